#include "samples/plan/parameters.h"

#include <algorithm>
#include <sstream>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/parsed.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::plan {

namespace {

constexpr std::size_t kMostNumbers = 12;  // of a list: curves of more cannot be distinguished

/// None if the text is anything else.
std::optional<double> as_number(std::string_view text) {
  return parsed<double>(text.substr(text.starts_with('+') ? 1 : 0));
}

double number_in(const std::string& name, const std::string& text, const Range& range) {
  const std::optional<double> value = as_number(text);
  if (!value || !is_inside(range, *value))
    throw UsageError(name + ": expected " + describe("numbers", range) + " with commas between them, found '" + text +
                     "'");
  return *value;
}

/// Ascending, each once.
std::vector<double> numbers_in(const std::string& name, const std::string& list, const Range& range) {
  std::vector<double> numbers;
  std::istringstream texts(list);
  for (std::string text; std::getline(texts, text, ',');) {
    std::erase(text, ' ');
    const double value = number_in(name, text, range);
    if (std::ranges::find(numbers, value) == numbers.end()) numbers.push_back(value);
  }
  if (numbers.empty()) throw UsageError(name + ": expected at least one number, found none");
  if (numbers.size() > kMostNumbers)
    throw UsageError(name + ": expected at most " + std::to_string(kMostNumbers) + " numbers, found " +
                     std::to_string(numbers.size()));
  return numbers;
}

double share_in(const std::string& name, std::string text) {
  std::erase(text, ' ');
  const bool is_percent = text.ends_with('%');
  const std::optional<double> number = as_number(is_percent ? text.substr(0, text.size() - 1) : text);
  const Range shares = Range::between(0.001, 10);
  if (number && is_inside(shares, *number / (is_percent ? 100 : 1))) return *number / (is_percent ? 100 : 1);
  const bool is_percent_meant = !is_percent && number && is_inside(shares, *number / 100);
  throw UsageError(name +
                   ": expected a share from 0.001 to 10 (0.2), or a percentage from 0.1% to 1000% (20%), found '" +
                   text + "'" + (is_percent_meant ? ". Did you mean " + text + "%?" : ""));
}

}  // namespace

void declare(stage::ParameterList& list, Parameters& p) {
  list.table("plan");
  list.add("scenario", p.scenario);
  list.add("seed", p.seed);
  list.add("noise_um", p.noise_um);
  list.add("beads_per_um2", p.beads_per_um2);
  list.add("beads_per_um3", p.beads_per_um3);
  list.add("axial_noise", p.axial_noise, Range::factor());
  list.add("youngs_modulus_kPa", p.youngs_modulus_kPa);
  list.add("tension_nN", p.tension_nN, Range::force_nN());
  list.add("within", p.within);
  list.add("drawn", p.drawn, Range::between(0, 100));
  list.add("between_cells", p.between_cells, Range::between(0, 10));
  list.add("difference", p.difference, Range::between(0.01, 100));
  list.add("power", p.power, Range::between(0.06, 0.999));
}

Asked asked_by(const Parameters& p, double own_kPa) {
  Asked asked;
  asked.noise_um = numbers_in("noise_um", p.noise_um, Range::between(1e-5, 10));
  asked.densities = p.beads_per_um3.empty() ? numbers_in("beads_per_um2", p.beads_per_um2, Range::between(1e-4, 25))
                                            : numbers_in("beads_per_um3", p.beads_per_um3, Range::between(1e-6, 10));
  asked.youngs_modulus_kPa = p.youngs_modulus_kPa.empty()
                                 ? std::vector<double>{0.5 * own_kPa, own_kPa, 2 * own_kPa}
                                 : numbers_in("youngs_modulus_kPa", p.youngs_modulus_kPa, Range::modulus_kPa());
  std::ranges::sort(asked.densities);
  std::ranges::sort(asked.youngs_modulus_kPa);
  asked.within = share_in("within", p.within);
  asked.tension_nN = p.tension_nN.value_or(1);
  asked.target_nN = asked.within * asked.tension_nN;
  return asked;
}

}  // namespace mbtfm::plan
