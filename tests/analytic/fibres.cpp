/// Drawn fibres are found where they were drawn, each as one, of the right width and type.
#include "tests/support/drawn_image.h"
#include "tests/support/find_fibres.h"
#include "tests/support/segmentation_accuracy.h"

namespace mbtfm::cells {
namespace {

using namespace mbtfm::test;

std::vector<Fibre> fibres_of(const images::Image& image, const std::vector<Adhesion>& adhesions = {}) {
  return find_fibres(image, {}, adhesions, 0.1, FibreParameters{});
}

const std::vector<Polyline> kCrossing = {{{4, 6}, {21, 19}}, {{4, 20}, {21, 8}}};
const Polygon kSquare_um{{1, 1}, {24, 1}, {24, 24}, {1, 24}};
images::Image drawn(const std::vector<Polyline>& lines, double height = 300, double width_um = 0.6) {
  images::Image image = even_image(256, 256, 100);
  for (const Polyline& line : lines) draw_line(image, line, height, width_um, 0.1);
  add_noise(image, 10, 1);
  return image;
}

bool is_among(const std::vector<Fibre>& fibres, const Polyline& line, double tolerance_um) {
  return std::ranges::any_of(fibres, [&](const Fibre& f) {
    return covered_share(f.points_um, line, tolerance_um) > 0.95 &&
           covered_share(line, f.points_um, tolerance_um) > 0.9;
  });
}

TEST(Fibres, are_followed_through_a_crossing_and_typed_by_their_adhesions) {
  for (const double noise : {0.0, 10.0, 40.0}) {
    SCOPED_TRACE(noise);
    const DrawnScene scene = drawn_scene(noise, 2);
    const auto fibres = fibres_of(scene.actin_image, scene.adhesions);
    ASSERT_EQ(fibres.size(), 3u);
    EXPECT_EQ(fibres[0].type, FibreType::ventral);
    EXPECT_EQ(fibres[1].type, FibreType::ventral);
    EXPECT_EQ(fibres[2].type, FibreType::dorsal);
    for (const Polyline& line : scene.fibres) EXPECT_TRUE(is_among(fibres, line, 0.1));
    // the filter's grid of 0.2 um widens 0.6 um to sqrt(0.6² + 0.2²·2.355²/12 ·2) = 0.63
    for (const Fibre& f : fibres) EXPECT_NEAR(f.width_um, 0.63, 0.1);
  }
}

TEST(Fibres, of_a_clipped_picture_are_those_of_the_whole_one) {
  images::Image image = drawn(kCrossing);
  for (float& value : image.pixels) value = std::min(value, 190.0f);  // ground 100, crests 400: plateaus of 0.8 um
  const auto fibres = fibres_of(image);
  ASSERT_EQ(fibres.size(), kCrossing.size());
  for (const Polyline& line : kCrossing) EXPECT_TRUE(is_among(fibres, line, 0.1));
  for (const Fibre& f : fibres) EXPECT_NEAR(f.width_um, 0.63, 0.1);  // as of whole ones
}

TEST(Fibres, are_not_made_of_a_saturated_blot) {
  images::Image image = drawn(kCrossing);
  for (int k = 0; k < 256 * 256; ++k) {  // 7 um wide, above the fibres, with a soft rim
    const double outside_px = std::hypot(k % 256 - 125, k / 256 - 45) - 35,
                 blot = 600 / (1 + std::exp(outside_px / 1.2));
    image.pixels[k] = static_cast<float>(std::min(image.pixels[k] + blot, 450.0));
  }
  const auto fibres = fibres_of(image);
  EXPECT_EQ(fibres.size(), kCrossing.size());
  for (const Polyline& line : kCrossing) EXPECT_TRUE(is_among(fibres, line, 0.1));
}

TEST(Fibres, half_to_twice_as_wide_as_typical_are_found_with_their_width) {
  for (const double width_um : {0.3, 0.6, 1.2}) {
    SCOPED_TRACE(width_um);
    const Polyline line{{4, 6}, {21, 19}};
    const auto fibres = fibres_of(drawn({line}, 300, width_um));
    ASSERT_EQ(fibres.size(), 1u);
    EXPECT_TRUE(is_among(fibres, line, 0.1));  // half a pixel of the filter's grid
    // the grid's width of 0.2 um, as above; the profile reaches out 0.9 um and takes a wide fibre's flank for its side
    EXPECT_NEAR(fibres[0].width_um, std::sqrt(width_um * width_um + 0.037), width_um > 1 ? 0.25 : 0.1);
  }
}

TEST(Fibres, that_bend_are_followed) {
  Polyline arc;
  for (double a = 0.3; a < 2.2; a += 0.05) arc.push_back({12.8 + 9 * std::cos(a), 6 + 9 * std::sin(a)});
  const auto fibres = fibres_of(drawn({arc}));
  ASSERT_EQ(fibres.size(), 1u);
  EXPECT_TRUE(is_among(fibres, arc, 0.1));
}

TEST(Fibres, with_a_gap_are_one) {
  const auto fibres = fibres_of(drawn({{{4, 12}, {12, 12.5}}, {{13, 12.56}, {22, 13.1}}}));
  ASSERT_EQ(fibres.size(), 1u);
  // a square end blurred by the filter over 0.7 um falls to half at its place, to 0.4 of the line up to 0.2 um further
  EXPECT_NEAR(length_um(fibres[0].points_um), 18, 0.8);
}

TEST(Fibres, side_by_side_stay_two) {
  EXPECT_EQ(fibres_of(drawn({{{4, 12}, {21, 12.6}}, {{4, 13.2}, {21, 13.8}}})).size(), 2u);
}

/// At 20° the brighter one hides the other for w/sin 20°, three widths.
TEST(Fibres, that_cross_at_20_degrees_go_straight_on) {
  const Vec2 middle{12.8, 12.8}, half{std::cos(0.349), std::sin(0.349)};
  const Polyline faint{{3.8, 12.8}, {21.8, 12.8}}, bright{middle - 9 * half, middle + 9 * half};
  images::Image image = drawn({faint}, 150);
  draw_line(image, bright, 450, 0.6, 0.1);
  const auto fibres = fibres_of(image);
  ASSERT_EQ(fibres.size(), 2u);
  constexpr double kHalfWidth_um = 0.3;  // the brighter one's skirt draws the other
  for (const Polyline& line : {faint, bright}) EXPECT_TRUE(is_among(fibres, line, kHalfWidth_um));
}

TEST(Fibres, without_adhesions_are_arcs) {
  const auto fibres = fibres_of(drawn_scene(10, 3).actin_image);
  EXPECT_EQ(fibres.size(), 3u);
  for (const Fibre& f : fibres) {
    EXPECT_EQ(f.type, FibreType::arc);
    EXPECT_EQ(f.type_reason, "start far from any adhesion; end far from any adhesion");
  }
}

TEST(Fibres, say_why_they_have_their_type) {
  const Polyline line{{5, 12}, {20, 12}};
  const auto fibres = fibres_of(drawn({line}), {ellipse(3, {4.9, 12}, 1.6, 0.6, 0), ellipse(8, {12, 12}, 1, 0.6, 0)});
  ASSERT_EQ(fibres.size(), 1u);
  EXPECT_EQ(fibres[0].type, FibreType::dorsal);
  EXPECT_TRUE(has_words(fibres[0].type_reason, "held 0.0 um from adhesion 3", "; over adhesion 8"));
  EXPECT_GT(fibres[0].type_confidence, 0.95);
}

TEST(Fibres, are_less_surely_dorsal_if_another_one_goes_on_or_the_free_end_lies_no_deeper) {
  const std::vector<Adhesion> adhesions = {ellipse(1, {2.9, 12}, 0.8, 0.6, 0), ellipse(2, {12, 20}, 0.8, 0.6, 0)};
  const auto confidence = [&](const std::vector<Polyline>& lines) {
    const auto fibres = find_fibres(drawn(lines, 60), kSquare_um, adhesions, 0.1, FibreParameters{});
    return fibres.size() == lines.size() && fibres[0].type == FibreType::dorsal ? fibres[0].type_confidence : -9;
  };
  EXPECT_GT(confidence({{{3, 12}, {9, 12}}}), 0.95);
  EXPECT_LT(std::abs(confidence({{{3, 12}, {9.5, 12}}, {{14, 12}, {20, 12}}})), 0.9);
  EXPECT_LT(std::abs(confidence({{{12, 20}, {6, 20}}})), 0.9);
}

TEST(Fibres, that_nothing_holds_are_arcs_if_they_bulge_towards_the_edge_and_else_of_no_type) {
  const Adhesion far = ellipse(1, {4, 21}, 0.8, 0.6, 0);
  for (const bool bulges : {true, false}) {
    SCOPED_TRACE(bulges);
    Polyline line;
    for (double s = -5; s <= 5; s += 0.5) line.push_back({12.5 + s, 7 + (bulges ? 0.05 * s * s : 0)});
    const auto fibres = find_fibres(drawn({line}), kSquare_um, {far}, 0.1, FibreParameters{});
    ASSERT_EQ(fibres.size(), 1u);
    EXPECT_EQ(fibres[0].type, FibreType::arc);
    EXPECT_EQ(fibres[0].type_confidence < 0.5, !bulges) << fibres[0].type_reason;
  }
}

TEST(Fibres, that_stop_at_the_limit_of_reach_are_decided_by_their_direction) {
  // a cell's edge at x = 22 um, the adhesion 1.4 um ahead of the end: 0.7 of the way counts, about the reach of 1 um
  const Polygon cell{{1, 1}, {22, 1}, {22, 24}, {1, 24}};
  const auto end_of = [&](const Polyline& line, const Adhesion& adhesion) {
    const auto fibres = find_fibres(drawn({line}), cell, {adhesion}, 0.1, FibreParameters{});
    return fibres.size() == 1 ? fibres[0] : Fibre{};
  };
  const Fibre across = end_of({{6, 12}, {18.5, 12}}, ellipse(1, {20.3, 12}, 0.8, 0.6, 0));
  const Fibre along = end_of({{18.5, 19}, {18.5, 8}}, ellipse(1, {18.5, 6.2}, 0.8, 0.6, 1.57));
  EXPECT_EQ(across.type, FibreType::dorsal) << across.type_reason;
  EXPECT_EQ(along.type, FibreType::arc) << along.type_reason;
  for (const Fibre* f : {&across, &along}) EXPECT_LT(f->type_confidence, 0.95);
}

/// The targets at ordinary quality, on one cell of each kind; means over seeds come from segmentation_accuracy.
TEST(Fibres, of_simulated_cells_are_found) {
  for (const std::string scenario : {"u2os", "crowded"}) {
    SCOPED_TRACE(scenario);
    const SimulatedCell cell = simulated_cell(scenario, "ordinary", 1);
    Cell found = cell.truth;
    found.fibres = find_fibres(cell.actin.image, found.outline_um, found.adhesions, 0.1, FibreParameters{});
    Accuracy accuracy = accuracy_of(cell.truth, found);
    EXPECT_GE(accuracy["fibre centreline F1 (0.25 um)"], 0.90);
    EXPECT_GE(accuracy["fibres in one piece"], 0.85);
    EXPECT_GE(accuracy["fibre type right"], 0.90);
  }
}

TEST(Fibres, the_edge_of_a_cell_is_its_outline_and_no_fibre) {
  images::Image image = even_image(256, 256, 100);
  const Adhesion cell = ellipse(1, {12.8, 12.8}, 20, 16, 0.3);
  draw_ellipse(image, cell, 300, 0.15, 0.1);
  add_noise(image, 10, 4);
  const Polygon outline = find_cells(image, {}, 0.1, OutlineParameters{}).cells.at(0).outer_um;
  ASSERT_GE(outline.size(), 8u);
  // an error of half a pixel all around (57 um) would be 2.8 um² of 251
  EXPECT_GT(intersection_over_union(outline, ellipse_corners(cell, 200)), 0.97);
  for (const Fibre& f : find_fibres(image, outline, {}, 0.1, FibreParameters{})) EXPECT_LT(f.confidence, 0.5);
}

}  // namespace
}  // namespace mbtfm::cells
