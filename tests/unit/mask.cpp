#include "segment/cells/mask.h"
#include "pipeline/contract/errors.h"
#include "segment/cells/ellipse.h"
#include "segment/cells/segment_cell.h"
#include "tests/support/drawn_image.h"

namespace mbtfm::cells {
namespace {

constexpr int kSide = 256;
constexpr double kPixel_um = 0.1;
constexpr Field kMaskField{kSide, kSide, kPixel_um};

template <class IsIn>
void paint(images::Image& image, float value, const IsIn& is_in) {
  for (int j = 0; j < image.height; ++j)
    for (int i = 0; i < image.width; ++i)
      if (is_in(i + 0.5, j + 0.5)) image.at(i, j) = value;
}

images::Image empty() { return test::even_image(kSide, kSide, 0); }

void paint_disc(images::Image& image, float value, Vec2 centre_px, double radius_px) {
  paint(image, value, [&](double x, double y) { return norm(Vec2{x, y} - centre_px) < radius_px; });
}

LabelMask mask(const images::Image& image) { return mask_of(image, "mask.tif"); }

int n_pixels(const LabelMask& m) {
  return static_cast<int>(m.labels.size() - static_cast<std::size_t>(std::ranges::count(m.labels, 0)));
}

std::string refusal_of(const auto& body) {
  const auto error = test::caught<InputError>(body);
  return error ? error->where + ": " + error->expected + "; " + error->found : "no error";
}

std::string hint_of(const auto& body) {
  const auto error = test::caught<InputError>([&] { body(); });
  return error ? error->hint : "no error";
}

TEST(Mask, an_outline_goes_round_its_pixels_without_bias) {
  for (const double radius_px : {60.0, 83.7, 110.2}) {
    images::Image image = empty();
    paint_disc(image, 255, {128.3, 127.1}, radius_px);
    const LabelMask m = mask(image);
    const auto cells = mask_outlines(m, 1, kMaskField, {});
    ASSERT_EQ(cells.size(), 1u);
    const double area_um2 = n_pixels(m) * kPixel_um * kPixel_um;
    EXPECT_NEAR(cells[0].area_um2, area_um2, 1e-9);
    EXPECT_NEAR(signed_area_um2(cells[0].outer_um), area_um2, 0.01 * area_um2);
    Vec2 mean;
    for (const Vec2 p : cells[0].outer_um) mean += (1.0 / static_cast<double>(cells[0].outer_um.size())) * p;
    EXPECT_NEAR(norm(mean - kPixel_um * Vec2{128.3, 127.1}), 0, kPixel_um);
  }
}

TEST(Mask, grey_rims_of_a_drawn_one_are_rims_and_labels_are_labels) {
  images::Image image = empty();
  for (int k = 0; k < 4; ++k) paint_disc(image, static_cast<float>(60 * k + 60), {128, 128}, 60.0 - 0.5 * k);
  paint_disc(image, 255, {128, 128}, 58);
  const LabelMask drawn = mask(image);
  EXPECT_TRUE(drawn.is_binary);
  EXPECT_NEAR(n_pixels(drawn), std::numbers::pi * 59 * 59, 0.02 * 59 * 59);
  images::Image ring = empty();
  paint_disc(ring, 1, {128, 128}, 60);
  paint_disc(ring, 0, {128, 128}, 57);
  EXPECT_TRUE(
      has_words(hint_of([&] { mask_outlines(mask(ring), 1, kMaskField, {.outline_smallest_um2 = 1}); }), "fill it"));
  paint_disc(ring, 0, {128, 128}, 60);
  paint_disc(ring, 1, {128, 128}, 75);
  paint_disc(ring, 0, {128, 128}, 55);
  EXPECT_EQ(mask_outlines(mask(ring), 1, kMaskField, {.outline_smallest_um2 = 1}).front().holes_um.size(), 1u)
      << "wider than a line: an area, as an adhesive pattern may be";
  for (const float largest : {2.f, 255.f}) {
    images::Image labels = empty();
    paint_disc(labels, 1, {60, 60}, 20);
    paint_disc(labels, largest, {160, 160}, 20);
    EXPECT_FALSE(mask(labels).is_binary) << largest;
  }
}

TEST(Mask, without_a_zero_the_value_of_the_corners_is_the_background) {
  images::Image image = empty();
  paint_disc(image, 1, {128, 128}, 60);
  const LabelMask plain = mask(image);
  for (float& value : image.pixels) value = value == 0 ? 2 : 1;  // as ilastik counts
  EXPECT_EQ(n_pixels(mask(image)), n_pixels(plain));
  EXPECT_TRUE(mask(image).is_binary);
  const images::Image even = test::even_image(kSide, kSide, 255);
  EXPECT_TRUE(has_words(hint_of([&] { mask_outlines(mask(even), 1, kMaskField, {}); }), "transparency"));
  image.taken = "the maximum of its 3 slices was taken (mask_z = max)";
  EXPECT_EQ(mask(image).taken, "the maximum of its 3 slices was taken");
}

TEST(Mask, a_ring_around_n_pixels_has_an_area_of_half_a_pixel_less) {
  images::Image image = empty();
  paint(image, 1, [](double x, double y) { return (x < 20 && y < 9) || (x > 4 && x < 7 && y < 30); });
  const auto rings = rings_px(mask(image), 1);
  ASSERT_EQ(rings.size(), 1u);
  EXPECT_NEAR(signed_area_um2(rings[0]), n_pixels(mask(image)) - 0.5, 1e-9);
}

TEST(Mask, pixels_that_touch_by_a_corner_are_parts_and_rings_of_their_own) {
  images::Image image = empty();
  for (const int k : {10, 11, 12}) image.at(k, k) = 1;
  const LabelMask parts = with_parts_labelled(mask(image));
  EXPECT_EQ(*std::ranges::max_element(parts.labels), 3);
  EXPECT_EQ(rings_px(mask(image), 1).size(), 3u);
}

TEST(Mask, holes_are_kept_and_pinholes_are_not) {
  images::Image image = empty();
  paint_disc(image, 255, {128, 128}, 100);
  paint_disc(image, 0, {110, 128}, 25);  // 19.6 um²
  image.at(160, 128) = 0;
  const auto cell = mask_outlines(mask(image), 1, kMaskField, {}).front();
  ASSERT_EQ(cell.holes_um.size(), 1u);
  EXPECT_NEAR(std::abs(signed_area_um2(cell.holes_um[0])), std::numbers::pi * 6.25, 0.2);
  EXPECT_NEAR(cell.area_um2, std::numbers::pi * (100 - 6.25), 1);
}

TEST(Mask, of_a_binary_mask_the_largest_part_is_the_cell_and_the_others_follow) {
  images::Image image = empty();
  paint_disc(image, 255, {60, 60}, 45);
  paint_disc(image, 255, {180, 180}, 60);
  paint_disc(image, 255, {200, 40}, 5);  // a speck
  const auto area = [&](int cell) { return mask_outlines(mask(image), cell, kMaskField, {}).front().area_um2; };
  EXPECT_NEAR(area(1), std::numbers::pi * 36, 1);
  EXPECT_NEAR(area(2), std::numbers::pi * 20.25, 1);
  EXPECT_EQ(mask_outlines(mask(image), 0, kMaskField, {}).size(), 2u);
  EXPECT_EQ(refusal_of([&] { area(3); }), "mask.tif: cell 3; 2 in all");
}

TEST(Mask, of_a_label_image_the_parameter_names_the_label) {
  images::Image image = empty();
  paint_disc(image, 7, {60, 60}, 45);
  paint_disc(image, 1200, {150, 150}, 60);
  const auto area = [&](int cell) { return mask_outlines(mask(image), cell, kMaskField, {}).front().area_um2; };
  EXPECT_NEAR(area(7), std::numbers::pi * 20.25, 1);
  EXPECT_NEAR(area(1200), std::numbers::pi * 36, 1);
  EXPECT_EQ(refusal_of([&] { area(1); }), "mask.tif: a cell with label 1; labels 7, 1200");
}

TEST(Mask, a_cell_at_the_border_is_cut_there_and_nowhere_else) {
  images::Image image = empty();
  paint_disc(image, 1, {20, 128}, 70);
  const auto cell = mask_outlines(mask(image), 1, kMaskField, {}).front();
  ASSERT_TRUE(cell.is_cut_by_border());
  ASSERT_EQ(cell.is_cut.size(), cell.outer_um.size());
  double cut_um = 0;
  for (std::size_t i = 0; i < cell.is_cut.size(); ++i) {
    if (!cell.is_cut[i]) continue;
    const Vec2 a = cell.outer_um[i], b = cell.outer_um[(i + 1) % cell.outer_um.size()];
    EXPECT_EQ(a.x, 0);
    EXPECT_EQ(b.x, 0);
    cut_um += norm(b - a);
  }
  EXPECT_NEAR(cut_um, 2 * std::sqrt(49 - 4.0), 2 * kPixel_um);
}

TEST(Mask, an_adhesion_has_the_moments_of_its_pixels) {
  images::Image image = empty();
  const Adhesion truth = test::ellipse(1, {12, 9}, 4, 2, 0.7);
  paint(image, 3, [&](double x, double y) { return contains(ellipse_corners(truth, 200), kPixel_um * Vec2{x, y}); });
  paint_disc(image, 9, {50, 200}, 6);
  const LabelMask m = mask(image);
  const auto found = mask_adhesions(m, std::nullopt, kMaskField);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].adhesion_id, 1);
  EXPECT_EQ(found[0].origin, AdhesionOrigin::image);
  EXPECT_NEAR(found[0].area_um2, std::ranges::count(m.labels, 3) * kPixel_um * kPixel_um, 1e-9);
  EXPECT_NEAR(norm(found[0].position_um - truth.position_um), 0, 0.01);
  EXPECT_NEAR(found[0].major_axis_um, 4, 0.06);
  EXPECT_NEAR(found[0].minor_axis_um, 2, 0.04);
  EXPECT_NEAR(found[0].angle_rad, 0.7, 0.02);
}

