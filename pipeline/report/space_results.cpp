#include "pipeline/report/space_results.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/json_record.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/space_files.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::report {
namespace {

constexpr const char* kTruth = "truth/surface_traction.csv";

std::vector<Vec2> from_above(const std::vector<Vec3>& places) {
  std::vector<Vec2> seen;
  for (const Vec3& at : places) seen.push_back({at.x, at.y});
  return seen;
}

Vec3 vector_in(const files::CsvTable& table, int row, const char* x, const char* y, const char* z) {
  return {table.number(row, x), table.number(row, y), table.number(row, z)};
}

void read_figures(const Path& file, SpaceResults& results) {
  const files::JsonRecord summary(file, "a summary as mbtfm-traction writes it",
                                  "run again: mbtfm run --redo traction");
  for (const auto& [name, value] : summary.members()) {
    if (value.json().is_string()) results.texts[name] = value.text();
    if (value.json().is_number()) results.numbers[name] = value.number();
  }
}

}  // namespace

double SpaceResults::number(const std::string& key) const {
  if (const auto value = find(key)) return *value;
  throw InputError((folder / "4_traction/traction.json").string(), "a number '" + key + "'", "none",
                   "run again: mbtfm run --redo traction");
}

std::optional<double> SpaceResults::find(const std::string& key) const {
  const auto found = numbers.find(key);
  return found == numbers.end() ? std::nullopt : std::optional(found->second);
}

Vec3 SpaceResults::vector(const std::string& key, const std::string& unit) const {
  return {number(key + "_x_" + unit), number(key + "_y_" + unit), number(key + "_z_" + unit)};
}

SpaceResults read_space_results(const Path& cell) {
  files::check_cell_folder(cell);
  SpaceResults results;
  results.folder = cell;
  results.name = fs::weakly_canonical(cell).filename().string();
  stage::ParameterList list;
  declare(list, results.gel);
  stage::read_toml(list, cell / "cell.toml");
  results.surface = files::read_surface(cell / "3_surface/surface.vtp");
  results.beads = files::read_displacement_in_space(cell / kBeadsInSpace);
  const Path tractions = cell / "4_traction/traction.csv", forces = cell / "4_traction/traction_adhesion_forces.csv";
  results.tractions = files::read(tractions, files::surface_traction_table());
  if (results.tractions.size() < 4)
    throw InputError(tractions.string(), "tractions at four places or more", std::to_string(results.tractions.size()));
  if (files::is_own_file(forces)) results.forces = files::read(forces, files::part_force_table());
  if (!results.forces.empty()) results.adhesions = files::read_adhesions(cell / "1_segment/adhesions.csv");
  if (files::is_own_file(cell / "1_segment/outline.csv"))
    results.outline_um = files::read_outline(cell / "1_segment/outline.csv").front();
  read_figures(cell / "4_traction/traction.json", results);
  return results;
}

SpaceMap map_of(const SpaceResults& results) {
  SpaceMap map;
  map.total_force_nN = results.number("total_force_nN");
  double errors = 0, size = 0;
  bool has_errors = true;
  for (const SurfaceTraction& t : results.tractions) {
    map.at_um.push_back(t.position_um);
    map.traction_kPa.push_back(t.traction_kPa);
    map.area_um2.push_back(t.area_um2);
    size += t.area_um2 * dot(t.traction_kPa, t.traction_kPa);
    has_errors = has_errors && t.sigma_kPa;
    if (t.sigma_kPa) errors += t.area_um2 * dot(*t.sigma_kPa, *t.sigma_kPa);
  }
  if (has_errors && size > 0) map.stated_error = std::sqrt(errors / size);
  return map;
}

double largest_kPa(const SpaceMap& map) {
  double largest = 0;
  for (const Vec3& t : map.traction_kPa) largest = std::max(largest, norm(t));
  return largest;
}

bool has_space_truth(const Path& cell) { return files::is_own_file(cell / kTruth); }

SpaceMap true_space_map(const Path& cell) {
  const files::CsvTable table(cell / kTruth);
  table.require({"x_um", "y_um", "z_um", "nz", "tx_kPa", "ty_kPa", "tz_kPa"});
  SpaceMap map;
  for (int row = 0; row < table.n_rows(); ++row) {
    map.at_um.push_back(vector_in(table, row, "x_um", "y_um", "z_um"));
    map.traction_kPa.push_back(vector_in(table, row, "tx_kPa", "ty_kPa", "tz_kPa"));
    map.area_um2.push_back(1 / std::abs(table.number(row, "nz")));
  }
  const Vec2 step_um = files::lattice_spacing_um(from_above(map.at_um), cell / kTruth);
  for (std::size_t k = 0; k < map.at_um.size(); ++k) {
    map.area_um2[k] *= step_um.x * step_um.y;
    map.total_force_nN += map.area_um2[k] * norm(map.traction_kPa[k]);
  }
  return map;
}

TractionsBetween::TractionsBetween(const SpaceMap& map) {
  const std::vector<Vec2> places = from_above(map.at_um);
  const Vec2 gap = files::lattice_spacing_um(places, "map of tractions");
  const auto [low, high] = extent_of(places);
  origin_um_ = low;
  last_ = {std::round((high.x - low.x) / gap.x), std::round((high.y - low.y) / gap.y)};
  spacing_um_ = {(high.x - low.x) / last_.x, (high.y - low.y) / last_.y};
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Vec2 p = in_steps(places[k]);
    traction_kPa_[{std::lround(p.x), std::lround(p.y)}] = map.traction_kPa[k];
  }
}

Vec2 TractionsBetween::in_steps(Vec2 place_um) const {
  return {(place_um.x - origin_um_.x) / spacing_um_.x, (place_um.y - origin_um_.y) / spacing_um_.y};
}

TractionsBetween::Found TractionsBetween::at(Vec2 place_um) const {
  constexpr double kRounding = 1e-6;  // files have nine digits
  const Vec2 p = in_steps(place_um);
  if (std::min(p.x, p.y) < -kRounding || p.x > last_.x + kRounding || p.y > last_.y + kRounding) return {};
  const double i = std::clamp(std::floor(p.x), 0.0, last_.x - 1), j = std::clamp(std::floor(p.y), 0.0, last_.y - 1);
  Found found{.is_whole = true};
  for (const int right : {0, 1}) {
    for (const int down : {0, 1}) {
      const auto corner = traction_kPa_.find({std::lround(i) + right, std::lround(j) + down});
      const double share = (right == 1 ? p.x - i : 1 - p.x + i) * (down == 1 ? p.y - j : 1 - p.y + j);
      if (corner == traction_kPa_.end())
        found.is_whole = false;
      else
        found.traction_kPa += share * corner->second;
    }
  }
  return found;
}

double difference(const SpaceMap& map, const SpaceMap& reference) {
  const TractionsBetween found(map);
  double wrong = 0, size = 0;
  for (std::size_t k = 0; k < reference.at_um.size(); ++k) {
    const Vec3 off = found.at({reference.at_um[k].x, reference.at_um[k].y}).traction_kPa - reference.traction_kPa[k];
    wrong += reference.area_um2[k] * dot(off, off);
    size += reference.area_um2[k] * dot(reference.traction_kPa[k], reference.traction_kPa[k]);
  }
  return size > 0 ? std::sqrt(wrong / size) : 0;
}

}  // namespace mbtfm::report
