#include "mbtfm/spatial/stage.h"

#include <algorithm>

#include "mbtfm/spatial/problem.h"
#include "mbtfm/spatial/repeated.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/space_files.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/stage/parameters.h"
#include "substrate/choice/large_strain.h"

namespace mbtfm::spatial {
namespace {

SpatialInputs read_inputs(const StageParameters& p, stage::StageContext& context) {
  SpatialInputs inputs{.beads = files::read_displacement_in_space(context.input("displacement")),
                       .gel = p.gel,
                       .adhesions = {},
                       .outline_um = {}};
  if (context.has_input("surface"))
    inputs.gel.surface = std::make_shared<const HeightMap>(files::read_surface(context.input("surface")));
  if (context.has_input("adhesions")) inputs.adhesions = files::read_adhesions(context.input("adhesions"));
  if (context.has_input("outline")) inputs.outline_um = files::read_outline(context.input("outline")).front();
  return inputs;
}

/// The criteria by lambda, in um/kPa: files and picture of the flat methods.
void write_scan(stage::StageContext& context, const SpatialReconstruction& r, double youngs_modulus_kPa) {
  tractions::Reconstruction shown;
  shown.scan = r.scan;
  shown.lambda = *r.length_um / youngs_modulus_kPa;
  shown.length_um = r.length_um;
  const double unit = *shown.lambda / *r.lambda;
  inverse::LambdaScan& scan = *shown.scan;
  for (inverse::ScanPoint& point : scan.points) point.lambda *= unit;
  for (double* by : {&scan.by_gcv, &scan.by_evidence, &scan.by_risk, &scan.by_prediction}) *by *= unit;
  for (std::optional<double>* by : {&scan.by_l_curve, &scan.by_discrepancy}) {
    if (*by) **by *= unit;
  }
  tractions::write_lambda_scan(context.output_beside("out", "_lambda.csv"), scan, youngs_modulus_kPa);
  tractions::write_lambda_picture(context.output_beside("out", "_lambda.svg"), shown,
                                  r.lambda_by ? std::string("by ") + name_of(*r.lambda_by) : "as given");
}

void write_outputs(stage::StageContext& context, const Problem& problem, const SpatialReconstruction& r,
                   const Figures& summary) {
  write_tractions(context.output("out"), context.output_beside("out", ".vtp"), problem, r);
  files::write_figures(context.output_beside("out", ".json"), summary);
  if (r.scan) write_scan(context, r, problem.gel.youngs_modulus_kPa);
  if (!r.forces.empty())
    files::write(context.output_beside("out", "_adhesion_forces.csv"), files::part_force_table(), r.forces);
}

std::string summary_line(const SpatialReconstruction& r, const Balance& balance) {
  std::string line = name_of(r.method) + std::string(": total force ") + brief(balance.total_force_nN) +
                     " nN, net force " + brief(norm(balance.force_nN)) + " nN, strain energy " +
                     brief(balance.strain_energy_fJ) + " fJ, relative L2 " + brief(r.relative_l2);
  if (r.length_um)
    line += ", lambda E " + brief(*r.length_um) + " um (" + (r.lambda_by ? "by " : "") + how_lambda(r) + ")";
  if (r.degrees > 0) line += ", " + brief(r.degrees) + " numbers resolved";
  if (!r.remark.empty()) line += "; " + r.remark;
  return line;
}

std::string left_out_of(const Observed& observed) {
  std::string text;
  const auto add = [&](int n, const char* what) {
    if (n > 0) text += "; " + std::to_string(n) + what;
  };
  add(observed.n_flagged, " flagged beads left out");
  add(observed.n_above, " beads above the surface left out");
  add(observed.n_below_base, " beads below the base left out");
  add(observed.n_beyond, " beads left out where no surface is known");
  return text;
}

/// What does not go together is reported with the names of the files.
Problem problem_of(const StageParameters& p, const SpatialInputs& inputs, const Meshing& meshing,
                   const substrate::SubstrateParameters& gel, const stage::StageContext& context) {
  try {
    return make_problem(inputs, p.spatial, meshing, gel, context.threads);
  } catch (const InvalidData& error) {
    std::string names;
    for (const char* input : {"displacement", "surface", "outline", "adhesions"}) {
      if (context.has_input(input)) names += (names.empty() ? "" : ", ") + context.inputs_.at(input).string();
    }
    throw InputError(names + ": " + error.element, error.expected, error.found,
                     "are these files of one cell, with one origin, in um, z into the gel?");
  }
}

Meshing meshing_of(const StageParameters& p, tractions::TractionMethod method) {
  using enum tractions::TractionMethod;
  return {.spacing_um = p.traction.spacing_um,
          .refine = p.spatial.refine,
          .grow_um = p.traction.grow_um,
          .has_patches = method == patches || method == tikhonov || method == group_l1,
          .has_facets = method == green};
}

/// @throws UsageError where faces are to be split by errors that the reconstruction does not know
void require_errors(Refine refine, const SpatialReconstruction& r) {
  if (refine != Refine::resolved || r.resolved.size() > 0) return;
  throw UsageError("traction.refine = resolved: " + std::string(name_of(r.method)) +
                   " states no resolution with these beads: choose tikhonov or group-l1, a wider traction.spacing_um, "
                   "or another traction.refine");
}

/// Strains are small until tractions are known that make them large; and `direct` has no place for a common motion.
/// @throws UsageError where that is asked for
substrate::SubstrateParameters gel_to_begin_with(substrate::SubstrateParameters gel, tractions::TractionMethod method) {
  gel.effects.large_strain = Switch::off;
  if (method != tractions::TractionMethod::direct) return gel;
  if (gel.effects.common_motion == Switch::on)
    throw UsageError("effects.common_motion = on: direct imposes the displacement as it was measured; take tikhonov");
  gel.effects.common_motion = Switch::off;
  return gel;
}

/// Whether it can go on about a strained gel.
bool has_tangent(const Problem& problem, tractions::TractionMethod method) {
  using enum tractions::TractionMethod;
  return !problem.map && method != patches && method != green && method != direct;
}

}  // namespace

void declare(stage::ParameterList& list, SpatialParameters& p) {
  list.table("traction");
  list.add("spacing_beads", p.spacing_beads, Range::between(0.2, 5));
  list.add("region", p.region);
  list.add("refine", p.refine);
  list.add("background", p.background, Range::between(0, 1));
  list.add("loss", p.loss);
  list.add("axial_sigma_ratio", p.axial_sigma_ratio, Range::between(0.1, 100));
  list.add("with_axial", p.with_axial);
}

void declare(stage::ParameterList& list, StageParameters& p) {
  declare(list, p.gel);
  declare(list, p.traction);
  declare(list, p.spatial);
  declare(list, p.substrate);
  declare(list, p.substrate.effects, {"large_strain", "common_motion", "effect_tolerance"});
}

StageReport run_in_space(const StageParameters& p, stage::StageContext& context) {
  context.progress(0, "reading");
  const SpatialInputs inputs = read_inputs(p, context);
  const tractions::TractionMethod method = checked_method(p.traction, inputs);
  context.progress(0.05, "displacing the gel");
  const auto made = [&](std::optional<TractionMesh> mesh) {
    Meshing meshing = meshing_of(p, method);
    meshing.mesh = std::move(mesh);
    return problem_of(p, inputs, meshing, gel_to_begin_with(p.substrate, method), context);
  };
  Problem problem = made({});
  context.progress(0.6, "reconstructing tractions");
  const auto find = [&](const Problem& of) { return reconstruct(of, inputs, p.traction, p.spatial, context.threads); };
  SpatialReconstruction r = find(problem);
  if (starts_coarse(p.spatial.refine)) {
    require_errors(p.spatial.refine, r);
    context.progress(0.65, "on smaller faces");
    Refined on_smaller = refined(std::move(problem), std::move(r), p.spatial.refine, made, find);
    problem = std::move(on_smaller.problem);
    r = std::move(on_smaller.reconstruction);
    r.figures.emplace_back("n_faces_split", std::int64_t{on_smaller.n_split});
  }
  StageReport report;
  Effect strain = decide_strain(problem, r.traction_kPa, p.substrate);
  if (strain.is_on && !has_tangent(problem, r.method)) {
    strain.is_on = false;
    strain.why += "; but not with " + std::string(name_of(r.method)) + ", or with so many tractions";
  }
  if (strain.is_on) {
    context.progress(0.7, "large strains of the gel");
    Strained strained = on_strained_gel(problem, std::move(r), p.substrate, find, context.threads);
    problem = std::move(strained.problem);
    r = std::move(strained.reconstruction);
    r.figures.emplace_back("steps_on_strained_gel", std::int64_t{strained.steps});
  } else {
    const double left_out = choice::left_out_in_gel(problem.gel, mean_traction_kPa(problem, r.traction_kPa));
    context.notice(noticed(Symptom::strain_beyond_linear, left_out));
  }
  const auto common = common_motion_beside(problem, r);
  report.effects = {strain, common_motion_effect(p.substrate.effects.common_motion, problem, common)};
  if (common) {
    for (auto& figure : figures_of(*common)) r.figures.push_back(std::move(figure));
  }
  for (const auto& finding : r.findings) context.notice(finding);
  const Balance balance = balance_of(problem, r);
  if (!inputs.outline_um.empty() || !inputs.adhesions.empty())  // of one cell: a whole field may hold many
    context.expect_plausible("total_force_nN", balance.total_force_nN);
  context.notice(noticed_imbalance(balance));
  const Figures summary = summary_of(problem, r, balance);
  write_outputs(context, problem, r, summary);
  context.progress(1, "done");
  report.summary = summary_line(r, balance) + left_out_of(problem.observed);
  report.figures = summary;
  return report;
}

}  // namespace mbtfm::spatial
