#include "pipeline/report/results.h"

#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/own_files.h"
#include "pipeline/contract/parameters.h"

namespace mbtfm::report {
namespace fs = std::filesystem;
namespace {

/// Both files hold the unflagged beads in the same order. @throws InputError where they do not
std::optional<Residual> residual_of(const DisplacementField& measured, const Path& fitted_file) {
  if (!is_own_file(fitted_file)) return {};
  const DisplacementField fitted = read_displacement(fitted_file);
  Residual residual;
  for (const Bead& bead : measured) {
    if (!bead.flag.empty()) continue;
    const std::size_t i = residual.positions_um.size();
    if (i >= fitted.size() || !(fitted[i].position_um == bead.position_um)) {
      throw InputError(fitted_file.string(), "the beads of 2_track/displacement.csv", "others",
                       "run the fit again: mbtfm run --redo fit");
    }
    residual.positions_um.push_back(bead.position_um);
    residual.residual_um.push_back(bead.displacement_um - fitted[i].displacement_um);
  }
  return residual;
}

std::optional<Images> images_of(const Path& segmentation) {
  const Path file = segmentation / "images.jpg", place = segmentation / "images.csv";
  if (!is_own_file(file) || !is_own_file(place)) return {};
  const CsvTable table(place);
  if (table.n_rows() != 1) throw InputError(place.string(), "one row", std::to_string(table.n_rows()));
  const Vec2 low_um{table.number(0, "x_um"), table.number(0, "y_um")};
  return Images{file, low_um, low_um + Vec2{table.number(0, "width_um"), table.number(0, "height_um")}};
}

}  // namespace

CellResults read_results(const Path& cell) {
  check_cell_folder(cell);
  CellResults results;
  results.folder = cell;
  results.name = fs::weakly_canonical(cell).filename().string();
  ParameterList list;
  declare(list, results.gel);
  read_toml(list, cell / "cell.toml");
  results.cell = read_cell(cell / "1_segment");
  results.displacement = read_displacement(cell / "2_track/displacement.csv");
  results.network = read_network(cell / "3_network/network.vtu");
  results.contracted = read_contracted_network(cell / "4_fit/contracted.vtu");
  for (const Tension& tension : read_tensions(cell / "4_fit/tensions.csv"))
    results.tensions[tension.fibre_id] = tension;
  results.forces = read_adhesion_forces(cell / "4_fit/adhesion_forces.csv");
  results.fit = read_fit_summary(cell / "4_fit/fit.json");
  results.residual = residual_of(results.displacement, cell / "4_fit/fitted_displacement.csv");
  if (has_truth(cell)) results.comparison = compare_with_truth(cell);
  results.images = images_of(cell / "1_segment");
  return results;
}

std::map<int, const Adhesion*> adhesions_by_id(const Cell& cell) {
  std::map<int, const Adhesion*> by_id;
  for (const Adhesion& adhesion : cell.adhesions) by_id[adhesion.adhesion_id] = &adhesion;
  return by_id;
}

}  // namespace mbtfm::report
