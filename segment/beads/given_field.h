/// A displacement field from another program.
#pragma once

#include <filesystem>

#include "pipeline/contract/effects.h"
#include "segment/beads/track.h"

namespace mbtfm::beads {

/// Read scattered or gridded displacements, columns and unit as the parameters say; separated by commas, semicolons or
/// tabs. Nothing is dropped: rows are flagged `not a number`, `duplicate` (of an earlier position) and `neighbours
/// disagree`. Standard errors that lack are the robust scatter about the neighbours' affine motion where the field
/// changes least. The field is taken as it is.
/// @throws InputError
DisplacementField read_given_field(const std::filesystem::path& file, const TrackParameters& parameters);

struct GivenMotion {
  CommonMotion common;
  Effect affine;
};

/// Take turn, growth and shear of the whole, and the shift found with them, off a field, as `drift_affine` says. Where
/// they are not taken off the field stays as it is: whoever made it has taken its drift off, or wants it.
GivenMotion take_affine_off(DisplacementField& field, const TrackParameters& parameters);

/// Mean of the cosine between displacement and direction from the field's centre, weighted with displacement²: about
/// −0.7 around a contracting cell; positive where stressed and relaxed image are swapped. 0 for less than 20 beads that
/// move.
double outwardness(const DisplacementField& field);

/// The gel moves outward, away from what is pushed, as if stressed and relaxed image were exchanged. Asked only where a
/// picture can tell: a part of it is at rest, the border cuts no cell, and no growth is left in the field.
/// @param is_affine_left  turn, growth or shear was found and not taken off
bool points_outward(const DisplacementField& field, const CommonMotion& common, bool is_affine_left);

}  // namespace mbtfm::beads
