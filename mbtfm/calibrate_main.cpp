/// mbtfm-calibrate: which regularisation gives FTTC the total forces of the model-based fit (thesis fig. 3.8, 3.9).
#include <algorithm>
#include <cmath>

#include "mbtfm/tractions/fttc.h"
#include "pipeline/charts/chart.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::tractions {
namespace {

// From hardly smoothed to hardly a traction left: a cell's adhesions are some 0.1 to 10 um apart.
constexpr double kLargest_um = 30, kSmallest_um = 0.1;

struct FittedCell {
  std::string name;
  TractionInputs inputs;
  double fitted_force_nN = 0;
};

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

Line line_of(const Eigen::VectorXd& x, const Eigen::VectorXd& y) {
  const Eigen::VectorXd dx = x.array() - x.mean(), dy = y.array() - y.mean();
  const double variances = dx.squaredNorm() * dy.squaredNorm();
  return {.slope = x.squaredNorm() > 0 ? x.dot(y) / x.squaredNorm() : 0,
          .correlation = variances > 0 ? dx.dot(dy) / std::sqrt(variances) : 0};
}

/// The comparison over all cells, for one lambda.
struct Comparison {
  double length_um = 0;
  std::vector<double> fttc_nN;  ///< by cell
  Line line;
};

/// The length with slope one, between two of the series; the slope grows as lambda falls.
std::optional<double> length_of_slope_one_um(const std::vector<Comparison>& series) {
  for (std::size_t l = 1; l < series.size(); ++l) {
    const Comparison &before = series[l - 1], &after = series[l];
    if (before.line.slope > 1 || after.line.slope <= 1) continue;
    const double share = (1 - before.line.slope) / (after.line.slope - before.line.slope);
    return before.length_um * std::pow(after.length_um / before.length_um, share);
  }
  return std::nullopt;
}

std::string says(const Comparison& c) {
  return "ℓ = " + charts::readable(c.length_um) + " µm: slope " + charts::readable(c.line.slope) + ", r " +
         charts::readable(c.line.correlation);
}

constexpr const char* kOneToOne = "stroke:#333;stroke-width:1.6;stroke-dasharray:6 4";

/// FTTC's total force over the fit's, for some of the series and for slope one (thesis fig. 3.8).
charts::Chart forces_chart(const std::vector<FittedCell>& cells, const std::vector<Comparison>& shown) {
  double largest_fitted = 0, largest = 0;
  for (const FittedCell& cell : cells) largest_fitted = std::max(largest_fitted, 1.08 * cell.fitted_force_nN);
  for (const Comparison& c : shown)
    for (const double force : c.fttc_nN) largest = std::max({largest, 1.05 * force, c.line.slope * largest_fitted});
  charts::Chart chart("Total force of a cell", {"model-based fit (nN)", 0, largest_fitted, charts::Scale::linear},
                      {"FTTC (nN)", 0, std::max(largest, largest_fitted), charts::Scale::linear});
  chart.curve({{0, 0}, {largest_fitted, largest_fitted}}, kOneToOne);
  chart.put_key(charts::Chart::KeySide::left);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const std::string colour = charts::kColours[i % std::size(charts::kColours)];
    chart.curve({{0, 0}, {largest_fitted, shown[i].line.slope * largest_fitted}}, "stroke-width:1.2;stroke:" + colour);
    for (std::size_t c = 0; c < cells.size(); ++c)
      chart.dot({cells[c].fitted_force_nN, shown[i].fttc_nN[c]}, 4, "fill:" + colour, cells[c].name);
    chart.key(says(shown[i]), colour);
  }
  return chart;
}

