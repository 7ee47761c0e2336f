/// mbtfm-init: a cell.toml from what the files of a folder say, with notes on what is to be completed.
#include <filesystem>
#include <string>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/runner/batch.h"
#include "pipeline/runner/run_cell.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "segment/survey/cell_toml.h"
#include "segment/survey/roles.h"

namespace {

using namespace mbtfm;

/// A cell whose cell.toml others are made like.
struct Model {
  fs::path cell;
  std::string text;  ///< of its cell.toml
  runner::ImageNames images;
};

/// Every such text in quotes becomes another one.
void replace_quoted(std::string& text, const std::string& from, const std::string& to) {
  for (const std::string quote : {"\"", "'"})
    for (std::size_t at = 0; (at = text.find(quote + from + quote, at)) != text.npos; at += to.size())
      text.replace(at + 1, from.size(), to);
}

/// The name in the model's cell.toml, as it is or with this folder's name in place of the model's.
/// @throws InputError if neither is the name of one file here
void find_like(const Model& model, const std::string& key, const fs::path& folder, std::string& text) {
  const std::string name = runner::name_of_image(model.images, key),
                    theirs = fs::weakly_canonical(model.cell).filename(), ours = folder.filename();
  if (runner::match_image(model.cell, name).files.size() != 1) return;
  if (runner::match_image(folder, name).files.size() == 1) return;
  std::string other = name;
  for (std::size_t at = 0; (at = other.find(theirs, at)) != other.npos; at += ours.size())
    other.replace(at, theirs.size(), ours);
  if (runner::match_image(folder, other).files.size() != 1)
    throw InputError(folder.string(), "one file '" + other + "' (" + key + "), as in " + model.cell.string(),
                     std::to_string(runner::match_image(folder, other).files.size()),
                     "rename the picture, or write this one by itself: mbtfm init '" + folder.string() + "'");
  replace_quoted(text, name, other);
}

/// A cell.toml for each folder below that has pictures and none. Those that cannot be made are said, and stay.
StageReport init_like(stage::StageContext& context, bool& is_whole) {
  const fs::path study = context.input("cell", {}), cell = context.input("like", {"cell.toml"});
  const Model model{cell, files::read_text(cell / "cell.toml"), runner::read_image_names(cell)};
  int n_written = 0;
  std::string open;
  for (const runner::SkippedFolder& found : runner::search_cells(study).skipped) {
    if (!found.lacks_settings) {
      open += "\n  " + found.folder.string() + ": " + found.why;
      continue;
    }
    try {
      std::string text = model.text;
      for (const std::string& key : runner::image_keys()) find_like(model, key, found.folder, text);
      files::write_text(context.pending_path(found.folder / "cell.toml"), text);
      ++n_written;
    } catch (const InputError& error) {
      open += "\n  " + std::string(error.what()) + "; " + error.hint;
    }
  }
  is_whole = open.empty();
  StageReport report;
  report.summary = counted(n_written, "cell.toml", "cell.toml") + " written like that of " + cell.string() +
                   (open.empty() ? "" : "; not written:" + open);
  return report;
}

StageReport init(stage::StageContext& context, bool& is_whole) {
  if (context.has_input("like")) return init_like(context, is_whole);
  const fs::path folder = context.input("cell", {});
  runner::require_folder(folder, "a folder with the images of a cell");
  for (const fs::path& file : {folder / "cell.toml", context.outputs_.at("out")})
    if (fs::symlink_status(file).type() != fs::file_type::not_found)
      throw InputError(file.string(), "no cell.toml yet", "one", "it is yours: edit it, or rename it first");
  if (survey::images_in(folder).empty()) {
    for (const fs::path& below : files::visible_in(folder))
      if (files::is_folder(below) && !survey::images_in(below).empty())
        throw InputError(folder.string(), "images of a cell: TIFF, PNG or JPEG", "some in the folder " + below.string(),
                         "if that is the cell: mbtfm init '" + below.string() + "'; else move its images up");
    throw InputError(folder.string(), "images of a cell: TIFF, PNG or JPEG", "none",
                     "files of a microscope (nd2, czi, lif): in Fiji, File > Import > Bio-Formats, then File > Save As "
                     "> Tiff; or bfconvert IN OUT.ome.tif");
  }
  const survey::Written written = survey::cell_toml(folder);
  files::write_text(context.output("out"), written.text);
  StageReport report;
  report.summary = "cell.toml is written; complete in it: " + written.open;
  return report;
}

}  // namespace

int main(int argc, char** argv) {
  using enum mbtfm::stage::FileArgument::Kind;
  bool is_whole = true;
  const int code = mbtfm::stage::run_stage(
      {.name = "init", .files = {{"cell", input}, {"like", optional_input}, {"out", output}}}, argc, argv, [](auto&) {},
      [&](mbtfm::stage::StageContext& context) { return init(context, is_whole); });
  return code == mbtfm::exit_code::kDone && !is_whole ? mbtfm::exit_code::kFailed : code;
}
