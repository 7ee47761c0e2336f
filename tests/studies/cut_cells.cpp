/// cut_cells fits [cells] [first seed]: simulated cells that the image cuts, against the truth of the whole cell. A
/// table (CSV) on stdout: by cell and cut, relative error of the identifiable tensions (and that of the same fibres
/// where the whole cell is fitted), coverage of their 95 % intervals; root mean square error over standard error of the
/// adhesions' forces, coverage; force through the cut, true and found, error over standard error by component.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tests/support/cut_cell.h"

namespace {

using namespace mbtfm;
using test::Beyond;

struct Score {
  double error = 0, size = 0;
  int n = 0, n_covered = 0;
  double over_sigma = 0;
  void add(double found, double truth, double sigma, bool is_covered) {
    error += (found - truth) * (found - truth);
    size += truth * truth;
    over_sigma += (found - truth) * (found - truth) / (sigma * sigma);
    ++n;
    n_covered += is_covered;
  }
};

Score tensions(const tensions::EnsembleFit& fit, const std::vector<Tension>& truth, const Cell& of) {
  Score score;
  for (const Fibre& f : of.fibres) {
    const auto i = std::ranges::find(fit.tensions.fibre_ids, f.fibre_id) - fit.tensions.fibre_ids.begin();
    if (static_cast<std::size_t>(i) == fit.tensions.fibre_ids.size()) continue;
    const tensions::Estimate& e = fit.tensions.nN[static_cast<std::size_t>(i)];
    const double t = std::ranges::find(truth, f.fibre_id, &Tension::fibre_id)->tension_nN;
    const tensions::Interval interval = tensions::interval_95(e);
    score.add(e.value, t, std::max(1e-9, e.standard_error), interval.low <= t && t <= interval.high);
  }
  return score;
}

Score adhesions(const tensions::EnsembleFit& fit, const test::CutCell& cut, const std::vector<AdhesionForce>& truth) {
  Score score;
  for (std::size_t a = 0; a < cut.cell.adhesions.size(); ++a) {
    const int id = cut.cell.adhesions[a].adhesion_id;
    if (cut.share_inside.at(id) < 1) continue;  // what is seen of it is no adhesion of its own
    const auto row = 2 * static_cast<Eigen::Index>(a);
    const Eigen::VectorXd exerted = tensions::adhesion_forces_nN(fit);
    const Vec2 found{exerted[row], exerted[row + 1]};
    const Vec2 t = std::ranges::find(truth, id, &AdhesionForce::adhesion_id)->force_nN;
    const tensions::Estimate& e = fit.forces.magnitudes[a];
    const double along = norm(found) > 0 ? dot(t, found) / norm(found) : 0;
    const tensions::Interval interval = tensions::interval_95(e);
    score.add(norm(found), along, std::max(1e-9, e.standard_error),
              std::abs(norm(found) - along) <= interval.high - e.value);
  }
  return score;
}

/// The cell as far as it is right of a part of its width and, with two sides, below a quarter of its height.
test::Window window_of(const Cell& cell, int sides, double part) {
  Vec2 low = cell.outline_um.front(), high = low;
  for (const Vec2 q : cell.outline_um) {
    low = {std::min(low.x, q.x), std::min(low.y, q.y)};
    high = {std::max(high.x, q.x), std::max(high.y, q.y)};
  }
  test::Window window{{-1e4, -1e4}, {1e4, 1e4}};
  window.low_um.x = low.x + part * (high.x - low.x);
  if (sides == 2) window.low_um.y = low.y + 0.25 * (high.y - low.y);
  return window;
}

experiment::Experiment experiment(int seed) {
  drawing::ScenarioParameters p;
  p.seed = static_cast<std::uint64_t>(seed);
  return experiment::simulate(p, 2);
}

/// Forces of the adhesions in the cell less those of a network held at the cut with the true tensions, by distance.
void profile(int n_cells, int first) {
  std::printf("cell,part,distance_um,difference_nN,true_nN\n");
  for (int seed = first; seed < first + n_cells; ++seed) {
    const experiment::Experiment e = ::experiment(seed);
    for (const double part : {0.25, 0.35, 0.5}) {
      const test::CutCell cut = test::cut_cell(e.cell, e.forces, window_of(e.cell, 1, part));
      const cables::CableNetwork cables(mesh::generate_network(cut.cell, {}).network);
      std::vector<double> tensions_nN;
      for (const int id : cables.fibre_ids())
        tensions_nN.push_back(std::ranges::find(e.tensions, id, &Tension::fibre_id)->tension_nN);
      const Eigen::VectorXd forces = cables.adhesion_forces_nN(tensions_nN, cables.equilibrium(tensions_nN));
      for (const Adhesion& a : cut.cell.adhesions) {
        if (cut.share_inside.at(a.adhesion_id) < 1) continue;
        const auto row = 2 * (std::ranges::find(cables.adhesion_ids(), a.adhesion_id) - cables.adhesion_ids().begin());
        const Vec2 truth = std::ranges::find(e.forces, a.adhesion_id, &AdhesionForce::adhesion_id)->force_nN;
        std::printf("%d,%g,%.3f,%.4f,%.4f\n", seed, part, distance_to_cut_um(cut.cell, a.position_um),
                    norm(truth - Vec2{forces[row], forces[row + 1]}), norm(truth));
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 1 << 12);
  const int n_cells = argc > 2 ? std::atoi(argv[2]) : 6, first = argc > 3 ? std::atoi(argv[3]) : 41;
  if (argc > 1 && std::strcmp(argv[1], "profile") == 0) {
    profile(n_cells, first);
    return 0;
  }
  std::printf(
      "cell,sides,part,beyond,fibres,tension_error,of_whole,covered,adhesions,force_over_sigma,force_covered,true_x,"
      "true_y,"
      "cut_x,cut_y,sigma_x,sigma_y,over_sigma_x,over_sigma_y,places,motions,intensity,chi_squared,growth_over_sigma\n");
  for (int seed = first; seed < first + n_cells; ++seed) {
    const Gel gel = drawing::ScenarioParameters{}.gel;
    const experiment::Experiment e = ::experiment(seed);
    DisplacementField measured = e.measured;
    for (Bead& b : measured) b.sigma_um = e.noise_um;
    const test::CutFit whole = test::fit_cut(e.cell, measured, gel, 4);
    for (const int sides : {1, 2}) {
      for (const double part : {0.25, 0.35, 0.5}) {
        const test::Window window = window_of(e.cell, sides, part);
        const test::CutCell cut = test::cut_cell(e.cell, e.forces, window);
        const DisplacementField beads = test::beads_in(measured, window);
        for (const Beyond allow : {Beyond::allowed, Beyond::ignored}) {
          if (allow == Beyond::ignored && part != 0.35) continue;
          const test::CutFit found = test::fit_cut(cut.cell, beads, gel, 4, allow);
          Cell known = cut.cell;  // its fibres whose tensions are identifiable
          std::erase_if(known.fibres, [&, all = tensions::tensions_of(found.fit)](const Fibre& fibre) {
            const auto at = std::ranges::find(all, fibre.fibre_id, &Tension::fibre_id);
            return at == all.end() || !at->identifiable;
          });
          const Score t = ::tensions(found.fit, e.tensions, known), w = ::tensions(whole.fit, e.tensions, known);
          const Score f = adhesions(found.fit, cut, e.forces);
          const tensions::CutForce& c = *found.fit.cut;
          const double x = c.x_nN.value, y = c.y_nN.value;
          const auto beyond = found.beyond.value_or(tensions::ForcesBeyond{});
          std::printf(
              "%d,%d,%g,%s,%d,%.4f,%.4f,%.3f,%d,%.3f,%.3f,%.2f,%.2f,%.2f,%.2f,%.2f,%.2f,%.2f,%.2f,%d,%d,%.3g,%.3f,%."
              "2f\n",
              seed, sides, part, allow == Beyond::allowed ? "allowed" : "ignored", t.n, std::sqrt(t.error / t.size),
              std::sqrt(w.error / w.size), double(t.n_covered) / t.n, f.n, std::sqrt(f.over_sigma / f.n),
              double(f.n_covered) / f.n, cut.outside_nN.x, cut.outside_nN.y, x, y, c.x_nN.standard_error,
              c.y_nN.standard_error, (x - cut.outside_nN.x) / c.x_nN.standard_error,
              (y - cut.outside_nN.y) / c.y_nN.standard_error, int(beyond.n_places), int(beyond.n_motions),
              beyond.intensity_nN_per_um, found.fit.misfit.chi_squared_per_degree,
              found.motion->motion.growth / found.motion->sigma[3]);
        }
      }
    }
  }
  return 0;
}
