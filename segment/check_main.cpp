/// mbtfm-check: what the images below a folder are good for, cell by cell, before a batch is run.
#include <algorithm>

#include "pipeline/contract/errors.h"
#include "pipeline/files/hash.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/runner/batch.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/process.h"
#include "pipeline/runner/run_cell.h"
#include "pipeline/runner/stage_result.h"
#include "pipeline/stage/console.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "segment/survey/cell_look.h"

namespace {

using namespace mbtfm;
using survey::Seen;

survey::Survey survey_of(const fs::path& cell, survey::CellImages& images) {
  const runner::ImageNames names = runner::read_image_names(cell);
  const CellKind kind = runner::stages_of(cell, names).kind;
  const auto needed = [&](const char* key) { return runner::resolve_image(cell, names, key); };
  const auto if_there = [&](const char* key) { return runner::resolve_optional_image(cell, names, key); };
  survey::CellFiles files{.toml = cell / "cell.toml"};
  if (!is_in_space(kind)) {
    files.adhesion = if_there("adhesion");
    files.actin = is_sheet(kind) ? if_there("actin") : needed("actin");  // a sheet's outline may be a mask
  }
  if (!is_in_space(kind) && !runner::name_of_image(names, "displacement").empty())
    files.displacement = needed("displacement");
  else
    files.beads_stressed = needed("beads_stressed"), files.beads_relaxed = needed("beads_relaxed");
  if (is_in_space(kind)) return survey::survey_in_space(files);
  images = survey::read_images(files);
  return survey::survey(images, 1);
}

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

std::string json_of(const Seen& seen) {
  return runner::event_of_look({.cell = seen.row.cell,
                                .facts = seen.row.facts,
                                .cautions = seen.row.doubts,
                                .error = seen.error,
                                .hint = seen.hint});
}

void read_beads(const fs::path& cell, Seen& seen) {
  try {
    seen.beads = fs::canonical(runner::resolve_image(cell, runner::read_image_names(cell), "beads_stressed"));
    if (files::is_file(seen.beads)) seen.sha256 = files::sha256_of_file(seen.beads);
  } catch (const std::exception&) {  // reported already
  }
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
  const std::string title = "Images of " + fs::weakly_canonical(folder).filename().string();
  files::write_whole(file, survey::page_of_cells(title, seen) + mark);
}

StageReport check(const fs::path& folder, const CheckParameters& p, int threads, bool& is_fine) {
  setenv(stage::kRunnerVariable, stage::kForPerson, 1);  // of the stages that are asked
  const runner::FoundCells found = runner::search_cells(folder);
  if (found.cells.empty() && found.skipped.empty()) runner::find_cells(folder);  // says what to do
  std::vector<Seen> seen(found.cells.size());
  const auto name_of = [&](const fs::path& cell) {
    return cell == folder ? fs::weakly_canonical(folder).filename().string() : cell.lexically_relative(folder).string();
  };
  numerics::parallel_for(static_cast<int>(seen.size()), threads, [&](int i) {
    seen[i] = look_at(found.cells[i], name_of(found.cells[i]));
    read_beads(found.cells[i], seen[i]);
  });
  survey::mark_same_pictures(seen);
  for (const runner::SkippedFolder& skipped : found.skipped) {
    seen.push_back({.error = skipped.why});
    seen.back().row.cell = name_of(skipped.folder);
  }
  for (const Seen& cell : seen) stage::print(p.json ? json_of(cell) : survey::text_of(cell));
  if (!p.json) stage::print(survey::disk_doubt(folder, seen.size()));
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
