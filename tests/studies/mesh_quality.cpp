/// mesh_quality [seeds] [edge_um]: quality of the meshes of simulated cells and of the unit circle, by first placement
/// of the vertices and anchoring. Means over the seeds, and the worst. A table (CSV) on stdout.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <numbers>

#include "network/mesh/mesh.h"
#include "samples/drawing/draw.h"

namespace {

using namespace mbtfm;

struct Scene {
  std::string name;
  std::vector<Cell> cells;  ///< taken in turn by the seeds
  double edge_um = 1.5;
};

Cell unit_disc() {
  Cell cell;
  for (int i = 0; i < 400; ++i) {
    const double angle = 2 * std::numbers::pi * i / 400;
    cell.outline_um.push_back({std::cos(angle), std::sin(angle)});
  }
  return cell;
}

void print_row(const Scene& scene, mesh::Seeds seeds, mesh::AdhesionAnchor anchor, int n_seeds) {
  double vertices = 0, mean = 0, worst = 1, worst_mean = 1, free_mean = 0, free_worst = 1, even = 0, sweeps = 0;
  double seconds = 0, needles = 0;
  int n_at_rest = 0;
  for (int seed = 1; seed <= n_seeds; ++seed) {
    mesh::NetworkParameters p;
    p.edge_length_um = scene.edge_um;
    p.seed = static_cast<std::uint64_t>(seed);
    p.seeds = seeds;
    p.adhesion_anchor = anchor;
    const std::clock_t begin = std::clock();
    const auto generated = mesh::generate_network(scene.cells[seed % scene.cells.size()], p);
    seconds += static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC / n_seeds;
    vertices += static_cast<double>(generated.network.vertices_um.size()) / n_seeds;
    mean += generated.mean_quality / n_seeds;
    worst_mean = std::min(worst_mean, generated.mean_quality);
    worst = std::min(worst, generated.worst_quality);
    free_mean += generated.mean_free_quality / n_seeds;
    free_worst = std::min(free_worst, generated.worst_free_quality);
    even += generated.even_share / n_seeds;
    needles += static_cast<double>(generated.n_needles) / n_seeds;
    sweeps += static_cast<double>(generated.report.iterations) / n_seeds;
    n_at_rest += generated.report.converged;
  }
  std::printf("%s,%g,%s,%s,%.0f,%.4f,%.4f,%.3f,%.4f,%.3f,%.4f,%.0f,%d/%d,%.1f,%.3f\n", scene.name.c_str(),
              scene.edge_um, name_of(seeds), name_of(anchor), vertices, mean, worst_mean, worst, free_mean, free_worst,
              even, sweeps, n_at_rest, n_seeds, needles, seconds);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const int n_seeds = argc > 1 ? std::atoi(argv[1]) : 10;
  const drawing::ScenarioParameters scenario;
  std::vector<Scene> scenes = {{"circle", {unit_disc()}, 0.1}, {"circle", {unit_disc()}, 0.05}};
  Scene cell{"cell", {}, argc > 2 ? std::atof(argv[2]) : 1.5};
  for (std::uint64_t k = 1; k <= 5; ++k) {
    cell.cells.push_back(
        drawing::draw_cell(scenario.cell, scenario.tension, drawing::field_um(scenario.microscope), k).cell);
  }
  std::printf(
      "scene,edge_um,seeds,anchor,vertices,mean,least_mean,worst,free_mean,free_worst,even_share,sweeps,at_rest,"
      "needles,"
      "cpu_s\n");
  for (const mesh::Seeds seeds : values_of<mesh::Seeds>()) {
    if (argc > 3 && name_of(seeds) != std::string(argv[3])) continue;
    for (const Scene& s : scenes) print_row(s, seeds, mesh::AdhesionAnchor::centre, n_seeds);
    for (const auto anchor : {mesh::AdhesionAnchor::ellipse, mesh::AdhesionAnchor::rim})
      print_row(cell, seeds, anchor, n_seeds);
  }
}
