/// The effects of the physics, one switch each: the table [effects] of cell.toml.
///
/// `on` and `off` are obeyed, or refused where the scene or the method has no place for them. `auto`, the default, asks
/// one number of the scene, what leaving the effect out would cost, before the effect is paid for: it is on where that
/// number exceeds its threshold. docs/effects.md has the numbers.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/effects.h"
#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::stage {

struct EffectSwitches {
  Switch stress_fibres = Switch::automatic;
  Switch finite_thickness = Switch::automatic;
  Switch finite_sides = Switch::automatic;
  Switch depth_graded_gel = Switch::automatic;
  Switch vertical_displacement = Switch::automatic;
  Switch large_strain = Switch::automatic;
  Switch drift_affine = Switch::automatic;
  Switch common_motion = Switch::automatic;
  Switch beads_under_load = Switch::automatic;
  Switch channel_shift = Switch::automatic;
  Switch beyond_cut = Switch::automatic;
  Switch cable_elasticity = Switch::automatic;
  Switch robust_loss = Switch::automatic;
  Switch time_coupling = Switch::automatic;
  double effect_tolerance = 0.01;  ///< a tenth of the tensions' usual error bars: what is left out then does not show
};

/// Declare these keys of [effects]; a stage leaves the others' to them. @param names  members of EffectSwitches
void declare(ParameterList& list, EffectSwitches& switches, const std::vector<std::string>& names);

/// All keys of [effects] that the run of a cell has.
std::vector<std::string> effect_keys();

/// Whether an effect is on: as its switch says or, where that is `auto`, where `number` exceeds `threshold`.
/// @param found  what the number is, in words before it: "the base changes the field by"
Effect decided(EffectKind kind, Switch setting, double number, double threshold, const std::string& found);
/// The same where the scene either calls for it or does not.
Effect decided(EffectKind kind, Switch setting, bool is_called_for, const std::string& why);

/// "finite sides: off (auto): sides at 2.5 thicknesses change the field by 0.025, ...; 0.2 s"
std::string line_of(const Effect& effect);

}  // namespace mbtfm::stage
