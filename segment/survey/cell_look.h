/// What is seen of a cell before it is run: its images as cell.toml chooses them, and what it shares with others.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "segment/survey/survey.h"

namespace mbtfm::survey {

/// Images of a cell as its cell.toml names them.
struct CellFiles {
  std::filesystem::path toml = {};
  std::optional<std::filesystem::path> adhesion = {}, actin = {}, beads_stressed = {}, beads_relaxed = {};
  std::optional<std::filesystem::path> displacement = {};  ///< of another program, in place of the bead images
};

/// The planes that the stages will read. @throws InputError where a key or value of cell.toml is wrong
CellImages read_images(const CellFiles& files);

/// Of a cell whose beads are followed in space: do the stacks go together, and are there beads enough?
Survey survey_in_space(const CellFiles& files);

struct Seen {
  PageRow row = {};
  std::string error = {}, hint = {};  ///< why it could not be looked at
  std::filesystem::path beads = {};   ///< the picture while the cell pulls
  std::string sha256 = {};            ///< of it
  bool is_fine() const { return error.empty() && row.doubts.empty(); }
};

/// For a terminal.
std::string text_of(const Seen& seen);
/// A folder that was copied has the same picture in another file. Cells of one picture share the file.
void mark_same_pictures(std::vector<Seen>& seen);
/// What to say if the disk has no room for the results; empty: it has.
std::string disk_doubt(const std::filesystem::path& folder, std::size_t n_cells);
/// On the page what could not be looked at is a row, too.
std::string page_of_cells(const std::string& title, const std::vector<Seen>& cells);

}  // namespace mbtfm::survey
