/// How deep a contracting cell presses into its gel, by height of the cell and stiffness of the gel.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "continuum/solids/revolved.h"
#include "pipeline/contract/work.h"

namespace mbtfm::solids {

struct Setting {
  double volume_um3 = 0;
  Solid cell = {};
  Slab slab = {};
  double gel_poisson_ratio = 0.49;
  std::vector<double> depths_um = {0, 5};  ///< of reading, below the surface at rest
  Strain strain = Strain::small;
  Fineness fineness = {};
};

/// A case: the height of the cell and Young's modulus of the gel over the cell's.
struct Case {
  double height_um = 0, modulus_ratio = 1;
};

struct Reading {
  std::vector<double> depth_um;  ///< by depth of reading: the largest displacement into the gel there
  double lift_um = 0;            ///< largest displacement of the gel's surface out of it: near the contact's rim
  double largest_u_um = 0;       ///< anywhere
  double largest_u_gel_um = 0;
  double top_down_um = 0;  ///< of the cell's top, towards the gel
};

struct Indentation {
  Case of = {};
  double contact_radius_um = 0, contact_area_um2 = 0;
  Reading reading = {};
  Reading coarse = {};   ///< the same on a coarser mesh: an order and an element towards the rim less
  double error_um = 0;   ///< largest difference of the two
  double energy_fJ = 0;  ///< elastic, with what the contraction gains
  double imbalance = 0;  ///< net force of the cell on the gel over the sum of its parts; exactly none
  int iterations = 1;
  std::optional<std::string> failure = {};  ///< why there is no equilibrium: then only case and contact are known
};

/// @throws InvalidData as section_mesh and where a depth lies below the base; NotSolved as solve
Indentation indentation(const Setting& setting, const Case& of);
/// Many cases, side by side; the answer does not depend on the number of threads. A case that is not solved says why.
/// @throws InvalidData as indentation
std::vector<Indentation> indentations(const Setting& setting, const std::vector<Case>& cases, int threads,
                                      const Progress& progress);

/// The cell itself, deformed, on the fine mesh.
Deformed deformed_section(const Setting& setting, const Case& of);

/// A cell whose contact is no circle, in full.
struct OutlinedIndentation {
  Indentation of = {};  ///< its radius of the contact is that of the circle of the same area
  RevolvedBody deformed;
};
/// The volume follows from the contact and the height; the setting's is not read. Strains are small.
/// @throws InvalidData as sectors_of and revolved_mesh and where a depth lies below the base; NotSolved as solved
OutlinedIndentation indentation(const Setting& setting, const Case& of, const Contact& contact, int threads);

/// The height at which a depth of reading is largest, for one stiffness of the gel.
struct Optimum {
  double modulus_ratio = 0, read_at_um = 0;
  double height_um = 0, depth_um = 0, contact_area_um2 = 0;
  double height_error_um = 0;  ///< of the meshes (fine and coarse differ by that) and of the search
};

/// For each stiffness and depth of reading, by a parabola through the three best heights, solved again at its top until
/// that stays where it is. None where the best height is the first or the last, there are fewer than three, or a height
/// about it is not solved.
std::vector<Optimum> optima(const Setting& setting, const std::vector<Indentation>& solved, int threads);

}  // namespace mbtfm::solids
