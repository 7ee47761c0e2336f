/// Contracting colonies with known truth: what a scenario says of them, in the tables [colony] and [sheet].
#pragma once

#include "continuum/sheet/parameters.h"
#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::colonies {

enum class Shape {
  none,         ///< no colony: a cell with fibres, as all other scenarios
  disc,         ///< a round colony or cell
  spikes,       ///< a disc with spikes (thesis 4.2)
  doublet_on_h  ///< two cells on the letter H, with bundles along their free edges
};
constexpr auto words(Shape) { return std::array{"none", "disc", "spikes", "doublet-on-h"}; }

struct ColonyParameters {
  Shape shape = Shape::none;
  double radius_um = 100;  ///< a few hundred cells
  int n_spikes = 4;
  double spike_um = 50;            ///< beyond the disc
  double spike_half_width_um = 8;  ///< at half its height
  double pattern_um = 35;          ///< side of the H: two cells wide
  double bar_um = 7;               ///< width of its bars
  double sag = 0.13;               ///< of the free edges over their length, as edges with a bundle have
  int n_colonies = 1;
  double scatter_um = 0;          ///< of the colonies' places; above 0 they are turned at random, too
  int n_dipoles = 0;              ///< in each colony, at random: what single cells do
  double dipole_nN = 2;           ///< standard deviation of a dipole's force; it pulls or pushes
  double dipole_um = 10;          ///< distance of its two forces: a cell's size
  double dipole_radius_um = 1.5;  ///< of the discs they act on
};
void declare(stage::ParameterList& list, ColonyParameters& parameters);

}  // namespace mbtfm::colonies
