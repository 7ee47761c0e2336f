#include "pipeline/stage/plausible.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::stage {

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

const std::vector<PlausibleQuantity>& plausible_quantities() {
  static const std::vector<PlausibleQuantity> table = {
      {"youngs_modulus_kPa", "Young's modulus of the gel", Range::between(0.1, 100), Range::between(0.01, 1000),
       "Tissues have 0.1 kPa (brain) to 40 kPa (early bone): Discher, Janmey & Wang, Science 310 (2005) 1139; gels up "
       "to 100 kPa are in use. Above 1000 kPa the strongest adhesions (10 kPa, radius 1 um) move beads by only 20 nm "
       "(2.25 t a / E); below 0.01 kPa a gel does not keep its shape",
       "check the modulus and its unit, kPa"},
      {"poisson_ratio", "Poisson's ratio of the gel", Range::between(0.3, 0.5), Range::between(0, 0.5),
       "0.45 to 0.5 for polyacrylamide and silicone (Takigawa et al., Polym. Gels Netw. 4 (1996) 1: 0.457), as water "
       "has no time to leave. 0.5 is the limit of an elastic body",
       "take 0.49 for polyacrylamide, 0.5 or 0.499 for silicone"},
      {"thickness_um", "thickness of the gel", Range::between(10, 1000), Range::between(1, 1e5),
       "Gels are cast 20 to 100 um thick. Below 10 um the glass sets the displacements (Merkel et al., Biophys. J. 93 "
       "(2007) 3314); no high-resolution objective looks through 1000 um",
       "measure it by focusing on glass and surface; for a half-space set gel_model or the effect finite_thickness"},
      {kPixelSize, "pixel size", Range::between(0.02, 1.3), Range::between(0.005, 7),
       "Camera pixels of 2 to 16 um behind lenses of 10 to 100 times: 0.02 to 1.3 um; 7 um is a camera without a lens",
       "check it and its unit, um: the camera's pixel over the magnification, times the binning"},
      {"beads_per_um2", "density of the beads", Range::between(0.02, 10), Range::not_negative(),
       "Adhesions are some um apart: with less than one bead in 7 x 7 um forces cannot be separated (Sabass et al., "
       "Biophys. J. 94 (2008) 207). Above 10 a um² beads are nearer than the 0.3 um that a lens resolves, and share "
       "errors",
       "check the pixel size; use more beads, or thin an interpolated field out"},
      {"bead_sigma_um", "width (standard deviation) of the beads in the images", Range::between(0.075, 1),
       Range::between(0.01, 20),
       "A point looks at least 0.21 wavelengths over the aperture wide: 0.075 um at 515 nm and 1.45 (Zhang, Zerubia & "
       "Olivo-Marin, Appl. Opt. 46 (2007) 1819). 1 um is a bead of 4 um. Below 0.01 and above 20 um no microscope "
       "shows single beads",
       "check the pixel size: were the images binned or reduced later? Super-resolved beads may be smaller"},
      {"adhesion_area_um2", "median area of the adhesions", Range::between(0.1, 10), Range::between(0.01, 100),
       "Focal adhesions have 0.1 to 10 um² (mean 0.46 um² in U2OS: Soine et al., PLoS Comput. Biol. 11 (2015) "
       "e1004076). 0.01 um² is a sixth of what a lens resolves; 100 um² a small cell",
       "check the pixel size, the channel and the thresholds of [segment]"},
      {"cell_area_um2", "area of the cell", Range::between(200, 20000), Range::between(10, 1e6),
       "Adherent cells spread over 500 to 10 000 um², platelets over 30; 1 mm² is a colony",
       "check the pixel size, and whether the outline holds one cell"},
      {"total_force_nN", "total force of the cell", Range::between(1, 5000), Range::between(0, 1e5),
       "U2OS cells exert about 200 nN (3612 adhesions in 21 cells, 1.19 nN each: Soine et al. 2015). 5.5 kPa (Balaban "
       "et al. 2001) on a tenth of 10 000 um² are 5500 nN; 100 000 nN are twenty such cells",
       "check the modulus (kPa) and the pixel size (um); forces of several cells add up"},
      {"fibre_tension_nN", "tension of a stress fibre", Range::between(0, 150), Range::between(0, 400),
       "An isolated stress fibre breaks at 380 nN and carried about 10 nN in the cell (Deguchi, Ohashi & Sato, J. "
       "Biomech. 39 (2006) 2603)",
       "check the modulus (kPa), the pixel size (um), and whether a fibre is missing beside it"},
      {"traction_kPa", "traction of the adhesions that bear half of the force", Range::between(0, 15),
       Range::between(0, 100),
       "Adhesions carry 5.5 kPa (Balaban et al., Nat. Cell Biol. 3 (2001) 466), supermature ones 12 kPa (Goffin et "
       "al., J. Cell Biol. 172 (2006) 259). 100 kPa are 2500 bonds of 40 pN a um²",
       "check the modulus (kPa), the pixel size (um) and the adhesion's ellipse: too small an area makes a large "
       "traction"},
  };
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
    return "the " + d.quantity + " is " + with_unit(d.id, d.value) + ", but " + with_unit(d.id, d.limit) +
           " by the image's own calibration: both cannot be right";
  return "the " + d.quantity + " is " + with_unit(d.id, d.value) + (d.value > d.limit ? ", above " : ", below ") +
         brief(d.limit) + (d.level == DoubtLevel::refused ? ": it cannot be" : ": unusual");
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
  list.add("allow", p.allow,
           "quantities whose implausible values are accepted (docs/plausible.md), with commas between them or as an "
           "array. Example: \"poisson_ratio\"");
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
  std::string page =
      "# Plausible values\n\nThe programs check their inputs and their results against this table, which they write "
      "themselves. Outside the usual\nrange a value is a caution. Outside the possible range it is an error, unless "
      "`cell.toml` allows it:\n\n```toml\n[checks]\nallow = [\"youngs_modulus_kPa\"]\n```\n\n"
      "`pixel_size_um` is also compared with each image's own calibration: a difference above 1 % is a caution, above "
      "20 % an error.\nIf `thickness_um`, `poisson_ratio` or the errors of the displacements are not given, they are "
      "listed as assumed.\n\n| quantity | usual | possible | source | what to do |\n|---|---|---|---|---|\n";
  for (const PlausibleQuantity& q : plausible_quantities()) {
    page += "| `" + std::string(q.id) + "`: " + q.quantity + " |" + range_text(q.usual) + " |" +
            range_text(q.possible) + " | " + q.source + " | " + q.remedy + " |\n";
  }
  return page;
}

}  // namespace mbtfm::stage
