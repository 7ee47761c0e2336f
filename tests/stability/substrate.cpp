/// Hard cases of every model, and what none of them takes.
#include <sys/resource.h>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/report.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/stage/parameters.h"
#include "substrate/choice/decide.h"
#include "substrate/choice/factory.h"
#include "substrate/effects.h"
#include "substrate/gel_vtu.h"
#include "substrate/greens/models.h"
#include "substrate/surface/formula.h"
#include "tests/support/hard_case.h"
#include "tests/support/substrate_scene.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::substrate {
namespace {

using std::numbers::pi;

const Gel kGel = {.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 20};

Eigen::MatrixXd compliance(const std::string& model, const Gel& gel, const std::vector<Vec2>& points,
                           const std::vector<Ellipse>& ellipses) {
  return choice::make_substrate(gel, test::model_named(model), 2)->compliance_um_per_nN(points, ellipses);
}

class Model : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(All, Model, testing::Values("half-space", "layer", "split", "refined", "auto"),
                         [](const auto& test) {
                           std::string name = test.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

/// Largest part of the displacement of a point in the middle of a loaded ellipse that may differ between models.
double tolerance_of(const std::string& model) {
  if (model == "refined") return 2 * 0.02;  // the tolerance, estimated within a factor of 2
  return model == "split" ? 2e-3 : 1e-7;
}

TEST_P(Model, copes_with_thin_and_thick_gels_near_incompressibility) {
  if (std::string(GetParam()) == "half-space") GTEST_SKIP() << "has no thickness";
  double worst = 0;
  for (const auto& [thickness, half_side] : {std::pair{2.0, 4.0}, std::pair{1000.0, 40.0}})
    for (const double nu : {0.0, 0.4999}) {
      const Gel gel = {.youngs_modulus_kPa = 8.4, .poisson_ratio = nu, .thickness_um = thickness};
      const auto points = test::scattered_points(200, half_side);
      const std::vector<Ellipse> ellipse = {{{0.1, 0.2}, 0.6, 0.3, 0.4}};
      const Eigen::MatrixXd layer = compliance("layer", gel, points, ellipse);
      const double difference = test::mean_column_difference(compliance(GetParam(), gel, points, ellipse), layer);
      EXPECT_LT(difference, tolerance_of(GetParam())) << "nu " << nu << ", thickness " << thickness;
      worst = std::max(worst, difference);
    }
  test::came_out("differs by " + test::two_digits(worst) + ", allowed " + test::two_digits(tolerance_of(GetParam())));
}

TEST_P(Model, copes_with_slender_and_tiny_and_overlapping_adhesions) {
  // 1:10; 0.01 um²; two over each other; the same twice
  const std::vector<Ellipse> ellipses = {{{0, 0}, 2, 0.2, 0.3},
                                         {{6, 1}, 0.08, 0.0398, 1},
                                         {{1, 0.5}, 1, 0.6, 2},
                                         {{-6, 2}, 1, 0.5, 0},
                                         {{-6, 2}, 1, 0.5, 0}};
  const auto points = test::scattered_points(400, 10);
  const Eigen::MatrixXd g = compliance(GetParam(), kGel, points, ellipses);
  EXPECT_TRUE(g.allFinite());
  EXPECT_LT((g.middleCols(6, 2) - g.middleCols(8, 2)).norm(), 1e-12 * g.norm());
  const Eigen::MatrixXd reference =
      compliance(std::string(GetParam()) == "half-space" ? "half-space" : "layer", kGel, points, ellipses);
  const double difference = test::mean_column_difference(g, reference);
  EXPECT_LT(difference, tolerance_of(GetParam()));
  test::came_out("differs by " + test::two_digits(difference) + ", allowed " +
                 test::two_digits(tolerance_of(GetParam())));
}

TEST_P(Model, is_continuous_through_the_centre_and_the_rim) {
  for (const double b : {0.1, 0.5, 1.0}) {
    const Ellipse ellipse = {{0, 0}, 1, b, 0};
    std::vector<Vec2> points;
    for (const double angle : {0.0, 0.3, 0.5 * pi, 3.0})
      for (const double r : {0.0, 1e-9, 1 - 1e-9, 1.0, 1 + 1e-9})
        points.push_back({r * std::cos(angle), r * b * std::sin(angle)});
    const Eigen::MatrixXd g = compliance(GetParam(), kGel, points, {ellipse});
    ASSERT_TRUE(g.allFinite());
    // slopes at the rim grow as log(1 / distance): 1e-9 away no more than 1e-7 of the field
    for (Eigen::Index i = 0; i < g.rows(); i += 10) {
      EXPECT_LT((g.middleRows<2>(i) - g.middleRows<2>(i + 2)).norm(), 1e-7 * g.middleRows<2>(i).norm());
      EXPECT_LT((g.middleRows<2>(i + 4) - g.middleRows<2>(i + 6)).norm(), 1e-7 * g.middleRows<2>(i).norm());
      EXPECT_LT((g.middleRows<2>(i + 8) - g.middleRows<2>(i + 6)).norm(), 1e-7 * g.middleRows<2>(i).norm());
    }
  }
}

TEST_P(Model, rejects_what_is_no_gel_no_ellipse_no_point_and_no_force) {
  const SubstrateParameters parameters = test::model_named(GetParam());
  for (const Gel& gel : {Gel{8.4, 0.51, 20}, Gel{8.4, 0.6, 20}, Gel{8.4, -0.1, 20}, Gel{0, 0.4, 20}, Gel{-1, 0.4, 20},
                         Gel{8.4, 0.4, 0}, Gel{NAN, 0.4, 20}, Gel{8.4, NAN, 20}})
    EXPECT_THROW(choice::make_substrate(gel, parameters, 1), InvalidData);
  const auto model = choice::make_substrate(kGel, parameters, 1);
  const Ellipse good = {{0, 0}, 1, 0.5, 0};
  EXPECT_THROW(model->compliance_um_per_nN({{NAN, 0}}, {good}), InvalidData);
  EXPECT_THROW(model->compliance_um_per_nN({{0, INFINITY}}, {good}), InvalidData);
  for (const Ellipse& bad : {Ellipse{{NAN, 0}, 1, 0.5, 0}, Ellipse{{0, 0}, 1, 0, 0}, Ellipse{{0, 0}, 0.5, 1, 0},
                             Ellipse{{0, 0}, INFINITY, 1, 0}, Ellipse{{0, 0}, 1, 0.5, NAN}})
    EXPECT_THROW(model->compliance_um_per_nN({{0, 0}}, {bad}), InvalidData);
  EXPECT_THROW(model->displacements_um({{0, 0}}, {good}, {{NAN, 0}}), InvalidData);
  EXPECT_THROW(model->displacements_um({{0, 0}}, {good}, {}), InvalidData);
}

TEST_P(Model, takes_empty_scenes) {
  const auto model = choice::make_substrate(kGel, test::model_named(GetParam()), 1);
  EXPECT_EQ(model->compliance_um_per_nN({}, {}).size(), 0);
  EXPECT_EQ(model->compliance_um_per_nN({{0, 0}}, {}).rows(), 2);
  EXPECT_EQ(model->compliance_um_per_nN({}, {{{0, 0}, 1, 0.5, 0}}).cols(), 2);
  const auto u = model->displacements_um({{1, 1}}, {}, {});
  ASSERT_EQ(u.size(), 1u);
  EXPECT_EQ(norm(u[0]), 0);
}

TEST(Substrate, names_the_models_it_knows) {
  const UsageError error = test::thrown<UsageError>([&] {
    SubstrateParameters parameters;
    stage::ParameterList list;
    declare(list, parameters);
    stage::set_from_text(stage::parameter_named(list, "model"), "layr");
  });
  EXPECT_TRUE(has_words(error.what(), "half-space, layer, split, refined, curved, auto"));
  EXPECT_THROW(greens::make_greens(kGel, test::model_named("split"), 1), UsageError);
}

TEST(Substrate, refuses_before_it_takes_more_memory_than_allowed) {
  for (const char* name : {"split", "refined"}) {
    SubstrateParameters parameters = test::model_named(name);
    parameters.memory_limit_GB = 0.005;
    const auto model = choice::make_substrate(kGel, parameters, 1);
    const NotSolved error = test::thrown<NotSolved>(
        [&] { model->compliance_um_per_nN(test::scattered_points(10, 40), test::scattered_ellipses(5, 30)); });
    EXPECT_TRUE(has_words(error.report->reason, "memory"));
    test::came_out(error.report->reason);
  }
  // a scene of 1 mm on a gel of 1 um: no grid of it fits
  Gel thin = kGel;
  thin.thickness_um = 1;
  SubstrateParameters parameters = test::model_named("split");
  parameters.memory_limit_GB = 4;
  EXPECT_THROW(choice::make_substrate(thin, parameters, 1)
                   ->compliance_um_per_nN(test::scattered_points(10, 500), test::scattered_ellipses(5, 30)),
               NotSolved);
}

TEST(Substrate, says_which_mesh_would_fit_the_memory) {
  SubstrateParameters parameters = test::model_named("refined");
  parameters.displacement_tolerance = 0;
  parameters.precision = numerics::Precision::double_;
  for (const auto& [limit_GB, fitting] : {std::pair{0.2, "elements; one of"}, std::pair{0.5, "unknowns would fit"}}) {
    parameters.memory_limit_GB = limit_GB;
    const NotSolved error = test::thrown<NotSolved>([&] {
      choice::make_substrate(kGel, parameters, 1)
          ->compliance_um_per_nN(test::scattered_points(10, 45), test::scattered_ellipses(40, 35));
    });
    EXPECT_TRUE(has_words(error.report->reason, fitting));
    test::came_out(error.report->reason);
  }
}

TEST(Substrate, takes_a_thousand_adhesions) {
  const auto points = test::scattered_points(200, 60);
  const auto ellipses = test::scattered_ellipses(1000, 60);
  const Eigen::MatrixXd layer = compliance("layer", kGel, points, ellipses);
  const double difference = test::mean_column_difference(compliance("split", kGel, points, ellipses), layer);
  EXPECT_LT(difference, 2e-3);
  test::came_out("split differs from layer by " + test::two_digits(difference));
}

TEST(Substrate, refuses_a_thousand_adhesions_that_refined_has_no_memory_for) {
  const auto points = test::scattered_points(200, 60);
  const auto ellipses = test::scattered_ellipses(1000, 60);
  SubstrateParameters parameters = test::model_named("refined");
  parameters.displacement_tolerance = 0;
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  for (const double limit_GB : {0.5, 1.0}) {
    parameters.memory_limit_GB = limit_GB;
    const NotSolved error = test::thrown<NotSolved>(
        [&] { choice::make_substrate(kGel, parameters, 2)->compliance_um_per_nN(points, ellipses); });
    const std::string& reason = error.report->reason;
    EXPECT_TRUE(has_words(reason, "would fit the memory", "elements_across_adhesion"));
  }
  getrusage(RUSAGE_SELF, &after);
  const double taken_GB = 1e-6 * static_cast<double>(after.ru_maxrss - before.ru_maxrss);
  EXPECT_LT(taken_GB, 1.0);  // the larger limit
  test::came_out(test::two_digits(taken_GB) + " GB taken before the error");
}

TEST(Substrate, takes_adhesions_that_touch_a_side) {
  // the scene's rectangle is the block: the ellipse's tip touches the side
  SubstrateParameters parameters = test::model_named("refined");
  parameters.side_distance_um = 1e-6;
  const auto points = test::scattered_points(200, 6);
  const std::vector<Ellipse> ellipses = {{{9, 0}, 1, 0.5, 0}, {{0, 0}, 1, 0.5, 0}};
  const Eigen::MatrixXd g = choice::make_substrate(kGel, parameters, 2)->compliance_um_per_nN(points, ellipses);
  ASSERT_TRUE(g.allFinite());
  // a block cut close gives more than an endless layer
  EXPECT_GT(g.norm(), compliance("layer", kGel, points, ellipses).norm());
}

std::string choice(const Gel& gel, const SubstrateParameters& parameters, const std::vector<Vec2>& points,
                   const std::vector<Ellipse>& ellipses) {
  const auto model = choice::make_substrate(gel, parameters, 2);
  const Eigen::MatrixXd matrix = model->compliance_um_per_nN(points, ellipses);
  EXPECT_TRUE(matrix.allFinite());
  const std::string name = std::get<std::string>(model->figures().front().second);
  return name;
}

TEST(Automatic, takes_the_cheapest_model_that_is_right) {
  const auto points = test::scattered_points(100, 10);
  const std::vector<Ellipse> ellipses = {{{1, 2}, 1, 0.5, 0.3}};
  SubstrateParameters parameters = test::model_named("auto");
  Gel thick = kGel;
  thick.thickness_um = 5000;
  EXPECT_EQ(choice(thick, parameters, points, ellipses), "half-space");
  EXPECT_EQ(choice(kGel, parameters, points, ellipses), "layer");
  parameters.side_distance_um = 100;  // five thicknesses: exp(-7.4)
  EXPECT_EQ(choice(kGel, parameters, points, ellipses), "layer");
  parameters.side_distance_um = 30;
  EXPECT_EQ(choice(kGel, parameters, points, ellipses), "split");
  parameters.side_distance_um = 5;
  EXPECT_EQ(choice(kGel, parameters, points, ellipses), "refined");
  parameters.side_distance_um.reset();
  parameters.modulus_profile = "0:8.4, 5:8.4, 5:20";
  EXPECT_EQ(choice(kGel, parameters, points, ellipses), "refined");
}

TEST(Automatic, leaves_out_no_more_than_the_tolerance) {
  const auto points = test::scattered_points(1000, 30);
  const auto ellipses = test::scattered_ellipses(6, 25);
  SubstrateParameters parameters = test::model_named("auto");
  for (const double tolerance : {0.05, 0.01}) {
    parameters.effects.effect_tolerance = tolerance;
    // as thin as the half-space is taken
    Gel gel = kGel;
    gel.thickness_um = 40;
    while (choice(gel, parameters, points, ellipses) != "half-space") gel.thickness_um *= 1.25;
    EXPECT_LT(test::mean_column_difference(compliance("half-space", gel, points, ellipses),
                                           compliance("layer", gel, points, ellipses)),
              tolerance);
    // sides as near as the layer is taken
    SubstrateParameters sides = parameters;
    sides.side_distance_um = kGel.thickness_um * -std::log(tolerance) / 1.48 * 1.001;
    ASSERT_EQ(choice(kGel, sides, points, ellipses), "layer");
    sides.model = ModelKind::split;
    EXPECT_LT(
        test::mean_column_difference(choice::make_substrate(kGel, sides, 2)->compliance_um_per_nN(points, ellipses),
                                     compliance("layer", kGel, points, ellipses)),
        tolerance);
  }
}

GelEffects effects_for(double thickness_um, const SubstrateParameters& parameters) {
  Gel gel = kGel;
  gel.thickness_um = thickness_um;
  return choice::decide(gel, parameters, {.width_um = 50, .adhesion_radius_um = 0.5});
}

TEST(Automatic, each_effect_of_the_gel_has_a_scene_that_calls_for_it_and_one_that_does_not) {
  SubstrateParameters p;
  EXPECT_TRUE(effects_for(60, p).thickness.is_on);
  EXPECT_FALSE(effects_for(20000, p).thickness.is_on);
  p.side_distance_um = 100;
  EXPECT_TRUE(effects_for(60, p).sides.is_on);  // exp(-2.5)
  EXPECT_FALSE(effects_for(20, p).sides.is_on);
  EXPECT_FALSE(effects_for(60, {}).sides.is_on);
  p.modulus_profile = "0:8.4, 20:8.4, 20:8.8";
  EXPECT_TRUE(effects_for(60, p).grading.is_on);
  EXPECT_FALSE(effects_for(15, p).grading.is_on);  // thinner than where it begins
  p.modulus_profile = "0:8.4, 20:8.45";
  EXPECT_FALSE(effects_for(60, p).grading.is_on);
  EXPECT_FALSE(effects_for(60, p).vertical.is_on);
  p.effects.vertical_displacement = Switch::on;
  EXPECT_TRUE(effects_for(60, p).vertical.is_on);
}

TEST(Automatic, says_where_an_uneven_surface_matters_that_no_model_has) {
  const auto surface_of = [](double tilt_deg, double roughness_um) {
    SubstrateParameters p;
    p.surface_tilt_deg = tilt_deg;
    p.surface_roughness_um = roughness_um;
    return effects_for(60, p).surface;
  };
  const auto is_said = [](const Effect& e) { return e.why.find("no model has it") != std::string::npos; };
  EXPECT_FALSE(is_said(surface_of(0, 0)));
  EXPECT_FALSE(is_said(surface_of(5, 0.004)));
  EXPECT_TRUE(is_said(surface_of(10, 0)));
  EXPECT_TRUE(is_said(surface_of(0, 0.1)));
  EXPECT_FALSE(surface_of(10, 0).is_on);
  EXPECT_NEAR(surface_of(60, 0).number.value(), 0.5, 1e-12);
  EXPECT_NEAR(surface_of(0, 0.1).number.value(), 0.2, 1e-12);
}

TEST(Automatic, a_surface_that_is_given_changes_the_field_by_about_what_its_slopes_say) {
  const std::vector<Ellipse> ellipses = {{{-11, 2}, 1, 1, 0}, {{3, 9}, 1, 1, 0}};
  const std::vector<Vec2> points = {{-20, 3}, {-9, 4}, {1, 2}, {5, 12}, {14, -6}}, forces = {{30, 0}, {-10, 20}};
  const auto gel_of = [](double amplitude_um) {
    Gel gel{.youngs_modulus_kPa = 10, .poisson_ratio = 0.45, .thickness_um = 60};
    const auto wave = surface::formula_of("wave period_um=40 amplitude_um=" + std::to_string(amplitude_um));
    gel.surface = std::make_shared<const HeightMap>(surface::sampled(wave, {-30, -30}, {30, 30}, 1));
    return gel;
  };
  SubstrateParameters p;
  p.displacement_tolerance = 0.05;
  const auto displaced = [&](const Gel& gel) {
    const auto model = choice::make_substrate(gel, p, 2);
    return std::pair{model->displacements_um(points, ellipses, forces), model->effects()[4]};
  };
  const auto [wavy, effect] = displaced(gel_of(1.3));
  const auto [flat, none] = displaced(gel_of(0.02));
  ASSERT_EQ(effect.kind, EffectKind::uneven_surface);
  EXPECT_TRUE(effect.is_on);
  EXPECT_FALSE(none.is_on);
  double change = 0, size = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    change += dot(wavy[k] - flat[k], wavy[k] - flat[k]);
    size += dot(flat[k], flat[k]);
  }
  EXPECT_GT(std::sqrt(change / size), effect.number.value() / 3);  // of five points
  EXPECT_LT(std::sqrt(change / size), effect.number.value() * 3);
}

TEST(Automatic, obeys_its_switches) {
  const auto points = test::scattered_points(100, 10);
  const std::vector<Ellipse> ellipses = {{{1, 2}, 1, 0.5, 0.3}};
  SubstrateParameters p;
  p.side_distance_um = 30;
  p.modulus_profile = "0:8.4, 5:8.4, 5:20";
  p.effects.depth_graded_gel = Switch::off;
  EXPECT_EQ(choice(kGel, p, points, ellipses), "split");
  p.effects.finite_sides = Switch::off;
  EXPECT_EQ(choice(kGel, p, points, ellipses), "layer");
  p.effects.finite_thickness = Switch::off;
  EXPECT_EQ(choice(kGel, p, points, ellipses), "half-space");
}

TEST(Automatic, refuses_switches_without_a_datum_and_models_that_cannot_follow) {
  const auto refused = [](const std::string& model, Switch stage::EffectSwitches::*member, Switch setting,
                          std::optional<double> side_distance_um = {}) {
    SubstrateParameters p = test::model_named(model);
    p.effects.*member = setting;
    p.side_distance_um = side_distance_um;
    const auto error = test::caught<UsageError>([&] { choice::make_substrate(kGel, p, 1); });
    return error ? std::string(error->what()).find("effects.") != std::string::npos : false;
  };
  using S = stage::EffectSwitches;
  EXPECT_TRUE(refused("auto", &S::finite_sides, Switch::on));
  EXPECT_TRUE(refused("auto", &S::depth_graded_gel, Switch::on));
  EXPECT_TRUE(refused("auto", &S::finite_thickness, Switch::off, 5));  // sides so near are on, and have a base
  EXPECT_TRUE(refused("half-space", &S::finite_thickness, Switch::on));
  EXPECT_TRUE(refused("layer", &S::finite_thickness, Switch::off));
  EXPECT_TRUE(refused("layer", &S::finite_sides, Switch::on, 30));
  EXPECT_FALSE(refused("auto", &S::finite_sides, Switch::on, 30));
}

TEST(Substrate, refuses_profiles_that_are_none_and_models_that_take_none) {
  SubstrateParameters parameters = test::model_named("refined");
  for (const char* text : {"0", "0:", "0:8, -1:4", "0:0", "5:8, 2:4", "0:8 4:4", "a:8", "0:8, 4:4x", "0:-3"}) {
    parameters.modulus_profile = text;
    EXPECT_THROW(choice::make_substrate(kGel, parameters, 1), UsageError) << text;
  }
  for (const ModelKind model : {ModelKind::half_space, ModelKind::layer, ModelKind::split}) {
    parameters.model = model;
    parameters.modulus_profile = "0:8, 4:8, 4:16";
    EXPECT_THROW(choice::make_substrate(kGel, parameters, 1), UsageError) << name_of(model);
  }
  EXPECT_THROW(choice::make_substrate(kGel, test::model_named("split"), 1)->volume({{{0, 0}, 1, 0.5, 0}}, {{1, 0}}),
               UsageError);
}

/// The only file of a folder.
std::filesystem::path only_file(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  EXPECT_EQ(files.size(), 1u);
  return files.at(0);
}

TEST(Cache, gives_the_same_bits_survives_damage_and_many_writers) {
  const test::TemporaryFolder folder;
  const auto points = test::scattered_points(50, 20);
  const auto ellipses = test::scattered_ellipses(5, 15);
  SubstrateParameters parameters = test::model_named("split");
  const Eigen::MatrixXd without = choice::make_substrate(kGel, parameters, 1)->compliance_um_per_nN(points, ellipses);
  parameters.cache_folder = (folder / "cache").string();
  const auto note = [&] {
    const auto model = choice::make_substrate(kGel, parameters, 1);
    EXPECT_TRUE(without == model->compliance_um_per_nN(points, ellipses));
    for (const auto& [name, value] : model->figures())
      if (name == "substrate_cache") return std::get<std::string>(value);
    return std::string("none");
  };
  numerics::parallel_for(4, 4, [&](int) { note(); });  // at once: none sees half a file, and no temporary one is left
  const auto file = only_file(parameters.cache_folder);
  EXPECT_EQ(note(), "used");
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  EXPECT_EQ(note().substr(0, 7), "damaged");
  EXPECT_EQ(note(), "used");
  {
    std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekp(1000);
    bytes.put('x');
  }
  EXPECT_EQ(note().substr(0, 7), "damaged");
  EXPECT_EQ(note(), "used");
  // another gel, another file
  Gel other = kGel;
  other.youngs_modulus_kPa *= 1 + 1e-12;
  choice::make_substrate(other, parameters, 1)->compliance_um_per_nN(points, ellipses);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(parameters.cache_folder), {}), 2);
  // a folder that cannot be
  parameters.cache_folder = (file / "below").string();
  EXPECT_TRUE(has_words(note(), "not written"));
}

TEST(Substrate, writes_its_surface_for_paraview) {
  const test::TemporaryFolder folder;
  const std::vector<Ellipse> ellipses = {{{0, 0}, 2, 0.5, 0.3}, {{8, 3}, 1, 0.5, 1}};
  const auto model = choice::make_substrate(kGel, test::model_named("layer"), 2);
  write_substrate_vtu(folder / "substrate.vtu", *model, ellipses, {{1, 0}, {0, -1}});
  std::ifstream file(folder / "substrate.vtu");
  const std::string text(std::istreambuf_iterator<char>(file), {});
  EXPECT_TRUE(has_words(text, "compressor=\"vtkZLibDataCompressor\"", "displacement_um", "traction_kPa"));
  EXPECT_FALSE(has_words(text, "nan"));
  EXPECT_TRUE(has_words(text, "</VTKFile>"));
}

}  // namespace
}  // namespace mbtfm::substrate
