/// The pictures of many cells side by side: a wrong channel is seen in seconds.
#pragma once

#include <string>
#include <vector>

#include "segment/images/png.h"
#include "segment/survey/survey.h"

namespace mbtfm::survey {

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
