#include "segment/cells/candidates.h"
#include "pipeline/contract/errors.h"
#include "segment/cells/fibre_ends.h"
#include "segment/cells/mask.h"
#include "segment/cells/segment_cell.h"
#include "tests/support/drawn_image.h"

namespace mbtfm::cells {
namespace {

double nearest_um(const std::vector<Vec2>& points, Vec2 point) {
  double least = std::numeric_limits<double>::infinity();
  for (const Vec2 p : points)
    if (!(p == point)) least = std::min(least, norm(p - point));
  return least;
}

TEST(Candidates, of_a_lattice_touch_and_do_not_overlap) {
  for (const Placement placement : {Placement::first, Placement::second}) {
    const auto points = hexagonal_lattice({-100, -70}, {150, 200}, 2, placement);
    for (std::size_t i = 0; i < points.size(); i += 37) EXPECT_NEAR(nearest_um(points, points[i]), 2, 1e-9);
    EXPECT_NEAR(static_cast<double>(points.size()) * std::sqrt(3.0) / 2 * 4, 250 * 270, 0.01 * 250 * 270);
  }
  const Adhesion one = lattice_candidates({0, 0}, {1, 1}, 2, Placement::first, [](Vec2) { return true; }).at(0);
  EXPECT_EQ(one.major_axis_um, 2);
  EXPECT_EQ(one.position_um, (Vec2{0.5, 0.5}));
  EXPECT_EQ(one.origin, AdhesionOrigin::candidate);
}

TEST(Candidates, of_the_second_placement_lie_in_the_middle_between_those_of_the_first) {
  const auto first = hexagonal_lattice({-20, -20}, {20, 20}, 2, Placement::first);
  for (const Vec2 p : hexagonal_lattice({-15, -15}, {15, 15}, 2, Placement::second))
    EXPECT_NEAR(nearest_um(first, p), 1, 1e-9);  // half way between two neighbours
}

TEST(Candidates, at_ends_near_to_each_other_are_one) {
  const auto found = candidates_at({{0, 0}, {1.9, 0}, {2.1, 0}, {10, 0}}, 2);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[2].adhesion_id, 3);
}

/// A round cell of 20 um radius about the origin.
Polygon round_outline() {
  Polygon outline;
  for (int i = 0; i < 120; ++i)
    outline.push_back(20 * Vec2{std::cos(i * std::numbers::pi / 60), std::sin(i * std::numbers::pi / 60)});
  return outline;
}
/// Part of a circle about (x, 0), from angle to angle.
Polyline bow(double x_um, double radius_um, double from_rad, double to_rad) {
  Polyline line;
  for (int i = 0; i <= 20; ++i) {
    const double angle = from_rad + i / 20.0 * (to_rad - from_rad);
    line.push_back({x_um + radius_um * std::cos(angle), radius_um * std::sin(angle)});
  }
  return line;
}

TEST(Candidates, hold_no_arc_one_end_of_a_dorsal_fibre_and_both_of_a_ventral_one) {
  const Polygon outline = round_outline();
  const auto held = [&](const Polyline& line) {
    const EndsToTie ends = ends_held_by_shape(line, outline, 6, 3);
    return std::pair{ends.start, ends.end};
  };
  const std::pair neither{false, false}, both{true, true};
  EXPECT_EQ(held(bow(0, 14, -0.4, 0.4)), neither) << "an arc: along the edge, 6 um behind it";
  EXPECT_EQ(held(bow(0, 18.5, -0.3, 0.3)), both) << "along the edge and in the lamellipodium: a bundle of the edge";
  EXPECT_EQ(held(bow(33, 20, std::numbers::pi - 0.25, std::numbers::pi + 0.25)), both) << "bent inwards";
  EXPECT_EQ(held({{18.5, 0}, {14, 0.3}, {8, 0.5}}), (std::pair{true, false})) << "rises from the edge to the middle";
  EXPECT_EQ(held({{8, 0.5}, {14, 0.3}, {18.5, 0}}), (std::pair{false, true}));
  EXPECT_EQ(held({{18.5, 0}, {17, 3}, {15, 7}}), both) << "a short chord";
  EXPECT_EQ(held({{12, 0}, {6, 0.5}, {2, 0.5}}), both) << "a piece of a fibre in the middle of the cell";
  EXPECT_EQ(held({{-18, 2}, {0, 3}, {10, 2}}), both) << "spans the cell: held at both ends as a rule";
}

TEST(Candidates, are_taken_where_nothing_shows_the_adhesions_and_as_the_parameters_say) {
  EXPECT_EQ(source_of({}, true, false), AdhesionSource::image);
  EXPECT_EQ(source_of({}, false, false), AdhesionSource::cell);
  EXPECT_EQ(source_of({.adhesions = AdhesionSource::fibre_ends}, true, false), AdhesionSource::fibre_ends);
  EXPECT_EQ(source_of({.adhesions = AdhesionSource::pattern}, true, true), AdhesionSource::pattern);
  EXPECT_THROW(source_of({.adhesions = AdhesionSource::pattern}, true, false), UsageError);
  EXPECT_THROW(source_of({.adhesions = AdhesionSource::image}, false, false), UsageError);
}

struct Scene {
  test::DrawnScene drawn = test::drawn_scene(10, 1);
  images::Channel adhesion{"paxillin.tif", drawn.adhesion_image}, actin{"actin.tif", drawn.actin_image};
  SegmentParameters parameters;
  explicit Scene(std::optional<AdhesionSource> adhesions) {
    parameters.pixel_size_um = test::DrawnScene::kPixel_um;
    parameters.candidates.adhesions = adhesions;
  }
};

bool are_candidates(const Cell& cell) {
  return std::ranges::all_of(cell.adhesions, [](const Adhesion& a) { return a.origin == AdhesionOrigin::candidate; });
}

void expect_apart(const Cell& cell, double least_um) {
  for (std::size_t i = 0; i < cell.adhesions.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GE(norm(cell.adhesions[i].position_um - cell.adhesions[j].position_um), least_um - 1e-9);
}

/// The same fibres, each with its own id, whatever holds it.
void expect_same_fibres(const Cell& a, const Cell& b) {
  for (const Fibre& f : a.fibres) {
    const auto other = std::ranges::find(b.fibres, f.fibre_id, &Fibre::fibre_id);
    if (other == b.fibres.end()) continue;
    EXPECT_EQ(other->mean_intensity, f.mean_intensity);
    EXPECT_EQ(other->width_um, f.width_um);
  }
}

TEST(Candidates, without_an_adhesion_image_stand_at_the_ends_of_the_fibres_and_along_the_rim) {
  const Scene scene({});
  const Segmentation s = segment_cell(std::nullopt, scene.actin, scene.parameters);
  EXPECT_EQ(s.source, AdhesionSource::cell);
  ASSERT_FALSE(s.cell.adhesions.empty());
  EXPECT_TRUE(are_candidates(s.cell));
  expect_apart(s.cell, scene.parameters.candidates.candidate_spacing_um);
  ASSERT_FALSE(s.cell.fibres.empty());
  for (const Fibre& f : s.cell.fibres) {
    // two chords, and one that rises from the edge towards the middle
    EXPECT_EQ(f.type, length_um(f.points_um) > 10 ? FibreType::ventral : FibreType::dorsal) << f.type_reason;
    EXPECT_LE(f.type_confidence, 0.5);  // nobody saw what holds it
  }
  const double band_um = scene.parameters.candidates.candidate_band_um;
  for (const Adhesion& a : s.cell.adhesions) {
    const bool is_end = std::ranges::any_of(s.cell.fibres, [&](const Fibre& f) {
      return f.start_adhesion_id == a.adhesion_id || f.end_adhesion_id == a.adhesion_id;
    });
    EXPECT_TRUE(is_end || *a.edge_distance_um <= band_um);
    EXPECT_TRUE(contains(s.cell.outline_um, a.position_um));
  }
  ASSERT_TRUE(s.second);
  expect_same_fibres(s.cell, *s.second);
}

TEST(Candidates, at_fibre_ends_alone_have_no_other_place) {
  const Scene scene(AdhesionSource::fibre_ends);
  const Segmentation s = segment_cell(scene.adhesion, scene.actin, scene.parameters);
  EXPECT_TRUE(are_candidates(s.cell));
  EXPECT_LE(s.cell.adhesions.size(), 2 * s.cell.fibres.size());
  EXPECT_FALSE(s.second);
}

TEST(Candidates, of_a_pattern_lie_on_it_and_in_the_cell) {
  Scene scene(AdhesionSource::pattern);
  images::Image half = test::even_image(256, 256, 0);
  for (int j = 0; j < 256; ++j)
    for (int i = 0; i < 128; ++i) half.at(i, j) = 255;
  HandDrawn drawn;
  drawn.adhesion_mask = std::make_shared<const LabelMask>(mask_of(half, "pattern.tif"));
  const Segmentation s = segment_cell(std::nullopt, scene.actin, scene.parameters, drawn);
  EXPECT_TRUE(are_candidates(s.cell));
  expect_apart(s.cell, 2);
  for (const Adhesion& a : s.cell.adhesions) {
    EXPECT_LT(a.position_um.x, 12.8);
    EXPECT_TRUE(contains(s.cell.outline_um, a.position_um));
  }
  // half of a cell of 10 um radius, by the lattice cell of 3.46 um²
  EXPECT_NEAR(static_cast<double>(s.cell.adhesions.size()), 0.5 * s.area_um2 / 3.464, 6);
  ASSERT_TRUE(s.second);
  EXPECT_NEAR(static_cast<double>(s.second->adhesions.size()), static_cast<double>(s.cell.adhesions.size()), 6);
  for (const Adhesion& a : s.second->adhesions) EXPECT_LT(a.position_um.x, 12.8);
}

TEST(Candidates, of_a_pattern_stand_where_fibres_end_on_it) {
  Scene scene(AdhesionSource::pattern);
  HandDrawn drawn;
  images::Image disc = test::even_image(256, 256, 255);
  for (int j = 0; j < 256; ++j) disc.at(0, j) = 0;
  drawn.adhesion_mask = std::make_shared<const LabelMask>(mask_of(disc, "pattern.tif"));
  const Segmentation without = segment_cell(std::nullopt, scene.actin, scene.parameters, drawn);
  scene.parameters.candidates.adhesions = AdhesionSource::cell;
  const Segmentation at_ends = segment_cell(std::nullopt, scene.actin, scene.parameters);
  ASSERT_FALSE(without.cell.fibres.empty());
  ASSERT_TRUE(without.second);
  for (const Cell* cell : {&without.cell, &*without.second}) {
    ASSERT_EQ(cell->fibres.size(), at_ends.cell.fibres.size());
    for (std::size_t i = 0; i < cell->fibres.size(); ++i) {  // the same ends, wherever the lattice lies
      EXPECT_EQ(cell->fibres[i].points_um.front(), at_ends.cell.fibres[i].points_um.front());
      EXPECT_EQ(cell->fibres[i].points_um.back(), at_ends.cell.fibres[i].points_um.back());
    }
    expect_apart(*cell, 2);
  }
}

TEST(Candidates, of_a_pattern_that_lies_beside_the_cell_are_doubted) {
  const Scene scene(AdhesionSource::pattern);
  const auto beneath = [&](Vec2 shift_um) {
    images::Image image = test::even_image(256, 256, 0);
    for (int j = 0; j < 256; ++j)
      for (int i = 0; i < 256; ++i)
        if (norm(0.1 * Vec2{i + 0.5, j + 0.5} - Vec2{12.8, 12.8} - shift_um) < 6) image.at(i, j) = 255;
    HandDrawn drawn;
    drawn.adhesion_mask = std::make_shared<const LabelMask>(mask_of(image, "pattern.tif"));
    return segment_cell(std::nullopt, scene.actin, scene.parameters, drawn).pattern->beneath;
  };
  EXPECT_GT(beneath({0, 0}).value_or(0), 0.95);
  EXPECT_LT(beneath({4.5, 4.5}).value_or(1), beneath({0, 0}).value_or(0) - 0.05);
}

TEST(Pattern, measures_how_much_of_the_cell_lies_on_it_and_how_large_its_parts_are) {
  const images::Image field = test::even_image(256, 256, 0);
  const Field of_pixels{.width_px = 256, .height_px = 256, .pixel_um = 0.1};
  CellOutline cell;
  for (int i = 0; i < 120; ++i)
    cell.outer_um.push_back(Vec2{12.8, 12.8} +
                            10 * Vec2{std::cos(i * std::numbers::pi / 60), std::sin(i * std::numbers::pi / 60)});
  cell.area_um2 = std::numbers::pi * 100;
  const auto pattern_of = [&](const auto& is_pattern) {
    images::Image image = field;
    for (int j = 0; j < 256; ++j)
      for (int i = 0; i < 256; ++i)
        if (is_pattern(0.1 * Vec2{i + 0.5, j + 0.5})) image.at(i, j) = 255;
    return pattern_at(mask_of(image, "pattern.tif"), cell, of_pixels);
  };
  const PatternAtCell whole = pattern_of([](Vec2 p) { return norm(p - Vec2{12.8, 12.8}) < 10; });
  EXPECT_NEAR(whole.of_cell, 1, 0.02);  // points 0.2 um apart along a rim of 63 um
  const PatternAtCell left = pattern_of([](Vec2 p) { return norm(p - Vec2{12.8, 12.8}) < 10 && p.x < 12.8; });
  EXPECT_NEAR(left.of_cell, 0.5, 0.02);
  const PatternAtCell dots = pattern_of([](Vec2 p) {
    return norm(p - 4 * Vec2{std::round(p.x / 4), std::round(p.y / 4)}) < 0.8;
  });
  EXPECT_NEAR(dots.part_area_um2, std::numbers::pi * 0.64, 0.2);  // points of 0.04 um² along a rim of 5 um
  EXPECT_NEAR(dots.of_cell, std::numbers::pi * 0.64 / 16, 0.03);
}

TEST(Candidates, are_not_asked_for_where_an_image_shows_the_adhesions) {
  const Scene scene({});
  const Segmentation s = segment_cell(scene.adhesion, scene.actin, scene.parameters);
  EXPECT_EQ(s.source, AdhesionSource::image);
  EXPECT_FALSE(s.second);
  for (const Adhesion& a : s.cell.adhesions) EXPECT_EQ(a.origin, AdhesionOrigin::image);
}

}  // namespace
}  // namespace mbtfm::cells
