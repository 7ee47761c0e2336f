/// The best way on of a line, on responses that are made by hand: a pixel is a unit of length.
#include "segment/cells/ways.h"
#include "tests/support/test.h"

namespace mbtfm::cells {
namespace {

constexpr int kSide_px = 200, kDirections = 16;
constexpr double kHeight = 10;  // standard deviations, far above where a way gains fully

/// No line anywhere, noise of deviation 1.
Ridges dark() {
  Ridges r;
  for (int k = 0; k < kDirections; ++k) r.response.push_back(cv::Mat::zeros(kSide_px, kSide_px, CV_32F));
  r.noise = cv::Mat::ones(kSide_px, kSide_px, CV_32F);
  r.strongest = cv::Mat::zeros(kSide_px, kSide_px, CV_32F);
  return r;
}

void light(Ridges& r, int x, int y, double angle_rad, double height = kHeight) {
  const auto k =
      static_cast<std::size_t>(std::lround(angle_rad / std::numbers::pi * kDirections) + kDirections) % kDirections;
  for (int dy = -1; dy <= 1; ++dy) {
    r.response[k].at<float>(y + dy, x) = static_cast<float>(height);
    r.strongest.at<float>(y + dy, x) = std::max(r.strongest.at<float>(y + dy, x), static_cast<float>(height));
  }
}

Ridges row(int from, int to) {
  Ridges r = dark();
  for (int x = from; x < to; ++x) light(r, x, 100, 0);
  return r;
}

Way from(const Ridges& ridges, Course course, const Claims& claims) {
  return Ways(ridges, WayRule{}).best(course, kHeight, claims);
}
Claims none() { return Claims({kSide_px, kSide_px}, kDirections); }

TEST(Ways, along_a_straight_line_the_best_is_straight_and_gains_all_that_is_in_reach) {
  const Way way = from(row(0, kSide_px), {{50, 100}, 0, 0}, none());
  EXPECT_DOUBLE_EQ(way.curvature, 0);
  EXPECT_NEAR(way.gain_px, WayRule{}.reach_px, 1e-4);  // sums in single precision
}

/// Far beyond the 64 deviations that are told apart.
TEST(Ways, gain_along_a_line_however_bright_it_is) {
  for (const double height : {100.0, 1e3, 1e6}) {
    Ridges r = dark();
    for (int x = 0; x < kSide_px; ++x) light(r, x, 100, 0, height);
    EXPECT_NEAR(Ways(r, WayRule{}).best({{50, 100}, 0, 0}, height, none()).gain_px, WayRule{}.reach_px, 1e-4) << height;
  }
}

TEST(Ways, in_the_dark_none_gains) { EXPECT_EQ(from(dark(), {{50, 100}, 0, 0}, none()).gain_px, 0); }

/// Of a reach R a gap g loses g, and what is beyond it gains R − g: something is left where g < R/2.
TEST(Ways, lead_over_a_gap_of_less_than_half_of_the_reach) {
  const int step = static_cast<int>(WayRule{}.step_px), half = static_cast<int>(WayRule{}.reach_px) / 2;
  for (const int gap : {half - 2 * step, half + 2 * step}) {
    Ridges r = row(0, 50);
    for (int x = 50 + gap; x < kSide_px; ++x) light(r, x, 100, 0);
    EXPECT_EQ(from(r, {{49, 100}, 0, 0}, none()).gain_px > 0, gap < half) << gap;
  }
}

TEST(Ways, gain_nothing_where_a_line_runs_already) {
  Claims claims = none();
  for (int x = 50; x < kSide_px; ++x) claims.add({1.0 * x, 100}, 0.0, 3);
  EXPECT_EQ(from(row(0, kSide_px), {{50, 100}, 0, 0}, claims).gain_px, 0);
}

/// A line ends where another one crosses it at 34°: the kink costs more than the other line gives.
TEST(Ways, do_not_kink_into_a_line_that_crosses) {
  const double angle = 3 * std::numbers::pi / kDirections;
  Ridges r = row(0, 100);
  for (int i = -60; i <= 60; ++i)
    light(r, 100 + i, 100 + static_cast<int>(std::lround(i * std::tan(angle))), angle, 2 * kHeight);
  EXPECT_EQ(from(r, {{99, 100}, 0, 0}, none()).gain_px, 0);
}

/// A line of the smallest radius that has bent so far bends on, at no cost.
TEST(Ways, bend_on_as_they_bend) {
  const double radius = WayRule{}.smallest_radius_px, curvature = 1 / radius;
  Ridges r = dark();
  for (double a = 0; a < 1.2; a += 0.005)
    light(r, 60 + static_cast<int>(std::lround(radius * std::sin(a))),
          60 + static_cast<int>(std::lround(radius * (1 - std::cos(a)))), a);
  const Way way = from(r, {{60, 60}, 0, curvature}, none());
  EXPECT_DOUBLE_EQ(way.curvature, curvature);
  EXPECT_GT(way.gain_px, 0.8 * WayRule{}.reach_px);  // between two directions the responses made here have gaps
}

}  // namespace
}  // namespace mbtfm::cells
