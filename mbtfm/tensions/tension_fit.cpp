#include "mbtfm/tensions/tension_fit.h"

#include <numeric>

#include "pipeline/stage/parameters.h"

namespace mbtfm::tensions {

void declare(stage::ParameterList& list, FitParameters& p) {
  list.table("fit");
  list.add("method", p.method, "method that fits the tensions to the beads' displacements");
  list.add("gradients", p.gradients, "how the conjugate gradient methods compute gradients");
  list.add("robust_kind", p.robust_kind, "loss function of the residuals if the effect robust_loss is on",
           {Loss::huber, Loss::tukey, Loss::l1});
  list.add("substrate", p.substrate,
           "displacements of a trial: by the compliance matrix, or solved for each trial (per-evaluation)");
  list.add("region_um", p.region_um, Range::zero_or_size_um(),
           "beads further outside the outline are left out of the fit (um); unset: none");
  list.add("n_meshes", p.n_meshes, Range::between(1, 1000),
           "number of networks; tensions are their mean, and two or more give the error of the model");
  list.add("tolerance", p.tolerance, Range::between(1e-15, 1),
           "relative change of the tensions at which the fit stops");
  list.add("max_steps", p.max_steps, Range::between(1, 100000), "most steps of the Gauss-Newton method");
  list.add("max_evaluations", p.max_evaluations, Range::between(1, 10000000),
           "most equilibria of a conjugate gradient method");
  list.add("far_distance_um", p.far_distance_um, Range::zero_or_size_um(),
           "beads further outside the outline give the noise (um)");
  list.add("frame_interval_s", p.frame_interval_s, Range::between(1e-6, 1e7),
           "time between the frames of a series (s)");
  list.add("bootstrap", p.bootstrap, Range::between(0, 1000000),
           "draws of the parametric bootstrap for the intervals; 0: intervals by the misfit's profile");
  list.add("surface_lines", p.surface_lines, Range::between(8, 10000),
           "lattice lines of the surface in substrate.vtu, over the cell's longer side");
  list.add("cross_validation", p.cross_validation, Range::between(0, 1000000),
           "draws of tensions by fibre type, and with dorsal and ventral exchanged, to compare misfits; 0: none");
}

TensionFit fit_tensions(const TensionProblem& problem, const FitParameters& parameters, int threads, const Trial& start,
                        Search search) {
  if (parameters.method == FitMethod::gauss_newton) return fit_gauss_newton(problem, parameters, start, search);
  std::vector<int> all(problem.n_tensions());
  std::iota(all.begin(), all.end(), 0);
  if (parameters.method == FitMethod::plain_cg) {
    return fit_conjugate_gradients(problem, parameters, threads, start, {{.tensions = all, .n_steps = 10}});
  }
  // thesis 3.2.5: one step on the network, ten on the fibres
  const std::vector<int> fibres(all.begin() + 1, all.end());
  std::vector<Block> blocks = {{.tensions = {0}, .n_steps = 1}};
  if (!fibres.empty()) blocks.push_back({.tensions = fibres, .n_steps = 10});
  return fit_conjugate_gradients(problem, parameters, threads, start, blocks);
}

}  // namespace mbtfm::tensions
