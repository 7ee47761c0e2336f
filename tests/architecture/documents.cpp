/// The pages of docs/ are in step with the program.
#include <regex>

#include "continuum/mean/outputs.h"
#include "continuum/sheet/borders.h"
#include "continuum/sheet/tables.h"
#include "continuum/solids/outputs.h"
#include "mbtfm/plan/tables.h"
#include "mbtfm/sheets/tables.h"
#include "mbtfm/spatial/stage.h"
#include "mbtfm/tensions/tables.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/findings.h"
#include "pipeline/cost/study.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/tables.h"
#include "pipeline/runner/batch_table.h"
#include "pipeline/stage/plausible.h"
#include "pipeline/statistics/study_files.h"
#include "tests/support/plain_words.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

const fs::path kDocs = test::source_folder() / "docs";

TEST(Documents, the_examples_of_the_format_page_are_read) {
  const std::string page = files::read_text(kDocs / "formats.md");
  const std::regex example("```csv ([a-z_0-9]+\\.csv)\n([^`]*)```");
  const test::TemporaryFolder folder;
  int n_examples = 0;
  for (std::sregex_iterator at(page.begin(), page.end(), example), end; at != end; ++at, ++n_examples)
    files::write_text(folder / (*at)[1], (*at)[2].str());
  EXPECT_EQ(n_examples, 8);
  EXPECT_EQ(files::read_cell(folder.path()).fibres.size(), 2u);
  EXPECT_EQ(files::read_displacement(folder / "displacement.csv").size(), 2u);
  EXPECT_EQ(files::read_displacement_in_space(folder / "displacement_3d.csv").size(), 2u);
  EXPECT_EQ(files::read_tensions(folder / "tensions.csv").size(), 3u);
  EXPECT_EQ(files::read_adhesion_forces(folder / "adhesion_forces.csv").size(), 2u);
}

constexpr const char* kStages[] = {"segment", "track", "network", "contract", "fit",      "traction",
                                   "plan",    "sheet", "indent",  "mean",     "simulate", "stats"};

/// What a new user sets first, and then asks for.
struct Needed {
  const char *stage, *table, *key;
};
constexpr Needed kNeeded[] = {{"segment", "", "pixel_size_um"},    {"fit", "gel", "youngs_modulus_kPa"},
                              {"fit", "gel", "poisson_ratio"},     {"fit", "gel", "thickness_um"},
                              {"segment", "segment", "adhesions"}, {"segment", "segment", "fibre_false_per_cell"},
                              {"track", "track", "method"},        {"track", "track", "z_points"},
                              {"fit", "substrate", "model"},       {"fit", "fit", "n_meshes"}};

/// The cells of a parameter's row: key, default, value, meaning.
std::vector<std::string> row_of(const std::string& output, const Needed& needed) {
  const std::string table = needed.table, key = needed.key;
  const std::string title = table.empty() ? "### Above the first table" : "### `[" + table + "]`";
  std::istringstream lines(output);
  bool is_table = false;
  std::vector<std::string> cells;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("### ")) is_table = line == title;
    if (!is_table || !line.starts_with("| `" + key + "` |")) continue;
    std::string rest = line.substr(2, line.size() - 4);
    for (auto end = rest.find(" | "); end != rest.npos; end = rest.find(" | ")) {
      cells.push_back(rest.substr(0, end));
      rest.erase(0, end + 3);
    }
    cells.push_back(rest);
    break;
  }
  EXPECT_EQ(cells.size(), 4u) << needed.stage << ": " << title << ": " << key;
  cells.resize(4);
  return cells;
}

std::string needed_table(const std::map<std::string, std::string>& outputs) {
  std::string text =
      "\n## The ten you need\n\nThe first four set the size of every force: check them first. The others help if a "
      "result is not what you expect.\n\n| key | table | program | default | meaning |\n|---|---|---|---|---|\n";
  for (const Needed& needed : kNeeded) {
    const std::vector<std::string> cells = row_of(outputs.at(needed.stage), needed);
    const std::string table = needed.table;
    text += "| " + cells[0] + " | " + (table.empty() ? "above the first" : "`[" + table + "]`") + " | `mbtfm-" +
            needed.stage + "` | " + cells[1] + " | " + cells[3] + " |\n";
  }
  return text;
}

std::string parameter_page() {
  std::map<std::string, std::string> outputs;
  for (const char* stage : kStages) {
    const std::string outcome = test::output_of("mbtfm-" + std::string(stage) + " --parameters");
    outputs[stage] = outcome;
  }
  std::string page =
      "# Parameters\n\nMade by the programs themselves (`mbtfm-<stage> --parameters`). Each is a key of `cell.toml` "
      "and a flag of its\nprogram; flags win. `mbtfm-simulate` reads its tables from a scenario file. How much is "
      "computed is set\nby a flag of `mbtfm run`: `--preset` ([accuracy and cost](accuracy-and-cost.md)).\n" +
      needed_table(outputs);
  for (const char* stage : kStages) page += "\n## `mbtfm-" + std::string(stage) + "`\n" + outputs[stage];
  return page;
}

