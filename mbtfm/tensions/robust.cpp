#include "mbtfm/tensions/robust.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/distributions.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::tensions {

namespace {

/// Length of each bead's residual, of the beads in use.
std::vector<double> used_lengths(const LinearData& data, const VectorXd& residual) {
  std::vector<double> lengths;
  const Index each = data.dimension;
  for (Index i = 0; i < residual.size(); i += each)
    if (data.weight_per_um[i] > 0) lengths.push_back(residual.segment(i, each).norm());
  return lengths;
}

/// Where the middle bead is explained to rounding there is nothing to be robust against.
bool is_exact(const LinearData& data, double scale) {
  return scale <= 1e-9 * data.weight_per_um.cwiseProduct(data.displacement_um).cwiseAbs().maxCoeff();
}

/// Changes of the weighted displacements by tension, 2·beads × tensions. Single precision: weights settle to 1e-4.
using BeadJacobian = Eigen::MatrixXf;

BeadJacobian bead_jacobian(const LinearData& data, const MatrixXd& force_derivatives) {
  constexpr Index kColumns = 64;  // at a time in double precision
  BeadJacobian J(data.weight_per_um.size(), force_derivatives.cols());
  for (Index first = 0; first < J.cols(); first += kColumns) {
    const Index count = std::min(kColumns, J.cols() - first);
    J.middleCols(first, count) =
        (data.weight_per_um.asDiagonal() *
         less_motion(data, data.response->displace(force_derivatives.middleCols(first, count))))
            .cast<float>();
  }
  return J;
}

/// Jᵀ W J and Jᵀ W r, W the weights by bead.
struct NormalEquations {
  MatrixXd H;
  VectorXd b;
};

NormalEquations normal_equations(const BeadJacobian& J, const VectorXd& bead_weights, const VectorXd& residual,
                                 int threads) {
  constexpr int kPieces = 8;      // that sums are made of, whatever the threads
  constexpr Index kBeads = 4096;  // at a time in double precision
  const Index each = J.rows() / bead_weights.size();
  std::vector<NormalEquations> sums(kPieces, {MatrixXd::Zero(J.cols(), J.cols()), VectorXd::Zero(J.cols())});
  numerics::parallel_for(kPieces, threads, [&](int piece) {
    NormalEquations& sum = sums[piece];
    for (Index first = piece * kBeads; first < bead_weights.size(); first += kPieces * kBeads) {
      const Index count = std::min(kBeads, bead_weights.size() - first);
      VectorXd root(each * count);
      for (Index b = 0; b < count; ++b) root.segment(each * b, each).setConstant(std::sqrt(bead_weights[first + b]));
      const MatrixXd weighted = root.asDiagonal() * J.middleRows(each * first, each * count).cast<double>();
      numerics::add_upper_gram(weighted, sum.H, 1);
      sum.b += numerics::transposed_matvec(weighted, root.cwiseProduct(residual.segment(each * first, each * count)));
    }
  });
  for (int piece = 1; piece < kPieces; ++piece) {
    sums.front().H += sums[piece].H;
    sums.front().b += sums[piece].b;
  }
  numerics::mirror_upper(sums.front().H);
  return sums.front();
}

/// J s, by parts of the rows.
VectorXd times(const BeadJacobian& J, const VectorXd& s, int threads) {
  constexpr Index kRows = 8192;
  const Eigen::VectorXf step = s.cast<float>();
  VectorXd moved(J.rows());
  numerics::parallel_for(static_cast<int>((J.rows() + kRows - 1) / kRows), threads, [&](int part) {
    const Index first = part * kRows, count = std::min(kRows, J.rows() - first);
    moved.segment(first, count) = (J.middleRows(first, count) * step).cast<double>();
  });
  return moved;
}

/// The robust fit of the linearised problem r − J s, s >= low: the weights it ends with.
VectorXd linear_weights(Loss loss, const VectorXd& residual, const BeadJacobian& J, const VectorXd& low, double scale,
                        Index each, int threads) {
  VectorXd step = VectorXd::Zero(J.cols());
  VectorXd weights = inverse::weights_of(loss, residual, scale, each);
  constexpr int kMaxSteps = 50;  // the weights settle linearly, in some ten steps
  for (int i = 0; i < kMaxSteps; ++i) {
    auto [H, b] = normal_equations(J, weights, residual, threads);
    H.diagonal() += 1e-12 * H.diagonal().maxCoeff() * VectorXd::Ones(H.rows());  // a tension that no bead feels
    const VectorXd next = bounded_quadratic_minimum(H, -b, low);
    const double change = (next - step).norm();
    step = next;
    weights = inverse::weights_of(loss, residual - times(J, step, threads), scale, each);
    if (change <= 1e-4 * step.norm()) break;
  }
  return weights;
}

WeighedFit fit_with_loss(LinearData data, const network::Contractile& network, const std::vector<int>& adhesion_ids,
                         const FitParameters& parameters, int threads, TensionFit fit, Loss loss,
                         std::optional<double> fixed_scale) {
  constexpr int kMaxRounds = 20;      // each halves the change at least
  constexpr double kSettled = 0.022;  // of a standard error, mean over the directions: a tenth along one of twenty
  for (int round = 0; round < kMaxRounds; ++round) {
    const Trial last = fit.trial;
    const VectorXd& before = last.tensions_nN;
    const VectorXd residual = weighted_residual(data, fit.trial.forces_nN);
    const double scale = fixed_scale ? *fixed_scale : robust_scale(data, residual);
    if (is_exact(data, scale)) break;
    const TensionProblem problem(network, data.reduced, adhesion_ids, {}, threads);
    const MatrixXd derivatives = problem.force_derivatives(fit.trial);
    const VectorXd weights =
        linear_weights(loss, residual, bead_jacobian(data, derivatives), -before, scale, data.dimension, threads);
    data = reweighted(std::move(data), weights);
    const TensionProblem weighed(network, data.reduced, adhesion_ids, {}, threads);
    const auto fit_again = [&](const Trial& start, Search search) {
      const int n_evaluations = fit.n_evaluations;
      fit = fit_tensions(weighed, parameters, threads, start, search);
      fit.n_evaluations += n_evaluations;
    };
    const auto is_settled = [&] {
      // or a thousandth of the largest tension: at a kink of the forces fits may end on either side in turn
      const VectorXd change = fit.trial.tensions_nN - before;
      const double settled = kSettled * scale * std::sqrt(static_cast<double>(change.size()));
      const VectorXd changed = less_motion(data, data.response->displace(numerics::matvec(derivatives, change)));
      const double moved = data.weight_per_um.cwiseProduct(changed).norm();
      return moved <= settled || change.cwiseAbs().maxCoeff() <= 1e-3 * before.maxCoeff();
    };
    fit_again(scaled_to_data(weighed, before, &last), Search::nearest);
    if (!is_settled()) continue;
    fit_again(fit.trial, Search::best);  // only now: weights that still change do not change which side is best
    if (is_settled()) break;
  }
  return {std::move(fit), std::move(data)};
}

/// R with R Rᵀ this covariance.
MatrixXd root_of(const MatrixXd& covariance) {
  const auto [values, vectors] = numerics::symmetric_eigen(covariance);
  return vectors * values.cwiseMax(0).cwiseSqrt().asDiagonal();
}

/// Whether the nearest bead's residual does not go along with that of the bead of this row, by half of it at least.
bool stands_alone(const LinearData& data, const VectorXd& residual, Index row) {
  const Index each = data.dimension;
  const auto own = residual.segment(row, each);
  double nearest = std::numeric_limits<double>::infinity(), along = 0;
  for (Index other = 0; other < residual.size(); other += each) {
    if (other == row || data.weight_per_um[other] == 0) continue;
    const double distance = norm(place_of_bead(data, other / each) - place_of_bead(data, row / each));
    if (distance >= nearest) continue;
    nearest = distance;
    along = residual.segment(other, each).dot(own);
  }
  return along < 0.5 * own.squaredNorm();
}

}  // namespace

