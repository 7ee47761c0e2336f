#include "mbtfm/intervals.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "pipeline/contract/parallel.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::inverse {

namespace {

constexpr double kNormal95 = 1.959963984540054;  // two-sided 95 % of a normal variable
// A tension is held at zero where chance would press it there this hard once in forty.
constexpr double kHeldBeyond = kNormal95;
// What chance presses against zero is to be counted in full where a bias is taken off: this leaves out a hundredth of
// it.
constexpr double kPressedByMoreThanChance = 3;

/// H⁻¹; eigenvalues lost in rounding count as its limit.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& H) {
  const Eigen::VectorXd scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * H * scale.asDiagonal());
  const double smallest = 1e-12 * std::max(eigen.eigenvalues().maxCoeff(), 1e-300);  // rounding of JᵀJ
  const Eigen::VectorXd roots =
      eigen.eigenvalues().unaryExpr([&](double v) { return 1 / std::sqrt(std::max(v, smallest)); });
  const Eigen::MatrixXd half = scale.asDiagonal() * eigen.eigenvectors() * roots.asDiagonal();
  return half * half.transpose();
}

Eigen::MatrixXd sandwich(const LocalMisfit& local, double variance, const Eigen::MatrixXd& K) {
  if (local.model_variance.size() == 0) return variance * K;
  return variance * K + K * local.model_variance * K;
}

/// Those that the data do not press against zero by more than so many standard errors.
std::vector<int> free_tensions(const LocalMisfit& local, double variance, double limit) {
  const Eigen::MatrixXd K = inverse_of(local.H);
  const Eigen::MatrixXd covariance = sandwich(local, variance, K);
  std::vector<int> free;
  for (int i = 0; i < static_cast<int>(local.g.size()); ++i) {
    // without its bound t_i would go to −K_ii g_i
    const bool is_held = local.tensions_nN[i] <= 0 && local.g[i] * K(i, i) > limit * std::sqrt(covariance(i, i));
    if (!is_held) free.push_back(i);
  }
  return free;
}

/// Least rise of 2 Phi where tension i changes by `shift` and the others follow as they may.
double rise(const LocalMisfit& local, int i, double shift) {
  std::vector<int> others(local.g.size());
  std::iota(others.begin(), others.end(), 0);
  others.erase(others.begin() + i);
  const Eigen::VectorXd column = local.H.col(i);
  double sum = 2 * local.g[i] * shift + local.H(i, i) * shift * shift;
  if (others.empty()) return sum;
  const Eigen::MatrixXd H = local.H(others, others);
  const Eigen::VectorXd g = local.g(others) + shift * column(others);
  const Eigen::VectorXd low = -local.tensions_nN(others);
  const Eigen::VectorXd s = bounded_quadratic_minimum(H, g, low);
  return sum + 2 * g.dot(s) + s.dot(H * s);
}

/// Where sqrt(rise) reaches `wanted` on the way from 0 to `first` and beyond, but not past `end`.
double shift_at(const LocalMisfit& local, int i, double wanted, double first, double end) {
  const auto height = [&](double shift) { return std::sqrt(std::max(0.0, rise(local, i, shift))); };
  double inner = 0, outer = first;
  if (std::abs(outer) >= std::abs(end)) outer = end;
  for (int k = 0; k < 60 && height(outer) < wanted; ++k) {
    if (outer == end) return end;
    inner = outer;
    outer = std::abs(2 * outer) < std::abs(end) ? 2 * outer : end;
  }
  for (int k = 0; k < 40; ++k) {
    const double low = height(inner), high = height(outer);
    if (high - wanted <= 1e-3 * wanted) return outer;
    // sqrt(rise) is nearly straight; half-way where it is not
    const double share = k % 2 == 0 && high > low ? (wanted - low) / (high - low) : 0.5;
    const double middle = inner + share * (outer - inner);
    (height(middle) < wanted ? inner : outer) = middle;
    if (std::abs(outer - inner) <= 1e-3 * std::abs(outer)) break;
  }
  return outer;
}

}  // namespace

LocalMisfit local_misfit(const Trial& trial, const Eigen::MatrixXd& jacobian) {
  return {.tensions_nN = trial.tensions_nN,
          .H = gram(jacobian),
          .g = jacobian.transpose() * trial.residual};
}

Eigen::MatrixXd response_of(const LocalMisfit& local, double variance) {
  const std::vector<int> free = free_tensions(local, variance, kHeldBeyond);
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(local.H.rows(), local.H.cols());
  if (!free.empty()) K(free, free) = inverse_of(local.H(free, free));
  return K;
}

Eigen::MatrixXd covariance_nN2(const LocalMisfit& local, double variance) {
  return sandwich(local, variance, response_of(local, variance));
}

Eigen::VectorXd past_bounds_nN(const LocalMisfit& local, double variance) {
  Eigen::VectorXd past = Eigen::VectorXd::Zero(local.g.size());
  const std::vector<int> free = free_tensions(local, variance, kPressedByMoreThanChance);
  if (free.empty()) return past;
  Eigen::VectorXd pressed = Eigen::VectorXd::Zero(local.g.size());  // a free tension's gradient is a last step's rest
  for (Eigen::Index i = 0; i < pressed.size(); ++i)
    if (local.tensions_nN[i] <= 0) pressed[i] = std::max(0.0, local.g[i]);
  past(free) = -inverse_of(local.H(free, free)) * pressed(free);
  return past;
}

