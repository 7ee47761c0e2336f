/// Surfaces of a gel from formulas, height maps and points.
#include "pipeline/contract/errors.h"
#include "substrate/surface/formula.h"
#include "substrate/surface/height.h"
#include "substrate/surface/missing.h"
#include "substrate/surface/points.h"
#include "tests/support/test.h"

namespace mbtfm::surface {
namespace {

using std::numbers::pi;
constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

double bumpy(Vec2 p) { return 3 * std::sin(p.x / 7) * std::cos(p.y / 9) + 0.1 * p.x; }

double largest_error(const std::function<double(Vec2)>& truth, double spacing_um) {
  const Height height(sampled(truth, {-20, -15}, {20, 25}, spacing_um));
  double largest = 0;
  for (double y = -15; y <= 25; y += 0.37)
    for (double x = -20; x <= 20; x += 0.37) largest = std::max(largest, std::abs(height({x, y}) - truth({x, y})));
  return largest;
}

TEST(Formula, is_what_it_says) {
  const Vec2 p = {3, 4};
  EXPECT_DOUBLE_EQ(formula_of("flat z_um=2")(p), 2);
  EXPECT_DOUBLE_EQ(formula_of("wave amplitude_um=12 period_um=70 phase_um=35")(p),
                   -12 * std::cos(2 * pi * (3 - 35.0) / 70));
  EXPECT_NEAR(formula_of("wave amplitude_um=12 period_um=70 angle_deg=90")(p), -12 * std::cos(2 * pi * 4 / 70), 1e-12);
  EXPECT_DOUBLE_EQ(formula_of("groove depth_um=20 width_um=40 wall_um=9")(p),
                   10 * (std::tanh((3 + 20) / 9.) - std::tanh((3 - 20) / 9.)));
  EXPECT_DOUBLE_EQ(formula_of("eggbox amplitude_um=5 period_um=40")(p),
                   -5 * std::cos(2 * pi * 3 / 40) * std::cos(2 * pi * 4 / 40));
  EXPECT_NEAR(formula_of("well depth_um=10 radius_um=20 wall_um=2")({0, 0}), 10, 1e-7);
  EXPECT_DOUBLE_EQ(formula_of("well depth_um=10 radius_um=5 wall_um=2")(p), 5);
  const auto cap = formula_of("cap radius_um=30 height_um=10 x_um=3");
  EXPECT_DOUBLE_EQ(cap({3, 0}), -10);  // bulges out of the gel
  EXPECT_DOUBLE_EQ(cap({100, 0}), 0);
}

TEST(Formula, that_is_none_is_refused_by_name) {
  const auto message_of = [](const std::string& text) -> std::string {
    const auto error = test::caught<UsageError>([&] { formula_of(text); });
    return error ? error->what() : "";
  };
  EXPECT_TRUE(has_words(message_of("wawe"), "wave"));
  EXPECT_TRUE(has_words(message_of("wave amplitude_um=3"), "period_um"));
  EXPECT_TRUE(has_words(message_of("wave amplitude_um=3 period_um=0"), "> 0"));
  EXPECT_TRUE(has_words(message_of("wave amplitude=3 period_um=1"), "'amplitude=3'"));
  EXPECT_TRUE(has_words(message_of("wave amplitude_um=3x period_um=1"), "'amplitude_um=3x'"));
  EXPECT_TRUE(has_words(message_of("flat z_um=1 z_um=2"), "once"));
  EXPECT_TRUE(has_words(message_of("cap radius_um=3 height_um=4"), "overhangs"));
}

TEST(Height, is_of_fourth_order_up_to_the_rim) {
  const double coarse = largest_error(bumpy, 2), fine = largest_error(bumpy, 1);
  EXPECT_GT(coarse / fine, 12);  // 16 as the spacing goes to 0
  EXPECT_LT(fine, 1e-3);
}

TEST(Height, of_a_cubic_is_exact_and_so_are_its_slopes) {
  const auto cubic = [](Vec2 p) { return 1e-3 * p.x * p.x * p.x - 0.01 * p.x * p.y * p.y + p.y; };
  EXPECT_LT(largest_error(cubic, 5), 1e-11);
  const Height height(sampled(cubic, {-20, -15}, {20, 25}, 5));
  EXPECT_NEAR(height.slope({3, 4}).x, 3e-3 * 9 - 0.01 * 16, 1e-11);
  EXPECT_NEAR(height.slope({3, 4}).y, -0.02 * 3 * 4 + 1, 1e-11);
}

TEST(Height, goes_on_beyond_its_rim_without_a_kink_and_ends_level_at_its_mean) {
  const HeightMap map = sampled(bumpy, {-20, -15}, {20, 25}, 1);
  const Height height(map);
  constexpr double kStep = 1e-4;
  for (const Vec2 rim : {Vec2{20, 3}, Vec2{-20, 3}, Vec2{3, 25}, Vec2{20, 25}})
    for (const Vec2 along : {Vec2{1, 0}, Vec2{0, 1}}) {
      const double before = (height(rim) - height(rim - kStep * along)) / kStep;
      const double behind = (height(rim + kStep * along) - height(rim)) / kStep;
      EXPECT_NEAR(before, behind, 1e-3);  // a step of 1e-4 um on curvatures up to 1 / um
    }
  const double mean_um = std::accumulate(map.z_um.begin(), map.z_um.end(), 0.0) / (map.n_x * map.n_y);
  EXPECT_NEAR(height({1000, 0}), mean_um, 1e-12);
  EXPECT_TRUE(height.contains({20, 25}));
  EXPECT_FALSE(height.contains({20.1, 25}));
}

HeightMap with_holes(HeightMap map, const std::function<bool(Vec2)>& is_hole) {
  for (int k = 0; k < map.n_x * map.n_y; ++k) {
    const Vec2 at = map.vertex_um(static_cast<std::size_t>(k));
    if (is_hole(at)) map.z_um[k] = kMissing;
  }
  return map;
}

TEST(HeightMap, small_holes_are_filled_smoothly) {
  const HeightMap whole = sampled(bumpy, {-20, -20}, {20, 20}, 0.5);
  const auto is_hole = [](Vec2 p) { return norm(p - Vec2{5, 3}) < 2 || norm(p - Vec2{-20, -20}) < 2; };
  const FilledMap mended = filled(with_holes(whole, is_hole), 5);
  EXPECT_GT(mended.n_filled, 50);
  double largest = 0;
  for (std::size_t k = 0; k < whole.z_um.size(); ++k)
    largest = std::max(largest, std::abs(mended.map.z_um[k] - whole.z_um[k]));
  // a plate over a disc of radius r is off by r⁴/64 of the fourth derivatives (0.003 here), at a free corner by its
  // curvature: r²/2 of 0.06
  EXPECT_LT(largest, 0.12);
  EXPECT_EQ(filled(whole, 5).n_filled, 0);
}

/// A plate without load is biharmonic, and the differences of a quartic are its derivatives.
TEST(HeightMap, a_hole_in_a_biharmonic_quartic_is_filled_exactly) {
  const auto quartic = [](Vec2 p) { return 1e-4 * (std::pow(p.x, 4) - 6 * p.x * p.x * p.y * p.y + std::pow(p.y, 4)); };
  for (const double spacing_um : {0.5, 0.8}) {
    const HeightMap whole = sampled(quartic, {-8, -8}, {8, 8}, spacing_um);
    const FilledMap mended = filled(with_holes(whole, [](Vec2 p) { return norm(p - Vec2{2, 1}) < 2; }), 5);
    EXPECT_GT(mended.n_filled, 12);
    for (std::size_t k = 0; k < whole.z_um.size(); ++k)
      EXPECT_NEAR(mended.map.z_um[k], whole.z_um[k], 1e-9) << k;  // heights of 3 um, a matrix of condition 1e5
  }
}

TEST(HeightMap, a_wide_hole_is_refused_by_place) {
  const HeightMap map = with_holes(sampled(bumpy, {-20, -20}, {20, 20}, 0.5), [](Vec2 p) {
    return norm(p - Vec2{5, 3}) < 3;
  });
  const InvalidData error = test::thrown<InvalidData>([&] { filled(map, 5); });
  EXPECT_TRUE(has_words(error.element, "x, y = 5, 3")) << error.what();
}

TEST(HeightMap, coarser_ones_are_means_and_keep_their_place) {
  const auto tilted = [](Vec2 p) { return 0.3 * p.x - 0.2 * p.y; };
  const HeightMap fine = sampled(tilted, {0, 0}, {20, 10}, 1), coarse = binned(fine, 2);
  for (int k = 0; k < coarse.n_x * coarse.n_y; ++k) {
    const Vec2 at = coarse.origin_um + Vec2{k % coarse.n_x * 2.0, k / coarse.n_x * 2.0};
    EXPECT_NEAR(coarse.z_um[k], tilted(at), 1e-12);
  }
  EXPECT_THROW(binned(fine, 4), InvalidData);
}

struct Scattered {
  std::vector<Vec3> points;
  std::vector<double> sigma;
};
Scattered scattered(int n, double error_um, double share_of_strays, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> x(-20, 20), share(0, 1), far(-8, 8);
  std::normal_distribution<double> noise(0, error_um);
  Scattered s;
  for (int k = 0; k < n; ++k) {
    const Vec2 p = {x(random), x(random)};
    const bool is_stray = share(random) < share_of_strays;
    s.points.push_back({p.x, p.y, bumpy(p) + noise(random) + (is_stray ? far(random) : 0)});
    s.sigma.push_back(error_um);
  }
  return s;
}

struct Misfit {
  double rms_um = 0, rms_over_sigma = 0;
};
Misfit misfit_of(const PointFit& fit) {
  Misfit sum;
  int n = 0;
  for (double y = -18; y <= 18; y += 0.7)
    for (double x = -18; x <= 18; x += 0.7) {
      const double error = fit.height_um({x, y}) - bumpy({x, y});
      sum.rms_um += error * error;
      sum.rms_over_sigma += std::pow(error / fit.sigma_um({x, y}), 2);
      ++n;
    }
  return {std::sqrt(sum.rms_um / n), std::sqrt(sum.rms_over_sigma / n)};
}

TEST(SurfacePoints, the_surface_lies_nearer_than_they_and_knows_its_error) {
  constexpr double kError = 0.3;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const Scattered s = scattered(600, kError, 0, seed);
    for (const bool is_known : {true, false}) {
      const PointFit fit = fit_points(s.points, is_known ? s.sigma : std::vector<double>{});
      const Misfit misfit = misfit_of(fit);
      // some 80 bumps of the field are told by 600 points: sqrt(80/600) of their error
      EXPECT_LT(misfit.rms_um, 0.5 * kError) << "seed " << seed;
      EXPECT_NEAR(misfit.rms_over_sigma, 1, 0.35) << "seed " << seed;
      EXPECT_LE(fit.strays.size(), 1u);  // Student's errors are narrower than the points' own
      if (!is_known) EXPECT_NEAR(fit.error_scale, kError, 0.3 * kError);
    }
  }
}

TEST(SurfacePoints, strays_are_named_and_pull_little) {
  const Scattered s = scattered(800, 0.2, 0.1, 5);
  const PointFit fit = fit_points(s.points, s.sigma);
  EXPECT_LT(misfit_of(fit).rms_um, 0.2);
  EXPECT_GT(fit.strays.size(), 55u);  // nine of ten of 80 lie further than five errors
  EXPECT_LT(fit.strays.size(), 100u);
}

TEST(SurfacePoints, errors_of_the_distribution_that_is_assumed_have_their_scale) {
  constexpr double kScale = 0.3;
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> place(-20, 20);
  std::student_t_distribution<double> error(4);
  std::vector<Vec3> points;
  for (int k = 0; k < 2000; ++k) {
    const double x = place(random), y = place(random);
    points.push_back({x, y, bumpy({x, y}) + kScale * error(random)});
  }
  // known to sqrt((nu + 3) / (2 nu n)) = 2 % (Lange, Little, Taylor); what the surface follows takes as much again
  EXPECT_NEAR(fit_points(points, {}).error_scale, kScale, 0.06 * kScale);
}

TEST(SurfacePoints, without_errors_the_surface_goes_through_them) {
  const Scattered s = scattered(2000, 0, 0, 6);
  EXPECT_LT(misfit_of(fit_points(s.points, {})).rms_um, 0.01);
}

TEST(SurfacePoints, a_plane_stays_one) {
  std::vector<Vec3> points;
  for (const Vec3& p : scattered(200, 1, 0, 7).points) points.push_back({p.x, p.y, 4 + 0.2 * p.x - 0.1 * p.y});
  const PointFit fit = fit_points(points, {});
  for (const Vec2 p : {Vec2{0, 0}, Vec2{15, -12}}) EXPECT_NEAR(fit.height_um(p), 4 + 0.2 * p.x - 0.1 * p.y, 1e-3);
}

TEST(SurfacePoints, too_few_or_on_a_line_are_refused) {
  std::vector<Vec3> line;
  for (int k = 0; k < 50; ++k) line.push_back({1.0 * k, 2.0 * k, 0.1 * k});
  EXPECT_THROW(fit_points(line, {}), InvalidData);
  EXPECT_THROW(fit_points({line.begin(), line.begin() + 10}, {}), InvalidData);
  line[3].z = kMissing;
  EXPECT_THROW(fit_points(line, {}), InvalidData);
}

}  // namespace
}  // namespace mbtfm::surface
