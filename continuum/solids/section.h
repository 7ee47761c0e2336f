/// A cell as a section of a sphere, bonded to a gel by its flat face, and the mesh of both. z = 0 is the gel's surface,
/// z points into the gel; the cell lies at z < 0.
#pragma once

#include "continuum/solids/mesh.h"
#include "continuum/solids/solve.h"

namespace mbtfm::solids {

/// Height of the whole sphere of this volume, cbrt(6 V / pi), and of half of it, cbrt(3 V / (2 pi)).
double sphere_height_um(double volume_um3);
double hemisphere_height_um(double volume_um3);

struct Section {
  double volume_um3 = 0, height_um = 0;

  /// A = 2 V / h - pi h² / 3.
  double contact_area_um2() const;
  double contact_radius_um() const;
};

/// The gel under the cell: a cylinder, its base held, its side free.
struct Slab {
  double thickness_um = 60, radius_um = 100;
};

enum Part { kGel = 0, kCell = 1 };
inline constexpr int kSlabPatch = 0;  ///< u along r, v into the gel

struct Fineness {
  int order = 5;        ///< of the elements
  int towards_rim = 5;  ///< elements between the rim of the contact and half its radius, each a fifth of the next
};

struct SectionMesh {
  std::shared_ptr<const Mesh> mesh;
  Slab slab;
  double contact_radius_um = 0;

  /// In the gel. @throws InvalidData where it lies outside
  Mesh::Place in_gel(double r_um, double depth_um) const;
  Mesh::Place top_of_cell() const;
};

/// Whatever the section and the slab, it is cut the same way.
/// @throws InvalidData where the section is no section of a sphere, or the slab too narrow for it
SectionMesh section_mesh(const Section& section, const Slab& slab, const Fineness& fineness);

/// The base is held.
Unknowns unknowns_of(const SectionMesh& mesh);

}  // namespace mbtfm::solids
