/// The fit of a sheet to the beads under it: what it finds, and whether its error bars hold.
#include "continuum/sheet/forward.h"
#include "continuum/sheet/mesh_size.h"
#include "mbtfm/sheets/bead_fit.h"
#include "mbtfm/sheets/beside_fibres.h"
#include "mbtfm/sheets/variation.h"
#include "mbtfm/tensions/common_motion.h"
#include "substrate/greens/models.h"
#include "tests/support/sheets.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::sheets;
using sheet::Elements;

constexpr double kNoise_um = 0.02, kThickness_um = 4, kRatio = 0.5;

/// A disc bonded to a gel, its table and its beads. The same mesh makes the data: what is asked is the statistics.
struct FittedDisc {
  double radius_um;
  sheet::TriangleSize size;
  Gel gel{8.4, 0.49, 60};
  std::unique_ptr<substrate::Substrate> model;
  std::shared_ptr<const Elements> elements;
  std::unique_ptr<sheet::OnGel> ground;
  std::unique_ptr<StiffnessTable> table;
  DisplacementField beads;
  mutable substrate::SharedResponse response;

  explicit FittedDisc(double radius, bool has_line = false, std::optional<sheet::TriangleSize> triangles = {})
      : radius_um(radius),
        size(triangles.value_or(sheet::TriangleSize{
            .at_curves_um = radius / 8, .largest_um = radius / 3, .growth = 0.4, .most_turn_rad = 0.5})) {
    substrate::SubstrateParameters parameters;
    parameters.model = substrate::ModelKind::layer;
    model = greens::make_greens(gel, parameters, 1);
    sheet::Region region;
    // around a disc a line pulls as its contraction does: an ellipse tells the two apart
    region.rims.emplace_back(test::ring(
        [=](double t) { return has_line ? 0.5 * radius / std::hypot(0.5 * std::cos(t), std::sin(t)) : radius; }, 360));
    elements = std::make_shared<const Elements>(sheet::triangulated(region, size, 10000));
    ground = std::make_unique<sheet::OnGel>(*elements, *model, sheet::adhering_triangles(*elements, {}), 1);
    table = std::make_unique<StiffnessTable>(table_of({sheet::even(*elements, 1)}, {}, has_line));
    const double side = 3.5 * radius;
    const int n = 28;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        beads.push_back({.position_um = side * Vec2{(i + 0.5) / n - 0.5, (j + 0.5) / n - 0.5}, .sigma_um = kNoise_um});
  }

  StiffnessTable table_of(std::vector<std::vector<double>> contractions, std::vector<sheet::Bundle> bundles = {},
                          bool has_line = false, Bond bond = {}) const {
    return StiffnessTable({.elements = elements,
                           .contractions = std::move(contractions),
                           .poisson_ratio = kRatio,
                           .n_rims = 1,
                           .has_line = has_line,
                           .bundles = std::move(bundles),
                           .bond = bond},
                          *ground, gel, radius_um, 1);
  }

  /// Of its own triangles.
  sheet::Scene scene(double E_kPa, double s_nN_per_um) const {
    sheet::Scene made;
    made.region.rims.emplace_back(test::ring([=, this](double) { return radius_um; }, 360));
    made.material = {E_kPa, kRatio, kThickness_um};
    made.contraction.nN_per_um = s_nN_per_um;
    made.size = size;
    return made;
  }

  double stiffness(double E_kPa) const { return E_kPa * kThickness_um / (1 - kRatio * kRatio); }

  /// Solved on its own, not by the table.
  DisplacementField exact(double E_kPa, double s_nN_per_um, double line_nN = 0) const {
    return exact(E_kPa, sheet::even(*elements, s_nN_per_um), line_nN);
  }
  DisplacementField exact(double E_kPa, std::vector<double> contraction, double line_nN = 0,
                          std::optional<double> adhesion_nN_per_um3 = {}, const Eigen::VectorXd& more_nN = {}) const {
    sheet::Sheet made;
    made.material = {E_kPa, kRatio, kThickness_um};
    made.contraction_nN_per_um = std::move(contraction);
    made.line_tension_nN = line_nN;
    sheet::NodeVectors load = sheet::forces_of_contraction_nN(*elements, made);
    if (more_nN.size() > 0) load += more_nN;
    const auto solved = ground->solve(made.material, adhesion_nN_per_um3, load);
    std::vector<Vec2> forces;
    for (int t = 0; t < elements->n_triangles(); ++t) forces.push_back(sheet::at_node(solved.forces_nN, t));
    return moved_by(model->displacements_um(points_of(beads), ground->patches(), forces));
  }
  DisplacementField moved_by(const std::vector<Vec2>& u_um) const {
    DisplacementField field = beads;
    for (std::size_t i = 0; i < field.size(); ++i) field[i].displacement_um = u_um[i];
    return field;
  }
  DisplacementField moved_by(const Eigen::VectorXd& u_um) const {
    DisplacementField field = beads;
    for (std::size_t i = 0; i < field.size(); ++i) field[i].displacement_um = {u_um(2 * i), u_um(2 * i + 1)};
    return field;
  }
  /// As data_of(), the response kept.
  tensions::LinearData data(const DisplacementField& field) const {
    if (!response) response = data_of(beads, *table, *ground, *model, 1).response;
    return tensions::reduce(field, response);
  }
  SheetFit fit(const DisplacementField& field, tensions::Loss loss = tensions::Loss::squares) const {
    return fit_sheet(data(field), *table, loss);
  }
  /// By another table.
  SheetFit fit(const DisplacementField& field, const StiffnessTable& other,
               const std::vector<std::string>& parts = {}) const {
    return fit_sheet(data_of(field, other, *ground, *model, 1), other, tensions::Loss::squares, {}, parts);
  }
};

DisplacementField with_noise(DisplacementField field, std::mt19937_64& random) {
  std::normal_distribution<double> noise(0, kNoise_um);
  for (Bead& bead : field) bead.displacement_um += Vec2{noise(random), noise(random)};
  return field;
}

