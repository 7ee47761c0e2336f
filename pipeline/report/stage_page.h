/// The page of what one program found, in the style of a cell's report: one file that needs nothing else.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pipeline/contract/figures.h"
#include "pipeline/contract/findings.h"
#include "pipeline/contract/path.h"
#include "pipeline/report/page.h"

namespace mbtfm::report {

/// "total force (nN)" of total_force_nN: a column's name and unit as people write them.
std::string heading_of(const std::string& column);

/// A table that a program wrote, as a page shows it: these columns, without those that are empty.
struct Listing {
  std::string title, explained;
  std::string name, csv;  ///< of the file, and what is in it
  /// Names between commas, each with another heading than heading_of() after a colon; with a star: its cells are names
  /// of columns, and shown as headings. "*quantity: measure, n_cells"
  std::string columns = {};
  /// Rows that have these words in these columns; empty: all.
  std::vector<std::pair<std::string, std::string>> only = {};
};

Table table_of(const Listing& listing);
/// With the link to the file; empty if no row is left.
std::string html_of(const Listing& listing);
/// A section with the table.
std::string section_of(const Listing& listing);
/// A section with a drawing of the program's own, no wider than the page.
std::string section_of_picture(const std::string& title, const std::string& svg_file, const std::string& explained);

/// Those of the fit of a cell or colony as a contracting sheet. @param of  put before the names of the downloads
std::vector<Listing> tables_of_sheet(const Path& estimates, const Path& models, const std::string& of = {});

/// What one program found: these sentences, its open findings with their remedies or a tick, its notes.
std::string list_of(const std::vector<std::string>& facts, const std::vector<Finding>& findings);

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
