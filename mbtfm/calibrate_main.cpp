/// mbtfm-calibrate: which regularisation gives FTTC the total forces of the model-based fit (thesis fig. 3.8, 3.9).
#include "mbtfm/tractions/calibration.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::tractions {
namespace {

// From hardly smoothed to hardly a traction left: a cell's adhesions are some 0.1 to 10 um apart.
constexpr double kLargest_um = 30, kSmallest_um = 0.1;

struct Cells {
  std::vector<FittedCell> fitted;
  int n_not_converged = 0;  ///< whose fit has no result to compare with
};

/// The folders that hold a displacement and a fit, in alphabetical order.
Cells read_cells(stage::StageContext& context) {
  const Path folder = context.input("cells", {});
  std::vector<Path> paths;
  for (const Path& entry : files::visible_in(folder))
    if (files::is_own_file(entry / "4_fit/fit.json")) paths.push_back(entry);
  Cells cells;
  for (const Path& path : paths) {
    files::check_cell_folder(path);
    const FitSummary fit = files::read_fit_summary(path / "4_fit/fit.json");
    if (!fit.converged) {
      ++cells.n_not_converged;
      continue;
    }
    const std::string name = path.filename().string();
    context.input("cells", {name + "/cell.toml", name + "/2_track/displacement.csv", name + "/1_segment/outline.csv",
                            name + "/4_fit/fit.json"});
    FittedCell cell;
    cell.name = name;
    stage::ParameterList list;
    declare(list, cell.inputs.gel);
    stage::read_toml(list, path / "cell.toml");
    cell.inputs.beads = files::read_displacement(path / "2_track/displacement.csv");
    std::erase_if(cell.inputs.beads, [](const Bead& bead) { return !bead.flag.empty(); });
    cell.inputs.outline_um = files::read_outline(path / "1_segment/outline.csv").front();
    cell.fitted_force_nN = fit.total_force_nN;
    cells.fitted.push_back(std::move(cell));
  }
  if (cells.fitted.size() < 2) {
    throw InputError(folder.string(), "at least two cell folders with a converged 4_fit/fit.json",
                     std::to_string(cells.fitted.size()));
  }
  return cells;
}

void write_tables(stage::StageContext& context, const std::vector<FittedCell>& cells,
                  const std::vector<Comparison>& series) {
  files::CsvText table({"length_um", "slope", "correlation", "n_cells"});
  files::CsvText by_cell({"cell", "length_um", "fttc_total_force_nN", "fit_total_force_nN"});
  for (const Comparison& s : series) {
    table.add(s.length_um).add(s.slope).add(s.correlation).add(static_cast<int>(cells.size())).end_row();
    for (std::size_t c = 0; c < cells.size(); ++c)
      by_cell.add(cells[c].name).add(s.length_um).add(s.fttc_nN[c]).add(cells[c].fitted_force_nN).end_row();
  }
  files::write_text(context.output("out"), table.str());
  files::write_text(context.output_beside("out", "_cells.csv"), by_cell.str());
}

StageReport calibrate(const TractionParameters& p, stage::StageContext& context) {
  const auto [cells, n_not_converged] = read_cells(context);
  const std::vector<double> lengths_um = lambdas_between(kLargest_um, kSmallest_um);
  const std::vector<Comparison> series = compared(cells, lengths_um, p, context.threads);
  write_tables(context, cells, series);
  const std::optional<double> slope_one_um = length_of_slope_one_um(series);
  files::write_text(context.output_beside("out", ".svg"), charts_of(cells, series));
  StageReport report;
  report.summary = std::to_string(cells.size()) + " cells";
  if (slope_one_um) {
    report.figures.emplace_back("length_of_slope_one_um", *slope_one_um);
    report.summary += ": FTTC gives the forces of the fit at lambda E = " + brief(*slope_one_um) + " um";
  } else {
    report.summary += ": no lambda between " + brief(kSmallest_um) + " and " + brief(kLargest_um) +
                      " um gives FTTC the forces of the fit";
  }
  if (n_not_converged > 0)
    report.summary += "; " + std::to_string(n_not_converged) + " left out, whose fit has not converged";
  return report;
}

}  // namespace
}  // namespace mbtfm::tractions

int main(int argc, char** argv) {
  using mbtfm::stage::FileArgument;
  using namespace mbtfm::tractions;
  return mbtfm::stage::run_stage<TractionParameters>(
      {.name = "calibrate", .files = {{"cells", FileArgument::Kind::input}, {"out", FileArgument::Kind::output}}}, argc,
      argv, calibrate);
}