const SheetEstimate& of(const SheetFit& fit, Quantity quantity) {
  return *std::ranges::find(fit.estimates, quantity, &SheetEstimate::quantity);
}

/// Whether its interval has the truth.
bool holds(const SheetEstimate& e, double truth) {
  return e.low.value_or(0) <= truth && truth <= e.high.value_or(1e300);
}

TEST(SheetFit, exact_displacements_give_contraction_stiffness_and_line_tension_back) {
  const FittedDisc disc(25, true);
  for (const double E : {0.5, 3.0, 20.0}) {
    const SheetFit fit = disc.fit(disc.exact(E, 1, 2));
    // The table's polynomial of log M follows the solutions to 1e-4 of them.
    EXPECT_NEAR(of(fit, Quantity::contraction).value, 1, 2e-3) << E;
    EXPECT_NEAR(of(fit, Quantity::stiffness).value / disc.stiffness(E), 1, 1e-2) << E;
    EXPECT_NEAR(of(fit, Quantity::line_tension).value, 2, 4e-2) << E;
    EXPECT_LE(fit.relative_l2, 1e-3) << E;
  }
}

TEST(SheetFit, a_stiff_sheet_shows_contraction_over_stiffness_and_a_lower_limit) {
  const FittedDisc disc(25);
  std::mt19937_64 random(7);
  const SheetFit fit = disc.fit(with_noise(disc.exact(200, 20), random));
  EXPECT_FALSE(of(fit, Quantity::stiffness).identifiable);
  EXPECT_TRUE(of(fit, Quantity::stiffness).low.has_value());
  EXPECT_FALSE(of(fit, Quantity::stiffness).high.has_value());
  EXPECT_FALSE(of(fit, Quantity::contraction).high.has_value());
  const SheetEstimate& ratio = of(fit, Quantity::contraction_over_stiffness);
  EXPECT_TRUE(ratio.identifiable);
  const double truth = 20 / disc.stiffness(200);
  EXPECT_LT(*ratio.low, truth);
  EXPECT_GT(*ratio.high, truth);
  EXPECT_LT((*ratio.high - *ratio.low) / truth, 0.3);
}

TEST(SheetFit, parts_that_contract_each_by_its_own_are_resolved_where_they_differ) {
  const FittedDisc disc(25);
  std::vector<std::vector<double>> parts(2, sheet::even(*disc.elements, 0));
  for (int t = 0; t < disc.elements->n_triangles(); ++t)
    for (int p = 0; p < Elements::kPoints; ++p)
      parts[norm(disc.elements->at(t, p).place_um) > 18][Elements::kPoints * t + p] = 1;
  const StiffnessTable table = disc.table_of(parts);
  for (const double at_edge : {1.0, 3.0}) {
    std::vector<double> contraction = parts[0];
    for (std::size_t k = 0; k < contraction.size(); ++k) contraction[k] += at_edge * parts[1][k];
    std::mt19937_64 random(12);
    const SheetFit fit = disc.fit(with_noise(disc.exact(3, contraction), random), table, {"inside", "edge"});
    for (const SheetEstimate& e : fit.estimates) {
      if (e.quantity != Quantity::contraction) continue;
      // four standard errors
      EXPECT_NEAR(e.value, e.part == "edge" ? at_edge : 1, 4 * e.sigma.value_or(0)) << e.part;
      EXPECT_LT(e.sigma.value_or(1), 0.5) << e.part;
    }
    ASSERT_EQ(fit.models.size(), 3u);
    EXPECT_EQ(fit.models[2].name, "sheet-in-parts");
    EXPECT_EQ(fit.models[2].bic<fit.models[1].bic, at_edge> 1);
  }
}

/// A stiff sheet that reaches its gel through soft adhesions, in a table of both stiffnesses.
StiffnessTable on_springs(const FittedDisc& disc) {
  return disc.table_of({sheet::even(*disc.elements, 1)}, {}, false, Bond::fitted);
}

TEST(SheetFit, exact_displacements_give_the_stiffness_of_the_adhesions_back) {
  const FittedDisc disc(25);
  const StiffnessTable table = on_springs(disc);
  for (const double kappa : {0.05, 0.5}) {
    const SheetFit fit = disc.fit(disc.exact(3, sheet::even(*disc.elements, 1), 0, kappa), table);
    // The solutions between the table's own lack 1e-4 of the displacement; s, M and kappa are correlated by up to
    // 0.999.
    EXPECT_LE(fit.relative_l2, 1e-3) << kappa;
    EXPECT_NEAR(of(fit, Quantity::adhesion_stiffness).value / kappa, 1, 0.02);
    EXPECT_NEAR(of(fit, Quantity::stiffness).value / disc.stiffness(3), 1, 0.02);
    EXPECT_NEAR(of(fit, Quantity::contraction).value, 1, 0.02);
    ASSERT_EQ(fit.models.size(), 3u);
    EXPECT_EQ(fit.models[1].name, "sheet");
    EXPECT_EQ(fit.models[2].name, "sheet-on-springs");
  }
}

TEST(SheetFit, beads_show_the_penetration_where_they_do_not_separate_sheet_and_adhesions) {
  constexpr int kRuns = 12;
  const FittedDisc disc(25);
  const StiffnessTable table = on_springs(disc);
  const double kappa = 0.3, M = disc.stiffness(1), l = std::sqrt(M / kappa);
  const DisplacementField exact = disc.exact(1, sheet::even(*disc.elements, 1), 0, kappa);
  const substrate::SharedResponse response = data_of(exact, table, *disc.ground, *disc.model, 1).response;
  std::mt19937_64 random(14);
  std::map<Quantity, int> held, limited;
  const std::map<Quantity, double> truth = {{Quantity::contraction, 1},
                                            {Quantity::stiffness, M},
                                            {Quantity::adhesion_stiffness, kappa},
                                            {Quantity::penetration, l}};
  for (int run = 0; run < kRuns; ++run) {
    const SheetFit fit =
        fit_sheet(tensions::reduce(with_noise(exact, random), response), table, tensions::Loss::squares);
    for (const auto& [quantity, value] : truth) {
      const SheetEstimate& e = of(fit, quantity);
      held[quantity] += holds(e, value);
      limited[quantity] += e.identifiable;
    }
  }
  // 95 % of 12 are 11.4 ± 0.75: three standard deviations of the count
  for (const auto& [quantity, n] : held) EXPECT_GE(n, 9) << name_of(quantity);
  EXPECT_GE(limited[Quantity::penetration], 11);
  EXPECT_LE(limited[Quantity::stiffness], 2);
}

