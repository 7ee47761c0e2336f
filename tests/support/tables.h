/// Tables that a test reads back.
#pragma once

#include "pipeline/files/csv.h"
#include "tests/support/test.h"

namespace mbtfm::test {

/// Row of a table where these columns have these texts.
inline int row_with(const files::CsvTable& table, const std::map<std::string, std::string>& texts) {
  for (int row = 0; row < table.n_rows(); ++row)
    if (std::ranges::all_of(texts, [&](const auto& t) { return table.text(row, t.first) == t.second; })) return row;
  throw std::runtime_error("no row with " + texts.begin()->first + " = " + texts.begin()->second);
}

}  // namespace mbtfm::test
