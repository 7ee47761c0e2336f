/// Images whose sums and centroids are known.
#include "samples/drawing/geometry.h"
#include "samples/drawing/render.h"
#include "tests/support/test.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::drawing;

double sum_of(const images::Image& image) {
  double sum = 0;
  for (const float value : image.pixels) sum += value;
  return sum;
}

/// Centroid with pixel centres at (i+½, j+½) pixel sizes.
Vec2 centroid_um(const images::Image& image) {
  Vec2 sum;
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column)
      sum += image.at(column, row) * *image.pixel_size_um * Vec2{column + 0.5, row + 0.5};
  return (1 / sum_of(image)) * sum;
}

TEST(Spot, has_its_centroid_at_its_position_and_all_its_photons) {
  constexpr double kPixel_um = 0.1;
  drawing::Random random(1, drawing::Stream::beads);
  for (int i = 0; i < 50; ++i) {
    const Vec2 position{random.uniform(2, 4), random.uniform(2, 4)};
    images::Image image = drawing::blank_image(64, kPixel_um);
    drawing::add_spot(image, {position, 4000, 0.15});
    const Vec2 offset = (1 / kPixel_um) * (centroid_um(image) - position);
    // cut at 5 sigma, asymmetric by up to a pixel: the tail of 6e-7 of the light times its lever of 7.5 px
    EXPECT_LT(norm(offset), 1e-5);
    // both axes lose at most 6e-7 of the light; pixels are floats
    EXPECT_NEAR(sum_of(image), 4000, 4000 * 2e-6);
  }
}

TEST(Spot, at_the_border_is_cut_and_beyond_it_is_not_seen) {
  images::Image image = drawing::blank_image(64, 0.1);
  drawing::add_spot(image, {{0, 3.2}, 1000, 0.15});
  EXPECT_NEAR(sum_of(image), 500, 0.01) << "half of it lies outside";
  const double before = sum_of(image);
  drawing::add_spot(image, {{-5, 3.2}, 1000, 0.15});
  drawing::add_spot(image, {{3.2, 20}, 1000, 0.15});
  EXPECT_EQ(sum_of(image), before);
}

TEST(BeadImages, move_right_and_down_for_a_positive_displacement) {
  drawing::MicroscopeParameters m;
  m.image_size_px = 64;
  m.haze = 0;
  m.unevenness = 0;
  m.blurred_bead_fraction = 0;
  const Vec2 displacement{0.43, 0.27};
  const Vec2 relaxed{3.0, 3.1};
  const drawing::BeadImages beads = drawing::bead_spots({relaxed}, {relaxed + displacement}, 0, m, 1);
  images::Image before = drawing::blank_image(64, 0.1), after = before;
  for (const drawing::Spot& spot : beads.relaxed) drawing::add_spot(before, spot);
  for (const drawing::Spot& spot : beads.stressed) drawing::add_spot(after, spot);
  const Vec2 shift = centroid_um(after) - centroid_um(before);
  EXPECT_NEAR(shift.x, displacement.x, 1e-6);
  EXPECT_NEAR(shift.y, displacement.y, 1e-6);
}

TEST(BeadImages, lose_the_share_of_beads_asked_for) {
  const std::vector<Vec2> positions(20000, Vec2{1, 1});
  const drawing::BeadImages beads = drawing::bead_spots(positions, positions, 0.1, {}, 1);
  // binomial with p = 0.05: sd = sqrt(n p (1−p)) = 31; four of them
  EXPECT_NEAR(static_cast<double>(beads.relaxed.size()), 19000, 124);
  EXPECT_NEAR(static_cast<double>(beads.stressed.size()), 19000, 124);
}

TEST(Blur, keeps_the_sum_and_the_centroid_and_widens_a_spot) {
  images::Image image = drawing::blank_image(128, 0.1);
  drawing::add_spot(image, {{6.13, 6.77}, 1, 0.3});
  const images::Image wide = drawing::blurred(image, 0.4, 1);
  EXPECT_NEAR(sum_of(wide), 1, 1e-5);
  EXPECT_LT(norm(centroid_um(wide) - Vec2{6.13, 6.77}), 1e-4);
  // variances add: the peak of the wide spot is that of a Gaussian of sigma 0.5, of 5 px
  EXPECT_NEAR(*std::ranges::max_element(wide.pixels), 1 / (2 * std::numbers::pi * 25),
              0.01 / (2 * std::numbers::pi * 25));
}

TEST(Blur, does_not_depend_on_the_number_of_threads) {
  drawing::Random random(2, drawing::Stream::optics);
  const images::Image noise = drawing::smooth_noise(97, 0.1, 0.3, random, 1);
  EXPECT_EQ(drawing::blurred(noise, 0.5, 1).pixels, drawing::blurred(noise, 0.5, 3).pixels);
}