TEST(SheetFit, bundles_in_the_sheet_have_their_tensions) {
  const FittedDisc disc(25);
  const sheet::Bundle across{7, {{-18, 4}, {0, 5}, {18, 4}}};
  const StiffnessTable table = disc.table_of({sheet::even(*disc.elements, 1)}, {across});
  const Eigen::VectorXd pull = sheet::forces_of_bundle_nN(*disc.elements, across);
  for (const double tension : {0.0, 20.0}) {
    std::mt19937_64 random(15);
    const SheetFit fit =
        disc.fit(with_noise(disc.exact(3, sheet::even(*disc.elements, 1), 0, {}, tension * pull), random), table);
    const SheetEstimate& e = of(fit, Quantity::bundle_tension);
    EXPECT_EQ(e.part, "fibre 7");
    EXPECT_NEAR(e.value, tension, 4 * e.sigma.value_or(0));
    EXPECT_NEAR(of(fit, Quantity::contraction).value, 1, 4 * of(fit, Quantity::contraction).sigma.value_or(0));
    ASSERT_EQ(fit.models.size(), 3u);
    EXPECT_EQ(fit.models[1].name, "sheet");
    EXPECT_EQ(fit.models[2].name, "sheet-with-bundles");
    EXPECT_EQ(fit.models[2].bic<fit.models[1].bic, tension> 0);
  }
}

/// Mean and standard deviation of numbers.
struct Spread {
  double sum = 0, squares = 0, n = 0;
  void add(double x) { sum += x, squares += x * x, ++n; }
  double mean() const { return sum / n; }
  double deviation() const { return std::sqrt((squares - sum * sum / n) / (n - 1)); }
};

constexpr double kNear_um = 25.0 / 8;

TEST(SheetFit, residuals_of_a_right_sheet_are_as_large_and_as_alike_as_stated) {
  constexpr int kRuns = 200;
  const FittedDisc disc(25);
  std::mt19937_64 random(31);
  const DisplacementField exact = disc.exact(3, 1);
  for (const tensions::Loss loss : {tensions::Loss::squares, tensions::Loss::huber}) {
    Spread size, likeness;
    int n_named = 0;
    for (int run = 0; run < kRuns; ++run) {
      const SheetFit fit = disc.fit(with_noise(exact, random), loss);
      const Misfit misfit = misfit_of(fit.residuals, kNear_um, Eigen::MatrixXd(2 * std::ssize(exact), 0));
      size.add(misfit.chi_squared_per_degree.excess());
      likeness.add(misfit.correlation.excess());
      n_named += misfit.excess() > 3;
    }
    // means of 200 within three of their errors, deviations within three of theirs, 1/√400
    EXPECT_NEAR(likeness.mean(), 0, 0.21) << name_of(loss);
    EXPECT_NEAR(likeness.deviation(), 1, 0.15) << name_of(loss);
    EXPECT_LE(n_named, 3) << "two chances of 0.13 %: " << name_of(loss);
    if (loss != tensions::Loss::squares) continue;  // weights of less than 1 for some sound beads: a smaller sum
    EXPECT_NEAR(size.mean(), 0, 0.21);
    EXPECT_NEAR(size.deviation(), 1, 0.15);
  }
}

/// What the outline's error makes of the residuals is counted if it is stated, and named if it is not.
TEST(SheetFit, an_outline_that_lies_elsewhere_is_named_unless_its_error_is_stated) {
  constexpr double kFurther_um = 3;
  const FittedDisc truth(25), taken(25 + kFurther_um);
  std::mt19937_64 random(32);
  const DisplacementField beads = with_noise(truth.exact(3, 1), random);
  const SheetFit fit = taken.fit(beads, *taken.table);
  const sheet::Scene scene = taken.scene(3, 1);
  const Eigen::MatrixXd moved_um = changes_by_outline_um(scene, sheet::solve_on(*taken.ground, taken.elements, scene),
                                                         *taken.model, points_of(beads), kFurther_um, 1);
  const Misfit unstated = misfit_of(fit.residuals, kNear_um, 0.05 * moved_um),
               stated = misfit_of(fit.residuals, kNear_um, moved_um);
  EXPECT_GT(unstated.excess(), 3);
  EXPECT_LT(stated.excess(), 3);
}

/// 0.3 % of growth, a turn and a shift between the two pictures of the beads.
TEST(SheetFit, a_motion_that_all_beads_share_is_no_contraction) {
  const FittedDisc disc(25);
  std::mt19937_64 random(18);
  DisplacementField beads = with_noise(disc.exact(3, 1), random);
  for (Bead& bead : beads) {
    const Vec2 x = bead.position_um;
    bead.displacement_um += Vec2{0.1, -0.05} + 0.003 * x + 0.001 * Vec2{-x.y, x.x};
  }
  const auto contraction = [&](Eigen::MatrixXd motions) {
    return of(fit_sheet(data_of(beads, *disc.table, *disc.ground, *disc.model, 1, std::move(motions)), *disc.table,
                        tensions::Loss::squares),
              Quantity::contraction);
  };
  const SheetEstimate with = contraction(tensions::affine_motions(beads)), without = contraction({});
  EXPECT_NEAR(with.value, 1, 4 * with.sigma.value_or(0));
  EXPECT_GT(std::abs(without.value - 1), 4 * without.sigma.value_or(0)) << "then this asks nothing";
}

double sum_of_squares(const SheetErrorParts& parts) {
  double sum = 0;
  for_each_part(parts, [&](const char*, const std::optional<double>& part) { sum += std::pow(part.value_or(0), 2); });
  return sum;
}

