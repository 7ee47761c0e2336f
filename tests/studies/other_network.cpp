/// other_network STUDY [cells] [first seed]: how well tensions are found on other networks than the truth's, 20 nm of
/// noise. A table (CSV) on stdout.
///   formulations   the default ensemble beside one mesh in the thesis' formulation
///   forces         forces of the adhesions on networks of these truths, found and true, and their stated errors
///   wrong          of cells whose segmentation is wrong: tensions, forces of the adhesions without and with what the
///                  beads show beside the network, total force
#include <cstdio>
#include <cstring>
#include <string>

#include "mbtfm/fit/fit_cell.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/fit_results.h"
#include "samples/experiment/experiment.h"
#include "tests/support/tension_scene.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::tensions;

constexpr double kNoise_um = 0.02;

struct OtherNetwork {
  experiment::Experiment experiment;
  Eigen::VectorXd forces_nN;  ///< true, by adhesion
  std::vector<int> adhesion_ids;
  DisplacementField beads;  ///< noisy
  tensions::LinearData noisy;
};

struct Cells {
  std::uint64_t first = 1, last = 20;
};

/// Forces of the experiment's tensions on a network of this formulation, as fine as the simulator's.
Eigen::VectorXd forces_on(const experiment::Experiment& experiment, mesh::NetworkParameters p, std::uint64_t seed) {
  constexpr std::uint64_t kSeeds = 0x74727565;  // far from those of the fits
  p.seed = kSeeds + seed;
  p.edge_length_um = drawing::MechanicsParameters{}.simulation_edge_length_um;
  Network network = mesh::generate_network(experiment.cell, p).network;
  for (Link& link : network.links)
    if (link.fibre_id == 0) link.share *= p.edge_length_um / experiment::kReferenceEdge_um;
  const cables::CableNetwork cables(std::move(network));
  std::vector<double> tensions_nN;
  for (const Tension& t : experiment.tensions) tensions_nN.push_back(t.tension_nN);
  return cables.adhesion_forces_nN(tensions_nN, cables.equilibrium(tensions_nN));
}

Eigen::VectorXd forces_of(const experiment::Experiment& experiment) {
  Eigen::VectorXd forces_nN(2 * static_cast<Eigen::Index>(experiment.forces.size()));
  for (std::size_t a = 0; a < experiment.forces.size(); ++a)
    forces_nN.segment<2>(2 * static_cast<Eigen::Index>(a)) << experiment.forces[a].force_nN.x,
        experiment.forces[a].force_nN.y;
  return forces_nN;
}

/// @param truth  formulation of the cell's own network; none: the simulator's
OtherNetwork other_network(std::uint64_t seed, const mesh::NetworkParameters* truth = nullptr) {
  drawing::ScenarioParameters p;
  p.seed = seed;
  OtherNetwork o{
      .experiment = experiment::simulate(p, 2), .forces_nN = {}, .adhesion_ids = {}, .beads = {}, .noisy = {}};
  o.forces_nN = truth ? forces_on(o.experiment, *truth, seed) : forces_of(o.experiment);
  std::vector<Vec2> points;
  for (const Bead& bead : o.experiment.displacement) points.push_back(bead.position_um);
  std::vector<substrate::Ellipse> ellipses;
  for (const Adhesion& adhesion : o.experiment.cell.adhesions) {
    ellipses.push_back(substrate::ellipse_of(adhesion));
    o.adhesion_ids.push_back(adhesion.adhesion_id);
  }
  const Eigen::MatrixXd compliance =
      greens::make_greens(p.gel, {.model = substrate::ModelKind::layer}, 2)->compliance_um_per_nN(points, ellipses);
  DisplacementField exact = o.experiment.displacement;
  if (truth) {
    const Eigen::VectorXd u_um = compliance * o.forces_nN;
    for (std::size_t i = 0; i < exact.size(); ++i) {
      const auto row = 2 * static_cast<Eigen::Index>(i);
      exact[i].displacement_um = {u_um[row], u_um[row + 1]};
    }
  }
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, kNoise_um);
  DisplacementField noisy = exact;
  for (std::size_t i = 0; i < noisy.size(); ++i) {
    const double x = normal(random), y = normal(random);
    noisy[i].displacement_um += Vec2{x, y};
    noisy[i].sigma_um = kNoise_um;
  }
  o.beads = noisy;
  o.noisy = tensions::reduce(noisy, substrate::dense_response(compliance), {}, 2, tensions::affine_motions(noisy));
  return o;
}

