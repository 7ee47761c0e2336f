#include "continuum/sheet/on_gel.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "continuum/sheet/stiffness.h"
#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::sheet {
namespace {

/// W u and Wᵀ F, by column.
struct Means {
  const Elements& elements;
  const std::vector<int>& triangles;
  const std::vector<std::array<double, 6>>& weights;

  Index n() const { return 2 * std::ssize(triangles); }
  MatrixXd of(const MatrixXd& u) const {
    MatrixXd means = MatrixXd::Zero(n(), u.cols());
    for (Index c = 0; c < u.cols(); ++c)
      for (std::size_t k = 0; k < triangles.size(); ++k)
        for (int i = 0; i < 6; ++i)
          means.col(c).segment<2>(2 * static_cast<Index>(k)) +=
              weights[k][i] * u.col(c).segment<2>(2 * elements.nodes(triangles[k])[i]);
    return means;
  }
  MatrixXd spread(const MatrixXd& forces) const {
    MatrixXd f = MatrixXd::Zero(2 * elements.n_nodes(), forces.cols());
    for (Index c = 0; c < forces.cols(); ++c)
      for (std::size_t k = 0; k < triangles.size(); ++k)
        for (int i = 0; i < 6; ++i)
          f.col(c).segment<2>(2 * elements.nodes(triangles[k])[i]) +=
              weights[k][i] * forces.col(c).segment<2>(2 * static_cast<Index>(k));
    return f;
  }
};

/// Motions of the sheet as a whole: by node, or as the patches' means have them.
MatrixXd rigid_motions(const Elements& elements) {
  MatrixXd rigid = MatrixXd::Zero(2 * elements.n_nodes(), 3);
  for (int i = 0; i < elements.n_nodes(); ++i) {
    const Vec2 x = elements.triangles().nodes_um[i];
    rigid.block<2, 3>(2 * i, 0) << 1, 0, -x.y, 0, 1, x.x;
  }
  return rigid;
}
/// Keeps rounding from growing: takes net force and torque off forces, and motions as a whole off displacements.
class Balanced {
 public:
  /// @param motions  of the patches  @param weight  of their components
  Balanced(MatrixXd motions, const VectorXd& weight)
      : motions_(std::move(motions)),
        weighted_(weight.asDiagonal() * motions_),
        factor_(motions_.transpose() * weighted_) {}
  MatrixXd forces(MatrixXd f) const { return f - weighted_ * factor_.solve(motions_.transpose() * f); }
  MatrixXd displacements(MatrixXd u) const { return u - motions_ * motion_in(u); }
  /// The motion in displacements.
  MatrixXd motion_in(const MatrixXd& u) const { return factor_.solve(weighted_.transpose() * u); }

 private:
  MatrixXd motions_, weighted_;
  Eigen::FullPivLU<Eigen::Matrix3d> factor_;
};

/// By column.
Eigen::RowVectorXd dots(const MatrixXd& a, const MatrixXd& b) { return a.cwiseProduct(b).colwise().sum(); }

/// Newton's step by conjugate gradients, to what its neighbours need; where the energy bends down along a step, what
/// was found before.
NodeVectors downhill(const std::function<NodeVectors(const NodeVectors&)>& stiffness, const Stiffness& preconditioner,
                     const NodeVectors& left_nN) {
  constexpr double kClose = 1e-5;  // of the energy norm
  constexpr int kMost = 300;
  NodeVectors found = NodeVectors::Zero(left_nN.size()), residual = left_nN, z = preconditioner.solve(residual),
              step = z;
  double energy = residual.dot(z);
  const double whole = energy;
  for (int k = 0; k < kMost && energy > kClose * kClose * whole; ++k) {
    const NodeVectors answer = stiffness(step);
    const double curvature = step.dot(answer);
    if (curvature <= 0) return k == 0 ? step : found;
    const double length = energy / curvature;
    found += length * step;
    residual -= length * answer;
    z = preconditioner.solve(residual);
    const double next = residual.dot(z);
    step = z + next / energy * step;
    energy = next;
  }
  return found;
}

constexpr double kTolerance = 1e-8;  // of the energy norm of the residual: u is asked to 1 %
constexpr int kMostIterations = 2000;

}  // namespace

