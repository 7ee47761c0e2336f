#include "docs/pages.h"

#include <map>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "continuum/sheet/borders.h"
#include "continuum/sheet/tables.h"
#include "continuum/solids/outputs.h"
#include "mbtfm/mean/outputs.h"
#include "mbtfm/sheets/bead_fit.h"
#include "mbtfm/tensions/tables.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/findings.h"
#include "pipeline/cost/study.h"
#include "pipeline/files/tables.h"
#include "pipeline/runner/batch_table.h"
#include "pipeline/runner/process.h"
#include "pipeline/stage/plausible.h"
#include "pipeline/statistics/study_files.h"
#include "samples/plan/tables.h"

namespace mbtfm::pages {
namespace {

constexpr const char* kStages[] = {"segment", "track", "network", "contract", "fit",      "traction",
                                   "plan",    "sheet", "indent",  "mean",     "simulate", "stats"};

/// What a new user sets first, and then asks for.
struct Needed {
  const char *stage, *table, *key;
};
constexpr Needed kNeeded[] = {{"segment", "", "pixel_size_um"},    {"fit", "gel", "youngs_modulus_kPa"},
                              {"fit", "gel", "poisson_ratio"},     {"fit", "gel", "thickness_um"},
                              {"segment", "segment", "adhesions"}, {"segment", "segment", "fibre_least_probability"},
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
  if (cells.size() != 4) throw std::runtime_error(std::string(needed.stage) + ": " + title + ": no row of " + key);
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

std::string output_of(const std::filesystem::path& program, const std::string& flag) {
  std::string output;
  const auto result = runner::run_process({program.string(), flag}, {}, [&](std::string_view text) { output += text; });
  if (result.exit_code != 0 || result.signal)
    throw std::runtime_error(program.string() + " " + flag + ": " + runner::how_it_ended(result) + ": " + output);
  return output;
}

/// A program's tables without the rows that were printed before: of these the keys, and whose they are.
/// @param first  the program that printed a row first, by its table and itself
std::string once_each(const std::string& program, const std::string& output,
                      std::map<std::pair<std::string, std::string>, std::string>& first) {
  std::string page, title, head, rows;
  std::map<std::string, std::string> keys_of;  // by program
  const auto end_table = [&] {
    if (title.empty()) return;
    page += title + "\n\n" + (rows.empty() ? "" : head + rows);
    std::string others;
    for (const auto& [name, keys] : keys_of) others += (others.empty() ? "" : "; ") + keys + " as for `" + name + "`";
    if (!others.empty()) page += (rows.empty() ? "" : "\n") + others + ".\n";
    head.clear(), rows.clear(), keys_of.clear();
  };
  std::istringstream lines(output);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("### ")) {
      end_table();
      title = "\n" + line;
    } else if (!line.starts_with("| `")) {
      head += line.empty() ? "" : line + "\n";
    } else if (const auto [row, is_new] = first.try_emplace({title, line}, program); is_new) {
      rows += line + "\n";
    } else {
      std::string& keys = keys_of[row->second];
      keys += (keys.empty() ? "" : ", ") + line.substr(2, line.find(" | ") - 2);
    }
  }
  end_table();
  return page;
}

}  // namespace

std::string parameter_page(const std::filesystem::path& programs) {
  std::map<std::string, std::string> outputs;
  for (const char* stage : kStages)
    outputs[stage] = output_of(programs / ("mbtfm-" + std::string(stage)), "--parameters");
  std::string page =
      "# Parameters\n\nMade by the programs themselves (`mbtfm-<stage> --parameters`). Each is a key of `cell.toml` "
      "and a flag of its\nprogram; flags win. What several programs have is explained with the first. "
      "`mbtfm-simulate` reads its tables\nfrom a scenario file: `samples/scenarios/u2os.toml` explains all keys of a "
      "cell, `patches-on-ring.toml` and\n`colony-spikes.toml` those of `[space]` and `[colony]`. How much is computed "
      "is set by a flag of `mbtfm run`:\n`--preset` ([accuracy](accuracy.md#presets-accuracy-and-time)).\n" +
      needed_table(outputs);
  std::map<std::pair<std::string, std::string>, std::string> first;
  for (const char* stage : kStages) {
    const std::string program = "mbtfm-" + std::string(stage);
    page += "\n## `" + program + "`\n" + once_each(program, outputs[stage], first);
  }
  return page;
}

std::string column_page() {
  return "# Columns\n\nEvery table of a cell folder, a batch and a study, column by column. The other files are in\n"
         "[the cell folder](formats/cell-folder.md). *May be missing*: older files, or files made elsewhere, need not "
         "have this column.\n"
         "Results have six significant digits; numbers that a later stage computes with have all digits.\n" +
         files::pages_of_cell_tables() + tensions::pages_of_tables() + tractions::pages_of_tables() +
         sheet::pages_of_tables() + sheet::pages_of_cells() + sheets::pages_of_tables() + solids::pages_of_tables() +
         mean::pages_of_tables() + runner::pages_of_tables() + cost::pages_of_tables() + statistics::pages_of_tables() +
         plan::pages_of_tables();
}

std::string made_page(const std::string& name, const std::filesystem::path& programs) {
  if (name == "parameters.md") return parameter_page(programs);
  if (name == "columns.md") return column_page();
  if (name == "findings.md") return findings_page();
  if (name == "plausible.md") return stage::plausible_page();
  throw std::runtime_error("no page is made of the name " + name);
}

}  // namespace mbtfm::pages
