/// mbtfm-check: what the images below a folder are good for, cell by cell, before a batch is run.
#include <algorithm>
#include <filesystem>
#include <map>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/hash.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/runner/batch.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/process.h"
#include "pipeline/runner/run_cell.h"
#include "pipeline/runner/told.h"
#include "pipeline/stage/console.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "segment/beads/given_field.h"
#include "segment/beads/track.h"
#include "segment/cells/segment_cell.h"
#include "segment/stacks/run.h"
#include "segment/survey/survey.h"

namespace {

using namespace mbtfm;

/// Which planes cell.toml chooses, as the stages will read them. @throws InputError where a key or value is wrong
struct Chosen {
  cells::SegmentParameters segment;
  beads::TrackParameters track;
  stacks::StackParameters in_space;
};

Chosen chosen_in(const fs::path& toml) {
  Chosen chosen;
  stage::ParameterList of_segment, of_track;
  declare(of_segment, chosen.segment);
  stage::read_toml(of_segment, toml);
  declare(of_track, chosen.track);
  int binning = 1;  // of the stage: images are looked at as they are
  of_track.table("track");
  declare(of_track, chosen.in_space);
  images::PlaneChoice surface_plane;
  declare(of_track, surface_plane, "surface");
  of_track.table("track");
  of_track.add("binning", binning, Range::between(1, images::kLargestBinning), "pixels of a side in one");
  stage::read_toml(of_track, toml);
  return chosen;
}

std::optional<images::Channel> channel(const fs::path& file, const images::PlaneChoice& choice) {
  return images::Channel{.name = file.filename().string(), .image = images::read_image(file, choice)};
}

survey::CellImages images_of(const fs::path& cell, const runner::ImageNames& names, CellKind kind) {
  const Chosen chosen = chosen_in(cell / "cell.toml");
  survey::CellImages images;
  images.given_pixel_size_um = chosen.segment.pixel_size_um;
  images.given_beads_pixel_size_um = chosen.track.beads_pixel_size_um;
  if (const auto file = runner::resolve_optional_image(cell, names, "adhesion"))
    images.adhesion = channel(*file, chosen.segment.adhesion_plane);
  // a sheet's outline may be a mask
  const auto actin = kind == CellKind::sheet ? runner::resolve_optional_image(cell, names, "actin")
                                             : runner::resolve_image(cell, names, "actin");
  if (actin) images.actin = channel(*actin, chosen.segment.actin_plane);
  if (!runner::name_of_image(names, "displacement").empty()) {  // of another program
    const auto& picture = images.adhesion ? images.adhesion : images.actin;
    std::optional<images::ImageField> field;
    if (picture) field = {picture->image.width, picture->image.height, {}};
    images.given =
        beads::read_given_field(runner::resolve_image(cell, names, "displacement"), chosen.track, field).field;
    return images;
  }
  images.beads_stressed = channel(runner::resolve_image(cell, names, "beads_stressed"), chosen.track.stressed_plane);
  images.beads_relaxed = channel(runner::resolve_image(cell, names, "beads_relaxed"), chosen.track.relaxed_plane);
  return images;
}

/// Of a cell whose beads are followed in space: do the stacks go together, and are there beads enough?
survey::Survey survey_in_space(const fs::path& cell, const runner::ImageNames& names) {
  const Chosen chosen = chosen_in(cell / "cell.toml");
  const stacks::StackLook look =
      stacks::look_at_stacks(runner::resolve_image(cell, names, "beads_relaxed"),
                             runner::resolve_image(cell, names, "beads_stressed"), chosen.track, chosen.in_space, 1);
  survey::Survey survey;
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

survey::Survey survey_of(const fs::path& cell, survey::CellImages& images) {
  const runner::ImageNames names = runner::read_image_names(cell);
  const CellKind kind = runner::stages_of(cell, names).kind;
  if (kind == CellKind::space) return survey_in_space(cell, names);
  images = images_of(cell, names, kind);
  return survey::survey(images, 1);
}

struct Seen {
  survey::PageRow row = {};
  std::string error = {}, hint = {};  ///< why it could not be looked at
  fs::path beads = {};                ///< the picture while the cell pulls
  std::string sha256 = {};            ///< of it
  bool is_fine() const { return error.empty() && row.doubts.empty(); }
};

/// What a stage of the cell says of cell.toml and, if it looks at them before it runs, of the images.
void add_refusals(const fs::path& cell, std::vector<std::string>& doubts) {
  runner::RunOptions options;
  options.stage_folder = runner::executable_folder();
  for (const runner::Stage& stage : runner::stages_of(cell, runner::read_image_names(cell)).stages) {
    try {
      runner::check_parameters(stage, cell / "cell.toml", options, [](std::string_view) {});
    } catch (const runner::StageFailed& refusal) {
      doubts.push_back(refusal.failure.message);
    }
  }
}

Seen look_at(const fs::path& cell, const std::string& name) {
  Seen seen{.row = {.cell = name, .facts = {}, .doubts = {}, .thumbnails = {}}};
  try {
    survey::CellImages images;
    survey::Survey survey = survey_of(cell, images);
    seen.row.facts = std::move(survey.facts);
    seen.row.doubts = std::move(survey.doubts);
    seen.row.thumbnails = survey::thumbnails_of(images);
    add_refusals(cell, seen.row.doubts);
  } catch (const InputError& error) {
    seen.error = error.what();
    seen.hint = error.hint;
  } catch (const std::exception& error) {
    seen.error = error.what();
  }
  return seen;
}

std::string text_of(const Seen& seen) {
  std::string text = seen.row.cell + ": ";
  text +=
      seen.error.empty() ? seen.row.facts + (seen.is_fine() ? "; fine" : "") : stage::warning("error: " + seen.error);
  if (!seen.hint.empty()) text += "\n  hint: " + seen.hint;
  for (const std::string& doubt : seen.row.doubts) text += "\n" + stage::warning("  caution: " + doubt);
  return text + "\n";
}

std::string json_of(const Seen& seen) {
  return runner::event_of_look({.cell = seen.row.cell,
                                .facts = seen.row.facts,
                                .cautions = seen.row.doubts,
                                .error = seen.error,
                                .hint = seen.hint});
}

/// On the page what could not be looked at is a row, too.
survey::PageRow row_of(Seen seen) {
  if (!seen.error.empty()) seen.row.doubts.insert(seen.row.doubts.begin(), seen.error);
  return std::move(seen.row);
}

/// A folder that was copied has the same picture in another file. Cells of one picture share the file.
void tell_copies(const std::vector<std::string>& names, std::vector<Seen>& seen) {
  std::map<std::string, std::size_t> first;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i].sha256.empty()) continue;
    const auto [at, is_new] = first.emplace(seen[i].sha256, i);
    if (is_new || seen[at->second].beads == seen[i].beads) continue;
    seen[i].row.doubts.push_back(seen[i].beads.filename().string() + " is the same picture as that of " +
                                 names[at->second] + ": a copy, or another cell of one field. A copy counts once.");
  }
}

