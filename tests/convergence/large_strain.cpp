/// What large strains change of a gel's displacement, for fits that go on from a linear model.
#include <Eigen/Cholesky>

#include "pipeline/contract/numbers.h"
#include "substrate/choice/factory.h"
#include "substrate/choice/large_strain.h"
#include "substrate/loads.h"
#include "substrate/material.h"
#include "tests/support/test.h"

namespace mbtfm::choice {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using substrate::Ellipse;

const Gel kGel{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 40};

struct Scene {
  std::vector<Ellipse> ellipses;
  std::vector<Vec2> beads;
};

/// Adhesions on a circle, beads all over.
Scene ring(int n, double radius_um) {
  Scene s;
  for (int k = 0; k < n; ++k) {
    const double angle = 2 * std::numbers::pi * k / n;
    s.ellipses.push_back({radius_um * Vec2{std::cos(angle), std::sin(angle)}, 0.9, 0.4, angle});
  }
  std::mt19937_64 random(3);
  const auto anywhere = [&] { return 1.8 * radius_um * (2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1); };
  for (int i = 0; i < 1200; ++i) s.beads.push_back({anywhere(), anywhere()});
  return s;
}

/// Towards the middle, of the traction over the shear modulus that is given.
VectorXd inwards(const Scene& s, double mu_share) {
  VectorXd forces(2 * std::ssize(s.ellipses));
  for (std::size_t j = 0; j < s.ellipses.size(); ++j) {
    const Ellipse& e = s.ellipses[j];
    const double size = mu_share * substrate::shear_modulus_kPa(kGel) * std::numbers::pi * e.semi_major_um *
                        e.semi_minor_um / norm(e.centre_um);
    forces.segment<2>(2 * static_cast<Index>(j)) << -size * e.centre_um.x, -size * e.centre_um.y;
  }
  return forces;
}

VectorXd some(Index n, unsigned seed) {
  std::mt19937_64 random(seed);
  VectorXd values(n);
  for (double& v : values) v = 2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1;
  return values;
}

TEST(LargeStrain, its_response_is_the_derivative_of_its_change) {
  const Scene s = ring(2, 6);
  const VectorXd forces = inwards(s, 0.8), way = some(forces.size(), 5) * forces.norm();
  const LargeStrain large(kGel, s.ellipses, s.beads, forces, 2);
  constexpr double kStep = 1e-3;
  const VectorXd along = large.about(forces).response->displace(way),
                 between = (large.about(forces + kStep * way).displacement_um -
                            large.about(forces - kStep * way).displacement_um) /
                           (2 * kStep);
  EXPECT_LE((along - between).norm(), 1e-4 * between.norm());
  EXPECT_GT(along.norm(), 0);
}

TEST(LargeStrain, the_gels_tangent_has_its_exact_transpose) {
  const Scene s = ring(2, 6);
  substrate::SubstrateParameters p;
  p.model = substrate::ModelKind::curved;
  p.material = MaterialLaw::neo_hooke;
  p.effects.large_strain = Switch::on;
  p.displacement_tolerance = 0;
  const auto gel = make_substrate(kGel, p, 2);
  const auto response = gel->response({s.ellipses}, {s.beads});
  const auto tangent = response->about(inwards(s, 0.8)).response;
  const VectorXd f = some(tangent->cols(), 1), d = some(tangent->rows(), 2);
  const VectorXd forwards = tangent->displace(f), back = tangent->pull_back(d);
  EXPECT_NEAR(d.dot(forwards), f.dot(back), 1e-12 * d.norm() * forwards.norm());
}

TEST(LargeStrain, of_weak_forces_nothing_is_left) {
  const Scene s = ring(2, 6);
  const LargeStrain large(kGel, s.ellipses, s.beads, inwards(s, 1), 2);
  const VectorXd at_half = large.about(inwards(s, 0.1)).displacement_um,
                 at_quarter = large.about(inwards(s, 0.05)).displacement_um;
  EXPECT_NEAR(at_quarter.norm() / at_half.norm(), 0.25, 0.01);  // it begins with the square
  EXPECT_EQ(large.about(VectorXd::Zero(4)).displacement_um.norm(), 0);
}

TEST(LargeStrain, adhesions_that_hardly_pull_stay_out_of_it) {
  Scene s = ring(2, 6);
  const VectorXd forces = inwards(s, 0.8);
  const VectorXd alone = LargeStrain(kGel, s.ellipses, s.beads, forces, 2).about(forces).displacement_um;
  s.ellipses.push_back({{1, 2}, 0.5, 0.4, 0});
  VectorXd with(forces.size() + 2);
  with << forces, 0.02, 0.01;
  const substrate::Tangent change = LargeStrain(kGel, s.ellipses, s.beads, with, 2).about(with);
  EXPECT_EQ(change.displacement_um, alone);
  EXPECT_EQ(change.response->cols(), with.size());
  EXPECT_EQ(change.response->matrix().rightCols(2).norm(), 0);
}

/// Most of what coarse elements get wrong of the change, itself some per cent of the displacement, lies on the
/// adhesions, where strains are infinite in linear theory.
TEST(LargeStrain, coarse_elements_give_the_change_within_what_is_stated) {
  const Scene s = ring(4, 8);
  const VectorXd forces = inwards(s, 0.5);
  const VectorXd coarse = LargeStrain(kGel, s.ellipses, s.beads, forces, 2).about(forces).displacement_um,
                 fine = LargeStrain(kGel, s.ellipses, s.beads, forces, 2, 4).about(forces).displacement_um;
  VectorXd away = VectorXd::Ones(fine.size());
  for (std::size_t b = 0; b < s.beads.size(); ++b)
    for (const Ellipse& e : s.ellipses)
      if (norm(s.beads[b] - e.centre_um) < 2 * e.semi_major_um) away.segment<2>(2 * static_cast<Index>(b)).setZero();
  const double off = (coarse - fine).norm() / fine.norm(),
               off_there = away.cwiseProduct(coarse - fine).norm() / away.cwiseProduct(fine).norm();
  RecordProperty("elements", brief(off) + " " + brief(off_there));
  EXPECT_LE(off, kStrainElementsError);
  EXPECT_LE(off_there, 0.1);
}

/// Independent forces of all adhesions, found from what the gel does, by its linear model and about what that found.
TEST(LargeStrain, forces_are_found_by_its_tangent_that_linear_theory_misses) {
  const Scene s = ring(4, 8);
  const VectorXd truth = inwards(s, 0.9);
  substrate::SubstrateParameters layer;
  layer.model = substrate::ModelKind::layer;
  const Eigen::MatrixXd G = make_substrate(kGel, layer, 2)->response({s.ellipses}, {s.beads})->matrix();
  const VectorXd seen = G * truth + LargeStrain(kGel, s.ellipses, s.beads, truth, 2, 2).about(truth).displacement_um;
  const VectorXd linear = (G.transpose() * G).ldlt().solve(G.transpose() * seen);
  const substrate::Tangent change = LargeStrain(kGel, s.ellipses, s.beads, linear, 2).about(linear);
  const Eigen::MatrixXd T = G + change.response->matrix();
  const VectorXd left = seen - G * linear - change.displacement_um;
  const VectorXd found = linear + (T.transpose() * T).ldlt().solve(T.transpose() * left);
  RecordProperty("forces",
                 brief((linear - truth).norm() / truth.norm()) + " " + brief((found - truth).norm() / truth.norm()));
  EXPECT_LT((found - truth).norm(), 0.4 * (linear - truth).norm());
}

TEST(LargeStrain, what_linear_theory_leaves_out_at_beads_is_predicted_within_a_factor_of_two) {
  for (const auto& [n, radius_um, share] :
       {std::tuple{2, 6.0, 0.4}, std::tuple{4, 8.0, 0.2}, std::tuple{4, 8.0, 1.2}, std::tuple{12, 12.0, 0.4}}) {
    const Scene s = ring(n, radius_um);
    const VectorXd forces = inwards(s, share);
    substrate::SubstrateParameters layer;
    layer.model = substrate::ModelKind::layer;
    const VectorXd linear = make_substrate(kGel, layer, 2)->response({s.ellipses}, {s.beads})->displace(forces);
    const double truth =
        LargeStrain(kGel, s.ellipses, s.beads, forces, 2).about(forces).displacement_um.norm() / linear.norm();
    const double predicted = left_out_at_beads(kGel, mean_traction_kPa(s.ellipses, forces));
    RecordProperty("predicted_" + std::to_string(n) + "_" + brief(share), brief(predicted) + " " + brief(truth));
    EXPECT_LE(predicted, 2 * truth) << n << " " << share;
    EXPECT_GE(predicted, truth / 2) << n << " " << share;
  }
}

TEST(LargeStrain, tractions_are_weighed_by_the_squares_of_their_forces) {
  const std::vector<Ellipse> two = {{{0, 0}, 1, 1, 0}, {{5, 0}, 2, 2, 0}};
  const Eigen::Vector4d forces(3, 0, 0, 4);
  const double a = 3 / std::numbers::pi, b = 1 / std::numbers::pi;
  EXPECT_NEAR(mean_traction_kPa(two, forces), std::sqrt((9 * a * a + 16 * b * b) / 25), 1e-14);
  EXPECT_EQ(mean_traction_kPa(two, Eigen::Vector4d::Zero()), 0);
}

}  // namespace
}  // namespace mbtfm::choice
