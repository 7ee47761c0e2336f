#include "continuum/sheet/on_gel.h"

#include <Eigen/LU>
#include <cmath>

#include "continuum/sheet/stiffness.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::sheet {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// W u and Wᵀ F.
struct Means {
  const Elements& elements;
  const std::vector<int>& triangles;
  const std::vector<std::array<double, 6>>& weights;

  Index n() const { return 2 * std::ssize(triangles); }
  VectorXd of(const NodeVectors& u) const {
    VectorXd means = VectorXd::Zero(n());
    for (std::size_t k = 0; k < triangles.size(); ++k)
      for (int i = 0; i < 6; ++i)
        means.segment<2>(2 * static_cast<Index>(k)) +=
            weights[k][i] * u.segment<2>(2 * elements.nodes(triangles[k])[i]);
    return means;
  }
  NodeVectors spread(const VectorXd& forces) const {
    NodeVectors f = NodeVectors::Zero(2 * elements.n_nodes());
    for (std::size_t k = 0; k < triangles.size(); ++k)
      for (int i = 0; i < 6; ++i)
        f.segment<2>(2 * elements.nodes(triangles[k])[i]) +=
            weights[k][i] * forces.segment<2>(2 * static_cast<Index>(k));
    return f;
  }
};

/// Motions of the sheet as a whole: by node, or as the patches' means have them.
Eigen::MatrixXd rigid_motions(const Elements& elements) {
  Eigen::MatrixXd rigid = Eigen::MatrixXd::Zero(2 * elements.n_nodes(), 3);
  for (int i = 0; i < elements.n_nodes(); ++i) {
    const Vec2 x = elements.triangles().nodes_um[static_cast<std::size_t>(i)];
    rigid.block<2, 3>(2 * i, 0) << 1, 0, -x.y, 0, 1, x.x;
  }
  return rigid;
}
Eigen::MatrixXd of_patches(const Eigen::MatrixXd& rigid, const Means& means) {
  Eigen::MatrixXd patches(means.n(), 3);
  for (int k = 0; k < 3; ++k) patches.col(k) = means.of(rigid.col(k));
  return patches;
}

/// Keeps rounding from growing: takes net force and torque off forces, and motions as a whole off displacements.
class Balanced {
 public:
  /// @param motions  of the patches  @param weight  of their components
  Balanced(Eigen::MatrixXd motions, const VectorXd& weight)
      : motions_(std::move(motions)),
        weighted_(weight.asDiagonal() * motions_),
        factor_(motions_.transpose() * weighted_) {}
  VectorXd forces(VectorXd f) const { return f - weighted_ * factor_.solve(motions_.transpose() * f); }
  VectorXd displacements(VectorXd u) const { return u - motions_ * factor_.solve(weighted_.transpose() * u); }
  /// The motion in a displacement.
  Eigen::Vector3d motion_in(const VectorXd& u) const { return factor_.solve(weighted_.transpose() * u); }

 private:
  Eigen::MatrixXd motions_, weighted_;
  Eigen::FullPivLU<Eigen::Matrix3d> factor_;
};

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

/// Of each patch's springs.
VectorXd OnGel::slip_um_per_nN(double adhesion_nN_per_um3) const {
  VectorXd slip(2 * patches_.n());
  for (Index i = 0; i < slip.size(); ++i)
    slip(i) = 1 / (adhesion_nN_per_um3 * patches_.areas_um2[static_cast<std::size_t>(i / 2)]);
  return slip;
}

