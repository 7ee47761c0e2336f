/// Experiments that tell two adhesions apart, or do not: the two fits by themselves, without what a plan knows of them.
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <random>
#include <vector>

#include "mbtfm/plan/adhesion_pair.h"
#include "substrate/greens/half_space.h"

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

/// The best place of one adhesion, by a pattern of steps that halve, from the middle and from both places.
inline double misfit_of_one(const Gel& gel, double radius_um, const std::vector<Vec2>& beads_um,
                            const Eigen::VectorXd& u, double distance_um) {
  double best = 1e300;
  for (const double start : {0.0, -0.5, 0.5}) {
    Vec2 at{start * distance_um, 0};
    double here = misfit_of_forces(pair_field(gel, at, radius_um, beads_um), u);
    for (double step = 0.25 * distance_um; step > 0.02 * radius_um;) {
      bool has_moved = false;
      for (const Vec2 way : {Vec2{1, 0}, Vec2{-1, 0}, Vec2{0, 1}, Vec2{0, -1}}) {
        const double there = misfit_of_forces(pair_field(gel, at + step * way, radius_um, beads_um), u);
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

/// Two adhesions that pull with 1 nN each, along their line or across it in turn.
struct DrawnPair {
  Gel gel;
  double radius_um = 0, distance_um = 0, beads_per_um2 = 0, noise_um = 0;
  double half_field_um = 0;
};

/// Whether one drawn experiment tells the two apart.
inline bool is_told(const DrawnPair& p, int draw) {
  std::mt19937_64 random(static_cast<std::uint64_t>(draw) + 77);
  std::uniform_real_distribution<double> place(-p.half_field_um, p.half_field_um);
  std::normal_distribution<double> normal(0, p.noise_um);
  const auto n = static_cast<int>(p.beads_per_um2 * 4 * p.half_field_um * p.half_field_um);
  std::vector<Vec2> beads_um;
  for (int i = 0; i < n; ++i) {
    const double x = place(random);
    beads_um.push_back({x, place(random)});
  }
  Eigen::MatrixXd both(2 * n, 4);
  both.leftCols<2>() = pair_field(p.gel, {-0.5 * p.distance_um, 0}, p.radius_um, beads_um);
  both.rightCols<2>() = pair_field(p.gel, {0.5 * p.distance_um, 0}, p.radius_um, beads_um);
  const Eigen::Vector2d one = draw % 2 == 0 ? Eigen::Vector2d(1, 0) : Eigen::Vector2d(0, 1);
  Eigen::Vector4d forces;
  forces << one, one;
  Eigen::VectorXd u = both * forces;
  for (double& component : u) component += normal(random);
  return misfit_of_one(p.gel, p.radius_um, beads_um, u, p.distance_um) - misfit_of_forces(both, u) >
         plan::kTold * p.noise_um * p.noise_um;
}

}  // namespace mbtfm::test
