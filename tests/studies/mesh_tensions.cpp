/// mesh_tensions [first cell] [last cell] [meshes]: how well tensions are found on other meshes than the truth's, by
/// the formulation of the fit's networks and, as none is nature's, by that of the truth's. A table (CSV) on stdout.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>

#include "mbtfm/tensions/ensemble.h"
#include "network/cables/cables.h"
#include "network/mesh/mesh.h"
#include "samples/experiment/experiment.h"
#include "substrate/compliance.h"
#include "substrate/greens/models.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::tensions;

struct Formulation {
  const char* name;
  mesh::NetworkParameters parameters;
};

const Formulation kTruths[] = {
    {"neighbours", {.edge_length_um = 0.9, .link_reach = mesh::LinkReach::neighbours}},
    {"second neighbours", {.edge_length_um = 0.9, .link_reach = mesh::LinkReach::second_neighbours}},
    {"neighbours with rims",
     {.edge_length_um = 0.9,
      .link_reach = mesh::LinkReach::neighbours,
      .adhesion_anchor = mesh::AdhesionAnchor::rim,
      .rim_points = 12}}};
const Formulation kFits[] = {
    {"thesis",
     {.link_weights = mesh::LinkWeights::equal,
      .link_reach = mesh::LinkReach::neighbours,
      .adhesion_anchor = mesh::AdhesionAnchor::centre}},
    {"neighbours", {.link_reach = mesh::LinkReach::neighbours}},
    {"second neighbours", {.link_reach = mesh::LinkReach::second_neighbours}},
    {"second neighbours at 2 um", {.edge_length_um = 2, .link_reach = mesh::LinkReach::second_neighbours}}};

struct Scene {
  experiment::Experiment experiment;
  std::vector<int> adhesion_ids;
  Eigen::MatrixXd compliance_um_per_nN;
};

Scene scene(std::uint64_t seed) {
  drawing::ScenarioParameters p;
  p.seed = seed;
  p.beads = 3000;  // the beads' noise is not what this is about
  Scene s{.experiment = experiment::simulate(p, 1), .adhesion_ids = {}, .compliance_um_per_nN = {}};
  std::vector<Vec2> points;
  for (const Bead& b : s.experiment.measured) points.push_back(b.position_um);
  std::vector<substrate::Ellipse> ellipses;
  for (const Adhesion& a : s.experiment.cell.adhesions) {
    ellipses.push_back(substrate::ellipse_of(a));
    s.adhesion_ids.push_back(a.adhesion_id);
  }
  s.compliance_um_per_nN =
      greens::make_greens(p.gel, {.model = substrate::ModelKind::layer}, 1)->compliance_um_per_nN(points, ellipses);
  return s;
}

/// What the cell would do to the beads, were its network of this formulation.
tensions::LinearData measured(const Scene& s, mesh::NetworkParameters truth, std::uint64_t seed) {
  constexpr std::uint64_t kSeeds = 0x74727565;  // far from those of the fits
  truth.seed = kSeeds + seed;
  Network network = mesh::generate_network(s.experiment.cell, truth).network;
  for (Link& link : network.links)
    if (link.fibre_id == 0) link.share *= truth.edge_length_um / experiment::kReferenceEdge_um;
  const cables::CableNetwork cables(std::move(network));
  std::vector<double> tensions_nN;
  for (const Tension& t : s.experiment.tensions) tensions_nN.push_back(t.tension_nN);
  const Eigen::VectorXd u_um =
      s.compliance_um_per_nN * cables.adhesion_forces_nN(tensions_nN, cables.equilibrium(tensions_nN));
  constexpr double kNoise_um = 0.02;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, kNoise_um);
  DisplacementField beads = s.experiment.measured;
  for (std::size_t i = 0; i < beads.size(); ++i) {
    const auto row = 2 * static_cast<Eigen::Index>(i);
    const double x = u_um[row] + normal(random), y = u_um[row + 1] + normal(random);
    beads[i].displacement_um = {x, y};
    beads[i].sigma_um = kNoise_um;
  }
  return tensions::reduce(beads, s.compliance_um_per_nN);
}

void print_row(const Scene& s, tensions::LinearData data, mesh::NetworkParameters of_fit, int n_meshes) {
  const std::clock_t begin = std::clock();
  std::vector<cables::CableNetwork> networks;
  for (int m = 1; m <= n_meshes; ++m) {
    of_fit.seed = static_cast<std::uint64_t>(m);
    networks.emplace_back(mesh::generate_network(s.experiment.cell, of_fit).network);
  }
  tensions::FitParameters parameters;
  parameters.n_meshes = n_meshes;
  const tensions::EnsembleFit fit = tensions::fit_ensemble(networks, data, s.adhesion_ids, parameters, 1);
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  double of_mean = 0, of_single = 0, size = 0, over_stated = 0;
  int n_covered = 0, n = 0;
  for (std::size_t i = 1; i < fit.tensions.fibre_ids.size(); ++i, ++n) {
    const double t = s.experiment.tensions[i].tension_nN;
    const double error = fit.tensions.nN[i].value - t;
    of_mean += error * error;
    size += t * t;
    over_stated += std::pow(error / fit.tensions.nN[i].standard_error, 2);
    const tensions::Interval interval = tensions::interval_95(fit.tensions.nN[i]);
    n_covered += interval.low <= t && t <= interval.high ? 1 : 0;
    for (const auto& mesh : fit.meshes)
      of_single += std::pow(mesh.fit.trial.tensions_nN[static_cast<Eigen::Index>(i)] - t, 2) / n_meshes;
  }
  std::printf("%d,%.4f,%.4f,%.2f,%.2f,%.1f\n", n_meshes, std::sqrt(of_single / size), std::sqrt(of_mean / size),
              std::sqrt(over_stated / n), double(n_covered) / n, seconds);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const int first = argc > 1 ? std::atoi(argv[1]) : 1, last = argc > 2 ? std::atoi(argv[2]) : first;
  const int n_meshes = argc > 3 ? std::atoi(argv[3]) : 8;
  std::printf("cell,truth,fit,meshes,error_of_one,error_of_mean,error_over_stated,coverage,cpu_s\n");
  for (int cell = first; cell <= last; ++cell) {
    const Scene s = scene(static_cast<std::uint64_t>(cell));
    for (const Formulation& truth : kTruths) {
      const tensions::LinearData data = measured(s, truth.parameters, static_cast<std::uint64_t>(cell));
      for (const Formulation& of_fit : kFits) {
        std::printf("%d,%s,%s,", cell, truth.name, of_fit.name);
        print_row(s, data, of_fit.parameters, n_meshes);
      }
    }
  }
}