/// Slope and correlation by lambda (thesis fig. 3.9).
charts::Chart slope_chart(const std::vector<Comparison>& series, std::optional<double> slope_one_um) {
  std::vector<double> lengths, slopes;
  std::vector<Vec2> by_slope, by_correlation;
  for (const Comparison& c : series) {
    lengths.push_back(c.length_um);
    slopes.push_back(c.line.slope);
    by_slope.push_back({c.length_um, c.line.slope});
    by_correlation.push_back({c.length_um, c.line.correlation});
  }
  slopes.push_back(1);
  charts::Chart chart("Slope and correlation", charts::axis_over("ℓ = λE (µm)", lengths, charts::Scale::logarithmic),
                      charts::axis_over("FTTC over fit", slopes, charts::Scale::logarithmic));
  chart.level(1, kOneToOne);
  if (slope_one_um) chart.upright(*slope_one_um, kOneToOne);
  chart.curve(by_slope, std::string("stroke-width:2;stroke:") + charts::kColours[0]);
  chart.curve(by_correlation, std::string("stroke-width:2;stroke:") + charts::kColours[1]);
  for (std::size_t i = 0; i < series.size(); ++i) {
    chart.dot(by_slope[i], 3, std::string("fill:") + charts::kColours[0], says(series[i]));
    chart.dot(by_correlation[i], 3, std::string("fill:") + charts::kColours[1], says(series[i]));
  }
  chart.subtitle(slope_one_um ? "slope one at ℓ = " + charts::readable(*slope_one_um) + " µm" : "slope one nowhere",
                 "#333");
  chart.key("slope", charts::kColours[0]);
  chart.key("correlation r", charts::kColours[1]);
  return chart;
}

void write_tables(stage::StageContext& context, const std::vector<FittedCell>& cells,
                  const std::vector<Comparison>& series) {
  files::CsvText table({"length_um", "slope", "correlation", "n_cells"});
  files::CsvText by_cell({"cell", "length_um", "fttc_total_force_nN", "fit_total_force_nN"});
  for (const Comparison& s : series) {
    table.add(s.length_um).add(s.line.slope).add(s.line.correlation).add(static_cast<int>(cells.size())).end_row();
    for (std::size_t c = 0; c < cells.size(); ++c)
      by_cell.add(cells[c].name).add(s.length_um).add(s.fttc_nN[c]).add(cells[c].fitted_force_nN).end_row();
  }
  files::write_text(context.output("out"), table.str());
  files::write_text(context.output_beside("out", "_cells.csv"), by_cell.str());
}

StageReport calibrate(const TractionParameters& p, stage::StageContext& context) {
  const auto [cells, n_not_converged] = read_cells(context);
  const std::vector<double> lengths_um = lambdas_between(kLargest_um, kSmallest_um);
  std::vector<std::vector<double>> totals(cells.size());
  numerics::parallel_for(static_cast<int>(cells.size()), context.threads, [&](int c) {
    const auto i = static_cast<std::size_t>(c);
    totals[i] = total_forces_nN(cells[i], lengths_um, p);
  });
  Eigen::VectorXd fitted(std::ssize(cells)), fttc(std::ssize(cells));
  for (Eigen::Index c = 0; c < fitted.size(); ++c) fitted[c] = cells[c].fitted_force_nN;
  std::vector<Comparison> series;
  for (std::size_t l = 0; l < lengths_um.size(); ++l) {
    for (Eigen::Index c = 0; c < fttc.size(); ++c) fttc[c] = totals[c][l];
    series.push_back({lengths_um[l], {fttc.begin(), fttc.end()}, line_of(fitted, fttc)});
  }
  write_tables(context, cells, series);
  const std::optional<double> slope_one_um = length_of_slope_one_um(series);
  std::vector<Comparison> shown;  // more than so far from one, the others would crowd along an axis
  std::copy_if(series.begin(), series.end(), std::back_inserter(shown),
               [](const Comparison& c) { return c.line.slope > 0.25 && c.line.slope < 4; });
  files::write_text(context.output_beside("out", ".svg"),
                    charts::svg_file({forces_chart(cells, shown), slope_chart(series, slope_one_um)}, 2,
                                     {std::to_string(cells.size()) + " cells. Dashed: FTTC as the fit."}));
  StageReport report{.converged = true,
                     .summary = std::to_string(cells.size()) + " cells",
                     .figures = {},
                     .effects = {},
                     .findings = {}};
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
