/// Cells that are hard to mesh, by name. Squares of 12 um or what is drawn in them.
#pragma once

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "tests/support/test.h"

namespace mbtfm::test {

inline Adhesion adhesion_at(int id, Vec2 position, double angle_rad = 0) {
  Adhesion a;
  a.adhesion_id = id;
  a.position_um = position;
  a.major_axis_um = 1.2;
  a.minor_axis_um = 0.53;
  a.area_um2 = 0.25 * std::numbers::pi * a.major_axis_um * a.minor_axis_um;
  a.angle_rad = angle_rad;
  return a;
}

inline Fibre fibre_along(int id, Polyline points, std::optional<int> start = {}, std::optional<int> end = {}) {
  Fibre f;
  f.fibre_id = id;
  f.width_um = 0.6;
  f.points_um = std::move(points);
  f.start_adhesion_id = start;
  f.end_adhesion_id = end;
  return f;
}

struct HardCell {
  std::string name;
  Cell cell;
};

/// A square with two adhesions across from each other, and the fibres.
inline HardCell square_with(std::string name, std::vector<Fibre> fibres, std::vector<Adhesion> more = {}) {
  Cell cell;
  cell.outline_um = {{0, 0}, {12, 0}, {12, 12}, {0, 12}};
  cell.adhesions = {adhesion_at(1, {1.5, 1.5}, 0.8), adhesion_at(2, {10.5, 10.5}, 0.8)};
  cell.adhesions.insert(cell.adhesions.end(), more.begin(), more.end());
  cell.fibres = std::move(fibres);
  return {std::move(name), std::move(cell)};
}

inline Polygon circle(Vec2 centre, double radius, int n) {
  Polygon points;
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * i / n;
    points.push_back(centre + radius * Vec2{std::cos(angle), std::sin(angle)});
  }
  return points;
}

inline HardCell with_hole(HardCell hard, Polygon hole) {
  hard.cell.holes_um.push_back(std::move(hole));
  return hard;
}

inline HardCell with_outline(HardCell hard, Polygon outline) {
  hard.cell.outline_um = std::move(outline);
  return hard;
}

inline HardCell bundle_of_crossing_fibres() {
  std::vector<Fibre> fibres;
  for (int i = 0; i < 8; ++i) {
    const double angle = std::numbers::pi * i / 8;
    const Vec2 arm = 4.0 * Vec2{std::cos(angle), std::sin(angle)};
    const Vec2 middle = {6 + 0.05 * (i % 3), 6 - 0.04 * (i % 4)};
    fibres.push_back(fibre_along(i + 1, {middle - arm, middle + arm}));
  }
  return square_with("bundle_of_crossing_fibres", fibres);
}

inline HardCell sharp_corners() {
  Polygon star;
  for (int i = 0; i < 10; ++i) {
    const double radius = i % 2 == 0 ? 6 : 2;
    star.push_back({6 + radius * std::cos(std::numbers::pi * i / 5), 6 + radius * std::sin(std::numbers::pi * i / 5)});
  }
  HardCell hard = with_outline(square_with("sharp_corners", {}), star);
  hard.cell.adhesions = {adhesion_at(1, {11, 6}), adhesion_at(2, {6, 6})};
  return hard;
}

inline HardCell neck_thinner_than_an_edge() {
  HardCell hard = with_outline(
      square_with("neck_thinner_than_an_edge", {fibre_along(1, {{2.5, 6}, {10, 6}})}),
      {{0, 1}, {4, 1}, {4, 5.8}, {8, 5.8}, {8, 1}, {12, 1}, {12, 11}, {8, 11}, {8, 6.2}, {4, 6.2}, {4, 11}, {0, 11}});
  hard.cell.adhesions = {adhesion_at(1, {1.5, 2.5}), adhesion_at(2, {10.5, 9.5})};
  return hard;
}

inline std::vector<HardCell> hard_cells() {
  return {
      square_with("crossing_fibres",
                  {fibre_along(1, {{1.5, 1.5}, {10.5, 10.5}}, 1, 2), fibre_along(2, {{2, 9.5}, {9.5, 2.5}})}),
      square_with("touching_fibres", {fibre_along(1, {{2, 6}, {10, 6}}), fibre_along(2, {{6, 6.05}, {8.5, 10}})}),
      square_with("nearly_parallel_fibres",
                  {fibre_along(1, {{2, 5.9}, {10, 6.1}}), fibre_along(2, {{2, 6.1}, {10, 5.9}}),
                   fibre_along(3, {{2, 6.7}, {10, 6.8}})}),
      square_with("branching_fibres", {fibre_along(1, {{1.5, 1.5}, {6, 6}, {10.5, 10.5}}, 1, 2),
                                       fibre_along(2, {{1.5, 1.5}, {6, 6}, {6, 10}}, 1)}),
      bundle_of_crossing_fibres(),
      square_with("fibres_that_leave_the_outline",
                  {fibre_along(1, {{5, 4}, {16, 5}}), fibre_along(2, {{-3, 8}, {15, 8.5}})}),
      square_with("fibre_along_the_outline", {fibre_along(1, {{2.5, 0.2}, {9.5, 0.2}})}),
      square_with("fibre_ends_free_in_the_network", {fibre_along(1, {{1.5, 1.5}, {7, 5}}, 1)}),
      square_with("adhesions_at_on_and_outside_the_outline", {},
                  {adhesion_at(3, {0.4, 6}, 1.2), adhesion_at(4, {6, 12}), adhesion_at(5, {13, 4}),
                   adhesion_at(6, {12.2, 8}, 1.57)}),
      square_with("adhesions_that_overlap", {fibre_along(1, {{1.5, 1.5}, {6, 6}}, 1, 3)},
                  {adhesion_at(3, {6, 6}), adhesion_at(4, {6.3, 6.2}, 1.2), adhesion_at(5, {6, 6}),
                   adhesion_at(6, {7.3, 6.3})}),
      square_with("several_adhesions_on_one_fibre", {fibre_along(1, {{2, 6}, {10, 6}})},
                  {adhesion_at(3, {4, 6.1}), adhesion_at(4, {6, 5.9}, 1), adhesion_at(5, {8, 6.05}, 2)}),
      sharp_corners(),
      neck_thinner_than_an_edge(),
      with_hole(square_with("fibre_over_a_hole", {fibre_along(1, {{1.5, 1.5}, {10.5, 10.5}}, 1, 2)}),
                circle({6.3, 5.7}, 2.2, 60)),
      with_hole(square_with("fibre_along_a_hole_and_adhesion_on_its_rim",
                            {fibre_along(1, {{2, 3.9}, {10, 3.7}}), fibre_along(2, {{10.5, 10.5}, {8.2, 6.4}}, 2, 3)},
                            {adhesion_at(3, {8.2, 6.4}, 1)}),
                circle({6, 6}, 2.2, 60)),
      with_hole(with_hole(square_with("holes_close_to_each_other_and_to_the_outline", {}), circle({3.2, 6.2}, 2.8, 60)),
                {{6.5, 4}, {11.5, 4}, {11.5, 8}, {6.5, 8}}),
  };
}

}  // namespace mbtfm::test