MatrixXd of_free_tensions(const MatrixXd& force_derivatives, const VectorXd& tensions_nN) {
  std::vector<Index> free;
  for (Index i = 0; i < tensions_nN.size(); ++i)
    if (tensions_nN[i] > 0) free.push_back(i);
  return force_derivatives(Eigen::all, free);
}

Studentized studentized(const LinearData& data, const Trial& trial, const MatrixXd& force_derivatives) {
  const MatrixXd of_free = of_free_tensions(force_derivatives, trial.tensions_nN);
  const VectorXd weight = squared_weights(data).cwiseSqrt();
  const Index each = data.dimension;
  std::vector<MatrixXd> hat(data.bead_weight.size(), MatrixXd::Zero(each, each));  // its blocks
  const auto add = [&](const MatrixXd& independent) {                              // columns Z of a part Z Zᵀ
    for (std::size_t b = 0; b < hat.size(); ++b) {
      const auto own = independent.middleRows(each * static_cast<Index>(b), each);
      hat[b].noalias() += own.lazyProduct(own.transpose());
    }
  };
  if (data.motions.shapes.cols() > 0)
    add(numerics::small_product(weight.asDiagonal() * data.motions.shapes, root_of(data.motions.inverse)));
  const MatrixXd unit = numerics::small_product(
      of_free, root_of(numerics::pseudo_inverse(numerics::gram(displace(data.reduced, of_free, data.threads)))));
  constexpr Index kColumns = 64;  // at a time: beads × tensions are too many numbers
  for (Index first = 0; first < unit.cols(); first += kColumns) {
    const Index count = std::min(kColumns, unit.cols() - first);
    add(weight.asDiagonal() * less_motion(data, data.response->displace(unit.middleCols(first, count))));
  }
  VectorXd residual = weighted_residual(data, trial.forces_nN), leverage(data.bead_weight.size());
  for (Index b = 0; b < leverage.size(); ++b) {
    constexpr double kLeast = 0.01;  // a bead of leverage 1 leaves rounding, not a residual
    auto own = residual.segment(each * b, each);
    own = numerics::inverse_root(MatrixXd::Identity(each, each) - hat[b], kLeast) * own;
    leverage[b] = hat[b].trace();
  }
  return {.residual = std::move(residual), .leverage = std::move(leverage)};
}