TEST(Mask, each_part_of_a_binary_mask_is_an_adhesion_and_each_label_of_a_label_image) {
  images::Image image = empty();
  paint_disc(image, 255, {50, 50}, 6);
  paint_disc(image, 255, {90, 50}, 6);
  EXPECT_EQ(mask_adhesions(mask(image), std::nullopt, kMaskField).size(), 2u);
  paint_disc(image, 4, {150, 50}, 6);
  EXPECT_EQ(mask_adhesions(mask(image), std::nullopt, kMaskField).size(), 2u);  // 255 lies in two pieces
}

TEST(Mask, an_adhesions_intensity_is_its_height_above_its_surroundings) {
  images::Image image = empty(), light = test::even_image(kSide, kSide, 100);
  paint_disc(image, 1, {80, 80}, 8);
  paint_disc(light, 400, {80, 80}, 8);
  const auto found = mask_adhesions(mask(image), images::Channel{"paxillin.tif", light}, kMaskField);
  EXPECT_NEAR(found.front().mean_intensity, 300, 1e-4);
}

TEST(Mask, binning_the_images_leaves_the_mask_as_fine_as_it_is) {
  images::Image image = empty();
  paint_disc(image, 1, {101, 97}, 50);
  LabelMask m = mask(image);
  const auto fine = mask_outlines(m, 1, kMaskField, {}).front();
  m.binning = 2;
  const Field coarse{kSide / 2, kSide / 2, 2 * kPixel_um};
  const auto binned = mask_outlines(m, 1, coarse, {}).front();
  EXPECT_EQ(binned.outer_um, fine.outer_um);
  EXPECT_NEAR(mask_adhesions(m, std::nullopt, coarse)[0].area_um2, fine.area_um2, 1e-9);
}

