/// Parts of a sheet that carry an even traction each.
#pragma once

#include <functional>
#include <vector>

#include "continuum/sheet/elements.h"
#include "substrate/ellipse.h"

namespace mbtfm::sheet {

/// The ellipse that stands for a triangle of the mesh: of its area and centre.
substrate::Ellipse patch_of(const Elements& elements, int triangle);

/// The ellipse of a triangle: of its centre, area and the ratio and direction of its axes of inertia.
substrate::Ellipse ellipse_of(Vec2 a, Vec2 b, Vec2 c);

struct Patches {
  const Elements* elements = nullptr;
  std::vector<int> triangles;  ///< rising
  std::vector<substrate::Ellipse> ellipses;
  std::vector<double> areas_um2;

  int n() const { return static_cast<int>(triangles.size()); }
  Vec2 centre_um(int patch) const { return ellipses[patch].centre_um; }
  std::vector<Vec2> centres_um() const;
  /// The root of its area.
  double size_um(int patch) const;
  /// At point 0 … Elements::kPoints − 1 of a patch.
  const Shape& at(int patch, int point) const { return elements->at(triangles[patch], point); }
  /// Of a point in the mean over the patch.
  double share(int patch, int point) const { return at(patch, point).weight_um2 / areas_um2[patch]; }
};
/// @throws InvalidData where there are fewer than two
Patches patches_of(const Elements& elements, std::vector<int> triangles);

/// By patch: itself and those whose centres are nearer than a function of the sum of both sizes, which must not fall;
/// rising.
std::vector<std::vector<int>> neighbours_of(const Patches& patches, const std::function<double(double)>& reach_um);

}  // namespace mbtfm::sheet
