/// Surfaces made of triangles in the files of other programs: .stl (text, binary), .ply, .obj and .vtp. Read with doubt
/// by own code: VTK's readers of PLY and OBJ crash on damaged files (end too early, a corner that is no point), or take
/// a word for 0. Normals, colours and textures do not count.
#pragma once

#include "pipeline/contract/path.h"
#include "pipeline/contract/surface.h"

namespace mbtfm::files {

/// Polygons are cut into triangles from their first corner: exact where they are flat and convex. The three corners of
/// STL's triangles become common points where their coordinates are equal.
/// @param length_unit_um  of the file's coordinates, which name none
/// @throws InputError
TriangleMesh read_triangle_mesh(const Path& file, double length_unit_um);

}  // namespace mbtfm::files