/// The same displacements on a gel of another modulus are made by forces and stiffnesses in proportion.
TEST(SheetFit, the_error_of_the_modulus_is_one_of_forces_and_stiffnesses) {
  const FittedDisc disc(25);
  std::mt19937_64 random(19);
  SheetFit fit = disc.fit(with_noise(disc.exact(3, 1), random));
  const SheetFit before = fit;
  constexpr double kRelative = 0.1;
  Eigen::VectorXd of_outline = Eigen::VectorXd::Zero(std::ssize(fit.estimates));
  of_outline(0) = 0.3;
  add_error(fit.estimates, &SheetErrorParts::gel, changes_by_modulus(fit.estimates, kRelative));
  add_error(fit.estimates, &SheetErrorParts::outline, of_outline);
  for (std::size_t k = 0; k < fit.estimates.size(); ++k) {
    const SheetEstimate &e = fit.estimates[k], &old = before.estimates[k];
    const double of_modulus = e.quantity == Quantity::contraction_over_stiffness ? 0 : kRelative * e.value;
    EXPECT_DOUBLE_EQ(e.parts.gel.value_or(-1), of_modulus) << name_of(e.quantity);
    EXPECT_DOUBLE_EQ(e.parts.outline.value_or(-1), k == 0 ? 0.3 : 0) << name_of(e.quantity);
    EXPECT_NEAR(*e.sigma, std::sqrt(std::pow(*old.sigma, 2) + std::pow(of_modulus, 2) + (k == 0 ? 0.09 : 0)),
                1e-9 * *e.sigma);
    EXPECT_LE(*e.low, *old.low);
    EXPECT_GE(*e.high, *old.high);
  }
}

/// The elastic sheet inside of a disc whose rim moves outward grows evenly.
TEST(SheetFit, the_outlines_part_is_what_a_larger_sheet_makes_of_the_fit) {
  constexpr double kFurther_um = 0.05;
  const FittedDisc disc(25);
  const Elements larger = sheet::with_rims_further_out(*disc.elements, 1, kFurther_um);
  for (int i = 0; i < larger.n_nodes(); ++i) {
    const Vec2 before = disc.elements->triangles().nodes_um[i], after = larger.triangles().nodes_um[i];
    // sides are parabolas, off the circle by some 1e-4 of the radius
    EXPECT_LE(norm(after - (1 + kFurther_um / 25) * before), 0.02 * kFurther_um);
  }
  std::mt19937_64 random(22);
  DisplacementField beads = with_noise(disc.exact(3, 1), random);
  SheetFit fit = disc.fit(beads);
  const sheet::Scene scene = disc.scene(3, 1);
  const Eigen::MatrixXd changes = changes_by_outline_um(scene, sheet::solve_on(*disc.ground, disc.elements, scene),
                                                        *disc.model, points_of(beads), kFurther_um, 1);
  const auto before = fit.estimates;
  add_error(fit, &SheetErrorParts::outline, changes.leftCols(1));
  for (std::size_t i = 0; i < beads.size(); ++i) {
    const auto row = 2 * static_cast<Eigen::Index>(i);
    beads[i].displacement_um += -1.0 * Vec2{changes(row, 0), changes(row + 1, 0)};
  }
  const SheetFit moved = disc.fit(beads);
  for (std::size_t k = 0; k < before.size(); ++k)
    // what is not linear in some per cent of the estimate
    EXPECT_NEAR(*fit.estimates[k].parts.outline / std::abs(moved.estimates[k].value - before[k].value), 1, 0.1)
        << name_of(before[k].quantity);
}

/// What the fit would find is asked by fits to other beads, on other gels and by other outlines.
class SheetBudget : public testing::Test {
 protected:
  BeadFit fitted(
      const Gel& gel, const std::function<void(Question&)>& with = [](Question&) {}) const {
    Question q{.scene = scene_, .outline_error_um = 0};
    q.scene.region.rims.emplace_back(outline_);
    with(q);
    return fit_beads(q, beads_, gel, *model_of(gel), {.usual = model_of, .with_base = model_of}, 1);
  }
  static std::unique_ptr<substrate::Substrate> model_of(const Gel& gel) {
    substrate::SubstrateParameters layer;
    layer.model = substrate::ModelKind::layer;
    return greens::make_greens(gel, layer, 1);
  }
  SheetBudget() {
    scene_.material = {1, kRatio, kThickness_um};
    scene_.size = {.at_curves_um = 25.0 / 8, .largest_um = 25.0 / 3, .growth = 0.4, .most_turn_rad = 0.5};
    std::mt19937_64 random(21);
    const FittedDisc disc(25);
    beads_ = with_noise(disc.exact(3, 1), random);
  }
  sheet::Scene scene_;
  Polygon outline_ = test::ring([](double) { return 25.0; }, 360);
  DisplacementField beads_;
  const Gel gel_{8.4, 0.49, 60};
};

TEST_F(SheetBudget, its_parts_add_up_to_the_standard_errors_and_none_is_named_that_was_not_asked_for) {
  Gel doubtful = gel_;
  doubtful.youngs_modulus_sigma_kPa = 0.84;
  doubtful.poisson_ratio_sigma = 0.02;
  for (const bool varies : {false, true}) {
    const BeadFit found = fitted(doubtful, [&](Question& q) {
      q.outline_error_um = 0.2;
      if (varies) q.field_points = 9;
    });
    for (const SheetEstimate& e : found.fit.estimates) {
      ASSERT_TRUE(e.sigma.has_value()) << name_of(e.quantity);
      EXPECT_NEAR(sum_of_squares(e.parts) / std::pow(*e.sigma, 2), 1, 1e-9) << name_of(e.quantity);
      for_each_part(e.parts, [&](const std::string& name, const std::optional<double>& part) {
        if (varies && name == "variation") return;  // it is fitted
        ASSERT_TRUE(part.has_value()) << name;
        EXPECT_LT(*part, *e.sigma) << name;
      });
      EXPECT_GT(*e.parts.beads, 0);
      EXPECT_GT(*e.parts.motion, 0);
      EXPECT_GT(*e.parts.mesh, 0);
      EXPECT_GT(*e.parts.outline, 0);
    }
  }
  const BeadFit plain = fitted(gel_, [](Question& q) { q.has_motion = false; });
  for (const SheetEstimate& e : plain.fit.estimates) {
    EXPECT_FALSE(e.parts.gel || e.parts.outline || e.parts.motion) << name_of(e.quantity);
    EXPECT_NEAR(sum_of_squares(e.parts) / std::pow(*e.sigma, 2), 1, 1e-9) << name_of(e.quantity);
  }
}

