#include "segment/images/channels.h"

#include "pipeline/numerics/order_statistics.h"
#include "tests/support/bead_pair.h"
#include "tests/support/findings.h"

namespace mbtfm {
namespace {

using images::Image;
using test::fires;

/// Rows of both kinds from two pictures of the same beads, drawn half a phase to the right and to the left: nothing is
/// interpolated. Half of the noise's variance is the light's.
Image scanned(double phase_px, int width, int n_beads, std::uint64_t seed, double noise = 20) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0, width);
  std::normal_distribution<float> normal(0, static_cast<float>(noise));
  Image pictures[2];
  for (Image& picture : pictures) {
    picture.width = picture.height = width;
    picture.pixels.assign(static_cast<std::size_t>(width) * width, 100);
  }
  for (int k = 0; k < n_beads; ++k) {
    const double x = place(random), y = place(random);
    for (const int odd : {0, 1}) test::add_bead(pictures[odd], {x + (odd ? -0.5 : 0.5) * phase_px, y}, 500, 1.4);
  }
  Image result = pictures[0];
  for (int j = 0; j < width; ++j)
    for (int i = 0; i < width; ++i) result.at(i, j) = pictures[j % 2].at(i, j) + normal(random);
  return result;
}

TEST(ScanPhase, the_shift_of_every_second_row_is_found_within_its_error_and_taken_off) {
  for (const double phase_px : {0.3, 1.0, -2.4, 6.0}) {
    for (const std::uint64_t seed : {1, 2}) {
      const Image image = scanned(phase_px, 256, 400, seed);
      const auto found = images::scan_phase(image);
      ASSERT_TRUE(found) << phase_px << ", seed " << seed;
      EXPECT_LT(found->sigma_px, 0.02);
      EXPECT_NEAR(found->px, phase_px, 4 * found->sigma_px) << seed;  // chance: one in 16 000
      EXPECT_FALSE(images::scan_phase(images::without_scan_phase(image, phase_px))) << phase_px << ", seed " << seed;
    }
  }
}

TEST(ScanPhase, sound_pictures_have_none_whatever_they_show) {
  for (const std::uint64_t seed : {3, 4, 5}) {
    EXPECT_FALSE(images::scan_phase(scanned(0, 256, 400, seed))) << seed;
    EXPECT_FALSE(images::scan_phase(scanned(0, 128, 8, seed))) << seed;
    EXPECT_FALSE(images::scan_phase(scanned(0, 256, 0, seed))) << seed;
    // a camera whose noise is alike in pixels across a corner, over beads that are hardly seen
    Image camera = scanned(0, 256, 400, seed, 0);
    std::mt19937_64 random(seed);
    std::normal_distribution<float> normal(0, 400);
    Image noise = camera;
    for (float& value : noise.pixels) value = normal(random);
    for (int j = 0; j + 1 < 256; ++j)
      for (int i = 0; i < 255; ++i) camera.at(i, j) += noise.at(i, j) + (j % 2 ? noise.at(i + 1, j + 1) : 0.0f);
    EXPECT_FALSE(images::scan_phase(camera)) << seed;
  }
}

TEST(ScanPhase, it_is_named_with_its_number_where_it_matters) {
  images::Channel shifted{"beads.tif", scanned(1, 256, 400, 6)}, sound{"beads.tif", scanned(0, 256, 400, 6)};
  const auto found = images::take_scan_phase_off(shifted);
  EXPECT_TRUE(fires("scan-phase", found));
  EXPECT_NEAR(found->number.value_or(0), 1, 0.05);  // to some hundredths of a pixel
  EXPECT_FALSE(fires("scan-phase", images::take_scan_phase_off(sound)));
}

/// A phase that both pictures have costs beads where it is left.
TEST(ScanPhase, beads_are_followed_as_without_it) {
  constexpr double kPixel_um = 0.1;
  const auto peaks = test::ring_of_adhesions(256, 3);
  const test::BeadPair sound = test::draw_bead_pair(peaks, {.width = 256, .n_beads = 1300});
  const auto followed = [&](double phase_px, bool is_taken_off) {
    images::Channel relaxed{"r", images::without_scan_phase(sound.relaxed, -phase_px)},
        stressed{"s", images::without_scan_phase(sound.stressed, -phase_px)};
    if (is_taken_off) {
      images::take_scan_phase_off(relaxed);
      images::take_scan_phase_off(stressed);
    }
    return beads::track_beads(relaxed.image, stressed.image, kPixel_um, test::in_relaxed_frame());
  };
  const auto error_px = [&](const beads::Tracking& tracking) {
    std::vector<double> sizes;
    for (const Bead& bead : tracking.field) {
      const Vec2 place = (1 / kPixel_um) * bead.position_um - Vec2{0.5, 0.5};
      if (bead.flag.empty())
        sizes.push_back(norm((1 / kPixel_um) * bead.displacement_um - test::displacement(peaks, place)));
    }
    return numerics::quantile(std::move(sizes), 0.5);
  };
  const beads::Tracking without = followed(0, false), off = followed(1.5, true), left = followed(1.5, false);
  // rows that are moved twice by a kernel of eight pixels lose a tenth of the noise's correlation at most
  EXPECT_LT(error_px(off), 1.1 * error_px(without));
  EXPECT_GT(off.n_good, 0.99 * without.n_good);
  EXPECT_LT(left.n_good, 0.9 * without.n_good);
}

}  // namespace
}  // namespace mbtfm
