/// Displacements that other programs keep in another form than a row for each vector.
#pragma once

#include <filesystem>
#include <optional>

#include "pipeline/files/foreign_table.h"
#include "segment/beads/track.h"
#include "segment/images/image.h"

namespace mbtfm::beads {

/// Places and displacements of spots in two frames (TrackMate), as a table of vectors in the place of that of spots.
/// @returns tracks that have not one spot in each of both frames
/// @throws InputError
int make_vectors_of_spots(files::ForeignTable& table, const TrackParameters& parameters);

/// pyTFM's u.npy and v.npy: a lattice over the whole picture, first row on top, in px.
/// @throws InputError
files::ForeignTable read_pytfm(const std::filesystem::path& file, const std::optional<images::ImageField>& picture);

}  // namespace mbtfm::beads
