#include "continuum/sheet/on_gel.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "continuum/sheet/stiffness.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/neighbour_bins.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/loads.h"
#include "substrate/response.h"

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

substrate::Ellipse ellipse_of(Vec2 a, Vec2 b, Vec2 c) {
  const Vec2 centre = 1.0 / 3 * (a + b + c);
  Eigen::Matrix2d inertia = Eigen::Matrix2d::Zero();
  for (const Vec2 p : {a, b, c}) {
    const Eigen::Vector2d d(p.x - centre.x, p.y - centre.y);
    inertia += d * d.transpose() / 12;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(inertia);
  const double ratio = std::sqrt(axes.eigenvalues()(1) / axes.eigenvalues()(0));
  const double product = 0.5 * std::abs(cross(b - a, c - a)) / std::numbers::pi;
  const Eigen::Vector2d major = axes.eigenvectors().col(1);
  const double semi_major = std::sqrt(product * ratio);
  return {centre, semi_major, std::min(semi_major, product / semi_major), std::atan2(major.y(), major.x())};
}

substrate::Ellipse patch_of(const Elements& elements, int triangle) {
  const auto corner = [&](std::size_t i) {
    return elements.triangles().nodes_um[static_cast<std::size_t>(elements.nodes(triangle)[i])];
  };
  substrate::Ellipse ellipse = ellipse_of(corner(0), corner(1), corner(2));
  const double area = elements.area_um2(triangle);  // of the curved triangle
  const double scale = std::sqrt(area / (std::numbers::pi * ellipse.semi_major_um * ellipse.semi_minor_um));
  ellipse.semi_major_um *= scale;
  ellipse.semi_minor_um *= scale;
  ellipse.centre_um = {};
  for (int p = 0; p < Elements::kPoints; ++p)
    ellipse.centre_um += elements.at(triangle, p).weight_um2 / area * elements.at(triangle, p).place_um;
  return ellipse;
}

OnGel::OnGel(const Elements& elements, const substrate::Substrate& gel, std::optional<double> adhesion_nN_per_um3,
             std::vector<int> adhering, int threads)
    : elements_(elements), threads_(threads), adhesion_(adhesion_nN_per_um3), adhering_(std::move(adhering)) {
  if (adhering_.size() < 2)
    throw InvalidData("where the sheet adheres", "two of its triangles or more", std::to_string(adhering_.size()));
  std::vector<Vec2> centres;
  for (const int t : adhering_) {
    ellipses_.push_back(patch_of(elements, t));
    centres.push_back(ellipses_.back().centre_um);
    areas_um2_.push_back(elements.area_um2(t));
    std::array<double, 6>& weights = weights_.emplace_back();
    for (int p = 0; p < Elements::kPoints; ++p)
      for (std::size_t i = 0; i < 6; ++i)
        weights[i] += elements.at(t, p).weight_um2 / areas_um2_.back() * elements.at(t, p).value[i];
  }
  compliance_ = gel.compliance_um_per_nN(centres, ellipses_);
  average_near(gel, centres);
  for (Index j = 0; j < compliance_.cols(); ++j)
    for (Index i = j; i < compliance_.rows(); ++i) compliance_(i, j) = 0.5 * (compliance_(i, j) + compliance_(j, i));
}

void OnGel::average_near(const substrate::Substrate& gel, const std::vector<Vec2>& centres) {
  constexpr double kReach = 2.5;  // sizes of the two patches: beyond, the centre's value is the mean to 1 %
  double largest = 0;
  for (const double area : areas_um2_) largest = std::max(largest, std::sqrt(area));
  numerics::Grid grid(centres, largest);
  for (std::size_t i = 0; i < centres.size(); ++i) grid.add(static_cast<int>(i), centres[i], centres[i]);
  std::vector<std::vector<int>> near(centres.size());
  for (std::size_t j = 0; j < centres.size(); ++j)
    grid.for_each_near(centres[j], centres[j], 2 * kReach * largest, [&](int i) {
      const double sizes = std::sqrt(areas_um2_[j]) + std::sqrt(areas_um2_[static_cast<std::size_t>(i)]);
      if (norm(centres[static_cast<std::size_t>(i)] - centres[j]) < kReach * sizes) near[j].push_back(i);
    });
  numerics::parallel_for(static_cast<int>(centres.size()), threads_, [&](int j) {
    std::vector<Vec2> points;
    for (const int i : near[static_cast<std::size_t>(j)])
      for (int p = 0; p < Elements::kPoints; ++p)
        points.push_back(elements_.at(adhering_[static_cast<std::size_t>(i)], p).place_um);
    const Eigen::MatrixXd field = gel.compliance_um_per_nN(points, {ellipses_[static_cast<std::size_t>(j)]});
    Index row = 0;
    for (const int i : near[static_cast<std::size_t>(j)]) {
      Eigen::Matrix2d mean = Eigen::Matrix2d::Zero();
      for (int p = 0; p < Elements::kPoints; ++p, row += 2)
        mean += elements_.at(adhering_[static_cast<std::size_t>(i)], p).weight_um2 /
                areas_um2_[static_cast<std::size_t>(i)] * field.middleRows<2>(row);
      compliance_.block<2, 2>(2 * i, 2 * j) = mean;
    }
  });
}

VectorXd OnGel::gel_um(const VectorXd& forces_nN) const {
  return compliance_.selfadjointView<Eigen::Lower>() * forces_nN;
}

VectorXd OnGel::ground_um(const VectorXd& forces_nN) const {
  VectorXd u = gel_um(forces_nN);
  if (adhesion_)
    for (Index i = 0; i < u.size(); ++i)
      u(i) += forces_nN(i) / (*adhesion_ * areas_um2_[static_cast<std::size_t>(i / 2)]);
  return u;
}

OnGel::Solution OnGel::solve(const Material& material, const NodeVectors& load_nN) const {
  const Means means{elements_, adhering_, weights_};
  const Index n = means.n();
  Stiffness free(elements_, pins(elements_)), held(elements_, {});
  VectorXd spring(n);  // nN/um of each patch: what the gel under it and its neighbours is like
  constexpr double kNeighbours = 4;
  for (Index i = 0; i < n; ++i) {
    spring(i) = kNeighbours * compliance_(i, i);
    if (adhesion_) spring(i) += 1 / (*adhesion_ * areas_um2_[static_cast<std::size_t>(i / 2)]);
    spring(i) = 1 / spring(i);
  }
  for (int t = 0; t < elements_.n_triangles(); ++t) {
    const Stiffness::OfElement K = elastic_stiffness(elements_, t, material);
    free.add(t, K);
    held.add(t, K);
  }
  for (std::size_t k = 0; k < adhering_.size(); ++k) {
    Stiffness::OfElement K = Stiffness::OfElement::Zero();
    const auto& w = weights_[k];
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j)
        for (int a = 0; a < 2; ++a) K(2 * i + a, 2 * j + a) = spring(2 * static_cast<Index>(k) + a) * w[i] * w[j];
    held.add(adhering_[k], K);
  }
  if (!free.factorise(0, threads_) || !held.factorise(0, threads_))
    throw NotSolved({.reason = "the sheet has no stiffness: check its Young's modulus and thickness"});
  const Eigen::MatrixXd rigid = rigid_motions(elements_);
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

}  // namespace mbtfm::sheet
