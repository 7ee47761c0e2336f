#include "mbtfm/tensions/intervals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::tensions {

namespace {

// Standard errors by which a tension is pressed against zero where it is half held: chance does so once in forty.
constexpr double kHalfHeld = 2;
// What chance presses against zero is to be counted in full where a bias is taken off: this leaves out a hundredth of
// it.
constexpr double kPressedByMoreThanChance = 3;

/// H⁻¹; eigenvalues lost in rounding count as its limit. So far a tension moves that no bead feels that its square is
/// still a number.
MatrixXd inverse_of(const MatrixXd& H) {
  const double least = std::max(1e-30 * H.diagonal().maxCoeff(), 1e-100);
  const VectorXd scale = H.diagonal().cwiseMax(least).cwiseSqrt().cwiseInverse();
  const auto [values, vectors] = numerics::symmetric_eigen(numerics::scaled_on_both_sides(H, scale));
  const double smallest = 1e-12 * std::max(values.maxCoeff(), 1e-300);  // rounding of JᵀJ
  const VectorXd roots = values.cwiseMax(smallest).cwiseSqrt().cwiseInverse();
  const MatrixXd half = scale.asDiagonal() * vectors * roots.asDiagonal();
  return numerics::small_product(half, half.transpose());
}

MatrixXd sandwich(const LocalMisfit& local, double variance, const MatrixXd& K) {
  if (local.model_variance.size() == 0) return variance * K;
  return numerics::plus_product(variance * K, numerics::small_product(K, local.model_variance), K);
}

/// By tension: 1 where it is free, 0 where the data press it against zero by a standard error more than `half_held`,
/// and smooth in between.
VectorXd freedom_of(const LocalMisfit& local, double variance, double half_held) {
  const MatrixXd K = inverse_of(local.H);
  const MatrixXd covariance = sandwich(local, variance, K);
  VectorXd freedom = VectorXd::Ones(local.g.size());
  for (Index i = 0; i < freedom.size(); ++i) {
    if (local.tensions_nN[i] > 0) continue;
    // without its bound t_i would go to −K_ii g_i
    const double pressed = local.g[i] * K(i, i) / std::max(std::sqrt(covariance(i, i)), 1e-300);
    const double share = std::clamp((half_held + 1 - pressed) / 2, 0.0, 1.0);
    freedom[i] = share * share * (3 - 2 * share);
  }
  return freedom;
}

/// H⁻¹ with tensions held as much as they lack freedom: f (f H f + (1 − f²) diag H)⁻¹ f. Without the held ones where
/// all are 0 or 1.
MatrixXd held_inverse(const MatrixXd& H, const VectorXd& freedom) {
  MatrixXd held = numerics::scaled_on_both_sides(H, freedom);
  held.diagonal() = H.diagonal();
  return numerics::scaled_on_both_sides(inverse_of(held), freedom);
}

/// Of 2 Phi where a tension changes and the others follow as they may.
struct Rise {
  double value = 0, slope = 0;
};

/// The least rise where tension i changes by `shift`. Its slope is that at fixed others, which are at their minimum.
Rise rise(const LocalMisfit& local, int i, double shift) {
  std::vector<int> others(local.g.size());
  std::iota(others.begin(), others.end(), 0);
  others.erase(others.begin() + i);
  const VectorXd column = local.H.col(i);
  Rise rise{.value = 2 * local.g[i] * shift + local.H(i, i) * shift * shift,
            .slope = 2 * (local.g[i] + local.H(i, i) * shift)};
  if (others.empty()) return rise;
  const MatrixXd H = local.H(others, others);
  const VectorXd g = local.g(others) + shift * column(others);
  const VectorXd low = -local.tensions_nN(others);
  const VectorXd s = bounded_quadratic_minimum(H, g, low);
  rise.value += 2 * g.dot(s) + numerics::quadratic_form(H, s);
  rise.slope += 2 * column(others).dot(s);
  return rise;
}

/// Where sqrt(rise) reaches `wanted` on the way from 0 to `first` and beyond, but not past `end`. By Newton's method on
/// the root, which is straight but where a tension meets its bound; to rounding, as an end that is found roughly would
/// jump with the number of steps.
double shift_at(const LocalMisfit& local, int i, double wanted, double first, double end) {
  double inner = 0, outer = end, shift = std::abs(first) < std::abs(end) ? first : end;
  constexpr int kMaxSteps = 200;  // halving alone needs 60
  constexpr double kRounding = 1e-12;
  for (int k = 0; k < kMaxSteps; ++k) {
    const Rise at = rise(local, i, shift);
    const double height = std::sqrt(std::max(0.0, at.value));
    if (std::abs(height - wanted) <= kRounding * wanted) break;
    if (height < wanted && shift == end) return end;
    (height < wanted ? inner : outer) = shift;
    const double newton = shift + (wanted - height) * 2 * height / at.slope;
    const bool is_between = std::abs(newton) > std::abs(inner) && std::abs(newton) < std::abs(outer);
    const double beyond = std::abs(outer) < std::abs(4 * shift) ? (inner + outer) / 2 : 2 * shift;
    const double next = is_between && newton * first > 0 ? newton : std::abs(beyond) < std::abs(end) ? beyond : end;
    if (std::abs(next - shift) <= kRounding * std::abs(shift)) break;
    shift = next;
  }
  return shift;
}

/// At the solution the gradient of a free tension is zero, and of a held one not negative, but for the last step's
/// rest; and directions that no bead feels must not make it singular.
LocalMisfit at_minimum(LocalMisfit local) {
  local.H.diagonal() += 1e-12 * local.H.diagonal();
  for (Index k = 0; k < local.g.size(); ++k) {
    local.g[k] = local.tensions_nN[k] > 0 ? 0 : std::max(0.0, local.g[k]);
  }
  return local;
}

/// Whether no tension meets its bound where tension i goes `half` to either side and the others follow it.
bool is_unbounded(const LocalMisfit& local, const MatrixXd& K, int i, double half) {
  const VectorXd follow = half / K(i, i) * K.col(i).cwiseAbs();
  return (local.tensions_nN.array() > follow.array()).all();
}

}  // namespace

