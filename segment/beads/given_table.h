/// What the table of another program means: which columns are places and displacements, in which units, which rows its
/// program masked, and which way y points.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "pipeline/files/csv.h"
#include "segment/beads/track.h"

namespace mbtfm::beads {

/// A column that says of each row whether its program measured it.
enum class RowMark {
  zero_if_measured,  ///< a mask, or flags
  zero_if_masked,    ///< valid
  one_if_measured,   ///< PIVlab's type of a vector: 0 masked, 2 filled in from the neighbours
  positive_if_measured,
  code_of_imagej  ///< 999 filled in, -1 masked
};
struct MarkColumn {
  std::string name;
  RowMark mark = RowMark::zero_if_measured;
};

struct GivenTable {
  TableForm form = TableForm::plain;
  files::CsvTable rows;
  std::string x, y, ux, uy;
  std::string sigma = {};  ///< empty: none
  std::vector<MarkColumn> marks = {};
  double place_um = 1, displacement_um = 1, sigma_um = 1;  ///< the units that the numbers are in
  double first = 0;      ///< from the picture's corner to where the places count from, in their unit
  bool is_ours = false;  ///< columns by our own names, which mean our axes
  bool is_lattice = false;
  bool is_y_up = false;
  bool is_y_up_stated = true;  ///< by the program or the user, and not by the order of the rows
  std::string how = {};  ///< for people: "as PIVlab writes them: x [px], y [px], u [px/frame], v [px/frame] in px"
  int n_left_out = 0;    ///< spots that are not in both frames
};

/// @param picture  of the same field: pyTFM's arrays do not state their spacing
/// @throws InputError, UsageError with what to set
GivenTable read_given_table(const std::filesystem::path& file, const TrackParameters& parameters,
                            const std::optional<images::ImageField>& picture);

/// Why a row is not used by what its program says of it; empty: it was measured.
std::string flag_of(RowMark mark, const std::string& cell);

}  // namespace mbtfm::beads
