/// Images that show no adhesion give none, and say why.
#include "segment/cells/adhesions.h"
#include "pipeline/contract/errors.h"
#include "segment/cells/segment_cell.h"
#include "tests/support/drawn_image.h"
#include "tests/support/hard_case.h"

namespace mbtfm::cells {
namespace {

using namespace mbtfm::test;

TEST(Adhesions, names_a_pixel_that_is_no_number) {
  images::Image image = even_image(20, 20, 1);
  image.at(3, 4) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(find_adhesions(image, 0.1, AdhesionParameters{}), InvalidData);
}

TEST(Adhesions, takes_saturated_adhesions) {
  DrawnScene s = drawn_scene(10, 7);
  for (float& value : s.adhesion_image.pixels) value = std::min(value, 400.0f);
  const auto found = find_adhesions(s.adhesion_image, s.kPixel_um, AdhesionParameters{});
  const int n_matched = score_adhesions(s.adhesions, found).n_matched;
  EXPECT_EQ(n_matched, 5);
  test::came_out(std::to_string(n_matched) + " of " + std::to_string(s.adhesions.size()));
}

/// The error of a segmentation that finds nothing.
std::string finding(const std::optional<images::Image>& adhesion, const std::optional<images::Image>& actin) {
  SegmentParameters p;
  p.pixel_size_um = 0.1;
  const auto channel = [](const std::optional<images::Image>& image) {
    return image ? std::optional(images::Channel{"image", *image}) : std::nullopt;
  };
  const auto error = test::caught<InputError>([&] { segment_cell(channel(adhesion), channel(actin), p); });
  return error ? error->found : "a cell";
}

images::Image noisy(float level, double noise, std::uint64_t seed) {
  images::Image image = even_image(400, 300, level);
  add_noise(image, noise, seed);
  return image;
}

TEST(Emptiness, a_constant_image_is_called_so) {
  EXPECT_EQ(emptiness_of(even_image(20, 20, 100)), "every pixel is 100");
  EXPECT_EQ(finding(even_image(200, 150, 0), std::nullopt), "every pixel is 0");
  test::came_out("every pixel is 0");
  EXPECT_EQ(finding(std::nullopt, even_image(200, 150, 65535)), "every pixel is 65535");
}

TEST(Emptiness, a_saturated_image_is_called_so) {
  DrawnScene s = drawn_scene(10, 1);
  for (float& value : s.adhesion_image.pixels) value = std::min(value, 190.0f);  // into the cytosol
  const std::string found = finding(s.adhesion_image, s.actin_image);
  EXPECT_TRUE(has_words(found, "% of the pixels at 190", "saturated"));
  test::came_out(found);
}

TEST(Emptiness, an_inverted_image_is_called_so) {
  const DrawnScene s = drawn_scene(10, 1);
  const auto inverted = [](images::Image image) {
    const float most = *std::ranges::max_element(image.pixels);
    for (float& pixel : image.pixels) pixel = most - pixel;
    return image;
  };
  const std::string spots = finding(inverted(s.adhesion_image), s.actin_image);
  EXPECT_TRUE(has_words(spots, "dark spots on a brighter ground"));
  const std::string cell = finding(s.adhesion_image, inverted(s.actin_image));
  EXPECT_EQ(cell, "one that is darker than its surroundings");
  test::came_out(spots + "; " + cell);
}

TEST(Emptiness, bright_beads_are_not_called_inverted) {
  images::Image beads = even_image(400, 300, 200);
  for (int i = 0; i < 400; ++i) {
    const Vec2 place{std::fmod(0.618034 * i, 1.0) * 40, (i + 0.5) / 400 * 30};
    draw_ellipse(beads, ellipse(i + 1, place, 0.4, 0.4, 0), 1000, 0.15, 0.1);
  }
  add_noise(beads, 15, 7);
  const std::string found = finding(std::nullopt, beads);
  EXPECT_TRUE(has_words(found, "no cell"));
  test::came_out(found);
}

TEST(Emptiness, noise_alone_is_called_so_and_says_by_how_much) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    const std::string found = finding(noisy(200, 15, seed), std::nullopt);
    EXPECT_TRUE(has_words(found, "nothing above the noise, the brightest spot 4."));
    EXPECT_TRUE(has_words(finding(std::nullopt, noisy(200, 15, seed)), "no cell"));
    test::came_out(found);
  }
}

