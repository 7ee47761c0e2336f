#include "mbtfm/tensions/energy.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/fit_results.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/near.h"
#include "substrate/greens/models.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::tensions {

namespace {

/// By adhesion (x, y): the mean displacement under it.
VectorXd mean_displacement_um(const std::vector<substrate::Ellipse>& ellipses, const VectorXd& forces_nN,
                              const Gel& gel, int threads) {
  std::vector<std::vector<substrate::DiscPoint>> rules;
  std::vector<Vec2> points_um;
  for (const substrate::Ellipse& e : ellipses) {
    rules.push_back(substrate::ellipse_rule(e, 5));
    for (const substrate::DiscPoint& p : rules.back()) points_um.push_back(e.centre_um + p.position);
  }
  const auto layer = greens::make_greens(gel, {.model = substrate::ModelKind::layer}, threads);
  const VectorXd at_points = layer->response({ellipses}, {points_um})->displace(forces_nN);
  VectorXd mean = VectorXd::Zero(forces_nN.size());
  Index point = 0;
  for (Index a = 0; a < std::ssize(ellipses); ++a) {
    for (const substrate::DiscPoint& p : rules[a])
      mean.segment<2>(2 * a) += p.weight * at_points.segment<2>(2 * point++);
  }
  return mean;
}

/// Mean of what the forces make of the beads on an adhesion, or of the four nearest.
Eigen::Vector2d shown_by_beads_um(const numerics::Near& beads, const VectorXd& moved_um, const Adhesion& adhesion) {
  constexpr std::size_t kNearest = 4;
  const Vec3 place{adhesion.position_um.x, adhesion.position_um.y, 0};
  std::vector<int> shown = beads.within(place, adhesion.major_axis_um / 2, static_cast<int>(beads.points().size()));
  if (shown.size() < kNearest) shown = beads.nearest(place, kNearest);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const int bead : shown) sum += moved_um.segment<2>(2 * Index{bead});
  return sum / static_cast<double>(shown.size());
}

VectorXd displacement_under_um(const EnsembleFit& fit, const Cell& cell, const VectorXd& forces_nN, const Gel& gel,
                               int threads) {
  VectorXd under = mean_displacement_um(substrate::ellipses_of(cell.adhesions), forces_nN, gel, threads);
  const auto assumed = [](const Adhesion& a) { return is_assumed(a.origin); };
  if (std::ranges::none_of(cell.adhesions, assumed) || fit.data.position_um.empty()) return under;
  std::vector<Vec3> places_um;
  for (const Vec2 p : fit.data.position_um) places_um.push_back({p.x, p.y, 0});
  constexpr double kCell_um = 1;
  const numerics::Near beads(std::move(places_um), kCell_um);
  const VectorXd moved_um = moved_by(fit.data, forces_nN);
  for (Index a = 0; a < std::ssize(cell.adhesions); ++a)
    if (assumed(cell.adhesions[a])) under.segment<2>(2 * a) = shown_by_beads_um(beads, moved_um, cell.adhesions[a]);
  return under;
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
    const VectorXd displacement_um = displacement_under_um(fit, cell, forces_nN, gel, threads);
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
