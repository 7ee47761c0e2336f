#include "pipeline/runner/image_sets.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "pipeline/contract/errors.h"
#include "pipeline/files/json.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/files/toml.h"
#include "pipeline/runner/images.h"
#include "pipeline/runner/run_cell.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::runner {
namespace {

constexpr std::string_view kCell = "{cell}";

/// The pattern as a regular expression whose one group is the cell.
std::regex regex_of(const std::string& pattern) {
  std::string text;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    if (pattern.compare(i, kCell.size(), kCell) == 0) {
      text += "([^/]+)";
      i += kCell.size() - 1;
    } else if (pattern[i] == '*') {
      text += "[^/]*";
    } else if (pattern[i] == '?') {
      text += "[^/]";
    } else {
      if (std::string_view("\\^$.|()[]{}+").find(pattern[i]) != std::string_view::npos) text += '\\';
      text += pattern[i];
    }
  }
  return std::regex(text);
}

/// Images of one cell: path by key of [images].
using ImageSet = std::map<std::string, fs::path>;

/// Folders that cannot be read have no images: the patterns then find none of theirs.
void collect_files(const fs::path& folder, std::vector<fs::path>& files) {
  for (const fs::path& entry : files::visible_in(folder))
    if (files::is_own_folder(entry))
      collect_files(entry, files);
    else if (files::is_file(entry))
      files.push_back(entry);
}

std::map<std::string, ImageSet> group_images(const fs::path& folder, const std::vector<ImagePattern>& patterns) {
  std::map<std::string, ImageSet> sets;
  std::vector<fs::path> files;
  collect_files(folder, files);
  for (fs::path& file : files) file = file.lexically_relative(folder);
  for (const ImagePattern& p : patterns) {
    const std::regex regex = regex_of(p.pattern);
    const std::size_t n_before = sets.size();
    bool is_found = false;
    for (const fs::path& file : files) {
      std::smatch match;
      const std::string path = file.generic_string();
      if (!std::regex_match(path, match, regex)) continue;
      is_found = true;
      const auto [place, is_new] = sets[match[1].str()].emplace(p.key, file);
      if (!is_new) {
        throw InputError(folder.string(), "one image '" + p.pattern + "' of cell " + match[1].str(),
                         place->second.string() + " and " + path,
                         "make the pattern of '" + p.key + "' fit one of them");
      }
    }
    if (!is_found) {
      throw InputError(folder.string(), "images '" + p.pattern + "'",
                       "none among " + std::to_string(files.size()) + " files (" + std::to_string(n_before) +
                           " cells by the patterns before)",
                       "{cell} stands for the cell's name; sub-folders are written with /");
    }
  }
  return sets;
}

/// A basic string of TOML, whose escapes are those of JSON.
std::string quoted(const std::string& text) { return files::json_text(text); }

std::string toml_of(const std::string& settings, const ImageSet& images, const fs::path& folder, const fs::path& cell) {
  std::string text = settings;
  if (!text.empty() && text.back() != '\n') text += '\n';
  text += text.empty() ? "[images]\n" : "\n[images]\n";
  for (const auto& [key, file] : images)
    text += key + " = " + quoted((folder / file).lexically_relative(cell).generic_string()) + "\n";
  return text;
}

}  // namespace

ImagePattern parse_pattern(const std::string& text) {
  const auto equals = text.find('=');
  const ImagePattern p{text.substr(0, equals), equals == std::string::npos ? "" : text.substr(equals + 1)};
  ImageNames names;
  stage::ParameterList list;
  declare(list, names);
  stage::parameter_named(list, p.key);  // throws where there is none
  const auto cell = p.pattern.find(kCell);
  if (cell == std::string::npos || p.pattern.find(kCell, cell + 1) != std::string::npos)
    throw UsageError("--pattern " + text + ": expected {cell} once, as in " + p.key + "='{cell}_" + p.key + ".tif'");
  return p;
}

