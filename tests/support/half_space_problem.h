/// Tractions on a flat half-space, whose answer is a closed form: reconstructions in space without finite elements.
#pragma once

#include "mbtfm/spatial/observed.h"
#include "mbtfm/spatial/problem.h"
#include "substrate/greens/inside.h"
#include "tests/support/test.h"

namespace mbtfm::test {

struct HalfSpaceScene {
  Gel gel{.youngs_modulus_kPa = 10, .poisson_ratio = 0.45, .thickness_um = 1000};
  double half_um = 24;  ///< of the field
  int n_beads = 500;
  double shallowest_um = 2, depth_um = 12;  ///< of the beads
  double spacing_um = 4;
  std::uint64_t seed = 1;

  /// Even tractions on discs.
  struct Spot {
    Vec2 centre_um;
    double radius_um = 0;
    Vec3 force_nN;
  };
  std::vector<Spot> spots = {{{-10, -9}, 4, {40, 25, -15}}, {{11, -6}, 4, {-35, 20, 12}}, {{0, 12}, 4, {-5, -45, 3}}};

  std::vector<Adhesion> adhesions() const {
    std::vector<Adhesion> made;
    for (const Spot& s : spots)
      made.push_back({.adhesion_id = static_cast<int>(made.size()) + 1,
                      .position_um = s.centre_um,
                      .area_um2 = M_PI * s.radius_um * s.radius_um,
                      .major_axis_um = 2 * s.radius_um,
                      .minor_axis_um = 2 * s.radius_um});
    return made;
  }

  Vec3 displaced_um(const Vec3& bead, const Spot& spot) const {
    const auto rule = substrate::ellipse_rule({spot.centre_um, spot.radius_um, spot.radius_um, 0}, 15);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto& point : rule) {
      const Vec2 from = spot.centre_um + point.position;
      sum += point.weight * greens::half_space_inside_um_per_nN(gel, {bead.x - from.x, bead.y - from.y}, bead.z) *
             Eigen::Vector3d(spot.force_nN.x, spot.force_nN.y, spot.force_nN.z);
    }
    return {sum.x(), sum.y(), sum.z()};
  }

  /// @param sigma_um  three times as much along z
  std::vector<BeadInSpace> beads(double sigma_um) const {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> across(-half_um, half_um), down(shallowest_um, depth_um);
    std::normal_distribution<double> noise;
    std::vector<BeadInSpace> made;
    for (int b = 0; b < n_beads; ++b) {
      BeadInSpace bead{.position_um = {across(random), across(random), down(random)},
                       .sigma_um = sigma_um,
                       .sigma_z_um = 3 * sigma_um};
      for (const Spot& spot : spots) bead.displacement_um += displaced_um(bead.position_um, spot);
      const double x = noise(random), y = noise(random), z = noise(random);
      bead.displacement_um += sigma_um * Vec3{x, y, 3 * z};
      made.push_back(bead);
    }
    return made;
  }

  /// Bilinear tractions, each face as 3 × 3 Gauss points.
  Eigen::MatrixXd response(const spatial::TractionMesh& mesh, const std::vector<Vec3>& points) const {
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(3 * std::ssize(points), 3 * Eigen::Index{mesh.n_vertices()});
    over_faces(mesh, spatial::Ground(nullptr), 3, spatial::Places::gauss,
               [&](Vec2 at, std::span<const spatial::VertexShare> shares, double area_um2) {
                 for (std::size_t b = 0; b < points.size(); ++b) {
                   const Vec2 offset{points[b].x - at.x, points[b].y - at.y};
                   const Eigen::Matrix3d g = area_um2 * greens::half_space_inside_um_per_nN(gel, offset, points[b].z);
                   for (const auto& [vertex, share] : shares)
                     G.block<3, 3>(3 * static_cast<Eigen::Index>(b), 3 * vertex) += share * g;
                 }
               });
    return G;
  }

  spatial::Rectangle over() const { return {{-half_um, -half_um}, {half_um, half_um}}; }

  spatial::Problem problem(const std::vector<BeadInSpace>& seen, const spatial::SpatialParameters& parameters) const {
    const spatial::Ground ground(nullptr);
    return problem_on(make_traction_mesh(ground, over(), spacing_um, [](Vec2) { return true; }), seen, parameters);
  }

  spatial::Problem problem_on(spatial::TractionMesh mesh, const std::vector<BeadInSpace>& seen,
                              const spatial::SpatialParameters& parameters) const {
    const spatial::Ground ground(nullptr);
    spatial::Problem made{.observed = observe(seen, gel, ground, parameters),
                          .gel = gel,
                          .ground = ground,
                          .expected = {over(), [](Vec2) { return true; }, "all", 1},
                          .mesh = std::move(mesh)};
    const auto& points = std::get<std::vector<Vec3>>(made.observed.at.points_um);
    made.response_um_per_kPa = response(made.mesh, points);
    std::vector<Vec3> below = made.vertices_um();
    for (Vec3& v : below) v.z = 0.5;  // point forces are singular on the surface
    made.surface_um_per_kPa = response(made.mesh, below);
    made.adhesion_areas_um2 = adhesion_areas_um2(made.mesh, ground, adhesions(), 0);
    made.patch_response_um_per_nN.resize(3 * std::ssize(points), 3 * std::ssize(spots));
    for (std::size_t s = 0; s < spots.size(); ++s)
      for (int c = 0; c < 3; ++c) {
        Spot unit = spots[s];
        unit.force_nN = {c == 0 ? 1.0 : 0.0, c == 1 ? 1.0 : 0.0, c == 2 ? 1.0 : 0.0};
        for (std::size_t b = 0; b < points.size(); ++b) {
          const Vec3 u = displaced_um(points[b], unit);
          made.patch_response_um_per_nN.block<3, 1>(3 * static_cast<Eigen::Index>(b),
                                                    3 * static_cast<Eigen::Index>(s) + c)
              << u.x,
              u.y, u.z;
        }
      }
    return made;
  }
};

}  // namespace mbtfm::test
