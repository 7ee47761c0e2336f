/// A cell while it is being drawn.
#pragma once

#include <functional>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "samples/drawing/random.h"
#include "samples/drawing/scenario.h"

namespace mbtfm::drawing {

/// An arc of the outline that a bundle draws in: indices of its points, from corner to corner.
struct FreeEdge {
  int first = 0, last = 0;
};

struct Sketch {
  CellParameters parameters;
  Vec2 centre_um;
  Polygon outline_um;              ///< turns from +x towards +y, points every kOutlineSpacing
  std::vector<int> corner_points;  ///< indices into outline_um
  std::vector<FreeEdge> free_edges;
  std::vector<Adhesion> adhesions;
  std::vector<Fibre> fibres;  ///< points every kFibreSpacing until the cell is finished
};

inline constexpr double kOutlineSpacing_um = 0.5;  ///< arcs of 10 um radius deviate from it by 3 nm
inline constexpr double kFibreSpacing_um = 0.5;    ///< for tests of distance: a quarter of the fibre spacing
inline constexpr double kPointSpacing_um = 2;      ///< of finished fibres: 20 um of radius deviates by 25 nm
inline constexpr int kMaxTries = 20000;            ///< to place one thing: every loop ends

/// Unit normal of the outline at point i, into the cell.
Vec2 inward_normal(const Sketch& sketch, int i);
/// Is the adhesion inside the outline, clear of all others and of all fibres?
bool has_room(const Sketch& sketch, const Adhesion& adhesion);

/// Draw the outline into an empty sketch. Of n_edge arcs, the longest, bundles draw the edge further in.
void draw_outline(Sketch& sketch, Random& random);
/// Draw one fibre of the type and the adhesions at its ends, which grow with its tension.
void draw_fibre(Sketch& sketch, FibreType type, double tension_nN, Random& random);
/// Draw a ventral fibre alongside the last one. Where `tension_nN` needs large adhesions these are staggered.
void draw_neighbour(Sketch& sketch, double tension_nN, Random& random);
/// Draw all fibres of a dense cell: edge bundles, carpets of ventral fibres that fan out, merge and cross, fans of
/// dorsal fibres, stacks of arcs; and the adhesions that hold them, some of which hold two or three.
/// @param tension_nN  of the next fibre of a type
/// @returns the fibres' tensions, in their order
std::vector<double> draw_dense_fibres(Sketch& sketch, const std::function<double(FibreType)>& tension_nN,
                                      Random& random);
/// Fill up to n_adhesions with adhesions that hold no fibre, so that the mean area comes out.
void draw_free_adhesions(Sketch& sketch, Random& random);

/// Add a fibre with adhesions at the ends that have one; gives labels and types.
void add_fibre(Sketch& sketch, Polyline points_um, const Adhesion* start, const Adhesion* end);
/// Add a fibre of this type to adhesions that are there.
void add_fibre(Sketch& sketch, Polyline points_um, FibreType type, std::optional<int> start_id,
               std::optional<int> end_id);
/// @returns its label
int add_adhesion(Sketch& sketch, const Adhesion& adhesion);
/// An adhesion that holds a fibre of this tension at the end of it, along its direction.
Adhesion holding_adhesion(const CellParameters& parameters, Vec2 position_um, Vec2 along, double tension_nN,
                          Random& random);

/// Regular cells, whose forces are known by symmetry.
void draw_line(Sketch& sketch);
void draw_ring(Sketch& sketch);

}  // namespace mbtfm::drawing
