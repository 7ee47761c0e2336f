#include "mbtfm/tensions/model_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "mbtfm/tensions/search.h"
#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/distributions.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/compliance.h"

namespace mbtfm::tensions {

namespace {

/// Where the adhesions are pulled at: components × adhesions.
MatrixXd places_of(const std::vector<Adhesion>& adhesions, const LinearData& data) {
  MatrixXd places_um(data.dimension, std::ssize(adhesions));
  for (Index a = 0; a < places_um.cols(); ++a) {
    const auto& [x, y] = adhesions[a].position_um;
    places_um.col(a) = Eigen::Vector3d(x, y, data.held_um.empty() ? 0 : -data.held_um[a]).head(data.dimension);
  }
  return places_um;
}

using Pair = std::array<std::size_t, 2>;  ///< of adhesions, by their place in the list

/// From one to the other.
ShortVector direction_of(const Pair& pair, const MatrixXd& places_um) {
  ShortVector chord = places_um.col(static_cast<Index>(pair[1])) - places_um.col(static_cast<Index>(pair[0]));
  chord.normalize();
  return chord;
}

/// Forces at these places of fibres between two of them each, of tension 1: components·places × pairs.
MatrixXd chords(const MatrixXd& places_um, const std::vector<Pair>& pairs) {
  MatrixXd forces = MatrixXd::Zero(places_um.size(), std::ssize(pairs));
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    auto by_place = forces.col(static_cast<Index>(k)).reshaped(places_um.rows(), places_um.cols());
    by_place.col(static_cast<Index>(pairs[k][0])) = direction_of(pairs[k], places_um);
    by_place.col(static_cast<Index>(pairs[k][1])) = -direction_of(pairs[k], places_um);
  }
  return forces;
}

/// Of the adhesion in the list.
std::size_t place_of(int adhesion_id, const std::vector<Adhesion>& adhesions) {
  const auto at = std::ranges::find(adhesions, adhesion_id, &Adhesion::adhesion_id);
  return static_cast<std::size_t>(at - adhesions.begin());
}

constexpr double kTradeOff = -0.95;  // see fibres_not_distinguished

/// Forces of the one tension of all cables that fits best: Gauss–Newton in one variable. Zero where the beads want the
/// cables to push: less tension is better then down to none, as forces are proportional to a small one.
VectorXd best_uniform_nN(const TensionProblem& problem) {
  const VectorXd ones = VectorXd::Ones(problem.n_tensions());
  Trial trial = scaled_to_data(problem, ones);
  constexpr int kMaxSteps = 20;  // forces are all but proportional to the tension: three do
  for (int i = 0; i < kMaxSteps; ++i) {
    const double tension = trial.tensions_nN[0];
    const VectorXd slope = numerics::matvec(problem.jacobian(trial), ones);
    const double step = -slope.dot(trial.residual) / std::max(slope.squaredNorm(), 1e-300);
    const bool is_pushed = tension + step <= 0 && 0.5 * problem.data().target.squaredNorm() <= trial.objective;
    if (is_pushed) return VectorXd::Zero(trial.forces_nN.size());
    const double next = std::max(0.1 * tension, tension + step);
    Trial moved = problem.evaluate(next * ones, &trial);
    if (moved.objective >= trial.objective) break;
    trial = std::move(moved);
    if (std::abs(next - tension) < 1e-6 * tension) break;
  }
  return trial.forces_nN;
}

}  // namespace

MatrixXd correlation_of(const EnsembleFit& fit) {
  VectorXd scale = fit.tensions.covariance_nN2.diagonal().cwiseSqrt();
  for (double& s : scale) s = s > 0 ? 1 / s : 0;
  return numerics::scaled_on_both_sides(fit.tensions.covariance_nN2, scale);
}

