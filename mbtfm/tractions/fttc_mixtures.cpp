#include "mbtfm/tractions/fttc_mixtures.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "mbtfm/tractions/fttc.h"
#include "pipeline/contract/errors.h"

namespace mbtfm::tractions {

namespace {

Eigen::VectorXd sums_nN(const Lattice& field, const std::vector<Vec2>& tractions, const std::vector<int>& owners,
                        std::size_t n_adhesions) {
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(2 * static_cast<Eigen::Index>(n_adhesions));
  const double area_um2 = field.spacing_um * field.spacing_um;
  for (std::size_t p = 0; p < tractions.size(); ++p)
    if (owners[p] >= 0) sums.segment<2>(2 * owners[p]) += area_um2 * Eigen::Vector2d(tractions[p].x, tractions[p].y);
  return sums;
}

}  // namespace

FttcMixtures::FttcMixtures(const DisplacementField& field, const DisplacementField& noise, const Gel& gel,
                           const std::vector<Adhesion>& adhesions, const TractionParameters& parameters, int threads)
    : parameters_(parameters) {
  const LatticeProblem problem(field, gel, lattice_options(parameters, threads));
  MBTFM_ASSERT(problem.stated_variance());
  n_data_ = problem.n_data();
  unit_variance_ = *problem.stated_variance();
  Eigen::MatrixX2d data(2 * std::ssize(field), 2);
  data << problem.data(), problem.roots().cwiseProduct(components_of(noise));
  std::vector<Vec2> nodes_um;
  for (const GroundPatch& p :
       patches_of(problem, std::vector<Vec2>(static_cast<std::size_t>(problem.field().n_nodes())),
                  problem.transform().no_field()))
    nodes_um.push_back(p.position_um);
  const std::vector<int> owners = adhesion_of_patches(nodes_um, adhesions, parameters.grow_um);

  const auto solver_of = [&](const NodeField& spread) {
    return TikhonovSolver(problem, problem.pulled_back(spread), threads);
  };
  std::array<TikhonovSolver, 2> solvers = {solver_of(problem.spread(data.col(0))),
                                           solver_of(problem.spread(data.col(1)))};
  TikhonovSolver probe = solver_of(problem.spread_signs());
  for (const double lambda : lambdas_of(problem)) {
    AtLambda at{
        .lambda = lambda, .residuals = data, .forces_nN = Eigen::MatrixX2d(2 * std::ssize(adhesions), 2), .norms = {}};
    std::array<WaveField, 2> waves;
    for (int k = 0; k < 2; ++k) {
      const auto i = static_cast<std::size_t>(k);
      solvers[i].solve(lambda, kTolerance);
      waves[i] = solvers[i].solution();
      at.residuals.col(k) -= problem.at_beads(problem.displaced(waves[i]));
      at.forces_nN.col(k) =
          sums_nN(problem.field(), tractions_kPa(problem, waves[i], parameters.read_out, parameters.gaussian_um),
                  owners, adhesions.size());
    }
    const WaveTransform& transform = problem.transform();
    const double mixed = transform.dot(waves[0], waves[1]);
    at.norms << transform.dot(waves[0], waves[0]), mixed, mixed, transform.dot(waves[1], waves[1]);
    probe.solve(lambda, kScanTolerance);
    at.degrees = probe.right_hand_side_times_solution();
    at.degrees_of_square = probe.displaced_squared();
    scan_.push_back(std::move(at));
  }
}

/// Something of the scan at any lambda: Lagrange's cubic in the logarithm through the four nearest.
template <class Of>
auto FttcMixtures::between(double lambda, const Of& of) const {
  const auto n = static_cast<double>(scan_.size());
  const double at =
      (n - 1) * std::log(scan_.front().lambda / lambda) / std::log(scan_.front().lambda / scan_.back().lambda);
  const auto first = static_cast<std::size_t>(std::clamp(std::floor(at) - 1, 0.0, n - 4));
  const double x = at - static_cast<double>(first);
  const auto share = [x](int i) {
    double product = 1;
    for (int k = 0; k < 4; ++k)
      if (k != i) product *= (x - k) / (i - k);
    return product;
  };
  std::decay_t<decltype(of(scan_.front()))> sum = share(0) * of(scan_[first]);
  for (int i = 1; i < 4; ++i) sum += share(i) * of(scan_[first + static_cast<std::size_t>(i)]);
  return sum;
}

Eigen::VectorXd FttcMixtures::forces_nN(double factor) const {
  const Eigen::Vector2d mixture(1, factor);
  std::vector<ScanPoint> points;
  for (const AtLambda& at : scan_)
    points.push_back({.lambda = at.lambda,
                      .misfit = (at.residuals * mixture).squaredNorm() / (factor * factor),
                      .norm = mixture.dot(at.norms * mixture) / (factor * factor),
                      .degrees = at.degrees});
  const auto variance_left_at = [&](double lambda) {
    const Eigen::VectorXd left =
        between(lambda, [&](const AtLambda& at) -> Eigen::VectorXd { return at.residuals * mixture / factor; });
    return robust_variance(left, between(lambda, [](const AtLambda& at) { return at.degrees; }),
                           between(lambda, [](const AtLambda& at) { return at.degrees_of_square; }));
  };
  const LambdaScan scan = judge(std::move(points), n_data_, unit_variance_, variance_left_at, unbiased_risks(n_data_));
  const double lambda = parameters_.lambda_um_per_kPa.value_or(chosen_lambda(scan, parameters_.lambda_by));
  return between(lambda, [&](const AtLambda& at) -> Eigen::VectorXd { return at.forces_nN * mixture; });
}

}  // namespace mbtfm::tractions
