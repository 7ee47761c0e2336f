#include "segment/cells/hand_drawn.h"
#include "pipeline/contract/errors.h"
#include "segment/cells/cell_rois.h"
#include "segment/cells/segment_cell.h"
#include "tests/support/drawn_image.h"

namespace mbtfm::cells {
namespace {

constexpr Field kField{256, 256, 0.1};

rois::Roi area(std::vector<Vec2> points_px, const std::string& name = "area") {
  rois::Roi roi;
  roi.name = name;
  roi.points_px = std::move(points_px);
  return roi;
}

rois::Roi line(std::vector<Vec2> points_px, const std::string& name = "line", int group = 0) {
  rois::Roi roi = area(std::move(points_px), name);
  roi.shape = rois::RoiShape::polyline;
  roi.group = group;
  return roi;
}

rois::Roi oval(Vec2 corner_px, Vec2 size_px) {
  rois::Roi roi;
  roi.shape = rois::RoiShape::oval;
  roi.name = "oval";
  roi.corner_px = corner_px;
  roi.size_px = size_px;
  return roi;
}

RoiSet set_of(std::vector<rois::Roi> rois) { return {"rois.zip", std::move(rois)}; }

constexpr double kAnchor_um2 = 1;
HeldFibres held(const RoiSet& set, const std::vector<Adhesion>& adhesions, const CellOutline& cell = {}) {
  return hold_fibres(drawn_lines(set, std::nullopt, kField, {}), adhesions, cell, {}, kAnchor_um2);
}

TEST(HandDrawn, a_polygon_has_the_ellipse_of_its_second_moments) {
  // a rectangle of sides a, b has the moments a²/12, b²/12: axes' ratio a/b, turned with it
  for (const double angle : {0.0, 0.3, 1.2, -0.9}) {
    const Vec2 e{std::cos(angle), std::sin(angle)}, n{-e.y, e.x}, centre{40, 70};
    const Polygon box = {centre + 3.0 * e + 1.0 * n, centre - 3.0 * e + 1.0 * n, centre - 3.0 * e - 1.0 * n,
                         centre + 3.0 * e - 1.0 * n};
    const Adhesion a = ellipse_of_polygon(box);
    EXPECT_NEAR(a.area_um2, 12, 1e-9);
    EXPECT_NEAR(norm(a.position_um - centre), 0, 1e-9);
    EXPECT_NEAR(a.major_axis_um / a.minor_axis_um, 3, 1e-9);
    EXPECT_NEAR(std::numbers::pi / 4 * a.major_axis_um * a.minor_axis_um, 12, 1e-9);
    EXPECT_NEAR(std::sin(a.angle_rad - angle), 0, 1e-9);
  }
}

TEST(HandDrawn, a_polygon_around_an_ellipse_has_this_ellipse) {
  const Adhesion truth = test::ellipse(1, {12, 7}, 2.4, 0.9, 0.8);
  const Adhesion a = ellipse_of_polygon(ellipse_corners(truth, 400));
  EXPECT_NEAR(a.area_um2, truth.area_um2, 1e-4 * truth.area_um2);  // 400 corners lack 4e-5
  EXPECT_NEAR(a.major_axis_um, truth.major_axis_um, 1e-4 * truth.major_axis_um);
  EXPECT_NEAR(a.angle_rad, truth.angle_rad, 1e-9);
}

TEST(HandDrawn, ovals_and_ellipses_are_known_exactly) {
  rois::Roi ellipse = area({{100, 60}, {140, 90}}, "ellipse");
  ellipse.shape = rois::RoiShape::ellipse;
  ellipse.aspect_ratio = 0.4;
  const auto found = hand_drawn_adhesions(set_of({oval({10, 20}, {8, 30}), ellipse}), std::nullopt, kField);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(norm(found[0].position_um - Vec2{1.4, 3.5}), 0, 1e-12);
  EXPECT_NEAR(found[0].major_axis_um, 3, 1e-12);
  EXPECT_NEAR(found[0].minor_axis_um, 0.8, 1e-12);
  EXPECT_NEAR(std::abs(found[0].angle_rad), std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(norm(found[1].position_um - Vec2{12, 7.5}), 0, 1e-12);
  EXPECT_NEAR(found[1].major_axis_um, 5, 1e-12);
  EXPECT_NEAR(found[1].minor_axis_um, 2, 1e-12);
  EXPECT_NEAR(found[1].angle_rad, std::atan2(3, 4), 1e-12);
}

TEST(HandDrawn, an_adhesions_intensity_is_the_height_of_the_pixels_whose_centres_are_in_it) {
  images::Image image = test::even_image(256, 256, 100);
  for (int j = 40; j < 46; ++j)
    for (int i = 50; i < 70; ++i) image.at(i, j) = 400;
  const images::Channel channel{"paxillin.tif", image};
  for (const double m : {0.0, 0.3}) {  // a third of a pixel larger on each side: still no further centre is in it
    const rois::Roi drawn = area({{50 - m, 40 - m}, {70 + m, 40 - m}, {70 + m, 46 + m}, {50 - m, 46 + m}});
    EXPECT_NEAR(hand_drawn_adhesions(set_of({drawn}), channel, kField).front().mean_intensity, 300, 1e-9) << m;
  }
}

TEST(HandDrawn, a_fibres_type_is_that_of_its_name_then_of_its_group_then_of_its_ends) {
  const std::vector<Adhesion> adhesions = {test::ellipse(1, {5, 5}, 1, 0.5, 0), test::ellipse(2, {15, 5}, 1, 0.5, 0)};
  const std::vector<Vec2> tied = {{50, 50}, {150, 50}}, loose = {{80, 200}, {180, 200}};
  const auto expect = [&](FibreType type, const std::vector<rois::Roi>& drawn) {
    for (const rois::Roi& roi : drawn) EXPECT_EQ(held(set_of({roi}), adhesions).fibres[0].type, type) << roi.name;
  };
  expect(FibreType::dorsal, {line(tied, "dorsal 3"), line(tied, "0012-0034", 1), line(tied, "dorsal", 3)});
  expect(FibreType::arc, {line(loose), line(tied, "ARC_1"), line(tied, "0012-0034", 2)});
  expect(FibreType::ventral, {line(tied), line(loose, "Ventral-12"), line(loose, "0012-0034", 3)});
  expect(FibreType::edge, {line(loose, "edge 4"), line(tied, "0012-0034", 4)});
  expect(FibreType::unclassified, {line(tied, "unclassified 4")});
  expect(FibreType::ventral, {line(tied, "archive 4", 9), line(tied, "", 5)});  // neither says a type
}

TEST(HandDrawn, a_named_fibre_is_held_by_what_it_reaches_and_by_anchors_where_it_reaches_nothing) {
  const std::vector<Adhesion> adhesions = {test::ellipse(7, {5, 5}, 1, 0.5, 0)};
  for (const char* name : {"ventral 1", "edge 1"}) {
    const HeldFibres result = held(set_of({line({{50, 50}, {150, 50}}, name)}), adhesions);
    const Fibre& f = result.fibres.front();
    EXPECT_EQ(f.start_adhesion_id, 7);
    EXPECT_EQ(f.end_adhesion_id, 8);
    EXPECT_EQ(f.confidence, 1);
    EXPECT_EQ(f.type_confidence, 1);
    EXPECT_NEAR(norm(f.points_um.back() - Vec2{15.05, 5.05}), 0, 1e-12);  // from the pixel's centre
    ASSERT_EQ(result.anchors.size(), 1u);
    EXPECT_EQ(result.anchors[0].adhesion_id, 8);
    EXPECT_EQ(result.anchors[0].origin, AdhesionOrigin::anchor);
    EXPECT_EQ(result.anchors[0].position_um, f.points_um.back());
    EXPECT_NEAR(result.anchors[0].area_um2, kAnchor_um2, 1e-12);
    EXPECT_NEAR(std::numbers::pi / 4 * result.anchors[0].major_axis_um * result.anchors[0].minor_axis_um, kAnchor_um2,
                1e-12);
  }
}

TEST(HandDrawn, a_fibre_is_held_at_as_many_ends_as_its_type_says_with_or_without_adhesions) {
  const std::vector<Adhesion> at_both = {test::ellipse(1, {5, 5}, 1, 0.5, 0), test::ellipse(2, {15, 5}, 1, 0.5, 0)};
  for (const FibreType type : kFibreTypes)
    for (const auto& adhesions : {std::vector<Adhesion>{}, at_both}) {
      const HeldFibres result =
          held(set_of({line({{50, 50}, {150, 50}}, std::string(name_of(type)) + " 1")}), adhesions);
      const Fibre& f = result.fibres.front();
      EXPECT_EQ(f.type, type);
      const int n_held = type == FibreType::unclassified && adhesions.empty() ? 0 : n_held_ends(type);
      EXPECT_EQ(f.start_adhesion_id.has_value(), n_held >= 1) << name_of(type);
      EXPECT_EQ(f.end_adhesion_id.has_value(), n_held == 2) << name_of(type);
      EXPECT_EQ(static_cast<int>(result.anchors.size()), adhesions.empty() ? n_held : 0);
      EXPECT_NEAR(length_um(f.points_um), 10, 0.2) << name_of(type);  // free ends stay where they are drawn
    }
}

TEST(HandDrawn, a_dorsal_fibre_is_held_at_its_last_point_where_that_alone_reaches_an_adhesion) {
  const std::vector<Adhesion> adhesions = {test::ellipse(7, {15, 5}, 1, 0.5, 0)};
  const HeldFibres result = held(set_of({line({{50, 50}, {150, 50}}, "dorsal 1")}), adhesions);
  EXPECT_FALSE(result.fibres[0].start_adhesion_id);
  EXPECT_EQ(result.fibres[0].end_adhesion_id, 7);
  EXPECT_TRUE(result.anchors.empty());
}

TEST(HandDrawn, fibres_that_meet_share_an_anchor) {
  const HeldFibres result = held(set_of({line({{60, 200}, {52, 52}}, "a"), line({{50, 50}, {150, 50}}, "edge 1"),
                                         line({{150, 52}, {150, 200}}, "ventral 2")}),
                                 {});
  EXPECT_EQ(result.anchors.size(), 3u);
  EXPECT_EQ(result.fibres[1].end_adhesion_id, result.fibres[2].start_adhesion_id);
  EXPECT_EQ(result.fibres[0].end_adhesion_id,
            result.fibres[1].start_adhesion_id);  // of no stated type: what it reaches
  EXPECT_EQ(result.fibres[0].type, FibreType::dorsal);
}

TEST(HandDrawn, an_end_a_little_outside_the_cell_is_held_on_its_edge_and_one_far_outside_is_refused) {
  const CellOutline cell{.outer_um = {{4, 4}, {20, 4}, {20, 20}, {4, 20}}};
  const auto near = held(set_of({line({{100, 100}, {209.5, 99.5}}, "ventral 1")}), {}, cell);
  EXPECT_NEAR(norm(near.anchors[0].position_um - Vec2{20, 10}), 0, 1e-9);
  EXPECT_EQ(near.fibres[0].points_um.back(), near.anchors[0].position_um);
  EXPECT_THROW(held(set_of({line({{100, 100}, {250, 100}}, "ventral 1")}), {}, cell), InputError);
}

TEST(HandDrawn, a_line_that_passes_an_adhesion_between_two_points_does_not_turn_back_to_it) {
  const std::vector<Adhesion> adhesions = {test::ellipse(1, {14, 5.3}, 2, 2, 0)};
  const HeldFibres result = held(set_of({line({{50, 50}, {150, 50}}, "dorsal 1")}), adhesions);
  const Polyline& points = result.fibres[0].points_um;
  EXPECT_EQ(points.back(), adhesions[0].position_um);
  for (std::size_t i = 1; i < points.size(); ++i) EXPECT_GT(points[i].x, points[i - 1].x);
}

TEST(HandDrawn, no_anchor_is_made_where_a_fibre_leaves_the_image) {
  const CellOutline cell{.outer_um = {{0, 4}, {20, 4}, {20, 20}, {0, 20}}};
  const Cuts cuts = {{{0, 20}, {0, 4}}};
  const RoiSet set = set_of({line({{100, 100}, {2, 100}}, "ventral 1")});
  const HeldFibres result = hold_fibres(drawn_lines(set, std::nullopt, kField, {}), {}, cell, {}, kAnchor_um2, cuts);
  EXPECT_EQ(result.anchors.size(), 1u);
  EXPECT_FALSE(result.fibres[0].end_adhesion_id);
}

TEST(HandDrawn, a_fibres_width_is_measured_in_the_image) {
  images::Image image = test::even_image(256, 256, 100);
  test::draw_line(image, {{5, 12.8}, {20, 12.8}}, 500, 0.8, 0.1);
  const RoiSet set = set_of({line({{60, 127.5}, {190, 127.5}})});
  const Fibre f = drawn_lines(set, images::Channel{"actin.tif", image}, kField, {}).front().fibre;
  EXPECT_NEAR(f.width_um, 0.8, 0.1);  // a pixel
  EXPECT_NEAR(f.mean_intensity, 500, 25);
}

TEST(HandDrawn, areas_within_the_outline_are_its_holes) {
  const std::vector<Vec2> outer = {{10, 10}, {110, 10}, {110, 60}, {10, 60}},
                          hole = {{20, 20}, {20, 30}, {40, 30}, {40, 20}};
  rois::Roi composite = area({}, "cell");
  composite.shape = rois::RoiShape::composite;
  composite.paths_px = {hole, outer};
  for (const RoiSet& set : {set_of({area(hole), area(outer)}), set_of({composite})}) {
    const CellOutline cell = hand_drawn_outline(set, kField);
    EXPECT_NEAR(std::abs(signed_area_um2(cell.outer_um)), 50, 1e-9);
    ASSERT_EQ(cell.holes_um.size(), 1u);
    EXPECT_NEAR(std::abs(signed_area_um2(cell.holes_um[0])), 2, 1e-9);
    EXPECT_NEAR(cell.area_um2, 48, 1e-9);
    EXPECT_FALSE(cell.is_cut_by_border());
  }
  EXPECT_TRUE(hand_drawn_outline(set_of({area({{0, 0}, {100, 0}, {100, 90}})}), kField).is_cut_by_border());
}

std::string error_of(const auto& body) {
  const auto error = test::caught<InputError>([&] { body(); });
  return error ? error->where + ": " + error->found : "no error";
}

TEST(HandDrawn, what_cannot_be_used_is_named) {
  const auto adhesion = [](const rois::Roi& roi) {
    return error_of([&] { hand_drawn_adhesions(set_of({roi}), std::nullopt, kField); });
  };
  const auto fibre = [](const rois::Roi& roi) { return error_of([&] { held(set_of({roi}), {}); }); };
  const rois::Roi square = area({{10, 10}, {20, 10}, {20, 20}, {10, 20}}, "a 1");
  EXPECT_EQ(adhesion(square), "no error");
  EXPECT_EQ(adhesion(line({{10, 10}, {20, 20}}, "a 1")), "rois.zip: 'a 1': a segmented line");
  EXPECT_EQ(adhesion(area({{10, 10}, {20, 10}}, "a 1")), "rois.zip: 'a 1': 2 different ones");
  EXPECT_EQ(adhesion(area({{10, 10}, {20, 10}, {30, 10}}, "a 1")), "rois.zip: 'a 1': none between its points");
  EXPECT_EQ(adhesion(area({{10, 10}, {300, 10}, {30, 30}}, "a 1")), "rois.zip: 'a 1': a point at 300, 10");
  EXPECT_EQ(adhesion(area({{0, 0}, {20, 20}, {20, 0}, {0, 19}}, "a 1")), "rois.zip: 'a 1': negative second moments");
  rois::Roi point = square, composite = square;
  point.shape = rois::RoiShape::point;
  composite.shape = rois::RoiShape::composite;
  composite.paths_px = {square.points_px, {{50, 50}, {70, 50}, {70, 70}, {50, 70}}};
  EXPECT_EQ(adhesion(point), "rois.zip: 'a 1': a point selection");
  EXPECT_EQ(error_of([&] { hand_drawn_outline(set_of({composite}), kField); }), "rois.zip: areas beside each other");
  EXPECT_EQ(fibre(square), "rois.zip: 'a 1': a polygon");
  EXPECT_EQ(fibre(point), "rois.zip: 'a 1': a point selection");
  EXPECT_EQ(fibre(line({{10, 10}, {10, 10}}, "f")), "rois.zip: 'f': 1 different ones");
  EXPECT_EQ(fibre(line({{0, 10}, {0.5, 10}}, "f")), "rois.zip: 'f': 0.05 um");
  EXPECT_EQ(fibre(line({{10, 10}, {-9, 10}}, "f")), "rois.zip: 'f': a point at -9, 11");
  EXPECT_EQ(fibre(line({{10, 10}, {20, 10}}, "dorsal or arc")), "rois.zip: 'dorsal or arc': two");
  EXPECT_EQ(error_of([&] {
              hand_drawn_outline(set_of({square, point}), kField);
            }),
            "rois.zip: 'a 1': a point selection");
}

TEST(HandDrawn, what_the_program_found_given_back_by_hand_gives_the_same_cell) {
  const test::DrawnScene scene = test::drawn_scene(10, 1);
  const images::Channel adhesion{"paxillin.tif", scene.adhesion_image}, actin{"actin.tif", scene.actin_image};
  SegmentParameters parameters;
  parameters.pixel_size_um = scene.kPixel_um;
  const Segmentation found = segment_cell(adhesion, actin, parameters);
  HandDrawn drawn;
  for (const rois::Roi& roi : rois_of(found.cell, found.pixel_size_um)) {
    auto& set = roi.shape == rois::RoiShape::polygon   ? drawn.outline
                : roi.shape == rois::RoiShape::ellipse ? drawn.adhesions
                                                       : drawn.fibres;
    if (!set) set = RoiSet{"rois.zip", {}};
    set->rois.push_back(rois::decode_roi(rois::encode_roi(roi), "rois.zip"));
  }
  const Segmentation again = segment_cell(adhesion, actin, parameters, drawn);
  constexpr double kFloat_um = 1e-5;  // rounding of coordinates to float: 1e-5 px of 256
  ASSERT_EQ(again.cell.adhesions.size(), found.cell.adhesions.size());
  for (std::size_t i = 0; i < found.cell.adhesions.size(); ++i) {
    const Adhesion &a = again.cell.adhesions[i], &b = found.cell.adhesions[i];
    EXPECT_NEAR(norm(a.position_um - b.position_um), 0, kFloat_um);
    EXPECT_EQ(a.origin, AdhesionOrigin::drawn);
    EXPECT_NEAR(a.area_um2, b.area_um2, 1e-4 * b.area_um2);
    EXPECT_NEAR(a.minor_axis_um, b.minor_axis_um, 1e-4);
    EXPECT_NEAR(std::sin(a.angle_rad - b.angle_rad), 0, 1e-4);
  }
  ASSERT_EQ(again.cell.fibres.size(), found.cell.fibres.size());
  for (std::size_t i = 0; i < found.cell.fibres.size(); ++i) {
    const Fibre &a = again.cell.fibres[i], &b = found.cell.fibres[i];
    EXPECT_EQ(a.type, b.type);
    EXPECT_EQ(a.start_adhesion_id, b.start_adhesion_id);
    EXPECT_EQ(a.end_adhesion_id, b.end_adhesion_id);
    EXPECT_NEAR(length_um(a.points_um), length_um(b.points_um), 1e-3);
    EXPECT_NEAR(a.width_um, b.width_um, 0.1);
  }
  ASSERT_EQ(again.cell.outline_um.size(), found.cell.outline_um.size());
  EXPECT_NEAR(signed_area_um2(again.cell.outline_um), signed_area_um2(found.cell.outline_um), 1e-3);
}

}  // namespace
}  // namespace mbtfm::cells
