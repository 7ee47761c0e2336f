/// other_network STUDY [cells]: how well tensions are found on other networks than the truth's, 20 nm of noise. A table
/// (CSV) on stdout.
///   formulations   the default ensemble of eight meshes beside one mesh in the thesis' formulation
///   parts          what the error is made of: the beads' noise, the ensemble's size, the truth's own network
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "samples/experiment.h"
#include "tests/support/tension_scene.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::inverse;

constexpr double kNoise_um = 0.02;

struct OtherNetwork {
  samples::Experiment experiment;
  std::vector<int> adhesion_ids;
  LinearData noisy, exact;  ///< weighted alike
};

OtherNetwork other_network(std::uint64_t seed) {
  samples::ScenarioParameters p;
  p.seed = seed;
  OtherNetwork o{.experiment = samples::simulate(p, 2), .adhesion_ids = {}, .noisy = {}, .exact = {}};
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, kNoise_um);
  std::vector<Vec2> points;
  DisplacementField noisy = o.experiment.displacement, exact = noisy;
  for (std::size_t i = 0; i < noisy.size(); ++i) {
    const double x = normal(random), y = normal(random);
    noisy[i].displacement_um += Vec2{x, y};
    noisy[i].sigma_um = exact[i].sigma_um = kNoise_um;
    points.push_back(noisy[i].position_um);
  }
  std::vector<substrate::Ellipse> ellipses;
  for (const Adhesion& adhesion : o.experiment.cell.adhesions) {
    ellipses.push_back(substrate::ellipse_of(adhesion));
    o.adhesion_ids.push_back(adhesion.adhesion_id);
  }
  const Eigen::MatrixXd compliance =
      substrate::make_greens(p.gel, {.model = "layer"}, 2)->compliance_um_per_nN(points, ellipses);
  o.noisy = reduce(noisy, compliance);
  o.exact = reduce(exact, compliance);
  return o;
}

std::vector<network::CableNetwork> span(const Cell& cell, int n_meshes, network::NetworkParameters p = {}) {
  std::vector<network::CableNetwork> networks;
  for (int m = 0; m < n_meshes; ++m) {
    p.seed = static_cast<std::uint64_t>(m) + 1;
    networks.emplace_back(network::generate_network(cell, p).network);
  }
  return networks;
}

EnsembleFit fit(const std::vector<network::CableNetwork>& networks, LinearData& data, const OtherNetwork& o) {
  FitParameters parameters;
  parameters.n_meshes = static_cast<int>(networks.size());
  return fit_ensemble(networks, data, o.adhesion_ids, parameters, 2, {});
}

/// |t̂ − t| / |t| of the fibres
double relative_error(const EnsembleFit& fit, const OtherNetwork& o) {
  double error = 0, size = 0;
  for (std::size_t i = 1; i < fit.fibre_ids.size(); ++i) {
    const double t = o.experiment.tensions[i].tension_nN;
    error += std::pow(fit.tensions_nN[i].value - t, 2);
    size += t * t;
  }
  return std::sqrt(error / size);
}

void formulations(int n_cells) {
  network::NetworkParameters thesis;
  thesis.link_weights = "equal";
  thesis.link_reach = "neighbours";
  thesis.adhesion_anchor = "centre";
  std::printf("cell,formulation,meshes,relative_error,rms_error_over_stated,coverage\n");
  for (int c = 1; c <= n_cells; ++c) {
    OtherNetwork o = other_network(static_cast<std::uint64_t>(c));
    for (const bool is_thesis : {false, true}) {
      const int n_meshes = is_thesis ? 1 : FitParameters{}.n_meshes;
      const EnsembleFit found =
          fit(span(o.experiment.cell, n_meshes, is_thesis ? thesis : network::NetworkParameters{}), o.noisy, o);
      double squares = 0;
      int n_covered = 0, n = 0;
      for (std::size_t i = 1; i < found.fibre_ids.size(); ++i) {
        const Estimate& estimate = found.tensions_nN[i];
        const double t = o.experiment.tensions[i].tension_nN, stated = estimate.standard_error();
        const Interval interval = interval_95(estimate, n_meshes);
        squares += stated > 0 ? std::pow((estimate.value - t) / stated, 2) : 0;
        n_covered += interval.low <= t && t <= interval.high ? 1 : 0;
        ++n;
      }
      std::printf("%d,%s,%d,%.4f,%.3f,%.3f\n", c, is_thesis ? "thesis" : "default", n_meshes, relative_error(found, o),
                  std::sqrt(squares / n), double(n_covered) / n);
    }
  }
}

void parts(int n_cells) {
  network::NetworkParameters fine;
  fine.edge_length_um = samples::MechanicsParameters{}.simulation_edge_length_um;
  std::printf("cell,own_network,meshes_8,meshes_32,exact_meshes_8,exact_meshes_32,exact_meshes_8_of_its_edge\n");
  for (int c = 1; c <= n_cells; ++c) {
    OtherNetwork o = other_network(static_cast<std::uint64_t>(c));
    const Cell& cell = o.experiment.cell;
    std::vector<network::CableNetwork> own;
    own.emplace_back(o.experiment.network);
    const std::vector<network::CableNetwork> eight = span(cell, 8), many = span(cell, 32);
    std::printf("%d,%.4f,%.4f,%.4f,", c, relative_error(fit(own, o.noisy, o), o),
                relative_error(fit(eight, o.noisy, o), o), relative_error(fit(many, o.noisy, o), o));
    std::printf("%.4f,%.4f,%.4f\n", relative_error(fit(eight, o.exact, o), o), relative_error(fit(many, o.exact, o), o),
                relative_error(fit(span(cell, 8, fine), o.exact, o), o));
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 1 << 12);
  const int n_cells = argc > 2 ? std::atoi(argv[2]) : 20;
  const std::pair<const char*, void (*)(int)> studies[] = {{"formulations", formulations}, {"parts", parts}};
  for (const auto& [name, study] : studies) {
    if (argc < 2 || std::strcmp(argv[1], name) != 0) continue;
    study(n_cells);
    return 0;
  }
  std::fprintf(stderr, "other_network formulations|parts [cells]\n");
  return 2;
}