LocalMisfit local_misfit(const Trial& trial, const MatrixXd& jacobian) {
  return {.tensions_nN = trial.tensions_nN,
          .H = numerics::gram(jacobian),
          .g = numerics::transposed_matvec(jacobian, trial.residual)};
}

MatrixXd response_of(const LocalMisfit& local, double variance) {
  return held_inverse(local.H, freedom_of(local, variance, kHalfHeld));
}

MatrixXd covariance_nN2(const LocalMisfit& local, double variance) {
  return sandwich(local, variance, response_of(local, variance));
}

VectorXd past_bounds_nN(const LocalMisfit& local, double variance) {
  VectorXd pressed = VectorXd::Zero(local.g.size());  // a free tension's gradient is a last step's rest
  for (Index i = 0; i < pressed.size(); ++i)
    if (local.tensions_nN[i] <= 0) pressed[i] = std::max(0.0, local.g[i]);
  return numerics::matvec(-held_inverse(local.H, freedom_of(local, variance, kPressedByMoreThanChance)), pressed);
}

VectorXd bending_bias_nN(const TensionProblem& problem, const Trial& solution, const MatrixXd& jacobian,
                         const MatrixXd& response, const MatrixXd& covariance_nN2, int threads) {
  constexpr double kRough = 1e-4;  // of an equilibrium: what bends is a hundredth of the forces and more
  const numerics::SymmetricEigen eigen = numerics::symmetric_eigen(covariance_nN2);
  const double largest = solution.tensions_nN.maxCoeff();
  MatrixXd bend = MatrixXd::Zero(jacobian.rows(), jacobian.cols());  // by direction
  numerics::parallel_for(static_cast<int>(jacobian.cols()), threads, [&](int k) {
    const VectorXd deviation = std::sqrt(std::max(0.0, eigen.values[k])) * eigen.vectors.col(k);
    const double size = deviation.cwiseAbs().maxCoeff();
    if (size == 0) return;                              // held
    const double part = std::min(1.0, largest / size);  // what no bead constrains deviates without bounds
    for (const double step : {part, -part}) {
      const VectorXd there = (solution.tensions_nN + step * deviation).cwiseMax(0.0);
      const VectorXd straight = numerics::plus_matvec(solution.residual, jacobian, there - solution.tensions_nN);
      bend.col(k) += (problem.evaluate(there, &solution, kRough).residual - straight) / (part * part);
    }
  });
  return numerics::matvec(-0.5 * response, numerics::transposed_matvec(jacobian, bend.rowwise().sum()));
}