TEST_F(SheetBudget, the_motions_part_is_what_is_gained_if_the_beads_share_none) {
  const BeadFit with = fitted(gel_), without = fitted(gel_, [](Question&q) { q.has_motion = false; });
  const SheetEstimate &e = of(with.fit, Quantity::contraction), &still = of(without.fit, Quantity::contraction);
  EXPECT_NEAR(std::hypot(*e.parts.beads, *e.parts.model) / std::hypot(*still.parts.beads, *still.parts.model), 1, 0.05);
  EXPECT_GT(*e.parts.motion, 0.2 * *e.parts.beads) << "then this asks nothing";
}

/// s (1 ± 0.2 (2 r²/R² − 1)): an even sheet follows it with another stiffness.
std::vector<double> edge_against_middle(const Elements& elements, double variation) {
  std::vector<double> contraction;
  elements.for_each_point([&](int, int, const sheet::Shape& shape) {
    contraction.push_back(1 + variation * (2 * dot(shape.place_um, shape.place_um) / 625 - 1));
  });
  return contraction;
}

TEST_F(SheetBudget, intervals_hold_a_contraction_that_varies_though_the_beads_do_not_show_it) {
  const FittedDisc disc(25);
  for (const double variation : {-kVariation, kVariation}) {
    std::mt19937_64 random(33);
    beads_ = with_noise(disc.exact(3, edge_against_middle(*disc.elements, variation)), random);
    const BeadFit found = fitted(gel_);
    for (const auto& [quantity, truth] :
         {std::pair(Quantity::contraction, 1.0), std::pair(Quantity::stiffness, disc.stiffness(3))}) {
      const SheetEstimate& e = of(found.fit, quantity);
      EXPECT_TRUE(holds(e, truth)) << name_of(quantity) << variation;
      if (!e.sigma) continue;
      const double others = std::sqrt(std::pow(*e.sigma, 2) - std::pow(*e.parts.variation, 2));
      EXPECT_GT(std::abs(e.value - truth), 2 * others) << "then this asks nothing";
    }
  }
}

TEST(SheetBudgets, smooth_patterns_change_no_mean_and_no_other_and_the_last_is_edge_against_middle) {
  const FittedDisc disc(25);
  std::vector<Vec2> places;
  std::vector<double> areas;
  disc.elements->for_each_point([&](int, int, const sheet::Shape& shape) {
    places.push_back(shape.place_um);
    areas.push_back(shape.weight_um2);
  });
  const Eigen::VectorXd area = Eigen::VectorXd::Map(areas.data(), std::ssize(areas)) / disc.elements->area_um2();
  const Eigen::MatrixXd g = smooth_patterns(places, area), products = g.transpose() * area.asDiagonal() * g;
  EXPECT_LT((g.transpose() * area).cwiseAbs().maxCoeff(), 1e-12);
  const double square = kVariation * kVariation / 3;
  EXPECT_LT((products - square * Eigen::MatrixXd::Identity(5, 5)).cwiseAbs().maxCoeff(), 1e-12);
  for (std::size_t k = 0; k < places.size(); ++k)  // sides are parabolas, off the circle by some 1e-4 of the radius
    EXPECT_NEAR(g(static_cast<Eigen::Index>(k), 4), kVariation * (2 * dot(places[k], places[k]) / 625 - 1), 1e-3);
}

/// Of two bundles side by side, one slack, that noise often makes push: unbounded fits are off by that.
TEST(SheetFit, bundles_never_push_and_their_intervals_hold_what_they_pull) {
  const FittedDisc disc(25);
  const sheet::Bundle taut{1, {{-18, 4}, {0, 5}, {18, 4}}}, slack{2, {{-18, 1}, {0, 2}, {18, 1}}};
  const StiffnessTable table = disc.table_of({sheet::even(*disc.elements, 1)}, {taut, slack});
  const Eigen::VectorXd pull = sheet::forces_of_bundle_nN(*disc.elements, taut);
  constexpr int kDraws = 40;
  constexpr double kTension = 20;
  int n_at_bound = 0, n_held = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::mt19937_64 random(100 + static_cast<unsigned>(draw));
    const SheetFit fit =
        disc.fit(with_noise(disc.exact(3, sheet::even(*disc.elements, 1), 0, {}, kTension * pull), random), table);
    for (const SheetEstimate& e : fit.estimates) {
      if (e.quantity != Quantity::bundle_tension) continue;
      ASSERT_TRUE(e.low && e.high && e.sigma) << e.part;
      EXPECT_GE(e.value, 0);
      EXPECT_GE(*e.low, 0);
      EXPECT_GT(*e.sigma, 0);
      EXPECT_LE(*e.low, e.value);
      EXPECT_GT(*e.high, e.value);
      const double truth = e.part == "fibre 1" ? kTension : 0;
      n_at_bound += truth == 0 && e.value == 0 ? 1 : 0;
      n_held += *e.low <= truth && truth <= *e.high ? 1 : 0;
    }
  }
  // a slack bundle's best tension is below zero in one draw of two, 3 standard deviations of 40 are 10
  EXPECT_NEAR(n_at_bound, kDraws / 2, 10);
  EXPECT_GE(n_held, 2 * kDraws - 8);  // of 80, 95 % and more; 8 is 2.2 standard deviations above the 4 expected
}

/// A table for contractions that vary over the disc.
struct Field {
  ContractionLattice lattice;
  StiffnessTable table;
  Eigen::VectorXd mean;

  Field(const FittedDisc& disc, int n_points)
      : lattice(*disc.elements, n_points),
        table(disc.table_of(lattice.shares_on(*disc.elements))),
        mean(means_over(*disc.elements, lattice)) {}