OnGel::Solution OnGel::solve(const Material& material, std::optional<double> adhesion_nN_per_um3,
                             const NodeVectors& load_nN) const {
  const Elements& elements = *patches_.elements;
  const Means means{elements, patches_.triangles, weights_};
  const Index n = means.n();
  Stiffness free(elements, pins(elements)), held(elements, {});
  const VectorXd slip = adhesion_nN_per_um3 ? slip_um_per_nN(*adhesion_nN_per_um3) : VectorXd::Zero(n);
  constexpr double kNeighbours = 4;  // what the gel under a patch and its neighbours is like
  const VectorXd spring = (kNeighbours * compliance_->diagonal_um_per_nN() + slip).cwiseInverse();
  const auto ground_um = [&](const VectorXd& forces) -> VectorXd { return gel_um(forces) + slip.cwiseProduct(forces); };
  for (int t = 0; t < elements.n_triangles(); ++t) {
    const Stiffness::OfElement K = elastic_stiffness(elements, t, material);
    free.add(t, K);
    held.add(t, K);
  }
  for (std::size_t k = 0; k < patches_.triangles.size(); ++k) {
    Stiffness::OfElement K = Stiffness::OfElement::Zero();
    const auto& w = weights_[k];
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j)
        for (int a = 0; a < 2; ++a) K(2 * i + a, 2 * j + a) = spring(2 * static_cast<Index>(k) + a) * w[i] * w[j];
    held.add(patches_.triangles[k], K);
  }
  if (!free.factorise(0, threads_) || !held.factorise(0, threads_))
    throw NotSolved({.reason = "the sheet has no stiffness: check its Young's modulus and thickness"});
  const Eigen::MatrixXd rigid = rigid_motions(elements);
  const Balanced balanced(of_patches(rigid, means), spring);
  const auto preconditioned = [&](const VectorXd& r) -> VectorXd {
    const VectorXd scaled = spring.cwiseProduct(r);
    const VectorXd taken = means.of(held.solve(means.spread(scaled)));
    return balanced.forces(scaled - spring.cwiseProduct(taken));
  };
  const VectorXd at_rest = free.solve(load_nN);
  Solution solution{{}, VectorXd::Zero(n), {}};
  VectorXd residual = balanced.displacements(means.of(at_rest)), z = preconditioned(residual), step = z;
  double energy = residual.dot(z);
  const double whole = energy;
  Report& report = solution.report;
  while (energy > kTolerance * kTolerance * whole) {
    if (++report.iterations > kMostIterations)
      throw NotSolved({.converged = false,
                       .iterations = kMostIterations,
                       .last_change = std::sqrt(energy / whole),
                       .reason = "the sheet and its gel found no balance in " + std::to_string(kMostIterations) +
                                 " steps; residual " + brief(std::sqrt(energy / whole))});
    const VectorXd answer = ground_um(step) + means.of(free.solve(means.spread(step)));
    const double length = energy / step.dot(answer);
    solution.forces_nN += length * step;
    residual = balanced.displacements(residual - length * answer);
    z = preconditioned(residual);
    const double next = residual.dot(z);
    step = z + (next / energy) * step;
    energy = next;
  }
  report.converged = true;
  report.last_change = whole > 0 ? std::sqrt(energy / whole) : 0;
  report.reason = std::to_string(report.iterations) + " steps of conjugate gradients";
  solution.u = at_rest - free.solve(means.spread(solution.forces_nN));
  solution.u += rigid * balanced.motion_in(ground_um(solution.forces_nN) - means.of(solution.u));
  return solution;
}

OnGel::Reduced OnGel::reduced(const Eigen::MatrixXd& forces_nN, double poisson_ratio,
                              const NodeVectors& load_nN) const {
  const Elements& elements = *patches_.elements;
  const Means means{elements, patches_.triangles, weights_};
  const Material unit{1 - poisson_ratio * poisson_ratio, poisson_ratio, 1};
  Stiffness free(elements, pins(elements));
  for (int t = 0; t < elements.n_triangles(); ++t) free.add(t, elastic_stiffness(elements, t, unit));
  const bool is_definite = free.factorise(0, threads_);
  MBTFM_ASSERT(is_definite);
  Eigen::MatrixXd loads(load_nN.size(), forces_nN.cols() + 1), on_gel(forces_nN.rows(), forces_nN.cols());
  for (Index k = 0; k < forces_nN.cols(); ++k) {
    loads.col(k) = means.spread(forces_nN.col(k));
    on_gel.col(k) = gel_um(forces_nN.col(k));
  }
  loads.rightCols(1) = load_nN;
  const Eigen::MatrixXd u = free.solve(loads);
  const Eigen::MatrixXd work = loads.leftCols(forces_nN.cols()).transpose() * u;
  return {.gel = forces_nN.transpose() * on_gel,
          .slip = forces_nN.transpose() * slip_um_per_nN(1).asDiagonal() * forces_nN,
          .sheet = work.leftCols(forces_nN.cols()),
          .pull = work.rightCols(1)};
}

}  // namespace mbtfm::sheet