OnGel::OnGel(const Elements& elements, const substrate::Substrate& gel, std::vector<int> adhering, int threads,
             std::optional<Held> held)
    : patches_(patches_of(elements, std::move(adhering))),
      threads_(threads),
      held_(held.value_or(held_for(patches_.n(), gel.capabilities()))),
      compliance_(compliance_of(patches_, gel, held_, threads)) {
  for (int k = 0; k < patches_.n(); ++k) {
    std::array<double, 6>& weights = weights_.emplace_back();
    for (int p = 0; p < Elements::kPoints; ++p)
      for (std::size_t i = 0; i < 6; ++i) weights[i] += patches_.share(k, p) * patches_.at(k, p).value[i];
  }
}

/// Of each patch's springs; 0 where it is bonded.
VectorXd OnGel::slip_um_per_nN(std::optional<double> adhesion_nN_per_um3) const {
  VectorXd slip = VectorXd::Zero(2 * patches_.n());
  if (!adhesion_nN_per_um3) return slip;
  for (Index i = 0; i < slip.size(); ++i) slip(i) = 1 / (*adhesion_nN_per_um3 * patches_.areas_um2[i / 2]);
  return slip;
}

/// What the gel under a patch and its neighbours is like.
VectorXd OnGel::spring_nN_per_um(const VectorXd& slip) const {
  constexpr double kNeighbours = 4;
  return (kNeighbours * compliance_->diagonal_um_per_nN() + slip).cwiseInverse();
}

/// Springs that represent the ground: by patch and component.
void OnGel::add_springs(Stiffness& stiffness, const VectorXd& spring) const {
  for (std::size_t k = 0; k < patches_.triangles.size(); ++k) {
    Stiffness::OfElement K = Stiffness::OfElement::Zero();
    const auto& w = weights_[k];
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j)
        for (int a = 0; a < 2; ++a) K(2 * i + a, 2 * j + a) = spring(2 * static_cast<Index>(k) + a) * w[i] * w[j];
    stiffness.add(patches_.triangles[k], K);
  }
}

OnGel::Solution OnGel::solve(const Material& material, std::optional<double> adhesion_nN_per_um3,
                             const NodeVectors& load_nN) const {
  Solutions all = solve_all(material, adhesion_nN_per_um3, load_nN);
  return {all.u, all.forces_nN, std::move(all.report)};
}

OnGel::Solutions OnGel::solve_all(const Material& material, std::optional<double> adhesion_nN_per_um3,
                                  const MatrixXd& loads_nN) const {
  const Elements& elements = *patches_.elements;
  const Means means{elements, patches_.triangles, weights_};
  const Index n = means.n();
  Stiffness free(elements, pins(elements)), held(elements, {});
  const VectorXd slip = slip_um_per_nN(adhesion_nN_per_um3), spring = spring_nN_per_um(slip);
  const auto ground_um = [&](const MatrixXd& forces) -> MatrixXd {
    return gel_um(forces) + slip.asDiagonal() * forces;
  };
  for (int t = 0; t < elements.n_triangles(); ++t) {
    const Stiffness::OfElement K = elastic_stiffness(elements, t, material);
    free.add(t, K);
    held.add(t, K);
  }
  add_springs(held, spring);
  if (!free.factorise(0, threads_) || !held.factorise(0, threads_))
    throw NotSolved({.reason = "the sheet has no stiffness: check its Young's modulus and thickness"});
  const MatrixXd rigid = rigid_motions(elements);
  const Balanced balanced(means.of(rigid), spring);
  const auto preconditioned = [&](const MatrixXd& r) -> MatrixXd {
    const MatrixXd scaled = spring.asDiagonal() * r;
    return balanced.forces(scaled - spring.asDiagonal() * means.of(held.solve(means.spread(scaled))));
  };
  const MatrixXd at_rest = free.solve(loads_nN);
  Solutions solution{{}, MatrixXd::Zero(n, loads_nN.cols()), {}};
  MatrixXd residual = balanced.displacements(means.of(at_rest)), z = preconditioned(residual), step = z;
  Eigen::RowVectorXd energy = dots(residual, z);
  const Eigen::RowVectorXd whole = energy.cwiseMax(std::numeric_limits<double>::min());
  const auto left = [&] { return std::sqrt(std::max(0.0, energy.cwiseQuotient(whole).maxCoeff())); };
  Report& report = solution.report;
  while (left() > kTolerance) {
    if (++report.iterations > kMostIterations)
      throw NotSolved({.converged = false,
                       .iterations = kMostIterations,
                       .last_change = left(),
                       .reason = "the sheet and its gel found no balance in " + std::to_string(kMostIterations) +
                                 " steps; residual " + brief(left())});
    const MatrixXd answer = ground_um(step) + means.of(free.solve(means.spread(step)));
    // of a load whose balance is found to the last digit nothing is left to divide by
    const auto over = [](double a, double b) { return b > 0 ? a / b : 0.0; };
    const Eigen::RowVectorXd length = energy.binaryExpr(dots(step, answer), over);
    solution.forces_nN += step * length.asDiagonal();
    residual = balanced.displacements(residual - answer * length.asDiagonal());
    z = preconditioned(residual);
    const Eigen::RowVectorXd next = dots(residual, z);
    step = z + step * next.binaryExpr(energy, over).asDiagonal();
    energy = next;
  }
  report.converged = true;
  report.last_change = left();
  report.reason = counted(report.iterations, "step", "steps") + " of conjugate gradients";
  solution.u = at_rest - free.solve(means.spread(solution.forces_nN));
  solution.u += rigid * balanced.motion_in(ground_um(solution.forces_nN) - means.of(solution.u));
  return solution;
}

