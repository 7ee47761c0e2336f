/// Outlines lie on the edges of drawn cells.
#include "pipeline/contract/errors.h"
#include "segment/cells/ellipse.h"
#include "tests/support/drawn_image.h"
#include "tests/support/real_adhesions.h"

namespace mbtfm::cells {
namespace {

using namespace mbtfm::test;

constexpr double kPixel_um = 0.1;
const Adhesion kDisc = ellipse(1, {20, 20}, 24, 18, 0.4);

images::Image drawn_disc(double noise, std::uint64_t seed) {
  images::Image image = even_image(400, 400, 100);
  draw_ellipse(image, kDisc, 200, 0.15, kPixel_um);
  add_noise(image, noise, seed);
  return image;
}

/// Mean distance outside of an ellipse.
double mean_offset_um(const Polygon& ring, const Adhesion& ellipse) {
  double sum = 0;
  for (const Vec2 p : ring) sum += distance_to_ellipse_um(ellipse, p);
  return sum / static_cast<double>(ring.size());
}

TEST(Outline, lies_on_a_blurred_step) {
  for (const double noise : {2.0, 10.0, 40.0}) {
    SCOPED_TRACE(noise);
    const Polygon outline = find_cells(drawn_disc(noise, 1), {}, kPixel_um, {}).cells.at(0).outer_um;
    ASSERT_GE(outline.size(), 8u);
    EXPECT_NEAR(mean_offset_um(outline, kDisc), 0, 0.05);
    EXPECT_GT(intersection_over_union(outline, ellipse_corners(kDisc, 200)), 0.98);
  }
}

TEST(Outline, lies_in_the_middle_of_a_cortex_that_the_microscope_cannot_resolve) {
  for (const double width_um : {0.35, 0.6}) {
    SCOPED_TRACE(width_um);
    images::Image image = drawn_disc(5, 2);
    Polyline edge = ellipse_corners(kDisc, 100);
    edge.push_back(edge.front());
    draw_line(image, edge, 300, width_um, kPixel_um);
    const Polygon outline = find_cells(image, {}, kPixel_um, {}).cells.at(0).outer_um;
    EXPECT_NEAR(mean_offset_um(outline, kDisc), 0, 0.1);  // its half-height is 0.2 and 0.3 um further out
    EXPECT_GT(intersection_over_union(outline, ellipse_corners(kDisc, 200)), 0.98);
  }
}

TEST(Outline, lies_on_the_edge_of_a_cell_and_not_of_its_haze) {
  // a tall cell out of focus: a blur of 2 um, and a skirt of a third of the light that reaches three times as far
  for (const double noise : {2.0, 20.0}) {
    SCOPED_TRACE(noise);
    images::Image image = even_image(600, 600, 100);
    const Adhesion cell = ellipse(1, {30, 30}, 36, 26, 0.4);
    draw_ellipse(image, cell, 400, 2, kPixel_um);
    draw_ellipse(image, cell, 200, 6, kPixel_um);
    draw_line(image, {{20, 28}, {40, 31}}, 400, 0.6, kPixel_um);
    add_noise(image, noise, 6);
    const Polygon outline = find_cells(image, {}, kPixel_um, {}).cells.at(0).outer_um;
    // the step of the mask's grid, and what the median of a curved cell lacks of its plateau
    EXPECT_NEAR(mean_offset_um(outline, cell), 0, 0.5);
    EXPECT_GT(intersection_over_union(outline, ellipse_corners(cell, 200)), 0.93);
  }
}

TEST(Outline, keeps_a_dim_lamella_whose_edge_is_sharp) {
  images::Image image = even_image(500, 500, 100);
  const Adhesion lamella = ellipse(1, {25, 25}, 30, 24, 0.4), body = ellipse(2, {25, 25}, 26, 20, 0.4);
  draw_ellipse(image, lamella, 100, 0.15, kPixel_um);
  draw_ellipse(image, body, 200, 0.5, kPixel_um);  // three times as bright
  add_noise(image, 5, 7);
  const Polygon outline = find_cells(image, {}, kPixel_um, {}).cells.at(0).outer_um;
  EXPECT_GT(intersection_over_union(outline, ellipse_corners(lamella, 200)), 0.95);  // 0.75 is the body
}

TEST(Outline, of_a_real_doublet_is_its_authors_outline) {
  if (!std::filesystem::exists(kDoublet)) GTEST_SKIP() << "the shared data are absent: " << kDoublet;
  EXPECT_GE(doublet_overlap(), 0.93);
}

TEST(Outline, contains_every_adhesion_it_owns) {
  const DrawnScene scene = drawn_scene(10, 5);
  std::vector<Adhesion> adhesions = scene.adhesions;
  adhesions.push_back(ellipse(6, {12.8, 23.6}, 1, 0.5, 0));  // 0.8 um outside
  const auto cells = find_cells(scene.actin_image, adhesions, scene.kPixel_um, {}).cells;
  ASSERT_EQ(cells.size(), 1u);
  EXPECT_EQ(inside(cells[0], adhesions).size(), adhesions.size());
}

TEST(Outline, says_how_far_each_adhesion_lies_beyond_what_the_image_shows) {
  images::Image image = even_image(400, 400, 100);
  const Adhesion disc = ellipse(1, {20, 20}, 20, 20, 0);
  draw_ellipse(image, disc, 200, 0.15, kPixel_um);
  add_noise(image, 5, 2);
  std::vector<Adhesion> adhesions;
  const std::vector<double> beyond_um = {-3, 0.6, 1.5, 4};
  for (const double beyond : beyond_um)
    adhesions.push_back(ellipse(1, disc.position_um + Vec2{0, disc.major_axis_um / 2 + beyond}, 0.6, 0.3, 0));
  const CellsInImage found = find_cells(image, adhesions, kPixel_um, {});
  ASSERT_EQ(found.beyond_um.size(), adhesions.size());
  EXPECT_EQ(found.beyond_um[0], 0);
  for (std::size_t i = 1; i < adhesions.size(); ++i)
    EXPECT_NEAR(found.beyond_um[i], beyond_um[i], 0.35);  // a pixel of the masks' grid
}

TEST(Outline, the_share_of_one_that_lies_beyond_others_is_that_of_rings_and_of_what_is_apart) {
  const auto disc = [](Vec2 middle_um, double radius_um) {
    CellOutline cell;
    cell.outer_um = ellipse_corners(ellipse(1, middle_um, 2 * radius_um, 2 * radius_um, 0), 400);
    return cell;
  };
  const CellOutline one = disc({20, 20}, 12);
  EXPECT_EQ(share_beyond(one, {one}, 0.01), 0);
  EXPECT_EQ(share_beyond(one, {disc({60, 60}, 5)}, 1), 1);
  EXPECT_EQ(share_beyond(one, {disc({20, 20}, 11.5)}, 1), 0);
  EXPECT_NEAR(share_beyond(one, {disc({20, 20}, 9)}, 1), 1 - 100.0 / 144, 0.01);
  CellOutline ring = one;
  ring.holes_um = {disc({20, 20}, 6).outer_um};
  EXPECT_NEAR(share_beyond(ring, {disc({20, 20}, 9)}, 1), 44.0 / 108, 0.01);
}

TEST(Outline, a_gap_as_dark_as_outside_is_a_hole_and_what_lies_in_it_is_not_in_the_cell) {
  images::Image image = drawn_disc(5, 3);
  const Adhesion gap = ellipse(1, {21, 19}, 6, 4, 1);
  draw_ellipse(image, gap, -200, 0.15, kPixel_um);
  const auto cells = find_cells(image, {}, kPixel_um, {}).cells;
  ASSERT_EQ(cells.size(), 1u);
  ASSERT_EQ(cells[0].holes_um.size(), 1u);
  EXPECT_GT(intersection_over_union(cells[0].holes_um[0], ellipse_corners(gap, 100)), 0.9);
  EXPECT_NEAR(cells[0].area_um2, kDisc.area_um2 - gap.area_um2, 0.02 * kDisc.area_um2);
  const auto kept = inside(cells[0], {ellipse(1, {21, 19}, 1, 0.5, 0), ellipse(2, {13, 19}, 1, 0.5, 0)});
  ASSERT_EQ(kept.size(), 1u);
  EXPECT_EQ(kept[0].position_um.x, 13);
}

TEST(Outline, a_dim_middle_is_no_hole) {
  images::Image image = drawn_disc(5, 4);
  draw_ellipse(image, ellipse(1, {21, 19}, 6, 4, 1), -100, 0.15, kPixel_um);  // half as bright as the cell
  const auto cells = find_cells(image, {}, kPixel_um, {}).cells;
  ASSERT_EQ(cells.size(), 1u);
  EXPECT_TRUE(cells[0].holes_um.empty());
}

TEST(Outline, strips_that_registration_leaves_are_no_ground) {
  for (const float value : {0.f, 100.f, 1000.f}) {
    images::Image image = drawn_disc(10, 6);
    for (int j = 0; j < image.height; ++j)
      for (int i = 0; i < image.width; ++i)
        if (i < 23 || j < 31) image.at(i, j) = value;
    const auto cells = find_cells(image, {}, kPixel_um, {}).cells;
    ASSERT_EQ(cells.size(), 1u) << value;
    EXPECT_GT(intersection_over_union(cells[0].outer_um, ellipse_corners(kDisc, 200)), 0.98) << value;
    EXPECT_FALSE(cells[0].is_cut_by_border()) << value;
  }
}

/// Two discs of 24 and 20 um, 4 um apart, and a bridge of `neck_um` between them.
struct TouchingDiscs {
  Adhesion large = ellipse(1, {16, 20}, 24, 24, 0), small = ellipse(2, {42, 20}, 20, 20, 0);
  Vec2 neck_um{30, 20};
  images::Image image = even_image(600, 400, 100);
};
TouchingDiscs touching_discs(double neck_um) {
  TouchingDiscs d;
  for (const Adhesion& part : {d.large, d.small, ellipse(3, d.neck_um, 24, neck_um, 0)}) {
    images::Image alone = even_image(600, 400, 100);
    draw_ellipse(alone, part, 200, 0.15, kPixel_um);
    for (std::size_t k = 0; k < alone.pixels.size(); ++k)
      d.image.pixels[k] = std::max(d.image.pixels[k], alone.pixels[k]);
  }
  add_noise(d.image, 10, 7);
  return d;
}

TEST(Outline, cells_that_touch_are_cut_apart_at_the_neck_between_them) {
  for (const double neck_um : {3.0, 6.0}) {  // of 20 um, the width of the smaller one
    SCOPED_TRACE(neck_um);
    const TouchingDiscs d = touching_discs(neck_um);
    const auto cells = find_cells(d.image, {}, kPixel_um, {}).cells;
    ASSERT_EQ(cells.size(), 2u);
    // each has half of the bridge
    EXPECT_GT(intersection_over_union(cells[0].outer_um, ellipse_corners(d.large, 200)), 0.95);
    EXPECT_GT(intersection_over_union(cells[1].outer_um, ellipse_corners(d.small, 200)), 0.95);
    for (const CellOutline& cell : cells) {
      ASSERT_TRUE(cell.neck);
      EXPECT_NEAR(cell.neck->width_um, neck_um, 0.8);    // a pixel of the masks' grid on each side
      EXPECT_LT(norm(cell.neck->at_um - d.neck_um), 2);  // half of the bridge: it is as wide everywhere
    }
  }
}

TEST(Outline, a_wide_waist_and_a_long_cell_are_one_cell) {
  EXPECT_EQ(find_cells(touching_discs(15).image, {}, kPixel_um, {}).cells.size(), 1u);
  OutlineParameters never;
  never.outline_neck = 0;
  EXPECT_EQ(find_cells(touching_discs(3).image, {}, kPixel_um, never).cells.size(), 1u);
  images::Image image = even_image(600, 400, 100);
  draw_ellipse(image, ellipse(1, {30, 20}, 52, 6, 0.1), 200, 0.15, kPixel_um);
  add_noise(image, 10, 8);
  const auto cells = find_cells(image, {}, kPixel_um, {}).cells;
  ASSERT_EQ(cells.size(), 1u);
  EXPECT_FALSE(cells[0].neck);
}

TEST(Outline, what_hangs_on_a_cell_by_a_thread_and_is_small_is_a_part_of_it) {
  images::Image image = even_image(600, 400, 100);
  draw_ellipse(image, ellipse(1, {20, 20}, 24, 24, 0), 200, 0.15, kPixel_um);
  draw_ellipse(image, ellipse(2, {40, 20}, 7, 7, 0), 200, 0.15, kPixel_um);  // a twelfth of its area
  draw_line(image, {{30, 20}, {38, 20}}, 200, 1.5, kPixel_um);
  add_noise(image, 10, 9);
  OutlineParameters small;
  small.outline_smallest_um2 = 20;
  const auto cells = find_cells(image, {}, kPixel_um, small).cells;
  ASSERT_EQ(cells.size(), 1u);
  EXPECT_TRUE(contains(cells[0].outer_um, {40, 20}));
}

TEST(Outline, several_cells_come_by_area_and_the_border_cuts_one) {
  images::Image image = even_image(600, 400, 100);
  const Adhesion small = ellipse(1, {12, 12}, 14, 10, 0.2), large = ellipse(2, {40, 22}, 24, 20, 1),
                 cut = ellipse(3, {8, 38}, 12, 12, 0);
  for (const Adhesion& a : {small, large, cut}) draw_ellipse(image, a, 200, 0.15, kPixel_um);
  add_noise(image, 10, 5);
  const auto cells = find_cells(image, {}, kPixel_um, {}).cells;
  ASSERT_EQ(cells.size(), 3u);
  EXPECT_GT(intersection_over_union(cells[0].outer_um, ellipse_corners(large, 200)), 0.98);
  EXPECT_GT(intersection_over_union(cells[1].outer_um, ellipse_corners(small, 200)), 0.97);
  EXPECT_FALSE(cells[0].is_cut_by_border());
  EXPECT_FALSE(cells[1].is_cut_by_border());
  EXPECT_TRUE(cells[2].is_cut_by_border());
  for (const Vec2 p : cells[2].outer_um) EXPECT_LE(p.y, 40);
}

TEST(Outline, the_cell_asked_for_is_the_one_segmented) {
  const DrawnScene s = drawn_scene(10, 6);
  images::Image adhesion = even_image(520, 256, 100), actin = adhesion;
  for (int row = 0; row < 256; ++row)
    for (int column = 0; column < 256; ++column) {
      adhesion.at(column, row) = s.adhesion_image.at(column, row);
      actin.at(column, row) = s.actin_image.at(column, row);
    }
  draw_ellipse(adhesion, ellipse(1, {39, 13}, 1.6, 0.6, 0.3), 500, 0.13, s.kPixel_um);
  draw_ellipse(actin, ellipse(1, {39, 13}, 12, 12, 0), 200, 0.15, s.kPixel_um);
  SegmentParameters p;
  p.pixel_size_um = s.kPixel_um;
  const auto segmented = [&](int cell) {
    p.cell = cell;
    return segment_cells(images::Channel{"adhesion", adhesion}, images::Channel{"actin", actin}, p);
  };
  ASSERT_EQ(segmented(1).size(), 1u);
  EXPECT_EQ(segmented(1)[0].n_cells, 2);
  EXPECT_EQ(segmented(1)[0].cell.adhesions.size(), 5u);
  ASSERT_EQ(segmented(2)[0].cell.adhesions.size(), 1u);
  EXPECT_NEAR(segmented(2)[0].cell.adhesions[0].position_um.x, 39, 0.1);
  EXPECT_EQ(segmented(0).size(), 2u);
  EXPECT_THROW(segmented(3), InputError);
}

}  // namespace
}  // namespace mbtfm::cells
