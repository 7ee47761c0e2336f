/// One reader and one writer for each table that passes between stages. All of them call `check`.
/// Readers throw InputError with the line, the column and the label of the row; writers throw OutputError.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/beads.h"
#include "pipeline/contract/beads_in_space.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/results.h"
#include "pipeline/contract/surface.h"
#include "pipeline/files/named_array.h"

namespace mbtfm::files {

std::vector<Adhesion> read_adhesions(const Path& file);
void write_adhesions(const Path& file, const std::vector<Adhesion>& adhesions);

/// fibres.csv and fibre_points.csv
std::vector<Fibre> read_fibres(const Path& fibres_file, const Path& points_file);
void write_fibres(const Path& fibres_file, const Path& points_file, const std::vector<Fibre>& fibres);

/// Rings of a cell's outline: the outer one, then the holes. A file without the column `ring` is one ring.
std::vector<Polygon> read_outline(const Path& file);
/// @param is_cut  by piece of the outer ring (Cell::is_cut); the column of that name is written where there is a cut
void write_outline(const Path& file, const Polygon& outer_um, const std::vector<Polygon>& holes_um = {},
                   const std::vector<bool>& is_cut = {});

/// What a segmented cell consists of.
inline const std::vector<std::string> kCellFiles = {"adhesions.csv", "fibres.csv", "fibre_points.csv", "outline.csv"};
/// Outlines of other cells in the image, a ring each; may not be there.
inline constexpr const char* kNeighboursFile = "neighbours.csv";
/// kCellFiles of a folder, checked against each other; with its neighbours if there are any
Cell read_cell(const Path& folder);

DisplacementField read_displacement(const Path& file);
void write_displacement(const Path& file, const DisplacementField& field);
std::vector<BeadInSpace> read_displacement_in_space(const Path& file);
void write_displacement_in_space(const Path& file, const std::vector<BeadInSpace>& beads);
/// displacement_0001.csv of a time series.
std::string displacement_of_frame(int frame);

/// Columns x_um, y_um.
std::vector<Vec2> read_points(const Path& file);
/// Columns x_um, y_um, z_um at places of an even lattice, in any order. A vertex without a row or a z has NaN.
HeightMap read_heights(const Path& file);

/// Between the columns and rows of points that lie on a lattice.
/// @param file  they are from, for the message. @throws InputError where there are less than two columns or rows
Vec2 lattice_spacing_um(const std::vector<Vec2>& points_um, const Path& file);
/// Columns x_um, y_um, tx_kPa, ty_kPa; area_um2 where the points lie on no lattice. Displacements stay nought.
std::vector<GroundPatch> read_tractions(const Path& file);

/// Columns fibre_id, tension_nN at least.
std::vector<Tension> read_tensions(const Path& file);
void write_tensions(const Path& file, const std::vector<Tension>& tensions, const std::vector<Fibre>& fibres);

/// Columns adhesion_id, fx_nN, fy_nN at least.
std::vector<AdhesionForce> read_adhesion_forces(const Path& file);
/// @param more  further columns, by force; their names carry the unit
void write_adhesion_forces(const Path& file, const std::vector<AdhesionForce>& forces,
                           const std::vector<Adhesion>& adhesions, const std::vector<NamedArray>& more = {});

/// Columns vertex, fx_nN, fy_nN: the force of the network on the substrate at each held vertex.
void write_reactions(const Path& file, const std::vector<int>& vertices, const std::vector<Vec2>& forces_nN);

}  // namespace mbtfm::files
