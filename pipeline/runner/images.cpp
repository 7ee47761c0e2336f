#include "pipeline/runner/images.h"

#include <fnmatch.h>

#include <algorithm>
#include <iterator>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/runner/batch.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/suggest.h"

namespace mbtfm::runner {

namespace {

struct ImageKey {
  const char* key;
  std::string ImageNames::*member;
};
using N = ImageNames;
constexpr ImageKey kImages[] = {{"adhesion", &N::adhesion},
                                {"actin", &N::actin},
                                {"beads_stressed", &N::beads_stressed},
                                {"beads_relaxed", &N::beads_relaxed},
                                {"surface_beads", &N::surface_beads},
                                {"outline_roi", &N::outline_roi},
                                {"adhesion_rois", &N::adhesion_rois},
                                {"fibre_rois", &N::fibre_rois},
                                {"outline_mask", &N::outline_mask},
                                {"adhesion_mask", &N::adhesion_mask},
                                {"cell_labels", &N::cell_labels},
                                {"displacement", &N::displacement}};

}  // namespace

void declare(stage::ParameterList& list, ImageNames& names) {
  list.table("images");
  for (const ImageKey& image : kImages) list.add(image.key, names.*image.member);
  list.add("cell_with", names.cell_with);
}

std::vector<std::string> image_keys() {
  std::vector<std::string> keys;
  for (const ImageKey& image : kImages) keys.emplace_back(image.key);
  return keys;
}

bool is_image_key(const std::string& key) {
  return std::ranges::find(kImages, key, &ImageKey::key) != std::end(kImages);
}

const std::string& name_of_image(const ImageNames& names, const std::string& key) {
  const auto image = std::ranges::find(kImages, key, &ImageKey::key);
  MBTFM_ASSERT(image != std::end(kImages));
  return names.*image->member;
}

std::vector<ImageInput> images_of(const Stage& stage, const ImageNames& names) {
  if (!stage.instead || name_of_image(names, stage.instead->key).empty()) return stage.images;
  return {*stage.instead};
}

ImageMatch match_image(const fs::path& folder, const std::string& name_or_glob) {
  ImageMatch match{.pattern = name_or_glob};
  const fs::path exact = files::file_shown_as(folder, name_or_glob);
  if (files::is_file(exact) || (!name_or_glob.empty() && files::is_folder(exact))) {  // of the frames of a series
    match.files = {exact};
    return match;
  }
  if (const auto bar = name_or_glob.find('|'); bar != std::string::npos) {
    for (const std::string& part : {name_or_glob.substr(0, bar), name_or_glob.substr(bar + 1)})
      for (fs::path& file : match_image(folder, part).files) match.files.push_back(std::move(file));
    std::ranges::sort(match.files, files::is_before);
    match.files.erase(std::unique(match.files.begin(), match.files.end()), match.files.end());
    return match;
  }
  const fs::path parent = exact.parent_path();
  const std::string pattern = exact.filename().string();
  for (const fs::path& file : files::visible_in(parent))
    if (fnmatch(pattern.c_str(), file.filename().c_str(), 0) == 0 && files::is_file(file)) match.files.push_back(file);
  return match;
}

namespace {

constexpr std::string_view kOfPictures[] = {".tif", ".tiff", ".png", ".jpg", ".jpeg"};
constexpr std::string_view kOfMicroscopes[] = {".nd2", ".czi", ".lif", ".oib", ".oif"};

bool is_picture(const fs::path& file) {
  return std::ranges::find(kOfPictures, files::lower_case(file.extension().string())) != std::end(kOfPictures);
}

/// Where there is no such file: one that was probably meant; else what can be done.
std::string advice_on_missing(const fs::path& folder, const std::string& name, const std::string& key) {
  const std::string place = "'" + key + "' in [images] of cell.toml";
  if (name.find('\\') != name.npos) return "write folders with / in " + place;
  std::vector<fs::path> there = files::visible_in(folder);
  for (fs::path& file : there) file = file.filename();
  if (const fs::path link = files::file_shown_as(folder, name); fs::is_symlink(fs::symlink_status(link)))
    return "it is a link to " + fs::read_symlink(link).string() + ", which is not there: copy the picture here";
  for (const fs::path& file : there)
    if (files::folded(file.string()) == files::folded(name)) return "there is '" + file.string() + "': capitals count";
  for (const fs::path& file : there) {
    const std::string type = files::lower_case(file.extension().string());
    if (std::ranges::find(kOfMicroscopes, type) != std::end(kOfMicroscopes))
      return "there is '" + file.string() + "', a file of a microscope: save it as TIFF in Fiji (File > Import > " +
             "Bio-Formats, then File > Save As > Tiff), or: bfconvert '" + file.string() + "' '" +
             file.stem().string() + ".ome.tif'; then name it as " + place;
    if (files::folded(file.stem().string()) == files::folded(fs::path(name).stem().string()))
      return "there is '" + file.string() + "': name it as " + place;
  }
  for (const fs::path& below : there)
    if (files::is_file(folder / below / name)) return "it is in the folder '" + below.string() + "': move it up";
  std::erase_if(there, [](const fs::path& file) { return !is_picture(file); });
  constexpr std::size_t kShown = 6;
  std::string pictures;
  for (std::size_t k = 0; k < std::min(kShown, there.size()); ++k)
    pictures += (k == 0 ? "'" : ", '") + there[k].string() + "'";
  return there.empty()
             ? "put it there, or name the file or a glob as " + place
             : "name one of the pictures here as " + place + ": " + pictures + (there.size() > kShown ? " …" : "");
}

}  // namespace

std::string unused_pictures(const fs::path& cell, const ImageNames& names) {
  std::string missing, unused;
  for (const char* key : {"adhesion", "actin"})
    if (match_image(cell, name_of_image(names, key)).files.empty())
      missing += (missing.empty() ? "" : " or ") + std::string(key);
  if (missing.empty()) return "";
  std::vector<fs::path> used;
  for (const ImageKey& image : kImages)
    std::ranges::copy(match_image(cell, names.*image.member).files, std::back_inserter(used));
  for (const fs::path& file : files::visible_in(cell))
    if (is_picture(file) && std::ranges::find(used, file) == used.end())
      unused += (unused.empty() ? "" : ", ") + file.filename().string();
  return unused.empty()
             ? ""
             : "not used: " + unused + "; if it is the picture of " + missing + ", name it so in [images] of cell.toml";
}

fs::path other_half(const fs::path& file) {
  constexpr std::string_view kHalf = "u.npy";
  const std::string name = file.string();
  return name.ends_with(kHalf) ? fs::path(name.substr(0, name.size() - kHalf.size()) + "v.npy") : fs::path();
}

fs::path resolve_image(const fs::path& folder, const ImageNames& names, const std::string& key) {
  const ImageMatch match = match_image(folder, name_of_image(names, key));
  if (match.files.size() == 1) return match.files.front();
  if (match.files.empty()) {
    throw InputError(folder.string(), "a file '" + match.pattern + "'", "none",
                     advice_on_missing(folder, match.pattern, key));
  }
  std::string list;
  for (const fs::path& file : match.files) list += (list.empty() ? "" : ", ") + file.filename().string();
  throw InputError(folder.string(), "one file '" + match.pattern + "'",
                   std::to_string(match.files.size()) + ": " + list,
                   "make '" + key + "' in [images] of cell.toml fit one of them only");
}

std::optional<fs::path> resolve_image(const fs::path& folder, const ImageNames& names, const ImageInput& image) {
  if (image.need == ImageInput::Need::where_there) return resolve_optional_image(folder, names, image.key);
  return resolve_image(folder, names, image.key);
}

std::optional<fs::path> resolve_optional_image(const fs::path& folder, const ImageNames& names,
                                               const std::string& key) {
  const std::string& name = name_of_image(names, key);
  const bool is_default = name == name_of_image(ImageNames{}, key);
  // a link that leads nowhere is there, and somebody wants it
  std::error_code error;
  const bool is_there = fs::exists(fs::symlink_status(files::file_shown_as(folder, name), error));
  if (is_default && !is_there && match_image(folder, name).files.empty()) return std::nullopt;
  return resolve_image(folder, names, key);
}

namespace {

/// 0 where the folder is searched in vain.
std::size_t n_cells_below(const fs::path& folder) {
  try {
    return find_cells(folder).cells.size();
  } catch (const InputError&) {
    return 0;
  }
}

std::string parent_of(const fs::path& file) {
  const fs::path folder = file.parent_path();
  return folder.empty() ? "." : folder.string();
}

}  // namespace

void require_folder(const fs::path& folder, const std::string& expected) {
  if (files::is_folder(folder)) return;
  if (files::is_file(folder))
    throw InputError(folder.string(), expected, "a file", "give the folder that it is in: " + parent_of(folder));
  const std::string name = folder.filename().string();
  std::vector<std::string> names;
  for (const fs::path& other : files::visible_in(parent_of(folder))) names.push_back(other.filename().string());
  const std::string meant = stage::did_you_mean(names, name), path = folder.string();
  throw InputError(path, expected, "none",
                   path.starts_with("~") ? "~ in quotes is no folder: leave the quotes out, or write $HOME"
                   : path.find_first_of("*?") != path.npos
                       ? "* and ? stand for folders outside of quotes only; for many cells: mbtfm batch FOLDER"
                   : path.find("://") != path.npos ? "a path begins with /, not with file://"
                   : !meant.empty()
                       ? meant
                       : "give the folder of the cell's images and cell.toml, or of all cells, as seen from here");
}

ImageNames read_image_names(const fs::path& cell) {
  require_folder(cell, "a cell folder");
  if (!files::is_file(cell / "cell.toml")) {
    if (const std::size_t n = n_cells_below(cell); n > 0)
      throw InputError(cell.string(), "a cell folder with cell.toml",
                       "a folder of " + counted(static_cast<std::int64_t>(n), "cells"),
                       "to run them all: mbtfm batch " + cell.string());
    if (const fs::path above = fs::weakly_canonical(cell).parent_path(); files::is_file(above / "cell.toml"))
      throw InputError(cell.string(), "a cell folder with cell.toml", "a folder in a cell's own",
                       "give the cell: " + above.string() + ", or make one here: mbtfm init " + cell.string());
    const std::string misnamed = misnamed_settings(files::visible_in(cell));
    throw InputError(cell.string(), "a cell folder with cell.toml", "no cell.toml",
                     misnamed.empty() ? "to write one from what the images say: mbtfm init " + cell.string()
                                      : "rename " + misnamed + " to cell.toml");
  }
  ImageNames names;
  stage::ParameterList list;
  declare(list, names);
  stage::read_toml(list, cell / "cell.toml");
  return names;
}

}  // namespace mbtfm::runner
