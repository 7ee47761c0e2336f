/// What must not change the adhesions and the outline, or change them in a known way.
#include <opencv2/core/utility.hpp>

#include "segment/cells/adhesions.h"
#include "segment/cells/outline.h"
#include "tests/support/drawn_image.h"
#include "tests/support/segmentation_accuracy.h"

namespace mbtfm::images {
namespace {

using namespace mbtfm::test;

constexpr double kPixel_um = DrawnScene::kPixel_um, kSide_um = 25.6;

struct Found {
  std::vector<Adhesion> adhesions;
  Polygon outline_um;
};

Found found_in(const Image& adhesion, const Image& actin) {
  const auto adhesions = cells::find_adhesions(adhesion, kPixel_um, {});
  return {adhesions, cells::find_cells(actin, adhesions, kPixel_um, {}).cells.at(0).outer_um};
}

/// `b` is `a` after `move`, a turn by `turn_rad` or a reflection.
template <class Move>
void expect_moved(const Found& a, const Found& b, Move move) {
  std::vector<Adhesion> expected = a.adhesions;
  for (Adhesion& adhesion : expected) {
    const Vec2 tip = adhesion.position_um + Vec2{std::cos(adhesion.angle_rad), std::sin(adhesion.angle_rad)};
    const Vec2 along = move(tip) - move(adhesion.position_um);
    adhesion.position_um = move(adhesion.position_um);
    adhesion.angle_rad = std::atan2(along.y, along.x);
  }
  const AdhesionScore score = score_adhesions(expected, b.adhesions);
  EXPECT_EQ(score.n_matched, score.n_true);
  EXPECT_EQ(score.n_found, score.n_true);
  // the background is taken on a grid of five pixels that does not turn with the image: it moves the level by a share
  // of the noise
  EXPECT_LT(score.centre_error_um, 0.01);
  EXPECT_NEAR(score.area_ratio, 1, 0.02);
  EXPECT_LT(score.angle_error_rad, 0.03);
  Polygon outline = a.outline_um;
  for (Vec2& p : outline) p = move(p);
  EXPECT_GT(intersection_over_union(outline, b.outline_um), 0.99);
}

/// A speck of dye and hot pixels, far brighter than any adhesion, set no level for them.
TEST(Adhesions, do_not_depend_on_what_few_pixels_have) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    const DrawnScene s = drawn_scene(20, seed);
    Image spoilt = s.adhesion_image;
    draw_ellipse(spoilt, ellipse(9, {23, 2}, 1.5, 1.5, 0), 30 * 500, 0.13, kPixel_um);
    for (int k = 0; k < 10; ++k) spoilt.at(20 * k + 30, 250) = 65535;
    const auto alone = cells::find_adhesions(s.adhesion_image, kPixel_um, {});
    auto found = cells::find_adhesions(spoilt, kPixel_um, {});
    std::erase_if(found, [](const Adhesion& a) {
      return a.position_um.y > 24 || norm(a.position_um - Vec2{23, 2}) < 3;
    });
    ASSERT_EQ(found.size(), alone.size());
    for (std::size_t i = 0; i < alone.size(); ++i) {
      // the camera's noise has no part in it: what is left is the blur that all adhesions share
      EXPECT_LT(norm(found[i].position_um - alone[i].position_um), 0.01);
      EXPECT_NEAR(found[i].area_um2, alone[i].area_um2, 0.05 * alone[i].area_um2);
    }
  }
}

TEST(Adhesions, turn_and_mirror_with_the_image) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    const DrawnScene s = drawn_scene(20, seed);
    const Found upright = found_in(s.adhesion_image, s.actin_image);
    const auto expect_same = [&](auto map, auto move) {
      expect_moved(upright, found_in(mapped(s.adhesion_image, map), mapped(s.actin_image, map)), move);
    };
    expect_same([](int c, int r) { return std::pair(255 - r, c); }, [](Vec2 p) { return Vec2{kSide_um - p.y, p.x}; });
    expect_same([](int c, int r) { return std::pair(255 - c, 255 - r); },
                [](Vec2 p) {
                  return Vec2{kSide_um - p.x, kSide_um - p.y};
                });
    expect_same([](int c, int r) { return std::pair(255 - c, r); }, [](Vec2 p) { return Vec2{kSide_um - p.x, p.y}; });
    expect_same([](int c, int r) { return std::pair(r, c); }, [](Vec2 p) { return Vec2{p.y, p.x}; });
  }
}

