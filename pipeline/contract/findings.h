/// What the program notices and a user should know. Every finding has a kind, declared in the one table of findings.cpp
/// with the threshold, its reason and the remedy; docs/findings.md is written from that table. From the records of the
/// stages the findings reach the terminal, run.json, batch.csv, run.log, the report and the study.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/words.h"

namespace mbtfm {

enum class Severity {
  note,     ///< worth knowing; the results hold
  caution,  ///< open: the results may be off by more than their error bars say
  bad       ///< open: what it names must not be used
};

constexpr auto words(Severity) { return std::array{"note", "caution", "bad"}; }

enum class FindingKind {
  // any stage
  unusual_value,
  assumed_input,
  lossy_image,
  saturated,
  pixel_size_unchecked,
  // segment
  adhesions_left_out,
  actin_shift,
  adhesions_long,
  bright_actin,
  bleed_through,
  adhesions_off_actin,
  outline_off_actin,
  adhesions_assumed,
  pattern_too_fine,
  pattern_as_cell,
  fibre_ends_anchored,
  input_not_used,
  // track
  nothing_moves,
  moves_outward,
  tracked_by_correlation,
  defocused,
  beads_not_round,
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

struct KindOfFinding {
  FindingKind kind;
  const char* id;  ///< its identity in files
  const char* stage;
  Severity severity;
  const char* number;  ///< what is asked, with its unit
  double threshold;    ///< a finding where the number is above it
  const char* reason;  ///< of the threshold
  const char* remedy;
};

const std::vector<KindOfFinding>& kinds_of_findings();
const KindOfFinding& properties_of(FindingKind kind);

/// As it is written to files and shown, complete in itself.
struct Finding {
  std::string id;
  Severity severity = Severity::note;
  std::string text;  ///< what was found, one to three sentences
  std::optional<double> number, threshold;
  std::string number_is;  ///< what the number is, with its unit
  std::string reason, remedy;
};

bool is_open(const Finding& finding);
bool has_open(const std::vector<Finding>& findings);

/// A finding where the number is above its kind's threshold, or is not a number.
std::optional<Finding> noticed(FindingKind kind, double number, const std::string& text);
/// The same, with another severity than the kind's own: where this case is milder or worse than the kind as a rule.
std::optional<Finding> noticed(FindingKind kind, double number, const std::string& text, Severity severity);

/// "caution (missing-fibre): text Remedy."
std::string line_of(const Finding& finding);
/// Identities of the open ones, each once, in their order: "missing-fibre; common-motion".
std::string open_ids(const std::vector<Finding>& findings);

/// docs/findings.md
std::string findings_page();

}  // namespace mbtfm