std::vector<cables::CableNetwork> span(const Cell& cell, int n_meshes, mesh::NetworkParameters p = {}) {
  std::vector<cables::CableNetwork> networks;
  for (int m = 0; m < n_meshes; ++m) {
    p.seed = static_cast<std::uint64_t>(m) + 1;
    networks.emplace_back(mesh::generate_network(cell, p).network);
  }
  return networks;
}

tensions::EnsembleFit fitted_on(const std::vector<cables::CableNetwork>& networks, const tensions::LinearData& data,
                                const OtherNetwork& o, int threads = 2) {
  tensions::FitParameters parameters;
  parameters.n_meshes = static_cast<int>(networks.size());
  return tensions::fit_ensemble(networks, data, o.adhesion_ids, parameters, threads);
}

struct Score {
  double relative_error = 0;  ///< |t̂ − t| / |t| of the fibres
  double over_stated = 0;     ///< root mean square of error over stated standard error
  double coverage = 0;        ///< of the 95 % intervals
};

Score score(const tensions::EnsembleFit& fit, const OtherNetwork& o) {
  double error = 0, size = 0, over_stated = 0;
  int n_covered = 0, n = 0;
  for (std::size_t i = 1; i < fit.tensions.fibre_ids.size(); ++i, ++n) {
    const tensions::Estimate& estimate = fit.tensions.nN[i];
    const double t = o.experiment.tensions[i].tension_nN;
    const tensions::Interval interval = tensions::interval_95(estimate);
    error += std::pow(estimate.value - t, 2);
    size += t * t;
    over_stated += estimate.standard_error > 0 ? std::pow((estimate.value - t) / estimate.standard_error, 2) : 0;
    n_covered += interval.low <= t && t <= interval.high ? 1 : 0;
  }
  return {std::sqrt(error / size), std::sqrt(over_stated / n), double(n_covered) / n};
}

void formulations(Cells cells) {
  const mesh::NetworkParameters thesis = test::thesis_network();
  std::printf("cell,formulation,meshes,relative_error,rms_error_over_stated,coverage\n");
  for (std::uint64_t c = cells.first; c <= cells.last; ++c) {
    OtherNetwork o = other_network(c);
    for (const bool is_thesis : {false, true}) {
      const int n_meshes = is_thesis ? 1 : tensions::FitParameters{}.n_meshes;
      const Score s = score(
          fitted_on(span(o.experiment.cell, n_meshes, is_thesis ? thesis : mesh::NetworkParameters{}), o.noisy, o), o);
      std::printf("%d,%s,%d,%.4f,%.3f,%.3f\n", int(c), is_thesis ? "thesis" : "default", n_meshes, s.relative_error,
                  s.over_stated, s.coverage);
    }
  }
}

using Formulations = std::vector<std::pair<const char*, mesh::NetworkParameters>>;

Formulations true_formulations() {
  using enum drawing::TrueNetwork;
  return {{"second neighbours", experiment::formulation(second_neighbours)},
          {"edges", experiment::formulation(edges)},
          {"edges and rims", experiment::formulation(edges_rims)},
          {"edges and centres", experiment::formulation(edges_centres)}};
}