TEST(Mask, what_is_no_mask_is_named) {
  images::Image image = empty();
  EXPECT_EQ(refusal_of([&] { mask(image); }), "mask.tif: pixels above 0 for what the mask covers; 0 everywhere");
  image.at(3, 5) = 0.25f;
  EXPECT_EQ(refusal_of([&] { mask(image); }), "mask.tif: pixel 3, 5: a whole number, 0 for the background; 0.25");
  image.at(3, 5) = -1;
  EXPECT_EQ(refusal_of([&] { mask(image); }), "mask.tif: pixel 3, 5: a whole number, 0 for the background; -1");
  image.at(3, 5) = 1;
  image.is_lossy = true;
  EXPECT_EQ(refusal_of([&] { mask(image); }), "mask.tif: a mask as TIFF or PNG; a JPEG, which changes labels and rims");
  images::Image inverted = test::even_image(kSide, kSide, 255);
  paint_disc(inverted, 0, {128, 128}, 80);
  EXPECT_EQ(refusal_of([&] { mask_outlines(mask(inverted), 1, kMaskField, {}); }),
            "mask.tif: a cell on a background of 0; values above 0 in all four corners of the image");
}

TEST(Mask, of_a_cell_or_a_pattern_is_not_taken_for_adhesions) {
  images::Image image = empty();
  paint_disc(image, 255, {40, 40}, 5);
  paint_disc(image, 255, {150, 150}, 60);
  const auto measure = [&] { mask_adhesions(mask(image), std::nullopt, kMaskField); };
  EXPECT_EQ(refusal_of(measure), "mask.tif: part at (15, 15) um: an adhesion, of at most 100 um²; 113 um²");
  EXPECT_TRUE(has_words(hint_of(measure), "segment.adhesions = pattern", "outline_mask"));
}