/// Who reads one row, in --help or on the page, needs no other to understand it.
TEST(Documents, a_parameters_meaning_stands_alone_in_plain_words) {
  const std::regex leans(R"(^(of|unless|the same|their|its|likewise)\b)");
  int n_rows = 0;
  for (const std::string& line : test::lines_of_prose(parameter_page())) {
    for (const std::string& found : test::unplain_words_in(line)) ADD_FAILURE() << found;
    const auto last = line.rfind(" | ");
    if (!line.starts_with("| code |") || last == line.npos) continue;
    ++n_rows;
    EXPECT_FALSE(std::regex_search(line.substr(last + 3), leans)) << line;
  }
  EXPECT_GE(n_rows, 300);
}

/// With MBTFM_WRITE_DOCS the page is written.
void expect_page(const char* name, const std::string& page) {
  if (std::getenv("MBTFM_WRITE_DOCS") != nullptr) files::write_text(kDocs / name, page);
  EXPECT_EQ(files::read_text(kDocs / name), page) << "MBTFM_WRITE_DOCS=1 build/tests/architecture_tests";
}

TEST(Documents, the_parameter_page_is_what_the_programs_declare) { expect_page("parameters.md", parameter_page()); }

std::string column_page() {
  return "# Columns\n\nEvery table of a cell folder, a batch and a study, column by column. The other files are in\n"
         "[formats.md](formats.md). *May be missing*: older files, or files made elsewhere, need not have this "
         "column.\n"
         "Results have six significant digits; numbers that a later stage computes with have all digits.\n" +
         files::pages_of_cell_tables() + tensions::pages_of_tables() + tractions::pages_of_tables() +
         sheet::pages_of_tables() + sheet::pages_of_cells() + sheets::pages_of_tables() + solids::pages_of_tables() +
         mean::pages_of_tables() + spatial::pages_of_tables() + runner::pages_of_tables() + cost::pages_of_tables() +
         statistics::pages_of_tables() + plan::pages_of_tables();
}

TEST(Documents, the_page_of_columns_is_what_the_tables_declare) { expect_page("columns.md", column_page()); }

TEST(Documents, the_page_of_findings_is_what_the_program_declares) { expect_page("findings.md", findings_page()); }

TEST(Documents, the_page_of_plausible_values_is_the_table_that_the_programs_ask) {
  expect_page("plausible.md", stage::plausible_page());
}

/// tests/mutations.sh plants faults in the sources as they are: the text that each replaces is there, once.
TEST(Documents, the_list_of_planted_faults_fits_the_sources) {
  std::istringstream list(files::read_text(test::source_folder() / "tests/mutations.txt"));
  std::string name, file, old;
  int n_faults = 0;
  const auto expect_once = [&] {
    if (file.empty()) return;
    ++n_faults;
    const std::string source = files::read_text(test::source_folder() / file);
    const auto at = source.find(old);
    EXPECT_NE(at, source.npos) << name << ": no longer in " << file;
    if (at == source.npos) return;
    EXPECT_EQ(source.find(old, at + 1), source.npos) << name << ": twice in " << file;
  };
  for (std::string line; std::getline(list, line);) {
    if (line.starts_with("fault: ")) {
      expect_once();
      name = line.substr(7);
      file.clear();
      old.clear();
    }
    if (line.starts_with("in: ")) file = line.substr(4);
    if (line.starts_with("- ")) old += (old.empty() ? "" : "\n") + line.substr(2);
  }
  expect_once();
  EXPECT_GE(n_faults, 60);
}

/// Each test of tests/stability has its line in the catalogue, which says what is hard and what must come out.
TEST(Documents, the_catalogue_lists_every_hard_case) {
  const std::string page = files::read_text(kDocs / "developers/hard-cases.md");
  const std::regex any_test("\nTEST(?:_F|_P)?\\(\\w+, (\\w+)\\)");
  for (const auto& entry : fs::directory_iterator(test::source_folder() / "tests/stability")) {
    const std::string text = files::read_text(entry.path());
    for (std::sregex_iterator at(text.begin(), text.end(), any_test), end; at != end; ++at) {
      std::string name = (*at)[1];
      std::replace(name.begin(), name.end(), '_', ' ');
      EXPECT_TRUE(has_words(page, name + " |")) << name << ": give it a row in docs/developers/hard-cases.md";
    }
  }
}

}  // namespace
}  // namespace mbtfm
