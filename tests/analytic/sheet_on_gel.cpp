/// Sheets bonded to gels against an exact spectral solution (tests/data/reference/chapter4).
#include <Eigen/LU>

#include "continuum/sheet/forward.h"
#include "continuum/sheet/mesh_size.h"
#include "continuum/sheet/parameters.h"
#include "pipeline/contract/errors.h"
#include "substrate/greens/models.h"
#include "tests/support/sheets.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::sheet;
using test::Deviation;

constexpr double kThick_um = 1e5;

struct DiscOnGel {
  double radius_um = 0;
  Scene scene;
  Gel gel;
};

DiscOnGel disc_of(const files::CsvTable& csv, int row, double finer = 1) {
  const auto value = [&](const char* column) {
    return csv.text(row, column) == "inf" ? std::numeric_limits<double>::infinity() : csv.number(row, column);
  };
  DiscOnGel disc{.radius_um = value("radius_um")};
  disc.gel = {value("gel_E_kPa"), value("gel_nu"), std::min(kThick_um, value("gel_thickness_um"))};
  disc.scene.region.rims.emplace_back(test::circle(disc.radius_um));
  disc.scene.material = {value("E_kPa"), value("nu"), value("h_um")};
  disc.scene.contraction.nN_per_um = value("s_nN_per_um");
  if (std::isfinite(value("adhesion_nN_per_um3"))) disc.scene.adhesion_nN_per_um3 = value("adhesion_nN_per_um3");
  disc.scene.size = size_on_gel(disc.scene.region, disc.scene.material, disc.gel, disc.scene.adhesion_nN_per_um3);
  disc.scene.size = with_edge(disc.scene.size, disc.scene.size.at_curves_um / finer);
  return disc;
}

Solution solved(const DiscOnGel& disc) {
  substrate::SubstrateParameters parameters;
  parameters.model = disc.gel.thickness_um < kThick_um ? substrate::ModelKind::layer : substrate::ModelKind::half_space;
  const auto model = greens::make_greens(disc.gel, parameters, 1);
  return solve_on_gel(disc.scene, *model, 1);
}

/// Radial force beyond r = a over that of the reference. Of a disc (r S_rr)' − S_tt = r T, so ∫ r T dr from a to R is
/// −a S_rr(a) − ∫ S_tt dr. Near the rim S_tt is a sum of powers of √(R − r): the first four of them through its four
/// outermost values have the integral to 1e-3 of the force.
double rim_force_error(const files::CsvTable& csv, int first, double from, const DiscOnGel& disc,
                       const Solution& solution) {
  const double R = disc.radius_um;
  Eigen::Matrix4d powers;
  Eigen::Vector4d values;
  double at_a = 0;
  int n = 0;
  const int of_case = csv.integer(first, "case", 0);
  for (int row = first; row < csv.n_rows() && csv.integer(row, "case", 0) == of_case; ++row) {
    const double x = csv.number(row, "r_um") / R, root = std::sqrt(1 - x);
    if (std::abs(x - from) < 1e-6) at_a = csv.number(row, "Srr_nN_per_um");
    if (x < 0.65) continue;
    EXPECT_LT(n, 4);
    powers.row(n) << 1, root, root * root, root * root * root;
    values(n++) = csv.number(row, "Stt_nN_per_um");
  }
  const Eigen::Vector4d c = powers.fullPivLu().solve(values);
  const double d = 1 - from;
  const double tangential =
      R * (c(0) * d + c(1) * std::pow(d, 1.5) / 1.5 + c(2) * d * d / 2 + c(3) * std::pow(d, 2.5) / 2.5);
  const double exact = 2 * std::numbers::pi * (-from * R * at_a - tangential);
  double ours = 0;
  for (int t = 0; t < solution.elements->n_triangles(); ++t)
    for (int p = 0; p < Elements::kPoints; ++p) {
      const Shape& shape = solution.elements->at(t, p);
      const double r = norm(shape.place_um);
      if (r > from * R) ours += shape.weight_um2 * dot(solution.patches[t].traction_kPa, 1 / r * shape.place_um);
    }
  return std::abs(ours / exact - 1);
}

struct Errors {
  double u = 0, mean_tension = 0;
};
Errors errors_of(const files::CsvTable& csv, int first, const Solution& solution) {
  const Locator locator(*solution.elements);
  Deviation u;
  const int of_case = csv.integer(first, "case", 0);
  for (int row = first; row < csv.n_rows() && csv.integer(row, "case", 0) == of_case; ++row) {
    const double r = csv.number(row, "r_um"), c = std::cos(0.7), s = std::sin(0.7);
    const auto place = locator.find(r * Vec2{c, s}, 0.05);
    if (!place) continue;
    const Vec2 at = value_of(solution.u, solution.elements->nodes(place->triangle),
                             solution.elements->shape(place->triangle, place->r, place->s));
    u.add(c * at.x + s * at.y, csv.number(row, "sheet_ur_um"));
  }
  const double exact = csv.number(first, "mean_tension_nN_per_um");
  return {u.relative(), std::abs(balance_of(solution).mean_tension_nN_per_um - exact) / exact};
}

