#include "pipeline/stage/plausible.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/toml.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::stage {

extern const std::string_view kPlausible;  // plausible.toml

namespace {

constexpr const char* kPixelSize = "pixel_size_um";

const PlausibleQuantity* find(std::string_view id) {
  const auto& all = plausible_quantities();
  const auto found = std::ranges::find_if(all, [&](const PlausibleQuantity& q) { return q.id == id; });
  return found == all.end() ? nullptr : &*found;
}

const PlausibleQuantity& quantity_of(std::string_view id) {
  const PlausibleQuantity* quantity = find(id);
  MBTFM_ASSERT(quantity != nullptr);
  return *quantity;
}

/// "kPa" of "youngs_modulus_kPa"; empty where the name has no unit.
std::string unit_of(std::string_view id) {
  constexpr std::pair<const char*, const char*> kUnits[] = {
      {"_per_um2", "per um²"}, {"_kPa", "kPa"}, {"_um2", "um²"}, {"_um", "um"}, {"_nN", "nN"}};
  for (const auto& [suffix, unit] : kUnits)
    if (id.ends_with(suffix)) return unit;
  return {};
}

std::string with_unit(std::string_view id, const std::string& number) {
  const std::string unit = unit_of(id);
  return number + (unit.empty() ? "" : " " + unit);
}
/// Six digits: 8400, not 8.4e+03.
std::string with_unit(std::string_view id, double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return with_unit(id, text);
}

std::optional<double> value_of(const Parameter& p) {
  if (const auto* member = std::get_if<double*>(&p.member)) return **member;
  if (const auto* member = std::get_if<std::optional<double>*>(&p.member)) return **member;
  return std::nullopt;
}

std::string range_text(const Range& range) { return describe("", range); }

}  // namespace

namespace {

const toml::table& plausible_file() {
  static const toml::table file = files::parse_toml(kPlausible, "plausible.toml");
  return file;
}

}  // namespace

const std::vector<PlausibleQuantity>& plausible_quantities() {
  static const std::vector<PlausibleQuantity> table = [] {
    std::vector<PlausibleQuantity> all;
    for (const toml::node& node : *plausible_file()["quantity"].as_array()) {
      const toml::table& of = *node.as_table();
      const auto text = [&](const char* key) { return of[key].as_string()->get().c_str(); };
      const auto range = [&](const char* key) {
        return Range::between(of[key][0].value<double>().value(), of[key][1].value<double>().value());
      };
      all.push_back({text("id"), text("name"), range("usual"), range("possible"), text("source"), text("remedy")});
    }
    return all;
  }();
  return table;
}

std::optional<Doubt> doubt_about(std::string_view id, double value) {
  const PlausibleQuantity& q = quantity_of(id);
  if (is_inside(q.usual, value)) return std::nullopt;
  const bool is_possible = is_inside(q.possible, value);
  const Range& range = is_possible ? q.usual : q.possible;
  const std::string slip = unit_slip(id, value, q.usual);
  return Doubt{.id = q.id,
               .quantity = q.quantity,
               .value = value,
               .limit = value > range.high ? range.high : range.low,
               .source = q.source,
               .remedy = slip.empty() ? q.remedy : slip + "; " + q.remedy,
               .level = is_possible ? DoubtLevel::caution : DoubtLevel::refused};
}

namespace {

/// Or of an image's own calibration.
bool is_of_table(const Doubt& d) {
  const std::optional<Doubt> by_table = doubt_about(d.id, d.value);
  return by_table && by_table->limit == d.limit;
}

}  // namespace

std::string sentence_of(const Doubt& d) {
  if (!is_of_table(d))
    return "the " + d.quantity + " is " + with_unit(d.id, brief(d.value)) + ", but " + with_unit(d.id, brief(d.limit)) +
           " by the image's own calibration: both cannot be right";
  return "the " + d.quantity + " is " + with_unit(d.id, brief(d.value)) +
         (d.value > d.limit ? ", above " : ", below ") + brief(d.limit) +
         (d.level == DoubtLevel::refused ? ": it cannot be" : ": unusual");
}

void require_possible(const Doubt& d, const std::vector<std::string>& allowed, const std::string& where) {
  if (d.level != DoubtLevel::refused || std::ranges::find(allowed, d.id) != allowed.end()) return;
  const std::string expected = is_of_table(d) ? with_unit(d.id, describe("a number", quantity_of(d.id).possible))
                                              : "about " + with_unit(d.id, d.limit) + ", the image's own calibration";
  throw InputError(where, expected, with_unit(d.id, d.value),
                   d.remedy + ". " + d.source + ". If the value is right, set [checks] allow = [\"" + d.id + "\"]");
}

void declare(ParameterList& list, CheckParameters& p) {
  list.table("checks");
  list.add("allow", p.allow);
}

std::vector<std::string> allowed_quantities(const CheckParameters& p) {
  std::vector<std::string> names;
  std::string name;
  for (const char c : p.allow + ",") {
    if (c != ',' && c != ' ') {
      name += c;
      continue;
    }
    if (name.empty()) continue;
    if (!find(name)) {
      std::string known;
      for (const PlausibleQuantity& q : plausible_quantities())
        known += (known.empty() ? "" : ", ") + std::string(q.id);
      throw UsageError("[checks] allow: expected names out of " + known + ", found '" + name + "'");
    }
    names.push_back(std::exchange(name, {}));
  }
  return names;
}

