/// The list of the kinds of findings, for sources that name one.
#pragma once

#include "pipeline/contract/findings.h"

namespace mbtfm {

enum class FindingKind : int {
  // any stage
  unusual_value,
  assumed_input,
  lossy_image,
  saturated,
  pixel_size_unchecked,
  scan_phase,
  // segment
  adhesions_left_out,
  actin_shift,
  adhesions_long,
  bright_actin,
  bleed_through,
  adhesions_off_actin,
  outline_doubtful,
  outline_off_actin,
  cells_touch,
  adhesions_assumed,
  pattern_too_fine,
  pattern_as_cell,
  fibre_ends_anchored,
  input_not_used,
  // track
  vectors_masked,
  nothing_moves,
  moves_outward,
  tracked_by_correlation,
  defocused,
  beads_wide,
  beads_not_round,
  pattern_repeats,
  beads_lost,
  little_at_rest,
  slices_moved,
  beads_scatter,
  light_lost,
  // fit: the displacement
  common_motion,
  curved_motion,
  channel_shift,
  explains_little,
  read_otherwise,
  field_smoothed,
  unexplained_displacement,
  strain_beyond_linear,
  noise_unknown,
  noise_disagrees,
  beads_disagree_by_region,
  telling_beads_scatter,
  adhesions_without_beads,
  // fit: the cell
  cell_cut,
  neighbour_pulls,
  missing_fibre,
  missing_adhesion,
  fibre_without_tension,
  // fit: the answer
  not_identifiable,
  network_not_identifiable,
  wide_interval,
  tension_at_zero,
  single_mesh,
  forces_out_of_balance,
  torques_out_of_balance,
  // surface
  off_the_surface,
  surface_repaired,
  surface_level,
  surface_off_zero,
  // traction in space
  beads_off_the_gel,
  beads_far,
  beads_tell_little,
  misfit_in_space,
  patches_do_not_fit,
  tractions_out_of_balance,
  z_reversed,
  beads_stray,
  loss_decides,
  lambda_runs_away,
  // fit: the gel
  modulus_error_unknown,
  // indent
  contraction_beyond_linear,
  cases_not_solved,
  // mean
  registration_ambiguous,
  cells_left_out,
  few_cells,
  // sheet
  sheet_thick,
  sheet_strain,
  sheet_coarse,
  sheet_not_identifiable,
  sheet_unexplained,
  sheet_expands,
  sheet_at_bound,
  sheet_cut,
  tractions_off_balance,
  tractions_outside
};

}  // namespace mbtfm