std::vector<Index> stray_beads(const LinearData& data, const Studentized& beads) {
  const VectorXd& residual = beads.residual;
  const double scale = robust_scale(data, residual);
  if (is_exact(data, scale)) return {};
  constexpr double kChance = 0.05;
  const Index each = data.dimension;
  const double n_beads = static_cast<double>(data.n_used) / static_cast<double>(each), all = beads.leverage.sum();
  std::vector<Index> strays;
  std::size_t n_large = 0;
  for (Index b = 0; b < beads.leverage.size(); ++b) {
    if (data.weight_per_um[each * b] == 0) continue;
    const double share = 0.5 / n_beads + 0.5 * (all > 0 ? beads.leverage[b] / all : 1 / n_beads);
    const double squares = residual.segment(each * b, each).squaredNorm() / (scale * scale);
    if (numerics::chi_squared_above(static_cast<double>(each), squares) >= kChance * share) continue;
    ++n_large;
    if (stands_alone(data, residual, each * b)) strays.push_back(b);
  }
  return 2 * strays.size() > n_large ? strays : std::vector<Index>();
}

LinearData without_strays(LinearData data, const Trial& trial, const MatrixXd& force_derivatives,
                          const MatrixXd& motions) {
  const LinearData& followed = motions.size() > 0 ? with_more_motions(data, motions) : data;
  const std::vector<Index> strays = stray_beads(data, studentized(followed, trial, force_derivatives));
  if (strays.empty()) return data;
  VectorXd weight = VectorXd::Ones(data.bead_weight.size());
  for (const Index bead : strays) weight[bead] = 0;
  return reweighted(std::move(data), weight);
}

double harm_done_by(const std::vector<Index>& strays, const LinearData& data, const VectorXd& weighted_residual,
                    const MatrixXd& force_derivatives) {
  const Index each = data.dimension, n_strays = std::ssize(strays);
  VectorXd residual(each * n_strays), weight(each * n_strays);
  for (Index k = 0; k < n_strays; ++k) {
    residual.segment(each * k, each) = weighted_residual.segment(each * strays[k], each);
    weight.segment(each * k, each) = data.weight_per_um.segment(each * strays[k], each);
  }
  const MatrixXd of_strays = weight.asDiagonal() * data.response->at_points(strays)->displace(force_derivatives);
  const MatrixXd all = numerics::gram(displace(data.reduced, force_derivatives, data.threads));
  const MatrixXd others = all - numerics::gram(of_strays);
  const VectorXd moved =
      numerics::shortest_solution(others, numerics::transposed_matvec(of_strays, residual)).cwiseAbs();
  const VectorXd variance = numerics::pseudo_inverse(all).diagonal();
  const VectorXd in_errors = moved.cwiseQuotient(variance.cwiseMax(1e-300).cwiseSqrt());
  const double most_moved =
      (variance.array() > 0).select(in_errors, 0).maxCoeff() / robust_scale(data, weighted_residual);
  const double without_them = weighted_residual.squaredNorm() - residual.squaredNorm();
  const double widened = weighted_residual.norm() / std::sqrt(std::max(without_them, 1e-300)) - 1;
  return std::max(most_moved, widened);
}

double robust_scale(const LinearData& data, const VectorXd& weighted_residual) {
  return inverse::scale_of(used_lengths(data, weighted_residual), data.dimension);
}

WeighedFit fit_reweighted(LinearData data, const network::Contractile& network, const std::vector<int>& adhesion_ids,
                          const FitParameters& parameters, Loss loss, int threads, TensionFit first) {
  WeighedFit found{std::move(first), std::move(data)};
  for (const Loss step : inverse::in_turn(loss)) {
    std::optional<double> scale;
    if (step == Loss::tukey) scale = robust_scale(found.data, weighted_residual(found.data, found.fit.trial.forces_nN));
    found = fit_with_loss(std::move(found.data), network, adhesion_ids, parameters, threads, std::move(found.fit), step,
                          scale);
  }
  return found;
}

double misfit_variance(const LinearData& data, const VectorXd& forces_nN, Index n_tensions, Loss loss) {
  const VectorXd residual = weighted_residual(data, forces_nN);
  const auto degrees = static_cast<double>(std::max<Index>(1, data.n_used - n_tensions));
  double variance = residual.squaredNorm() / degrees;
  const std::vector<double> lengths = used_lengths(data, residual);
  const Index each = data.dimension;
  const double scale = inverse::scale_of(lengths, each);
  if (loss != Loss::squares && scale > 0) variance = inverse::estimator_of(loss, lengths, scale, each).variance;
  return data.has_errors ? std::max(1.0, variance) : variance;
}

}  // namespace mbtfm::tensions
