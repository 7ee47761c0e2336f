/// One reader and one writer for each file that passes between stages. All of them call `check`.
/// Readers throw InputError with the line, the column and the label of the row; writers throw OutputError.
#pragma once

#include <array>
#include <filesystem>
#include <istream>
#include <ostream>
#include <string>
#include <vector>

#include "pipeline/contract/report.h"
#include "pipeline/contract/types.h"

namespace mbtfm {

using Path = std::filesystem::path;

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
/// kCellFiles of a folder, checked against each other
Cell read_cell(const Path& folder);

DisplacementField read_displacement(const Path& file);
void write_displacement(const Path& file, const DisplacementField& field);
/// displacement_0001.csv of a time series.
std::string displacement_of_frame(int frame);

/// Columns x_um, y_um.
std::vector<Vec2> read_points(const Path& file);

/// Columns fibre_id, tension_nN at least.
std::vector<Tension> read_tensions(const Path& file);
void write_tensions(const Path& file, const std::vector<Tension>& tensions, const std::vector<Fibre>& fibres);

/// A named array over the points or cells of a VTK file or the rows of a table, one value or (x, y) each; the name
/// carries the unit.
struct PointArray {
  std::string name;
  std::vector<double> scalars;
  std::vector<Vec2> vectors;
};

/// Columns adhesion_id, fx_nN, fy_nN at least.
std::vector<AdhesionForce> read_adhesion_forces(const Path& file);
/// @param more  further columns, by force; their names carry the unit
void write_adhesion_forces(const Path& file, const std::vector<AdhesionForce>& forces,
                           const std::vector<Adhesion>& adhesions, const std::vector<PointArray>& more = {});

/// Columns vertex, fx_nN, fy_nN: the force of the network on the substrate at each held vertex.
void write_reactions(const Path& file, const std::vector<int>& vertices, const std::vector<Vec2>& forces_nN);

/// What each source adds to a standard error. In squares they add up.
struct ErrorParts {
  double beads = 0;               ///< noise of the displacements
  double segmentation = 0;        ///< shift, area and angle of the adhesions; free ends of the fibres
  std::optional<double> mesh{};   ///< one network is not another; none: a single mesh tells nothing of it
  double substrate = 0;           ///< discretisation of the gel, or what its model leaves out
  double solver = 0;              ///< where the iterations stopped
  double model = 0;               ///< what the misfit calls for beside the beads' noise and the mesh
  std::optional<double> gel{};    ///< modulus, thickness and Poisson's ratio, where their errors are stated
  std::optional<double> place{};  ///< of the cell on the beads, where it was found with the tensions
};
double total(const ErrorParts& parts);

struct TensionError {
  int fibre_id = 0;  ///< 0: the actin network
  double tension_nN = 0;
  ErrorParts parts_nN;
};
struct ErrorBudget {
  std::vector<TensionError> tensions;
  double total_force_nN = 0;
  ErrorParts total_force_parts_nN;
  struct CutForce {
    double force_nN = 0;
    ErrorParts parts_nN;
  };
  std::optional<CutForce> cut_force;  ///< through the image's cut; none: the image shows the whole cell
};

/// What the fit found for the cell as a whole: fit.json.
struct FitSummary {
  double relative_l2 = 0;           ///< |u_measured − u_model| / |u_measured|
  double expected_relative_l2 = 0;  ///< what the bead noise alone would give
  double noise_um = 0;              ///< standard deviation of a displacement component far from the cell
  double total_force_nN = 0;        ///< sum of force magnitudes over adhesions
  double network_force_nN = 0;      ///< the same with every fibre at the network's tension
  double fibre_force_nN = 0;        ///< the difference
  double network_surface_tension_nN_per_um = 0;
  int n_meshes = 1;
  int iterations = 0;
  bool converged = false;
  std::optional<ErrorBudget> error_budget;
  Figures more;  ///< further figures, written after the named ones
};
FitSummary read_fit_summary(const Path& file);
/// @param fibres  whose types are written beside the tensions of the error budget
void write_fit_summary(const Path& file, const FitSummary& summary, const std::vector<Fibre>& fibres = {});
/// Named figures as one JSON object.
void write_figures(const Path& file, const Figures& figures);

// VTK (XML, binary appended, compressed)

Network read_network(const Path& file);
void write_network(const Path& file, const Network& network);

/// Values of a grid in space, some numbers each; the name carries the unit.
struct GridArray {
  std::string name;
  int components = 1;
  std::vector<double> values;
};
/// Quadrilaterals (4 corners, round) or hexahedra (8 corners: one face round, then the face across).
struct Grid {
  int corners = 4;
  std::vector<std::array<double, 3>> points_um;
  std::vector<int> cells;  ///< points of the corners, cell by cell
  std::vector<GridArray> point_arrays, cell_arrays;
};
void write_grid_vtu(const Path& file, const Grid& grid);

/// Outline, adhesion ellipses and fibres as polygons and lines, with adhesion_id, fibre_id and fibre_type by cell.
void write_cell_vtp(const Path& file, const Cell& cell);
/// A point cloud with arrays.
void write_points_vtp(const Path& file, const std::vector<Vec2>& points_um, const std::vector<PointArray>& arrays);
/// Adhesion ellipses with arrays by adhesion.
void write_ellipses_vtp(const Path& file, const std::vector<Adhesion>& adhesions,
                        const std::vector<PointArray>& arrays);
/// A network in equilibrium: its vertices are where the cables have drawn them; force_nN is carried by each link.
struct ContractedNetwork {
  Network network;
  std::vector<double> link_force_nN;
};
ContractedNetwork read_contracted_network(const Path& file);
void write_contracted_network(const Path& file, const Network& network, const std::vector<Vec2>& positions_um,
                              const std::vector<double>& link_force_nN, const std::vector<CableState>& link_states);

}  // namespace mbtfm
