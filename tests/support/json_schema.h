/// The JSON files of a cell against the schemas of docs/ (python3-jsonschema).
#pragma once

#include "pipeline/files/text.h"
#include "tests/support/folders.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::test {

/// What the validator says of the file; empty: it is valid. @param schema  of docs/, without its ending
inline std::string schema_errors(const std::filesystem::path& file, const std::string& schema) {
  const TemporaryFolder folder;
  const std::filesystem::path log = folder / "log";
  const std::string command = "python3 -W ignore -m jsonschema -i '" + file.string() + "' '" +
                              test::source_folder().string() + "/docs/" + schema + ".schema.json' > '" + log.string() +
                              "' 2>&1";
  const int status = std::system(command.c_str());
  const std::string said = files::read_text(log);
  return status != 0 && said.empty() ? "python3-jsonschema failed" : said;
}

inline void expect_schemas_hold(const std::filesystem::path& cell) {
  EXPECT_EQ(schema_errors(cell / "run.json", "run"), "");
  EXPECT_EQ(schema_errors(cell / "4_fit/fit.json", "fit"), "");
}

}  // namespace mbtfm::test