std::vector<FibreGroup> fibres_not_distinguished(const EnsembleFit& fit) {
  const MatrixXd correlation = correlation_of(fit);
  const int n = static_cast<int>(correlation.rows());
  std::vector<bool> is_placed(static_cast<std::size_t>(n), false);
  std::vector<FibreGroup> groups;
  for (int seed = 1; seed < n; ++seed) {
    if (is_placed[seed]) continue;
    FibreGroup group{.indices = {seed}, .sum_nN = {}};
    for (std::size_t next = 0; next < group.indices.size(); ++next) {
      for (int j = seed + 1; j < n; ++j) {
        const bool is_member = std::find(group.indices.begin(), group.indices.end(), j) != group.indices.end();
        if (!is_member && correlation(group.indices[next], j) < kTradeOff) group.indices.push_back(j);
      }
    }
    if (group.indices.size() < 2) continue;
    std::sort(group.indices.begin(), group.indices.end());
    for (const int i : group.indices) is_placed[i] = true;
    group.sum_nN = sum_of(fit, group.indices);
    groups.push_back(std::move(group));
  }
  return groups;
}

Influence influence_of(const EnsembleFit& fit, const LinearData& data) {
  // With the reduced data y = C⁻ᵀ Gᵀ W² u the tensions change by K (C D)ᵀ dy = K (C D)ᵀ C (CᵀC)⁻¹ Gᵀ W² du, D = dR/dt;
  // a component's own standard error is 1/w.
  const MeshFit& mesh = fit.meshes.front();
  const BeadAnswers answers(data, solve_normal(data.reduced, mesh.by_force.transpose()).transpose());
  const VectorXd own_error = data.weight_per_um.unaryExpr([](double w) { return w > 0 ? 1 / w : 0; });
  const Index n_beads = data.bead_weight.size();
  Influence influence{
      .variance = VectorXd(answers.n_rows()),
      .n_informing_beads = VectorXd(answers.n_rows()),
      .most_informed = std::vector<int>(static_cast<std::size_t>(n_beads), fit.tensions.fibre_ids.front())};
  VectorXd largest = VectorXd::Zero(n_beads);
  answers.for_each_block([&](Index first, const MatrixXd& block) {
    for (Index k = 0; k < block.rows(); ++k) {
      const Index i = first + k;
      const double standard_error = std::max(std::sqrt(mesh.covariance_nN2(i, i)), 1e-300);
      const VectorXd row = block.row(k).transpose().cwiseProduct(own_error) / standard_error;
      VectorXd by_bead(n_beads);
      for (Index b = 0; b < n_beads; ++b) {
        by_bead[b] = row.segment(data.dimension * b, data.dimension).squaredNorm();
        if (by_bead[b] <= largest[b]) continue;
        largest[b] = by_bead[b];
        influence.most_informed[b] = fit.tensions.fibre_ids[i];
      }
      const double sum_of_squares = by_bead.squaredNorm();
      influence.variance[i] = by_bead.sum();
      influence.n_informing_beads[i] = sum_of_squares > 0 ? std::pow(by_bead.sum(), 2) / sum_of_squares : 0;
    }
  });
  return influence;
}

std::vector<ModelScore> compare_models(const EnsembleFit& fit, const LinearData& data,
                                       const network::Contractile& first_network,
                                       const std::vector<int>& adhesion_ids) {
  const ReducedData& reduced = data.reduced;
  const double variance = noise_variance(data);
  const auto misfit = [&](const VectorXd& forces) {
    return (numerics::matvec(*reduced.compliance, forces) - reduced.target).squaredNorm() + reduced.floor_squared;
  };
  const VectorXd uniform = best_uniform_nN(TensionProblem(first_network, reduced, adhesion_ids));
  const auto scored = [&](const char* name, Index n_parameters, double left, const VectorXd& forces_nN) {
    ModelScore model = score_of(name, n_parameters, left / variance, relative_l2(data, forces_nN), data);
    model.left_um = data.displacement_um - data.response->displace(forces_nN);
    model.forces_nN = forces_nN;
    return model;
  };
  std::vector<ModelScore> models = {
      scored("no-fibres", 1, misfit(uniform), uniform),
      scored("full", std::ssize(fit.tensions.fibre_ids), misfit(fit.forces.nN), fit.forces.nN),
      scored("adhesion-forces", reduced.n_felt, reduced.floor_squared, free_forces_nN(reduced))};
  models.back().left_um.resize(0);
  return models;
}