  FieldFit fit(const FittedDisc& disc, const DisplacementField& field, std::optional<double> stiffness) const {
    if (!response) response = data_of(field, table, *disc.ground, *disc.model, 1).response;
    return fit_field(tensions::reduce(field, response), table, tensions::Loss::squares, stiffness, lattice, mean);
  }
  /// Of places all over the disc, how many intervals hold the contraction.
  int n_held(const FittedDisc& disc, int n, const FieldFit& fit, const std::function<double(Vec2)>& truth) const {
    int held = 0;
    for (int k = 0; k < n; ++k) {
      const Vec2 at = 0.92 * disc.radius_um * std::sqrt((k + 0.5) / n) * Vec2{std::cos(2.4 * k), std::sin(2.4 * k)};
      const Eigen::VectorXd shares = lattice.shares_at(at);
      const double sigma = std::sqrt(shares.dot(fit.covariance * shares));
      held += std::abs(shares.dot(fit.contractions) - truth(at)) < 1.96 * sigma ? 1 : 0;
    }
    return held;
  }
  mutable substrate::SharedResponse response;
};

/// Twice as much to the right as to the left.
double contraction_at(Vec2 place) { return 1 + place.x / 75; }
std::vector<double> varying(const Elements& elements) {
  std::vector<double> contraction;
  for (int t = 0; t < elements.n_triangles(); ++t)
    for (int p = 0; p < Elements::kPoints; ++p) contraction.push_back(contraction_at(elements.at(t, p).place_um));
  return contraction;
}

TEST(SheetField, shares_of_its_lattice_add_up_to_the_sheet) {
  const FittedDisc disc(25);
  const ContractionLattice lattice(*disc.elements, 40);
  const Eigen::VectorXd even = Eigen::VectorXd::Ones(lattice.n_points());
  for (int t = 0; t < disc.elements->n_triangles(); ++t)
    for (int p = 0; p < Elements::kPoints; ++p)
      EXPECT_NEAR(lattice.shares_at(disc.elements->at(t, p).place_um).sum(), 1, 1e-12);
  EXPECT_NEAR(even.dot(lattice.roughness() * even), 0, 1e-12);
  EXPECT_NEAR(means_over(*disc.elements, lattice).sum(), 1, 1e-12);
}

TEST(SheetField, is_found_within_its_errors_and_called_for_where_the_contraction_varies_and_only_there) {
  const FittedDisc disc(25);
  const Field field(disc, 16);
  const double M = disc.stiffness(3);
  for (const bool varies : {true, false}) {
    const DisplacementField exact = disc.exact(3, varies ? varying(*disc.elements) : sheet::even(*disc.elements, 1));
    constexpr int kRuns = 3, kPlaces = 40;
    std::mt19937_64 random(16);
    int n_held = 0;
    for (int run = 0; run < kRuns; ++run) {
      const FieldFit fit = field.fit(disc, with_noise(exact, random), {});
      // four standard errors
      const SheetEstimate &mean = of(fit.sheet, Quantity::contraction), &stiffness = of(fit.sheet, Quantity::stiffness);
      EXPECT_NEAR(mean.value, 1, 4 * mean.sigma.value_or(0));
      EXPECT_NEAR(std::log(stiffness.value / M), 0, 4 * stiffness.sigma.value_or(0) / stiffness.value);
      ASSERT_EQ(fit.sheet.models.size(), 3u);
      EXPECT_EQ(fit.sheet.models[2].name, "sheet-in-field");
      EXPECT_EQ(fit.sheet.models[2].bic < fit.sheet.models[1].bic, varies);
      n_held += field.n_held(disc, kPlaces, fit, [&](Vec2 at) { return varies ? contraction_at(at) : 1; });
    }
    // Errors of neighbours are alike: of 120 places some 50 tell by themselves, of which 47.5 ± 1.5 are held.
    EXPECT_GE(n_held, (0.95 - 3 * 0.03) * kRuns * kPlaces) << varies;
  }
}

/// An even sheet of another stiffness fits as well: the prior lets the edge pull more than the middle.
TEST(SheetField, its_intervals_hold_an_edge_that_pulls_more_than_the_middle) {
  const FittedDisc disc(25);
  const Field field(disc, 16);
  std::mt19937_64 random(34);
  constexpr int kPlaces = 40;
  for (const double variation : {-kVariation, kVariation}) {
    const FieldFit fit =
        field.fit(disc, with_noise(disc.exact(3, edge_against_middle(*disc.elements, variation)), random), {});
    const auto truth = [&](Vec2 at) { return 1 + variation * (2 * dot(at, at) / 625 - 1); };
    EXPECT_GE(field.n_held(disc, kPlaces, fit, truth), (0.95 - 3 * 0.03) * kPlaces) << variation;
    EXPECT_TRUE(holds(of(fit.sheet, Quantity::stiffness), disc.stiffness(3))) << variation;
  }
}

