#include "mbtfm/tensions/energy.h"

#include <cmath>
#include <numbers>

#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/fit_results.h"
#include "pipeline/numerics/dense.h"
#include "substrate/greens/models.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::tensions {

namespace {

/// On the unit disc: exact for polynomials of fifth degree. Source: Stroud, Approximate Calculation of Multiple
/// Integrals (1971), S2 5-1.
struct DiscPoint {
  Vec2 at;
  double weight;
};
std::vector<DiscPoint> disc_rule() {
  constexpr int kRing = 6;
  const double radius = std::sqrt(2.0 / 3);
  std::vector<DiscPoint> rule = {{{0, 0}, 0.25}};
  for (int k = 0; k < kRing; ++k) {
    const double angle = 2 * std::numbers::pi * k / kRing;
    rule.push_back({{radius * std::cos(angle), radius * std::sin(angle)}, 0.125});
  }
  return rule;
}

/// By adhesion (x, y): the mean displacement under it.
VectorXd mean_displacement_um(const std::vector<substrate::Ellipse>& ellipses, const VectorXd& forces_nN,
                              const Gel& gel, int threads) {
  const std::vector<DiscPoint> rule = disc_rule();
  std::vector<Vec2> points_um;
  for (const substrate::Ellipse& e : ellipses) {
    const Vec2 along = {std::cos(e.angle_rad), std::sin(e.angle_rad)}, across = {-along.y, along.x};
    for (const auto& [at, weight] : rule)
      points_um.push_back(e.centre_um + at.x * e.semi_major_um * along + at.y * e.semi_minor_um * across);
  }
  const auto layer = greens::make_greens(gel, {.model = substrate::ModelKind::layer}, threads);
  const VectorXd at_points = layer->response({ellipses}, {points_um})->displace(forces_nN);
  VectorXd mean = VectorXd::Zero(forces_nN.size());
  for (Index a = 0; a < std::ssize(ellipses); ++a) {
    for (Index k = 0; k < std::ssize(rule); ++k)
      mean.segment<2>(2 * a) += rule[k].weight * at_points.segment<2>(2 * (a * std::ssize(rule) + k));
  }
  return mean;
}

/// Of a number that changes by `gradient` with the forces.
double standard_error(const EnsembleFit& fit, const VectorXd& gradient) {
  const MatrixXd network = by_network_force(fit, gradient);
  const double variance = covariance_of_estimates(fit, MatrixXd::Zero(1, 1), network.transpose())(0, 0);
  return std::sqrt(variance + own_variances(fit, gradient)[0]);
}

Vec2 centre_of(const std::vector<substrate::Ellipse>& ellipses) {
  Vec2 sum{};
  for (const substrate::Ellipse& e : ellipses) sum = sum + e.centre_um;
  return 1.0 / static_cast<double>(ellipses.size()) * sum;
}

Figures moments_of(const EnsembleFit& fit, const std::vector<substrate::Ellipse>& ellipses, const VectorXd& forces_nN) {
  const Vec2 centre = centre_of(ellipses);
  Eigen::Matrix2d moment = Eigen::Matrix2d::Zero();
  VectorXd of_trace(forces_nN.size());
  for (Index a = 0; a < std::ssize(ellipses); ++a) {
    const Vec2 arm = ellipses[a].centre_um - centre;
    const Eigen::Vector2d x(arm.x, arm.y);
    moment -= x * forces_nN.segment<2>(2 * a).transpose();
    of_trace.segment<2>(2 * a) = -x;
  }
  const auto [sizes, axes] = numerics::symmetric_eigen(0.5 * (moment + moment.transpose()));
  const Eigen::Vector2d major = axes.col(1);
  const double angle_deg = std::atan2(major.y(), major.x()) * 180 / std::numbers::pi;
  return {{"contractile_moment_nN_um", moment.trace()},
          {"contractile_moment_sigma_nN_um", standard_error(fit, of_trace)},
          {"contractile_moment_major_nN_um", sizes[1]},
          {"contractile_moment_minor_nN_um", sizes[0]},
          {"contractile_moment_axis_deg", angle_deg < 0 ? angle_deg + 180 : angle_deg}};
}

}  // namespace

Figures energy_and_moments(const EnsembleFit& fit, const Cell& cell, const Gel& gel, bool is_even_gel, int threads) {
  const std::vector<substrate::Ellipse> ellipses = substrate::ellipses_of(cell.adhesions);
  const VectorXd forces_nN = adhesion_forces_nN(fit);
  Figures figures;
  if (is_even_gel) {
    const VectorXd displacement_um = mean_displacement_um(ellipses, forces_nN, gel, threads);
    figures = {{"strain_energy_fJ", 0.5 * forces_nN.dot(displacement_um)},
               {"strain_energy_sigma_fJ", standard_error(fit, displacement_um)}};
  }
  if (!fit.cut) {
    const Figures moments = moments_of(fit, ellipses, forces_nN);
    figures.insert(figures.end(), moments.begin(), moments.end());
  }
  return figures;
}

}  // namespace mbtfm::tensions