TEST(SheetOnGel, bonded_discs_are_the_spectral_solution) {
  const auto csv = test::chapter4("disc_on_gel");
  for (int row = 0; row < csv.n_rows(); row += 7) {
    const int of_case = csv.integer(row, "case", 0);
    if (of_case == 1 || of_case == 3 || of_case == 6) continue;  // as 2 and 5, on a thicker and a thinner gel
    const DiscOnGel disc = disc_of(csv, row);
    const Solution solution = solved(disc);
    const Errors errors = errors_of(csv, row, solution);
    const Balance balance = balance_of(solution);
    const double force = rim_force_error(csv, row, 0.85, disc, solution);
    EXPECT_LE(force, 0.02);
    EXPECT_LE(errors.u, 0.01);
    EXPECT_LE(errors.mean_tension, 0.005);
    EXPECT_LE(norm(balance.net_force_nN), 1e-9 * balance.total_force_nN);
    EXPECT_LE(std::abs(balance.net_torque_nN_um), 1e-9 * balance.largest_torque_nN_um);
  }
}

TEST(SheetOnGel, halved_triangles_err_by_two_thirds_or_less) {
  const auto csv = test::chapter4("disc_on_gel");
  const int bonded_layer = 7, stiff = 42;
  for (const int row : {bonded_layer, stiff}) {
    std::vector<Errors> errors;
    for (const double finer : {0.25, 0.5}) errors.push_back(errors_of(csv, row, solved(disc_of(csv, row, finer))));
    EXPECT_GE(errors[0].u / errors[1].u, 1.5) << row;
    EXPECT_GE(errors[0].mean_tension / errors[1].mean_tension, 1.5) << row;
  }
}

/// Patches of very different sizes, on a layer; each held as all pairs and by the lattice.
TEST(SheetOnGel, the_lattice_answers_as_all_pairs_of_patches_do) {
  DiscOnGel disc{.radius_um = 25, .gel = {8.4, 0.49, 30}};
  disc.scene.region.rims.emplace_back(test::ring([](double t) { return 25 * (1 + 0.3 * std::cos(3 * t)); }, 360));
  disc.scene.material = {1, 0.5, 4};
  disc.scene.size = {.at_curves_um = 1.2, .largest_um = 6, .growth = 0.9};
  const auto elements = elements_of(disc.scene);
  substrate::SubstrateParameters parameters;
  parameters.model = substrate::ModelKind::layer;
  const auto model = greens::make_greens(disc.gel, parameters, 1);
  const Patches patches = patches_of(*elements, adhering_triangles(*elements, {}));
  const auto dense = compliance_of(patches, *model, Held::dense, 1),
             lattice = compliance_of(patches, *model, Held::lattice, 1);
  EXPECT_LE((dense->diagonal_um_per_nN() - lattice->diagonal_um_per_nN()).norm(),
            1e-14 * dense->diagonal_um_per_nN().norm());
  Eigen::VectorXd inward(2 * patches.n());
  for (int k = 0; k < patches.n(); ++k)
    inward.segment<2>(2 * k) << -patches.areas_um2[k] * patches.centre_um(k).x,
        -patches.areas_um2[k] * patches.centre_um(k).y;
  const Eigen::VectorXd other = Eigen::VectorXd::Random(2 * patches.n());
  for (const Eigen::VectorXd& forces : {inward, other}) {
    const Eigen::VectorXd exact = dense->displace(forces), ours = lattice->displace(forces);
    // All pairs take a patch's centre for its mean beyond 2.5 sizes of both. 1/r is then off by size² / 24 r²: 1.7e-3
    // of equal patches, less of those further away.
    EXPECT_LE((ours - exact).norm(), 1.7e-3 * exact.norm());
  }
  EXPECT_NEAR(other.dot(lattice->displace(inward).col(0)), inward.dot(lattice->displace(other).col(0)),
              1e-13 * inward.norm() * lattice->displace(other).norm());
  const auto solved_by = [&](Held held) {
    return solve_on(OnGel(*elements, *model, patches.triangles, 1, held), elements, disc.scene);
  };
  disc.scene.contraction.nN_per_um = 1;
  const Solution a = solved_by(Held::dense), b = solved_by(Held::lattice);
  EXPECT_LE((a.u - b.u).norm(), 1.7e-3 * a.u.norm());
  EXPECT_LE(norm(balance_of(b).net_force_nN), 1e-9 * balance_of(b).total_force_nN);
}