/// The truth is solved on a mesh three times as fine: the error of the fit's own exceeds that of the beads.
TEST(SheetField, intervals_hold_what_the_mesh_makes_of_the_contraction) {
  const FittedDisc disc(25);
  const Field field(disc, 25);
  const auto contraction = [](Vec2 place) { return 2 + place.x / 25; };
  sheet::Scene scene = disc.scene(3, 0);
  scene.contraction = {};
  scene.contraction.at = contraction;
  const std::vector<Vec2> places = points_of(disc.beads);
  const auto on_fine_mesh = [&](sheet::Scene of) {
    of.size = sheet::with_edge(of.size, of.size.at_curves_um / 3);
    return sheet::displacements_um(*disc.model, sheet::solve_on_gel(of, *disc.model, 1), places);
  };
  const std::vector<Vec2> exact = on_fine_mesh(scene);
  const FinerMeshes finer(scene, *disc.model, 1);
  constexpr double kSharp_um = 0.005;
  const auto change_for = [&](double sheet_nN_per_um, const std::function<double(Vec2)>& its_contraction) {
    sheet::Scene found = scene;
    found.material.youngs_modulus_kPa = sheet_nN_per_um * (1 - kRatio * kRatio) / kThickness_um;
    found.contraction.at = its_contraction;
    return finer.change(found, sheet::solve_on(*disc.ground, disc.elements, found), places);
  };
  int n_held = 0, n_held_without = 0;
  constexpr int kRuns = 3, kPlaces = 40;
  std::mt19937_64 random(17);
  std::normal_distribution<double> noise(0, kSharp_um);
  for (int run = 0; run < kRuns; ++run) {
    DisplacementField beads = disc.moved_by(exact);
    for (Bead& bead : beads) {
      bead.displacement_um += Vec2{noise(random), noise(random)};
      bead.sigma_um = kSharp_um;
    }
    for (const bool knows_mesh : {true, false}) {
      const auto fitted = [&](tensions::LinearData data) {
        return fit_field(std::move(data), field.table, tensions::Loss::squares, {}, field.lattice, field.mean);
      };
      const tensions::LinearData data = data_of(beads, field.table, *disc.ground, *disc.model, 1);
      FieldFit fit = fitted(data);
      if (knows_mesh) {
        const MeshChange change = change_for(fit.sheet.stiffnesses.sheet_nN_per_um, [&](Vec2 place) {
          return field.lattice.shares_at(place).dot(fit.contractions);
        });
        fit = fitted(corrected(data, change));
        add_error(fit, &SheetErrorParts::mesh, change.left_um);
      }
      (knows_mesh ? n_held : n_held_without) += field.n_held(disc, kPlaces, fit, contraction);
      if (knows_mesh) EXPECT_TRUE(holds(of(fit.sheet, Quantity::stiffness), disc.stiffness(3)));
    }
  }
  EXPECT_GE(n_held, (0.95 - 3 * 0.03) * kRuns * kPlaces);
  EXPECT_LT(n_held_without, 0.9 * kRuns * kPlaces) << "then this asks nothing";

  // an even contraction, by beads without noise: what is left is the mesh's
  scene.contraction.at = [](Vec2) { return 2.0; };
  DisplacementField beads = disc.moved_by(on_fine_mesh(scene));
  for (Bead& bead : beads) bead.sigma_um = 1e-4;
  const auto fitted = [&](const tensions::LinearData& data) {
    return fit_sheet(data, *disc.table, tensions::Loss::squares, disc.stiffness(3));
  };
  const SheetFit without = fitted(disc.data(beads));
  const MeshChange change = change_for(disc.stiffness(3), [&](Vec2) { return without.loads(0); });
  SheetFit with = fitted(corrected(disc.data(beads), change));
  add_error(with, &SheetErrorParts::mesh, change.left_um);
  const SheetEstimate& e = of(with, Quantity::contraction);
  EXPECT_TRUE(holds(e, 2));
  EXPECT_LT(*e.sigma, 0.05 * 2) << "meshes differ by 1 to 3 % of the displacement";
}

TEST(SheetField, sharp_beads_give_it_back_whatever_the_lattice) {
  const FittedDisc disc(25);
  DisplacementField sharp = disc.exact(3, varying(*disc.elements));
  for (Bead& bead : sharp) bead.sigma_um = 1e-4;
  for (const int n_points : {9, 25}) {
    const Field field(disc, n_points);
    const FieldFit fit = field.fit(disc, sharp, disc.stiffness(3));
    // the table lacks 1e-4 of the displacement, which is twice the beads' error
    for (double x = -16; x <= 16; x += 4)
      for (double y = -16; y <= 16; y += 4)
        EXPECT_NEAR(field.lattice.shares_at({x, y}).dot(fit.contractions), contraction_at({x, y}), 2e-3) << n_points;
  }
}

TEST(SheetFit, a_known_stiffness_leaves_the_contraction_alone) {
  const FittedDisc disc(25);
  std::mt19937_64 random(8);
  const auto data = disc.data(with_noise(disc.exact(10, 1), random));
  const SheetFit free = fit_sheet(data, *disc.table, tensions::Loss::squares);
  const SheetFit held = fit_sheet(data, *disc.table, tensions::Loss::squares, disc.stiffness(10));
  EXPECT_DOUBLE_EQ(held.stiffnesses.sheet_nN_per_um, disc.stiffness(10));
  EXPECT_LT(*of(held, Quantity::contraction).sigma, *of(free, Quantity::contraction).sigma);
  EXPECT_NEAR(of(held, Quantity::contraction).value, 1, 4 * *of(held, Quantity::contraction).sigma);
}

TEST(SheetFit, beside_adhesions_the_sheet_is_called_for_where_a_sheet_pulls_and_only_there) {
  const FittedDisc disc(25);
  std::vector<substrate::Ellipse> adhesions;
  for (int k = 0; k < 12; ++k) {
    const double t = std::numbers::pi * k / 6;
    adhesions.push_back({22.0 * Vec2{std::cos(t), std::sin(t)}, 1.5, 1, t});
  }
  const Eigen::MatrixXd compliance = disc.model->compliance_um_per_nN(points_of(disc.beads), adhesions);
  Cell cell;
  cell.outline_um = test::circle(25, 180);
  for (const int k : {0, 2}) {
    Fibre& fibre = cell.fibres.emplace_back();
    fibre.fibre_id = k + 1;
    fibre.points_um = {adhesions[k].centre_um, adhesions[k + 6].centre_um};
  }
  Fibre& outside = cell.fibres.emplace_back();
  outside.points_um = {{20, 0}, {20, 30}, {0, 20}};
  struct Bics {
    double sheet = 0, with_bundles = 0, adhesions = 0;
  };
  const auto bics_of = [&](const DisplacementField& field) {
    const tensions::LinearData data = tensions::reduce(field, compliance);
    const auto sheets = scores_of_sheets(data, cell, disc.gel, *disc.model, 1);
    EXPECT_EQ(sheets.size(), 2);
    EXPECT_EQ(sheets.back().name, "sheet-with-bundles");
    EXPECT_EQ(sheets.back().n_parameters, 4) << "the fibre that leaves the cell is none";
    return Bics{sheets.front().bic, sheets.back().bic,
                data.reduced.floor_squared / tensions::noise_variance(data) +
                    static_cast<double>(data.reduced.n_felt) * std::log(static_cast<double>(data.n_used))};
  };
  std::mt19937_64 random(13);
  const Bics of_sheet = bics_of(with_noise(disc.exact(3, 1), random));
  EXPECT_LT(of_sheet.sheet, of_sheet.adhesions);
  EXPECT_LT(of_sheet.sheet, of_sheet.with_bundles) << "they explain no more";
  // two fibres: four adhesions pull towards the one across
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(24);
  for (const int k : {0, 6, 2, 8})
    forces.segment<2>(2 * k) << -5 * adhesions[k].centre_um.x / 22, -5 * adhesions[k].centre_um.y / 22;
  const Bics of_fibres = bics_of(with_noise(disc.moved_by(compliance * forces), random));
  EXPECT_GT(of_fibres.sheet, of_fibres.adhesions);
  EXPECT_LT(of_fibres.with_bundles, of_fibres.sheet);
}

