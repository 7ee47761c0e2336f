#include "pipeline/report/space_results.h"

#include <nlohmann/json.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/json_record.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::report {
namespace {

Vec3 vector_in(const files::CsvTable& table, int row, const char* x, const char* y, const char* z) {
  return {table.number(row, x), table.number(row, y), table.number(row, z)};
}

std::vector<SurfaceTraction> read_tractions(const Path& file) {
  const files::CsvTable table(file);
  table.require({"x_um", "y_um", "z_um", "tx_kPa", "ty_kPa", "tz_kPa", "normal_kPa", "tangential_kPa", "area_um2",
                 "sigma_tx_kPa", "sigma_ty_kPa", "sigma_tz_kPa", "resolution_um"});
  std::vector<SurfaceTraction> list;
  for (int row = 0; row < table.n_rows(); ++row) {
    SurfaceTraction& t = list.emplace_back();
    t.at_um = vector_in(table, row, "x_um", "y_um", "z_um");
    t.traction_kPa = vector_in(table, row, "tx_kPa", "ty_kPa", "tz_kPa");
    t.normal_kPa = table.number(row, "normal_kPa");
    t.tangential_kPa = table.number(row, "tangential_kPa");
    t.area_um2 = table.number(row, "area_um2");
    t.resolution_um = table.optional_number(row, "resolution_um");
    const auto x = table.optional_number(row, "sigma_tx_kPa"), y = table.optional_number(row, "sigma_ty_kPa"),
               z = table.optional_number(row, "sigma_tz_kPa");
    if (x && y && z) t.sigma_kPa = Vec3{*x, *y, *z};
  }
  if (list.size() < 4) throw InputError(file.string(), "tractions at four places or more", std::to_string(list.size()));
  return list;
}

std::vector<ForceInSpace> read_forces(const Path& file) {
  if (!files::is_own_file(file)) return {};
  const files::CsvTable table(file);
  table.require({"adhesion_id", "x_um", "y_um", "z_um", "fx_nN", "fy_nN", "fz_nN", "area_um2", "sigma_nN"});
  std::vector<ForceInSpace> list;
  for (int row = 0; row < table.n_rows(); ++row) {
    list.push_back({.adhesion_id = table.integer(row, "adhesion_id", 1),
                    .at_um = vector_in(table, row, "x_um", "y_um", "z_um"),
                    .force_nN = vector_in(table, row, "fx_nN", "fy_nN", "fz_nN"),
                    .area_um2 = table.number(row, "area_um2"),
                    .sigma_nN = table.optional_number(row, "sigma_nN")});
  }
  return list;
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
  results.tractions = read_tractions(cell / "4_traction/traction.csv");
  results.forces = read_forces(cell / "4_traction/traction_adhesion_forces.csv");
  if (!results.forces.empty()) results.adhesions = files::read_adhesions(cell / "1_segment/adhesions.csv");
  if (files::is_own_file(cell / "1_segment/outline.csv"))
    results.outline_um = files::read_outline(cell / "1_segment/outline.csv").front();
  read_figures(cell / "4_traction/traction.json", results);
  return results;
}

}  // namespace mbtfm::report
