/// A cell whose contact is no circle, on its gel: the half plane of the round cell carried around the axis, wider or
/// narrower as the outline asks for, and cut into sectors. Strains are small.
///
/// With R0 the radius of the circle of the contact's area and s(angle) = R(angle) / R0, R from the contact's centroid,
/// a place (r, z) of the half plane goes to the distance from the axis
///
///   cell:  s r               so each level of the cell has the shape of the contact, and the volume is the round one's
///   slab:  s r up to R0, from there straight to the slab's side:  s R0 + (r - R0) (W - s R0) / (W - R0).
///
/// Elements are hexahedra with nodes of Gauss and Lobatto along all three axes, with pressures of a degree less as in
/// element.h. Those at the axis are collapsed: their nodes there are one.
#pragma once

#include <array>

#include "continuum/solids/contact.h"

namespace mbtfm::solids {

/// Nodes and hexahedra. Element e of the half plane is e * sectors.n() + sector here.
struct RevolvedMesh {
  SectionMesh half_plane;
  Sectors sectors;
  std::vector<Vec3> position_um = {};  ///< x and y as the outline's
  std::vector<int> nodes = {};         ///< n_nodes() an element: along u fastest, then v, then the angle
  std::vector<int> part = {};          ///< by element

  int n_nodes() const { return half_plane.mesh->square.n_nodes() * (half_plane.mesh->square.order() + 1); }
  int n_elements() const { return static_cast<int>(part.size()); }
  const int* nodes_of(int element) const { return &nodes[static_cast<std::size_t>(element) * n_nodes()]; }
};

/// As fine as two processors solve in seconds.
inline constexpr Fineness kRevolvedFineness = {.order = 3, .towards_rim = 3};

/// @throws InvalidData as section_mesh and expect_on_slab
RevolvedMesh revolved_mesh(const Contact& contact, const Sectors& sectors, double height_um, const Slab& slab,
                           const Fineness& fineness);

struct RevolvedBody {
  RevolvedMesh mesh;
  std::vector<Solid> solids;               ///< by part
  std::vector<Vec3> displacement_um = {};  ///< by node
  double energy_fJ = 0;                    ///< elastic, with what the contraction gains: below zero

  /// @param share  of the sector's angle
  Vec3 displacement_um_at(const Mesh::Place& place, int sector, double share) const;
  /// With the contraction: xx, yy, zz, xy, yz, xz, in the middle of each hexahedron between nodes: order³ an element,
  /// along u fastest, then v, then the angle.
  std::vector<std::array<double, 6>> stress_kPa() const;
  /// Forces of a part's elements on the nodes.
  std::vector<Vec3> forces_nN(int part) const;
};

/// @throws NotSolved where the stiffness is lost in rounding; OutOfMemory where it does not fit
RevolvedBody solved(RevolvedMesh mesh, const std::vector<Solid>& solids, int threads);

}  // namespace mbtfm::solids
