#include "pipeline/runner/verify.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/hash.h"
#include "pipeline/contract/json.h"
#include "pipeline/contract/names.h"

namespace mbtfm::runner {
namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace {

/// A file that run.json names.
struct KnownFile {
  std::string stage;
  std::string kind;  ///< "input" or "output"
  fs::path path;     ///< relative to the cell folder
  std::string sha256;
};

ordered_json read_run_json(const fs::path& file) {
  if (!fs::is_regular_file(file)) {
    throw InputError(file.string(), "a run.json of mbtfm run", "none", "run the cell first: mbtfm run");
  }
  try {
    ordered_json run = ordered_json::parse(read_text(file));
    run.at("stages");
    return run;
  } catch (const ordered_json::exception& error) {
    throw InputError(file.string(), "a run.json of mbtfm run", error.what());
  }
}

/// A stage's record lists files relative to its folder; of what the user gave, a hash by path in the cell folder.
void add_files(const std::string& kind, const Stage& stage, const ordered_json& entry, std::vector<KnownFile>& files) {
  const ordered_json list = entry.value(kind + "s", ordered_json::array());
  if (list.is_object()) {
    for (const auto& [path, sha256] : list.items()) files.push_back({stage.name, kind, path, sha256});
    return;
  }
  for (const ordered_json& file : list) {
    const fs::path path = fs::path(stage.folder) / file.at("file").get<std::string>();
    files.push_back({stage.name, kind, path.lexically_normal(), file.at("sha256")});
  }
}

std::vector<KnownFile> files_in(const ordered_json& run) {
  std::vector<KnownFile> files;
  for (const Stage& stage : stages()) {
    const ordered_json entry = run["stages"].value(stage.name, ordered_json::object());
    add_files("input", stage, entry, files);
    add_files("output", stage, entry, files);
  }
  return files;
}

void compare(const KnownFile& known, const fs::path& folder, Verification& found) {
  ++found.n_files;
  const std::string name = known.path.generic_string(), role = " (" + known.kind + " of " + known.stage + ")";
  const fs::path file = file_shown_as(folder, name);
  if (!fs::is_regular_file(file)) {
    found.differences.push_back(name + " is gone" + role);
  } else if (sha256_of_file(file) != known.sha256) {
    found.differences.push_back(name + " differs" + role);
  }
}

bool is_output(const KnownFile& file, const std::vector<KnownFile>& files) {
  return std::any_of(files.begin(), files.end(),
                     [&](const KnownFile& other) { return other.kind == "output" && other.path == file.path; });
}

bool is_given(const ordered_json& entry) {
  const std::string state = entry.value("state", "");
  return state == name_of(StageState::given) || state == name_of(StageState::replaced);
}

void add_values(const ordered_json& table, std::string& text) {
  for (const auto& [key, value] : table.items()) {
    if (!value.is_object() && !value.is_null()) text += key + " = " + value.dump() + "\n";  // as TOML writes them, too
  }
}

/// cell.toml of the parameters that the stages had, and of the images where they lie.
std::string toml_of(const ordered_json& run, const fs::path& inputs, const fs::path& out) {
  ordered_json all = ordered_json::object();
  for (const auto& [stage, entry] : run["stages"].items()) {
    if (!is_given(entry)) all.merge_patch(entry.value("parameters", ordered_json::object()));
  }
  std::string text;
  add_values(all, text);
  for (const auto& [table, values] : all.items()) {
    if (!values.is_object()) continue;
    text += "\n[" + table + "]\n";
    add_values(values, text);
  }
  text += "\n[images]\n";
  const ordered_json images = run.value("images", ordered_json::object());
  for (const auto& [key, file] : images.items()) {
    const fs::path path = file_shown_as(inputs, file.get<std::string>()).lexically_normal();
    if (fs::exists(path)) text += key + " = " + json_text(fs::proximate(path, out).generic_string()) + "\n";
  }
  return text;
}

/// The new folder: inputs where they lie, what the user gave copied.
void prepare(const ordered_json& run, const std::vector<KnownFile>& files, const fs::path& inputs,
             const fs::path& out) {
  Verification of_inputs;
  for (const KnownFile& file : files) {
    const bool was_given = file.kind == "output" && is_given(run["stages"][file.stage]);
    if (was_given || (file.kind == "input" && !is_output(file, files))) compare(file, inputs, of_inputs);
  }
  if (!of_inputs.differences.empty()) {
    throw InputError(inputs.string(), "the inputs of the run", of_inputs.differences.front(),
                     "--inputs names the folder where they are");
  }
  fs::create_directories(out);
  for (const KnownFile& file : files) {
    if (file.kind != "output" || !is_given(run["stages"][file.stage])) continue;
    fs::create_directories((out / file.path).parent_path());
    fs::copy_file(inputs / file.path, out / file.path);
  }
  write_whole(out / "cell.toml", toml_of(run, inputs, out));
}

}  // namespace

Verification verify_cell(const fs::path& cell) {
  const ordered_json run = read_run_json(cell / "run.json");
  Verification found;
  for (const KnownFile& file : files_in(run)) compare(file, cell, found);
  const Settings settings = read_settings(cell / "cell.toml");
  for (const Stage& stage : stages()) {
    const ordered_json entry = run["stages"].value(stage.name, ordered_json::object());
    if (is_given(entry)) continue;
    if (!entry.contains("run") || !entry["run"].value("finished", false)) {
      found.differences.push_back("stage " + stage.name + " has not ended");
    } else if (entry["run"].at("settings").dump() != ordered_json::parse(settings.at(stage.name)).dump()) {
      found.differences.push_back("cell.toml differs (parameters of " + stage.name + ")");
    }
  }
  return found;
}

Verification repeat_run(const fs::path& run_json, const fs::path& inputs, const fs::path& out,
                        const RunOptions& options, const std::function<void(const std::string&)>& note) {
  const ordered_json run = read_run_json(run_json);
  if (run.value("outcome", "") != "done") {
    throw InputError(run_json.string(), "a run that ended", "outcome '" + run.value("outcome", "unknown") + "'");
  }
  if (fs::exists(out)) throw InputError(out.string(), "a new folder to repeat the run in", "one that is there");
  if (run.value("version", "") != options.version)
    note("the run is of version " + run.value("version", "unknown") + ", this is " + options.version);
  const std::vector<KnownFile> files = files_in(run);
  prepare(run, files, inputs, out);
  run_cell(out, options);
  Verification found;
  for (const KnownFile& file : files) {
    if (file.kind == "output") compare(file, out, found);
  }
  return found;
}

}  // namespace mbtfm::runner
