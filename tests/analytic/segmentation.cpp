/// Drawn fibres are found where they were drawn.
#include <gtest/gtest.h>

#include "segment/segment_cell.h"
#include "tests/support/drawn_image.h"

namespace mbtfm::segment {
namespace {

using namespace mbtfm::test;

TEST(Segmentation, fibres_are_followed_through_a_crossing_and_typed_by_their_adhesions) {
  for (const double noise : {0.0, 10.0, 40.0}) {
    SCOPED_TRACE(noise);
    const DrawnScene scene = drawn_scene(noise, 2);
    const Polygon anywhere;
    const auto fibres = find_fibres(scene.actin_image, anywhere, scene.adhesions, scene.kPixel_um, FibreParameters{});
    ASSERT_EQ(fibres.size(), 3u);
    EXPECT_EQ(fibres[0].type, FibreType::ventral);
    EXPECT_EQ(fibres[1].type, FibreType::ventral);
    EXPECT_EQ(fibres[2].type, FibreType::dorsal);
    for (const Polyline& drawn : scene.fibres) {
      const bool is_followed = std::any_of(fibres.begin(), fibres.end(), [&](const Fibre& f) {
        // half a pixel of the filter's grid (0.2 um)
        return covered_share(f.points_um, drawn, 0.1) > 0.95 && covered_share(drawn, f.points_um, 0.1) > 0.9;
      });
      EXPECT_TRUE(is_followed);
    }
    // the filter's grid of 0.2 um widens 0.6 um to sqrt(0.6² + 0.2²·2.355²/12 ·2) = 0.63
    for (const Fibre& f : fibres) EXPECT_NEAR(f.width_um, 0.63, 0.1);
  }
}

TEST(Segmentation, a_fibre_without_adhesions_is_an_arc) {
  const DrawnScene scene = drawn_scene(10, 3);
  for (const Fibre& f : find_fibres(scene.actin_image, {}, {}, scene.kPixel_um, FibreParameters{})) {
    EXPECT_EQ(f.type, FibreType::arc);
    EXPECT_FALSE(f.start_adhesion_id || f.end_adhesion_id);
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

}  // namespace
}  // namespace mbtfm::segment
