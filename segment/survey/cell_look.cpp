#include "segment/survey/cell_look.h"

#include <map>

#include "pipeline/contract/numbers.h"
#include "pipeline/files/own_files.h"
#include "pipeline/stage/console.h"
#include "pipeline/stage/parameters.h"
#include "segment/beads/given_field.h"
#include "segment/cells/segment_cell.h"
#include "segment/stacks/run.h"
#include "segment/survey/roles.h"

namespace mbtfm::survey {
namespace {

struct Chosen {
  cells::SegmentParameters segment;
  stacks::TrackStageParameters track;
};

Chosen chosen_in(const std::filesystem::path& toml) {
  Chosen chosen;
  stage::ParameterList of_segment, of_track;
  declare(of_segment, chosen.segment);
  stage::read_toml(of_segment, toml);
  declare(of_track, chosen.track);
  stage::read_toml(of_track, toml);
  return chosen;
}

/// Of a series, which is a folder, the first frame.
std::optional<images::Channel> channel(const std::optional<std::filesystem::path>& given,
                                       const images::PlaneChoice& choice) {
  if (!given) return std::nullopt;
  const std::filesystem::path file = files::is_folder(*given) ? *given / frames_in(*given).front() : *given;
  return images::Channel{.name = file.filename().string(), .image = images::read_image(file, choice)};
}

}  // namespace

CellImages read_images(const CellFiles& files) {
  const Chosen chosen = chosen_in(files.toml);
  CellImages images{.adhesion = channel(files.adhesion, chosen.segment.adhesion_plane),
                    .actin = channel(files.actin, chosen.segment.actin_plane),
                    .beads_stressed = channel(files.beads_stressed, chosen.track.track.stressed_plane),
                    .beads_relaxed = channel(files.beads_relaxed, chosen.track.track.relaxed_plane),
                    .given_pixel_size_um = chosen.segment.pixel_size_um,
                    .given_beads_pixel_size_um = chosen.track.track.beads_pixel_size_um};
  if (!files.displacement) return images;
  const auto& picture = images.adhesion ? images.adhesion : images.actin;
  std::optional<images::ImageField> field;
  if (picture) field = {picture->image.width, picture->image.height, {}};
  images.given = beads::read_given_field(*files.displacement, chosen.track.track, field).field;
  return images;
}

Survey survey_in_space(const CellFiles& files) {
  const Chosen chosen = chosen_in(files.toml);
  const stacks::StackLook look = stacks::look_at_stacks(*files.beads_relaxed, *files.beads_stressed, chosen.track, 1);
  Survey survey;
  survey.facts = std::to_string(look.width) + " x " + std::to_string(look.height) + " pixels of " +
                 images::in_um(look.pixel_um) + " x " + std::to_string(look.depth) + " slices of " +
                 images::in_um(look.step_um) + "; " + std::to_string(look.n_beads) + " beads in space, " +
                 brief(look.distance_um) + " um apart";
  constexpr int kEnough = 500;  // of the errors of good stacks, fewer resolve less than a cell of four adhesions
  if (look.n_beads < kEnough)
    survey.doubts.push_back("Few beads (limit " + std::to_string(kEnough) +
                            "): the map of tractions will be mostly smoothing. Use more beads, or a deeper stack.");
  return survey;
}

std::string text_of(const Seen& seen) {
  std::string text = seen.row.cell + ": ";
  text +=
      seen.error.empty() ? seen.row.facts + (seen.is_fine() ? "; fine" : "") : stage::warning("error: " + seen.error);
  if (!seen.hint.empty()) text += "\n  hint: " + seen.hint;
  for (const std::string& doubt : seen.row.doubts) text += "\n" + stage::warning("  caution: " + doubt);
  return text + "\n";
}

void mark_same_pictures(std::vector<Seen>& seen) {
  std::map<std::string, std::size_t> first;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i].sha256.empty()) continue;
    const auto [at, is_new] = first.emplace(seen[i].sha256, i);
    if (is_new || seen[at->second].beads == seen[i].beads) continue;
    seen[i].row.doubts.push_back(seen[i].beads.filename().string() + " is the same picture as that of " +
                                 seen[at->second].row.cell +
                                 ": a copy, or another cell of one field. A copy counts once.");
  }
}

std::string disk_doubt(const std::filesystem::path& folder, std::size_t n_cells) {
  // a picture, its field, its networks beside each image: measured on the demo cell and doubled
  constexpr double kBytesPerCell = 40e6;
  std::error_code error;
  const double free = static_cast<double>(std::filesystem::space(folder, error).available),
               needed = kBytesPerCell * static_cast<double>(n_cells);
  if (error || free > needed) return {};
  return "  caution: " + brief(free / 1e9) + " GB of the disk are free; the results of " + std::to_string(n_cells) +
         " cells may take " + brief(needed / 1e9) + " GB.\n";
}

std::string page_of_cells(const std::string& title, const std::vector<Seen>& cells) {
  std::vector<PageRow> rows;
  for (const Seen& seen : cells) {
    rows.push_back(seen.row);
    if (!seen.error.empty()) rows.back().doubts.insert(rows.back().doubts.begin(), seen.error);
  }
  return page_of(title, rows);
}

}  // namespace mbtfm::survey
