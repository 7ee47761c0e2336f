/// The parts of the fibre finder: what lies beside fibres, what a faint end leads to, what counts as texture.
#include "segment/cells/fibre_ends.h"
#include "segment/cells/fibre_significance.h"
#include "segment/cells/fibres.h"
#include "segment/cells/ridge.h"
#include "segment/cells/without_lines.h"
#include "tests/support/test.h"

namespace mbtfm::cells {
namespace {

Polyline straight(Vec2 from, Vec2 to, double step_um = 0.2) {
  const int n = static_cast<int>(norm(to - from) / step_um);
  Polyline line;
  for (int i = 0; i <= n; ++i) line.push_back(from + (1.0 * i / n) * (to - from));
  return line;
}

TEST(FibreParts, a_line_is_not_beside_itself) {
  Bundles bundles;
  bundles.add(straight({0, 0}, {20, 0}));
  bundles.add(straight({0, 1}, {10, 1}));
  EXPECT_DOUBLE_EQ(bundles.share_beside(straight({0, 1}, {10, 1}), 1), 1);
  EXPECT_NEAR(bundles.share_beside(straight({0, 0}, {20, 0}), 0), 0.64,
              0.06);  // sqrt(3² - 1²) um beyond the other's end
}

TEST(FibreParts, a_line_is_beside_a_fibre_that_is_near_and_parallel) {
  Bundles bundles;
  EXPECT_DOUBLE_EQ(bundles.share_beside(straight({2, 1}, {12, 1})), 0);
  bundles.add(straight({0, 0}, {20, 0}));
  EXPECT_DOUBLE_EQ(bundles.share_beside(straight({2, 1}, {12, 1})), 1);
  EXPECT_DOUBLE_EQ(bundles.share_beside(straight({2, 4}, {12, 4})), 0);       // too far
  EXPECT_DOUBLE_EQ(bundles.share_beside(straight({10, -5}, {10, 5})), 0);     // across
  EXPECT_NEAR(bundles.share_beside(straight({15, 1}, {25, 1})), 0.78, 0.06);  // up to sqrt(3² - 1²) um beyond its end
}

/// Lines whose significances follow the law of texture, S = 3 + s (−ln u)^(1/1.4).
std::vector<double> lines_of_texture(int n, double scale, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(1e-12, 1);
  std::vector<double> significances;
  for (int i = 0; i < n; ++i) significances.push_back(3 + scale * std::pow(-std::log(uniform(random)), 1 / 1.4));
  return significances;
}

/// Two lines a cell are let through, to a factor of two: the scale is known to a tenth from 200 lines, and leans
/// towards the usual one. A tenth of the cell's lines being fibres changes nothing.
TEST(FibreParts, as_many_lines_of_texture_are_taken_for_fibres_as_expected) {
  for (const double scale : {1.5, 2.0, 3.0})
    for (const int n_fibres : {0, 20}) {
      SCOPED_TRACE(scale);
      double n_false = 0;
      constexpr int kCells = 40;
      for (unsigned seed = 1; seed <= kCells; ++seed) {
        std::vector<double> lines = lines_of_texture(200, scale, seed);
        const std::vector<double> texture = lines;
        lines.insert(lines.end(), static_cast<std::size_t>(n_fibres), 25.0);
        const TextureLines t = texture_lines(lines);
        n_false +=
            static_cast<double>(std::ranges::count_if(texture, [&](double s) { return t.expected_false(s) <= 2; }));
      }
      EXPECT_GT(n_false / kCells, 1);
      EXPECT_LT(n_false / kCells, 4);
    }
}

TEST(FibreParts, more_significant_lines_are_made_by_chance_less_often_and_by_more_texture_more_often) {
  const TextureLines fine = texture_lines(lines_of_texture(100, 1.5, 1)),
                     coarse = texture_lines(lines_of_texture(100, 3, 1)),
                     many = texture_lines(lines_of_texture(400, 1.5, 1));
  for (const double s : {7.0, 9.0, 12.0}) {
    EXPECT_LT(fine.expected_false(s + 1), fine.expected_false(s));
    EXPECT_GT(coarse.expected_false(s), fine.expected_false(s));
    EXPECT_GT(many.expected_false(s), fine.expected_false(s));
    EXPECT_GT(coarse.expected_false(s), coarse.expected_beside(s));
  }
}

TEST(FibreParts, each_thing_that_speaks_for_a_line_makes_it_more_probable) {
  const FibreEvidence doubtful{.log_false = 0, .length_um = 5, .relative_height = 0.6, .n_fibres = 6};
  const double before = probability_of(doubtful);
  EXPECT_GT(before, 0.1);
  EXPECT_LT(before, 0.9);
  const auto with = [&](auto change) {
    FibreEvidence other = doubtful;
    change(other);
    return probability_of(other);
  };
  EXPECT_GT(with([](FibreEvidence& e) { e.log_false = -5; }), before);
  EXPECT_GT(with([](FibreEvidence& e) { e.length_um = 15; }), before);
  EXPECT_GT(with([](FibreEvidence& e) { e.relative_height = 1; }), before);
  EXPECT_GT(with([](FibreEvidence& e) { e.share_beside = 1; }), before);
  EXPECT_GT(with([](FibreEvidence& e) { e.n_fibres = 20; }), before);
  EXPECT_LT(with([](FibreEvidence& e) { e.cortex = 0.5; }), before);
}

TEST(FibreParts, a_line_along_the_outline_is_cortex_as_far_as_it_is_near) {
  const Polygon outline{{0, 0}, {20, 0}, {20, 20}, {0, 20}};
  EXPECT_NEAR(cortex_along(straight({5, 0.5}, {15, 0.5}), outline), std::exp(-0.25), 1e-9);
  EXPECT_NEAR(cortex_along(straight({5, 4}, {15, 4}), outline), std::exp(-2), 1e-9);
  EXPECT_EQ(cortex_along(straight({10, 1}, {10, 9}), outline), 0);  // straight away from it
  EXPECT_EQ(cortex_along(straight({5, 0.5}, {15, 0.5}), {}), 0);
}

TEST(FibreParts, a_line_of_two_deviations_is_none_in_the_cleanest_cell) {
  EXPECT_GE(texture_lines({}).expected_false(6.9), 20);
  EXPECT_LT(texture_lines({}).expected_false(12), 0.1);
}

Adhesion adhesion_at(Vec2 position) {
  Adhesion a;
  a.adhesion_id = 7;
  a.position_um = position;
  a.major_axis_um = 1;
  a.minor_axis_um = 0.5;
  return a;
}

TracedFibre traced(double length_um, double over_noise) {
  TracedFibre t;
  t.fibre.points_um = straight({0, 0}, {length_um, 0});
  t.after.points_um = straight({length_um + 0.2, 0}, {length_um + 3, 3});  // aside, where it does not point
  t.after.over_noise.assign(t.after.points_um.size(), over_noise);
  return t;
}

TEST(FibreParts, a_long_fibre_is_led_on_along_its_faint_end_to_the_adhesion_there) {
  const std::vector<Adhesion> adhesions = {adhesion_at({22.1, 2.1})};
  TracedFibre bright = traced(20, 2.5), dark = traced(20, 0.9), brief = traced(10, 2.5);
  lead_on(bright, adhesions, {}, 1);
  lead_on(dark, adhesions, {}, 1);
  lead_on(brief, {adhesion_at({12.1, 2.1})}, {}, 1);
  EXPECT_LE(norm(bright.fibre.points_um.back() - adhesions[0].position_um), 0.5);
  EXPECT_NEAR(dark.fibre.points_um.back().x, 20, 1e-9);   // nothing is to be seen there
  EXPECT_NEAR(brief.fibre.points_um.back().x, 10, 1e-9);  // it may be a dorsal fibre or an arc
  tie_ends(bright.fibre, adhesions, {}, 1);
  EXPECT_EQ(bright.fibre.end_adhesion_id, 7);
  EXPECT_NEAR(norm(bright.fibre.points_um.back() - adhesions[0].position_um), 0, 1e-9);
}

TEST(FibreParts, an_end_is_not_tied_where_the_fibre_would_end_in_a_hook) {
  Adhesion across = adhesion_at({10, 1.2}), ahead = adhesion_at({11, 0.2});
  across.major_axis_um = 2.4;
  across.angle_rad = std::numbers::pi / 2;
  ahead.adhesion_id = 8;
  Fibre alone, both;
  alone.points_um = both.points_um = straight({0, 0}, {10, 0});
  tie_ends(alone, {across}, {}, 1);
  EXPECT_FALSE(alone.end_adhesion_id);
  EXPECT_NEAR(norm(alone.points_um.back() - Vec2{10, 0}), 0, 1e-9);
  tie_ends(both, {across, ahead}, {}, 1);
  EXPECT_EQ(both.end_adhesion_id, 8);
}

Fibre line_held_at_start(Vec2 from, Vec2 to) {
  Fibre f;
  f.points_um = straight(from, to);
  f.start_adhesion_id = 7;
  f.type = FibreType::dorsal;
  return f;
}

TEST(FibreParts, a_fibre_that_spans_the_cell_is_held_at_its_far_end_by_an_anchor) {
  const Polygon outline = {{-5, -20}, {45, -20}, {45, 20}, {-5, 20}};
  std::vector<Adhesion> adhesions = {adhesion_at({0, 0})};
  std::vector<Fibre> fibres = {line_held_at_start({0, 0}, {30, 3}), line_held_at_start({0, 0}, {30, 3.2}),
                               line_held_at_start({0, 0}, {9, 3})};
  hold_far_ends(fibres, adhesions, outline, {}, {});
  ASSERT_EQ(adhesions.size(), 2u);  // ends that meet share it
  EXPECT_EQ(adhesions[1].origin, AdhesionOrigin::anchor);
  EXPECT_EQ(adhesions[1].adhesion_id, 8);
  for (const std::size_t i : {0u, 1u}) {
    EXPECT_EQ(fibres[i].type, FibreType::ventral);
    EXPECT_EQ(fibres[i].end_adhesion_id, 8);
    EXPECT_EQ(fibres[i].points_um.back(), adhesions[1].position_um);
  }
  EXPECT_EQ(fibres[2].type, FibreType::dorsal);  // short ones may be dorsal
  EXPECT_FALSE(fibres[2].end_adhesion_id);
}

TEST(FibreParts, a_long_line_that_nothing_seems_to_hold_is_held_at_both_ends_unless_it_is_bent_as_an_arc) {
  const Polygon outline = {{-5, -20}, {45, -20}, {45, 20}, {-5, 20}};
  const auto unheld = [](const Polyline& line) {
    Fibre f;
    f.points_um = line;
    f.type = FibreType::arc;
    return f;
  };
  Polyline arc;
  for (double x = 0; x <= 30; x += 0.5) arc.push_back({x, 16 - 0.02 * (x - 15) * (x - 15)});
  std::vector<Adhesion> adhesions = {adhesion_at({0, -15})};
  std::vector<Fibre> fibres = {unheld(straight({0, 5}, {30, 6})), unheld(arc), unheld(straight({0, 5}, {12, 5}))};
  hold_far_ends(fibres, adhesions, outline, {}, {});
  ASSERT_EQ(adhesions.size(), 3u);
  EXPECT_EQ(fibres[0].type, FibreType::ventral);
  EXPECT_EQ(fibres[0].start_adhesion_id, 8);
  EXPECT_EQ(fibres[0].end_adhesion_id, 9);
  for (const std::size_t i : {1u, 2u}) EXPECT_EQ(fibres[i].type, FibreType::arc);
}

TEST(FibreParts, a_fibre_that_leaves_the_image_is_held_by_no_anchor_there) {
  const Polygon outline = {{-5, -20}, {30, -20}, {30, 20}, {-5, 20}};
  std::vector<Adhesion> adhesions = {adhesion_at({0, 0})};
  std::vector<Fibre> fibres = {line_held_at_start({0, 0}, {30, 3})};
  hold_far_ends(fibres, adhesions, outline, {{{30, -20}, {30, 20}}}, {});
  EXPECT_EQ(adhesions.size(), 1u);
  EXPECT_FALSE(fibres[0].end_adhesion_id);
}

TEST(FibreParts, a_way_that_reaches_no_adhesion_changes_nothing) {
  TracedFibre t = traced(20, 3);
  const Polyline before = t.fibre.points_um;
  lead_on(t, {adhesion_at({24, 2})}, {}, 1);
  EXPECT_EQ(t.fibre.points_um, before);
}

TEST(FibreParts, a_bright_line_that_is_in_no_fibre_is_named_and_a_faint_one_is_not) {
  constexpr int kSide = 256;
  cv::Mat image(kSide, kSide, CV_32F, cv::Scalar(100));
  std::vector<std::vector<cv::Point2d>> fibres;
  const auto draw = [&](int y, double height) {
    for (int x = 30; x < 220; ++x)
      for (int dy = -6; dy <= 6; ++dy)
        image.at<float>(y + dy, x) += static_cast<float>(height * std::exp(-dy * dy / 8.0));
  };
  for (const int y : {30, 60, 90, 120, 150}) {
    draw(y, 100);
    fibres.emplace_back();
    for (int x = 30; x < 220; ++x) fibres.back().emplace_back(x, y);
  }
  const cv::Mat is_inside(kSide, kSide, CV_8U, cv::Scalar(255));
  const RidgeScales scales{.width_sigma_px = 2, .length_sigma_px = 4, .noise_radius_px = 40};
  const auto beside = [&] {
    return bright_crests_beside(find_ridges(image, is_inside, scales), is_inside, fibres, 8, 20);
  };
  draw(210, 60);
  EXPECT_TRUE(beside().empty());
  draw(180, 130);
  const auto crests = beside();
  ASSERT_EQ(crests.size(), 1u);
  EXPECT_NEAR(static_cast<double>(crests[0].size()), 190, 20);
  for (const cv::Point2d& p : crests[0]) EXPECT_NEAR(p.y, 180, 1);
}

/// Normal variates have the deviation that was put in, from few free places as from many; a fibre's own responses do
/// not count where they are masked.
TEST(FibreParts, texture_is_the_deviation_of_what_is_free) {
  constexpr int kSide = 200;
  std::mt19937 random(1);
  std::normal_distribution<float> normal(0, 3);
  std::vector<cv::Mat> responses(4);
  for (cv::Mat& r : responses) {
    r.create(kSide, kSide, CV_32F);
    for (float& v : cv::Mat_<float>(r)) v = normal(random);
  }
  cv::Mat is_free(kSide, kSide, CV_8U, cv::Scalar(255));
  EXPECT_NEAR(cv::mean(texture_of(responses, is_free, 24))[0], 3, 0.3);  // the lower quartile of two directions
  for (cv::Mat& r : responses) r(cv::Rect(80, 0, 40, kSide)).setTo(100);
  is_free(cv::Rect(80, 0, 40, kSide)).setTo(0);
  EXPECT_NEAR(cv::mean(texture_of(responses, is_free, 24))[0], 3, 0.35);
  is_free.setTo(0);
  EXPECT_EQ(cv::countNonZero(texture_of(responses, is_free, 24)), 0);  // nothing to tell it from
}

}  // namespace
}  // namespace mbtfm::cells
