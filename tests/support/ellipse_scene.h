/// Eight loaded ellipses on a half-space: the scene on which traction maps are compared with other programs'.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/beads.h"
#include "substrate/compliance.h"
#include "substrate/greens/models.h"
#include "tests/support/test.h"

namespace mbtfm::test {

struct EllipseScene {
  Gel gel{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 1e6};
  double spacing_um = 0;
  int n_side = 0;
  std::vector<Adhesion> adhesions;
  std::vector<Vec2> forces_nN;
  DisplacementField field;          ///< row by row
  std::vector<Vec2> tractions_kPa;  ///< mean over each pixel, in the same order
  double largest_um = 0;            ///< displacement, without noise
};

inline tractions::TractionParameters half_space(tractions::TractionMethod method = tractions::TractionMethod::fttc) {
  tractions::TractionParameters parameters;
  parameters.method = method;
  parameters.gel_model = GelModel::half_space;
  return parameters;
}

inline tractions::TractionInputs inputs_of(const EllipseScene& scene) {
  return {.beads = scene.field, .gel = scene.gel, .adhesions = scene.adhesions, .outline_um = {}};
}

inline bool is_in_ellipse(const Adhesion& a, Vec2 point_um, double grown_um = 0) {
  const Vec2 d = point_um - a.position_um;
  const double c = std::cos(a.angle_rad), s = std::sin(a.angle_rad);
  const double along = (c * d.x + s * d.y) / (0.5 * a.major_axis_um + grown_um);
  const double across = (c * d.y - s * d.x) / (0.5 * a.minor_axis_um + grown_um);
  return along * along + across * across <= 1;
}

/// Smallest change of the forces that makes net force and torque vanish.
inline void balance(const std::vector<Adhesion>& adhesions, std::vector<Vec2>& forces_nN) {
  const auto n = static_cast<Eigen::Index>(forces_nN.size());
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(3, 2 * n);
  Eigen::VectorXd f(2 * n);
  for (Eigen::Index a = 0; a < n; ++a) {
    C(0, 2 * a) = C(1, 2 * a + 1) = 1;
    C(2, 2 * a) = -adhesions[a].position_um.y;
    C(2, 2 * a + 1) = adhesions[a].position_um.x;
    f.segment<2>(2 * a) << forces_nN[a].x, forces_nN[a].y;
  }
  f -= C.transpose() * (C * C.transpose()).ldlt().solve(C * f);
  for (Eigen::Index a = 0; a < n; ++a) forces_nN[a] = {f[2 * a], f[2 * a + 1]};
}

/// @param noise  standard deviation of each component over the largest displacement
/// @param turn_rad  the whole scene turned about its centre
inline EllipseScene ellipse_scene(int n_side, double noise, unsigned seed = 1, double turn_rad = 0, double side_um = 64,
                                  bool states_errors = true) {
  struct Row {
    double x, y, a, b, pascal;
  };
  constexpr Row kRows[] = {{14, 20, 2.4, 0.9, 1800}, {12, 34, 2.0, 0.8, 1500}, {17, 47, 2.6, 1.0, 2200},
                           {30, 53, 1.8, 0.7, 1200}, {44, 49, 2.4, 0.9, 2000}, {52, 36, 2.2, 0.8, 1700},
                           {50, 19, 2.6, 1.0, 2400}, {34, 11, 1.8, 0.7, 1300}};
  EllipseScene scene;
  scene.n_side = n_side;
  scene.spacing_um = side_um / n_side;
  const Vec2 centre{32, 32};
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  for (const Row& row : kRows) {
    const Vec2 from{row.x - centre.x, row.y - centre.y};
    const Vec2 offset{c * from.x - s * from.y, s * from.x + c * from.y};
    const double area = std::numbers::pi * row.a * row.b;
    scene.adhesions.push_back({.adhesion_id = static_cast<int>(scene.adhesions.size()) + 1,
                               .position_um = centre + offset,
                               .area_um2 = area,
                               .major_axis_um = 2 * row.a,
                               .minor_axis_um = 2 * row.b,
                               .angle_rad = std::atan2(-offset.y, -offset.x),
                               .eccentricity = std::sqrt(1 - row.b * row.b / (row.a * row.a)),
                               .mean_intensity = 1});
    scene.forces_nN.push_back(-area * row.pascal / 1000 / norm(offset) * offset);
  }
  balance(scene.adhesions, scene.forces_nN);
  std::vector<substrate::Ellipse> ellipses;
  for (const Adhesion& a : scene.adhesions) ellipses.push_back(substrate::ellipse_of(a));
  const auto greens = greens::make_greens(scene.gel, {.model = substrate::ModelKind::half_space}, 2);
  std::vector<Vec2> points;
  const double start = 32 - side_um / 2;
  for (int j = 0; j < n_side; ++j)
    for (int i = 0; i < n_side; ++i)
      points.push_back({start + (i + 0.5) * scene.spacing_um, start + (j + 0.5) * scene.spacing_um});
  const std::vector<Vec2> u = greens->displacements_um(points, ellipses, scene.forces_nN);
  for (const Vec2 v : u) scene.largest_um = std::max(scene.largest_um, norm(v));
  const double sigma = noise * scene.largest_um;
  test::Normal normal(seed);
  constexpr int kSub = 8;  // points a pixel side: its share of an ellipse to about 1 %
  for (std::size_t p = 0; p < points.size(); ++p) {
    const double noise_x = normal(), noise_y = normal();
    scene.field.push_back({.position_um = points[p],
                           .displacement_um = u[p] + Vec2{sigma * noise_x, sigma * noise_y},
                           .sigma_um = states_errors ? sigma : 0,
                           .flag = {}});
    Vec2 traction;
    for (std::size_t a = 0; a < scene.adhesions.size(); ++a) {
      if (norm(points[p] - scene.adhesions[a].position_um) > scene.adhesions[a].major_axis_um) continue;
      int n_inside = 0;
      for (int sub = 0; sub < kSub * kSub; ++sub) {
        const Vec2 at = {(sub % kSub + 0.5) / kSub - 0.5, (sub / kSub + 0.5) / kSub - 0.5};
        n_inside += is_in_ellipse(scene.adhesions[a], points[p] + scene.spacing_um * at);
      }
      traction += (n_inside / (kSub * kSub * scene.adhesions[a].area_um2)) * scene.forces_nN[a];
    }
    scene.tractions_kPa.push_back(traction);
  }
  return scene;
}

/// |t − true| / |true| over all pixels.
inline double traction_error(const EllipseScene& scene, const std::vector<Vec2>& tractions_kPa) {
  double difference = 0, truth = 0;
  for (std::size_t p = 0; p < scene.tractions_kPa.size(); ++p) {
    const Vec2 d = tractions_kPa[p] - scene.tractions_kPa[p];
    difference += dot(d, d);
    truth += dot(scene.tractions_kPa[p], scene.tractions_kPa[p]);
  }
  return std::sqrt(difference / truth);
}

inline std::vector<Vec2> forces_of(const tractions::Reconstruction& r) {
  std::vector<Vec2> forces;
  for (const AdhesionForce& f : r.forces) forces.push_back(f.force_nN);
  return forces;
}

/// Mean |F − true| / |true| of forces by adhesion.
inline double force_error(const EllipseScene& scene, const std::vector<Vec2>& forces_nN) {
  double sum = 0;
  for (std::size_t a = 0; a < forces_nN.size(); ++a)
    sum += norm(forces_nN[a] - scene.forces_nN[a]) / norm(scene.forces_nN[a]);
  return sum / static_cast<double>(forces_nN.size());
}

}  // namespace mbtfm::test