Eigen::VectorXd bending_bias_nN(const TensionProblem& problem, const Trial& solution, const Eigen::MatrixXd& jacobian,
                                const Eigen::MatrixXd& response, const Eigen::MatrixXd& covariance_nN2, int threads) {
  constexpr double kRough = 1e-5;  // of an equilibrium: what bends is a hundredth of the forces and more
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance_nN2);
  const double largest = solution.tensions_nN.maxCoeff();
  Eigen::MatrixXd bend = Eigen::MatrixXd::Zero(jacobian.rows(), jacobian.cols());  // by direction
  parallel_for(static_cast<int>(jacobian.cols()), threads, [&](int k) {
    const Eigen::VectorXd deviation = std::sqrt(std::max(0.0, eigen.eigenvalues()[k])) * eigen.eigenvectors().col(k);
    const double size = deviation.cwiseAbs().maxCoeff();
    if (size == 0) return;                              // held
    const double part = std::min(1.0, largest / size);  // what no bead tells of deviates without bounds
    for (const double step : {part, -part}) {
      const Eigen::VectorXd there = (solution.tensions_nN + step * deviation).cwiseMax(0.0);
      const Eigen::VectorXd straight = solution.residual + jacobian * (there - solution.tensions_nN);
      bend.col(k) += (problem.evaluate(there, &solution, kRough).residual - straight) / (part * part);
    }
  });
  return -0.5 * response * (jacobian.transpose() * bend.rowwise().sum());
}

double magnitude_bias_nN(const Eigen::VectorXd& forces_nN, const Eigen::MatrixXd& derivatives,
                         const Eigen::MatrixXd& covariance_nN2) {
  double bias = 0;
  for (Eigen::Index row = 0; row < forces_nN.size(); row += 2) {
    const Eigen::Vector2d force = forces_nN.segment<2>(row);
    const double size = force.norm();
    if (size <= 0) continue;
    const Eigen::Vector2d across(-force.y() / size, force.x() / size);
    const Eigen::VectorXd gradient = derivatives.middleRows<2>(row).transpose() * across;
    // No more than the force itself: where the error is as large as the force the second order says nothing.
    bias += std::min(size, gradient.dot(covariance_nN2 * gradient) / (2 * size));
  }
  return bias;
}

Sides profile_95(const LocalMisfit& local, double variance, int i) {
  if (!(local.H(i, i) > 0)) return {.below = local.tensions_nN[i], .above = 1e300};
  LocalMisfit safe = local;  // directions that no bead feels must not make it singular
  safe.H.diagonal() += 1e-12 * local.H.diagonal();
  // At the solution the gradient of a free tension is zero, and of a held one not negative, but for the last step's
  // rest.
  for (Eigen::Index k = 0; k < safe.g.size(); ++k) safe.g[k] = safe.tensions_nN[k] > 0 ? 0 : std::max(0.0, safe.g[k]);
  const Eigen::MatrixXd K = inverse_of(local.H);
  const double half = kNormal95 * std::sqrt(sandwich(local, variance, K)(i, i));
  const double wanted = half / std::sqrt(K(i, i)), first = half * (1 + 1e-6);
  const double t = local.tensions_nN[i];
  return {.below = t > 0 ? -shift_at(safe, i, wanted, -first, -t) : 0,
          .above = shift_at(safe, i, wanted, first, 1e300)};
}

Eigen::MatrixXd bootstrap_deviations_nN(const TensionProblem& problem, const FitParameters& parameters,
                                        const Trial& solution, double variance,
                                        const Eigen::VectorXd& force_variance_nN2,
                                        const std::vector<std::uint64_t>& draws, int threads) {
  Eigen::MatrixXd deviations(problem.n_tensions(), static_cast<Eigen::Index>(draws.size()));
  parallel_for(static_cast<int>(draws.size()), threads, [&](int d) {
    // In the reduced data white noise is white again (see ReducedData).
    std::mt19937_64 engine(draws[static_cast<std::size_t>(d)]);
    const auto uniform = [&] { return (static_cast<double>(engine() >> 11) + 0.5) * 0x1p-53; };
    const auto normal = [&] {  // Box & Muller (1958): the same with every library
      const double length = std::sqrt(-2 * std::log(uniform()));
      return length * std::cos(6.283185307179586 * uniform());
    };
    ReducedData drawn = problem.data();
    for (Eigen::Index k = 0; k < drawn.target.size(); ++k)
      drawn.target[k] += solution.residual[k] + std::sqrt(variance) * normal();
    Eigen::VectorXd of_model = force_variance_nN2.cwiseSqrt();
    for (double& e : of_model) e *= normal();
    if (of_model.size() > 0) drawn.target += *drawn.compliance * of_model;
    const TensionProblem again(problem.cables(), drawn, problem.adhesion_ids());
    const Trial start = again.evaluate(solution.tensions_nN, &solution);
    deviations.col(d) = fit_gauss_newton(again, parameters, start).trial.tensions_nN - solution.tensions_nN;
  });
  return deviations;
}

Sides percentiles_95(std::vector<double> deviations) {
  if (deviations.empty()) return {};
  std::sort(deviations.begin(), deviations.end());
  const auto at = [&](double share) {
    const double place = share * static_cast<double>(deviations.size() - 1);
    const auto k = static_cast<std::size_t>(place);
    const double rest = place - static_cast<double>(k);
    return deviations[k] + (rest > 0 ? rest * (deviations[k + 1] - deviations[k]) : 0);
  };
  return {.below = std::max(0.0, -at(0.025)), .above = std::max(0.0, at(0.975))};
}

}  // namespace mbtfm::inverse
