#include "pipeline/runner/all_cells.h"

#include <algorithm>
#include <sstream>

#include "pipeline/contract/errors.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/files/toml.h"
#include "pipeline/runner/images.h"
#include "pipeline/runner/run_cell.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::runner {

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
  const std::string before = files::is_file(file) ? files::read_text(file) : kMade;
  if (!before.starts_with(kMade))
    throw UsageError(file.string() +
                     " is not a file that mbtfm made, and segment.cell = 0 would overwrite it: move the "
                     "folder elsewhere, or choose one cell (segment.cell)");
  if (before != text.str()) files::write_whole(file, text.str());
  return cell;
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
