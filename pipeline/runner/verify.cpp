#include "pipeline/runner/verify.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/stage_state.h"
#include "pipeline/files/hash.h"
#include "pipeline/files/json.h"
#include "pipeline/files/json_record.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/record.h"
#include "pipeline/runner/run_cell.h"
#include "pipeline/runner/run_record.h"

namespace mbtfm::runner {
using nlohmann::ordered_json;

namespace {

enum class FileKind { input, output };
constexpr auto words(FileKind) { return std::array{"input", "output"}; }

/// A file that run.json names.
struct KnownFile {
  std::string stage;
  FileKind kind = FileKind::input;
  fs::path path;  ///< relative to the cell folder
  std::string sha256;
};

files::JsonRecord open_run_json(const fs::path& file) {
  if (!files::is_file(file))
    throw InputError(file.string(), "a run.json of mbtfm run", "none", "give a cell's folder, after mbtfm run");
  return files::JsonRecord(file, "a run.json of mbtfm run", "delete it and run the cell again: mbtfm run");
}

/// A stage's record lists files relative to its folder; of what the user gave, a hash by path in the cell folder.
void add_files(FileKind kind, const Stage& stage, const files::JsonRecord& entry, std::vector<KnownFile>& files) {
  const auto all = entry.find(name_of(kind) + std::string("s"));
  if (!all) return;
  if (all->json().is_object()) {
    for (const auto& [path, sha256] : all->members()) files.push_back({stage.name, kind, path, sha256.text()});
    return;
  }
  for (const files::JsonRecord& file : all->list()) {
    const fs::path path = fs::path(stage.folder) / file.at("file").text();
    files.push_back({stage.name, kind, path.lexically_normal(), file.at("sha256").text()});
  }
}

/// @throws InputError where a file that is called an output does not lie in the stage's folder
std::vector<KnownFile> files_in(const files::JsonRecord& run, const fs::path& run_json) {
  std::vector<KnownFile> files;
  for (const Stage& stage : all_stages()) {
    const auto entry = run.at("stages").find(stage.name);
    if (!entry) continue;
    add_files(FileKind::input, stage, *entry, files);
    add_files(FileKind::output, stage, *entry, files);
    for (const KnownFile& file : files)
      if (file.stage == stage.name && file.kind == FileKind::output)
        output_file(run_json.parent_path(), stage, file.path, run_json.string());
  }
  return files;
}

/// The files that settings name: they may lie anywhere.
std::vector<fs::path> named_images(const fs::path& cell) {
  const ImageNames names = read_image_names(cell);
  std::vector<fs::path> files;
  for (const Stage& stage : stages_of(cell, names).stages) {
    for (const auto& inputs : {images_of(stage, names), stage.optional_images}) {
      for (const ImageInput& image : inputs)
        for (fs::path& file : match_image(cell, name_of_image(names, image.key)).files)
          files.push_back(std::move(file));
    }
  }
  return files;
}

/// Does the file lie in the folder, or do the settings name it? Others are not even looked at.
bool may_be_read(const fs::path& name, const fs::path& folder, const std::vector<fs::path>& images) {
  std::error_code error;
  const fs::path file = fs::weakly_canonical(folder / name, error);
  const auto is_same = [&](const fs::path& image) {
    return fs::weakly_canonical(image, error) == file || fs::weakly_canonical(other_half(image), error) == file;
  };
  if (!error && std::ranges::any_of(images, is_same)) return true;
  try {
    files::inside(folder, name, "");
    return true;
  } catch (const InputError&) {
    return false;
  }
}

void compare(const KnownFile& known, const fs::path& folder, const std::vector<fs::path>& images, Verification& found) {
  ++found.n_files;
  const std::string name = known.path.generic_string(),
                    role = std::string(" (") + name_of(known.kind) + " of " + known.stage + ")";
  const fs::path file = files::file_shown_as(folder, name);
  if (!may_be_read(file.lexically_relative(folder), folder, images))
    found.differences.push_back(name + " is outside of the cell folder, and no setting names it: not read" + role);
  else if (!files::is_file(file))
    found.differences.push_back(name + " is gone" + role);
  else if (files::sha256_of_file(file) != known.sha256)
    found.differences.push_back(name + " differs" + role);
}

bool is_output(const KnownFile& file, const std::vector<KnownFile>& files) {
  return std::ranges::any_of(
      files, [&](const KnownFile& other) { return other.kind == FileKind::output && other.path == file.path; });
}

bool is_given(const std::optional<files::JsonRecord>& entry) {
  const std::string state = entry ? entry->text_or("state", "") : "";
  return state == name_of(StageState::given) || state == name_of(StageState::replaced);
}

bool is_given(const files::JsonRecord& run, const std::string& stage) { return is_given(run.at("stages").find(stage)); }

void add_values(const ordered_json& table, std::string& text) {
  for (const auto& [key, value] : table.items())
    if (!value.is_object() && !value.is_null()) text += key + " = " + value.dump() + "\n";  // as TOML writes them, too
}

/// The images that a run had, by key of [images].
std::map<std::string, fs::path> images_in(const files::JsonRecord& run, const fs::path& inputs) {
  std::map<std::string, fs::path> images;
  const auto list = run.find("images");
  if (!list) return images;
  for (const auto& [key, file] : list->members())
    images[key] = files::file_shown_as(inputs, file.text()).lexically_normal();
  return images;
}

/// cell.toml of the parameters that the stages had, and of the images where they lie.
std::string toml_of(const files::JsonRecord& run, const fs::path& inputs, const fs::path& out) {
  ordered_json all = ordered_json::object();
  for (const auto& [stage, entry] : run.at("stages").members()) {
    const auto parameters = entry.find("parameters");
    if (!parameters || is_given(entry)) continue;
    parameters->expect_object();
    all.merge_patch(parameters->json());
  }
  const ordered_json beside_images = all.value("images", ordered_json::object());  // what stages have in [images]
  all.erase("images");
  std::string text;
  add_values(all, text);
  for (const auto& [table, values] : all.items()) {
    if (!values.is_object()) continue;
    text += "\n[" + table + "]\n";
    add_values(values, text);
  }
  if (const auto of_run = run.find("run")) {
    of_run->expect_object();
    text += "\n[run]\n";
    add_values(of_run->json(), text);
  }
  text += "\n[images]\n";
  add_values(beside_images, text);
  for (const auto& [key, file] : images_in(run, inputs))
    if (files::is_file(file)) text += key + " = " + files::json_text(fs::proximate(file, out).generic_string()) + "\n";
  return text;
}

/// The new folder: inputs where they lie, what the user gave copied.
void prepare(const files::JsonRecord& run, const std::vector<KnownFile>& files, const fs::path& inputs,
             const fs::path& out) {
  std::vector<fs::path> images;
  for (const auto& [key, file] : images_in(run, inputs)) images.push_back(file);
  Verification of_inputs;
  for (const KnownFile& file : files) {
    const bool was_given = file.kind == FileKind::output && is_given(run, file.stage);
    if (was_given || (file.kind == FileKind::input && !is_output(file, files)))
      compare(file, inputs, images, of_inputs);
  }
  if (!of_inputs.differences.empty()) {
    throw InputError(inputs.string(), "the inputs of the run", of_inputs.differences.front(),
                     "--inputs names the folder where they are");
  }
  fs::create_directories(out);
  const auto is_put_in_place = [&](const KnownFile& file) {  // of a stage that the cell does not have
    return file.kind == FileKind::input && !is_output(file, files) &&
           std::ranges::any_of(all_stages(),
                               [&](const Stage& stage) { return *file.path.begin() == fs::path(stage.folder); });
  };
  for (const KnownFile& file : files) {
    if (!is_put_in_place(file) && (file.kind != FileKind::output || !is_given(run, file.stage))) continue;
    fs::create_directories((out / file.path).parent_path());
    fs::copy_file(inputs / file.path, out / file.path);
  }
  files::write_whole(out / "cell.toml", toml_of(run, inputs, out));
}

}  // namespace

Verification verify_cell(const fs::path& cell) {
  files::check_cell_folder(cell);
  const fs::path run_json = cell / "run.json";
  if (!files::is_own_file(run_json) && files::is_file(run_json))
    throw InputError(run_json.string(), "a file of the cell's own", "a link");
  const files::JsonRecord run = open_run_json(run_json);
  const std::vector<fs::path> images = named_images(cell);
  Verification found;
  for (const KnownFile& file : files_in(run, run_json)) compare(file, cell, images, found);
  const std::vector<Stage> stages = stages_of(cell, read_image_names(cell)).stages;
  const Settings settings = read_settings(cell / "cell.toml", stages);
  for (const Stage& stage : stages) {
    const auto entry = run.at("stages").find(stage.name);
    if (is_given(entry)) continue;
    const auto of_runner = entry ? entry->find("run") : std::nullopt;
    if (!of_runner || !of_runner->is_true_or("finished", false))
      found.differences.push_back("stage " + stage.name + " has not ended");
    else if (of_runner->at("settings").json().dump() != ordered_json::parse(settings.at(stage.name)).dump())
      found.differences.push_back("cell.toml differs (parameters of " + stage.name + ")");
  }
  return found;
}

Verification repeat_run(const fs::path& run_json, const fs::path& inputs, const fs::path& out,
                        const RunOptions& options, const std::function<void(const std::string&)>& note) {
  files::check_cell_folder(inputs);
  const files::JsonRecord run = open_run_json(run_json);
  const std::string outcome = run.text_or("outcome", "unknown"), version = run.text_or("version", "unknown");
  if (named<RunOutcome>(outcome) != RunOutcome::done)
    throw InputError(run_json.string(), "a run that ended", "outcome '" + outcome + "'");
  if (fs::exists(fs::symlink_status(out)))
    throw InputError(out.string(), "a new folder to repeat the run in", "one that is there");
  if (version != options.version) note("the run is of version " + version + ", this is " + options.version);
  const std::vector<KnownFile> files = files_in(run, run_json);
  prepare(run, files, inputs, out);
  run_cell(out, options);
  Verification found;
  for (const KnownFile& file : files)
    if (file.kind == FileKind::output) compare(file, out, {}, found);
  return found;
}

}  // namespace mbtfm::runner
