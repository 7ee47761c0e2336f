/// mbtfm-traction: the standard traction reconstructions, beside the model-based one.
#include <algorithm>

#include "mbtfm/spatial/stage.h"
#include "mbtfm/tractions/neighbour_noise.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/numerics/masked_values.h"
#include "pipeline/stage/effects.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::tractions {
namespace {

/// Of one cell: a whole field may hold many. @throws InputError where no cell pulls like that
void expect_plausible(stage::StageContext& context, const TractionInputs& inputs, const Reconstruction& r,
                      const TractionSums& sums) {
  if (inputs.outline_um.empty() && inputs.adhesions.empty()) return;
  context.expect_plausible("total_force_nN", sums.total_force_nN);
  if (!r.forces.empty())
    context.expect_plausible("traction_kPa", stage::traction_of_half_the_force_kPa(r.forces, inputs.adhesions));
}

/// @returns how many beads are left out, as they are flagged or as their program masked them
/// @throws InputError where nothing is left that moves
std::size_t leave_out(stage::StageContext& context, DisplacementField& beads) {
  const numerics::Masked masked = numerics::flag_masked(beads);
  context.notice(noticed(Symptom::vectors_masked, static_cast<double>(masked.n) / static_cast<double>(beads.size()),
                         {.at = "they have the displacement " + listed(masked.values_um) + " um to the last digit"}));
  const std::size_t n = std::erase_if(beads, [](const Bead& bead) { return !bead.flag.empty(); });
  if (!beads.empty() && std::ranges::none_of(beads, [](const Bead& bead) { return norm(bead.displacement_um) > 0; }))
    throw InputError(context.input("displacement").string(), "displacements, not all of them zero",
                     std::to_string(beads.size()) + " zeros",
                     "was the field exported before its vectors were computed, or are all of them masked?");
  return n;
}

/// Of beads in the gel's volume, or of a surface that is not flat.
bool is_in_space(stage::StageContext& context) {
  return context.has_input("surface") || files::CsvTable(context.input("displacement")).has("uz_um");
}

StageReport run(const spatial::StageParameters& p, stage::StageContext& context) {
  if (is_in_space(context)) return spatial::run_in_space(p, context);
  context.progress(0, "reading");
  TractionInputs inputs{
      .beads = {}, .gel = p.gel, .adhesions = {}, .outline_um = {}, .point_errors = PointErrors::stated};
  inputs.beads = files::read_displacement(context.input("displacement"));
  const std::size_t n_flagged = leave_out(context, inputs.beads);
  if (context.has_input("adhesions")) inputs.adhesions = files::read_adhesions(context.input("adhesions"));
  if (context.has_input("outline")) inputs.outline_um = files::read_outline(context.input("outline")).front();
  context.expect_plausible("beads_per_um2", beads_per_um2(inputs.beads));
  const std::optional<double> assumed_um = assume_noise_um(inputs.beads);
  if (assumed_um) context.assumed.push_back(stage::assumed_noise(*assumed_um));
  context.progress(0.1, "reconstructing tractions");
  Reconstruction r = reconstruct(inputs, p.traction, context.threads);
  if (assumed_um) r.figures.emplace_back("assumed_sigma_um", *assumed_um);
  const TractionSums sums = sums_of(r, inputs, p.traction.grow_um);
  expect_plausible(context, inputs, r, sums);

  write_tractions(context.output("out"), r.patches, r.sigmas_kPa);
  write_tractions_vtp(context.output_beside("out", ".vtp"), r.patches);
  files::write_figures(context.output_beside("out", ".json"), summary_of(r, sums));
  if (r.scan) {
    write_lambda_scan(context.output_beside("out", "_lambda.csv"), *r.scan, *r.length_um / *r.lambda);
    write_lambda_picture(
        context.output_beside("out", "_lambda.svg"), r,
        p.traction.lambda_um_per_kPa ? "as given" : std::string("by ") + name_of(p.traction.lambda_by));
  }
  if (!inputs.adhesions.empty()) {
    files::write_adhesion_forces(context.output_beside("out", "_adhesion_forces.csv"), r.forces, inputs.adhesions,
                                 columns_of(r.sensitivities));
  }
  context.progress(1, "done");

  StageReport report;
  report.summary = name_of(p.traction.method.value_or(TractionMethod::fttc)) + std::string(": total force ") +
                   brief(sums.total_force_nN) +
                   (sums.total_force_sigma_nN ? " ± " + brief(*sums.total_force_sigma_nN) : "") +
                   " nN, strain energy " + brief(sums.strain_energy_fJ) + " fJ over " + sums.where + ", relative L2 " +
                   brief(r.relative_l2);
  if (r.length_um) report.summary += ", lambda E " + brief(*r.length_um) + " um";
  if (assumed_um) {
    report.summary += "; the field states no errors: " + brief(*assumed_um) +
                      " um is assumed for all, estimated from neighbouring beads";
  }
  if (n_flagged > 0) report.summary += "; " + std::to_string(n_flagged) + " beads left out";
  report.converged = r.report.converged;
  if (!r.report.converged) report.summary += "; " + r.report.reason;
  if (!r.remark.empty()) report.summary += "; " + r.remark;
  constexpr double kOutward = -0.5;  // no cell pushes so; noise has a share near zero
  if (sums.inward_share < kOutward)
    report.summary += "; WARNING: the tractions push outward everywhere: are stressed and relaxed swapped?";
  report.figures = summary_of(r, sums);
  const bool is_layer = p.traction.gel_model == GelModel::layer;
  report.effects = {stage::decided(EffectKind::finite_thickness, switched(is_layer), is_layer,
                                   is_layer ? "layer on a rigid base" : "half-space, as gel_model asks")};
  return report;
}

}  // namespace
}  // namespace mbtfm::tractions

int main(int argc, char** argv) {
  using mbtfm::stage::FileArgument;
  using namespace mbtfm::tractions;
  return mbtfm::stage::run_stage<mbtfm::spatial::StageParameters>(
      {.name = "traction",
       .files = {{"displacement", FileArgument::Kind::input},
                 {"surface", FileArgument::Kind::optional_input},
                 {"adhesions", FileArgument::Kind::optional_input},
                 {"outline", FileArgument::Kind::optional_input},
                 {"out", FileArgument::Kind::output}}},
      argc, argv, run);
}
