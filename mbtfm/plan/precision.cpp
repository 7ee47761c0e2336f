#include "mbtfm/plan/precision.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "mbtfm/fit/data_of_beads.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/intervals.h"
#include "pipeline/numerics/dense.h"
#include "samples/drawing/random.h"
#include "substrate/choice/factory.h"

namespace mbtfm::plan {

using namespace tensions;

namespace {

/// Bead places do not weigh: a noise of 1 um on each.
DisplacementField unit_beads(const std::vector<Vec2>& places_um) {
  DisplacementField beads;
  for (const Vec2 place : places_um)
    beads.push_back({.position_um = place, .displacement_um = {}, .sigma_um = 1, .flag = {}});
  return beads;
}

/// Standard errors of the forces' components along `along`, each force by itself, of a covariance UUᵀ, U by row.
Eigen::VectorXd errors_along(const Eigen::MatrixXd& U, const Eigen::VectorXd& along) {
  Eigen::VectorXd errors(along.size() / 2);
  for (Eigen::Index a = 0; a < errors.size(); ++a) {
    const Eigen::Vector2d e = along.segment<2>(2 * a);
    errors[a] = (e.transpose() * U.middleRows<2>(2 * a)).norm();
  }
  return errors;
}

/// Directions of the forces, x where there is none.
Eigen::VectorXd directions(const Eigen::VectorXd& forces_nN) {
  Eigen::VectorXd along = directions_of(forces_nN);
  for (Eigen::Index row = 0; row < along.size(); row += 2)
    if (along.segment<2>(row).norm() == 0) along[row] = 1;
  return along;
}

/// Sums of squares of the errors, and back.
Precision powers(Precision p, double power) {
  const auto of = [power](double v) { return std::pow(v, power); };
  p.tensions = p.tensions.unaryExpr(of);
  p.adhesion_forces = p.adhesion_forces.unaryExpr(of);
  p.free_forces = p.free_forces.unaryExpr(of);
  p.total_force = of(p.total_force);
  return p;
}

/// a + factor b
Precision sum(Precision a, const Precision& b, double factor) {
  if (a.tensions.size() == 0) {
    a = b;
    a.tensions.setZero();
    a.adhesion_forces.setZero();
    a.free_forces.setZero();
    a.total_force = 0;
  }
  a.tensions += factor * b.tensions;
  a.adhesion_forces += factor * b.adhesion_forces;
  a.free_forces += factor * b.free_forces;
  a.total_force += factor * b.total_force;
  return a;
}

}  // namespace

BeadsOnGel beads_on_gel(const Scene& scene, const KnownCell& cell, double beads_per_um2, std::uint64_t draw,
                        int threads) {
  BeadsOnGel beads{.places_um = beads_on(scene, beads_per_um2, draw),
                   .response = {},
                   .modulus_kPa = scene.fit.gel.youngs_modulus_kPa};
  const auto gel = choice::make_substrate(scene.fit.gel, scene.fit.substrate, threads);
  beads.response = gel->response({cell.ellipses}, {beads.places_um})->kept();
  return beads;
}

BeadsOnGel some_of(const BeadsOnGel& beads, const std::vector<Eigen::Index>& which) {
  BeadsOnGel some{.places_um = {}, .response = beads.response->at_points(which), .modulus_kPa = beads.modulus_kPa};
  for (const Eigen::Index i : which) some.places_um.push_back(beads.places_um[static_cast<std::size_t>(i)]);
  return some;
}

Precision precision_of(const Scene& scene, const KnownCell& cell, const BeadsOnGel& beads, int threads) {
  const DisplacementField unit = unit_beads(beads.places_um);
  const LinearData data = reduce(unit, beads.response, {}, threads,
                                 allows_common_motion(scene.fit.effects) ? affine_motions(unit) : Eigen::MatrixXd());
  const Eigen::VectorXd along = directions(cell.forces_nN);
  Precision mean;
  for (const Eigen::MatrixXd& D : cell.derivatives) {
    const LocalMisfit local{.tensions_nN = cell.tensions_nN,
                            .H = numerics::gram(displace(data.reduced, D)),
                            .g = Eigen::VectorXd::Zero(D.cols())};
    const Eigen::MatrixXd U = Eigen::LLT<Eigen::MatrixXd>(response_of(local, 1)).matrixL();
    const Eigen::MatrixXd of_forces = D * U;
    const Precision of_mesh{.tensions = U.rowwise().norm(),
                            .total_force = (directions_of(cell.forces_nN).transpose() * of_forces).norm(),
                            .adhesion_forces = errors_along(of_forces, along),
                            .free_forces = Eigen::VectorXd::Zero(along.size() / 2)};
    mean = sum(std::move(mean), powers(of_mesh, 2), 1.0 / static_cast<double>(cell.derivatives.size()));
  }
  mean = powers(std::move(mean), 0.5);
  Eigen::MatrixXd U = Eigen::MatrixXd::Identity(along.size(), along.size());
  numerics::solve_upper(*data.reduced.compliance, U, threads);
  mean.free_forces = errors_along(U, along);
  // of this gel's modulus, to 1 kPa
  return sum({}, mean, 1 / beads.modulus_kPa);
}

Precision precision_at_share(const Scene& scene, const KnownCell& cell, const BeadsOnGel& beads, double share,
                             int threads) {
  constexpr int kMostSamples = 4;
  const auto n = beads.places_um.size();
  const auto n_taken = static_cast<std::size_t>(std::round(share * static_cast<double>(n)));
  if (n_taken >= n) return precision_of(scene, cell, beads, threads);
  std::vector<Eigen::Index> order(n);
  std::iota(order.begin(), order.end(), 0);
  drawing::Random random(scene.experiment.seed, drawing::Stream::beads, n_taken);
  for (std::size_t i = n - 1; i > 0; --i)
    std::swap(order[i], order[static_cast<std::size_t>(random.below(static_cast<int>(i) + 1))]);
  // samples that share no bead
  const int n_samples = std::clamp(static_cast<int>(n / std::max<std::size_t>(1, n_taken)), 1, kMostSamples);
  Precision squares;
  for (int s = 0; s < n_samples; ++s) {
    const auto first = order.begin() + static_cast<std::ptrdiff_t>(s * n_taken);
    std::vector<Eigen::Index> taken(first, first + static_cast<std::ptrdiff_t>(n_taken));
    std::ranges::sort(taken);
    squares =
        sum(std::move(squares), powers(precision_of(scene, cell, some_of(beads, taken), threads), 2), 1.0 / n_samples);
  }
  return powers(std::move(squares), 0.5);
}

}  // namespace mbtfm::plan
