/// Fibres in pieces, and parts of them that another line took over. On responses that are made by hand: a pixel is a
/// unit of length, and the texture has a deviation of 1.
#include "segment/cells/trace_join.h"
#include "tests/support/test.h"

namespace mbtfm::cells {
namespace {

constexpr int kField_px = 300, kSheets = 16;

/// The same response everywhere and in all directions.
Ridges even_ridges(double response) {
  Ridges r;
  for (int k = 0; k < kSheets; ++k) r.response.emplace_back(kField_px, kField_px, CV_32F, cv::Scalar(response));
  r.noise = cv::Mat::ones(kField_px, kField_px, CV_32F);
  return r;
}

Trace trace_of(double from, double to, const std::function<double(double)>& y, double height = 8) {
  Trace t;
  for (double x = from; x < to; ++x) t.points.emplace_back(x, y(x));
  t.height.assign(t.points.size(), height);
  t.is_shared.assign(t.points.size(), false);
  return t;
}

double level(double) { return 150; }

std::size_t n_lines(const Trace& a, const Trace& b, double response = 2) {
  return bridged({a, b}, even_ridges(response), TraceRule{}).size();
}

TEST(FibrePieces, on_one_line_are_put_together_across_a_gap_as_long_as_a_bridge_may_be) {
  const double longest = TraceRule{}.bridge_px;
  const Trace left = trace_of(20, 90, level);
  EXPECT_EQ(n_lines(left, trace_of(90 + longest - 5, 280, level)), 1);
  EXPECT_EQ(n_lines(left, trace_of(90 + longest + 5, 280, level)), 2);
}

TEST(FibrePieces, need_to_fit_the_less_the_brighter_the_way_between_them_is_and_no_texture_joins_them) {
  const Trace left = trace_of(20, 110, level), aside = trace_of(150, 280, [](double) { return 163.0; });
  EXPECT_EQ(n_lines(left, aside, 0.5), 2);
  EXPECT_EQ(n_lines(left, aside, 3), 1);
  EXPECT_EQ(n_lines(left, trace_of(150, 280, level), 0.5), 1);
  EXPECT_EQ(n_lines(left, trace_of(150, 280, level), 0.2), 2);
}

TEST(FibrePieces, stay_apart_beside_each_other_at_an_angle_back_to_back_and_where_one_is_far_brighter) {
  const Trace left = trace_of(20, 110, level);
  EXPECT_EQ(n_lines(left, trace_of(150, 280, [](double) { return 170.0; })), 2);
  EXPECT_EQ(n_lines(left, trace_of(150, 280, [](double x) { return 150 + 0.58 * (x - 130); })), 2);  // 30°
  EXPECT_EQ(n_lines(left, trace_of(150, 280, level, 8 * 12)), 2);
  const std::vector<Trace> row = {trace_of(60, 90, level), trace_of(100, 130, level)};
  EXPECT_EQ(chances_of_going_on(row, even_ridges(2), TraceRule{})[0], 0);
}

/// The order and the direction of pieces mean nothing.
TEST(FibrePieces, make_one_line_from_end_to_end_with_points_a_pixel_apart) {
  Trace right = trace_of(180, 280, level), middle = trace_of(105, 150, level);
  right.reverse();
  const auto lines = bridged({right, trace_of(20, 80, level), middle}, even_ridges(2), TraceRule{});
  ASSERT_EQ(lines.size(), 1);
  EXPECT_EQ(lines[0].pieces.size(), 3);
  const auto& points = lines[0].trace.points;
  EXPECT_NEAR(std::abs(points.front().x - points.back().x), 259, 1e-9);
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    EXPECT_NEAR(std::abs(points[i + 1].x - points[i].x), 1, 0.51) << i;
    EXPECT_NEAR(points[i].y, 150, 1e-6);
  }
}

/// Two straight lines cross at 24°; one of them was led on over the other's course from there on.
TEST(FibrePieces, get_back_what_another_line_took_over_at_a_crossing) {
  const auto slope = [](double x) { return 150 + 0.45 * (x - 150); };
  const Trace owner = trace_of(20, 138, level);
  const Trace other = trace_of(60, 280, [&](double x) { return x < 150 ? slope(x) : level(x); });
  const auto lines = with_own_courses({owner, other}, even_ridges(2), TraceRule{});
  ASSERT_EQ(lines.size(), 2);
  const auto is_level = [](const Trace& t) {
    return std::ranges::all_of(t.points, [](cv::Point2d p) { return std::abs(p.y - 150) < 1; });
  };
  ASSERT_TRUE(is_level(lines[0]));
  EXPECT_NEAR(lines[0].points.front().x, 20, 1);
  EXPECT_NEAR(lines[0].points.back().x, 279, 1);
  EXPECT_NEAR(lines[1].points.back().x, 150, 15);
}

TEST(FibrePieces, take_nothing_from_a_line_that_goes_straight_on) {
  const Trace across = trace_of(60, 280, level);
  const Trace ends_on_it = trace_of(60, 145, [](double x) { return 150 + 0.45 * (x - 150); });
  const auto lines = with_own_courses({ends_on_it, across}, even_ridges(2), TraceRule{});
  ASSERT_EQ(lines.size(), 2);
  EXPECT_EQ(lines[0].size(), ends_on_it.size());
  EXPECT_EQ(lines[1].size(), across.size());
}

}  // namespace
}  // namespace mbtfm::cells
