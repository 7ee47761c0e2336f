#include "network/mesh/adhesions.h"
#include "network/mesh/frame.h"
#include "pipeline/contract/errors.h"
#include "tests/support/hard_case.h"
#include "tests/support/hard_cells.h"
#include "tests/support/random_cell.h"
#include "tests/support/valid_network.h"

namespace mbtfm::mesh {
namespace {

using test::adhesion_at;
using test::expect_valid;
using test::fibre_along;

/// A square of 20 um with an adhesion near each corner.
Cell square_cell() {
  Cell cell;
  cell.outline_um = {{0, 0}, {20, 0}, {20, 20}, {0, 20}};
  cell.adhesions = {adhesion_at(1, {2, 2}), adhesion_at(2, {18, 2}), adhesion_at(3, {18, 18}), adhesion_at(4, {2, 18})};
  return cell;
}

void expect_valid_with(const std::vector<Fibre>& fibres) {
  Cell cell = square_cell();
  cell.fibres = fibres;
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const GeneratedNetwork generated = generate_network(cell, {.seed = seed});
    expect_valid(generated, cell, 1.5);
    for (const Fibre& f : fibres) {
      // merging moves a line by a tenth of an edge at most, each time it does
      EXPECT_NEAR(test::length_of_fibre_um(generated.network, f.fibre_id), length_um(f.points_um),
                  0.4 * 1.5 + 0.02 * length_um(f.points_um));
    }
  }
}

TEST(HardMesh, one_that_memory_cannot_hold_is_refused_with_its_count_before_it_is_made) {
  const OutOfMemory error =
      test::thrown<OutOfMemory>([&] { generate_network(square_cell(), {.edge_length_um = 1e-4}); });
  // 400 um2 over the (sqrt 3 / 2) edge^2 that a vertex of an even mesh has to itself: 4.6e10
  EXPECT_TRUE(has_words(error.report->reason, "4.62e+10 vertices"));
}

TEST(HardMesh, edges_too_fine_for_memory_are_refused_before_they_are_filled) {
  const Cell cell = square_cell();
  SizeField size(1.5, 1e-9, cell.outline_um);
  size.refine({10, 10}, 1e-4);  // and hardly more anywhere: an even mesh of 1.5 um has 200 vertices, this one 4.6e10
  EXPECT_THROW(expect_room_for_mesh(size, Boundary(cell, 1.5)), OutOfMemory);
}

TEST(HardMesh, crossing_fibres_share_a_vertex) {
  expect_valid_with({fibre_along(1, {{3, 10}, {17, 10}}), fibre_along(2, {{10.2, 3}, {9.9, 17}})});
  Cell cell = square_cell();
  cell.fibres = {fibre_along(1, {{3, 10}, {17, 10}}), fibre_along(2, {{10, 3}, {10, 17}})};
  const Network net = generate_network(cell, {}).network;
  std::vector<int> seen(net.vertices_um.size(), 0);
  for (const Link& link : net.links)
    if (link.fibre_id > 0) seen[link.vertex_a] |= link.fibre_id, seen[link.vertex_b] |= link.fibre_id;
  int n_crossings = 0;
  for (std::size_t v = 0; v < seen.size(); ++v) {
    if (seen[v] != 3) continue;
    ++n_crossings;
    EXPECT_NEAR(norm(net.vertices_um[v] - Vec2{10, 10}), 0, 1e-9);
  }
  EXPECT_EQ(n_crossings, 1);
}

TEST(HardMesh, nearly_parallel_fibres) {
  for (const double gap : {0.0, 0.01, 0.1, 0.15, 0.2, 0.4}) {
    SCOPED_TRACE("gap " + std::to_string(gap));
    expect_valid_with({fibre_along(1, {{3, 10}, {17, 10}}), fibre_along(2, {{3.4, 10 + gap}, {16.7, 10 + gap}})});
    expect_valid_with({fibre_along(1, {{3, 10}, {17, 10}}), fibre_along(2, {{3, 10 - gap}, {17, 10 + gap}})});
  }
}

TEST(HardMesh, fibres_on_the_same_line_each_keep_their_links) {
  Cell cell = square_cell();
  cell.fibres = {fibre_along(1, {{3, 10}, {17, 10}}), fibre_along(2, {{6, 10}, {14, 10}})};
  const GeneratedNetwork generated = generate_network(cell, {});
  expect_valid(generated, cell, 1.5);
  EXPECT_GT(generated.n_shared_segments, 0);
  EXPECT_NEAR(test::length_of_fibre_um(generated.network, 1), 14, 1e-9);
  EXPECT_NEAR(test::length_of_fibre_um(generated.network, 2), 8, 1e-9);
}

TEST(HardMesh, touching_and_branching_fibres) {
  expect_valid_with({fibre_along(1, {{3, 10}, {17, 10}}), fibre_along(2, {{10, 10.05}, {13, 16}})});
  expect_valid_with({fibre_along(1, {{3, 10}, {17, 10}}), fibre_along(2, {{3, 10}, {10, 10}, {16, 11}})});
  expect_valid_with(
      {fibre_along(1, {{5, 5}, {10, 10}}), fibre_along(2, {{10, 10}, {15, 15}}), fibre_along(3, {{10, 10}, {10, 16}})});
}

TEST(HardMesh, fibres_that_bend_back_and_cross_themselves) {
  expect_valid_with({fibre_along(1, {{4, 4}, {12, 12}, {12, 6}, {5, 12}})});
  Polyline zigzag;
  for (int i = 0; i < 100; ++i) zigzag.push_back({4 + 0.12 * i, 10 + 0.03 * (i % 2)});  // pixel steps
  Cell cell = square_cell();
  cell.fibres = {fibre_along(1, zigzag)};
  expect_valid(generate_network(cell, {}), cell, 1.5);
}

TEST(HardMesh, bundle_of_crossing_fibres) {
  std::vector<Fibre> fibres;
  for (int i = 0; i < 12; ++i) {
    const double angle = std::numbers::pi * i / 12;
    const Vec2 arm = 6.0 * Vec2{std::cos(angle), std::sin(angle)};
    const Vec2 middle = {10 + 0.05 * (i % 3), 10 - 0.04 * (i % 4)};
    fibres.push_back(fibre_along(i + 1, {middle - arm, middle + arm}));
  }
  expect_valid_with(fibres);
}

TEST(HardMesh, fibres_that_leave_the_cell_are_cut_and_named) {
  Cell cell = square_cell();
  cell.fibres = {fibre_along(1, {{10, 10}, {26, 11}}), fibre_along(2, {{5, 5}, {15, 5}}),
                 fibre_along(3, {{-4, 14}, {24, 14.5}})};
  const GeneratedNetwork generated = generate_network(cell, {});
  expect_valid(generated, cell, 1.5);
  EXPECT_EQ(generated.clipped_fibre_ids, (std::vector<int>{1, 3}));
  // cut at the outline, but for merging by a tenth of an edge
  EXPECT_NEAR(test::length_of_fibre_um(generated.network, 1), std::hypot(10, 0.625), 0.1 * 1.5);
  EXPECT_NEAR(test::length_of_fibre_um(generated.network, 3), 20, 0.2 * 1.5);
  cell.fibres = {fibre_along(4, {{30, 10}, {36, 11}})};
  EXPECT_THROW(generate_network(cell, {}), InvalidData);
}

TEST(HardMesh, fibre_that_leaves_and_comes_back_has_two_parts) {
  Cell cell;
  cell.outline_um = {{0, 0}, {20, 0}, {20, 20}, {14, 20}, {14, 6}, {6, 6}, {6, 20}, {0, 20}};
  cell.adhesions = {adhesion_at(1, {2, 2})};
  cell.fibres = {fibre_along(1, {{2, 14}, {18, 14}})};
  const GeneratedNetwork generated = generate_network(cell, {});
  expect_valid(generated, cell, 1.5);
  EXPECT_EQ(test::n_ends_of_fibre(generated.network, 1), 4);
  EXPECT_NEAR(test::length_of_fibre_um(generated.network, 1), 8, 0.8 * 1.5);
}

TEST(HardMesh, adhesions_outside_are_included_up_to_an_edge_length) {
  Cell cell = square_cell();
  cell.adhesions.push_back(adhesion_at(5, {21.2, 10}));
  cell.adhesions.push_back(adhesion_at(6, {10, 20}));
  const GeneratedNetwork generated = generate_network(cell, {});
  expect_valid(generated, cell, 1.5);
  EXPECT_TRUE(std::find(generated.snapped_adhesion_ids.begin(), generated.snapped_adhesion_ids.end(), 5) !=
              generated.snapped_adhesion_ids.end());
  cell.adhesions.push_back(adhesion_at(7, {21.8, 5}));
  EXPECT_THROW(generate_network(cell, {}), InvalidData);
}

TEST(HardMesh, adhesions_at_one_place_each_hold_a_vertex) {
  Cell cell = square_cell();
  for (int i = 0; i < 4; ++i) cell.adhesions.push_back(adhesion_at(5 + i, {10, 10}));
  for (int i = 0; i < 6; ++i) cell.adhesions.push_back(adhesion_at(9 + i, {5 + 0.35 * i, 15}));
  const GeneratedNetwork generated = generate_network(cell, {});
  expect_valid(generated, cell, 1.5);
  EXPECT_EQ(generated.separated_adhesion_ids, (std::vector<int>{5, 6, 7, 8}));
}

TEST(HardMesh, fibre_through_several_adhesions_is_held_by_each) {
  Cell cell = square_cell();
  for (int i = 0; i < 3; ++i) cell.adhesions.push_back(adhesion_at(5 + i, {6 + 3.0 * i, 10.1}));
  cell.fibres = {fibre_along(1, {{4, 10}, {16, 10}})};
  const GeneratedNetwork generated = generate_network(cell, {});
  expect_valid(generated, cell, 1.5);
  std::set<int> on_fibre;
  for (const Link& link : generated.network.links) {
    if (link.fibre_id != 1) continue;
    for (const int v : {link.vertex_a, link.vertex_b}) on_fibre.insert(generated.network.adhesion_id[v]);
  }
  EXPECT_EQ(on_fibre, (std::set<int>{0, 5, 6, 7}));
}

TEST(HardMesh, fibre_along_the_outline) {
  for (const double inset : {-0.3, 0.0, 0.1, 0.3, 0.5, 0.8}) {
    SCOPED_TRACE("inset " + std::to_string(inset));
    Cell cell = square_cell();
    cell.fibres = {fibre_along(1, {{4, inset}, {16, inset}})};
    expect_valid(generate_network(cell, {}), cell, 1.5);
  }
}

TEST(HardMesh, outlines_with_sharp_corners_and_thin_necks) {
  for (const double neck : {0.2, 0.6, 1.5, 3.0}) {
    SCOPED_TRACE("neck " + std::to_string(neck));
    Cell cell;
    const double low = 10 - neck / 2;
    const double high = 10 + neck / 2;
    cell.outline_um = {{0, 4},   {8, 4},   {8, low},   {14, low}, {14, 4}, {22, 4},
                       {22, 16}, {14, 16}, {14, high}, {8, high}, {8, 16}, {0, 16}};
    cell.adhesions = {adhesion_at(1, {2, 10}), adhesion_at(2, {20, 10})};
    expect_valid(generate_network(cell, {}), cell, 1.5);
    cell.fibres = {fibre_along(1, {{4, 10}, {18, 10}})};
    expect_valid(generate_network(cell, {}), cell, 1.5);
  }
  Cell star;
  for (int i = 0; i < 14; ++i) {
    const double radius = i % 2 == 0 ? 15 : 4;
    star.outline_um.push_back(
        {radius * std::cos(std::numbers::pi * i / 7), radius * std::sin(std::numbers::pi * i / 7)});
  }
  star.adhesions = {adhesion_at(1, {14.5, 0}), adhesion_at(2, {0, 0})};
  expect_valid(generate_network(star, {}), star, 1.5);
}

TEST(HardMesh, tip_beyond_a_neck_thinner_than_the_mesh_is_left_out_where_nothing_holds_it) {
  Cell cell;
  cell.outline_um = {{0, 4},   {8, 4},   {8, 9.975},   {14, 9.975}, {14, 4}, {22, 4},
                     {22, 16}, {14, 16}, {14, 10.025}, {8, 10.025}, {8, 16}, {0, 16}};
  cell.adhesions = {adhesion_at(1, {2, 6}), adhesion_at(2, {2, 14})};
  const GeneratedNetwork held_on_one_side = generate_network(cell, {});
  EXPECT_EQ(held_on_one_side.n_loose_parts, 1);
  expect_valid(held_on_one_side, cell, 1.5);
  for (const Vec2 p : held_on_one_side.network.vertices_um) EXPECT_LE(p.x, 14);
  cell.adhesions.push_back(adhesion_at(3, {20, 10}));
  const GeneratedNetwork held_on_both = generate_network(cell, {});
  EXPECT_EQ(held_on_both.n_loose_parts, 0);
  EXPECT_EQ(held_on_both.n_parts, 2);
}

TEST(HardMesh, outline_of_thousands_of_pixel_steps) {
  const Cell smooth = test::random_cell(11, {.n_outline_points = 300});
  for (const double pixel : {0.05, 0.1, 0.3}) {
    SCOPED_TRACE("pixel " + std::to_string(pixel));
    const Cell stepped = test::random_cell(11, {.n_outline_points = 4000, .pixel_um = pixel});
    const GeneratedNetwork generated = generate_network(stepped, {});
    expect_valid(generated, stepped, 1.5);
    // averaging half an edge leaves steps of a fraction of a pixel: area within perimeter · pixel / 2
    double perimeter = 0;
    for (std::size_t i = 1; i < smooth.outline_um.size(); ++i)
      perimeter += norm(smooth.outline_um[i] - smooth.outline_um[i - 1]);
    EXPECT_NEAR(generated.area_um2, std::abs(signed_area_um2(smooth.outline_um)), 0.5 * perimeter * (pixel + 0.1));
    EXPECT_GE(generated.mean_quality, 0.9);
    test::came_out("mean quality " + test::two_digits(generated.mean_quality));
  }
}

TEST(HardMesh, cell_smaller_than_an_edge) {
  const Cell cell = square_cell();
  for (const AdhesionAnchor anchor : {AdhesionAnchor::rim, AdhesionAnchor::ellipse})
    for (const double edge : {10.0, 20.0, 100.0}) {
      SCOPED_TRACE(std::string(name_of(anchor)) + ", edge " + std::to_string(edge));
      expect_valid(generate_network(cell, {.edge_length_um = edge, .adhesion_anchor = anchor}), cell, 0.0);
    }
}

TEST(HardMesh, adhesions_of_any_size) {
  for (const double scale : {0.05, 0.3, 3.0, 12.0}) {
    SCOPED_TRACE("scale " + std::to_string(scale));
    Cell cell = square_cell();
    cell.adhesions.push_back(adhesion_at(5, {10, 10}, 0.4));
    cell.adhesions.back().major_axis_um *= scale;
    cell.adhesions.back().minor_axis_um *= scale;
    cell.adhesions.back().area_um2 *= scale * scale;
    cell.fibres = {fibre_along(1, {{2, 2}, {10, 10}}, 1, 5)};
    const NetworkParameters parameters{.adhesion_anchor = AdhesionAnchor::rim};
    const GeneratedNetwork generated = generate_network(cell, parameters);
    expect_valid(generated, cell, test::finest_edge_um(cell, parameters));
    EXPECT_GE(generated.worst_free_quality, 0.3);
    // the fibre is straight, to the centres of both
    EXPECT_NEAR(test::length_of_fibre_um(generated.network, 1), 8 * std::sqrt(2.0), 1e-9);
  }
}

TEST(HardMesh, points_that_repeat_and_lines_that_run_back) {
  Cell cell = square_cell();
  cell.outline_um = {{0, 0}, {10, 0}, {10, 0}, {20, 0}, {20, 20}, {20, 26}, {20, 20}, {0, 20}};  // a whisker
  expect_valid(generate_network(cell, {}), cell, 1.5);
}

class HardCell : public ::testing::TestWithParam<test::HardCell> {};

TEST_P(HardCell, gives_a_valid_network_with_good_triangles_away_from_its_lines) {
  const Cell& cell = GetParam().cell;
  double worst = 1;
  for (const AdhesionAnchor anchor : values_of<AdhesionAnchor>())
    for (const std::uint64_t seed : {1, 2, 3}) {
      SCOPED_TRACE(std::string(name_of(anchor)) + ", seed " + std::to_string(seed));
      NetworkParameters parameters{.seed = seed};
      parameters.adhesion_anchor = anchor;
      const GeneratedNetwork generated = generate_network(cell, parameters);
      expect_valid(generated, cell, test::finest_edge_um(cell, parameters));
      EXPECT_GE(generated.worst_free_quality, 0.3);
      worst = std::min(worst, generated.worst_free_quality);
    }
  test::came_out("worst triangle away from lines " + test::two_digits(worst));
}

INSTANTIATE_TEST_SUITE_P(Mesh, HardCell, ::testing::ValuesIn(test::hard_cells()),
                         [](const auto& test) { return test.param.name; });

TEST(HardMesh, rims_hold_the_adhesions_areas) {
  Cell cell = square_cell();
  const GeneratedNetwork generated = generate_network(cell, {.adhesion_anchor = AdhesionAnchor::rim});
  for (const Adhesion& a : cell.adhesions) {
    Polygon rim;  // round the centre
    for (std::size_t v = 0; v < generated.network.vertices_um.size(); ++v) {
      if (generated.network.adhesion_id[v] != a.adhesion_id) continue;
      Adhesion inner = a;
      inner.major_axis_um *= 0.8;
      inner.minor_axis_um *= 0.8;
      if (!covers(inner, generated.network.vertices_um[v])) rim.push_back(generated.network.vertices_um[v]);
    }
    EXPECT_EQ(rim.size(), 8U);
    const auto angle = [&](Vec2 p) { return std::atan2(p.y - a.position_um.y, p.x - a.position_um.x); };
    std::sort(rim.begin(), rim.end(), [&](Vec2 p, Vec2 q) { return angle(p) < angle(q); });
    // the fine line of the rim has 32 points or more, which cut off (2 pi / 32)² / 6 = 0.6 %
    EXPECT_NEAR(signed_area_um2(rim), a.area_um2, 0.01 * a.area_um2) << "adhesion " << a.adhesion_id;
  }
}

TEST(HardMesh, fibre_spans_a_hole) {
  Cell cell = square_cell();
  cell.holes_um = {test::circle({10, 10}, 3, 80)};
  cell.fibres = {fibre_along(1, {{3, 10}, {17, 10}})};
  const GeneratedNetwork generated = generate_network(cell, {});
  expect_valid(generated, cell, 1.5);
  EXPECT_NEAR(test::length_of_fibre_um(generated.network, 1), 14, 1e-9);
  for (const Link& link : generated.network.links) {
    const Vec2 middle =
        0.5 * (generated.network.vertices_um[link.vertex_a] + generated.network.vertices_um[link.vertex_b]);
    // chords of the rim lie inside the hole by edge² / 8R
    EXPECT_TRUE(link.fibre_id > 0 || norm(middle - Vec2{10, 10}) > 3 - 0.2) << "in the hole";
  }
}

TEST(HardMesh, free_end_in_a_hole_is_cut_off_and_named) {
  Cell cell = square_cell();
  cell.holes_um = {test::circle({10, 10}, 3, 80)};
  cell.fibres = {fibre_along(1, {{3, 10}, {10, 10}}), fibre_along(2, {{3, 12}, {17, 12}})};
  const GeneratedNetwork generated = generate_network(cell, {});
  expect_valid(generated, cell, 1.5);
  EXPECT_EQ(generated.clipped_fibre_ids, (std::vector<int>{1}));
  // averaging the rim draws it in by edge² / 96 R, merging by a tenth of an edge
  EXPECT_NEAR(test::length_of_fibre_um(generated.network, 1), 4, 0.1 * 1.5 + 0.01);
}

TEST(HardMesh, hole_smaller_than_a_triangle_is_filled) {
  Cell cell = square_cell();
  cell.holes_um = {test::circle({10, 10}, 0.4, 30), test::circle({6, 12}, 2, 30)};
  const GeneratedNetwork generated = generate_network(cell, {});
  expect_valid(generated, cell, 1.5);
  EXPECT_EQ(generated.n_filled_holes, 1);
}

}  // namespace
}  // namespace mbtfm::mesh