TEST(SheetOnGel, many_patches_are_held_by_the_lattice_where_the_gel_answers_alike_everywhere) {
  EXPECT_EQ(held_for(2000, {.base = true}), Held::dense);
  EXPECT_EQ(held_for(2001, {.base = true}), Held::lattice);
  EXPECT_EQ(held_for(2001, {.sides = true}), Held::dense);
}

/// Where the gel does not give way the springs of the adhesions are alone.
TEST(SheetOnGel, on_a_rigid_gel_it_is_a_sheet_on_springs) {
  DiscOnGel disc = disc_of(test::chapter4("disc_on_gel"), 28);
  disc.gel.youngs_modulus_kPa = 1e6;
  disc.scene.adhesion_nN_per_um3 = 0.01;  // l = 23 um
  disc.scene.size = {.at_curves_um = 1, .largest_um = 2.5, .growth = 0.3};
  const Solution on_gel = solved(disc), on_springs = solve_on_springs(disc.scene, 1);
  ASSERT_EQ(on_gel.u.size(), on_springs.u.size());
  // A patch of size h with an even traction leaves out the springs' energy of what u varies in it: as if the sheet were
  // stiffer by h² / 18 l², 6e-4.
  EXPECT_LE((on_gel.u - on_springs.u).norm(), 1e-3 * on_springs.u.norm());
}

/// The same where a free sheet would contract by 0.15, by either measure of contraction: springs carry no energy of
/// what u varies in a patch, as above.
TEST(SheetOnGel, on_a_rigid_gel_large_strains_are_those_on_springs) {
  DiscOnGel disc = disc_of(test::chapter4("disc_on_gel"), 28);
  disc.gel.youngs_modulus_kPa = 1e6;
  disc.scene.adhesion_nN_per_um3 = 0.01;
  disc.scene.size = {.at_curves_um = 1.5, .largest_um = 3, .growth = 0.3};
  disc.scene.contraction.nN_per_um *= 0.15 / free_contraction(disc.scene.material, disc.scene.contraction.nN_per_um);
  const Solution linear = solve_on_springs(disc.scene, 1);
  disc.scene.strain = Strain::large;
  for (const ContractionMeasure measure : values_of<ContractionMeasure>()) {
    disc.scene.measure = measure;
    const Solution on_gel = solved(disc), on_springs = solve_on_springs(disc.scene, 1);
    EXPECT_LE((on_gel.u - on_springs.u).norm(), 1e-3 * on_springs.u.norm()) << name_of(measure);
    EXPECT_LE(on_gel.report.last_change, 1e-9);
    const double more = (on_springs.u - linear.u).norm() / linear.u.norm();
    EXPECT_GT(more, 2e-3) << "then this asks nothing";
  }
}

/// Of a sheet without symmetry, bonded to a soft gel.
TEST(SheetOnGel, large_strains_are_small_ones_in_the_limit_and_in_balance_where_the_sheet_has_moved_to) {
  DiscOnGel made{.radius_um = 25, .gel = {1, 0.45, 60}};
  made.scene.region.rims.emplace_back(
      test::ring([](double t) { return 25 * (1 + 0.25 * std::cos(3 * t) + 0.1 * std::sin(t)); }, 360));
  made.scene.material = {2, 0.4, 4};
  made.scene.size = {.at_curves_um = 2, .largest_um = 6, .growth = 0.4};
  const auto by = [&](Strain strain, double x) {
    made.scene.strain = strain;
    made.scene.contraction.nN_per_um = x / free_contraction(made.scene.material, 1);
    return solved(made);
  };
  const Solution linear = by(Strain::small, 0.01);
  double before = 0;
  for (const double x : {0.005, 0.01, 0.1}) {
    const Solution large = by(Strain::large, x);
    const double off = (large.u - x / 0.01 * linear.u).norm() / (x / 0.01 * linear.u.norm());
    if (x == 0.01) EXPECT_NEAR(off / before, 2, 0.1) << "what linear theory leaves out is of second order";
    before = off;
    const Balance balance = balance_of(large);
    EXPECT_LE(norm(balance.net_force_nN), 1e-7 * balance.total_force_nN);
    EXPECT_LE(std::abs(balance.net_torque_nN_um), 1e-7 * balance.largest_torque_nN_um);
  }
  EXPECT_GT(before, 0.02) << "then balance in the other place asks nothing";
}

