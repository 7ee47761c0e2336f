#include "samples/colonies/parameters.h"

#include "pipeline/stage/parameters.h"

namespace mbtfm::colonies {

void declare(stage::ParameterList& list, ColonyParameters& p) {
  list.table("colony");
  list.add("shape", p.shape);
  list.add("radius_um", p.radius_um, Range::size_um());
  list.add("n_spikes", p.n_spikes, Range::between(1, 50));
  list.add("spike_um", p.spike_um, Range::size_um());
  list.add("spike_half_width_um", p.spike_half_width_um, Range::size_um());
  list.add("pattern_um", p.pattern_um, Range::size_um());
  list.add("bar_um", p.bar_um, Range::size_um());
  list.add("sag", p.sag, Range::between(0, 0.3));
  list.add("n_colonies", p.n_colonies, Range::between(1, 1000));
  list.add("scatter_um", p.scatter_um, Range::zero_or_size_um());
  list.add("n_dipoles", p.n_dipoles, Range::between(0, 10000));
  list.add("dipole_nN", p.dipole_nN, Range::force_nN());
  list.add("dipole_um", p.dipole_um, Range::size_um());
  list.add("dipole_radius_um", p.dipole_radius_um, Range::size_um());
}

}  // namespace mbtfm::colonies
