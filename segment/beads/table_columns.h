/// The columns of a table of another program: which are meant, and in which units.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/files/foreign_table.h"
#include "segment/beads/given_table.h"
#include "segment/beads/track.h"
#include "segment/images/image.h"

namespace mbtfm::beads {

inline constexpr std::size_t kComponents = 4;  // x, y and the displacement along them

/// How long and how soon: "px/frame", "mm", "m/s".
struct Unit {
  double um = 0;     ///< 0: a pixel
  double per_s = 0;  ///< 0: a displacement; else a velocity
  bool operator==(const Unit&) const = default;
};
/// @returns nothing where it is none that is known
std::optional<Unit> unit_named(std::string text);

/// "Velocity u [m/s]": velocityu and m/s. "x_px": x and px.
struct ColumnName {
  std::string key;
  std::optional<Unit> unit;
};
ColumnName parts_of(const std::string& name);

/// Columns that say of each row whether it was measured, by their names' letters.
const std::map<std::string, RowMark>& known_marks();

/// What a parameter asks for, what it is by default, and which parameter that is.
struct Asked {
  const std::string& name;
  const std::string& own;
  const char* parameter;
};
std::array<Asked, kComponents> asked_for(const TrackParameters& p);

std::string how_to_set(const std::string& parameter, const std::string& value);
std::string without_marks(const std::string& name);

using Header = std::vector<std::string>;

struct Found {
  Header header;  ///< of the row that names the columns; their numbers if none does
  std::array<std::size_t, kComponents> columns{};
  std::vector<std::optional<Unit>> units;  ///< of each column, from its name or a row beneath
};

/// All lines above the numbers.
std::string text_above(const files::ForeignTable& table);
/// The names in quotes or between commas after `VARIABLES =`, over as many lines as they take.
Header variables_of(const files::ForeignTable& table);
/// The row that names the columns: the lowest above the numbers in which all that are needed are found.
/// @throws InputError
Found header_of(files::ForeignTable& table, const TrackParameters& parameters);
/// Columns that a program numbers from 0 or 1 in the first row, as data without a header.
void take_numbered_header(files::ForeignTable& table);

/// Places and displacements of spots in two frames (TrackMate), as a table of vectors in the place of that of spots.
/// @returns tracks that have not one spot in each of both frames
/// @throws InputError
int make_vectors_of_spots(files::ForeignTable& table, const TrackParameters& parameters);

/// pyTFM's u.npy and v.npy: a lattice over the whole picture, first row on top, in px.
/// @throws InputError
files::ForeignTable read_pytfm(const std::filesystem::path& file, const std::optional<images::ImageField>& picture);

}  // namespace mbtfm::beads
