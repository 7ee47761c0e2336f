/// mbtfm-mean: the mean displacement and traction of cells of one shape.
#include "mbtfm/mean/cells.h"
#include "mbtfm/mean/model.h"
#include "mbtfm/mean/registration.h"
#include "pipeline/contract/counted.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/text.h"
#include "pipeline/report/page.h"
#include "pipeline/report/stage_page.h"

namespace mbtfm::mean {
namespace {

Registered registered(const Cell& cell, const Way& way) {
  return {.beads = cell.beads,
          .gel = cell.gel,
          .motion = way.motion,
          .shift_error_um = way.shift_error_um,
          .angle_error_rad = way.angle_error_rad};
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
  const std::vector<double> lambdas = lambdas_of(kept, p.lambda_um_per_kPa, fttc, context.threads);
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
  report.figures = figures_of(rows, means, p.symmetry, ratio, blur, size);
  files::write_figures(context.output("out", "mean.json"), report.figures);
  report.summary = "mean of " + counted(std::ssize(kept), "cells") + " at " + std::to_string(means.size()) +
                   " nodes; blurred by " + brief(blur.fttc_um) + " µm by the tractions' smoothing and " +
                   brief(blur.registration_um) + " µm by registration";
  if (ratio)
    report.summary += "; tips pull " + brief(ratio->ratio) + " times (" + brief(ratio->low) + " to " +
                      brief(ratio->high) + ") as hard as the rest of the edge";
  write_page(context, picture, files::read_text(registration_file), report);
  return report;
}

}  // namespace
}  // namespace mbtfm::mean

int main(int argc, char** argv) {
  using Kind = mbtfm::stage::FileArgument::Kind;
  using namespace mbtfm::mean;
  return mbtfm::stage::run_stage<Parameters>({.name = "mean",
                                              .files = {{"cells", Kind::input, true},
                                                        {"pattern", Kind::optional_input},
                                                        {"model", Kind::optional_input},
                                                        {"out", Kind::output_folder, false, "", "mean"}}},
                                             argc, argv, run);
}
