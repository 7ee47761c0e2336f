#include "mbtfm/mean/cells.h"

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <set>

#include "continuum/outlines/rings.h"
#include "mbtfm/mean/registration.h"
#include "mbtfm/tractions/neighbour_noise.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/runner/images.h"
#include "pipeline/stage/parameters.h"
#include "segment/images/image.h"

namespace mbtfm::mean {

void declare(stage::ParameterList& list, Parameters& p) {
  list.add("pixel_size_um", p.pixel_size_um, Range::pixel_um());
  declare(list, p.gel);
  for (stage::Parameter& of_gel : list.all()) of_gel.is_required = false;  // a cell's own cell.toml has it, too
  list.table("mean");
  list.add("reference", p.reference);
  list.add("register_by", p.register_by);
  list.add("image", p.image);
  list.add("symmetry", p.symmetry);
  list.add("mirror", p.mirror);
  list.add("largest_misfit", p.largest_misfit, Range::between(1e-3, 1));
  list.add("others", p.others);
  list.add("gel_model", p.gel_model);
  list.add("lambda_um_per_kPa", p.lambda_um_per_kPa, Range::positive());
  list.add("spacing_um", p.spacing_um, Range::mesh_um());
  list.add("seed", p.seed);
}

namespace {

/// The first of some names that a folder has; empty: none.
Path first_of(const Path& folder, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (files::is_file(folder / name)) return name;
  return {};
}

Path displacement_in(const Path& folder) { return first_of(folder, {"2_track/displacement.csv", "displacement.csv"}); }

/// What a cell's own cell.toml says, in the place of what holds for all.
struct OwnSettings {
  Gel gel;
  std::optional<double> pixel_size_um;
  runner::ImageNames images;
  bool has_gel = false;  ///< nothing of it is assumed
};

OwnSettings settings_of(const Path& cell, const Parameters& otherwise) {
  OwnSettings own{otherwise.gel, otherwise.pixel_size_um, {}, false};
  if (!files::is_file(cell / "cell.toml")) return own;
  stage::ParameterList list;
  list.add("pixel_size_um", own.pixel_size_um, Range::pixel_um());
  declare(list, own.gel);
  declare(list, own.images);
  read_toml(list, cell / "cell.toml");
  own.has_gel = stage::assumed_inputs(list).empty();
  return own;
}

/// The outline that was found, or that is given, as mbtfm run takes it; empty: none.
/// @throws InputError where [images] names one that is not there
Path outline_in(const Path& folder, const runner::ImageNames& names) {
  const Path found = first_of(folder, {"1_segment/outline.csv", "outline.csv"});
  if (!found.empty()) return found;
  for (const char* key : {"outline_roi", "outline_mask"})
    if (const auto given = resolve_optional_image(folder, names, key)) return given->lexically_relative(folder);
  return {};
}

/// The image that cells are laid onto each other by: of this name, or the one that a key of [images] means.
Path image_in(const Path& folder, const runner::ImageNames& names, const std::string& name_or_key) {
  return runner::is_image_key(name_or_key) ? resolve_image(folder, names, name_or_key) : folder / name_or_key;
}

/// Folders that hold an outline and a displacement, by name.
std::vector<Path> folders_of_cells(const Path& top, const Parameters& p) {
  if (!files::is_folder(top)) throw InputError(top.string(), "a folder of cell folders", "none of that name");
  std::set<Path, decltype(&files::is_before)> found(files::is_before);
  std::error_code error;
  const auto how = fs::directory_options::skip_permission_denied;  // lost+found
  for (fs::recursive_directory_iterator entry(top, how, error), end; !error && entry != end; entry.increment(error)) {
    if (!files::is_folder(entry->path())) continue;  // a link that leads round in a circle is none
    static const Path kTruth = "truth";              // of a simulated cell: the cell is the folder above it
    if (files::is_hidden(entry->path()) || entry->path().filename() == kTruth) {
      entry.disable_recursion_pending();
      continue;
    }
    if (displacement_in(entry->path()).empty()) continue;
    if (outline_in(entry->path(), settings_of(entry->path(), p).images).empty()) continue;
    found.insert(entry->path().lexically_relative(top));
    entry.disable_recursion_pending();
  }
  if (error) throw InputError(top.string(), "folders that can be read", error.message());
  return {found.begin(), found.end()};
}

/// @throws InputError where the image has no calibration: that of beads and outline is not known here
Brightness read_brightness(const Path& file) {
  images::Image image = images::read_image(file);
  if (!image.pixel_size_um)
    throw InputError(file.string(), "an image with its pixel size", "none in the file",
                     "set its scale in ImageJ (Image > Properties) and save it as TIFF");
  return {image.width, image.height, *image.pixel_size_um, std::move(image.pixels)};
}

}  // namespace

std::vector<Cell> read_cells(stage::StageContext& context, const Parameters& p) {
  const Path top = context.input("cells", {});
  std::vector<std::string> read;
  std::vector<Cell> cells;
  bool have_gels = true;
  for (const Path& name : folders_of_cells(top, p)) {
    const Path folder = top / name;
    const OwnSettings own = settings_of(folder, p);
    have_gels = have_gels && own.has_gel;
    const Path outline = outline_in(folder, own.images);
    Cell cell{
        .name = name.generic_string(), .outline_file = folder / outline, .outline_um = {}, .beads = {}, .gel = own.gel};
    cell.outline_um = outlines::read_rings(cell.outline_file, own.pixel_size_um).points_um.front();
    cell.beads = files::read_displacement(folder / displacement_in(folder));
    std::erase_if(cell.beads, [](const Bead& bead) { return !bead.flag.empty(); });
    tractions::assume_noise_um(cell.beads);
    if (!(cell.gel.youngs_modulus_kPa > 0))
      throw InputError((folder / "cell.toml").string(), "[gel] youngs_modulus_kPa", "none",
                       "give it there, or for all cells in --config or as --youngs_modulus_kPa");
    if (p.register_by == By::images) {
      const Path image = image_in(folder, own.images, p.image);
      cell.image = read_brightness(image);
      read.push_back((name / image.lexically_relative(folder)).generic_string());
    }
    read.push_back((name / outline).generic_string());
    read.push_back((name / displacement_in(folder)).generic_string());
    cells.push_back(std::move(cell));
  }
  if (cells.size() < 2)
    throw InputError(top.string(),
                     "two cells or more, each with an outline (outline.csv, 1_segment/outline.csv, a mask or "
                     "selection) and displacement.csv (or 2_track/displacement.csv)",
                     std::to_string(cells.size()));
  context.input("cells", read);
  if (have_gels) context.assumed.clear();
  return cells;
}

Reference reference_of(stage::StageContext& context, const Parameters& p, const std::vector<Cell>& cells) {
  if (context.has_input("pattern")) {
    if (!p.reference.empty()) throw UsageError("expected --pattern or --reference, found both");
    if (p.register_by == By::images)
      throw UsageError("expected --reference with register_by = images: a pattern has no image");
    return {outlines::read_rings(context.input("pattern"), p.pixel_size_um).points_um.front()};
  }
  if (!p.reference.empty()) {
    const auto named = std::ranges::find(cells, p.reference, &Cell::name);
    if (named == cells.end())
      throw UsageError("--reference: expected one of the cells, found '" + p.reference + "' (the first is '" +
                       cells.front().name + "')");
    return {named->outline_um, &*named};
  }
  std::vector<Polygon> outlines;
  for (const Cell& cell : cells) outlines.push_back(cell.outline_um);
  const Mirrors mirrors = p.mirror == Switch::on ? Mirrors::tried : Mirrors::not_tried;
  const Cell& typical = cells[most_typical(outlines, mirrors, context.threads)];
  return {typical.outline_um, &typical};
}

std::vector<CellRow> rows_of(stage::StageContext& context, const Parameters& p, const std::vector<Cell>& cells,
                             const Reference& reference, const Alignment& alignment) {
  const Brightness* image = p.register_by == By::images ? &reference.cell->image : nullptr;
  std::vector<CellRow> rows = aligned(cells, alignment, context.threads, image);
  int n_left_out = 0, n_ambiguous = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    n_ambiguous += rows[k].is_kept && rows[k].is_ambiguous && !symmetry_of(p.symmetry).is_circle ? 1 : 0;
    if (rows[k].is_kept) continue;
    ++n_left_out;
    if (p.others == Others::refused)
      throw InputError(
          cells[k].outline_file.string(),
          "an outline of the reference's shape: cell '" + rows[k].cell + "' is in one mean with the others",
          rows[k].reason,
          "take the cell out, leave out all such cells (mean.others = left-out), or raise mean.largest_misfit");
  }
  const int n_kept = static_cast<int>(rows.size()) - n_left_out;
  if (n_kept < 2)
    throw InputError(context.inputs_.at("cells").string(), "two cells of the reference's shape",
                     std::to_string(n_kept));
  const std::string of_all = " of " + std::to_string(rows.size()), of_kept = " of " + std::to_string(n_kept);
  context.notice(noticed(Symptom::cells_left_out, n_left_out, {.value = std::to_string(n_left_out) + of_all}));
  context.notice(
      noticed(Symptom::registration_ambiguous, n_ambiguous, {.value = std::to_string(n_ambiguous) + of_kept}));
  context.notice(noticed(Symptom::few_cells, 5.0 / n_kept, {.value = std::to_string(n_kept)}));
  return rows;
}

