#include <algorithm>
#include <string>

#include "network/cables/effects.h"
#include "network/mesh/mesh.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/stage/effects.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"

namespace mbtfm {
namespace {

std::string counted(std::size_t n, const std::string& what) {
  return n == 0 ? "" : ", " + std::to_string(n) + " " + what;
}

std::vector<std::int64_t> list_of(const std::vector<int>& ids) { return {ids.begin(), ids.end()}; }

struct NetworkStageParameters {
  mesh::NetworkParameters network;
  stage::EffectSwitches effects;
};

void declare(stage::ParameterList& list, NetworkStageParameters& p) {
  declare(list, p.network);
  declare(list, p.effects, {"stress_fibres"});
}

StageReport report_of(const mesh::GeneratedNetwork& generated) {
  const Network& net = generated.network;
  const int n_held = static_cast<int>(net.vertices_um.size()) -
                     static_cast<int>(std::count(net.adhesion_id.begin(), net.adhesion_id.end(), 0));
  const auto n_by_cut = static_cast<std::int64_t>(std::ranges::count(net.held_by_cut, true));
  StageReport report;
  report.converged = generated.n_parts == 1;
  report.summary = std::to_string(net.vertices_um.size()) + " vertices, " + std::to_string(net.links.size()) +
                   " links" + counted(static_cast<std::size_t>(n_by_cut), "of them held by the cut") +
                   counted(generated.clipped_fibre_ids.size(), "fibres cut at the outline") +
                   counted(generated.snapped_adhesion_ids.size(), "adhesions outside the cell drawn in") +
                   counted(generated.separated_adhesion_ids.size(), "adhesions at one place moved apart") +
                   counted(generated.n_filled_holes, "holes smaller than a triangle filled") +
                   counted(generated.n_loose_parts, "parts left out that no adhesion holds") +
                   (generated.n_parts > 1 ? counted(generated.n_parts, "parts that no link joins") : "");
  report.figures = {{"n_vertices", static_cast<std::int64_t>(net.vertices_um.size())},
                    {"n_links", static_cast<std::int64_t>(net.links.size())},
                    {"n_triangles", static_cast<std::int64_t>(generated.n_triangles)},
                    {"n_held_vertices", static_cast<std::int64_t>(n_held)},
                    {"n_parts", static_cast<std::int64_t>(generated.n_parts)},
                    {"n_loose_parts", static_cast<std::int64_t>(generated.n_loose_parts)},
                    {"n_shared_segments", static_cast<std::int64_t>(generated.n_shared_segments)},
                    {"mean_edge_um", generated.mean_edge_um},
                    {"even_share", generated.even_share},
                    {"mean_quality", generated.mean_quality},
                    {"worst_quality", generated.worst_quality},
                    {"n_needles", static_cast<std::int64_t>(generated.n_needles)},
                    {"mean_free_quality", generated.mean_free_quality},
                    {"worst_free_quality", generated.worst_free_quality},
                    {"n_filled_holes", static_cast<std::int64_t>(generated.n_filled_holes)},
                    {"relaxation_converged", generated.report.converged},
                    {"relaxation_steps", static_cast<std::int64_t>(generated.report.iterations)},
                    {"last_move_edges", generated.report.last_change},
                    {"clipped_fibre_ids", list_of(generated.clipped_fibre_ids)},
                    {"snapped_adhesion_ids", list_of(generated.snapped_adhesion_ids)},
                    {"separated_adhesion_ids", list_of(generated.separated_adhesion_ids)}};
  if (n_by_cut > 0) report.figures.emplace_back("n_held_by_cut", n_by_cut);
  return report;
}

}  // namespace
}  // namespace mbtfm

int main(int argc, char** argv) {
  using namespace mbtfm;
  return stage::run_stage<NetworkStageParameters>(
      {.name = "network",
       .files = {{"cell", stage::FileArgument::Kind::input}, {"out", stage::FileArgument::Kind::output}}},
      argc, argv, [](const NetworkStageParameters& parameters, stage::StageContext& context) {
        Cell cell = files::read_cell(context.input("cell", files::kCellFiles));
        const Effect fibres = cables::take_fibres(cell, parameters.effects.stress_fibres);
        const mesh::GeneratedNetwork generated = mesh::generate_network(cell, parameters.network);
        files::write_network(context.output("out"), generated.network);
        StageReport report = report_of(generated);
        report.effects = {fibres};
        return report;
      });
}
