#include "mbtfm/tensions/common_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/search.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::tensions {

namespace {

/// 2·beads × 14, about the beads' centre and of size 1 or so.
MatrixXd curved_motions(const LinearData& data) {
  constexpr int kPowers[7][2] = {{2, 0}, {1, 1}, {0, 2}, {3, 0}, {2, 1}, {1, 2}, {0, 3}};
  const std::vector<Vec2>& places_um = data.position_um;
  const Vec2 centre = centre_of(places_um);
  double squares = 0;
  for (const Vec2 place : places_um) squares += dot(place - centre, place - centre);
  const double unit_um = std::sqrt(squares / std::max(1.0, static_cast<double>(places_um.size())));
  MatrixXd motions = MatrixXd::Zero(data.response->rows(), 14);
  if (!(unit_um > 0)) return motions;
  for (std::size_t i = 0; i < places_um.size(); ++i) {
    const Vec2 d = (1 / unit_um) * (places_um[i] - centre);
    const Index row = data.dimension * static_cast<Index>(i);
    for (int k = 0; k < 7; ++k) {
      motions(row, 2 * k) = motions(row + 1, 2 * k + 1) = std::pow(d.x, kPowers[k][0]) * std::pow(d.y, kPowers[k][1]);
    }
  }
  return motions;
}

}  // namespace

MotionsBeside motions_beside(const LinearData& data, const EnsembleFit& fit) {
  const MatrixXd weighted = squared_weights(data).asDiagonal() * data.motions.shapes;
  const MatrixXd by_force =
      numerics::small_product(data.motions.inverse, data.response->pull_back(weighted).transpose());
  return {.values = motion_in(data, data.displacement_um - data.response->displace(fit.forces.nN)),
          .sigma = covariance_of_estimates(fit, data.motions.inverse, by_force).diagonal().cwiseMax(0).cwiseSqrt()};
}

FoundMotion common_motion_among(const MotionsBeside& motions, const LinearData& data) {
  const VectorXd& a = motions.values;
  const Index n = 3 * data.dimension;
  return {.motion = {.shift = {a[0], a[1]},
                     .turn_rad = a[2],
                     .growth = a[3],
                     .stretch = a[4],
                     .skew = a[5],
                     .centre = centre_of(data.position_um)},
          .sigma = motions.sigma.head(n),
          .out_of_plane = a.segment(6, n - 6)};
}

CurvedMotion curved_motion_beside(const EnsembleFit& fit) {
  const MatrixXd motions = less_motion(fit.data, curved_motions(fit.data));
  const Left left(fit);
  const Scores scores = left.scores_of(pattern_of(fit.data, motions));
  const VectorXd sizes = numerics::shortest_solution(scores.information, scores.scores);  // over s
  const double n_beads = std::max<double>(1, static_cast<double>(fit.data.position_um.size()));
  const double rms = numerics::matvec(motions, sizes).norm() / std::sqrt(n_beads);
  return {.chi_squared = scores.scores.dot(sizes), .rms_um = std::sqrt(left.variance()) * rms};
}

bool allows_common_motion(const stage::EffectSwitches& switches) { return switches.common_motion != Switch::off; }

Effect common_motion_effect(Switch setting, const std::optional<FoundMotion>& found) {
  return stage::decided(EffectKind::common_motion, setting, true,
                        found ? "found with the tensions: " + sentence_of(*found)
                              : "switched off in [effects]: the beads at rest are taken to lie still");
}

double rms_um(const AffineMotion& motion, const std::vector<Vec2>& places_um) {
  double squares = 0;
  for (const Vec2 place : places_um) squares += dot(motion.at(place), motion.at(place));
  return std::sqrt(0.5 * squares / std::max(1.0, static_cast<double>(places_um.size())));
}

Figures figures_of(const FoundMotion& found) {
  const AffineMotion& m = found.motion;
  constexpr double kDegree = 180 / std::numbers::pi;
  Figures figures = {{"common_shift_x_um", m.shift.x},
                     {"common_shift_y_um", m.shift.y},
                     {"common_turn_deg", kDegree * m.turn_rad},
                     {"common_turn_sigma_deg", kDegree * found.sigma[2]},
                     {"common_growth", m.growth},
                     {"common_growth_sigma", found.sigma[3]},
                     {"common_shear", m.shear()},
                     {"common_shear_sigma", std::max(found.sigma[4], found.sigma[5])}};
  if (const VectorXd& out = found.out_of_plane; out.size() > 0)
    figures.insert(figures.end(), {{"common_shift_z_um", out[0]},
                                   {"common_shift_z_sigma_um", found.sigma[6]},
                                   {"common_tilt_deg", kDegree * out.tail<2>().norm()},
                                   {"common_tilt_sigma_deg", kDegree * found.sigma.tail<2>().maxCoeff()}});
  return figures;
}

std::string sentence_of(const FoundMotion& found) {
  const AffineMotion& m = found.motion;
  constexpr double kDegree = 180 / std::numbers::pi;
  return "growth " + with_error(100 * m.growth, 100 * found.sigma[3]) + " %, turn " +
         with_error(kDegree * m.turn_rad, kDegree * found.sigma[2]) + " degrees, shear " +
         with_error(100 * m.shear(), 100 * std::max(found.sigma[4], found.sigma[5])) + " %";
}

}  // namespace mbtfm::tensions