OnGel::Solution OnGel::solve_large(const Sheet& sheet, ContractionMeasure measure,
                                   std::optional<double> adhesion_nN_per_um3) const {
  const Elements& elements = *patches_.elements;
  const Means means{elements, patches_.triangles, weights_};
  const LargeSheet large(elements, sheet, measure);
  const VectorXd slip = slip_um_per_nN(adhesion_nN_per_um3), spring = spring_nN_per_um(slip);
  MatrixXd ground = compliance_->matrix_um_per_nN();
  ground.diagonal() += slip;
  if (!numerics::upper_cholesky(ground, threads_))
    throw NotSolved({.reason = "the gel's answer to the patches is not definite; strain = small"});
  const auto forces_of = [&](const NodeVectors& u) -> VectorXd {
    MatrixXd forces = means.of(u);
    numerics::solve_upper_transposed(ground, forces);
    numerics::solve_upper(ground, forces);
    return forces;
  };
  Stiffness held(elements, {});
  const LoadedSheet loaded{
      .energy_fJ =
          [&](const NodeVectors& u, double share) {
            return large.energy_fJ(u, share) + 0.5 * forces_of(u).dot(VectorXd(means.of(u)));
          },
      .left_nN = [&](const NodeVectors& u, double share) -> NodeVectors {
        return large.left_nN(u, share) - means.spread(forces_of(u));
      },
      .move = [&](const NodeVectors& u, double share, const NodeVectors& left) -> std::optional<NodeVectors> {
        held.set_zero();
        large.add_to(held, u, share);
        add_springs(held, spring);
        if (!factorise_shifted(held, threads_)) return std::nullopt;
        return downhill(
            [&](const NodeVectors& step) -> NodeVectors {
              return large.change_nN(u, share, step) + means.spread(forces_of(step));
            },
            held, left);
      },
      .force_scale_nN = forces_of_contraction_nN(elements, sheet).norm()};
  LargeStrain found = in_load_steps(loaded, 2 * elements.n_nodes());
  VectorXd forces_nN = forces_of(found.u);
  return {std::move(found.u), std::move(forces_nN), std::move(found.report)};
}

OnGel::Reduced OnGel::reduced(const MatrixXd& forces_nN, double poisson_ratio, const MatrixXd& loads_nN) const {
  const Elements& elements = *patches_.elements;
  const Means means{elements, patches_.triangles, weights_};
  const Material unit{1 - poisson_ratio * poisson_ratio, poisson_ratio, 1};
  Stiffness free(elements, pins(elements));
  for (int t = 0; t < elements.n_triangles(); ++t) free.add(t, elastic_stiffness(elements, t, unit));
  const bool is_definite = free.factorise(0, threads_);
  MBTFM_ASSERT(is_definite);
  const MatrixXd spread = means.spread(forces_nN);
  return {.gel = forces_nN.transpose() * gel_um(forces_nN),
          .slip = forces_nN.transpose() * slip_um_per_nN(1.0).asDiagonal() * forces_nN,
          .sheet = spread.transpose() * free.solve(spread),
          .pull = spread.transpose() * free.solve(loads_nN)};
}

}  // namespace mbtfm::sheet
