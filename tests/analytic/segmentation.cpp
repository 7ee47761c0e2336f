/// Drawn fibres are found where they were drawn.
#include <gtest/gtest.h>

#include "segment/cells/segment_cell.h"
#include "tests/support/drawn_image.h"

namespace mbtfm::cells {
namespace {

using namespace mbtfm::test;

TEST(Segmentation, the_edge_of_a_cell_is_its_outline_and_no_fibre) {
  images::Image image = even_image(256, 256, 100);
  const Adhesion cell = ellipse(1, {12.8, 12.8}, 20, 16, 0.3);
  draw_ellipse(image, cell, 300, 0.15, 0.1);
  add_noise(image, 10, 4);
  const Polygon outline = find_outline(image, {}, 0.1, OutlineParameters{});
  ASSERT_GE(outline.size(), 8u);
  // an error of half a pixel all around (57 um) would be 2.8 um² of 251
  EXPECT_GT(intersection_over_union(outline, ellipse_corners(cell, 200)), 0.97);
  for (const Fibre& f : find_fibres(image, outline, {}, 0.1, FibreParameters{})) EXPECT_LT(f.confidence, 0.5);
}

}  // namespace
}  // namespace mbtfm::cells
