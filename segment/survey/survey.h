/// What a cell's images are good for, found in about a second: before a night's batch, not in place of it; and the
/// pictures of many cells side by side, where a wrong channel is seen in seconds.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/beads.h"
#include "segment/images/channels.h"
#include "segment/images/png.h"

namespace mbtfm::survey {

struct CellImages {
  std::optional<images::Channel> adhesion, actin, beads_stressed, beads_relaxed;  ///< as far as they are there
  DisplacementField given = {};                     ///< of another program, in place of the bead images
  std::optional<double> given_pixel_size_um;        ///< by cell.toml
  std::optional<double> given_beads_pixel_size_um;  ///< the same of the bead images alone
};

struct Survey {
  std::string facts;                ///< size, pixel, beads and their distance, margin: in one line
  std::vector<std::string> doubts;  ///< each: what was found, its limit and what to do
};

/// @throws InputError if neither an image nor cell.toml states the pixel size, or images that must be of one size are
/// not
Survey survey(const CellImages& images, int threads);

struct Thumbnail {
  std::string what;  ///< "adhesion"
  images::Picture picture;
};

/// Some 200 px a side: the cell's images reduced, of the bead images the middle as it is. Grey from the 1st to the
/// 99.5th percentile. Bead images come last, the relaxed one first, on one scale each.
std::vector<Thumbnail> thumbnails_of(const CellImages& images);

struct PageRow {
  std::string cell;                   ///< its name
  std::string facts;                  ///< in one line
  std::vector<std::string> doubts;    ///< or errors; none: fine
  std::vector<Thumbnail> thumbnails;  ///< of what could be read
};

/// One self-contained page, a row a cell. The two bead images take turns in one place.
std::string page_of(const std::string& title, const std::vector<PageRow>& rows);

}  // namespace mbtfm::survey
