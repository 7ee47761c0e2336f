/// Experiments that tell two adhesions apart, or do not: the two fits by themselves, without what a plan knows of them.
#pragma once

#include <Eigen/Cholesky>

#include "samples/plan/adhesion_pair.h"
#include "substrate/greens/half_space.h"
#include "substrate/greens/inside.h"
#include "tests/support/test.h"

namespace mbtfm::test {

inline Eigen::MatrixXd pair_field(const Gel& gel, Vec2 centre_um, double radius_um, const std::vector<Vec2>& beads_um) {
  substrate::Ellipse e;
  e.centre_um = centre_um;
  e.semi_major_um = e.semi_minor_um = radius_um;
  const greens::HalfSpaceEllipse disc(gel, e);
  Eigen::MatrixXd G(2 * static_cast<Eigen::Index>(beads_um.size()), 2);
  for (std::size_t i = 0; i < beads_um.size(); ++i) {
    const bool is_far = norm(beads_um[i] - centre_um) > 8 * radius_um;
    const greens::Sym2 g = is_far ? disc.far_compliance_um_per_nN(beads_um[i]) : disc.compliance_um_per_nN(beads_um[i]);
    G.middleRows<2>(2 * static_cast<Eigen::Index>(i)) << g.xx, g.xy, g.xy, g.yy;
  }
  return G;
}

inline double misfit_of_forces(const Eigen::MatrixXd& G, const Eigen::VectorXd& u) {
  return (u - G * (G.transpose() * G).ldlt().solve(G.transpose() * u)).squaredNorm();
}

/// What unit forces at a place do to the beads.
using FieldAt = std::function<Eigen::MatrixXd(Vec2 centre_um)>;

/// The best place of one adhesion, by a pattern of steps that halve, from the middle and from both places.
inline double misfit_of_one(const FieldAt& field, double radius_um, const Eigen::VectorXd& u, double distance_um) {
  double best = 1e300;
  for (const double start : {0.0, -0.5, 0.5}) {
    Vec2 at{start * distance_um, 0};
    double here = misfit_of_forces(field(at), u);
    for (double step = 0.25 * distance_um; step > 0.02 * radius_um;) {
      bool has_moved = false;
      for (const Vec2 way : {Vec2{1, 0}, Vec2{-1, 0}, Vec2{0, 1}, Vec2{0, -1}}) {
        const double there = misfit_of_forces(field(at + step * way), u);
        if (there >= here) continue;
        here = there;
        at += step * way;
        has_moved = true;
        break;
      }
      if (!has_moved) step /= 2;
    }
    best = std::min(best, here);
  }
  return best;
}

/// Whether beads tell two adhesions of 1 nN each apart. @param noise  that they have, over noise_um
inline bool is_resolved(const FieldAt& field, double radius_um, double distance_um, int axis, double noise_um,
                        const Eigen::VectorXd& noise) {
  const Eigen::MatrixXd first = field({-0.5 * distance_um, 0}), second = field({0.5 * distance_um, 0});
  Eigen::MatrixXd both(first.rows(), first.cols() + second.cols());
  both << first, second;
  const Eigen::VectorXd u = first.col(axis) + second.col(axis) + noise_um * noise;
  return misfit_of_one(field, radius_um, u, distance_um) - misfit_of_forces(both, u) >
         plan::kResolved * noise_um * noise_um;
}

/// Two adhesions that pull with 1 nN each, along their line or across it in turn.
struct DrawnPair {
  Gel gel;
  double radius_um = 0, distance_um = 0, beads_per_um2 = 0, noise_um = 0;
  double half_field_um = 0;
};

/// Whether one drawn experiment tells the two apart.
inline bool is_resolved(const DrawnPair& p, int draw) {
  std::mt19937_64 random(static_cast<std::uint64_t>(draw) + 77);
  std::uniform_real_distribution<double> place(-p.half_field_um, p.half_field_um);
  std::normal_distribution<double> normal;
  const auto n = static_cast<int>(p.beads_per_um2 * 4 * p.half_field_um * p.half_field_um);
  std::vector<Vec2> beads_um;
  for (int i = 0; i < n; ++i) {
    const double x = place(random);
    beads_um.push_back({x, place(random)});
  }
  Eigen::VectorXd noise(2 * n);
  for (double& component : noise) component = normal(random);
  return is_resolved([&](Vec2 at) { return pair_field(p.gel, at, p.radius_um, beads_um); }, p.radius_um, p.distance_um,
                     draw % 2, p.noise_um, noise);
}

/// The same with beads in a volume: forces along x, along y and into the gel in turn.
struct DrawnPairInSpace {
  Gel gel;
  double radius_um = 0, distance_um = 0, beads_per_um3 = 0, noise_um = 0;
  plan::BeadVolume volume;
  double half_field_um = 0;
};

/// Rows along z count by their own noise.
inline Eigen::MatrixXd pair_field_inside(const Gel& gel, Vec2 centre_um, double radius_um,
                                         const std::vector<Vec3>& beads_um, double axial_noise) {
  substrate::Ellipse e;
  e.centre_um = centre_um;
  e.semi_major_um = e.semi_minor_um = radius_um;
  const greens::EllipseInside disc(gel, nullptr, e);
  Eigen::MatrixXd G(3 * static_cast<Eigen::Index>(beads_um.size()), 3);
  for (std::size_t i = 0; i < beads_um.size(); ++i) {
    const Vec3 at = beads_um[i];
    const Vec2 away = Vec2{at.x, at.y} - centre_um;
    const bool is_far = norm(Vec3{away.x, away.y, at.z}) > 8 * radius_um;
    const auto row = 3 * static_cast<Eigen::Index>(i);
    G.middleRows<3>(row) =
        is_far ? greens::half_space_inside_um_per_nN(gel, away, at.z) : disc.compliance_um_per_nN({at.x, at.y}, at.z);
    G.row(row + 2) /= axial_noise;
  }
  return G;
}

inline bool is_resolved(const DrawnPairInSpace& p, int draw) {
  std::mt19937_64 random(static_cast<std::uint64_t>(draw) + 77);
  std::uniform_real_distribution<double> place(-p.half_field_um, p.half_field_um), depth(0, p.volume.depth_um);
  std::normal_distribution<double> normal;
  const auto n = static_cast<int>(p.beads_per_um3 * 4 * p.half_field_um * p.half_field_um * p.volume.depth_um);
  std::vector<Vec3> beads_um;
  for (int i = 0; i < n; ++i) {
    const double x = place(random), y = place(random);
    beads_um.push_back({x, y, depth(random)});
  }
  Eigen::VectorXd noise(3 * n);
  for (double& component : noise) component = normal(random);
  return is_resolved([&](Vec2 at) { return pair_field_inside(p.gel, at, p.radius_um, beads_um, p.volume.axial_noise); },
                     p.radius_um, p.distance_um, draw % 3, p.noise_um, noise);
}

}  // namespace mbtfm::test
