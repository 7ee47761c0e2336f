#include "samples/colonies/parameters.h"

#include "pipeline/stage/parameters.h"

namespace mbtfm::colonies {

void declare(stage::ParameterList& list, ColonyParameters& p) {
  list.table("colony");
  list.add("shape", p.shape,
           "none: a cell with fibres; disc, spikes: a colony or a cell that contracts evenly; doublet-on-h: two cells "
           "on a pattern like the letter H. The table [sheet] has what it is made of");
  list.add("radius_um", p.radius_um, Range::size_um(), "radius of the colony without its spikes (um)");
  list.add("n_spikes", p.n_spikes, Range::between(1, 50), "number of spikes");
  list.add("spike_um", p.spike_um, Range::size_um(), "length of a spike beyond radius_um (um)");
  list.add("spike_half_width_um", p.spike_half_width_um, Range::size_um(),
           "half of a spike's width, half way to its tip (um)");
  list.add("pattern_um", p.pattern_um, Range::size_um(), "side of the letter H (um)");
  list.add("bar_um", p.bar_um, Range::size_um(), "width of the bars of the letter H (um)");
  list.add("sag", p.sag, Range::between(0, 0.3),
           "depth over length of the cell's free edges between the bars of the letter H");
  list.add("n_colonies", p.n_colonies, Range::between(1, 1000),
           "number of colonies of the same shape and contraction, each in a folder of its own with its own dipoles and "
           "beads");
  list.add("scatter_um", p.scatter_um, Range::zero_or_size_um(),
           "standard deviation of a colony's place about the middle of the field (um); above 0 it is turned, too");
  list.add("n_dipoles", p.n_dipoles, Range::between(0, 10000),
           "number of pairs of opposite forces in a colony, at random: of mean zero over colonies");
  list.add("dipole_nN", p.dipole_nN, Range::force_nN(),
           "standard deviation of a force of these random pairs (dipoles) (nN)");
  list.add("dipole_um", p.dipole_um, Range::size_um(), "distance of the two forces of a random pair (um)");
  list.add("dipole_radius_um", p.dipole_radius_um, Range::size_um(),
           "radius of the discs on which the forces of a random pair act (um)");
}

}  // namespace mbtfm::colonies