std::vector<FibreLeftOut> leave_each_fibre_out(const EnsembleFit& fit, const Influence& influence) {
  std::vector<FibreLeftOut> fibres;
  for (Index i = 1; i < static_cast<Index>(fit.tensions.fibre_ids.size()); ++i) {
    FibreLeftOut left{.fibre_id = fit.tensions.fibre_ids[i], .n_informing_beads = influence.n_informing_beads[i]};
    for (const MeshFit& mesh : fit.meshes) {
      // Where t_i is held to t_0, 2 Phi rises by (t_i − t_0)² / Var(t_i − t_0), Var in units of the noise.
      const MatrixXd& c = mesh.covariance_nN2;
      const double difference = mesh.local.tensions_nN[i] - mesh.local.tensions_nN[0];
      const double variance = c(i, i) + c(0, 0) - 2 * c(i, 0);
      if (difference <= 0 || variance <= 0) continue;  // no stronger than the network: it costs nothing to leave it out
      left.chi_squared_rise += difference * difference / variance / static_cast<double>(fit.meshes.size());
    }
    left.aic_rise = left.chi_squared_rise - 2;
    fibres.push_back(left);
  }
  return fibres;
}

LinearData with_missing_fibres(LinearData data, const std::vector<Adhesion>& adhesions,
                               const std::vector<MissingFibre>& fibres, Index n_last) {
  std::vector<Pair> pairs;
  VectorXd tensions_nN(std::ssize(fibres));
  for (std::size_t k = 0; k < fibres.size(); ++k) {
    pairs.push_back({place_of(fibres[k].start_adhesion_id, adhesions), place_of(fibres[k].end_adhesion_id, adhesions)});
    tensions_nN[static_cast<Index>(k)] = fibres[k].tension_nN;
  }
  // Ten times what was found bounds nothing, but forces along these pairs are then no direction without any meaning.
  constexpr double kAnySize = 10;
  const MatrixXd forces = chords(places_of(adhesions, data), pairs);
  Motions motions = joined_ahead(data.motions, n_last,
                                 {.shapes = data.response->displace(forces),
                                  .precision = (kAnySize * tensions_nN).cwiseAbs2().cwiseInverse(),
                                  .forces = forces});
  return with_motions(std::move(data), std::move(motions));
}

VectorXd segmentation_variance_nN2(const VectorXd& forces_nN, const std::vector<Adhesion>& adhesions,
                                   const SegmentationErrors& errors) {
  VectorXd variance(forces_nN.size());
  const double turn_rad = errors.adhesion_angle_error_deg * std::numbers::pi / 180;
  for (std::size_t a = 0; a < adhesions.size(); ++a) {
    const Index each = forces_nN.size() / std::ssize(adhesions), row = each * static_cast<Index>(a);
    const double shift = errors.adhesion_shift_error_um / substrate::ellipse_of(adhesions[a]).semi_minor_um;
    const double share = std::hypot(shift, errors.adhesion_area_error / 2, turn_rad);
    variance.segment(row, each).setConstant(share * share * forces_nN.segment(row, each).squaredNorm());
  }
  return variance;
}

namespace {

/// Fibres from adhesion to adhesion, all found together: what the beads show of each, given the others.
class FibresTogether {
 public:
  /// @param K, q  curvature and slope of the misfit by the forces on these adhesions, in units of the noise
  FibresTogether(MatrixXd places_um, MatrixXd K, VectorXd q)
      : places_um_(std::move(places_um)), K_(std::move(K)), q_(std::move(q)) {}

