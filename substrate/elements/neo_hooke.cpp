#include "substrate/elements/neo_hooke.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/report.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/material.h"

namespace mbtfm::elements {
namespace {

using CellVector = Eigen::Matrix<double, kUnknowns, 1>;
using CellPressures = Eigen::Matrix<double, kUnknowns, kPressures>;

/// Pairs of directions, of which a symmetric tangent has the others, too.
constexpr std::array<std::pair<int, int>, 6> kPairs = {{{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};

/// The equations of an element about a state, pressure and dilatation eliminated:
/// tangent du = -residual, then d theta and dp from du.
struct Condensed {
  MatrixXd tangent;
  CellVector residual;
  CellPressures divergence;  ///< B: (J F^-T : grad v, q)
  Eigen::Matrix4d mass_inverse, bulk;
  Eigen::Vector4d volume_gap, pressure_gap;  ///< (J - theta, q), (U' - p, q)
  double size = 0;                           ///< of the internal forces
  bool is_sound = true;                      ///< not turned inside out, its dilatation above zero
};

Condensed condensed(const NeoHooke& law, const Element& element, const NodeValues& u, const Eigen::Vector4d& pressure,
                    const Eigen::Vector4d& dilatation, bool with_tangent) {
  Condensed c;
  c.residual.setZero();
  c.divergence.setZero();
  c.bulk.setZero();
  c.volume_gap.setZero();
  c.pressure_gap.setZero();
  c.mass_inverse = element.mass.inverse();
  // the tangent's blocks of directions i <= k: slopes_a,J A(iJ, kL) slopes_b,L, summed over all points at once
  const Index n_slopes = with_tangent ? 3 * std::ssize(element.points) : 0;
  MatrixXd slopes(kNodes, n_slopes), weighed(kPairs.size() * kNodes, n_slopes);
  Index at = 0;
  for (const QuadraturePoint& point : element.points) {
    const Eigen::Matrix3d F = Eigen::Matrix3d::Identity() + u * point.slopes;
    const double J = F.determinant(), theta = dilatation.dot(point.pressures), p = pressure.dot(point.pressures);
    if (!(J > 0) || !(theta > 0)) {
      c.is_sound = false;
      return c;
    }
    const double weight = point.volume_um3;
    const Eigen::Matrix<double, 3, kNodes> force = weight * law.stress_kPa(F, p) * point.slopes.transpose();
    c.residual += Eigen::Map<const CellVector>(force.data());
    const Eigen::Matrix<double, 3, kNodes> spread = J * F.inverse().transpose() * point.slopes.transpose();
    c.divergence += weight * Eigen::Map<const CellVector>(spread.data()) * point.pressures.transpose();
    c.volume_gap += weight * (J - theta) * point.pressures;
    c.pressure_gap += weight * (law.pressure_kPa(theta) - p) * point.pressures;
    c.bulk += weight * law.pressure_slope_kPa(theta) * point.pressures * point.pressures.transpose();
    if (!with_tangent) continue;
    // A(iJ, kL) = d P_iJ / d F_kL
    Eigen::Matrix<double, 9, 9> A;
    for (int k = 0; k < 3; ++k) {
      for (int L = 0; L < 3; ++L) {
        Eigen::Matrix3d dF = Eigen::Matrix3d::Zero();
        dF(k, L) = weight;
        // rows 3 i + J: those of its transpose, column after column
        const Eigen::Matrix3d by_row = law.stress_change_kPa(F, p, dF).transpose();
        A.col(3 * k + L) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(by_row.data());
      }
    }
    for (std::size_t pair = 0; pair < kPairs.size(); ++pair) {
      const auto [i, k] = kPairs[pair];
      weighed.block<kNodes, 3>(pair * kNodes, at).noalias() = point.slopes.lazyProduct(A.block<3, 3>(3 * i, 3 * k));
    }
    slopes.middleCols<3>(at) = point.slopes;
    at += 3;
  }
  c.size = c.residual.norm();
  const CellPressures by_mass = c.divergence * c.mass_inverse;
  c.residual += by_mass * (c.bulk * (c.mass_inverse * c.volume_gap) + c.pressure_gap);
  if (with_tangent) {
    c.tangent = by_mass * c.bulk * by_mass.transpose();
    const MatrixXd blocks = weighed * slopes.transpose();
    for (std::size_t pair = 0; pair < kPairs.size(); ++pair) {
      const auto [i, k] = kPairs[pair];
      const auto block = blocks.middleRows<kNodes>(pair * kNodes);
      const auto rows = Eigen::seqN(i, Eigen::fix<kNodes>, 3), columns = Eigen::seqN(k, Eigen::fix<kNodes>, 3);
      c.tangent(rows, columns) += block;
      if (i != k) c.tangent(columns, rows) += block.transpose();
    }
  }
  return c;
}

/// Newton's method on one mesh.
class Solver {
 public:
  Solver(const Gel& gel, const Space& space, const LargeLoading& loading, const numerics::FactorOptions& options)
      : law_(gel), space_(space), loading_(loading), options_(options), forces_(space.nodes().size(), kNull) {
    const int n_cells = space.mesh().n_cells();
    elements_.reserve(n_cells);
    for (int cell = 0; cell < n_cells; ++cell) elements_.emplace_back(space.mesh().positions_of(cell));
    if (loading.traction_kPa) forces_ = space.traction_forces_nN(loading.traction_kPa);
    if (loading.force_kPa_per_um) {
      const Vectors by_volume = space.gather([&](int cell) {
        NodeValues sum = NodeValues::Zero();
        for (int q = 0; q < static_cast<int>(elements_[cell].points.size()); ++q) {
          const QuadraturePoint& point = elements_[cell].points[q];
          sum += point.volume_um3 * loading.force_kPa_per_um(point.position_um) * shapes_of_point(q).transpose();
        }
        return sum;
      });
      for (std::size_t k = 0; k < forces_.size(); ++k) forces_[k] += by_volume[k];
    }
    for (std::size_t k = 0; k < loading.at_nodes_nN.size(); ++k) forces_[k] += loading.at_nodes_nN[k];
    state_ = state_at_rest(space);
  }

  LargeSolution solve(int load_steps) {
    LargeSolution solution{.state = state_};
    double step = 1.0 / load_steps;
    constexpr double kLeastStep = 1.0 / 64;
    while (solution.share < 1) {
      const double share = std::min(1.0, solution.share + step);
      std::vector<double> residuals;
      state_ = solution.state;
      if (!converges(solution.share, share, residuals)) {
        step /= 2;
        if (step < kLeastStep) {
          solution.turned_over_um = turned_over_um_;
          return solution;
        }
        continue;
      }
      solution.state = state_;
      solution.share = share > 1 - 1e-12 ? 1 : share;
      solution.load_steps += 1;
      solution.most_iterations = std::max(solution.most_iterations, static_cast<int>(residuals.size()) - 1);
      solution.residuals = std::move(residuals);
    }
    return solution;
  }

 private:
  static inline const Eigen::Vector3d kNull = Eigen::Vector3d::Zero();
  static constexpr int kMiddle = 13;  ///< of the 27 points of the rule

  struct Assembled {
    Vectors residual;      ///< by free node: internal minus external forces
    double size = 0;       ///< of what it is to be compared with
    double gap = 0;        ///< largest of the dilatation's, relative
    int turned_over = -1;  ///< a cell that is; -1: none
    bool is_sound() const { return turned_over < 0; }
  };

  Condensed of_cell(int cell, bool with_tangent) const {
    return condensed(law_, elements_[cell], space_.values_of(cell, state_.at_nodes_um), state_.pressure_kPa[cell],
                     state_.dilatation[cell], with_tangent);
  }

  /// @param held_step_um  by node: how far those that are held still have to go; null: not at all
  Assembled residual(double share, const Vectors* held_step_um) const {
    Assembled sum;
    const int n_cells = space_.mesh().n_cells();
    std::vector<char> is_sound(n_cells, 1);
    std::vector<double> size(n_cells, 0), gap(n_cells, 0);
    sum.residual = space_.gather([&](int cell) -> NodeValues {
      const Condensed c = of_cell(cell, held_step_um != nullptr);
      is_sound[cell] = c.is_sound;
      if (!c.is_sound) return NodeValues::Zero();
      size[cell] = c.size;
      gap[cell] = (c.mass_inverse * c.volume_gap).norm();
      CellVector forces = c.residual;
      if (held_step_um) {
        const NodeValues step = space_.values_of(cell, *held_step_um);
        forces += c.tangent * Eigen::Map<const CellVector>(step.data());
      }
      return NodeValues(forces.data());
    });
    for (int cell = 0; cell < n_cells; ++cell) {
      if (!is_sound[cell]) sum.turned_over = cell;
      sum.size += size[cell] * size[cell];
      sum.gap = std::max(sum.gap, gap[cell]);
    }
    for (std::size_t k = 0; k < forces_.size(); ++k) sum.residual[k] -= share * forces_[k];
    sum.size = std::hypot(std::sqrt(sum.size), share * norm_of(forces_));
    return sum;
  }

  static double norm_of(const Vectors& values) {
    double sum = 0;
    for (const Eigen::Vector3d& v : values) sum += v.squaredNorm();
    return std::sqrt(sum);
  }

  static constexpr double kTolerance = 1e-10;
  /// Small, or no smaller than before where the method would square it: all digits are there. (Of a weak load they end
  /// sooner: rounding is that of the stress of F, which is nearly 1.)
  static bool is_met(const std::vector<double>& residuals) {
    constexpr double kNearEnough = 1e-6;
    const double last = residuals.back();
    return last < kTolerance ||
           (last < kNearEnough && residuals.size() > 1 && last > 0.1 * residuals[residuals.size() - 2]);
  }

  /// One step of the load. The state is that at `share` where it converges, rubbish otherwise.
  bool converges(double before, double share, std::vector<double>& residuals) {
    constexpr int kMostIterations = 15;
    Vectors held_step(state_.at_nodes_um.size(), kNull);
    if (loading_.held_um) {
      held_step = space_.spread(Vectors(forces_.size(), kNull), loading_.held_um);
      for (Eigen::Vector3d& v : held_step) v *= share - before;
    }
    bool moves_held = loading_.held_um != nullptr;
    for (int iteration = 0; iteration <= kMostIterations; ++iteration) {
      const Assembled now = residual(share, moves_held ? &held_step : nullptr);
      if (!now.is_sound()) {
        turned_over_um_ = elements_[now.turned_over].points[kMiddle].position_um;
        return false;
      }
      residuals.push_back(now.size > 0 ? norm_of(now.residual) / now.size : 0);
      if (!std::isfinite(residuals.back())) return false;
      if (!moves_held && is_met(residuals) && now.gap < kTolerance) return true;
      if (iteration == kMostIterations) return false;
      std::optional<Vectors> step = newton_step(now.residual);
      if (!step) return false;
      if (moves_held) {
        for (std::size_t k = 0; k < step->size(); ++k) (*step)[k] += held_step[k];
      }
      advance(*step);
      moves_held = false;
    }
    return false;
  }

  /// By node; nothing where the tangent is not positive definite.
  std::optional<Vectors> newton_step(const Vectors& residual_nN) const {
    Vectors forces(residual_nN.size());
    for (std::size_t k = 0; k < forces.size(); ++k) forces[k] = -residual_nN[k];
    try {
      const auto factor = space_.factorise([&](int cell) { return of_cell(cell, true).tangent; }, options_);
      return space_.spread(elements::solve(*factor, forces));
    } catch (const OutOfMemory&) {
      throw;
    } catch (const NotSolved&) {
      return std::nullopt;
    }
  }

  void advance(const Vectors& step) {
    numerics::parallel_for(space_.mesh().n_cells(), space_.threads(), [&](int cell) {
      const Condensed c = of_cell(cell, false);
      const NodeValues du = space_.values_of(cell, step);
      const Eigen::Vector4d d_theta =
          c.mass_inverse * (c.divergence.transpose() * Eigen::Map<const CellVector>(du.data()) + c.volume_gap);
      state_.dilatation[cell] += d_theta;
      state_.pressure_kPa[cell] += c.mass_inverse * (c.bulk * d_theta + c.pressure_gap);
    });
    for (std::size_t k = 0; k < step.size(); ++k) state_.at_nodes_um[k] += step[k];
  }

  NeoHooke law_;
  const Space& space_;
  LargeLoading loading_;
  numerics::FactorOptions options_;
  std::vector<Element> elements_;
  Vectors forces_;
  LargeState state_;
  std::optional<Eigen::Vector3d> turned_over_um_;
};

}  // namespace

NeoHooke::NeoHooke(const Gel& gel)
    : mu_kPa(substrate::shear_modulus_kPa(gel)),
      kappa_kPa(2 * mu_kPa * (1 + gel.poisson_ratio) / (3 * (1 - 2 * gel.poisson_ratio))) {}

Eigen::Matrix3d NeoHooke::stress_kPa(const Eigen::Matrix3d& F, double p_kPa) const {
  const double J = F.determinant();
  const Eigen::Matrix3d g = F.inverse().transpose();
  return mu_kPa * std::pow(J, -2.0 / 3) * (F - F.squaredNorm() / 3 * g) + p_kPa * J * g;
}

Eigen::Matrix3d NeoHooke::stress_change_kPa(const Eigen::Matrix3d& F, double p_kPa, const Eigen::Matrix3d& dF) const {
  const double J = F.determinant(), a = mu_kPa * std::pow(J, -2.0 / 3), trace = F.squaredNorm();
  const Eigen::Matrix3d g = F.inverse().transpose(), dg = -g * dF.transpose() * g;
  const double d_log_J = g.cwiseProduct(dF).sum();
  return a * (dF - 2.0 / 3 * F.cwiseProduct(dF).sum() * g - trace / 3 * dg) -
         2.0 / 3 * d_log_J * a * (F - trace / 3 * g) + p_kPa * J * (d_log_J * g + dg);
}

LargeState state_at_rest(const Space& space) {
  const auto n_cells = static_cast<std::size_t>(space.mesh().n_cells());
  return {Vectors(space.mesh().position_um.size(), Eigen::Vector3d::Zero()),
          std::vector<Eigen::Vector4d>(n_cells, {0, 0, 0, 0}), std::vector<Eigen::Vector4d>(n_cells, {1, 0, 0, 0})};
}

LargeSolution solve_neo_hooke_as_far(const Gel& gel, const Space& space, const LargeLoading& loading, int load_steps,
                                     const numerics::FactorOptions& options) {
  return Solver(gel, space, loading, options).solve(load_steps);
}

LargeSolution solve_neo_hooke(const Gel& gel, const Space& space, const LargeLoading& loading, int load_steps,
                              const numerics::FactorOptions& options) {
  LargeSolution solution = solve_neo_hooke_as_far(gel, space, loading, load_steps, options);
  if (solution.share == 1) return solution;
  std::string where;
  if (const auto& at = solution.turned_over_um) {
    where = ", where the gel would be turned inside out near x, y, z = " + brief(at->x()) + ", " + brief(at->y()) +
            ", " + brief(at->z()) + " um";
  }
  throw NotSolved(Report{.reason = "found no state at rest beyond " + brief(100 * solution.share) + " % of this load" +
                                   where + ": are units right, and areas of adhesions not too small?"});
}

std::function<MatrixXd(int cell)> large_stiffness_of(const Gel& gel, const Space& space, const LargeState& state) {
  return [law = NeoHooke(gel), &space, &state](int cell) {
    return condensed(law, Element(space.mesh().positions_of(cell)), space.values_of(cell, state.at_nodes_um),
                     state.pressure_kPa[cell], state.dilatation[cell], true)
        .tangent;
  };
}

StressLaw large_stress(const Gel& gel, const LargeState& state) {
  return {.at = [law = NeoHooke(gel)](const Eigen::Matrix3d& gradient, double pressure, double) -> Eigen::Matrix3d {
            const Eigen::Matrix3d F = Eigen::Matrix3d::Identity() + gradient;
            return law.stress_kPa(F, pressure) * F.transpose() / F.determinant();
          },
          .pressures = state.pressure_kPa};
}

}  // namespace mbtfm::elements
