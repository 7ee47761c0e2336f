/// Between the program and the library that holds deal.II.
#pragma once

#include "substrate/elements/block_mesh.h"

namespace mbtfm::elements {

constexpr const char* kMeshMakerFile = "libmbtfm_mesh_maker.so";

/// Fill in a mesh whose lines are given: all but cell_at.
/// @throws std::length_error for more than `most_cells`
using MakeMesh = void(BlockMesh& mesh, const std::function<bool(const Box&)>& is_too_large, std::int64_t most_cells,
                      int threads);

extern "C" MakeMesh mbtfm_make_mesh;

}  // namespace mbtfm::elements