  struct FittedPairs {
    std::vector<Pair> pairs;        ///< those that pull
    VectorXd tension_nN, sigma_nN;  ///< of each
    double gain = 0;                ///< how much less misfit all of them leave
  };
  /// Least squares with tensions of zero or more; those that would push are left out, the hardest pushing first.
  FittedPairs fit_pairs(std::vector<Pair> pairs) const {
    while (!pairs.empty()) {
      const MatrixXd V = chords(places_um_, pairs);
      const MatrixXd inverse =
          numerics::inverse_symmetric(numerics::small_product(numerics::small_transposed_product(V, K_), V));
      const VectorXd slopes = numerics::transposed_matvec(V, q_), t = numerics::matvec(inverse, slopes);
      Index least = 0;
      if (t.minCoeff(&least) > 0)
        return {std::move(pairs), t, inverse.diagonal().cwiseMax(0).cwiseSqrt(), slopes.dot(t)};
      pairs.erase(pairs.begin() + least);
    }
    return {};
  }
  /// Crossing fibres pull at the same four adhesions whichever two belong together: partners are exchanged between two
  /// pairs as long as all of them together then leave less misfit.
  FittedPairs with_best_partners(std::vector<Pair> pairs) const {
    double best = fit_pairs(pairs).gain;
    for (bool has_changed = true; has_changed;) {
      has_changed = false;
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
          for (const std::size_t end : {std::size_t{0}, std::size_t{1}}) {
            std::vector<Pair> exchanged = pairs;
            std::swap(exchanged[i][1], exchanged[j][end]);
            const double gain = fit_pairs(exchanged).gain;
            if (gain <= best * (1 + 1e-9)) continue;
            best = gain;
            pairs = std::move(exchanged);
            has_changed = true;
          }
        }
      }
    }
    return fit_pairs(std::move(pairs));
  }

 private:
  MatrixXd places_um_;
  MatrixXd K_;
  VectorXd q_;
};

}  // namespace

