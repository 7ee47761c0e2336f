/// mbtfm-plan: how many beads, which gel, how little noise and how many cells a question takes.
#include "pipeline/contract/counted.h"
#include "pipeline/files/text.h"
#include "pipeline/stage/console.h"
#include "pipeline/stage/stage.h"
#include "pipeline/statistics/picture.h"
#include "samples/plan/answer.h"
#include "samples/plan/tables.h"

namespace mbtfm::plan {
namespace {

Scene scene_of(const Parameters& parameters, stage::StageContext& context) {
  if (!context.has_input("cell")) return simulated_scene(parameters);
  return measured_scene(context.input("cell", kFilesOfCell), parameters);
}

std::vector<CellNumbers> cells_of(const Scene& scene, const Computed& computed, const Point& point,
                                  const Parameters& parameters, stage::StageContext& context) {
  std::vector<Scatter> scatter = scatter_of(scene, computed, point, parameters.between_cells);
  if (context.has_input("study"))
    scatter = scatter_of_study(context.input("study", {"types.csv", "variances.csv"}), std::move(scatter));
  return cell_numbers(scatter, parameters.difference, parameters.power);
}

Plan plan_of(const Parameters& parameters, stage::StageContext& context) {
  const Work work(context.threads, context.progress);
  const Scene scene = scene_of(parameters, context);
  const double own_kPa = scene.fit.gel.youngs_modulus_kPa;
  const Asked asked = asked_by(parameters, own_kPa);
  for (const double E : asked.youngs_modulus_kPa) context.expect_plausible("youngs_modulus_kPa", E);
  const Computed computed = compute(scene, asked, work);
  Plan plan{.name = scene.name,
            .own_kPa = own_kPa,
            .asked = asked,
            .grid = grid_of(scene, asked, computed, context.threads),
            .parameters = parameters,
            .most_beads_per_um2 = most_beads_per_um2(scene)};
  const Point point = answered_point(asked, plan.grid.needed, own_kPa);
  plan.cells = cells_of(scene, computed, point, parameters, context);
  if (parameters.drawn > 0) plan.drawn = draw_experiments(scene, computed, point, parameters.drawn, work);
  return plan;
}

void write_picture(const std::string& svg, std::size_t n_charts, stage::StageContext& context) {
  files::write_text(context.output("out", "plan.svg"), svg);
  constexpr double kColumn_mm = 90, kDotsPerInch = 300;  // of a page with two columns
  statistics::write_png(context.output("out", "plan.png"), svg, kColumn_mm * (n_charts > 1 ? 2 : 1), kDotsPerInch);
}

SpaceScene space_scene_of(const Parameters& parameters, stage::StageContext& context) {
  if (!context.has_input("cell")) return simulated_in_space(parameters, context.threads);
  return measured_in_space(context.input("cell", kFilesOfCellInSpace), parameters);
}

SpacePlan space_plan_of(const Parameters& parameters, stage::StageContext& context) {
  const Work work(context.threads, context.progress);
  const SpaceScene scene = space_scene_of(parameters, context);
  const Asked asked = asked_in_space(parameters, scene);
  for (const double E : asked.youngs_modulus_kPa) context.expect_plausible("youngs_modulus_kPa", E);
  const std::vector<SpacePool> pools = pools_of(scene, asked, work);
  work.tell(0.4, "what beads show");
  const SpaceForeseen foreseen = foresee(scene, asked, pools, work);
  SpacePlan plan{.name = scene.name,
                 .own_kPa = scene.gel.youngs_modulus_kPa,
                 .asked = asked,
                 .grid = grid_of(scene, asked, pools, foreseen, pairs_of(scene, asked, {}, context.threads)),
                 .axial_noise = scene.spatial.axial_sigma_ratio,
                 .volume_um3 = scene.volume_um3()};
  const Point point = answered_point(asked, plan.grid.needed, plan.own_kPa);
  if (parameters.drawn > 0)
    plan.drawn = draw_experiments(scene, pools[foreseen.index_of_density(point.density)], foreseen, point,
                                  parameters.drawn, work);
  return plan;
}

/// Write the tables, the picture and the page, and print the answer.
template <class Quantity>
StageReport report_of(const PlanOf<Quantity>& plan, stage::StageContext& context) {
  constexpr bool kIsFlat = std::is_same_v<Quantity, plan::Quantity>;
  const auto out = [&](const char* file) { return context.output("out", file); };
  files::write(out("plan.csv"), expected_table(Quantity{}), plan.grid.expected);
  files::write(out("plan_needed.csv"), needed_table(Quantity{}), plan.grid.needed);
  if (kIsFlat) files::write(out("plan_cells.csv"), cell_table(), plan.cells);
  if (plan.drawn) files::write(out("plan_drawn.csv"), drawn_table(Quantity{}), plan.drawn->numbers);
  write_picture(svg_of(plan), plan.asked.noise_um.size(), context);
  files::write_text(out("plan.html"), html_of(plan));
  context.progress(1, "done");
  stage::print(answer_sentence(plan) + "\n");
  for (const std::string& sentence : further_sentences(plan)) stage::print(sentence + "\n");
  for (const std::string& warning : plan.grid.warnings) stage::print("Mind: " + warning + "\n");
  StageReport report;
  report.summary = plan.name + ": " + counted(std::ssize(plan.asked.youngs_modulus_kPa), "gels") + ", " +
                   counted(std::ssize(plan.asked.densities), "density", "densities") + ", " +
                   counted(std::ssize(plan.asked.noise_um), "noises") + "; plan.html in " +
                   context.outputs_.at("out").string();
  report.figures = {{"target_nN", plan.asked.target_nN}};
  if (kIsFlat) report.figures.emplace_back("model_error_nN", plan.grid.model_error_nN);
  if (plan.drawn) report.figures.emplace_back("error_over_predicted", plan.drawn->error_over_predicted);
  return report;
}

bool is_in_space(const Parameters& parameters, const stage::StageContext& context) {
  if (context.has_input("cell")) return is_cell_in_space(context.inputs_.at("cell"));
  return is_in_space(parameters);
}

StageReport run(const Parameters& parameters, stage::StageContext& context) {
  if (is_in_space(parameters, context)) {
    if (context.has_input("study"))
      throw UsageError("study: the scatter of a study is that of tensions, and a cell in space has none");
    return report_of(space_plan_of(parameters, context), context);
  }
  if (!parameters.beads_per_um3.empty())
    throw UsageError("beads_per_um3: beads of a flat gel lie at its surface: give beads_per_um2");
  return report_of(plan_of(parameters, context), context);
}

}  // namespace
}  // namespace mbtfm::plan

int main(int argc, char** argv) {
  using mbtfm::stage::FileArgument;
  using Kind = FileArgument::Kind;
  return mbtfm::stage::run_stage<mbtfm::plan::Parameters>(
      {.name = "plan",
       .files = {{"cell", Kind::optional_input}, {"study", Kind::optional_input}, {"out", Kind::output_folder}}},
      argc, argv, mbtfm::plan::run);
}
