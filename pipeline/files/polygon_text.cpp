#include "pipeline/files/polygon_text.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/parsed.h"

namespace mbtfm::files {
namespace {

constexpr std::string_view kBlank = " \t\r\n\v\f";

}  // namespace

std::vector<std::string_view> TextRest::line() {
  const std::size_t end = rest_.find('\n');
  std::string_view line = rest_.substr(0, end);
  rest_.remove_prefix(end == rest_.npos ? rest_.size() : end + 1);
  ++line_;
  std::vector<std::string_view> words;
  for (std::size_t at = line.find_first_not_of(kBlank); at != line.npos; at = line.find_first_not_of(kBlank, at)) {
    const std::size_t stop = std::min(line.find_first_of(kBlank, at), line.size());
    words.push_back(line.substr(at, stop - at));
    at = stop;
  }
  return words;
}

std::string_view TextRest::word() {
  std::size_t at = 0;
  for (; at < rest_.size() && kBlank.find(rest_[at]) != kBlank.npos; ++at) {
    line_ += is_new_line_;
    is_new_line_ = rest_[at] == '\n';
  }
  line_ += is_new_line_ && at < rest_.size();
  is_new_line_ = is_new_line_ && at == rest_.size();
  const std::size_t stop = std::min(rest_.find_first_of(kBlank, at), rest_.size());
  const std::string_view word = rest_.substr(at, stop - at);
  rest_.remove_prefix(stop);
  return word;
}

std::string_view TextRest::bytes(std::size_t n) {
  if (n > rest_.size())
    throw InputError(name_, std::to_string(n) + " more bytes", "the end of the file", "the file may be cut short");
  const std::string_view taken = rest_.substr(0, n);
  rest_.remove_prefix(n);
  return taken;
}

double number_of(std::string_view word, const std::string& where) {
  constexpr std::size_t kShown = 40;
  std::string_view digits = word;
  if (digits.starts_with('+')) digits.remove_prefix(1);
  const auto value = parsed<double>(digits);
  if (value && std::isfinite(*value)) return *value;
  throw InputError(where, "a finite number",
                   word.empty() ? "the end of the file" : "'" + std::string(word.substr(0, kShown)) + "'");
}

int index_of(double value, const std::string& where) {
  const bool is_one = value >= 0 && value <= std::numeric_limits<int>::max() && value == std::floor(value);
  if (!is_one) throw InputError(where, "a whole number from 0 on", shortest(value));
  return static_cast<int>(value);
}

void add_polygon(const std::vector<int>& corners, const std::string& where, TriangleMesh& mesh) {
  if (corners.size() < 3) throw InputError(where, "three or more corners", std::to_string(corners.size()));
  for (std::size_t k = 2; k < corners.size(); ++k) mesh.triangles.push_back({corners[0], corners[k - 1], corners[k]});
}

}  // namespace mbtfm::files