std::vector<MissingFibre> missing_fibres(const EnsembleFit& fit, const std::vector<Adhesion>& adhesions,
                                         const SegmentationErrors& segmentation, int threads) {
  const double n_pairs = 0.5 * static_cast<double>(adhesions.size()) * (static_cast<double>(adhesions.size()) - 1);
  if (n_pairs < 1) return {};
  const double limit = numerics::normal_quantile(1 - 0.01 / n_pairs);
  const double variance = fit.model_error ? fit.model_error->noise_variance : fit.misfit.variance;
  const Left left(fit,
                  fit.model_error ? fit.model_error->force_variance_nN2 +
                                        segmentation_variance_nN2(fit.forces.nN, adhesions, segmentation)
                                  : VectorXd(),
                  variance, threads);
  const VectorXd& q = left.force_scores();
  const Index each = fit.data.dimension;
  const MatrixXd places_um = places_of(adhesions, fit.data);

  std::vector<std::pair<double, Pair>> found;      // by how much less misfit each alone would leave
  std::vector<ShortMatrix> own(adhesions.size());  // blocks of K = Cᵀ P C on its diagonal
  left.for_each_block([&](Index first, const MatrixXd& K) {
    for (auto b = static_cast<std::size_t>(first / each); each * static_cast<Index>(b) < K.rows(); ++b) {
      const auto j = each * static_cast<Index>(b);
      own[b] = K.block(j, j - first, each, each).selfadjointView<Eigen::Upper>();
      if (adhesions[b].origin == AdhesionOrigin::beads) continue;  // the last ones
      for (std::size_t a = 0; a < b; ++a) {
        const ShortVector e = direction_of({a, b}, places_um);  // the fibre pulls a towards b, and b towards a
        const auto i = each * static_cast<Index>(a);
        const ShortMatrix between = K.block(i, j - first, each, each);
        const double slope = e.dot(q.segment(i, each) - q.segment(j, each));
        const double curvature = e.dot((own[a] + own[b]) * e) - 2 * e.dot(between * e);
        if (slope <= 0 || curvature <= 0) continue;
        const double gain = slope * slope / curvature / variance;
        if (gain < limit * limit) continue;
        found.push_back({gain, {a, b}});
      }
    }
  });
  std::ranges::stable_sort(found, std::greater(), &std::pair<double, Pair>::first);
  if (found.empty()) return {};
  std::vector<std::size_t> ends;  // adhesions, each once: two for each fibre
  const auto is_end = [&](std::size_t a) { return std::ranges::find(ends, a) != ends.end(); };
  for (const auto& [gain, pair] : found)
    if (ends.size() < 2 * kMostMissingFibres && !is_end(pair[0]) && !is_end(pair[1]))
      ends.insert(ends.end(), pair.begin(), pair.end());
  std::vector<Index> components;
  std::vector<Pair> pairs;
  for (std::size_t k = 0; k < ends.size(); ++k) {
    for (Index c = 0; c < each; ++c) components.push_back(each * static_cast<Index>(ends[k]) + c);
    if (k % 2 == 1) pairs.push_back({k - 1, k});
  }
  const Scores there = left.scores_of(components);
  const FibresTogether together(places_um(Eigen::all, ends), there.information / variance,
                                there.scores / std::sqrt(variance));
  FibresTogether::FittedPairs fitted = together.with_best_partners(std::move(pairs));
  const auto gains = [&] { return VectorXd(fitted.tension_nN.cwiseQuotient(fitted.sigma_nN).cwiseAbs2()); };
  for (Index least = 0; !fitted.pairs.empty() && gains().minCoeff(&least) < limit * limit;) {
    fitted.pairs.erase(fitted.pairs.begin() + least);
    fitted = together.fit_pairs(std::move(fitted.pairs));
  }
  std::vector<MissingFibre> best;
  for (std::size_t k = 0; k < fitted.pairs.size(); ++k) {
    const auto [a, b] = fitted.pairs[k];
    const auto [first, second] = std::minmax(ends[a], ends[b]);
    best.push_back({.start_adhesion_id = adhesions[first].adhesion_id,
                    .end_adhesion_id = adhesions[second].adhesion_id,
                    .tension_nN = fitted.tension_nN[static_cast<Index>(k)],
                    .chi_squared_gain = gains()[static_cast<Index>(k)]});
  }
  std::ranges::stable_sort(best, std::greater(), &MissingFibre::chi_squared_gain);
  return best;
}

namespace {

FibreType exchanged(FibreType type) {
  if (type == FibreType::dorsal) return FibreType::ventral;
  return type == FibreType::ventral ? FibreType::dorsal : type;
}

}  // namespace

CrossValidation cross_validate(const TensionProblem& problem, const LinearData& data, const Trial& around,
                               const std::vector<FibreType>& types, const TypeTensions& tensions, int n_draws,
                               std::uint64_t seed, int threads) {
  MBTFM_ASSERT(static_cast<int>(types.size()) + 1 == problem.n_tensions());
  CrossValidation result;
  result.own.resize(static_cast<std::size_t>(n_draws));
  result.exchanged = result.own;
  numerics::parallel_for(2 * n_draws, threads, [&](int k) {
    const bool is_exchanged = k >= n_draws;
    const auto draw = static_cast<std::size_t>(is_exchanged ? k - n_draws : k);
    // the same numbers for both, so that they differ by the types alone
    std::mt19937_64 random(seed + 1000003 * (draw + 1));
    VectorXd drawn = around.tensions_nN;
    for (std::size_t i = 0; i < types.size(); ++i) {
      const std::vector<double>& choice = tensions.at(is_exchanged ? exchanged(types[i]) : types[i]);
      drawn[static_cast<Index>(i) + 1] = choice[random() % choice.size()];
    }
    (is_exchanged ? result.exchanged : result.own)[draw] =
        relative_l2(data, problem.evaluate(drawn, &around).forces_nN);
  });
  return result;
}

}  // namespace mbtfm::tensions
