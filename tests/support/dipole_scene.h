/// Discs that pull at each other on a half-space, seen by scattered beads: a truth that no map of tractions is made of.
#pragma once

#include <Eigen/Core>
#include <numbers>
#include <random>

#include "mbtfm/tractions/traction.h"
#include "substrate/ellipse.h"
#include "substrate/greens/models.h"
#include "tests/support/test.h"

namespace mbtfm::test {

struct DipoleOptions {
  double radius_um = 1, force_nN = 10, noise_um = 0.007;  ///< noise: .07 px of 0.1 um
  double distance_um = 20, field_um = 50, beads_per_um2 = 1;
};

struct DipoleScene {
  tractions::TractionInputs inputs;  ///< beads, gel, both discs as adhesions
  double force_nN = 0, radius_um = 0, moment_nN_um = 0;
  /// Of the traction on disc 0 or 1: towards the other.
  Vec2 direction(std::size_t disc) const {
    const Vec2 d = inputs.adhesions[1 - disc].position_um - inputs.adhesions[disc].position_um;
    return 1 / norm(d) * d;
  }
  double traction_kPa() const { return force_nN / (std::numbers::pi * radius_um * radius_um); }
};

inline Adhesion disc_adhesion(int id, Vec2 centre_um, double radius_um) {
  return {.adhesion_id = id,
          .position_um = centre_um,
          .area_um2 = std::numbers::pi * radius_um * radius_um,
          .major_axis_um = 2 * radius_um,
          .minor_axis_um = 2 * radius_um,
          .angle_rad = 0,
          .eccentricity = 0,
          .mean_intensity = 1};
}

/// Beads anywhere in a square, displaced by even forces on the adhesions (Cerruti's solution summed over each) and by
/// noise.
inline tractions::TractionInputs scattered(const std::vector<Adhesion>& adhesions, const std::vector<Vec2>& forces_nN,
                                           const DipoleOptions& o, unsigned seed) {
  tractions::TractionInputs inputs{.beads = {},
                                   .gel = {.youngs_modulus_kPa = 10, .poisson_ratio = 0.5 - 1e-4, .thickness_um = 1e6},
                                   .adhesions = adhesions,
                                   .outline_um = {}};
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0, o.field_um);
  std::normal_distribution<double> noise(0, o.noise_um);
  std::vector<Vec2> points(static_cast<std::size_t>(o.beads_per_um2 * o.field_um * o.field_um));
  for (Vec2& p : points) p.x = place(random), p.y = place(random);
  const auto greens = greens::make_greens(inputs.gel, {.model = substrate::ModelKind::half_space}, 1);
  std::vector<Vec2> u = greens->displacements_um(points, substrate::ellipses_of(adhesions), forces_nN);
  for (std::size_t i = 0; i < points.size(); ++i) {
    u[i].x += noise(random), u[i].y += noise(random);
    inputs.beads.push_back({.position_um = points[i], .displacement_um = u[i], .sigma_um = o.noise_um, .flag = {}});
  }
  return inputs;
}

inline DipoleScene dipole_scene(const DipoleOptions& o, unsigned seed) {
  const double angle = 0.7 * seed;
  const Vec2 e{std::cos(angle), std::sin(angle)}, middle{0.5 * o.field_um, 0.5 * o.field_um};
  const Vec2 arm = 0.5 * o.distance_um * e;
  return {
      .inputs = scattered({disc_adhesion(1, middle + arm, o.radius_um), disc_adhesion(2, middle - arm, o.radius_um)},
                          {-o.force_nN * e, o.force_nN * e}, o, seed),
      .force_nN = o.force_nN,
      .radius_um = o.radius_um,
      .moment_nN_um = o.force_nN * o.distance_um};
}

/// Deviation of the traction's magnitude on the discs and of that beside them, both over the true one (Sabass et al.,
/// Biophys. J. 94 (2008) 207; the background as in Huang et al., Sci. Rep. 9 (2019) 539). 0 is perfect.
struct SabassScore {
  double on_discs = 0, beside = 0, peak = 0;
  double total() const { return std::abs(on_discs) + beside; }
};
inline SabassScore sabass_score(const DipoleScene& scene, const std::vector<GroundPatch>& patches) {
  // lattice points may miss a small disc altogether: its traction is that of the nearest
  SabassScore score;
  double sum_beside = 0, area_beside = 0;
  for (const Adhesion& a : scene.inputs.adhesions) {
    double sum = 0, area = 0, nearest_um = 1e9, at_nearest = 0;
    for (const GroundPatch& p : patches) {
      const double distance_um = norm(p.position_um - a.position_um), t = norm(p.traction_kPa);
      if (distance_um <= scene.radius_um) sum += p.area_um2 * t, area += p.area_um2;
      if (distance_um < nearest_um) nearest_um = distance_um, at_nearest = t;
    }
    score.on_discs += 0.5 * ((area > 0 ? sum / area : at_nearest) / scene.traction_kPa() - 1);
  }
  for (const GroundPatch& p : patches) {
    const double t = norm(p.traction_kPa);
    score.peak = std::max(score.peak, t / scene.traction_kPa());
    bool is_beside = true;
    for (const Adhesion& a : scene.inputs.adhesions) is_beside &= norm(p.position_um - a.position_um) > scene.radius_um;
    if (is_beside) sum_beside += p.area_um2 * t, area_beside += p.area_um2;
  }
  score.beside = sum_beside / area_beside / scene.traction_kPa();
  return score;
}

}  // namespace mbtfm::test