void read_beads(const fs::path& cell, Seen& seen) {
  try {
    seen.beads = fs::canonical(runner::resolve_image(cell, runner::read_image_names(cell), "beads_stressed"));
    if (files::is_file(seen.beads)) seen.sha256 = files::sha256_of_file(seen.beads);
  } catch (const std::exception&) {  // reported already
  }
}

// What a run writes beside each image: its picture, its field, its networks; measured on the demo cell and doubled.
constexpr double kBytesPerCell = 40e6;

std::string disk_doubt(const fs::path& folder, std::size_t n_cells) {
  std::error_code error;
  const double free = static_cast<double>(fs::space(folder, error).available),
               needed = kBytesPerCell * static_cast<double>(n_cells);
  if (error || free > needed) return {};
  return "  caution: " + brief(free / 1e9) + " GB of the disk are free; the results of " + std::to_string(n_cells) +
         " cells may take " + brief(needed / 1e9) + " GB.\n";
}

struct CheckParameters {
  bool json = false;
  std::string page;
};
void declare(stage::ParameterList& list, CheckParameters& p) {
  list.add("json_lines", p.json);
  list.add("page", p.page);
}

/// @throws OutputError where another program made the file
void write_page(const fs::path& file, const fs::path& folder, const std::vector<Seen>& seen) {
  const std::string mark = "<!-- made by mbtfm check -->\n";
  if (files::is_file(file) && !files::read_text(file).ends_with(mark))
    throw OutputError(file.string() + " is there, and mbtfm check did not make it: nothing is written over it");
  std::vector<survey::PageRow> rows;
  for (const Seen& cell : seen) rows.push_back(row_of(cell));
  files::write_whole(file,
                     survey::page_of("Images of " + fs::weakly_canonical(folder).filename().string(), rows) + mark);
}

StageReport check(const fs::path& folder, const CheckParameters& p, int threads, bool& is_fine) {
  setenv(stage::kRunnerVariable, stage::kForPerson, 1);  // of the stages that are asked
  const runner::FoundCells found = runner::search_cells(folder);
  if (found.cells.empty() && found.skipped.empty()) runner::find_cells(folder);  // says what to do
  std::vector<Seen> seen(found.cells.size());
  const auto name_of = [&](const fs::path& cell) {
    return cell == folder ? fs::weakly_canonical(folder).filename().string() : cell.lexically_relative(folder).string();
  };
  std::vector<std::string> names;
  for (const fs::path& cell : found.cells) names.push_back(name_of(cell));
  numerics::parallel_for(static_cast<int>(seen.size()), threads, [&](int i) {
    seen[i] = look_at(found.cells[i], names[i]);
    read_beads(found.cells[i], seen[i]);
  });
  tell_copies(names, seen);
  for (const runner::SkippedFolder& skipped : found.skipped) {
    seen.push_back({.error = skipped.why});
    seen.back().row.cell = name_of(skipped.folder);
  }
  for (const Seen& cell : seen) stage::print(p.json ? json_of(cell) : text_of(cell));
  if (!p.json) stage::print(disk_doubt(folder, seen.size()));
  const auto n_fine = std::ranges::count_if(seen, &Seen::is_fine);
  is_fine = n_fine == static_cast<std::ptrdiff_t>(seen.size());
  if (!p.page.empty()) write_page(p.page, folder, seen);
  StageReport report;
  report.summary = std::to_string(n_fine) + " of " + std::to_string(seen.size()) + " cells are fine";
  report.figures = {{"n_cells", static_cast<std::int64_t>(seen.size())}, {"n_fine", static_cast<std::int64_t>(n_fine)}};
  return report;
}

}  // namespace

int main(int argc, char** argv) {
  bool is_fine = true;
  const int code =
      stage::run_stage<CheckParameters>({.name = "check", .files = {{"cells", stage::FileArgument::Kind::input}}}, argc,
                                        argv, [&](const CheckParameters& p, stage::StageContext& context) {
                                          return check(context.input("cells", {}), p, context.threads, is_fine);
                                        });
  return code == exit_code::kDone && !is_fine ? exit_code::kFailed : code;
}