/// Of every adhesion: true force, found force, stated error; and of the cell's total.
void forces(Cells cells) {
  std::printf("cell,truth,adhesion_id,connected,true_nN,found_nN,sigma_nN,across_nN,network_nN,edge_um\n");
  for (std::uint64_t c = cells.first; c <= cells.last; ++c) {
    for (const auto& [name, truth] : true_formulations()) {
      OtherNetwork o = other_network(c, &truth);
      const tensions::EnsembleFit found =
          fitted_on(span(o.experiment.cell, tensions::FitParameters{}.n_meshes), o.noisy, o);
      const tensions::Estimate& total = found.total_force_nN;
      std::printf("%d,%s,0,0,%.5g,%.5g,%.5g,0,0,0\n", int(c), name, tensions::total_nN(o.forces_nN), total.value,
                  total.standard_error);
      const std::vector<AdhesionForce> by_adhesion = forces_of(found, o.experiment.cell);
      for (std::size_t a = 0; a < by_adhesion.size(); ++a) {
        const AdhesionForce& f = by_adhesion[a];
        const Eigen::Vector2d wanted = o.forces_nN.segment<2>(2 * static_cast<Eigen::Index>(a));
        const Eigen::Vector2d got(f.force_nN.x, f.force_nN.y), unit = got.normalized();
        std::printf("%d,%s,%d,%d,%.5g,%.5g,%.5g,%.5g,%.5g,%.5g\n", int(c), name, f.adhesion_id, int(f.connected),
                    wanted.norm(), got.norm(), f.sigma_nN.value_or(0), unit[0] * wanted[1] - unit[1] * wanted[0],
                    found.forces.of_network_nN.segment<2>(2 * static_cast<Eigen::Index>(a)).norm(),
                    distance_to_boundary_um(o.experiment.cell.outline_um, o.experiment.cell.adhesions[a].position_um));
      }
    }
  }
}

/// Held by the nearest adhesion within 1.5 um; types follow.
void hold_again(Cell& cell) {
  constexpr double kReach_um = 1.5;
  for (Fibre& f : cell.fibres) {
    const auto holder = [&](const std::optional<int>& was, Vec2 end) -> std::optional<int> {
      if (!was) return {};
      std::optional<int> nearest;
      double distance_um = kReach_um;
      for (const Adhesion& a : cell.adhesions)
        if (norm(a.position_um - end) < distance_um) distance_um = norm(a.position_um - end), nearest = a.adhesion_id;
      return nearest;
    };
    f.start_adhesion_id = holder(f.start_adhesion_id, f.points_um.front());
    f.end_adhesion_id = holder(f.end_adhesion_id, f.points_um.back());
    if (f.start_adhesion_id && f.start_adhesion_id == f.end_adhesion_id) f.end_adhesion_id.reset();
    const int n_held = int(f.start_adhesion_id.has_value()) + int(f.end_adhesion_id.has_value());
    f.type = n_held == 2 ? FibreType::ventral : n_held == 1 ? FibreType::dorsal : FibreType::arc;
  }
}

/// What a segmentation has of the cell: without its strongest fibres, without a fifth of the adhesions, with ends that
/// are off by 0.5 um in each coordinate, or with fibres that bow by 5 % of their length.
Cell seen_wrongly(const experiment::Experiment& e, const std::string& how, std::uint64_t seed) {
  Cell cell = e.cell;
  std::mt19937_64 random(seed + 77);
  std::normal_distribution<double> normal(0, 1);
  std::vector<Tension> strongest(e.tensions.begin() + 1, e.tensions.end());
  std::ranges::sort(strongest, std::greater(), &Tension::tension_nN);
  const std::size_t n_lost = how == "fibre" ? 1 : how == "two fibres" ? 2 : 0;
  for (std::size_t i = 0; i < n_lost; ++i)
    std::erase_if(cell.fibres, [&](const Fibre& f) { return f.fibre_id == strongest[i].fibre_id; });
  if (how == "adhesions") std::erase_if(cell.adhesions, [&](const Adhesion&) { return random() % 5 == 0; });
  for (Fibre& f : cell.fibres) {
    const Vec2 a = f.points_um.front(), along = f.points_um.back() - a;
    if (how == "ends")
      for (Vec2* end : {&f.points_um.front(), &f.points_um.back()}) {
        const double x = normal(random), y = normal(random);
        *end += 0.5 * Vec2{x, y};
      }
    if (how != "bows") continue;
    const Vec2 sag = 0.05 * normal(random) * Vec2{-along.y, along.x};
    f.points_um.clear();
    for (int k = 0; k <= 16; ++k) f.points_um.push_back(a + k / 16.0 * along + 4 * (k / 16.0) * (1 - k / 16.0) * sag);
  }
  if (how == "ends" || how == "adhesions") hold_again(cell);
  return cell;
}

/// By the program's own fit, beads and adhesions being on each other.
fit::FittedCell found_on(const Cell& cell, const DisplacementField& beads) {
  fit::Parameters p;
  p.gel = drawing::ScenarioParameters{}.gel;
  p.effects.channel_shift = p.effects.beads_under_load = p.compare_sheet = Switch::off;
  return fit::fit_cell({.cell = cell, .network = mesh::generate_network(cell, p.network).network, .beads = beads}, p,
                       2);
}

