/// A displacement field from another program.
#pragma once

#include <filesystem>

#include "segment/track.h"

namespace mbtfm::segment {

/// Read scattered or gridded displacements, columns and unit as the parameters say; separated by commas, semicolons or
/// tabs. Nothing is dropped: rows are flagged `not a number`, `duplicate` (of an earlier position) and `neighbours
/// disagree`. Standard errors that lack are the robust scatter about the neighbours' affine motion where the field
/// changes least. The field is taken as it is: no drift is taken off.
/// @throws InputError
DisplacementField read_given_field(const std::filesystem::path& file, const TrackParameters& parameters);

/// Mean of the cosine between displacement and direction from the field's centre, weighted with displacement²: about
/// −0.7 around a contracting cell; positive where stressed and relaxed image are swapped. 0 for less than 20 beads that
/// move.
double outwardness(const DisplacementField& field);

}  // namespace mbtfm::segment
