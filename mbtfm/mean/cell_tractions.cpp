#include "mbtfm/mean/cell_tractions.h"

#include <cmath>
#include <numbers>

#include "mbtfm/tractions/fttc.h"
#include "substrate/greens/wave.h"

namespace mbtfm::mean {
namespace {

constexpr double kTolerance = 1e-4;  // of the tractions, in energy: a hundredth of them

tractions::LatticeProblem problem_of(const Registered& cell, const tractions::TractionParameters& parameters) {
  return {cell.beads, cell.gel, tractions::lattice_options(parameters, 1)};
}

CellField solved(const tractions::LatticeProblem& problem, tractions::TikhonovSolver& solver, const Registered& cell,
                 const tractions::TractionParameters& parameters, double lambda) {
  solver.solve(lambda, kTolerance);
  const tractions::WaveField waves = solver.solution();
  return {tractions::patches_of(problem, tractions::tractions_kPa(problem, waves, parameters.read_out, 0),
                                problem.displaced(waves)),
          cell.motion, extent_of(cell.beads, &Bead::position_um)};
}

}  // namespace

double lambda_by_risk_um_per_kPa(const Registered& cell, const tractions::TractionParameters& parameters) {
  const tractions::LatticeProblem problem = problem_of(cell, parameters);
  tractions::TikhonovSolver solver(problem);
  return tractions::chosen_lambda(tractions::scan_lambda(problem, solver), tractions::LambdaCriterion::risk);
}

CellField field_of(const Registered& cell, const tractions::TractionParameters& parameters, double lambda_um_per_kPa) {
  const tractions::LatticeProblem problem = problem_of(cell, parameters);
  tractions::TikhonovSolver solver(problem);
  return solved(problem, solver, cell, parameters, lambda_um_per_kPa);
}

CellField blurred(const std::function<Vec2(Vec2 place_um)>& traction_kPa, const Registered& cell,
                  const tractions::TractionParameters& parameters, double lambda_um_per_kPa) {
  const tractions::LatticeProblem problem = problem_of(cell, parameters);
  tractions::NodeField nodes = problem.transform().no_field();
  for (int j = 0; j < problem.field().n_rows; ++j) {
    for (int i = 0; i < problem.field().n_columns; ++i) {
      const Vec2 there = cell.motion.place_um(problem.field().position_um(i, j));
      const Vec2 traction = cell.motion.vector_back(traction_kPa(there));
      const Eigen::Index at = i + static_cast<Eigen::Index>(problem.box().n_columns) * j;
      nodes.x[at] = traction.x;
      nodes.y[at] = traction.y;
    }
  }
  const tractions::NodeField displacement = problem.displaced(problem.transform().forward(nodes));
  const tractions::NodeField spread = problem.spread_of(problem.at_beads(displacement));
  tractions::TikhonovSolver solver(problem, problem.pulled_back(spread), 1);
  return solved(problem, solver, cell, parameters, lambda_um_per_kPa);
}

std::vector<WaveShare> wave_shares(const std::vector<Registered>& cells, const std::vector<double>& lambdas_um_per_kPa,
                                   GelModel model, double size_um) {
  constexpr double kShortest = 0.01, kStep = 1.05;  // of the size
  std::vector<WaveShare> shares;
  for (double wavelength = kShortest * size_um; wavelength < 4 * size_um; wavelength *= kStep) {
    const double wave = 2 * std::numbers::pi / wavelength;
    WaveShare share{.wavelength_um = wavelength};
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const auto compliance = greens::wave_compliance(cells[k].gel, model, wave);
      const auto left = [&](double c) { return c * c / (c * c + lambdas_um_per_kPa[k] * lambdas_um_per_kPa[k]); };
      // at the edge, a size from the middle, a wave through it is moved by shift and turn
      const double moved2 =
          std::pow(cells[k].shift_error_um, 2) + 0.5 * std::pow(size_um * cells[k].angle_error_rad, 2);
      const double n = static_cast<double>(cells.size());
      share.along += left(compliance.along_um_per_kPa) / n;
      share.across += left(compliance.across_um_per_kPa) / n;
      share.registration += std::exp(-0.5 * wave * wave * moved2) / n;
    }
    shares.push_back(share);
  }
  return shares;
}

double gaussian_um(const std::vector<WaveShare>& shares, const std::function<double(const WaveShare&)>& share) {
  for (const WaveShare& one : shares) {
    // exp(-k² s² / 2) = 1/2
    if (share(one) >= 0.5)
      return one.wavelength_um == shares.front().wavelength_um
                 ? 0
                 : std::sqrt(2 * std::numbers::ln2) * one.wavelength_um / (2 * std::numbers::pi);
  }
  return std::sqrt(2 * std::numbers::ln2) * shares.back().wavelength_um / (2 * std::numbers::pi);
}

}  // namespace mbtfm::mean
