/// A displacement field from another program.
#pragma once

#include <filesystem>

#include "pipeline/contract/effects.h"
#include "pipeline/contract/findings.h"
#include "segment/beads/track.h"

namespace mbtfm::beads {

struct GivenField {
  DisplacementField field = {};
  TableForm form = TableForm::plain;
  std::string how = {};  ///< it was read, for people; empty: by our own names
  bool has_sigma = false;
  int n_left_out = 0;  ///< rows without a place, spots without a partner
  std::vector<Finding> findings = {};
};

/// Read scattered or gridded displacements, as people and other programs write them (foreign_table.h, given_table.h).
/// Nothing that has a place is dropped: rows are flagged `not a number`, `masked` (by their program, by a value that
/// many share, longer than the field), `filled in`, `duplicate` (of an earlier position) and `neighbours disagree`.
/// Missing standard errors are the robust scatter about the neighbours' affine motion where the field changes least.
/// @param picture  of the same field, if there is one
/// @throws InputError
GivenField read_given_field(const std::filesystem::path& file, const TrackParameters& parameters,
                            const std::optional<images::ImageField>& picture = std::nullopt);

struct GivenMotion {
  CommonMotion common;
  Effect affine;
  /// Length of the drift that the table holds, if it matters in which picture its places are and nobody said it.
  std::optional<double> unplaced_um = {};
};

/// Take the motion of the whole off a field. If its places are those of the relaxed picture, the motion of the stage is
/// taken off and added to the places. Otherwise turn, growth and shear, and the shift found with them, are taken off as
/// `drift_affine` says; if they are not, the field stays as it is: whoever made it has taken its drift off, or wants
/// it.
GivenMotion take_motion_off(DisplacementField& field, const TrackParameters& parameters);

/// Mean of the cosine between displacement and direction from the field's centre, weighted with displacement² in each
/// quarter about the centre, of all quarters alike: about −0.7 around a contracting cell; positive where stressed and
/// relaxed image are swapped. What a strong neighbour in a corner pulls outward lies in one quarter. 0 for less than 20
/// beads that move.
double outwardness(const DisplacementField& field);

/// The gel moves outward, away from what is pushed, as if stressed and relaxed image were exchanged. Asked only where a
/// picture can show it: a part of it is at rest, the border cuts no cell, and no growth is left in the field.
/// @param is_affine_left  turn, growth or shear was found and not taken off
bool points_outward(const DisplacementField& field, const CommonMotion& common, bool is_affine_left);

}  // namespace mbtfm::beads
