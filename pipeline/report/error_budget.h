/// What the error of each tension, and of the total force, is made of.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace mbtfm::report {

/// A quantity with its standard error and what each source adds to it; in squares these add up.
struct BudgetLine {
  std::optional<int> fibre_id = {};  ///< none: a sum of forces; 0: the actin network
  std::string type = {};             ///< of the fibre, or the sum's name
  double value_nN = 0, total_nN = 0;
  /// source, standard error; none where it is not known
  std::vector<std::pair<std::string, std::optional<double>>> parts_nN = {};
};

/// Of run.json; empty where it has none. @throws InputError where it is malformed
std::vector<BudgetLine> read_error_budget(const std::filesystem::path& run_file);

/// A chart and a table, as HTML. @param cell  name of the cell, for the table's download
std::string error_budget_html(const std::vector<BudgetLine>& budget, const std::string& cell);

}  // namespace mbtfm::report
