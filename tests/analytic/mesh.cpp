#include "network/mesh/adhesions.h"
#include "network/mesh/links.h"
#include "network/mesh/polyline.h"
#include "network/mesh/triangulation.h"
#include "pipeline/contract/polyline.h"
#include "tests/support/valid_network.h"

namespace mbtfm::mesh {
namespace {

Cell disc(int n_points) {
  Cell cell;
  for (int i = 0; i < n_points; ++i) {
    const double angle = 2 * std::numbers::pi * i / n_points;
    cell.outline_um.push_back({std::cos(angle), std::sin(angle)});
  }
  return cell;
}

Cell square(double side) {
  Cell cell;
  cell.outline_um = {{0, 0}, {side, 0}, {side, side}, {0, side}};
  return cell;
}

TEST(SizeField, grows_from_what_is_resolved_up_to_an_edge) {
  SizeField size(1.5, 0.3, {{-10, -10}, {10, 10}});
  size.refine({0, 0}, 0.3);
  for (const double d : {0.0, 0.5, 2.0, 9.0}) EXPECT_NEAR(size.at({0, d}), std::min(1.5, 0.3 + 0.3 * d), 1e-12) << d;
}

TEST(Mesh, quality_is_one_for_an_equilateral_and_zero_for_a_flat_triangle) {
  EXPECT_NEAR(quality({0, 0}, {1, 0}, {0.5, std::sqrt(3.0) / 2}), 1, 1e-12);
  EXPECT_EQ(quality({0, 0}, {1, 0}, {2, 0}), 0);
  // 3-4-5: inradius 1, circumradius 2.5
  EXPECT_NEAR(quality({0, 0}, {3, 0}, {0, 4}), 0.8, 1e-12);
}

TEST(Mesh, unit_circle_is_as_good_as_distmesh_makes_it) {
  for (const double edge : {0.1, 0.05})
    for (const std::uint64_t seed : {1, 2, 3, 4, 5}) {
      const GeneratedNetwork generated = generate_network(disc(400), {.edge_length_um = edge, .seed = seed});
      EXPECT_GE(generated.mean_quality, 0.985) << "edge " << edge << " seed " << seed;
      EXPECT_GE(generated.worst_quality, 0.5) << "edge " << edge << " seed " << seed;
    }
}

TEST(Mesh, disc_and_square_obey_eulers_formula) {
  for (const Cell& cell : {disc(100), square(2)}) {
    const GeneratedNetwork generated =
        generate_network(cell, {.edge_length_um = 0.15, .link_reach = LinkReach::neighbours});
    const int n_vertices = static_cast<int>(generated.network.vertices_um.size());
    const int n_edges = static_cast<int>(generated.network.links.size());
    EXPECT_EQ(n_vertices - n_edges + generated.n_triangles, 1);
  }
}

TEST(Mesh, area_is_that_of_the_outline) {
  // The vertices of a square lie on its sides and corners: the area is exact to rounding.
  EXPECT_NEAR(generate_network(square(2), {.edge_length_um = 0.15}).area_um2, 4, 1e-9);
  // Chords of length c cut c³ / 12R off a circle: with about 2 pi R / h of them a fraction h² / 6R², at most 1.5² of
  // that where chords are 1.5 h long; averaging the outline takes another h² / 48.
  constexpr double kEdge = 0.1;
  const double area = generate_network(disc(2000), {.edge_length_um = kEdge}).area_um2;
  EXPECT_LE(area, std::numbers::pi);
  EXPECT_GE(area, std::numbers::pi * (1 - kEdge * kEdge * (1.5 * 1.5 / 6 + 1.0 / 48)));
}

TEST(Mesh, holes_are_left_out) {
  Cell cell = square(4);
  cell.holes_um = {{{0.5, 0.5}, {1.5, 0.5}, {1.5, 1.5}, {0.5, 1.5}}, {{2, 2}, {2, 3.5}, {3.5, 3.5}, {3.5, 2}}};
  for (const double edge : {0.1, 0.3}) {
    const GeneratedNetwork generated =
        generate_network(cell, {.edge_length_um = edge, .link_reach = LinkReach::neighbours});
    // vertices lie on the sides and corners, as the square's above
    EXPECT_NEAR(generated.area_um2, 16 - 1 - 2.25, 1e-9) << "edge " << edge;
    const int n_vertices = static_cast<int>(generated.network.vertices_um.size());
    const int n_edges = static_cast<int>(generated.network.links.size());
    EXPECT_EQ(n_vertices - n_edges + generated.n_triangles, 1 - 2) << "edge " << edge;
  }
}

TEST(Mesh, edges_grow_from_what_is_resolved_no_faster_than_wanted) {
  Cell cell = square(30);
  Adhesion a;
  a.adhesion_id = 1;
  a.position_um = {15, 15};
  a.major_axis_um = a.minor_axis_um = 0.8;
  a.area_um2 = std::numbers::pi * 0.16;
  cell.adhesions = {a};
  NetworkParameters p;
  p.adhesion_anchor = AdhesionAnchor::rim;
  p.link_reach = LinkReach::neighbours;
  const Network net = generate_network(cell, p).network;
  for (const Link& link : net.links) {
    if (net.adhesion_id[link.vertex_a] != 0 && net.adhesion_id[link.vertex_b] != 0) continue;
    const Vec2 middle = 0.5 * (net.vertices_um[link.vertex_a] + net.vertices_um[link.vertex_b]);
    const double wanted =
        std::min(1.5, 0.1 * std::numbers::pi + 0.3 * std::max(0.0, norm(middle - a.position_um) - 0.4));
    EXPECT_LE(link.rest_length_um, 1.8 * wanted);
    EXPECT_GE(link.rest_length_um, 0.5 * wanted);
  }
}

TEST(Mesh, an_adhesion_covers_what_lies_in_its_ellipse) {
  const Adhesion adhesion{.adhesion_id = 1,
                          .position_um = {3, 4},
                          .area_um2 = std::numbers::pi / 4 * 3,
                          .major_axis_um = 3,
                          .minor_axis_um = 1,
                          .angle_rad = 0.4,
                          .eccentricity = 0,
                          .mean_intensity = 1};
  const Polygon corners = ellipse_corners(adhesion, 10000);  // within 1e-7 of the ellipse
  for (double y = 2; y < 6; y += 0.0371)
    for (double x = 1; x < 5; x += 0.0371)
      EXPECT_EQ(covers(adhesion, {x, y}), contains(corners, {x, y})) << x << " " << y;
}

TEST(Mesh, edges_along_an_adhesions_rim_enclose_its_area) {
  for (const double aspect : {1.0, 2.0, 5.0}) {
    const Adhesion adhesion{.adhesion_id = 1,
                            .position_um = {3, 4},
                            .area_um2 = std::numbers::pi / 4 * aspect,
                            .major_axis_um = aspect,
                            .minor_axis_um = 1,
                            .angle_rad = 0.4,
                            .eccentricity = 0,
                            .mean_intensity = 1};
    for (const double edge_um : {0.2, 0.5, 1.0}) {
      const int n_edges = std::max(3, static_cast<int>(std::lround(perimeter_um(adhesion) / edge_um)));
      const double drawn = std::abs(signed_area_um2(evenly_resampled(rim_um(adhesion, edge_um), n_edges)));
      // the finer line that the edges are taken from cuts corners too: 32 of them and more, 1 - sinc(2 pi / 32) of a
      // disc
      EXPECT_NEAR(drawn / adhesion.area_um2, 1, 0.03) << "aspect " << aspect << ", edge " << edge_um;
    }
  }
}

TEST(Mesh, sheet_of_even_surface_tension_is_at_rest_inside) {
  // Links weighted by width are minus the gradient of the area, which inner vertices do not change; what they hand on
  // to second neighbours exerts no force. So the forces on inner vertices cancel to rounding, and none is clipped here.
  for (const LinkReach reach : values_of<LinkReach>()) {
    const GeneratedNetwork generated =
        generate_network(disc(400), {.edge_length_um = 0.1, .link_weights = LinkWeights::width, .link_reach = reach});
    const Network& net = generated.network;
    std::vector<Vec2> force(net.vertices_um.size());
    for (const Link& link : net.links) {
      const Vec2 gap = net.vertices_um[link.vertex_b] - net.vertices_um[link.vertex_a];
      force[link.vertex_a] += (link.share / norm(gap)) * gap;
      force[link.vertex_b] += (-link.share / norm(gap)) * gap;
    }
    int n_inner = 0;
    for (std::size_t v = 0; v < force.size(); ++v) {
      if (norm(net.vertices_um[v]) > 0.8) continue;
      EXPECT_NEAR(norm(force[v]), 0, 1e-12) << "vertex " << v << ", " << name_of(reach);
      ++n_inner;
    }
    EXPECT_GT(n_inner, 100);
  }
}

TEST(Mesh, second_neighbours_of_a_regular_triangulation_pull_evenly_in_twelve_directions) {
  // Three rings of a triangular lattice of edge 1 round a vertex. Its links have half the material of a sheet whose
  // near links have t l = 1, twice: once in the six near ones, once in the six far ones, so that each has t l = 1/2.
  std::vector<Vec2> points;
  const Vec2 along = {1, 0}, up = {0.5, std::sqrt(3.0) / 2};
  for (int j = -3; j <= 3; ++j)
    for (int i = std::max(-3, -3 - j); i <= std::min(3, 3 - j); ++i) points.push_back(i * along + j * up);
  RelaxedMesh mesh{.points_um = points, .size_um = std::vector<double>(points.size(), 1)};
  std::vector<Vec2> hull = {{3, 0}, 3 * up, 3 * (up - along), {-3, 0}, -3 * up, -3 * (up - along)};
  Frame frame{.size = SizeField(1, 0.3, hull)};
  const auto at = [&](Vec2 p) {
    return static_cast<int>(std::find_if(points.begin(), points.end(), [&](Vec2 q) { return norm(p - q) < 1e-9; }) -
                            points.begin());
  };
  for (int side = 0; side < 6; ++side)
    for (int k = 0; k < 3; ++k) {
      const Vec2 step = (1.0 / 3) * (hull[(side + 1) % 6] - hull[side]);
      const auto [a, b] = std::minmax({at(hull[side] + k * step), at(hull[side] + (k + 1) * step)});
      frame.segments.push_back({.vertex_a = a, .vertex_b = b, .outline_count = 1});
    }
  mesh.triangulation = *triangulate(points, frame.segments);
  Vec2 force;
  double xx = 0, xy = 0, yy = 0;  // of the stress: isotropic with twelve times t l / 2 in its diagonal
  int n = 0;
  for (const Link& link : links_of(frame, mesh, {.edge_length_um = 1})) {
    if (link.vertex_a != at({0, 0}) && link.vertex_b != at({0, 0})) continue;
    const Vec2 gap = points[link.vertex_a] + points[link.vertex_b];  // from the origin
    EXPECT_NEAR(link.share * link.rest_length_um, 0.5, 1e-12);
    const Vec2 direction = (1 / norm(gap)) * gap;
    force += link.share * direction;
    xx += 0.5 * direction.x * direction.x, xy += 0.5 * direction.x * direction.y, yy += 0.5 * direction.y * direction.y;
    ++n;
  }
  EXPECT_EQ(n, 12);
  EXPECT_NEAR(norm(force), 0, 1e-12);
  EXPECT_NEAR(xx, 3, 1e-12);
  EXPECT_NEAR(yy, 3, 1e-12);
  EXPECT_NEAR(xy, 0, 1e-12);
}

TEST(Mesh, mean_width_is_that_of_a_regular_triangulation) {
  // Widths times lengths of all links fill twice the area: the sheet's tension does not depend on the edge length.
  for (const LinkReach reach : values_of<LinkReach>())
    for (const double edge : {0.05, 0.1, 0.2}) {
      const GeneratedNetwork generated = generate_network(
          disc(400), {.edge_length_um = edge, .link_weights = LinkWeights::width, .link_reach = reach});
      double sum = 0;
      for (const Link& link : generated.network.links) sum += link.share * link.rest_length_um * edge / std::sqrt(3.0);
      EXPECT_NEAR(sum, 2 * generated.area_um2, 1e-3 * generated.area_um2) << name_of(reach) << ", edge " << edge;
    }
}

TEST(Mesh, straight_fibre_between_two_adhesions_keeps_its_length) {
  Cell cell = square(20);
  for (int i = 0; i < 2; ++i) {
    Adhesion a;
    a.adhesion_id = i + 1;
    a.position_um = {3 + 14.0 * i, 5 + 7.0 * i};
    a.area_um2 = 0.5;
    a.major_axis_um = 1.2;
    a.minor_axis_um = 0.5;
    cell.adhesions.push_back(a);
  }
  Fibre fibre;
  fibre.fibre_id = 7;
  fibre.width_um = 0.6;
  fibre.start_adhesion_id = 1;
  fibre.end_adhesion_id = 2;
  fibre.points_um = {{3.2, 5.1}, {10, 8.5}, {16.9, 11.95}};
  cell.fibres.push_back(fibre);
  const GeneratedNetwork generated = generate_network(cell, {});
  test::expect_valid(generated, cell, 1.5);
  // it is drawn to the adhesions' centres, and straight: its points are off by less than the 0.05 edges that matter
  EXPECT_NEAR(test::length_of_fibre_um(generated.network, 7), std::hypot(14.0, 7.0), 1e-9);
  EXPECT_EQ(test::n_ends_of_fibre(generated.network, 7), 2);
}

}  // namespace
}  // namespace mbtfm::mesh
