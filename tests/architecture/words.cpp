/// Words that stand for a choice are read once, where a file, an argument or a flag is: from there on it is a value of
/// an enumeration (pipeline/contract/words.h), which the compiler knows.
#include <regex>

#include "pipeline/files/text.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

namespace mbtfm {
namespace {

const fs::path kRoot = test::source_folder();

/// Readers of formats whose words are not ours, or of tables that hold them.
const std::map<std::string, std::string> kReaders = {
    {"pipeline/files/vtu_file.cpp", "elements and attributes of VTU"},
    {"pipeline/files/vtu_data.cpp", "VTU's names of compressors"},
    {"pipeline/files/triangle_mesh.cpp", "extensions and words of STL, PLY and OBJ"},
    {"samples/plan/cell_numbers.cpp", "rows of a study's tables"},
    {"substrate/surface_main.cpp", "the extension of a height map"},
    {"continuum/outlines/rings.cpp", "extensions of outlines"},
    {"pipeline/files/csv.cpp", "true and false in CSV"},
    {"pipeline/files/fit_summary.cpp", "keys of fit.json"},
    {"pipeline/runner/cell_stages.cpp", "values of cell.toml that other programs declare"},
    {"pipeline/report/sheet_report.cpp", "values of sheet_fit.csv and of records"},
    {"pipeline/report/space_report.cpp", "values of traction.json and of records"},
    {"pipeline/stage/parameters.cpp", "tables, true and false of cell.toml and flags"},
    {"segment/images/stack.cpp", "the order of axes in OME-XML"},
    {"segment/rois/roi_set.cpp", "ImageJ's ROIs and their archives"},
    {"segment/beads/given_table.cpp", "words of other programs' tables"},
    {"segment/beads/table_columns.cpp", "units and numbers of other programs' columns"},
};

/// Paths, names of files, units of what a user types and the like: what no enumeration would make clearer.
constexpr std::size_t kMostElsewhere = 10;

/// "file:line: the line" of each comparison with a text that is written out, on either side.
std::vector<std::string> comparisons_in(const std::string& name, const std::string& text) {
  static const std::regex comparison(R"re([=!]=\s*"|"\s*[=!]=(?!=))re");
  std::vector<std::string> found;
  for (std::sregex_iterator at(text.begin(), text.end(), comparison), end; at != end; ++at) {
    const auto place = static_cast<std::size_t>(at->position());
    const std::size_t begin = text.rfind('\n', place) + 1, stop = text.find('\n', place);
    const auto line = 1 + std::count(text.begin(), text.begin() + at->position(), '\n');
    found.push_back(name + ":" + std::to_string(line) + ": " + text.substr(begin, stop - begin));
  }
  return found;
}

/// The text of each source of the product by its name.
std::map<std::string, std::string> sources() {
  std::map<std::string, std::string> found;
  for (const char* top : {"pipeline", "segment", "network", "substrate", "continuum", "mbtfm", "samples"})
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / top))
      if (const std::string extension = entry.path().extension(); extension == ".h" || extension == ".cpp")
        found[fs::relative(entry.path(), kRoot).generic_string()] = files::read_text(entry.path());
  return found;
}

std::map<std::string, std::vector<std::string>> comparisons() {
  std::map<std::string, std::vector<std::string>> found;
  for (const auto& [name, text] : sources())
    if (const auto in_file = comparisons_in(name, text); !in_file.empty()) found[name] = in_file;
  return found;
}

TEST(Words, a_comparison_with_a_written_text_is_seen_on_either_side_and_over_lines) {
  EXPECT_EQ(comparisons_in("a.cpp", "x\nif (loss == \"huber\") y;\n"),
            std::vector<std::string>{"a.cpp:2: if (loss == \"huber\") y;"});
  EXPECT_EQ(comparisons_in("a.cpp", "if (\"huber\" != loss)").size(), 1u);
  EXPECT_EQ(comparisons_in("a.cpp", "loss ==\n    \"huber\"").size(), 1u);
  EXPECT_TRUE(comparisons_in("a.cpp", "text = \"huber\"; f(\"a\", b == c);").empty());
}

TEST(Words, are_compared_as_texts_in_readers_only) {
  std::string places;
  std::size_t n = 0;
  for (const auto& [file, in_file] : comparisons()) {
    if (kReaders.contains(file)) continue;
    n += in_file.size();
    for (const std::string& place : in_file) places += "\n" + place;
  }
  EXPECT_LE(n, kMostElsewhere) << "declare an enumeration with words instead (CONTRIBUTING.md):" << places;
}

TEST(Words, readers_that_are_excused_compare_texts) {
  const auto found = comparisons();
  for (const auto& [file, reason] : kReaders) EXPECT_TRUE(found.contains(file)) << file << ": " << reason;
}

TEST(Words, data_determine_show_and_report_but_do_not_tell) {
  const std::regex quoted(R"("(\\.|[^"\\])*")"), told(R"((\b|_|k)(tells|[Tt]old)(\b|_)|//(?!/? @param t).*\btell\b)");
  for (const auto& [file, text] : sources()) {
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
      EXPECT_FALSE((line.find("tell") + 1 || line.find("told") + 1) &&
                   std::regex_search(std::regex_replace(line, quoted, ""), told))
          << file << ": " << line;
  }
}

}  // namespace
}  // namespace mbtfm