TEST(Emptiness, spots_of_the_wrong_size_are_called_so) {
  images::Image image = noisy(100, 5, 4);
  draw_ellipse(image, ellipse(1, {20, 15}, 0.8, 0.5, 0), 500, 0.15, 0.1);
  AdhesionParameters p;
  p.adhesion_smallest_um2 = 1;
  EXPECT_TRUE(find_adhesions(image, 0.1, p).empty());
  test::came_out(why_no_adhesions(image, 0.1, p));
  EXPECT_EQ(why_no_adhesions(image, 0.1, p),
            "of 1 spots none is larger than adhesion_smallest_um2 = 1 and smaller than adhesion_largest_um2 = 25");
}

TEST(Emptiness, a_picture_is_not_called_empty) {
  const DrawnScene s = drawn_scene(0, 1);  // few grey levels: an even ground, an even cell
  EXPECT_EQ(emptiness_of(s.adhesion_image), "");
  EXPECT_EQ(emptiness_of(s.actin_image), "");
}

TEST(Emptiness, a_sheet_of_cells_is_called_so) {
  images::Image image = even_image(900, 900, 100);
  for (int i = 0; i < 16; ++i)
    draw_ellipse(image, ellipse(1, {45.0 * (i % 4) + 22, 45.0 * (i / 4) + 22}, 52, 47, 0.3 * i), 100, 0.2, 0.2);
  for (float& value : image.pixels) value = std::min(value, 300.0f);
  add_noise(image, 5, 1);
  SegmentParameters p;
  p.pixel_size_um = 0.2;
  p.outline.outline_largest_um2 = 20000;
  const InputError error = test::thrown<InputError>([&] {
    segment_cell(std::nullopt, images::Channel{"sheet", image}, p);
  });
  EXPECT_EQ(error.expected, "single cells");
  test::came_out("expected single cells, found " + error.found);
}

TEST(Adhesions, of_a_texture_without_ellipses_are_valid) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    // noise summed over 7 x 7 pixels twice: clouds of all shapes, which no ellipse fits
    images::Image image = noisy(0, 100, seed);
    for (int round = 0; round < 2; ++round) {
      images::Image sums = image;
      for (int row = 0; row < image.height; ++row)
        for (int column = 0; column < image.width; ++column) {
          float sum = 0;
          for (int dy = -3; dy <= 3; ++dy)
            for (int dx = -3; dx <= 3; ++dx)
              sum += image.at(std::clamp(column + dx, 0, image.width - 1), std::clamp(row + dy, 0, image.height - 1));
          sums.at(column, row) = sum / 7;
        }
      image = sums;
    }
    add_noise(image, 1, seed + 10);
    const auto found = find_adhesions(image, 0.1, {});
    EXPECT_NO_THROW(check(found));
    for (const Adhesion& a : found) EXPECT_LE(a.area_um2, AdhesionParameters{}.adhesion_largest_um2);
  }
}

TEST(Adhesions, are_not_the_bright_body_of_a_cell) {
  images::Image image = noisy(100, 5, 5);
  draw_ellipse(image, ellipse(1, {20, 15}, 24, 16, 0.5), 1000, 0.15, 0.1);
  EXPECT_TRUE(find_adhesions(image, 0.1, {}).empty());
  test::came_out(why_no_adhesions(image, 0.1, {}));
  EXPECT_EQ(why_no_adhesions(image, 0.1, {}),
            "bright areas and edges, but no spot higher than the steps of its background");
}

}  // namespace
}  // namespace mbtfm::cells
