/// The pieces a page is made of, as HTML.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pipeline/charts/chart.h"
#include "pipeline/contract/path.h"

namespace mbtfm::report {

using charts::html_escaped;

/// Cells are HTML already.
struct Table {
  struct Column {
    Column(const char* text) : title(text) {}
    Column(std::string text, bool of_numbers) : title(std::move(text)), is_number(of_numbers) {}
    std::string title;
    bool is_number = false;  ///< aligned to the right and sorted as numbers
  };
  std::string caption = {};  ///< what it lists, for those who hear the page
  std::vector<Column> columns = {};
  std::vector<std::vector<std::string>> rows = {};
};

inline Table::Column number(std::string title) { return {std::move(title), true}; }

/// A file that a reader can take out of the page.
struct Download {
  std::string name, text = {};
};

/// A table whose rows sort by a click on a column's title.
std::string html_of(const Table& table);
/// The same with a link to its numbers, all digits of them.
std::string html_of(const Table& table, const Download& csv);
/// Two columns: name, value.
std::string html_of_pairs(const std::string& caption, const std::vector<std::pair<std::string, std::string>>& pairs);

/// The bytes of a picture as an address, for a self-contained page. @param type  "image/jpeg"
std::string data_address(const Path& picture, const char* type);

/// As HTML what programs write for terminals, too, in plain characters: a page has µ and ±.
std::string printed(const std::string& text);

/// A sentence begins so: "Control: ventral fibres".
std::string capitalised(std::string text);

/// A section with its line in the page's table of contents.
std::string section(const std::string& title, const std::string& content);
/// Folded until clicked.
std::string folded(const std::string& title, const std::string& content);
/// A chart that zooms and answers the mouse. @param legend  HTML below the frame
std::string figure(const charts::Chart& chart, const std::string& caption, const std::string& legend = {});

/// A page of any kind: a cell's, a sheet's, a plan's, a study's.
struct Page {
  std::string title;
  std::string what = {}, sub = {};  ///< below the title, larger and smaller
  std::string body = {};            ///< sections
};
/// The whole of it with its styles and scripts inside: it asks for nothing from anywhere.
std::string html_of(const Page& page);

}  // namespace mbtfm::report
