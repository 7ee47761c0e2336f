/// VTK files (XML, binary appended, compressed). Readers and writers call `check` and throw InputError and OutputError.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/network.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/surface.h"
#include "pipeline/files/named_array.h"

namespace mbtfm::files {

Network read_network(const Path& file);
void write_network(const Path& file, const Network& network);

/// surface.vtp: quadrilaterals of the lattice; `height_sigma_um` by point where the map has errors.
HeightMap read_surface(const Path& file);
void write_surface(const Path& file, const HeightMap& map);

/// Quadrilaterals (4 corners, round), hexahedra (8 corners: one face round, then the face across) or quadratic
/// triangles (3 corners, then the points between them: 6).
struct Grid {
  int corners = 4;
  std::vector<Vec3> points_um;
  std::vector<int> cells = {};  ///< points of the corners, cell by cell
  std::vector<NamedArray> point_arrays, cell_arrays;
};
void write_grid_vtu(const Path& file, const Grid& grid);
/// The same of quadrilaterals, as a surface.
void write_quads_vtp(const Path& file, const Grid& grid);

/// Outline, adhesion ellipses and fibres as polygons and lines, with adhesion_id, fibre_id and fibre_type by cell.
void write_cell_vtp(const Path& file, const Cell& cell);
/// A point cloud with arrays.
void write_points_vtp(const Path& file, const std::vector<Vec2>& points_um, const std::vector<NamedArray>& arrays);
/// The same in space.
void write_points_vtp(const Path& file, const std::vector<Vec3>& points_um, const std::vector<NamedArray>& arrays);
/// Adhesion ellipses with arrays by adhesion.
void write_ellipses_vtp(const Path& file, const std::vector<Adhesion>& adhesions,
                        const std::vector<NamedArray>& arrays);
ContractedNetwork read_contracted_network(const Path& file);
void write_contracted_network(const Path& file, const Network& network, const std::vector<Vec2>& positions_um,
                              const std::vector<double>& link_force_nN, const std::vector<CableState>& link_states);

}  // namespace mbtfm::files
