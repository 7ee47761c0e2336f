/// mbtfm-mean: the mean displacement and traction of cells of one shape.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>
#include <set>

#include "continuum/mean/align.h"
#include "continuum/mean/symmetry.h"
#include "continuum/outlines/rings.h"
#include "mbtfm/tractions/fttc.h"
#include "mbtfm/tractions/neighbour_noise.h"
#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/report/page.h"
#include "pipeline/report/stage_page.h"
#include "pipeline/runner/images.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "segment/images/image.h"

namespace mbtfm::mean {
namespace {

enum class Others { refused, left_out };
constexpr auto words(Others) { return std::array{"refused", "left-out"}; }

/// What cells are laid onto each other by.
enum class By { outlines, images };
constexpr auto words(By) { return std::array{"outlines", "images"}; }

struct Parameters {
  std::optional<double> pixel_size_um;
  Gel gel;
  std::string reference = {};
  By register_by = By::outlines;
  std::string image = "phase.tif";
  std::string symmetry = "C1";
  Switch mirror = Switch::automatic;
  double largest_misfit = Alignment{}.largest_misfit;
  Others others = Others::refused;
  GelModel gel_model = GelModel::layer;
  std::optional<double> lambda_um_per_kPa;
  std::optional<double> spacing_um;
  std::uint64_t seed = 1;
};

void declare(stage::ParameterList& list, Parameters& p) {
  list.add("pixel_size_um", p.pixel_size_um, Range::pixel_um(),
           "side of a pixel of outlines that are masks or selections (um), if cell.toml has none");
  declare(list, p.gel);
  for (stage::Parameter& of_gel : list.all()) of_gel.is_required = false;  // a cell's own cell.toml has it, too
  list.table("mean");
  list.add("reference", p.reference,
           "cell whose outline is the reference; empty: the pattern, or the most typical outline");
  list.add("register_by", p.register_by, "align cells by outlines, or by images");
  list.add("image", p.image,
           "with register_by = images: name of the image in each folder, or a key of [images] such as actin");
  list.add("symmetry", p.symmetry,
           "symmetry of the shape, over which the mean is taken, too: C1 none, C4 quarter turns, C4v with mirrors, "
           "Cinfv a circle");
  list.add("mirror", p.mirror, "whether cells may be mirrored; auto: if the reference is not its own mirror image");
  list.add("largest_misfit", p.largest_misfit, Range::between(1e-3, 1),
           "largest distance of an outline from the reference (rms), over its radius");
  list.add("others", p.others, "cells of another shape: refused (an error), or left out");
  list.add("gel_model", p.gel_model, "layer on a rigid base, or half-space");
  list.add("lambda_um_per_kPa", p.lambda_um_per_kPa, Range::positive(),
           "regularisation of the tractions (um/kPa); unset: by least expected error");
  list.add("spacing_um", p.spacing_um, Range::mesh_um(),
           "spacing of the mean's nodes (um); unset: half the first cell's distance of beads");
  list.add("seed", p.seed, "random seed of the resampling");
}

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
  list.add("pixel_size_um", own.pixel_size_um, Range::pixel_um(), "side of a pixel");
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

/// The image that cells are laid onto each other by: of this name, or what a key of [images] stands for.
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

/// An outline, and the cell that it is of; none: that of a pattern.
struct Reference {
  Polygon outline_um;
  const Cell* cell = nullptr;
};
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

/// @throws InputError at the first cell of another shape, where those are refused
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

Registered registered(const Cell& cell, const Way& way) {
  return {.beads = cell.beads,
          .gel = cell.gel,
          .motion = way.motion,
          .shift_error_um = way.shift_error_um,
          .angle_error_rad = way.angle_error_rad};
}

/// By cell that is kept.
std::vector<double> lambdas_of(const std::vector<Registered>& cells, const Parameters& p,
                               const tractions::TractionParameters& fttc, int threads) {
  if (p.lambda_um_per_kPa) return std::vector<double>(cells.size(), *p.lambda_um_per_kPa);
  std::vector<double> lambdas(cells.size());
  numerics::parallel_for(static_cast<int>(cells.size()), threads,
                         [&](int k) { lambdas[k] = lambda_by_risk_um_per_kPa(cells[k], fttc); });
  // gels differ: a length, lambda E, is the same for all
  std::vector<double> lengths;
  for (std::size_t k = 0; k < cells.size(); ++k) lengths.push_back(lambdas[k] * cells[k].gel.youngs_modulus_kPa);
  const double length = numerics::quantile(lengths, 0.5);
  for (std::size_t k = 0; k < cells.size(); ++k) lambdas[k] = length / cells[k].gel.youngs_modulus_kPa;
  return lambdas;
}

using Samples = std::vector<std::vector<std::optional<Sample>>>;

/// A field made of each cell, at all nodes.
template <class FieldOf>
Samples samples_of(std::size_t n_cells, const std::vector<Vec2>& nodes, const std::vector<Motion>& motions, int threads,
                   const FieldOf& field_of_cell) {
  Samples samples(n_cells);
  numerics::parallel_for(static_cast<int>(n_cells), threads, [&](int k) {
    const CellField field = field_of_cell(k);
    for (const Vec2 node : nodes) samples[k].push_back(field.at(node, motions));
  });
  return samples;
}

/// Tractions of a table, each as that of the nearest row; beyond the outermost ones none.
std::function<Vec2(Vec2)> model_in(const Path& file) {
  const files::CsvTable table(file);
  table.require({"x_um", "y_um", "tx_kPa", "ty_kPa"});
  std::vector<GroundPatch> patches;
  std::set<double> columns;
  for (int row = 0; row < table.n_rows(); ++row) {
    patches.push_back({.position_um = {table.number(row, "x_um"), table.number(row, "y_um")},
                       .traction_kPa = {table.number(row, "tx_kPa"), table.number(row, "ty_kPa")},
                       .displacement_um = {}});
    columns.insert(patches.back().position_um.x);
  }
  const std::size_t n_columns = columns.size(), n_rows = patches.size() / std::max<std::size_t>(1, n_columns);
  if (n_columns < 2 || n_rows < 2 || n_columns * n_rows != patches.size())
    throw InputError(file.string(), "tractions on a whole lattice of at least two columns and rows",
                     std::to_string(patches.size()) + " rows, " + std::to_string(n_columns) + " columns");
  std::ranges::sort(patches, [](const GroundPatch& a, const GroundPatch& b) {
    return std::pair(a.position_um.y, a.position_um.x) < std::pair(b.position_um.y, b.position_um.x);
  });
  const Vec2 low = patches.front().position_um, high = patches.back().position_um;
  const double spacing = (high.x - low.x) / static_cast<double>(n_columns - 1);
  for (GroundPatch& patch : patches) patch.area_um2 = spacing * spacing;
  const CellField field(patches, {}, {low, high});
  return [field](Vec2 place) { return field.at(place).value_or(Sample{}).traction_kPa; };
}

/// The model as the mean of these cells would show it.
std::vector<Vec2> blurred_model(const std::function<Vec2(Vec2)>& model, const std::vector<Registered>& cells,
                                const std::vector<double>& lambdas, const tractions::TractionParameters& fttc,
                                const std::vector<Vec2>& nodes, const Alignment& alignment, std::uint64_t seed,
                                int threads) {
  const Vec2 centre = centroid_um(alignment.reference_um);
  std::vector<Motion> errors;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  for (const Registered& cell : cells) {
    const double x = normal(random), y = normal(random), angle = normal(random);
    errors.push_back({centre, centre + cell.shift_error_um * Vec2{x, y}, cell.angle_error_rad * angle, false});
  }
  const Samples samples = samples_of(cells.size(), nodes, alignment.motions, threads, [&](int k) {
    const auto off = [&](Vec2 place) { return errors[k].vector(model(errors[k].back_um(place))); };
    return blurred(off, cells[k], fttc, lambdas[k]);
  });
  std::vector<Vec2> means;
  for (const NodeMean& node : mean_of(nodes, samples, alignment.reference_um)) means.push_back(node.mean.traction_kPa);
  return means;
}

struct Blur {
  std::vector<WaveShare> shares;
  double fttc_um = 0, registration_um = 0;
};

Figures figures_of(const Parameters& p, const std::vector<CellRow>& rows, const std::vector<NodeMean>& nodes,
                   const std::optional<Ratio>& ratio, const Blur& blur, double size) {
  std::int64_t n_kept = 0, n_ambiguous = 0;
  double misfit = 0, angle = 0;
  for (const CellRow& row : rows) {
    if (!row.is_kept) continue;
    n_kept += 1;
    n_ambiguous += row.is_ambiguous ? 1 : 0;
    misfit += row.way.misfit_um * row.way.misfit_um;
    angle += row.way.angle_error_rad * row.way.angle_error_rad;
  }
  double largest = 0;
  for (const NodeMean& node : nodes) largest = std::max(largest, norm(node.mean.traction_kPa));
  Figures figures = {{"n_cells", n_kept},
                     {"n_left_out", static_cast<std::int64_t>(rows.size()) - n_kept},
                     {"n_ambiguous", n_ambiguous},
                     {"symmetry", p.symmetry},
                     {"n_nodes", static_cast<std::int64_t>(nodes.size())},
                     {"reference_radius_um", size},
                     {"misfit_um", std::sqrt(misfit / static_cast<double>(n_kept))},
                     {"angle_error_deg", 180 / std::numbers::pi * std::sqrt(angle / static_cast<double>(n_kept))},
                     {"largest_mean_traction_kPa", largest},
                     {"blur_fttc_um", blur.fttc_um},
                     {"blur_registration_um", blur.registration_um}};
  if (!ratio) return figures;
  figures.emplace_back("tip_kPa", ratio->tip_kPa);
  figures.emplace_back("edge_kPa", ratio->edge_kPa);
  figures.emplace_back("tip_over_edge", ratio->ratio);
  figures.emplace_back("tip_over_edge_low", ratio->low);
  figures.emplace_back("tip_over_edge_high", ratio->high);
  return figures;
}

/// mean.html
void write_page(stage::StageContext& context, const std::string& picture, const std::string& registration_csv,
                const StageReport& report) {
  const mbtfm::report::StagePage page{
      .title = "Mean of registered cells",
      .facts = {mbtfm::report::capitalised(report.summary + ".")},
      .findings = context.findings_,
      .picture_svg = picture,
      .picture_title = "Mean traction",
      .picture_explained =
          "A ratio of tips to edge is mostly resolution: compare the blurred model (--model), never the model as it "
          "is.",
      .tables = {{"Registration", "How each cell lies on the reference, and how well its outline fits there.",
                  "registration.csv", registration_csv, "cell, kept, angle_deg, mirrored, misfit_um, ambiguous"}},
      .figures = report.figures};
  files::write_text(context.output("out", "mean.html"), report::html_of(page));
}

StageReport run(const Parameters& p, stage::StageContext& context) {
  const std::vector<Cell> cells = read_cells(context, p);
  context.progress(0.1, "laying outlines onto the reference");
  const Reference reference = reference_of(context, p, cells);
  Alignment alignment{.reference_um = reference.outline_um, .motions = {}, .largest_misfit = p.largest_misfit};
  const Symmetry symmetry = symmetry_of(p.symmetry);
  alignment.motions = motions_of(symmetry, alignment.reference_um);
  expect_symmetric(alignment, p.symmetry);
  alignment.mirrors = mirrors_for(p.mirror, alignment.reference_um);
  std::vector<CellRow> rows = rows_of(context, p, cells, reference, alignment);
  std::vector<Registered> kept;
  std::vector<Polygon> outlines;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (!rows[k].is_kept) continue;
    kept.push_back(registered(cells[k], rows[k].way));
    outlines.push_back(moved(cells[k].outline_um, rows[k].way.motion));
  }

