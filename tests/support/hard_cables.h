/// The hard cases of the cable network, as scenes, which the stability tests solve.
#pragma once

#include "network/cables/cables.h"
#include "network/mesh/mesh.h"
#include "tests/support/test.h"

namespace mbtfm::test {

struct HardCables {
  std::string name;   ///< of the test and of the panel
  std::string title;  ///< what is hard about it
  Network network;
  std::vector<double> tensions_nN;  ///< by group
  cables::CableParameters parameters{};
};

/// The round cell of all scenes: its radius, and where its adhesions are.
inline constexpr double kCellRadius_um = 10;
struct RoundCell {
  std::vector<Vec2> adhesions_um;
  std::vector<Polyline> fibres_um;
};

inline std::vector<Vec2> on_circle(double from_deg, double to_deg, int n) {
  std::vector<Vec2> points;
  for (int i = 0; i < n; ++i) {
    const double angle = (from_deg + (to_deg - from_deg) * i / n) * std::numbers::pi / 180;
    points.push_back({0.93 * kCellRadius_um * std::cos(angle), 0.93 * kCellRadius_um * std::sin(angle)});
  }
  return points;
}

inline Network mesh_of(const RoundCell& round) {
  Cell cell;
  for (int i = 0; i < 60; ++i) {
    const double angle = 2 * std::numbers::pi * i / 60;
    cell.outline_um.push_back({kCellRadius_um * std::cos(angle), kCellRadius_um * std::sin(angle)});
  }
  for (const Vec2 position : round.adhesions_um) {
    Adhesion a;
    a.adhesion_id = static_cast<int>(cell.adhesions.size()) + 1;
    a.position_um = position;
    a.area_um2 = 0.4;
    a.major_axis_um = a.minor_axis_um = std::sqrt(4 * a.area_um2 / std::numbers::pi);
    cell.adhesions.push_back(a);
  }
  for (const Polyline& points : round.fibres_um) {
    Fibre f;
    f.fibre_id = static_cast<int>(cell.fibres.size()) + 1;
    f.width_um = 0.6;
    f.points_um = points;
    cell.fibres.push_back(f);
  }
  return mesh::generate_network(cell, {}).network;
}

inline void scale_lengths(Network& network, double x, double y) {
  for (Vec2& v : network.vertices_um) v = {x * v.x, y * v.y};
  for (Link& link : network.links)
    link.rest_length_um = norm(network.vertices_um[link.vertex_b] - network.vertices_um[link.vertex_a]);
}

inline std::vector<HardCables> make_hard_cables() {
  const std::vector<Vec2> rim = on_circle(0, 360, 12);
  const Polyline ventral{rim[1], {2, 1.5}, rim[5]}, dorsal{rim[8], {-1, -2}}, arc{{-3, 4}, {1, 5}, {5, 3}};
  const Network ordinary = mesh_of({rim, {ventral, dorsal, arc}});
  const Network two = mesh_of({{rim[0], rim[6]}, {}});
  const Network on_line = mesh_of({{{-8, 0}, {-3, 0}, {2, 0}, {7, 0}}, {}});
  const Network half = mesh_of({on_circle(90, 270, 7), {{{-4, 3}, {6, 3}}}});
  const Network missing = mesh_of({{rim[0], rim[1], rim[2], rim[4], rim[5], rim[6], rim[7], rim[8]}, {}});
  const Network free_ends = mesh_of({rim, {{{-4, -2}, {4, 2}}, {{-2, 5}, {-2, -4}}}});
  const Network close = mesh_of({rim, {{{-6, 0}, {6, 0}}, {{-6, 0.1}, {6, 0.1}}}});
  Network needles = ordinary, nanometres = ordinary, millimetres = ordinary;
  scale_lengths(needles, 1, 1.0 / 15);
  scale_lengths(nanometres, 1e3, 1e3);
  scale_lengths(millimetres, 1e-3, 1e-3);
  const std::vector<double> usual{0.06, 5, 3, 2};
  return {
      {"no_tension", "all tensions zero", ordinary, {0, 0, 0, 0}},
      {"network_only", "only the network pulls", ordinary, {0.3, 0, 0, 0}},
      {"fibres_only", "only the fibres pull", ordinary, {0, 5, 3, 2}},
      {"strong_fibre", "1000 nN among 0.01 nN", ordinary, {0.01, 1000, 0.01, 0.01}},
      {"soft", "EA = 1 nN", ordinary, usual, {.axial_stiffness_nN = 1}},
      {"stiff", "EA = 1e6 nN", ordinary, usual, {.axial_stiffness_nN = 1e6}},
      {"two_adhesions", "two adhesions", two, {0.3}},
      {"on_a_line", "all adhesions on a line", on_line, {0.3}},
      {"half_without", "adhesions on the left only", half, {0.3, 2}},
      {"free_edge", "adhesions missing at the rim", missing, {0.3}},
      {"free_ends", "fibres that end in the network", free_ends, {0.06, 5, 5}},
      {"close_fibres", "two fibres 0.1 um apart", close, {0.06, 1, 8}},
      {"needles", "needle triangles (15 : 1)", needles, usual},
      {"nanometres", "lengths in nm", nanometres, usual},
      {"millimetres", "lengths in mm", millimetres, usual},
  };
}

inline const std::vector<HardCables>& hard_cables() {
  static const std::vector<HardCables> scenes = make_hard_cables();  // eight meshes: made once
  return scenes;
}

}  // namespace mbtfm::test