int most_typical(const std::vector<Polygon>& outlines_um, Mirrors mirrors, int threads) {
  constexpr std::size_t kMostCandidates = 12;  // of the middle sizes: each is laid onto all
  std::vector<int> candidates(outlines_um.size());
  std::iota(candidates.begin(), candidates.end(), 0);
  std::ranges::stable_sort(candidates, {}, [&](int k) { return size_um(outlines_um[k]); });
  while (candidates.size() > kMostCandidates) {
    candidates.pop_back();
    if (candidates.size() > kMostCandidates) candidates.erase(candidates.begin());
  }
  std::vector<double> sums(candidates.size(), 0);
  numerics::parallel_for(static_cast<int>(candidates.size()), threads, [&](int k) {
    for (const Polygon& outline : outlines_um) {
      const double misfit = ways_onto(outline, outlines_um[candidates[k]], mirrors).front().misfit_um;
      sums[k] += misfit * misfit;
    }
  });
  return candidates[std::ranges::min_element(sums) - sums.begin()];
}

Mirrors mirrors_for(Switch setting, const Polygon& reference_um) {
  if (setting != Switch::automatic) return setting == Switch::on ? Mirrors::tried : Mirrors::not_tried;
  const std::vector<Way> ways = ways_onto(reference_um, reference_um, Mirrors::tried);
  const auto mirrored = std::ranges::find_if(ways, [](const Way& way) { return way.motion.is_mirrored; });
  constexpr double kOwnMirrorImage = 0.05;  // of the size: outlines of one shape differ by as much
  const bool has_mirror = mirrored != ways.end() && mirrored->misfit_um < kOwnMirrorImage * size_um(reference_um);
  return has_mirror ? Mirrors::not_tried : Mirrors::tried;
}

