/// Large strains, against closed forms and manufactured fields (tests/data/reference/curved, by another program).
#include <Eigen/LU>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "substrate/choice/large_strain.h"
#include "substrate/elements/linear.h"
#include "substrate/elements/neo_hooke.h"
#include "substrate/elements/surface_loads.h"
#include "tests/support/cubed_sphere.h"
#include "tests/support/field_under_a_surface.h"

namespace mbtfm::elements {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using test::CubedSphere;

const numerics::FactorOptions kTwoThreads{.threads = 2, .memory_limit_GB = 8};

Matrix3d random_F(unsigned seed) {
  std::srand(seed);
  return Matrix3d::Identity() + 0.3 * Matrix3d::Random();
}

TEST(NeoHooke, has_the_stresses_of_the_closed_forms_in_even_states) {
  const files::CsvTable table(curved_folder("homogeneous.csv"));
  std::map<std::string, int> n;
  for (int row = 0; row < table.n_rows(); ++row) {
    const auto at = [&](const char* column) { return table.number(row, column); };
    const NeoHooke law({at("youngs_modulus_kPa"), at("poisson_ratio"), 1});
    const std::string name = table.text(row, "case");
    const double stretch = at("stretch_or_shear");
    const bool is_shear = name == "simple_shear";
    const auto state = [&](double lateral) {
      Matrix3d F = Matrix3d::Identity();
      if (is_shear) F(0, 1) = stretch;
      if (name == "uniaxial" || name == "confined") F.diagonal() << stretch, lateral, lateral;
      if (name == "equibiaxial") F.diagonal() << stretch, stretch, lateral;
      return F;
    };
    const auto free_kPa = [&](double lateral) {
      const Matrix3d gradient = state(lateral);
      return law.stress_kPa(gradient, law.pressure_kPa(gradient.determinant()))(2, 2);
    };
    // that of the file has 12 digits, too few where kappa is large: the same one, with all digits
    double lateral = at("lateral_stretch");
    if (name == "uniaxial" || name == "equibiaxial") {
      for (int step = 0; step < 3; ++step)
        lateral -= free_kPa(lateral) * 2e-7 / (free_kPa(lateral + 1e-7) - free_kPa(lateral - 1e-7));
      EXPECT_NEAR(lateral, at("lateral_stretch"), 1e-11);
    }
    const Matrix3d F = state(lateral);
    const double J = F.determinant();
    const Matrix3d P = law.stress_kPa(F, law.pressure_kPa(J)), cauchy = P * F.transpose() / J;
    // relative to the shear modulus, with the 12 digits of the file's own
    const double rounding = 1e-9 * law.mu_kPa + 1e-12 * std::abs(at("cauchy_kPa"));
    EXPECT_NEAR(cauchy(0, is_shear), at("cauchy_kPa"), rounding) << name << " " << stretch;
    // what is written of a strained gel is by area as it lies
    const Gel gel{at("youngs_modulus_kPa"), at("poisson_ratio"), 1};
    const Matrix3d written = large_stress(gel, {}).at(F - Matrix3d::Identity(), law.pressure_kPa(J), 0);
    EXPECT_NEAR(written(0, is_shear), at("cauchy_kPa"), rounding) << name << " " << stretch;
    EXPECT_NEAR(P(0, is_shear), at("nominal_kPa"), rounding);
    if (is_shear)
      EXPECT_NEAR(cauchy(0, 0) - cauchy(1, 1), at("other_kPa"), rounding);
    else
      EXPECT_NEAR(cauchy(1, 1), name == "equibiaxial" ? at("cauchy_kPa") : at("other_kPa"), rounding);
    ++n[name];
  }
  EXPECT_EQ(n.size(), 4u);
}

TEST(NeoHooke, its_tangent_is_the_derivative_of_its_stress) {
  const NeoHooke law({10, 0.49, 1});
  const Matrix3d F = random_F(1), dF = random_F(2) - Matrix3d::Identity();
  constexpr double kStep = 1e-5;
  const Matrix3d difference = (law.stress_kPa(F + kStep * dF, 3) - law.stress_kPa(F - kStep * dF, 3)) / (2 * kStep);
  EXPECT_LE((law.stress_change_kPa(F, 3, dF) - difference).norm(), 1e-8 * difference.norm());
}

Block block_of(const Shape& shape, double half_um, int n, int layers) {
  elements::GridLines lines;
  for (int k = 0; k <= n; ++k) lines.x_um.push_back(half_um * (2.0 * k / n - 1));
  lines.y_um = lines.x_um;
  for (int k = 0; k <= layers; ++k) lines.z_um.push_back(shape.base_um * k / layers);
  return {shape, lines, [](const elements::Box&) { return false; }, Sides::held, 100000, 2};
}

// One even state in bent cells: F given on the sides and, as a traction, on the surface.
TEST(NeoHooke, an_even_state_is_exact_in_bent_cells) {
  const Gel gel{10, 0.4999, 20};
  const NeoHooke law(gel);
  Matrix3d F = Matrix3d::Identity();
  F(0, 2) = 0.3;  // the base, z = 20, stays where it is
  F(1, 2) = -0.2;
  const auto u = [&](const Vector3d& p) -> Vector3d { return (F - Matrix3d::Identity()) * (p - Vector3d(0, 0, 20)); };
  const Matrix3d P = law.stress_kPa(F, law.pressure_kPa(F.determinant()));
  const Block block = block_of({[](Vec2 p) { return 2 * std::cos(0.3 * p.x); }, 20}, 15, 3, 2);
  const Space space(block.mesh(), 2);
  const LargeSolution solution = solve_neo_hooke(
      gel, space, {.traction_kPa = [&](const Vector3d&, const Vector3d& n) -> Vector3d { return P * n; }, .held_um = u},
      1, kTwoThreads);
  for (std::size_t k = 0; k < block.mesh().position_um.size(); ++k)
    EXPECT_LE((solution.state.at_nodes_um[k] - u(block.mesh().position_um[k])).norm(), 1e-8);
  const Matrix3d cauchy = P * F.transpose() / F.determinant();
  const auto field = volume_field(space, solution.state.at_nodes_um, large_stress(gel, solution.state));
  EXPECT_EQ(field.stress_kPa.size(), 8u * block.mesh().n_cells());
  for (const std::array<double, 6>& stress : field.stress_kPa) {
    const std::array exact = {cauchy(0, 0), cauchy(1, 1), cauchy(2, 2), cauchy(0, 1), cauchy(1, 2), cauchy(0, 2)};
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(stress[k], exact[k], 1e-6);
  }
}

/// Of a displacement, in the whole volume, L2.
double relative_error(const Space& space, const Vectors& at_nodes_um, const OfPlace& truth_um) {
  double error = 0, size = 0;
  for (int cell = 0; cell < space.mesh().n_cells(); ++cell) {
    const Element element(space.mesh().positions_of(cell));
    for (int q = 0; q < static_cast<int>(element.points.size()); ++q) {
      const Vector3d truth = truth_um(element.points[q].position_um);
      const double volume = element.points[q].volume_um3;
      error += volume * (space.values_of(cell, at_nodes_um) * shapes_of_point(q) - truth).squaredNorm();
      size += volume * truth.squaredNorm();
    }
  }
  return std::sqrt(error / size);
}

/// x = X + u of wavy_manufactured.csv.
struct Wavy {
  double base, amplitude, k, p, q, c1, c2, c3;
  Gel gel;
  Vector3d u(const Vector3d& X) const {
    const double f = (1 - X.z() / base) * (2 - X.z() / base) / 2;
    if (c3 != 0) {
      return f * Vector3d(c1 * std::sin(p * X.x()) * std::cos(q * X.y()),
                          c2 * std::cos(p * X.x()) * std::sin(q * X.y()), c3 * std::cos(p * X.x() + q * X.y()));
    }
    const double x = X.x() + c1 * f * std::sin(q * X.y());
    return {x - X.x(), c2 * f * std::sin(p * x), 0};
  }
  Matrix3d F(const Vector3d& X) const {
    constexpr double kStep = 1e-3;  // fourth order: 1e-13
    Matrix3d F = Matrix3d::Identity();
    for (int j = 0; j < 3; ++j) {
      const Vector3d h = kStep * Vector3d::Unit(j);
      F.col(j) += (8 * (u(X + h) - u(X - h)) - (u(X + 2 * h) - u(X - 2 * h))) / (12 * kStep);
    }
    return F;
  }
  Matrix3d stress(const Vector3d& X) const {
    const NeoHooke law(gel);
    const Matrix3d gradient = F(X);
    return law.stress_kPa(gradient, law.pressure_kPa(gradient.determinant()));
  }
  Vector3d body(const Vector3d& X) const {
    constexpr double kStep = 0.05;
    Vector3d b = Vector3d::Zero();
    for (int j = 0; j < 3; ++j) {
      const Vector3d h = kStep * Vector3d::Unit(j);
      b -= (8 * (stress(X + h) - stress(X - h)) - (stress(X + 2 * h) - stress(X - 2 * h))).col(j) / (12 * kStep);
    }
    return b;
  }
};

TEST(NeoHooke, a_manufactured_field_on_a_wave_is_met_with_order_at_any_poisson_ratio) {
  const files::CsvTable table(curved_folder("wavy_manufactured.csv"));
  std::array<bool, 2> is_done = {};
  for (int row = 0; row < table.n_rows(); ++row) {
    const auto at = [&](const char* column) { return table.number(row, column); };
    Wavy wavy{at("base_z_um"), at("amplitude_um"), 2 * std::numbers::pi / at("period_um"),
              at("p_per_um"),  at("q_per_um"),     at("c1_um"),
              at("c2_um"),     at("c3_um"),        {at("youngs_modulus_kPa"), at("poisson_ratio"), at("base_z_um")}};
    const Vector3d X(at("X_um"), at("Y_um"), at("Z_um"));
    // the field of this test is that of the table
    EXPECT_LE((wavy.u(X) - Vector3d(at("ux_um"), at("uy_um"), at("uz_um"))).norm(), 1e-9);
    EXPECT_NEAR(wavy.F(X).determinant(), at("J"), 1e-8);
    EXPECT_LE((wavy.body(X) - Vector3d(at("bx_kPa_per_um"), at("by_kPa_per_um"), at("bz_kPa_per_um"))).norm(), 2e-4);
    // One has forces per volume of some 200 kPa over the gel's depth, 60 times its shear modulus: no stable state was
    // found on the way to it. Of a tenth of its displacement there is one.
    const bool is_weak = wavy.c3 != 0;
    if (is_done[is_weak]) continue;
    is_done[is_weak] = true;
    if (is_weak)
      for (double* c : {&wavy.c1, &wavy.c2, &wavy.c3}) *c *= 0.1;
    std::vector<double> errors;
    for (const int n : {5, 10}) {
      const Block block = block_of(
          {[&](Vec2 p) { return -wavy.amplitude * std::cos(wavy.k * p.x) * std::cos(wavy.k * p.y); }, wavy.base}, 25, n,
          n);
      const Space space(block.mesh(), 2);
      const LargeSolution solution =
          solve_neo_hooke(wavy.gel, space,
                          {.traction_kPa = [&](const Vector3d& p, const Vector3d& normal) -> Vector3d {
                             return wavy.stress(p) * normal;
                           },
                           .held_um = [&](const Vector3d& p) { return wavy.u(p); },
                           .force_kPa_per_um = [&](const Vector3d& p) { return wavy.body(p); }},
                          2, kTwoThreads);
      EXPECT_LE(solution.most_iterations, 6);
      errors.push_back(relative_error(space, solution.state.at_nodes_um, [&](const Vector3d& p) { return wavy.u(p); }));
    }
    RecordProperty("wave_" + brief(wavy.gel.poisson_ratio), brief(errors[0]) + " " + brief(errors[1]));
    EXPECT_LE(errors[1], 0.01) << wavy.gel.poisson_ratio;
    EXPECT_GE(std::log2(errors[0] / errors[1]), 2.5) << wavy.gel.poisson_ratio;
  }
  EXPECT_TRUE(is_done[0] && is_done[1]);
}

TEST(NeoHooke, a_blown_up_shell_is_that_of_the_boundary_value_problem_in_the_radius_alone) {
  const files::CsvTable table(curved_folder("sphere.csv"));
  struct Shell {
    double youngs_modulus_kPa, poisson_ratio, inner_um, outer_um, inner_stretch;
    auto operator<=>(const Shell&) const = default;
  };
  std::map<Shell, std::vector<std::pair<double, double>>> shells;  // radii before and after
  for (int row = 0; row < table.n_rows(); ++row) {
    const auto at = [&](const char* column) { return table.number(row, column); };
    const Shell shell{at("youngs_modulus_kPa"), at("poisson_ratio"), at("inner_um"), at("outer_um"),
                      at("inner_stretch")};
    // pulled inwards to .7, meshes of 3 and 6 cells a patch find no stable state beyond 72 and 76 % of that, one of 4
    // cells none that is round
    if (shell.inner_stretch > 1) shells[shell].emplace_back(at("R_um"), at("r_um"));
  }
  EXPECT_GE(shells.size(), 4u);
  for (const auto& [shell, radii] : shells) {
    const std::string name = brief(shell.poisson_ratio) + ", stretched by " + brief(shell.inner_stretch);
    std::vector<double> errors;
    for (const int n : {2, 4}) {
      const CubedSphere sphere(shell.inner_um, shell.outer_um, n, n);
      const Space space(sphere.mesh, 2);
      const LargeSolution solution = solve_neo_hooke(
          {shell.youngs_modulus_kPa, shell.poisson_ratio, 1}, space,
          {.held_um = [&](const Vector3d& p) -> Vector3d { return (shell.inner_stretch - 1) * p; }}, 2, kTwoThreads);
      EXPECT_LE(solution.most_iterations, 6) << name;
      double error = 0, size = 0;
      int n_met = 0;
      for (std::size_t k = 0; k < sphere.mesh.position_um.size(); ++k) {
        const Vector3d& at = sphere.mesh.position_um[k];
        if (sphere.mesh.is_held[k]) continue;
        for (const auto& [before, after] : radii) {
          if (std::abs(at.norm() - before) > 1e-6) continue;
          error += (at + solution.state.at_nodes_um[k] - after / before * at).squaredNorm();
          size += std::pow(after - before, 2);
          ++n_met;
        }
      }
      EXPECT_GE(n_met, 100);
      errors.push_back(std::sqrt(error / size));
    }
    RecordProperty("sphere_" + name, brief(errors[0]) + " " + brief(errors[1]));
    EXPECT_LE(errors[1], 0.01) << name;
    EXPECT_GE(std::log2(errors[0] / errors[1]), 2.5) << name;
  }
}

/// Two patches that pull at each other.
struct FarScene {
  std::string name;
  double wave_um;  ///< amplitude of the surface
  Vector3d direction;
  double mu_share;  ///< traction over the shear modulus
  double semi_major_um = 3, semi_minor_um = 3;
  double poisson_ratio = 0.49, thickness_um = 30;
};

std::vector<double> mirrored(const std::vector<double>& from_zero_um) {
  std::vector<double> lines(from_zero_um.rbegin(), from_zero_um.rend());
  for (double& line : lines) line = -line;
  lines.insert(lines.end(), from_zero_um.begin() + 1, from_zero_um.end());
  return lines;
}

// the first three gave the number its factor, the others did not
TEST(NeoHooke, the_error_of_linear_theory_is_predicted_within_a_factor_of_two) {
  for (const FarScene& scene : {FarScene{"flat, tangential", 0, {1, 0, 0}, 0.4},
                                {"flat, oblique", 0, {1, 0, -1}, 0.4},
                                {"wave, tangential", 4, {1, 0, 0}, 0.4},
                                {"flat, gentle", 0, {1, 0, 0}, 0.1},
                                {"long patches", 0, {1, 0, 0}, 0.4, 5, 2.5},
                                {"thin, nearly incompressible", 0, {1, 0, 0}, 0.4, 3, 3, 0.4999, 10}}) {
    const Gel gel{8.4, scene.poisson_ratio, scene.thickness_um};
    const double mu = NeoHooke(gel).mu_kPa;
    // elements as fine as at the patches only beside them
    const elements::GridLines lines = {mirrored({0, 2.7, 5.4, 8.1, 10.8, 13.5, 17, 21.5, 27}),
                                       mirrored({0, 2.7, 5.4, 9, 15, 27}), layers_um(gel.thickness_um, 5)};
    const Block block(
        {[&](Vec2 p) { return scene.wave_um * std::cos(2 * std::numbers::pi * p.x / 40); }, gel.thickness_um}, lines,
        [](const elements::Box&) { return false; }, Sides::free, 100000, 2);
    const Space space(block.mesh(), 2);
    const std::vector<substrate::Ellipse> ellipses = {{{-10, 0}, scene.semi_major_um, scene.semi_minor_um, 0.4},
                                                      {{10, 0}, scene.semi_major_um, scene.semi_minor_um, 0.4}};
    const auto weights = load_weights(block, space, {ellipses, 3});
    Vectors forces(space.nodes().size(), Vector3d::Zero());
    const double force_nN = scene.mu_share * mu * std::numbers::pi * scene.semi_major_um * scene.semi_minor_um;
    for (int j = 0; j < 2; ++j) {
      Vector3d towards = scene.direction.normalized();
      if (j == 1) towards.x() *= -1;
      for (const auto& [node, weight] : weights[j]) forces[node] += weight * force_nN * towards;
    }
    // linear theory on the same elements: a load so weak that it holds
    constexpr double kWeak = 1e-4;
    Vectors weak_forces = forces;
    for (Vector3d& force : weak_forces) force *= kWeak;
    Vectors linear = solve_neo_hooke(gel, space, {.at_nodes_nN = weak_forces}, 1, kTwoThreads).state.at_nodes_um;
    for (Vector3d& u : linear) u /= kWeak;
    const LargeSolution large = solve_neo_hooke(gel, space, {.at_nodes_nN = forces}, 1, kTwoThreads);
    EXPECT_LE(large.most_iterations, 6) << scene.name;
    double error = 0, size = 0;
    for (int cell = 0; cell < block.mesh().n_cells(); ++cell) {
      const Element element(block.mesh().positions_of(cell));
      const NodeValues a = space.values_of(cell, linear), b = space.values_of(cell, large.state.at_nodes_um);
      for (int q = 0; q < static_cast<int>(element.points.size()); ++q) {
        error += element.points[q].volume_um3 * ((a - b) * shapes_of_point(q)).squaredNorm();
        size += element.points[q].volume_um3 * (b * shapes_of_point(q)).squaredNorm();
      }
    }
    const double truth = std::sqrt(error / size);
    const double predicted = choice::left_out_in_gel(gel, scene.mu_share * mu);
    RecordProperty(scene.name, brief(predicted) + " " + brief(truth));
    EXPECT_LE(predicted, 2 * truth) << scene.name;
    EXPECT_GE(predicted, truth / 2) << scene.name;
  }
}

TEST(NeoHooke, newton_converges_quadratically_and_a_load_too_large_keeps_the_last_good_state) {
  const Block block = block_of({[](Vec2 p) { return 2 * std::cos(0.3 * p.x); }, 20}, 15, 3, 2);
  const Space space(block.mesh(), 2);
  const auto pull = [](double kPa) {
    return LargeLoading{.traction_kPa = [kPa](const Vector3d& p, const Vector3d&) -> Vector3d {
      return Vector3d(kPa * std::exp(-0.05 * p.head<2>().squaredNorm()), 0, 0);
    }};
  };
  for (const double nu : {0.49, 0.4999}) {
    const LargeSolution solution = solve_neo_hooke({10, nu, 20}, space, pull(3), 1, kTwoThreads);
    EXPECT_LE(solution.most_iterations, 6) << nu;
    const std::vector<double>& r = solution.residuals;
    ASSERT_GE(r.size(), 3u);
    // the last step before rounding at least squares the residual, up to a constant
    EXPECT_LE(r[r.size() - 1], std::max(1e-11, 100 * r[r.size() - 2] * r[r.size() - 2])) << nu;
  }
  const LargeSolution partly = solve_neo_hooke_as_far({10, 0.49, 20}, space, pull(3000), 4, kTwoThreads);
  EXPECT_LT(partly.share, 1);
  for (const Vector3d& u : partly.state.at_nodes_um) EXPECT_TRUE(u.allFinite());
  EXPECT_THROW(solve_neo_hooke({10, 0.49, 20}, space, pull(3000), 4, kTwoThreads), NotSolved);
}

}  // namespace
}  // namespace mbtfm::elements
