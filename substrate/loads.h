/// What loads a gel, and where it is asked.
#pragma once

#include <Eigen/Core>
#include <array>
#include <variant>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "substrate/ellipse.h"

namespace mbtfm::substrate {

/// Carries an even traction.
struct Square {
  Vec2 centre_um;
  double side_um = 0;
};

/// A traction t cos(k · x) all over the surface.
struct Wave {
  Vec2 wave_vector_per_um;
};

/// Quads of a gel's surface whose sides are parallel to x and y, seen from above. A traction is given at each vertex
/// and bilinear in x and y between them: a space of its own, whatever the mesh that solves for the displacement.
struct SurfaceMesh {
  std::vector<Vec2> points_um;
  std::vector<std::array<int, 4>> faces;
};

/// Unit loads: 1 nN spread evenly over each ellipse, laid onto the surface; a traction of 1 kPa on each of the others,
/// of a SurfaceMesh at each vertex.
struct Loads {
  std::variant<std::vector<Ellipse>, std::vector<Square>, std::vector<Wave>, SurfaceMesh> shapes;
  int n_components = 2;  ///< of each: along x and y, or into the gel, too
  Eigen::Index size() const;
};

/// Of a displacement: along the surface (x, y), into the gel (z), or both.
enum class Components { along, normal, all };

struct Observations {
  std::variant<std::vector<Vec2>, std::vector<Vec3>> points_um;  ///< of the surface, or in space
  Components components = Components::along;
  Eigen::Index n_components() const {
    return components == Components::all ? 3 : components == Components::along ? 2 : 1;
  }
  Eigen::Index size() const;
};

/// Forces into the gel, too, or points in space: only models with that capability take them.
bool are_in_space(const Loads& loads, const Observations& observations);

/// The ellipses or points, checked, where a model takes no others.
/// @param most_components  of a load
/// @throws UsageError where they are others, InvalidData as check()
const std::vector<Ellipse>& ellipses_of(const Loads& loads, int most_components = 2);
const std::vector<Vec2>& surface_points_of(const Observations& observations);
/// Points in space as they are, those of the surface at depth 0. @throws InvalidData where one is not finite
std::vector<Vec3> points_in_space(const Observations& observations);

}  // namespace mbtfm::substrate