void expect_symmetric(const Alignment& alignment, const std::string& symmetry) {
  const double off = asymmetry_um(alignment.reference_um, alignment.motions);
  const double allowed = alignment.largest_misfit * size_um(alignment.reference_um);
  if (off > allowed)
    throw UsageError("--symmetry " + symmetry + ": expected a reference that is the same after each motion to within " +
                     brief(allowed) + " um (largest_misfit of its radius), found " + brief(off) +
                     " um: give its own symmetry, or a pattern that has this one");
}

namespace {

/// Marks a cell whose outline does not fit.
void judge(CellRow& row, const Alignment& alignment) {
  const double allowed = alignment.largest_misfit * size_um(alignment.reference_um);
  if (row.way.misfit_um <= allowed) return;
  row.is_kept = false;
  row.reason = "its outline lies " + brief(row.way.misfit_um) +
               " um from the reference (root mean square), more than " + brief(allowed) + " um";
}

}  // namespace

std::vector<CellRow> aligned(const std::vector<Cell>& cells, const Alignment& alignment, int threads,
                             const Brightness* image) {
  std::vector<CellRow> rows(cells.size());
  numerics::parallel_for(static_cast<int>(cells.size()), threads, [&](int k) {
    const Cell& cell = cells[k];
    std::vector<Way> ways = image ? ways_by_images(cell.image, *image, alignment.mirrors)
                                  : ways_onto(cell.outline_um, alignment.reference_um, alignment.mirrors);
    if (image) {
      for (Way& way : ways) way.misfit_um = misfit_um(moved(cell.outline_um, way.motion), alignment.reference_um);
    }
    CellRow& row = rows[k] = {.cell = cell.name, .way = ways.front(), .n_beads = static_cast<int>(cell.beads.size())};
    const auto second = std::ranges::find_if(
        ways, [&](const Way& way) { return !are_equivalent(way, ways.front(), alignment.motions); });
    if (second != ways.end()) {
      row.second_misfit_um = second->misfit_um;
      row.is_ambiguous = image ? correlate_equally(ways.front(), *second)
                               : fit_equally(ways.front(), *second, size_um(alignment.reference_um));
    }
    judge(row, alignment);
  });
  return rows;
}

}  // namespace mbtfm::mean