TEST(Mask, of_a_pattern_may_reach_the_corners_but_not_go_all_round) {
  images::Image lines = empty();
  paint(lines, 255, [](double x, double) { return x < 50 || x > 200; });
  EXPECT_NO_THROW(require_upright_pattern(mask(lines)));
  images::Image inverted = test::even_image(kSide, kSide, 255);
  paint_disc(inverted, 0, {128, 128}, 60);
  const auto look = [&] { require_upright_pattern(mask(inverted)); };
  EXPECT_EQ(refusal_of(look),
            "mask.tif: a pattern on a background of 0; values above 0 all along the border of the image");
  EXPECT_TRUE(has_words(hint_of(look), "inverted"));
}

TEST(Mask, of_a_pattern_lies_beneath_the_cell_by_the_share_of_the_parts_that_it_touches) {
  images::Image image = empty();
  paint(image, 255, [](double x, double y) { return x > 60 && x < 160 && y > 60 && y < 160; });  // the cell's pattern
  paint_disc(image, 255, {210, 210}, 20);                                                        // another cell's
  const LabelMask pattern = mask(image);
  const auto share = [&](double x_um) {
    const CellOutline cell{.outer_um = {{x_um, 5}, {x_um + 12, 5}, {x_um + 12, 17}, {x_um, 17}}, .area_um2 = 144};
    return pattern_at(pattern, cell, kMaskField).beneath;
  };
  // by columns of points 0.2 um apart, over 10 um
  EXPECT_NEAR(share(5).value(), 1, 0.02);
  EXPECT_NEAR(share(13).value(), 0.3, 0.02);
  EXPECT_FALSE(share(-20));
  images::Image whole = test::even_image(kSide, kSide, 255);  // cut by the image
  const CellOutline cell{.outer_um = {{5, 5}, {17, 5}, {17, 17}, {5, 17}}, .area_um2 = 144};
  EXPECT_FALSE(pattern_at(mask(whole), cell, kMaskField).beneath);
}

TEST(Mask, a_mask_of_another_size_is_refused_with_both_sizes) {
  images::Image image = test::even_image(250, 256, 0);
  paint_disc(image, 1, {100, 100}, 60);
  const std::string sizes = "mask.tif: a mask of the size of the images, 256 x 256 pixels; 250 x 256 pixels";
  EXPECT_EQ(refusal_of([&] { mask_outlines(mask(image), 1, kMaskField, {}); }), sizes);
  EXPECT_EQ(refusal_of([&] { mask_adhesions(mask(image), std::nullopt, kMaskField); }), sizes);
}

TEST(Mask, a_cell_is_segmented_by_masks_and_selections_count_more) {
  const test::DrawnScene scene = test::drawn_scene(10, 1);
  const images::Channel adhesion{"paxillin.tif", scene.adhesion_image}, actin{"actin.tif", scene.actin_image};
  images::Image outline = empty(), spots = empty();
  paint_disc(outline, 255, {128, 128}, 105);
  for (const Adhesion& a : scene.adhesions)
    paint(spots, static_cast<float>(a.adhesion_id), [&](double x, double y) {
      return distance_to_ellipse_um(a, kPixel_um * Vec2{x, y}) < 0;
    });
  SegmentParameters p;
  p.pixel_size_um = kPixel_um;
  HandDrawn drawn;
  drawn.outline_mask = std::make_shared<const LabelMask>(mask(outline));
  drawn.adhesion_mask = std::make_shared<const LabelMask>(mask(spots));
  const Segmentation s = segment_cell(adhesion, actin, p, drawn);
  EXPECT_NEAR(s.area_um2, std::numbers::pi * 10.5 * 10.5, 1);
  ASSERT_EQ(s.cell.adhesions.size(), scene.adhesions.size());
  for (std::size_t i = 0; i < scene.adhesions.size(); ++i) {
    EXPECT_NEAR(norm(s.cell.adhesions[i].position_um - scene.adhesions[i].position_um), 0, 0.05);
    EXPECT_NEAR(*s.cell.adhesions[i].edge_distance_um,
                distance_to_boundary_um(s.cell.outline_um, s.cell.adhesions[i].position_um), 1e-12);
  }
  EXPECT_TRUE(s.unused.empty());
  EXPECT_FALSE(segment_cell(std::nullopt, actin, p, drawn).second) << "a mask shows the adhesions";
  rois::Roi square;
  square.name = "cell";
  square.points_px = {{30, 30}, {226, 30}, {226, 226}, {30, 226}};
  drawn.outline = RoiSet{"outline.roi", {square}};
  const Segmentation by_hand = segment_cell(adhesion, actin, p, drawn);
  EXPECT_NEAR(by_hand.area_um2, 19.6 * 19.6, 1e-6);
  ASSERT_EQ(by_hand.unused.size(), 1u);
  EXPECT_EQ(by_hand.unused[0], "mask.tif is not used: the outline of outline.roi counts.");
}

}  // namespace
}  // namespace mbtfm::cells
