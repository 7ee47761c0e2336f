/// What quadratic triangles know: shape functions at the points where integrals are summed up, and where a point lies.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "continuum/sheet/triangles.h"

namespace mbtfm::sheet {

/// The six functions of a triangle at a point.
struct Shape {
  std::array<double, 6> value;
  std::array<Vec2, 6> gradient_per_um;
  Vec2 place_um;
  double weight_um2 = 0;  ///< of the point in an integral over the triangle
};

class Elements {
 public:
  static constexpr int kPoints = 7;  ///< of Radon's rule, exact for polynomials of degree 5

  /// @throws InvalidData where a triangle is turned inside out
  explicit Elements(Triangles triangles);

  const Triangles& triangles() const { return triangles_; }
  int n_nodes() const { return static_cast<int>(triangles_.nodes_um.size()); }
  int n_triangles() const { return static_cast<int>(triangles_.nodes.size()); }
  const std::array<int, 6>& nodes(int triangle) const { return triangles_.nodes[triangle]; }
  /// At point 0 … kPoints − 1 of the triangle.
  const Shape& at(int triangle, int point) const { return shapes_[kPoints * triangle + point]; }
  /// body(triangle, point, shape) at all points of all triangles, in turn.
  template <class Body>
  void for_each_point(const Body& body) const {
    for (int t = 0; t < n_triangles(); ++t)
      for (int p = 0; p < kPoints; ++p) body(t, p, at(t, p));
  }
  double area_um2(int triangle) const;
  double area_um2() const;
  /// At barycentric coordinates (1 − r − s, r, s) of a triangle; weight_um2 is the Jacobian's.
  Shape shape(int triangle, double r, double s) const;

 private:
  Triangles triangles_;
  std::vector<Shape> shapes_;
};

/// Finds the triangle of a point.
class Locator {
 public:
  explicit Locator(const Elements& elements);
  struct Place {
    int triangle = 0;
    double r = 0, s = 0;
  };
  /// Points outside, but nearer to a triangle than a share of its size, are taken for its own.
  std::optional<Place> find(Vec2 point_um, double outside = 0.02) const;

 private:
  const Elements& elements_;
  Vec2 low_um_;
  double bin_um_ = 1;
  int columns_ = 1, rows_ = 1;
  std::vector<std::vector<int>> bins_;
};

}  // namespace mbtfm::sheet
