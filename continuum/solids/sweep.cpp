#include "continuum/solids/sweep.h"

#include <array>
#include <cmath>
#include <sstream>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/parsed.h"
#include "pipeline/contract/words.h"

namespace mbtfm::solids {
namespace {

enum class Swept { height_um, modulus_ratio };
constexpr auto words(Swept) { return std::array{"height_um", "modulus_ratio"}; }

constexpr int kMostValues = 1000;  // of a list: a map of a million cases is a slip

std::vector<std::string> parts_of(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, at);) {
    const auto first = part.find_first_not_of(' '), last = part.find_last_not_of(' ');
    parts.push_back(first == part.npos ? std::string() : part.substr(first, last - first + 1));
  }
  return parts;
}

[[noreturn]] void refuse(const std::string& name, const std::string& found) {
  throw UsageError(name +
                   ": expected numbers as in 0.1, 0.5, 1 or a range as in 5.3..15.8:11 (from, to, how many), found '" +
                   found + "'");
}

}  // namespace

std::vector<double> values_in(const std::string& text, const std::string& name, Zero zero) {
  std::vector<double> values;
  if (const auto dots = text.find(".."); dots != text.npos) {
    const auto colon = text.find(':', dots);
    if (colon == text.npos) refuse(name, text);
    const auto low = parsed<double>(text.substr(0, dots)),
               high = parsed<double>(text.substr(dots + 2, colon - dots - 2));
    const int n = parsed<int>(text.substr(colon + 1)).value_or(0);
    if (!low || !high || !(*high > *low) || n < 2 || n > kMostValues) refuse(name, text);
    for (int k = 0; k < n; ++k) values.push_back(*low + (*high - *low) * k / (n - 1));
  } else {
    for (const std::string& part : parts_of(text, ',')) {
      const auto value = parsed<double>(part);
      if (!value || std::ssize(values) == kMostValues) refuse(name, text);
      values.push_back(*value);
    }
  }
  if (values.empty()) refuse(name, text);
  for (const double value : values)
    if (!std::isfinite(value) || value < 0 || (value == 0 && zero == Zero::is_refused)) refuse(name, text);
  return values;
}

std::vector<Case> cases_of(const std::string& sweep, const Case& otherwise) {
  std::vector<double> heights = {otherwise.height_um}, ratios = {otherwise.modulus_ratio};
  std::istringstream stream(sweep);
  for (std::string word; stream >> word;) {
    const auto equals = word.find('=');
    const auto swept = named<Swept>(word.substr(0, equals));
    if (equals == word.npos || !swept)
      throw UsageError("sweep: expected height_um=... and modulus_ratio=..., found '" + word + "'");
    (*swept == Swept::height_um ? heights : ratios) =
        values_in(word.substr(equals + 1), std::string("sweep of ") + name_of(*swept), Zero::is_refused);
  }
  std::vector<Case> cases;
  for (const double ratio : ratios)
    for (const double height : heights) cases.push_back({height, ratio});
  return cases;
}

}  // namespace mbtfm::solids
