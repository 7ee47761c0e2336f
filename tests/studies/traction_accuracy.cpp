/// Accuracy of traction reconstructions on the eight-ellipse scene, over noise that no parameter was chosen on.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "mbtfm/tractions/fttc.h"
#include "tests/support/ellipse_scene.h"

namespace mbtfm::tractions {
namespace {

constexpr unsigned kFirstSeed = 401;

/// Error of FTTC's map at its automatic lambda over that at the best possible one.
void fttc_against_the_best(int n_side, double noise, int n_seeds) {
  double worst = 0, reached = 0, best_of_all = 0;
  for (int s = 0; s < n_seeds; ++s) {
    const test::EllipseScene scene = test::ellipse_scene(n_side, noise, kFirstSeed + s, 0, 64, noise > 0);
    const LatticeProblem problem(
        scene.field, scene.gel,
        {.model = GelModel::half_space, .spacing_um = {}, .padding = 1.5, .basis = Basis::waves, .threads = 2});
    TikhonovSolver solver(problem);
    const auto error_at = [&](double lambda) {
      solver.solve(lambda, 1e-4);
      return test::traction_error(scene, tractions_kPa(problem, solver.solution(), ReadOut::cells, 0));
    };
    const double automatic = error_at(scan_lambda(problem, solver).by_risk);
    double best = 1;
    for (double lambda = 1; lambda > 0.008; lambda /= 1.3) best = std::min(best, error_at(lambda));
    worst = std::max(worst, automatic / best);
    reached += automatic / n_seeds;
    best_of_all += best / n_seeds;
  }
  std::printf("fttc %d², noise %3.0f %%: L2 %.3f, best possible %.3f, worst ratio %.3f (%d seeds)\n", n_side,
              100 * noise, reached, best_of_all, worst, n_seeds);
}

void forces_and_their_errors(TractionMethod method, double noise, int n_seeds) {
  TractionParameters parameters;
  parameters.method = method;
  parameters.gel_model = GelModel::half_space;
  double force_error = 0, map_error = 0, squares = 0;
  for (int s = 0; s < n_seeds; ++s) {
    const test::EllipseScene scene = test::ellipse_scene(128, noise, kFirstSeed + s);
    const Reconstruction r = reconstruct(
        {.beads = scene.field, .gel = scene.gel, .adhesions = scene.adhesions, .outline_um = {}}, parameters, 2);
    std::vector<Vec2> forces, tractions;
    for (const AdhesionForce& f : r.forces) forces.push_back(f.force_nN);
    for (const Patch& p : r.patches) tractions.push_back(p.traction_kPa);
    force_error += test::force_error(scene, forces) / n_seeds;
    if (tractions.size() == scene.tractions_kPa.size()) map_error += test::traction_error(scene, tractions) / n_seeds;
    for (std::size_t a = 0; a < forces.size(); ++a) {
      const double off = norm(forces[a]) - norm(scene.forces_nN[a]);
      squares += std::pow(off / std::max(r.forces[a].sigma_nN.value_or(0), 1e-9), 2) / (8 * n_seeds);
    }
  }
  std::printf("%-15s noise %3.0f %%: F %.4f", name_of(method), 100 * noise, force_error);
  if (map_error > 0) std::printf(", L2 %.3f", map_error);
  if (noise > 0) std::printf(", mean (error/sigma)² %.2f", squares);
  std::printf(" (%d seeds)\n", n_seeds);
}

}  // namespace
}  // namespace mbtfm::tractions

int main() {
  using namespace mbtfm::tractions;
  for (const double noise : {0.0, 0.05, 0.1}) {
    const bool is_noisy = noise > 0;
    fttc_against_the_best(128, noise, is_noisy ? 6 : 1);
    fttc_against_the_best(256, noise, is_noisy ? 2 : 1);
    forces_and_their_errors(TractionMethod::fttc, noise, is_noisy ? 6 : 1);
    forces_and_their_errors(TractionMethod::sparse, noise, is_noisy ? 6 : 1);
    forces_and_their_errors(TractionMethod::adhesion_forces, noise, is_noisy ? 10 : 1);
  }
}
