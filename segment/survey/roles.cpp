#include "segment/survey/roles.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "pipeline/contract/errors.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"

namespace mbtfm::survey {
namespace {

constexpr std::array kBeads = {"bead", "fluosphere", "tfm", "gel"};
constexpr std::array kRelaxed = {"relax", "ref",    "after",   "null", "tryps",   "sds",
                                 "post",  "nocell", "no_cell", "zero", "undeform"};
constexpr std::array kStressed = {"stress", "before", "pre", "load", "deform", "withcell", "with_cell", "force"};
constexpr std::array kSeries = {"frame", "series", "movie", "time"};
constexpr std::array kSurface = {"surf"};
constexpr std::array kAdhesion = {"pax", "vinc", "zyx", "adhes", "fak", "talin", "integrin", "_fa", "fa_"};
constexpr std::array kActin = {"actin", "phall", "_act", "act_", "fiber", "fibre", "utroph", "ftract"};

template <class Words>
bool has_any(std::string_view name, const Words& words) {
  return std::ranges::any_of(words, [&](std::string_view word) { return name.find(word) != name.npos; });
}

/// Empty if the name shows no role.
std::string key_of(const std::string& file) {
  const std::string name = files::lower_case(file);
  const bool is_adhesion = has_any(name, kAdhesion), is_actin = has_any(name, kActin);
  if (!has_any(name, kBeads)) {
    if (is_adhesion && is_actin) return "";
    if (is_adhesion) return "adhesion";
    if (is_actin) return "actin";
  }
  if (has_any(name, kBeads) && has_any(name, kSurface)) return "surface_beads";
  if (has_any(name, kRelaxed)) return "beads_relaxed";  // "undeformed", too, which has "deform" in it
  return has_any(name, kStressed) ? "beads_stressed" : "";
}

/// None where there are several.
std::optional<std::string> series_in(const std::filesystem::path& folder) {
  std::vector<std::string> found;
  for (const fs::path& below : files::visible_in(folder)) {
    const std::string name = below.filename().string(), small = files::lower_case(name);
    const bool is_named = has_any(small, kSeries) || has_any(small, kBeads) || has_any(small, kStressed);
    if (is_named && files::is_folder(below) && images_in(below).size() > 1) found.push_back(name);
  }
  return found.size() == 1 ? std::optional(found.front()) : std::nullopt;
}

}  // namespace

std::vector<std::string> images_in(const std::filesystem::path& folder) {
  constexpr std::array<std::string_view, 5> kEndings = {".tif", ".tiff", ".png", ".jpg", ".jpeg"};
  std::vector<std::string> names;
  for (const fs::path& file : files::visible_in(folder))
    if (std::ranges::find(kEndings, files::lower_case(file.extension().string())) != kEndings.end() &&
        files::is_file(file))
      names.push_back(file.filename().string());
  return names;
}

std::vector<std::string> frames_in(const std::filesystem::path& folder) {
  std::vector<std::string> names = images_in(folder);
  if (names.empty()) throw InputError(folder.string(), "images (.tif, .tiff, .png, .jpg, .jpeg)", "none");
  return names;
}

Roles roles_of(const std::filesystem::path& folder) {
  std::map<std::string, std::vector<std::string>> by_key;
  Roles roles;
  for (const std::string& name : images_in(folder)) by_key[key_of(name)].push_back(name);
  for (const auto& [key, files] : by_key)
    if (!key.empty() && files.size() == 1)
      roles.files[key] = files.front();
    else
      roles.unknown.insert(roles.unknown.end(), files.begin(), files.end());
  std::ranges::sort(roles.unknown);
  if (const auto series = series_in(folder)) roles.files.try_emplace("beads_stressed", *series);
  return roles;
}

}  // namespace mbtfm::survey