std::vector<std::string> make_cell_folders(const fs::path& folder, const std::vector<ImagePattern>& patterns,
                                           const fs::path& template_toml) {
  if (!files::is_folder(folder)) throw InputError(folder.string(), "a folder of images", "none");
  const std::string settings = template_toml.empty() ? "" : files::read_text(template_toml);
  if (std::regex_search(settings, std::regex(R"((^|\n)\s*\[images\])")))
    throw InputError(template_toml.string(), "settings without [images]", "[images]",
                     "the images of each cell come from --pattern");
  std::vector<std::string> cells;
  for (const auto& [name, images] : group_images(folder, patterns)) {
    // '.._pax.tif' is a name, too
    const fs::path cell = files::inside(folder, name, folder.string()), toml = cell / "cell.toml";
    cells.push_back(name);
    if (fs::exists(fs::symlink_status(toml))) continue;
    fs::create_directories(cell);
    files::write_whole(toml, toml_of(settings, images, folder, cell));
  }
  return cells;
}

namespace {

constexpr const char* kMade = "# Made by mbtfm run of ../cell.toml, which counts: changes here are lost.\n";

fs::path folder_of(const fs::path& folder, int n) {
  return files::inside(folder, "cell_" + std::to_string(n), folder.string());
}

/// The names or globs between the bars, one folder up.
std::string one_up(const std::string& names) {
  std::string up;
  std::istringstream parts(names);
  for (std::string name; std::getline(parts, name, '|');)
    up += (up.empty() ? "" : "|") + (fs::path(name).is_absolute() ? name : "../" + name);
  return up;
}

}  // namespace

bool asks_for_all_cells(const fs::path& folder) {
  if (!files::is_file(folder / "cell.toml")) return false;
  const toml::table toml = files::parse_toml(folder / "cell.toml");
  return toml["segment"]["cell"].value_or(std::int64_t{1}) == 0;
}

fs::path make_cell_of_picture(const fs::path& folder, int n) {
  toml::table toml = files::parse_toml(folder / "cell.toml");
  const ImageNames names = read_image_names(folder);
  for (const std::string& drawn : {names.outline_roi, names.fibre_rois})
    if (!match_image(folder, drawn).files.empty())
      throw UsageError((folder / drawn).string() + ": what is drawn by hand belongs to one cell: choose it " +
                       "(segment.cell), not all of them (segment.cell = 0)");
  toml::table images;
  if (const auto cell_with = toml["images"]["cell_with"].value<std::string>()) images.insert("cell_with", *cell_with);
  for (const std::string& key : image_keys()) {
    const std::string& name = name_of_image(names, key);
    const bool is_there = !match_image(folder, name).files.empty();
    if (!is_there && !toml["images"][key]) continue;
    images.insert(key, one_up(name));
  }
  toml.insert_or_assign("images", std::move(images));
  toml["segment"].as_table()->insert_or_assign("cell", std::int64_t{n});
  std::ostringstream text;
  text << kMade << toml::toml_formatter(toml) << "\n";
  const fs::path cell = folder_of(folder, n), file = cell / "cell.toml";
  fs::create_directories(cell);
  const bool is_there = files::is_file(file);
  if (is_there && !is_made_for_picture(cell))
    throw UsageError(file.string() +
                     " is not a file that mbtfm made, and segment.cell = 0 would overwrite it: move the "
                     "folder elsewhere, or choose one cell (segment.cell)");
  if (!is_there || files::read_text(file) != text.str()) files::write_whole(file, text.str());
  return cell;
}

bool is_made_for_picture(const fs::path& cell) {
  const fs::path file = cell / "cell.toml";
  return files::is_file(file) && files::read_text(file).starts_with(kMade);
}

int n_cells_in_picture(const fs::path& cell) {
  const StageReport report = stage::read_report(cell / "1_segment/record.json");
  const auto n = std::ranges::find(report.figures, "n_cells_in_image", [](const auto& f) { return f.first; });
  return n == report.figures.end() ? 1 : static_cast<int>(std::get<std::int64_t>(n->second));
}

std::vector<fs::path> cells_of_picture(const fs::path& folder) {
  const fs::path first = folder_of(folder, 1);
  if (!files::is_file(first / "cell.toml") || !asks_for_all_cells(folder)) return {};
  std::vector<fs::path> cells = {first};
  const int n = files::is_file(first / "1_segment/record.json") ? n_cells_in_picture(first) : 1;
  for (int i = 2; i <= n && files::is_file(folder_of(folder, i) / "cell.toml"); ++i)
    cells.push_back(folder_of(folder, i));
  return cells;
}

}  // namespace mbtfm::runner
