/// The page of what one program found, in the style of a cell's report: one file that needs nothing else.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/figures.h"
#include "pipeline/contract/findings.h"

namespace mbtfm::report {

/// A table that the program wrote: these columns of it.
struct Listing {
  std::string title, explained;
  std::string name, csv;  ///< of the file, and what is in it
  std::vector<std::string> columns = {};
};

/// A section with the table.
std::string section_of(const Listing& listing);
/// A drawing of the program's own as a picture with a name, no wider than the page.
std::string picture_in_page(const std::string& svg_file, const std::string& name);

struct StagePage {
  std::string title = {};
  std::vector<std::string> facts = {};  ///< sentences: what was found, the most important first
  std::vector<Finding> findings = {};
  std::string picture_svg = {}, picture_title = {}, picture_explained = {};
  std::vector<Listing> tables = {};
  Figures figures = {};
};
std::string html_of(const StagePage& page);

}  // namespace mbtfm::report
