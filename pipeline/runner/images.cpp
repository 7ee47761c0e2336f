#include "pipeline/runner/images.h"

#include <fnmatch.h>

#include <algorithm>

#include "pipeline/contract/errors.h"

namespace mbtfm::runner {
namespace fs = std::filesystem;

void declare(ParameterList& list, ImageNames& names) {
  list.table("images");
  list.add("adhesion", names.adhesion, "image of the adhesions: a file name or glob in the cell folder");
  list.add("actin", names.actin, "image of the actin");
  list.add("beads_stressed", names.beads_stressed, "image of the beads while the cell pulls");
  list.add("beads_relaxed", names.beads_relaxed, "image of the beads after the cell was removed");
  list.add("displacement", names.displacement,
           "displacements from another program (CSV), taken instead of the beads' images; columns and unit: [track]");
}

const std::string& name_of_image(const ImageNames& names, const std::string& key) {
  if (key == "adhesion") return names.adhesion;
  if (key == "actin") return names.actin;
  if (key == "beads_stressed") return names.beads_stressed;
  if (key == "displacement") return names.displacement;
  MBTFM_ASSERT(key == "beads_relaxed");
  return names.beads_relaxed;
}

std::vector<ImageInput> images_of(const Stage& stage, const ImageNames& names) {
  if (stage.name != "track" || names.displacement.empty()) return stage.images;
  return {{"displacement", "displacement"}};
}

ImageMatch match_image(const fs::path& folder, const std::string& name_or_glob) {
  ImageMatch match{.files = {}, .pattern = name_or_glob};
  const fs::path exact = folder / name_or_glob;
  if (fs::is_regular_file(exact)) {
    match.files = {exact};
    return match;
  }
  const fs::path parent = exact.parent_path();
  if (!fs::is_directory(parent)) return match;
  const std::string pattern = exact.filename().string();
  for (const fs::directory_entry& entry : fs::directory_iterator(parent)) {
    const std::string name = entry.path().filename().string();
    if (entry.is_regular_file() && fnmatch(pattern.c_str(), name.c_str(), FNM_PERIOD) == 0) {
      match.files.push_back(entry.path());
    }
  }
  std::sort(match.files.begin(), match.files.end());
  return match;
}

fs::path resolve_image(const fs::path& folder, const ImageNames& names, const std::string& key) {
  const ImageMatch match = match_image(folder, name_of_image(names, key));
  if (match.files.size() == 1) return match.files.front();
  if (match.files.empty()) {
    throw InputError(folder.string(), "an image '" + match.pattern + "'", "none",
                     "put it there, or name the file or a glob as '" + key + "' in [images] of cell.toml");
  }
  std::string list;
  for (const fs::path& file : match.files) list += (list.empty() ? "" : ", ") + file.filename().string();
  throw InputError(folder.string(), "one image '" + match.pattern + "'",
                   std::to_string(match.files.size()) + ": " + list,
                   "make '" + key + "' in [images] of cell.toml fit one of them only");
}

}  // namespace mbtfm::runner
