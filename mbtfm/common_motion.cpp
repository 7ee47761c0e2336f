#include "mbtfm/common_motion.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/csv.h"

namespace mbtfm::inverse {

namespace {

Vec2 centre_of(const std::vector<Vec2>& places) {
  Vec2 sum;
  for (const Vec2 place : places) sum += place;
  return (1 / std::max(1.0, static_cast<double>(places.size()))) * sum;
}

std::string with_error(double value, double sigma, const std::string& unit) {
  return brief(value) + " +- " + brief(sigma) + " " + unit;
}

}  // namespace

Vec2 CommonMotion::at(Vec2 place_um) const {
  const Vec2 d = place_um - centre_um;
  return shift_um + Vec2{(growth + shear_1) * d.x + (shear_2 - turn_rad) * d.y,
                         (shear_2 + turn_rad) * d.x + (growth - shear_1) * d.y};
}

double CommonMotion::largest_um(double radius_um) const {
  // of growth, turn and shear the matrix has singular values |growth + i turn| +- |shear|
  return radius_um * (std::hypot(growth, turn_rad) + std::hypot(shear_1, shear_2));
}

Eigen::MatrixXd affine_motions(const DisplacementField& beads) {
  std::vector<Vec2> places_um;
  for (const Bead& bead : beads) places_um.push_back(bead.position_um);
  const Vec2 centre = centre_of(places_um);
  Eigen::MatrixXd motions(2 * static_cast<Eigen::Index>(beads.size()), 6);
  for (std::size_t i = 0; i < beads.size(); ++i) {
    const Vec2 d = places_um[i] - centre;
    motions.middleRows<2>(2 * static_cast<Eigen::Index>(i)) << 1, 0, -d.y, d.x, d.x, d.y,  //
        0, 1, d.x, d.y, -d.y, d.x;
  }
  return motions;
}

FoundMotion motion_beside(const LinearData& data, const EnsembleFit& fit) {
  const Eigen::VectorXd a = motion_in(data, data.displacement_um - data.response->displace(fit.forces_nN));
  FoundMotion found{.motion = {.centre_um = centre_of(data.position_um),
                               .shift_um = {a[0], a[1]},
                               .turn_rad = a[2],
                               .growth = a[3],
                               .shear_1 = a[4],
                               .shear_2 = a[5]},
                    .sigma = {}};
  // The beads' own noise, and what errors of the tensions and of the model's forces look like to the motions.
  const Eigen::MatrixXd weighted = squared_weights(data).asDiagonal() * data.motions;
  const Eigen::MatrixXd inverse = motion_covariance(data);
  const Eigen::MatrixXd by_force = inverse * data.response->pull_back(weighted).transpose();  // motion_in(G)
  const MeshFit& mesh = fit.meshes.front();
  const Eigen::MatrixXd by_tension = by_force * mesh.force_derivatives;
  Eigen::MatrixXd covariance = fit.variance * inverse + by_tension * mesh.noise_covariance_nN2 * by_tension.transpose();
  if (fit.model_error) {
    const Eigen::MatrixXd left = by_force - by_tension * mesh.by_force;  // of errors of the forces, tensions following
    covariance += left * fit.model_error->force_variance_nN2.asDiagonal() * left.transpose();
  }
  found.sigma = covariance.diagonal().head<6>().cwiseMax(0).cwiseSqrt();
  const Eigen::VectorXd strain = a.segment<4>(2);
  found.chi_squared = strain.dot(covariance.block<4, 4>(2, 2).completeOrthogonalDecomposition().solve(strain));
  return found;
}

bool allows_common_motion(const EffectSwitches& switches) { return switches.common_motion != "off"; }

Effect common_motion_effect(const std::string& setting, const std::optional<FoundMotion>& found) {
  return decided(kCommonMotion, setting, true,
                 found ? "found with the tensions: " + sentence_of(*found) : "as told: the beads at rest lie still");
}

Figures figures_of(const FoundMotion& found) {
  const CommonMotion& m = found.motion;
  constexpr double kDegree = 180 / std::numbers::pi;
  return {{"common_shift_x_um", m.shift_um.x},
          {"common_shift_y_um", m.shift_um.y},
          {"common_turn_deg", kDegree * m.turn_rad},
          {"common_turn_sigma_deg", kDegree * found.sigma[2]},
          {"common_growth", m.growth},
          {"common_growth_sigma", found.sigma[3]},
          {"common_shear", std::hypot(m.shear_1, m.shear_2)},
          {"common_shear_sigma", std::max(found.sigma[4], found.sigma[5])}};
}

std::string sentence_of(const FoundMotion& found) {
  const CommonMotion& m = found.motion;
  constexpr double kDegree = 180 / std::numbers::pi;
  return "growth " + with_error(100 * m.growth, 100 * found.sigma[3], "%") + ", turn " +
         with_error(kDegree * m.turn_rad, kDegree * found.sigma[2], "degrees") + ", shear " +
         with_error(100 * std::hypot(m.shear_1, m.shear_2), 100 * std::max(found.sigma[4], found.sigma[5]), "%");
}

}  // namespace mbtfm::inverse
