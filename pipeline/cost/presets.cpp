/// Sets of parameters that trade accuracy for time together.
#include "pipeline/contract/errors.h"
#include "pipeline/cost/accuracy.h"

namespace mbtfm::cost {

// What each setting gains and costs: notes/cost-tables.md.
const std::vector<Preset>& presets() {
  static const std::vector<Preset> list = {
      {"fast",
       {{"track", "binning", "2"},              // half the time of tracking; beads that are hard to resolve are lost
        {"network", "edge_length_um", "2.5"},   // a third of the links, and of the time of their equilibrium
        {"fit", "surface_lines", "40"}},        // drawing the gel's surface finely takes as long as fitting a mesh
       {{"traction", "spacing_beads", "1.06"},  // with noise as near as a finer lattice, but to sparse maps
        {"substrate", "growth", "8"},           // half the elements: they cost more than all the rest
        {"substrate", "displacement_tolerance", "0.05"}}},
      {"standard", {}, {}},
      {"high",
       // the mean of more meshes, within 1 % of that of any number; what is left is that the cell is one network
       {{"fit", "n_meshes", "16"}, {"substrate", "cells_per_thickness", "3"}},
       // sparse maps come nearer to the truth; a finer gel would change a tenth of what noise does. Finer still, 500
       // beads have more unknowns than the dense operator takes
       {{"traction", "spacing_beads", "0.75"}}},
  };
  return list;
}

const Preset& preset_named(const std::string& name) {
  std::string names;
  for (const Preset& preset : presets()) {
    if (preset.name == name) return preset;
    names += (names.empty() ? "" : ", ") + preset.name;
  }
  throw UsageError("--preset: expected one of " + names + ", found '" + name + "'");
}

}  // namespace mbtfm::cost
