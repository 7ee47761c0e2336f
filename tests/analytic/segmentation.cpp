/// Drawn adhesions, fibres and outlines are found where they were drawn.
#include <gtest/gtest.h>

#include "segment/ellipse.h"
#include "segment/segment_cell.h"
#include "tests/support/drawn_image.h"

namespace mbtfm::segment {
namespace {

using namespace mbtfm::test;

TEST(Segmentation, the_pixels_of_an_ellipse_measure_as_that_ellipse) {
  // 60 x 24 px: its rim crosses ~140 pixels, each wrong by up to half: area to sqrt(140)/2/1131 = 0.5 %
  const double pixel_um = 0.1;
  const Adhesion drawn = ellipse(1, {5.03, 4.96}, 6, 2.4, 0.5);
  std::vector<CoveredPixel> pixels;
  for (int row = 0; row < 100; ++row)
    for (int column = 0; column < 100; ++column)
      if (distance_to_ellipse_um(drawn, centre_of_pixel_um(column, row, pixel_um)) < 0)
        pixels.push_back({column, row, 1, 7});
  const Adhesion measured = measure_ellipse(pixels, pixel_um);
  EXPECT_DOUBLE_EQ(measured.area_um2, static_cast<double>(pixels.size()) * pixel_um * pixel_um);
  EXPECT_NEAR(measured.area_um2 / drawn.area_um2, 1, 0.01);
  EXPECT_NEAR(measured.position_um.x, drawn.position_um.x, 0.01);
  EXPECT_NEAR(measured.position_um.y, drawn.position_um.y, 0.01);
  EXPECT_NEAR(measured.major_axis_um / drawn.major_axis_um, 1, 0.01);
  EXPECT_NEAR(measured.minor_axis_um / drawn.minor_axis_um, 1, 0.01);
  EXPECT_NEAR(measured.angle_rad, drawn.angle_rad, 0.01);
  EXPECT_DOUBLE_EQ(measured.mean_intensity, 7);
}

TEST(Segmentation, a_single_pixel_measures_as_a_disc_of_its_area) {
  const Adhesion measured = measure_ellipse({{3, 4, 1, 1}}, 0.2);
  EXPECT_NEAR(measured.area_um2, 0.04, 1e-15);
  EXPECT_NEAR(measured.position_um.x, 0.7, 1e-15);
  EXPECT_NEAR(measured.major_axis_um, measured.minor_axis_um, 1e-12);
}

TEST(Segmentation, a_blurred_ellipse_in_noise_is_found_with_its_area_place_and_angle) {
  for (const double noise : {0.0, 10.0, 30.0}) {
    SCOPED_TRACE(noise);
    const DrawnScene scene = drawn_scene(noise, 1);
    const auto found = find_adhesions(scene.adhesion_image, scene.kPixel_um, AdhesionParameters{});
    const AdhesionScore score = score_adhesions(scene.adhesions, found);
    EXPECT_EQ(score.n_matched, 5);
    EXPECT_EQ(score.n_found, 5);
    // 45 % of the height of a step blurred by sqrt(0.13² + 0.08²) um lies 0.019 um outside the edge: 9 % of 1.6 x 0.6
    // um
    EXPECT_NEAR(score.area_ratio, 1.09, 0.1);
    EXPECT_LT(score.centre_error_um, 0.05);  // half a pixel
    EXPECT_LT(score.angle_error_rad, 0.1);
  }
}

TEST(Segmentation, the_edge_of_a_cell_is_its_outline_and_no_fibre) {
  Image image = even_image(256, 256, 100);
  const Adhesion cell = ellipse(1, {12.8, 12.8}, 20, 16, 0.3);
  draw_ellipse(image, cell, 300, 0.15, 0.1);
  add_noise(image, 10, 4);
  const Polygon outline = find_outline(image, {}, 0.1, OutlineParameters{});
  ASSERT_GE(outline.size(), 8u);
  // an error of half a pixel all around (57 um) would be 2.8 um² of 251
  EXPECT_GT(intersection_over_union(outline, ellipse_polygon(cell, 200)), 0.97);
  EXPECT_TRUE(find_fibres(image, outline, {}, 0.1, FibreParameters{}).empty());
}

TEST(Segmentation, the_outline_contains_every_adhesion_it_owns) {
  const DrawnScene scene = drawn_scene(10, 5);
  const Adhesion beyond = ellipse(6, {12.8, 23.6}, 1, 0.5, 0);  // 0.8 um outside
  std::vector<Adhesion> adhesions = scene.adhesions;
  adhesions.push_back(beyond);
  const Polygon outline = find_outline(scene.actin_image, adhesions, scene.kPixel_um, OutlineParameters{});
  EXPECT_EQ(inside(outline, adhesions).size(), adhesions.size());
}

}  // namespace
}  // namespace mbtfm::segment
