#include "pipeline/report/results.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/json_record.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/tables.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::report {
namespace {

/// Both files hold the unflagged beads in the same order. @throws InputError where they do not
std::optional<VectorField> residual_of(const DisplacementField& measured, const Path& fitted_file) {
  if (!files::is_own_file(fitted_file)) return {};
  const DisplacementField fitted = files::read_displacement(fitted_file);
  VectorField residual;
  for (const Bead& bead : measured) {
    if (!bead.flag.empty()) continue;
    const std::size_t i = residual.positions_um.size();
    if (i >= fitted.size() || !(fitted[i].position_um == bead.position_um)) {
      throw InputError(fitted_file.string(), "the beads of 2_track/displacement.csv", "others",
                       "run the fit again: mbtfm run --redo fit");
    }
    residual.positions_um.push_back(bead.position_um);
    residual.vectors.push_back(bead.displacement_um - fitted[i].displacement_um);
  }
  return residual;
}

/// A picture and the file that says where it lies.
std::optional<Images> images_of(const Path& file, const Path& place) {
  if (!files::is_own_file(file) || !files::is_own_file(place)) return {};
  const std::vector<files::ImagePlace> rows = files::read(place, files::image_place_table());
  if (rows.size() != 1) throw InputError(place.string(), "one row", std::to_string(rows.size()));
  return Images{file, {rows[0].low_um, rows[0].low_um + rows[0].size_um}};
}

/// Of a file that a fit of this version writes; none where it is not there.
template <class Row>
std::vector<Row> rows_in(const Path& file, const files::Table<Row>& table) {
  return files::is_own_file(file) ? files::read(file, table) : std::vector<Row>();
}

/// None of a fit of a version that did not ask the usual method.
std::optional<UsualMethod> usual_method_in(const Path& folder) {
  if (!files::is_own_file(folder / "fttc.json")) return {};
  const files::JsonRecord figures(folder / "fttc.json", "figures as mbtfm-fit writes them",
                                  "run the fit again: mbtfm run --redo fit");
  UsualMethod usual;
  usual.obstacle = figures.text_or("obstacle", "");
  if (!usual.obstacle.empty()) return usual;
  usual.total_force_nN = figures.at("total_force_nN").number();
  usual.lambda_by = figures.text_or("lambda_by", "");
  if (const auto lambda = figures.find("lambda_um_per_kPa")) usual.lambda_um_per_kPa = lambda->number();
  const files::CsvTable table(folder / "fttc.csv");
  table.require({"x_um", "y_um", "tx_kPa", "ty_kPa", "area_um2"});
  for (int row = 0; row < table.n_rows(); ++row) {
    usual.positions_um.push_back({table.number(row, "x_um"), table.number(row, "y_um")});
    usual.tractions_kPa.push_back({table.number(row, "tx_kPa"), table.number(row, "ty_kPa")});
  }
  if (table.n_rows() > 0) usual.spacing_um = std::sqrt(table.number(0, "area_um2", Range::size_um()));
  return usual;
}

std::vector<MissingFibre> missing_fibres_in(const Path& file, const Cell& cell) {
  const auto by_id = adhesions_by_id(cell);
  std::vector<MissingFibre> fibres = rows_in(file, files::missing_fibre_table());
  for (const MissingFibre& fibre : fibres) {
    for (const int id : {fibre.start_adhesion_id, fibre.end_adhesion_id}) {
      if (!by_id.contains(id))
        throw InputError(file.string(), "adhesions of 1_segment/adhesions.csv", "adhesion " + std::to_string(id),
                         "run the fit again: mbtfm run --redo fit");
    }
  }
  return fibres;
}

}  // namespace

CellResults read_results(const Path& cell) {
  files::check_cell_folder(cell);
  CellResults results;
  results.folder = cell;
  results.name = fs::weakly_canonical(cell).filename().string();
  stage::ParameterList list;
  declare(list, results.gel);
  stage::read_toml(list, cell / "cell.toml");
  results.cell = files::read_cell(cell / "1_segment");
  results.displacement = files::read_displacement(cell / "2_track/displacement.csv");
  results.network = files::read_network(cell / "3_network/network.vtu");
  results.contracted = files::read_contracted_network(cell / "4_fit/contracted.vtu");
  for (const Tension& tension : files::read_tensions(cell / "4_fit/tensions.csv"))
    results.tensions[tension.fibre_id] = tension;
  results.forces = files::read_adhesion_forces(cell / "4_fit/adhesion_forces.csv");
  results.fit = files::read_fit_summary(cell / "4_fit/fit.json");
  results.residual = residual_of(results.displacement, cell / "4_fit/fitted_displacement.csv");
  results.usual_method = usual_method_in(cell / "4_fit");
  if (has_truth(cell)) results.comparison = compare_with_truth(cell);
  results.images = images_of(cell / "1_segment/images.jpg", cell / "1_segment/images.csv");
  results.bead_images = images_of(cell / "2_track/beads.jpg", cell / "2_track/beads_picture.csv");
  results.missing_fibres = missing_fibres_in(cell / "4_fit/missing_fibres.csv", results.cell);
  results.missing_adhesions = rows_in(cell / "4_fit/missing_adhesions.csv", files::missing_adhesion_table());
  return results;
}

bool has_origin(const Cell& cell, AdhesionOrigin origin) {
  return std::ranges::find(cell.adhesions, origin, &Adhesion::origin) != cell.adhesions.end();
}

bool has_assumed(const Cell& cell) { return std::ranges::any_of(cell.adhesions, is_assumed, &Adhesion::origin); }

std::map<int, const Adhesion*> adhesions_by_id(const Cell& cell) {
  std::map<int, const Adhesion*> by_id;
  for (const Adhesion& adhesion : cell.adhesions) by_id[adhesion.adhesion_id] = &adhesion;
  return by_id;
}

std::optional<double> figure_of(const FitSummary& fit, std::string_view name) {
  for (const auto& [known, value] : fit.more) {
    if (known != name) continue;
    if (const auto* number = std::get_if<double>(&value)) return *number;
    if (const auto* count = std::get_if<std::int64_t>(&value)) return static_cast<double>(*count);
  }
  return {};
}

Balance balance_of(const CellResults& results) {
  const auto by_id = adhesions_by_id(results.cell);
  Vec2 centre;
  for (const Adhesion& adhesion : results.cell.adhesions)
    centre += (1.0 / static_cast<double>(results.cell.adhesions.size())) * adhesion.position_um;
  Vec2 net;
  double torque = 0, magnitudes = 0, lever = 0;
  bool has_moments = true;
  for (const AdhesionForce& force : results.forces) {
    const Vec2 arm = by_id.at(force.adhesion_id)->position_um - centre;
    net += force.force_nN;
    torque += cross(arm, force.force_nN) + force.moment_nN_um.value_or(0);
    has_moments = has_moments && force.moment_nN_um.has_value();
    magnitudes += norm(force.force_nN);
    lever += norm(arm) * norm(force.force_nN);
  }
  if (!(magnitudes > 0)) return {};
  const auto of_cut = [&](const char* name) { return figure_of(results.fit, name).value_or(0); };
  const Vec2 cut_nN{of_cut("cut_force_x_nN"), of_cut("cut_force_y_nN")};
  net += cut_nN;
  torque += of_cut("cut_torque_nN_um") - cross(centre, cut_nN);
  return {.net_force = norm(net) / magnitudes,
          .net_torque = lever > 0 ? std::abs(torque) / lever : 0,
          .has_moments = has_moments};
}

}  // namespace mbtfm::report