TEST(Adhesions, move_with_the_image_by_whole_pixels) {
  const DrawnScene s = drawn_scene(20, 4);
  const Found before = found_in(s.adhesion_image, s.actin_image);
  for (const int by : {1, 6, 13}) {
    SCOPED_TRACE(by);
    const auto shift = [by](int c, int r) { return std::pair((c + by) % 256, r); };
    expect_moved(before, found_in(mapped(s.adhesion_image, shift), mapped(s.actin_image, shift)), [by](Vec2 p) {
      return Vec2{p.x + by * kPixel_um, p.y};
    });
  }
}

TEST(Adhesions, do_not_depend_on_gain_and_offset) {
  const DrawnScene s = drawn_scene(20, 5);
  Image adhesion = s.adhesion_image, actin = s.actin_image;
  for (Image* image : {&adhesion, &actin})
    for (float& value : image->pixels) value = 4 * value + 1024;  // powers of two: exact but for the last bits
  const Found a = found_in(s.adhesion_image, s.actin_image), b = found_in(adhesion, actin);
  expect_moved(a, b, [](Vec2 p) { return p; });
  for (std::size_t i = 0; i < a.adhesions.size(); ++i)
    EXPECT_NEAR(a.adhesions[i].area_um2, b.adhesions[i].area_um2, 1e-3 * a.adhesions[i].area_um2);
}

TEST(Adhesions, are_the_same_to_the_last_bit_for_any_number_of_threads) {
  const DrawnScene s = drawn_scene(20, 6);
  const int usual = cv::getNumThreads();
  std::vector<Found> found;
  for (const int threads : {1, 2, 4}) {
    cv::setNumThreads(threads);
    found.push_back(found_in(s.adhesion_image, s.actin_image));
  }
  cv::setNumThreads(usual);
  for (const Found& other : found) {
    ASSERT_EQ(other.adhesions.size(), found[0].adhesions.size());
    for (std::size_t i = 0; i < other.adhesions.size(); ++i) {
      const Adhesion &a = other.adhesions[i], &b = found[0].adhesions[i];
      EXPECT_TRUE(a.position_um == b.position_um && a.area_um2 == b.area_um2 && a.angle_rad == b.angle_rad &&
                  a.mean_intensity == b.mean_intensity && a.probability == b.probability);
    }
    EXPECT_EQ(other.outline_um, found[0].outline_um);
  }
}

/// With vesicles, haze and streaks among them, 0.1 to a square micrometre, and without. The seeds are not those of the
/// regression.
TEST(Adhesions, are_as_many_as_their_probabilities_state) {
  for (const double clutter_per_um2 : {0.0, 0.1}) {
    SCOPED_TRACE(clutter_per_um2);
    const SimulatedCell cell = simulated_cell("crowded", "ordinary", 821, 1024, clutter_per_um2);
    const auto found = cells::find_adhesions(cell.adhesion.image, *cell.adhesion.image.pixel_size_um, {});
    double stated = 0, variance = 0, n_true = 0;
    std::map<bool, std::vector<double>> probabilities;
    for (const Adhesion& a : found) {
      const double p = a.probability.value();
      const bool is_true = is_true_adhesion(a, cell.truth.adhesions);
      stated += p, variance += p * (1 - p), n_true += is_true;
      probabilities[is_true].push_back(p);
    }
    // three standard deviations of chance, and the twentieth by which the regression may be off
    EXPECT_NEAR(stated, n_true, 3 * std::sqrt(variance) + 0.05 * static_cast<double>(found.size()));
    if (clutter_per_um2 == 0) continue;
    ASSERT_GT(probabilities[false].size(), 10u);
    EXPECT_GT(median(probabilities[true]), median(probabilities[false]) + 0.1);
  }
}

}  // namespace
}  // namespace mbtfm::images
