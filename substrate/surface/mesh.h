/// The gel's surface from a mesh of triangles, as other programs make it.
#pragma once

#include "pipeline/contract/surface.h"

namespace mbtfm::surface {

struct MeshSurface {
  HeightMap map;      ///< NaN where no triangle lies: `check` comes when holes are filled
  int n_flipped = 0;  ///< triangles whose corners run the other way round than most others', seen along z
};

/// Median length of the triangles' edges, seen along z: a lattice of this spacing resolves what the mesh does. It is
/// wider where most edges are so short that the lattice would have more than 10 000 vertices and 100 a triangle.
/// @throws InvalidData where the mesh has no edge that is longer than 0 so
double suggested_spacing_um(const TriangleMesh& mesh);

/// Heights of a mesh that is a height field, where the lines along z through a lattice's vertices meet it. The lattice
/// spans the mesh's extent, from end to end; its spacings are the largest up to `spacing_um` that fit in, and at most a
/// third of the extent.
///
/// Upright triangles are walls: one that is higher than rounding and a thousandth of the spacing is a jump.
/// @throws InvalidData where the mesh is empty, closed, spans no area seen along z, or has two heights over one place,
///         by place
MeshSurface sample_mesh(const TriangleMesh& mesh, double spacing_um);

}  // namespace mbtfm::surface