  context.progress(0.2, "reconstructing tractions");
  const double size = size_um(alignment.reference_um);
  const double spacing = p.spacing_um.value_or(0.5 / std::sqrt(beads_per_um2(kept.front().beads)));
  tractions::TractionParameters fttc;
  fttc.gel_model = p.gel_model;
  fttc.spacing_um = spacing;
  const std::vector<double> lambdas = lambdas_of(kept, p, fttc, context.threads);
  for (std::size_t k = 0, of_kept = 0; k < rows.size(); ++k)
    if (rows[k].is_kept) rows[k].lambda_um_per_kPa = lambdas[of_kept++];
  const std::vector<Vec2> nodes = lattice_over(alignment.reference_um, size / 5, spacing);
  const Samples samples = samples_of(kept.size(), nodes, alignment.motions, context.threads,
                                     [&](int k) { return field_of(kept[k], fttc, lambdas[k]); });
  const std::vector<NodeMean> means = mean_of(nodes, samples, alignment.reference_um);
  context.progress(0.8, "means");
  const double band = size / 10;
  const std::optional<Ratio> ratio =
      tip_over_edge(nodes, samples, edge_parts(nodes, alignment.reference_um, band, 2 * band),
                    centroid_um(alignment.reference_um), p.seed);
  std::vector<Vec2> model;
  if (context.has_input("model"))
    model =
        blurred_model(model_in(context.input("model")), kept, lambdas, fttc, nodes, alignment, p.seed, context.threads);
  Blur blur{.shares = wave_shares(kept, lambdas, p.gel_model, size)};
  blur.fttc_um = gaussian_um(blur.shares, [](const WaveShare& s) { return 0.5 * (s.along + s.across); });
  blur.registration_um = gaussian_um(blur.shares, [](const WaveShare& s) { return s.registration; });

