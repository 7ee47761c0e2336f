#include "mbtfm/tractions/calibration.h"

#include <algorithm>
#include <cmath>

#include "pipeline/charts/chart.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::tractions {
namespace {

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

std::string says(const Comparison& c) {
  return "ℓ = " + charts::readable(c.length_um) + " µm: slope " + charts::readable(c.slope) + ", r " +
         charts::readable(c.correlation);
}

constexpr const char* kOneToOne = "stroke:#333;stroke-width:1.6;stroke-dasharray:6 4";

/// FTTC's total force over the fit's, for some of the series and for slope one (thesis fig. 3.8).
charts::Chart forces_chart(const std::vector<FittedCell>& cells, const std::vector<Comparison>& shown) {
  double largest_fitted = 0, largest = 0;
  for (const FittedCell& cell : cells) largest_fitted = std::max(largest_fitted, 1.08 * cell.fitted_force_nN);
  for (const Comparison& c : shown)
    for (const double force : c.fttc_nN) largest = std::max({largest, 1.05 * force, c.slope * largest_fitted});
  charts::Chart chart("Total force of a cell", {"model-based fit (nN)", 0, largest_fitted, charts::Scale::linear},
                      {"FTTC (nN)", 0, std::max(largest, largest_fitted), charts::Scale::linear});
  chart.curve({{0, 0}, {largest_fitted, largest_fitted}}, kOneToOne);
  chart.put_key(charts::Chart::KeySide::left);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const std::string colour = charts::kColours[i % std::size(charts::kColours)];
    chart.curve({{0, 0}, {largest_fitted, shown[i].slope * largest_fitted}}, "stroke-width:1.2;stroke:" + colour);
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
    slopes.push_back(c.slope);
    by_slope.push_back({c.length_um, c.slope});
    by_correlation.push_back({c.length_um, c.correlation});
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

}  // namespace

std::vector<Comparison> compared(const std::vector<FittedCell>& cells, const std::vector<double>& lengths_um,
                                 const TractionParameters& parameters, int threads) {
  std::vector<std::vector<double>> totals(cells.size());
  numerics::parallel_for(static_cast<int>(cells.size()), threads, [&](int c) {
    const auto i = static_cast<std::size_t>(c);
    totals[i] = total_forces_nN(cells[i], lengths_um, parameters);
  });
  Eigen::VectorXd fitted(std::ssize(cells)), fttc(std::ssize(cells));
  for (Eigen::Index c = 0; c < fitted.size(); ++c) fitted[c] = cells[c].fitted_force_nN;
  std::vector<Comparison> series;
  for (std::size_t l = 0; l < lengths_um.size(); ++l) {
    for (Eigen::Index c = 0; c < fttc.size(); ++c) fttc[c] = totals[c][l];
    const Eigen::VectorXd dx = fitted.array() - fitted.mean(), dy = fttc.array() - fttc.mean();
    const double variances = dx.squaredNorm() * dy.squaredNorm();
    series.push_back({lengths_um[l],
                      {fttc.begin(), fttc.end()},
                      fitted.squaredNorm() > 0 ? fitted.dot(fttc) / fitted.squaredNorm() : 0,
                      variances > 0 ? dx.dot(dy) / std::sqrt(variances) : 0});
  }
  return series;
}

std::optional<double> length_of_slope_one_um(const std::vector<Comparison>& series) {
  for (std::size_t l = 1; l < series.size(); ++l) {
    const Comparison &before = series[l - 1], &after = series[l];
    if (before.slope > 1 || after.slope <= 1) continue;
    const double share = (1 - before.slope) / (after.slope - before.slope);
    return before.length_um * std::pow(after.length_um / before.length_um, share);
  }
  return std::nullopt;
}

std::string charts_of(const std::vector<FittedCell>& cells, const std::vector<Comparison>& series) {
  std::vector<Comparison> shown;  // more than so far from one, the others would crowd along an axis
  std::copy_if(series.begin(), series.end(), std::back_inserter(shown),
               [](const Comparison& c) { return c.slope > 0.25 && c.slope < 4; });
  return charts::svg_file({forces_chart(cells, shown), slope_chart(series, length_of_slope_one_um(series))}, 2,
                          {std::to_string(cells.size()) + " cells. Dashed: FTTC as the fit."});
}

}  // namespace mbtfm::tractions