double magnitude_bias_nN(const VectorXd& forces_nN, const MatrixXd& derivatives, const MatrixXd& covariance_nN2,
                         Index dimension) {
  double bias = 0;
  for (Index row = 0; row < forces_nN.size(); row += dimension) {
    const VectorXd force = forces_nN.segment(row, dimension);
    const double size = force.norm();
    if (size <= 0) continue;
    const MatrixXd gradients = derivatives.middleRows(row, dimension).transpose() * numerics::across(force);
    // No more than the force itself: where the error is as large as the force the second order says nothing.
    bias += std::min(size, numerics::quadratic_forms(covariance_nN2, gradients).sum() / (2 * size));
  }
  return bias;
}

std::vector<Sides> profiles_95(const LocalMisfit& local, double variance) {
  const LocalMisfit minimum = at_minimum(local);
  const MatrixXd K = inverse_of(local.H);
  const MatrixXd covariance = sandwich(local, variance, K);
  constexpr double kAnywhere = std::numeric_limits<double>::infinity();
  std::vector<Sides> profiles;
  for (int i = 0; i < static_cast<int>(local.g.size()); ++i) {
    const double t = local.tensions_nN[i], half = kNormal95 * std::sqrt(covariance(i, i));
    const double wanted = half / std::sqrt(K(i, i));
    if (!(local.H(i, i) > 0)) {
      profiles.push_back({.below = t, .above = kAnywhere});
    } else if (is_unbounded(local, K, i, half)) {
      profiles.push_back({.below = half, .above = half});
    } else {
      profiles.push_back({.below = t > 0 ? -shift_at(minimum, i, wanted, -half, -t) : 0,
                          .above = shift_at(minimum, i, wanted, half, kAnywhere)});
    }
  }
  return profiles;
}

MatrixXd bootstrap_deviations_nN(const TensionProblem& problem, const FitParameters& parameters, const Trial& solution,
                                 double variance, const VectorXd& force_variance_nN2,
                                 const std::vector<std::uint64_t>& draws, int threads) {
  MatrixXd deviations(problem.n_tensions(), static_cast<Index>(draws.size()));
  numerics::parallel_for(static_cast<int>(draws.size()), threads, [&](int d) {
    // In the reduced data white noise is white again (see ReducedData).
    std::mt19937_64 engine(draws[d]);
    const auto uniform = [&] { return (static_cast<double>(engine() >> 11) + 0.5) * 0x1p-53; };
    const auto normal = [&] {  // Box & Muller (1958): the same with every library
      const double length = std::sqrt(-2 * std::log(uniform()));
      return length * std::cos(6.283185307179586 * uniform());
    };
    ReducedData drawn = problem.data();
    for (Index k = 0; k < drawn.target.size(); ++k)
      drawn.target[k] += solution.residual[k] + std::sqrt(variance) * normal();
    VectorXd of_model = force_variance_nN2.cwiseSqrt();
    for (double& e : of_model) e *= normal();
    if (of_model.size() > 0) drawn.target += numerics::matvec(*drawn.compliance, of_model);
    const TensionProblem again(problem.cell(), drawn, problem.adhesion_ids());
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

}  // namespace mbtfm::tensions
