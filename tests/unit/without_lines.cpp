/// Images without their lines: what is left shows the lines that were hidden.
#include "segment/cells/without_lines.h"
#include "tests/support/test.h"

namespace mbtfm::cells {
namespace {

constexpr int kPicture_px = 120;
constexpr double kProfile_px = 2.5, kFullWidth = 2.3548, kAlong_px = 7;

/// Level lines of Gaussian profile on a sloping ground.
cv::Mat picture_of_lines(const std::vector<std::pair<double, double>>& rows_and_heights) {
  cv::Mat image(kPicture_px, kPicture_px, CV_32F);
  for (int y = 0; y < kPicture_px; ++y)
    for (int x = 0; x < kPicture_px; ++x) {
      double level = 100 + 0.5 * y;
      for (const auto& [row, height] : rows_and_heights)
        level += height * std::exp(-(y - row) * (y - row) / (2 * kProfile_px * kProfile_px));
      image.at<float>(y, x) = static_cast<float>(level);
    }
  return image;
}

SeenLine level_line(double row) {
  SeenLine line{{}, kFullWidth * kProfile_px};
  for (int x = 0; x < kPicture_px; ++x) line.points.emplace_back(x, row);
  return line;
}

double largest_difference(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF); }

/// Of a Gaussian the fitted one reaches to 2.5 deviations: there it is 4 % of its height.
constexpr double kBeyondReach = 0.044;

TEST(WithoutLines, the_ground_is_left) {
  const cv::Mat rest = without_lines(picture_of_lines({{60, 50}}), {level_line(60)}, kAlong_px);
  EXPECT_LT(largest_difference(rest, picture_of_lines({})), 2 * kBeyondReach * 50);
}

/// Two that overlap by half share what is there: neither takes the other's height.
TEST(WithoutLines, lines_that_touch_are_taken_away_together) {
  const cv::Mat rest =
      without_lines(picture_of_lines({{58, 50}, {63, 20}}), {level_line(58), level_line(63)}, kAlong_px);
  EXPECT_LT(largest_difference(rest, picture_of_lines({})), 2 * kBeyondReach * 50);
}

/// A faint one beside a bright one is but a shoulder of it; without that it is a ridge of its own.
TEST(WithoutLines, a_faint_line_beside_a_bright_one_comes_out) {
  const double faint = 59 + 2.4 * kProfile_px;
  const auto stands_out = [&](const cv::Mat& image) {
    const int middle = cvRound(faint), x = kPicture_px / 2;
    return image.at<float>(middle, x) > image.at<float>(middle - 4, x) &&
           image.at<float>(middle, x) > image.at<float>(middle + 4, x);
  };
  const cv::Mat image = picture_of_lines({{59, 60}, {faint, 12}});
  EXPECT_FALSE(stands_out(image));
  EXPECT_TRUE(stands_out(without_lines(image, {level_line(59)}, kAlong_px)));
}

TEST(WithoutLines, nothing_is_taken_away_where_the_image_is_dark) {
  const cv::Mat image = picture_of_lines({{60, -30}});
  EXPECT_EQ(largest_difference(without_lines(image, {level_line(60)}, kAlong_px), image), 0);
}

}  // namespace
}  // namespace mbtfm::cells