void wrong(Cells cells) {
  std::printf(
      "cell,truth,wrong,relative_error,coverage,rms_error_over_stated,force_error_network,force_error,"
      "force_coverage,total_over_truth,total_z,n_fibres_named,n_places_named\n");
  for (std::uint64_t c = cells.first; c <= cells.last; ++c) {
    for (const auto& [name, truth] : true_formulations()) {
      const OtherNetwork o = other_network(c, &truth);
      for (const std::string how : {"sound", "fibre", "two fibres", "adhesions", "ends", "bows"}) {
        const Cell seen = seen_wrongly(o.experiment, how, c);
        const std::vector<int> ids = adhesion_ids_of(seen);
        Eigen::VectorXd forces_nN(2 * std::ssize(ids));
        for (std::size_t i = 0; i < ids.size(); ++i)
          forces_nN.segment<2>(2 * static_cast<Eigen::Index>(i)) =
              o.forces_nN.segment<2>(2 * (std::ranges::find(o.adhesion_ids, ids[i]) - o.adhesion_ids.begin()));
        const fit::FittedCell found = found_on(seen, o.beads);
        double error = 0, size = 0, z = 0;
        int n_in = 0, n_forces_in = 0;
        const auto n = static_cast<int>(found.fit.tensions.fibre_ids.size()) - 1;
        for (int i = 1; i <= n; ++i) {
          const Estimate& t = found.fit.tensions.nN[i];
          const double true_nN =
              std::ranges::find(o.experiment.tensions, found.fit.tensions.fibre_ids[i], &Tension::fibre_id)->tension_nN;
          const Interval interval = interval_95(t);
          error += std::pow(t.value - true_nN, 2), size += true_nN * true_nN;
          z += std::pow((t.value - true_nN) / std::max(t.standard_error, 1e-9), 2);
          n_in += interval.low <= true_nN && true_nN <= interval.high;
        }
        const Eigen::VectorXd network_nN = found.fit.forces.nN.head(forces_nN.size()),
                              exerted_nN = adhesion_forces_nN(found.fit).head(forces_nN.size());
        for (std::size_t a = 0; a < ids.size(); ++a) {
          const auto at = 2 * static_cast<Eigen::Index>(a);
          const Eigen::Vector2d force = exerted_nN.segment<2>(at), off = force - forces_nN.segment<2>(at);
          const Estimate& magnitude = found.fit.forces.magnitudes[a];
          n_forces_in += std::abs(off.dot(force.normalized())) <= quantile_975(magnitude) * magnitude.standard_error;
        }
        const double total_nN = tensions::total_nN(o.forces_nN);
        const Estimate& total = found.fit.total_force_nN;
        std::printf("%d,%s,%s,%.4f,%.3f,%.3f,%.4f,%.4f,%.3f,%.4f,%.3f,%d,%d\n", int(c), name, how.c_str(),
                    std::sqrt(error / size), double(n_in) / n, std::sqrt(z / n),
                    (network_nN - forces_nN).norm() / forces_nN.norm(),
                    (exerted_nN - forces_nN).norm() / forces_nN.norm(), double(n_forces_in) / double(ids.size()),
                    total.value / total_nN, (total.value - total_nN) / total.standard_error,
                    int(found.checks.missing_fibres.size()), int(found.checks.missing_adhesions.size()));
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 1 << 12);
  Cells cells;
  if (argc > 3) cells.first = static_cast<std::uint64_t>(std::atoi(argv[3]));
  cells.last = cells.first + static_cast<std::uint64_t>(argc > 2 ? std::atoi(argv[2]) : 20) - 1;
  const std::pair<const char*, void (*)(Cells)> studies[] = {
      {"formulations", formulations}, {"forces", forces}, {"wrong", wrong}};
  for (const auto& [name, study] : studies) {
    if (argc < 2 || std::strcmp(argv[1], name) != 0) continue;
    study(cells);
    return 0;
  }
  std::fprintf(stderr, "other_network formulations|forces|wrong [cells] [first seed]\n");
  return 2;
}
