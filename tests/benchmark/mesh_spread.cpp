/// mesh_spread [cell] [meshes]: how far the adhesion forces of one simulated cell with given tensions, and their
/// derivatives by tension, differ from mesh to mesh, by formulation and edge length. A table (CSV) on stdout.
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "network/cables.h"
#include "network/mesh.h"
#include "samples/draw.h"
#include "samples/experiment.h"

namespace {

using namespace mbtfm;

struct Formulation {
  const char* name;
  const char* link_weights;
  const char* adhesion_anchor;
  bool keeps_surface_tension;  ///< links pull in proportion to the edge; the thesis' are the same at any edge
};

/// What one mesh gives.
struct Sample {
  Eigen::VectorXd forces;
  Eigen::MatrixXd derivatives;
  std::size_t n_vertices = 0;
  double seconds = 0;
};

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

Sample sample(const samples::DrawnCell& drawn, const Formulation& f, double edge_um, std::uint64_t seed) {
  const double begin = now_s();
  network::NetworkParameters p;
  p.edge_length_um = edge_um;
  p.seed = seed;
  p.link_weights = f.link_weights;
  p.adhesion_anchor = f.adhesion_anchor;
  Network network = network::generate_network(drawn.cell, p).network;
  for (Link& link : network.links)
    if (f.keeps_surface_tension && link.fibre_id == 0) link.share *= edge_um / samples::kReferenceEdge_um;
  Sample s;
  s.n_vertices = network.vertices_um.size();
  const network::CableNetwork cables(std::move(network));
  std::vector<double> tensions = {0.06};  // of the thesis' network at the reference edge; then the fibres, by their ids
  tensions.insert(tensions.end(), drawn.tensions_nN.begin(), drawn.tensions_nN.end());
  const network::Equilibrium equilibrium = cables.equilibrium(tensions);
  s.forces = cables.adhesion_forces_nN(tensions, equilibrium);
  s.derivatives = cables.adhesion_force_derivatives(tensions, equilibrium);
  s.seconds = now_s() - begin;
  return s;
}

/// Root mean square deviation of the vectors from their mean, over the mean's length.
template <class Get>
double relative_spread(const std::vector<Sample>& samples, Get get) {
  const auto n = static_cast<double>(samples.size());
  Eigen::VectorXd mean = get(samples[0]) / n;
  for (std::size_t i = 1; i < samples.size(); ++i) mean += get(samples[i]) / n;
  double squares = 0;
  for (const Sample& s : samples) squares += (get(s) - mean).squaredNorm() / (n - 1);
  return std::sqrt(squares) / mean.norm();
}

void print_row(const samples::DrawnCell& drawn, const Formulation& f, double edge_um, int n_meshes) {
  std::vector<Sample> samples;
  double vertices = 0, seconds = 0;
  for (int seed = 1; seed <= n_meshes; ++seed) {
    samples.push_back(sample(drawn, f, edge_um, static_cast<std::uint64_t>(seed)));
    vertices += static_cast<double>(samples.back().n_vertices) / n_meshes;
    seconds += samples.back().seconds / n_meshes;
  }
  const auto of_group = [&](Eigen::Index g) {
    return relative_spread(samples, [g](const Sample& s) -> Eigen::VectorXd { return s.derivatives.col(g); });
  };
  std::printf("%s,%g,%.0f,%.3f,%.4f,%.4f", f.name, edge_um, vertices, seconds,
              relative_spread(samples, [](const Sample& s) -> Eigen::VectorXd { return s.forces; }), of_group(0));
  for (const FibreType type : kFibreTypes) {
    double sum = 0;
    int n = 0;
    for (std::size_t i = 0; i < drawn.cell.fibres.size(); ++i) {
      if (drawn.cell.fibres[i].type != type) continue;
      sum += of_group(static_cast<Eigen::Index>(i) + 1);
      ++n;
    }
    std::printf(",%.4f", n > 0 ? sum / n : 0.0);
  }
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const auto cell = static_cast<std::uint64_t>(argc > 1 ? std::atoi(argv[1]) : 1);
  const int n_meshes = argc > 2 ? std::atoi(argv[2]) : 6;
  const Formulation formulations[] = {{"thesis", "equal", "centre", false},
                                      {"equal centre", "equal", "centre", true},
                                      {"width centre", "width", "centre", true},
                                      {"equal ellipse", "equal", "ellipse", true},
                                      {"width ellipse", "width", "ellipse", true}};
  const samples::ScenarioParameters p;
  const samples::DrawnCell drawn = draw_cell(p.cell, p.tension, samples::field_um(p.microscope), cell);
  std::printf("formulation,edge_um,vertices,seconds,forces,d_network");
  for (const FibreType type : kFibreTypes) std::printf(",d_%s", std::string(name_of(type)).c_str());
  std::printf("\n");
  for (const Formulation& f : formulations)
    for (const double edge_um : {0.6, 0.9, 1.5, 3.0}) print_row(drawn, f, edge_um, n_meshes);
}