TEST(SheetFit, stray_beads_do_not_move_a_robust_fit) {
  const FittedDisc disc(25);
  std::mt19937_64 random(9);
  DisplacementField field = with_noise(disc.exact(1, 1), random);
  for (std::size_t i = 0; i < field.size(); i += 40) field[i].displacement_um += Vec2{1.5, -1};
  const SheetFit squares = disc.fit(field), tukey = disc.fit(field, tensions::Loss::tukey);
  EXPECT_NEAR(of(tukey, Quantity::contraction).value, 1, 4 * *of(tukey, Quantity::contraction).sigma);
  // by squares the same beads tell it five times worse, or not at all
  ASSERT_TRUE(of(tukey, Quantity::contraction).sigma);
  const std::optional<double> by_squares = of(squares, Quantity::contraction).sigma;
  EXPECT_TRUE(!by_squares || *of(tukey, Quantity::contraction).sigma < 0.2 * *by_squares);
  EXPECT_GE(tukey.n_down_weighted, static_cast<int>(field.size() / 40));
}

TEST(SheetFit, intervals_hold_the_truth_and_standard_errors_are_the_scatter) {
  constexpr int kRuns = 200;
  const FittedDisc disc(25);
  for (const double E : {1.0, 10.0}) {
    const DisplacementField exact = disc.exact(E, 1);
    const double M = disc.stiffness(E);
    std::mt19937_64 random(11);
    int s_held = 0, M_held = 0;
    Spread s_found, m_found, r_found, s_sigma, m_sigma, r_sigma;
    for (int run = 0; run < kRuns; ++run) {
      const SheetFit fit = disc.fit(with_noise(exact, random));
      const SheetEstimate &s = of(fit, Quantity::contraction), &stiffness = of(fit, Quantity::stiffness),
                          &ratio = of(fit, Quantity::contraction_over_stiffness);
      s_held += holds(s, 1);
      M_held += holds(stiffness, M);
      s_found.add(s.value), s_sigma.add(s.sigma.value_or(0));
      m_found.add(std::log(stiffness.value)), m_sigma.add(stiffness.sigma.value_or(0) / stiffness.value);
      r_found.add(ratio.value), r_sigma.add(ratio.sigma.value_or(0));
    }
    // 95 % of 200 are 190 ± 3.1: three standard deviations of the count
    for (const int held : {s_held, M_held}) {
      EXPECT_GE(held, 181) << E;
      EXPECT_LE(held, 199) << E;
    }
    EXPECT_NEAR(s_sigma.mean() / s_found.deviation(), 1, 0.15) << E;
    EXPECT_NEAR(m_sigma.mean() / m_found.deviation(), 1, 0.15) << E;
    EXPECT_NEAR(r_sigma.mean() / r_found.deviation(), 1, 0.15) << E;
  }
}

/// The truth is solved on a mesh three times as fine, as no real cell knows the fit's. Of each outline the mesh errs in
/// its own way. Triangles of the fit are half as fine as the program's.
TEST(SheetFit, intervals_hold_a_truth_on_another_mesh) {
  constexpr int kOutlines = 5, kRuns = 40;
  constexpr double kContraction = 1;
  struct Count {
    int s_held = 0, M_held = 0;
  };
  std::map<double, Count> by_modulus;
  std::mt19937_64 random(12);
  for (int outline = 0; outline < kOutlines; ++outline) {
    const double R = 25 + 0.37 * outline;
    const FittedDisc disc(
        R, false,
        sheet::TriangleSize{.at_curves_um = R / 20, .largest_um = R / 4, .growth = 0.9, .most_turn_rad = 0.35});
    const std::vector<Vec2> places = points_of(disc.beads);
    // a mesh and the gel under it are those of sheets of any stiffness
    const sheet::FinerMesh of_truth(disc.scene(1, kContraction), 1.0 / 3, *disc.model, 1);
    const FinerMeshes finer(disc.scene(1, kContraction), *disc.model, 1);
    for (const double E : {1.0, 10.0}) {
      const sheet::Scene scene = disc.scene(E, kContraction);
      const DisplacementField exact = disc.moved_by(of_truth.displacements_um(scene, places));
      // the change is that of the truth's neighbourhood: it hardly differs between runs, and is found once
      const MeshChange change = finer.change(scene, sheet::solve_on(*disc.ground, disc.elements, scene), places);
      Count& count = by_modulus[E];
      for (int run = 0; run < kRuns; ++run) {
        SheetFit fit =
            fit_sheet(corrected(disc.data(with_noise(exact, random)), change), *disc.table, tensions::Loss::squares);
        add_error(fit, &SheetErrorParts::mesh, change.left_um);
        count.s_held += holds(of(fit, Quantity::contraction), kContraction);
        count.M_held += holds(of(fit, Quantity::stiffness), disc.stiffness(E));
      }
    }
  }
  for (const auto& [E, count] : by_modulus)
    for (const int held : {count.s_held, count.M_held}) {  // as above
      EXPECT_GE(held, 181) << E;
      EXPECT_LE(held, 199) << E;
    }
}

}  // namespace
