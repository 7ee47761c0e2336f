/// Loads on a gel from files, and what they displace.
#pragma once

#include <optional>
#include <vector>

#include "pipeline/contract/path.h"
#include "substrate/gel_vtu.h"

namespace mbtfm::substrate {

/// Tractions of a lattice on a surface that is not flat: bilinear, as they are.
struct SurfaceLoad {
  SurfaceMesh mesh;
  VectorXd traction_kPa;  ///< three a vertex
};
struct Load {
  std::vector<Ellipse> ellipses;
  std::vector<Vec2> forces_nN;
  std::vector<double> into_the_gel_nN;  ///< by ellipse; empty: all lie along the surface
  std::optional<SurfaceLoad> lattice;   ///< instead of all these
  double into_nN(std::size_t ellipse) const { return into_the_gel_nN.empty() ? 0 : into_the_gel_nN[ellipse]; }
  std::size_t size() const { return lattice ? lattice->mesh.faces.size() : ellipses.size(); }
};

/// Forces of adhesions. @throws InputError where a force has no adhesion
Load read_forces(const Path& adhesions_file, const Path& file);
/// Tractions on a lattice, of a surface that is not flat. @throws InputError where it is no even lattice
SurfaceLoad read_surface_tractions(const Path& file);
/// Each patch as a disc of its area: the same force; the second moment is 5 % off, a side away 0.4 % of its field.
Load read_tractions(const Path& file);

/// Forces along the surface, as lengths, and into the gel: two an ellipse (nN).
VectorXd lengths_nN(const Load& load);
double largest_traction_kPa(const SurfaceLoad& load);

/// Write displacement_3d.csv at points of the gel's inside or of a surface that is not flat, or by forces into it.
/// @param points  a table; without z_um they lie on the surface. @param shape  of a surface that is not flat
/// @returns how many points, and the largest displacement
Figures write_in_space(const Path& file, const Path& points, const Substrate& model, const Load& load,
                       const std::optional<SurfaceShape>& shape);
/// Write displacement.csv at points of the surface; uz_um after its columns where the model has it.
Figures write_at_points(const Path& file, const Path& points, const Substrate& model, const Load& load);

}  // namespace mbtfm::substrate