/// Other outlines, by an independent program extrapolated from lattices: a guard against gross errors.
TEST(SheetOnGel, other_outlines_are_within_the_error_of_the_independent_solution) {
  const auto csv = test::chapter4("sheet_on_gel_outline");
  for (int row = 0; row < csv.n_rows();) {
    const std::string shape = csv.text(row, "shape");
    const auto value = [&](const char* column) { return csv.number(row, column); };
    const bool is_ellipse = shape == "ellipse";
    const auto radius = [=](double t) {
      return is_ellipse ? 30 * 18 / std::hypot(18 * std::cos(t), 30 * std::sin(t)) : 26 * (1 + 0.3 * std::cos(2 * t));
    };
    DiscOnGel made{.radius_um = 26, .gel = {value("gel_E_kPa"), value("gel_nu"), value("gel_thickness_um")}};
    made.scene.region.rims.emplace_back(test::ring(radius, 360));
    made.scene.material = {value("E_kPa"), value("nu"), value("h_um")};
    made.scene.contraction.nN_per_um = value("s_nN_per_um");
    made.scene.size = size_on_gel(made.scene.region, made.scene.material, made.gel, std::nullopt);
    made.scene.size = with_edge(made.scene.size, 2 * made.scene.size.at_curves_um);
    const Solution solution = solved(made);
    EXPECT_NEAR(balance_of(solution).mean_tension_nN_per_um, value("mean_tension_nN_per_um"),
                1.5 * value("mean_tension_error"));
    const Locator locator(*solution.elements);
    for (; row < csv.n_rows() && csv.text(row, "shape") == shape; ++row) {
      const auto place = locator.find({value("x_um"), value("y_um")});
      ASSERT_TRUE(place);
      const Vec2 u = value_of(solution.u, solution.elements->nodes(place->triangle),
                              solution.elements->shape(place->triangle, place->r, place->s));
      EXPECT_NEAR(u.x, value("ux_um"), 1.5 * value("u_error_um")) << shape << " row " << row;
      EXPECT_NEAR(u.y, value("uy_um"), 1.5 * value("u_error_um")) << shape << " row " << row;
    }
  }
}

/// What `auto` decides is right to both sides of its threshold: below it springs alone are 2.5 % off at most, well
/// above it they are not.
TEST(SheetOnGel, springs_stand_for_a_gel_where_beta_says_so_and_only_there) {
  const Gel gel{8.4, 0.49, 60};
  const Material material{1, 0.49, 4};
  const double mu = gel.youngs_modulus_kPa / (2 * (1 + gel.poisson_ratio));
  for (const double beta : {0.039, 0.041, 0.2}) {
    // beta = sqrt(kappa M) (1 − nu) / mu
    const double kappa = std::pow(beta * mu / (1 - gel.poisson_ratio), 2) / material.stiffness_nN_per_um();
    EXPECT_NEAR(gel_over_adhesions(material, kappa, gel), beta, 1e-12);
    const GroundChoice choice = decide_ground(std::nullopt, material, kappa, gel);
    EXPECT_EQ(choice.ground, beta > kLargestBeta ? Ground::gel : Ground::springs) << beta;
    EXPECT_EQ(choice.effect.is_on, beta > kLargestBeta);
    DiscOnGel disc{.radius_um = 25, .gel = gel};
    disc.scene.region.rims.emplace_back(test::circle(25));
    disc.scene.material = material;
    disc.scene.contraction.nN_per_um = 1;
    disc.scene.adhesion_nN_per_um3 = kappa;
    disc.scene.size = with_edge(size_on_gel(disc.scene.region, material, gel, kappa), 1);
    const Solution on_gel = solved(disc), on_springs = solve_on_springs(disc.scene, 1);
    const double off = (on_gel.u - on_springs.u).lpNorm<Eigen::Infinity>() / on_gel.u.lpNorm<Eigen::Infinity>();
    if (beta < 0.1)
      EXPECT_LE(off, 0.025) << beta;
    else
      EXPECT_GT(off, 0.1) << beta;
  }
}

TEST(SheetOnGel, large_strain_is_on_where_a_free_sheet_would_contract_by_more_than_a_twentieth) {
  const Material material{1, 0.5, 4};  // x = s / 8
  EXPECT_DOUBLE_EQ(free_contraction(material, 0.8), 0.1);
  for (const double x : {0.049, 0.051}) EXPECT_EQ(decide_strain(std::nullopt, x, Ground::springs).is_on, x > 0.05) << x;
  EXPECT_TRUE(decide_strain(Strain::large, 0.01, Ground::springs).is_on);
  EXPECT_TRUE(decide_strain(Strain::large, 0.01, Ground::gel).is_on);
  EXPECT_FALSE(decide_strain(std::nullopt, 0.2, Ground::gel).is_on);
  EXPECT_FALSE(decide_strain(Strain::small, 0.2, Ground::springs).is_on);
}

}  // namespace
