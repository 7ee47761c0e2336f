/// mbtfm-calibrate: which regularisation gives FTTC the total forces of the model-based fit (thesis fig. 3.8, 3.9).
#include <algorithm>
#include <cmath>

#include "mbtfm/fttc.h"
#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/parallel.h"
#include "pipeline/contract/stage.h"

namespace mbtfm::inverse {
namespace {

// From hardly smoothed to hardly a traction left: a cell's adhesions are some 0.1 to 10 um apart.
constexpr double kLargest_um = 30, kSmallest_um = 0.1;

struct FittedCell {
  TractionInputs inputs;
  double fitted_force_nN = 0;
};

/// The folders that hold a displacement and a finished fit, in alphabetical order.
std::vector<FittedCell> read_cells(StageContext& context) {
  const Path folder = context.input("cells", {});
  std::vector<Path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (std::filesystem::exists(entry.path() / "4_fit/fit.json")) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  std::vector<FittedCell> cells;
  for (const Path& path : paths) {
    const std::string name = path.filename().string();
    context.input("cells", {name + "/cell.toml", name + "/2_track/displacement.csv", name + "/1_segment/outline.csv",
                            name + "/4_fit/fit.json"});
    FittedCell cell;
    ParameterList list;
    declare(list, cell.inputs.gel);
    read_toml(list, path / "cell.toml");
    cell.inputs.beads = read_displacement(path / "2_track/displacement.csv");
    std::erase_if(cell.inputs.beads, [](const Bead& bead) { return !bead.flag.empty(); });
    cell.inputs.outline_um = read_outline(path / "1_segment/outline.csv").front();
    cell.fitted_force_nN = read_fit_summary(path / "4_fit/fit.json").total_force_nN;
    cells.push_back(std::move(cell));
  }
  if (cells.size() < 2) {
    throw InputError(folder.string(), "at least two cell folders with 4_fit/fit.json", std::to_string(cells.size()));
  }
  return cells;
}

/// Total FTTC force of a cell for each length lambda E.
std::vector<double> total_forces_nN(const FittedCell& cell, const std::vector<double>& lengths_um,
                                    const TractionParameters& parameters) {
  const LatticeProblem problem(cell.inputs.beads, cell.inputs.gel, lattice_options(parameters, 1));
  TikhonovSolver solver(problem);
  std::vector<double> totals;
  for (const double length_um : lengths_um) {
    solver.solve(length_um / cell.inputs.gel.youngs_modulus_kPa, 1e-2);  // a per cent of the energy: less of the sum
    Reconstruction r;
    r.patches = patches_of(problem, tractions_kPa(problem, solver.solution(), ReadOut::cells, parameters.gaussian_um),
                           problem.transform().no_field());
    totals.push_back(sums_of(r, cell.inputs, parameters.grow_um).total_force_nN);
  }
  return totals;
}

/// FTTC's forces over the fit's: y = slope x, and the correlation of the two.
struct Line {
  double slope = 0, correlation = 0;
};

Line line_of(const std::vector<double>& x, const std::vector<double>& y) {
  double xx = 0, xy = 0, mean_x = 0, mean_y = 0, vx = 0, vy = 0, cov = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += x[i] * x[i];
    xy += x[i] * y[i];
    mean_x += x[i] / static_cast<double>(x.size());
    mean_y += y[i] / static_cast<double>(x.size());
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    vx += (x[i] - mean_x) * (x[i] - mean_x);
    vy += (y[i] - mean_y) * (y[i] - mean_y);
    cov += (x[i] - mean_x) * (y[i] - mean_y);
  }
  return {.slope = xx > 0 ? xy / xx : 0, .correlation = vx * vy > 0 ? cov / std::sqrt(vx * vy) : 0};
}

StageReport calibrate(const TractionParameters& p, StageContext& context) {
  const std::vector<FittedCell> cells = read_cells(context);
  const std::vector<double> lengths_um = lambdas_between(kLargest_um, kSmallest_um);
  std::vector<std::vector<double>> totals(cells.size());
  parallel_for(static_cast<int>(cells.size()), context.threads, [&](int c) {
    const auto i = static_cast<std::size_t>(c);
    totals[i] = total_forces_nN(cells[i], lengths_um, p);
  });
  std::vector<double> fitted;
  for (const FittedCell& cell : cells) fitted.push_back(cell.fitted_force_nN);
  CsvText csv({"length_um", "slope", "correlation", "n_cells"});
  std::vector<Line> lines;
  for (std::size_t l = 0; l < lengths_um.size(); ++l) {
    std::vector<double> fttc;
    for (const auto& of_cell : totals) fttc.push_back(of_cell[l]);
    lines.push_back(line_of(fitted, fttc));
    csv.add(lengths_um[l]).add(lines[l].slope).add(lines[l].correlation).add(static_cast<int>(cells.size())).end_row();
  }
  write_text(context.output("out"), csv.str());
  StageReport report{
      .converged = true, .summary = std::to_string(cells.size()) + " cells", .figures = {}, .effects = {}};
  for (std::size_t l = 1; l < lines.size(); ++l) {  // the slope grows as lambda falls
    if (lines[l - 1].slope > 1 || lines[l].slope <= 1) continue;
    const double share = (1 - lines[l - 1].slope) / (lines[l].slope - lines[l - 1].slope);
    const double length_um = lengths_um[l - 1] * std::pow(lengths_um[l] / lengths_um[l - 1], share);
    report.figures.emplace_back("length_of_slope_one_um", length_um);
    report.summary += ": FTTC gives the forces of the fit at lambda E = " + brief(length_um) + " um, correlation " +
                      brief(lines[l].correlation);
    return report;
  }
  report.summary += ": no lambda between " + brief(kSmallest_um) + " and " + brief(kLargest_um) +
                    " um gives FTTC the forces of the fit";
  return report;
}

}  // namespace
}  // namespace mbtfm::inverse

int main(int argc, char** argv) {
  using mbtfm::FileArgument;
  using namespace mbtfm::inverse;
  return mbtfm::run_stage<TractionParameters>(
      {.name = "calibrate",
       .purpose = "compare FTTC's total forces with the fit's over finished cells, for a series of lambdas",
       .files = {{"cells", FileArgument::Kind::input, "folder of cell folders with 4_fit/fit.json"},
                 {"out", FileArgument::Kind::output, "calibration.csv: slope and correlation by lambda E"}}},
      argc, argv, calibrate);
}