std::vector<Doubt> doubts_about(const ParameterList& list, const std::vector<std::string>& allowed) {
  std::vector<Doubt> doubts;
  for (const Parameter& p : list.all()) {
    const std::optional<double> value = value_of(p);
    if (!value || !find(p.flag) || (*value == 0 && !p.is_set)) continue;  // left out: each cell may have its own
    const std::optional<Doubt> doubt = doubt_about(p.flag, *value);
    if (!doubt) continue;
    require_possible(*doubt, allowed, (p.table.empty() ? "" : "[" + p.table + "] ") + p.name);
    doubts.push_back(*doubt);
  }
  return doubts;
}

bool has_plausible_quantity(const ParameterList& list) {
  return std::ranges::any_of(list.all(), [](const Parameter& p) { return find(p.flag) != nullptr; });
}

std::optional<Doubt> doubt_about_pixel_size(double used_um, double of_file_um) {
  // Calibrations by a stage micrometer agree to a per cent; by a fifth none is wrong: then another objective, a binning
  // of the camera or a resized copy is meant. Forces go with the pixel size squared.
  constexpr double kCaution = 0.01, kRefused = 0.2;
  const double ratio = std::max(used_um, of_file_um) / std::min(used_um, of_file_um);
  if (!(ratio > 1 + kCaution)) return std::nullopt;
  const double whole = std::round(ratio);
  const bool is_binning = whole >= 2 && whole <= 16 && std::abs(ratio - whole) < kCaution * whole;
  return Doubt{.id = kPixelSize,
               .quantity = "pixel size",
               .value = used_um,
               .limit = of_file_um,
               .source = "The image's own calibration says " + with_unit(kPixelSize, of_file_um) +
                         ". Forces go with the square of the pixel size",
               .remedy = is_binning ? "the two differ by a factor of " + brief(whole) +
                                          ": the binning, or a reduced copy, may be left out in one of them"
                                    : "find out which is right, and leave pixel_size_um out if it is the image's",
               .level = ratio > 1 + kRefused ? DoubtLevel::refused : DoubtLevel::caution};
}

double traction_of_half_the_force_kPa(const std::vector<AdhesionForce>& forces,
                                      const std::vector<Adhesion>& adhesions) {
  MBTFM_ASSERT(forces.size() == adhesions.size());
  std::vector<Load> loads;
  for (std::size_t a = 0; a < forces.size(); ++a) {
    const double least_nN = std::max(0.0, norm(forces[a].force_nN) - 2 * forces[a].sigma_nN.value_or(0));
    loads.push_back({least_nN / area_stood_for_um2(adhesions[a]), least_nN});
  }
  return traction_of_half_the_force_kPa(std::move(loads));
}

double traction_of_half_the_force_kPa(std::vector<Load> loads) {
  std::ranges::sort(loads, std::greater(), &Load::traction_kPa);
  double total_nN = 0, sum_nN = 0;
  for (const Load& load : loads) total_nN += load.force_nN;
  for (const Load& load : loads) {
    sum_nN += load.force_nN;
    if (2 * sum_nN >= total_nN) return load.traction_kPa;
  }
  return 0;
}

double surest_fibre_tension_nN(const std::vector<Tension>& tensions) {
  double largest = 0;
  for (const Tension& t : tensions)
    if (t.fibre_id != 0) largest = std::max(largest, t.low_nN.value_or(t.tension_nN));
  return largest;
}

std::vector<AssumedInput> assumed_inputs(const ParameterList& list) {
  static const std::vector<AssumedInput> physical = {
      {"thickness_um", "thickness of the gel", "",
       "On a thinner gel the forces are larger than found, most of all those far apart."},
      {"poisson_ratio", "Poisson's ratio of the gel", "",
       "Between 0.45 and 0.5 the force for a given displacement changes by at most 6 %."}};
  std::vector<AssumedInput> assumed;
  for (const Parameter& p : list.all()) {
    if (p.is_set) continue;
    const auto known = std::ranges::find(physical, p.flag, &AssumedInput::id);
    const std::optional<double> value = value_of(p);
    if (known == physical.end() || !value) continue;
    assumed.push_back(*known);
    assumed.back().value = with_unit(p.name, *value);
  }
  return assumed;
}

AssumedInput assumed_noise(double sigma_um) {
  return {"sigma_um", "error of the displacements", with_unit("sigma_um", sigma_um),
          "It was estimated from neighbouring beads and is the same for all. Error bars go with it."};
}

std::string sentence_of(const AssumedInput& input) {
  return input.id + " = " + input.value + " (assumed: the " + input.quantity + " was not given)";
}

std::string plausible_page() {
  std::string page = plausible_file()["page"].as_string()->get();
  for (const PlausibleQuantity& q : plausible_quantities()) {
    page += "| `" + std::string(q.id) + "`: " + q.quantity + " |" + range_text(q.usual) + " |" +
            range_text(q.possible) + " | " + q.source + " | " + q.remedy + " |\n";
  }
  return page;
}

}  // namespace mbtfm::stage