  const Path registration_file = context.output("out", "registration.csv");
  write_registration(registration_file, rows);
  write_mean(context.output("out", "mean.csv"), context.output("out", "mean.vtp"), means, model);
  write_blur(context.output("out", "blur.csv"), blur.shares);
  files::write_outline(context.output("out", "reference.csv"), alignment.reference_um);
  const std::string picture = picture_of({.reference_um = alignment.reference_um,
                                          .outlines_um = std::move(outlines),
                                          .nodes = means,
                                          .spacing_um = spacing,
                                          .band_um = band});
  files::write_text(context.output("out", "mean.svg"), picture);
  StageReport report;
  report.figures = figures_of(p, rows, means, ratio, blur, size);
  files::write_figures(context.output("out", "mean.json"), report.figures);
  report.summary = "mean of " + counted(std::ssize(kept), "cells") + " at " + std::to_string(means.size()) +
                   " nodes; blurred by " + brief(blur.fttc_um) + " µm (tractions) and " + brief(blur.registration_um) +
                   " µm (registration)";
  if (ratio)
    report.summary += "; tips over the rest of the edge " + brief(ratio->ratio) + " (" + brief(ratio->low) + " to " +
                      brief(ratio->high) + ")";
  write_page(context, picture, files::read_text(registration_file), report);
  return report;
}

}  // namespace
}  // namespace mbtfm::mean

int main(int argc, char** argv) {
  using Kind = mbtfm::stage::FileArgument::Kind;
  using namespace mbtfm::mean;
  return mbtfm::stage::run_stage<Parameters>(
      {.name = "mean",
       .purpose = "mean displacements and tractions over cells of one shape",
       .files = {{"cells", Kind::input,
                  "folder of cells, each with an outline (outline.csv, mask or selection) and displacement.csv", true},
                 {"pattern", Kind::optional_input,
                  "outline of the reference: outline.csv, a mask or an ImageJ selection"},
                 {"model", Kind::optional_input,
                  "traction.csv of a model on a lattice in the reference's frame, blurred as the cells are"},
                 {"out", Kind::output_folder,
                  "folder of mean.csv, mean.vtp, mean.json, mean.svg, mean.html, registration.csv, blur.csv, "
                  "reference.csv; unset: mean/ beside the cells",
                  false, "", "mean"}}},
      argc, argv, run);
}
