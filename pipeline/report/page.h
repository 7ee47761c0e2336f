/// The pieces a page is made of, as HTML.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace mbtfm::report {

/// Cells are HTML already; `is_number` columns are aligned to the right and sorted as numbers.
struct Table {
  struct Column {
    std::string title;
    bool is_number = false;
  };
  std::vector<Column> columns;
  std::vector<std::vector<std::string>> rows;
};
/// A table whose rows sort by a click on a column's title.
std::string html_of(const Table& table);
/// Two columns: name, value.
std::string html_of_pairs(const std::vector<std::pair<std::string, std::string>>& pairs);

std::string section(const std::string& title, const std::string& content);
/// Folded until clicked.
std::string folded(const std::string& title, const std::string& content);
std::string figure(const std::string& title, const std::string& picture, const std::string& caption);

/// A whole page with its styles and its script inside: it asks for nothing from anywhere.
std::string page(const std::string& title, const std::string& body);

}  // namespace mbtfm::report
