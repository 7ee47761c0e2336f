/// Laws of a plan: how its errors scale, and that they are those of the fit.
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/ensemble.h"
#include "pipeline/contract/errors.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/numerics/parallel.h"
#include "samples/plan/cell_numbers.h"
#include "samples/plan/space_grid.h"
#include "tests/support/drawn_pair.h"

namespace mbtfm::plan {
namespace {

constexpr int kThreads = 2;

/// A small cell, quick to plan with.
Scene small_scene(double youngs_modulus_kPa = 8) {
  Parameters parameters;
  Scene scene = simulated_scene(parameters);
  drawing::ScenarioParameters& p = scene.experiment;
  p.cell.diameter_um = 30;
  p.cell.n_adhesions = 40;
  p.cell.n_ventral = 2;
  p.cell.n_dorsal = 2;
  p.cell.n_arc = 0;
  p.microscope.image_size_px = 512;
  p.gel.youngs_modulus_kPa = scene.fit.gel.youngs_modulus_kPa = youngs_modulus_kPa;
  const double side_um = drawing::field_um(p.microscope);
  scene.cell = drawing::draw_cell(p.cell, p.tension, side_um, p.seed);
  scene.field = {{0, 0}, {side_um, side_um}};
  return scene;
}

struct Small {
  Scene scene = small_scene();
  KnownCell cell = known_cell(scene, kThreads);
};
const Small& small() {
  static const Small small;
  return small;
}

double median_of(const Eigen::VectorXd& v) { return numerics::median(std::vector<double>(v.begin(), v.end())); }

/// The fit states for its own beads what the plan says of them: two ways to the same bound.
TEST(Plan, its_error_by_beads_is_that_which_a_fit_states) {
  const auto& [scene, cell] = small();
  constexpr double kNoise_um = 1e-3;  // so that the fit ends where the plan stands
  const BeadsOnGel beads = beads_on_gel(scene, cell, 1, 0, kThreads);
  const Precision unit = precision_of(scene, cell, beads, kThreads);
  // forces of a network of the fit's own: no other error than noise
  tensions::ReducedData none;  // none are needed for forces
  none.compliance =
      std::make_shared<const Eigen::MatrixXd>(Eigen::MatrixXd::Zero(cell.forces_nN.size(), cell.forces_nN.size()));
  none.target = Eigen::VectorXd::Zero(cell.forces_nN.size());
  const tensions::TensionProblem problem(cell.networks.front(), none, cell.adhesion_ids);
  const tensions::Trial truth = problem.evaluate(cell.tensions_nN);
  const DisplacementField field = exact_beads(beads.places_um, *beads.response, truth.forces_nN, kNoise_um);
  const std::vector<cables::CableNetwork> one = {cell.networks.front()};
  const tensions::EnsembleFit fit = tensions::fit_ensemble(
      one, tensions::reduce(field, beads.response, {}, kThreads, tensions::affine_motions(field)), cell.adhesion_ids,
      scene.fit.fit, kThreads, {}, &truth);
  for (std::size_t i = 0; i < fit.tensions.nN.size(); ++i) {
    const double planned = kNoise_um * scene.fit.gel.youngs_modulus_kPa * unit.tensions[static_cast<Eigen::Index>(i)];
    // the plan takes the mean of two meshes, of which the fit has the first: tensions differ by some per cent
    EXPECT_NEAR(fit.tensions.nN[i].noise, planned, 0.2 * planned) << "tension " << i;
  }
}

TEST(Plan, twice_the_modulus_is_twice_the_error) {
  const auto& [scene, cell] = small();
  const Scene stiff = small_scene(16);
  const Precision soft = precision_of(scene, cell, beads_on_gel(scene, cell, 1, 0, kThreads), kThreads),
                  hard = precision_of(stiff, cell, beads_on_gel(stiff, cell, 1, 0, kThreads), kThreads);
  // unit errors are those on 1 kPa: the same from either gel, to rounding of the normal matrix (1e-13 of its trace)
  EXPECT_LT((soft.tensions - hard.tensions).norm(), 1e-7 * soft.tensions.norm());
  EXPECT_NEAR(soft.total_force, hard.total_force, 1e-7 * soft.total_force);
}

const Densities& thin_and_dense() {
  static const Densities densities = precision_at(small().scene, small().cell, {0.5, 2}, kThreads);
  return densities;
}

TEST(Plan, four_times_the_beads_halve_the_error) {
  const Densities& d = thin_and_dense();
  const double thin = median_of(d.precision[0].tensions), dense = median_of(d.precision[1].tensions);
  // But for which places few beads have by chance: of a tension the beads near its two adhesions tell half, and of
  // some six of these the number scatters by 40 %, the error by 20 %, the median of five over three draws by 10 %.
  EXPECT_NEAR(thin / dense, 2, 0.5);
  EXPECT_NEAR(d.precision[0].total_force / d.precision[1].total_force, 2, 0.4);
}

TEST(Plan, between_densities_the_error_lies_between_and_beyond_them_it_follows_the_law) {
  const Densities& d = thin_and_dense();
  const double thin = unit_error(d, 1, 0.5), dense = unit_error(d, 1, 2);
  EXPECT_DOUBLE_EQ(thin, d.precision[0].tensions[1]);
  EXPECT_NEAR(dense, d.precision[1].tensions[1], 1e-12 * dense);
  EXPECT_NEAR(unit_error(d, 1, 1), std::sqrt(thin * dense), 1e-12 * thin);
  EXPECT_NEAR(unit_error(d, 1, 8), dense / 2, 1e-12 * dense);
  EXPECT_NEAR(unit_error(d, 1, 0.125), 2 * thin, 1e-12 * thin);
}

TEST(Plan, at_the_density_that_is_needed_half_of_the_fibres_meet_the_target) {
  const Scene& scene = small().scene;
  Parameters p;
  p.noise_um = "0.02";
  p.beads_per_um2 = "0.05,0.5,2";
  p.youngs_modulus_kPa = "4,8";
  p.within = "40%";
  const Asked asked = asked_by(p, 8);
  const Computed computed = compute(scene, asked, kThreads);
  const Grid grid = grid_of(scene, asked, computed, kThreads);
  ASSERT_EQ(grid.needed.size(), 2u);
  for (const Needed& n : grid.needed) {
    ASSERT_TRUE(n.density) << n.youngs_modulus_kPa;
    int n_within = 0;
    const auto n_fibres = static_cast<int>(computed.cell.fibre_ids.size()) - 1;
    for (int i = 1; i <= n_fibres; ++i) {
      // a millionth beyond, where the search for it ends
      const Point point{n.youngs_modulus_kPa, *n.density * (1 + 1e-5), n.noise_um};
      n_within += standard_error_nN(computed, static_cast<std::size_t>(i), point) <= asked.target_nN;
    }
    EXPECT_GE(2 * n_within, n_fibres);
    EXPECT_LT(2 * (n_within - 1), n_fibres + 1);
  }
  // the model's part is that of every gel: half the modulus needs a quarter of the beads where the law holds
  EXPECT_LT(*grid.needed[0].density, *grid.needed[1].density);
}

TEST(Plan, a_list_that_is_none_is_refused) {
  Parameters p;
  for (const char* bad : {"", "0.1,", "a", "0.1;0.2", "-1", "0", "1e9", "0.1 0.2", ",", "nan"}) {
    p.noise_um = bad;
    if (std::string(bad) == "0.1,") continue;  // a comma at the end ends the list
    EXPECT_THROW(asked_by(p, 8), UsageError) << bad;
  }
  p.noise_um = "0.05, 0.02,0.05";
  EXPECT_EQ(asked_by(p, 8).noise_um, (std::vector<double>{0.05, 0.02})) << "the first stays the first";
  p.within = "20 %";
  EXPECT_DOUBLE_EQ(asked_by(p, 8).target_nN, 0.2);
  for (const char* bad : {"often", "", "%", "0", "-20%", "2000%", "20,30"}) {
    p.within = bad;
    EXPECT_THROW(asked_by(p, 8), UsageError) << bad;
  }
}

TEST(Plan, a_percentage_without_its_sign_is_refused_and_named) {
  Parameters p;
  p.within = "20";
  const UsageError e = test::thrown<UsageError>([&] { asked_by(p, 8); });
  EXPECT_TRUE(has_words(e.what(), "Did you mean 20%?"));
}

// --- pairs

const Gel kGel{.youngs_modulus_kPa = 5, .poisson_ratio = 0.49, .thickness_um = 60};

/// One of all densities that are asked of: the fields of the pairs, which take the time, are those of each.
constexpr double kArea_um2 = 0.46;
enum Density : std::size_t { of_1, of_128, of_512, of_a_tenth, of_10 };
const PairResolution& resolution() {
  static const PairResolution pairs(kGel, kArea_um2, {1, 128, 512, 0.1, 10}, kThreads);
  return pairs;
}

TEST(AdhesionPair, the_least_distance_asks_for_force_over_noise_and_modulus) {
  const PairResolution& pairs = resolution();
  const auto base = pairs.least_distance_um(1, 8, of_1, 0.04);
  ASSERT_TRUE(base);
  EXPECT_GT(*base, pairs.touching_um());
  EXPECT_NEAR(*pairs.least_distance_um(2, 8, of_1, 0.08), *base, 1e-12 * *base);
  EXPECT_NEAR(*pairs.least_distance_um(1, 4, of_1, 0.08), *base, 1e-12 * *base);
  EXPECT_GT(*pairs.least_distance_um(1, 8, of_1, 0.05), *base);
  EXPECT_DOUBLE_EQ(*pairs.least_distance_um(1, 8, of_1, 1e-6), pairs.touching_um());
  EXPECT_FALSE(pairs.least_distance_um(0.01, 8, of_1, 0.1)) << "nothing is seen of such forces";
}

/// Many beads: four times as many with twice the noise say the same.
TEST(AdhesionPair, of_many_beads_only_the_density_over_the_squared_noise_counts) {
  const PairResolution& pairs = resolution();
  for (const double noise_um : {0.32, 0.48}) {
    const double few_um = *pairs.least_distance_um(1, 8, of_128, noise_um);
    EXPECT_GT(few_um, pairs.touching_um());
    // 400 experiments tell either to some 4 %, and they have the same random numbers
    EXPECT_NEAR(*pairs.least_distance_um(1, 8, of_512, 2 * noise_um), few_um, 0.04 * few_um) << noise_um;
  }
}

/// Where noise is large the single adhesion goes to the place that the noise likes best, the nearer to the truth the
/// fewer experiments tell two from one.
TEST(AdhesionPair, at_the_least_distance_four_in_five_experiments_resolve_the_two) {
  const Gel gel{.youngs_modulus_kPa = 8.4, .poisson_ratio = kGel.poisson_ratio, .thickness_um = 60};
  constexpr int kExperiments = 400;
  for (const double noise_um : {0.02, 0.04}) {
    const double distance_um = *resolution().least_distance_um(1, gel.youngs_modulus_kPa, of_1, noise_um);
    const test::DrawnPair pair{.gel = gel,
                               .radius_um = std::sqrt(kArea_um2 / std::numbers::pi),
                               .distance_um = distance_um,
                               .beads_per_um2 = 1,
                               .noise_um = noise_um,
                               .half_field_um = 6 + 2 * distance_um};
    std::vector<char> told(kExperiments);
    numerics::parallel_for(kExperiments, kThreads, [&](int draw) { told[draw] = test::is_resolved(pair, draw); });
    // three standard deviations of a share of 400, and of the plan's own 400
    const double share = static_cast<double>(std::ranges::count(told, 1)) / kExperiments;
    EXPECT_NEAR(share, kChance, 3 * std::sqrt(2 * kChance * (1 - kChance) / kExperiments)) << noise_um;
  }
}

/// The mean of what beads tell is the same for a hundredth of the beads with a tenth of the noise. But then chance
/// decides whether one lies near the two.
TEST(AdhesionPair, few_exact_beads_are_worth_less_than_many_poor_ones) {
  EXPECT_GT(*resolution().least_distance_um(1, 8, of_a_tenth, 0.01),
            1.3 * *resolution().least_distance_um(1, 8, of_10, 0.1));
}

/// Drawn experiments take minutes: notes/planning.md has those of version 0.2.
TEST(AdhesionPair, by_beads_in_a_volume_the_least_distance_asks_for_force_over_noise_and_modulus) {
  const BeadVolume volume{.depth_um = 12, .axial_noise = 3};
  const PairResolution pairs(kGel, 28, {0.002, 0.008}, volume, {4, 60}, kThreads);
  const auto base = pairs.least_distance_um(50, 8, 1, 0.2);
  ASSERT_TRUE(base);
  EXPECT_GT(*base, pairs.touching_um());
  EXPECT_NEAR(*pairs.least_distance_um(100, 8, 1, 0.4), *base, 1e-12 * *base);
  EXPECT_NEAR(*pairs.least_distance_um(50, 4, 1, 0.4), *base, 1e-12 * *base);
  EXPECT_LT(*pairs.least_distance_um(50, 8, 1, 0.1), *base);
  EXPECT_GT(pairs.least_distance_um(50, 8, 0, 0.2).value_or(pairs.farthest_um()), *base) << "a fourth of the beads";
  EXPECT_FALSE(pairs.least_distance_um(0.5, 8, 1, 0.2)) << "nothing is seen of such forces";
}

// --- in space

/// Two patches that pull at each other on a small gel whose base is near: few elements.
SpaceScene two_patches_in_space() {
  SpaceScene scene{.name = "two patches",
                   .gel = {.youngs_modulus_kPa = 10, .poisson_ratio = 0.45, .thickness_um = 20},
                   .low_um = {0, 0},
                   .high_um = {36, 36},
                   .bead_depth_um = 12,
                   .own_beads_per_um3 = 0.02};
  HeightMap flat{.origin_um = {-2, -2}, .spacing_um = {4, 4}, .n_x = 11, .n_y = 11};
  flat.z_um.assign(121, 0.0);
  scene.gel.surface = std::make_shared<const HeightMap>(flat);
  scene.traction.spacing_um = 2.43;  // of all densities, so that the beads alone change the errors
  for (const double side : {-1.0, 1.0}) {
    constexpr double kRadius_um = 3;
    scene.patches.push_back({{.adhesion_id = side < 0 ? 1 : 2,
                              .position_um = {18 + 9 * side, 18},
                              .area_um2 = std::numbers::pi * kRadius_um * kRadius_um,
                              .major_axis_um = 2 * kRadius_um,
                              .minor_axis_um = 2 * kRadius_um},
                             {-40 * side, 0, 20 * side}});
  }
  return scene;
}

Asked few_points(const SpaceScene& scene) {
  Parameters p;
  p.noise_um = "0.02,0.04";
  p.beads_per_um3 = "0.01,0.04";
  p.youngs_modulus_kPa = "10,20";
  return asked_in_space(p, scene);
}

struct SmallInSpace {
  SpaceScene scene = two_patches_in_space();
  Asked asked = few_points(scene);
  std::vector<SpacePool> pools = pools_of(scene, asked, kThreads);
  SpaceForeseen foreseen = foresee(scene, asked, pools, kThreads);
  SpaceGrid grid = grid_of(scene, asked, pools, foreseen, pairs_of(scene, asked, {2, 3}, kThreads));
  const SpaceExpected& of(const Point& p, SpaceQuantity quantity) const { return expected_of(grid, p, quantity); }
};
const SmallInSpace& in_space() {
  static const SmallInSpace small;
  return small;
}

TEST(PlanInSpace, twice_the_modulus_is_twice_the_noise_and_either_is_more_error_but_not_twice_as_much) {
  const SmallInSpace& s = in_space();
  for (const SpaceQuantity quantity : {SpaceQuantity::force, SpaceQuantity::normal_force, SpaceQuantity::net_force}) {
    const double once = s.of({10, 0.01, 0.02}, quantity).standard_error_nN,
                 noise = s.of({10, 0.01, 0.04}, quantity).standard_error_nN,
                 modulus = s.of({20, 0.01, 0.02}, quantity).standard_error_nN;
    EXPECT_DOUBLE_EQ(noise, modulus) << name_of(quantity);
    EXPECT_GT(noise, once) << name_of(quantity);
    EXPECT_LT(noise, 2 * once) << name_of(quantity) << ": more noise is smoothed more";
  }
}

/// Four times the beads would halve the error of patches alone. Beside a background that is only known to be weak they
/// do less: with as much smoothing, what it explains of the patches' displacement grows with the beads, too.
TEST(PlanInSpace, more_beads_err_less_but_four_times_as_many_not_by_half) {
  const SmallInSpace& s = in_space();
  for (const double noise_um : {0.02, 0.04}) {
    const SpaceExpected &thin = s.of({10, 0.01, noise_um}, SpaceQuantity::total_force),
                        &dense = s.of({10, 0.04, noise_um}, SpaceQuantity::total_force);
    EXPECT_LT(dense.standard_error_nN, thin.standard_error_nN) << noise_um;
    EXPECT_GT(2 * dense.standard_error_nN, thin.standard_error_nN) << noise_um;
    EXPECT_GT(dense.degrees, thin.degrees) << noise_um;
    EXPECT_LT(*s.of({10, 0.04, noise_um}, SpaceQuantity::force).resolution_um,
              *s.of({10, 0.01, noise_um}, SpaceQuantity::force).resolution_um);
  }
}

/// Where patches are all that pulls, the part by the noise of the beads is all that experiments scatter by: at every
/// density, so that what more beads are said to gain is gained.
TEST(PlanInSpace, drawn_experiments_scatter_as_the_part_by_beads_says) {
  const SmallInSpace& s = in_space();
  constexpr int kExperiments = 24;
  for (const double density : {0.01, 0.04}) {
    const Point point{10, density, 0.04};
    const SpacePool& pool = density < 0.02 ? s.pools.front() : s.pools.back();
    const Drawn drawn = draw_experiments(s.scene, pool, s.foreseen, point, kExperiments, kThreads);
    ASSERT_EQ(drawn.numbers.size(), std::size_t{kExperiments} * 6);
    double squares = 0;
    for (const DrawnNumber& f : drawn.numbers) squares += std::pow(f.found_nN - f.true_nN, 2) / kExperiments;
    // 144 numbers: their root mean square is known to 6 %; the places of the beads add 5 %, of the thin ones 10 %;
    // three times both
    EXPECT_NEAR(std::sqrt(squares / s.foreseen.of(point).by_noise_nN2.trace()), 1, density < 0.02 ? 0.35 : 0.24)
        << density;
    EXPECT_LT(drawn.error_over_predicted, 1.2) << "what is stated holds the background, too";
  }
}

TEST(PlanInSpace, at_the_density_that_is_needed_the_error_is_the_target) {
  const SmallInSpace& s = in_space();
  for (const Needed& n : s.grid.needed) {
    if (!n.density) continue;
    ASSERT_TRUE(n.of_most);
    EXPECT_LE(*n.density, *n.of_most);
    const bool is_between = *n.of_most > 0.01 && *n.of_most < 0.04;
    if (!is_between) continue;
    const double thin = s.of({n.youngs_modulus_kPa, 0.01, n.noise_um}, SpaceQuantity::force).standard_error_nN,
                 dense = s.of({n.youngs_modulus_kPa, 0.04, n.noise_um}, SpaceQuantity::force).standard_error_nN;
    EXPECT_LT(dense, s.asked.target_nN * 1.1);
    EXPECT_GT(thin, s.asked.target_nN / 1.1);
  }
}

TEST(PlanInSpace, what_is_said_of_a_density_does_not_depend_on_the_others) {
  SpaceScene scene = two_patches_in_space();
  scene.traction.spacing_um.reset();  // a reconstruction takes it from its beads
  const Point point{10, 0.01, 0.02};
  const auto said_beside = [&](std::vector<double> densities) {
    Asked asked = few_points(scene);
    asked.densities = std::move(densities);
    return foresee(scene, asked, pools_of(scene, asked, kThreads), kThreads).of(point);
  };
  const spatial::Foreseen alone = said_beside({0.01}), beside = said_beside({0.01, 0.03});
  EXPECT_EQ(alone.covariance_nN2, beside.covariance_nN2);
  EXPECT_EQ(alone.resolution_um, beside.resolution_um);
}

TEST(PlanInSpace, beads_by_area_or_too_few_or_too_many_are_refused) {
  const SpaceScene& scene = in_space().scene;
  Parameters p;
  p.beads_per_um2 = "1";
  EXPECT_THROW(asked_in_space(p, scene), UsageError);
  for (const char* bad : {"0.0001,0.04", "5"}) {
    p = {};
    p.beads_per_um3 = bad;
    EXPECT_THROW(pools_of(scene, asked_in_space(p, scene), kThreads), UsageError) << bad;
  }
  p = {};
  const Asked asked = asked_in_space(p, scene);
  EXPECT_EQ(asked.densities, (std::vector<double>{0.01, 0.02, 0.04}));
  EXPECT_NEAR(asked.tension_nN, std::hypot(40, 20), 1e-9);
}

// --- how many cells

TEST(CellNumbers, the_power_is_the_share_of_drawn_studies_that_see_the_difference) {
  const Scatter scatter{.mean_nN = 4, .between_cells_nN = 1, .within_nN = 2, .error_nN = 1, .fibres_per_cell = 5};
  constexpr int kStudies = 4000, kPerGroup = 10, kFibres = 5;
  test::Normal normal(3);
  const double t_limit = 2.1009220402409601;  // Student's t of 18 degrees at 0.975
  int n_seen = 0;
  for (int s = 0; s < kStudies; ++s) {
    double mean[2] = {}, squares[2] = {};
    for (int g = 0; g < 2; ++g) {
      for (int c = 0; c < kPerGroup; ++c) {
        double cell = 1.5 * g + scatter.between_cells_nN * normal();
        for (int f = 0; f < kFibres; ++f)
          cell += (scatter.within_nN * normal() + scatter.error_nN * normal()) / kFibres;
        mean[g] += cell / kPerGroup;
        squares[g] += cell * cell;
      }
      squares[g] -= kPerGroup * mean[g] * mean[g];
    }
    const double variance = (squares[0] + squares[1]) / (2 * kPerGroup - 2);
    n_seen += std::abs(mean[1] - mean[0]) > t_limit * std::sqrt(2 * variance / kPerGroup);
  }
  const double power = power_of(scatter, 1.5, kFibres, kPerGroup);
  // binomial: three standard deviations of 4000
  EXPECT_NEAR(double(n_seen) / kStudies, power, 3 * std::sqrt(power * (1 - power) / kStudies));
}

TEST(CellNumbers, without_a_difference_the_power_is_the_level_and_enough_cells_reach_any) {
  const Scatter scatter{.mean_nN = 4, .between_cells_nN = 1, .within_nN = 2, .error_nN = 1, .fibres_per_cell = 5};
  EXPECT_NEAR(power_of(scatter, 0, 5, 10), 0.05, 1e-9);
  const std::optional<int> cells = cells_for(scatter, 1, 5, 0.9);
  ASSERT_TRUE(cells);
  EXPECT_GE(power_of(scatter, 1, 5, *cells), 0.9);
  EXPECT_LT(power_of(scatter, 1, 5, *cells - 1), 0.9);
  EXPECT_FALSE(cells_for(scatter, 1e-4, 5, 0.9));
}

}  // namespace
}  // namespace mbtfm::plan