TEST(SmoothNoise, has_mean_zero_and_standard_deviation_one_whatever_its_reach) {
  for (const double sigma_um : {0.3, 0.8}) {
    drawing::Random random(5, drawing::Stream::optics);
    const images::Image noise = drawing::smooth_noise(400, 0.1, sigma_um, random, 2);
    double mean = 0, squares = 0;
    for (const float value : noise.pixels) {
      mean += value / 160000;
      squares += value * value / 160000;
    }
    // independent over an area of 4 pi sigma²; a variance of n such is known to sqrt(2/n), four of those
    const double n = 40 * 40 / (4 * std::numbers::pi * sigma_um * sigma_um);
    EXPECT_NEAR(mean, 0, 4 / std::sqrt(n)) << sigma_um;
    EXPECT_NEAR(squares - mean * mean, 1, 4 * std::sqrt(2 / n)) << sigma_um;
  }
}

TEST(Coverage, is_the_area_of_the_polygon) {
  const Polygon triangle{{1.03, 1.51}, {5.27, 2.11}, {2.49, 5.83}};
  const images::Image image = drawing::coverage_of(triangle, 64, 0.1);
  // exact across, eight lines by pixel down: the midpoint rule misses at most h²/12 · |f''| ~ (0.0125)² of the area
  EXPECT_NEAR(sum_of(image) * 0.01, signed_area_um2(triangle), 1e-3);
  for (const float value : image.pixels) EXPECT_LE(value, 1 + 1e-6);
}

TEST(AdhesionImage, has_half_its_brightness_on_the_ellipse) {
  const Adhesion ellipse = drawing::make_adhesion({3.2, 3.2}, 2.0, 2.0, 0.5);
  images::Image image = drawing::blank_image(64 * 4, 0.1 / 4);
  drawing::add_ellipse(image, ellipse, 1, 0.06, 0);
  // the rim of the dome is 0.8 bright, half of that on the ellipse; a pixel's centre lies up to 0.018 um off it,
  // where a rim of 0.06 um changes by 0.018 / (0.06 sqrt(2 pi)) = 0.12
  for (const Vec2 p : ellipse_corners(ellipse, 24)) {
    const int column = static_cast<int>(p.x / *image.pixel_size_um), row = static_cast<int>(p.y / *image.pixel_size_um);
    EXPECT_NEAR(image.at(column, row), 0.4, 0.12);
  }
}

TEST(AdhesionImage, fades_beyond_its_rim_as_a_step_blurred_by_the_rims_standard_deviation) {
  constexpr double kRim_um = 0.1;
  const Adhesion disc = drawing::make_adhesion({3.2, 3.2}, std::numbers::pi, 1, 0);  // of radius 1
  images::Image image = drawing::blank_image(256, 0.025);
  drawing::add_ellipse(image, disc, 1, kRim_um, 0);
  double light = 0, squares = 0;  // of the fall of light along a row: minus its differences from the rim on
  for (int column = 167; column < 208; ++column) {
    const double beyond_um = (column + 1) * 0.025 - 4.2;
    const double fall = (column == 167 ? 0.5 : 1) * (image.at(column, 128) - image.at(column + 1, 128));
    light += fall;
    squares += fall * beyond_um * beyond_um;
  }
  // half a Gaussian of fall has its variance; the row passes half a pixel beside the centre
  EXPECT_NEAR(std::sqrt(squares / light), kRim_um, 0.02 * kRim_um);
}

TEST(Illumination, falls_from_the_centre_to_the_corners_by_the_unevenness_asked_for) {
  drawing::MicroscopeParameters m;
  m.image_size_px = 100;
  m.haze = 0;
  m.unevenness = 0.2;
  images::Image even = drawing::blank_image(100, m.pixel_size_um);
  for (float& value : even.pixels) value = 1;
  const images::Image light = drawing::photons_of(even, m, 1);
  const double corners = 0.25 * (light.at(0, 0) + light.at(99, 0) + light.at(0, 99) + light.at(99, 99));
  // the brightest place lies a twentieth of the field off its middle: a hundredth of the fall
  EXPECT_NEAR(1 - corners / *std::ranges::max_element(light.pixels), 0.2, 0.005);
}

TEST(Camera, records_offset_gain_and_noise) {
  drawing::MicroscopeParameters m;
  m.image_size_px = 200;
  images::Image photons = drawing::blank_image(200, 0.1);
  for (float& value : photons.pixels) value = 100;
  const images::Image counts = drawing::recorded(photons, m, 1, 0, 1);
  EXPECT_EQ(counts.pixels, drawing::recorded(photons, m, 1, 0, 4).pixels) << "noise depends on the number of threads";
  EXPECT_NE(counts.pixels, drawing::recorded(photons, m, 1, 1, 1).pixels) << "two exposures have the same noise";
  const double n = static_cast<double>(counts.pixels.size());
  const double mean = sum_of(counts) / n;
  double variance = 0;
  for (const float value : counts.pixels) variance += (value - mean) * (value - mean) / n;
  // gain² · photons + read noise² + 1/12 of rounding
  const double expected = m.counts_per_photon * m.counts_per_photon * 100 + m.read_noise * m.read_noise + 1.0 / 12;
  EXPECT_NEAR(mean, m.camera_offset + m.counts_per_photon * 100, 4 * std::sqrt(expected / n));
  EXPECT_NEAR(variance, expected, 4 * expected * std::sqrt(2 / n));
}

}  // namespace
