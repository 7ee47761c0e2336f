#include <cmath>

#include "mbtfm/fit/networks.h"
#include "mbtfm/plan/experiment.h"
#include "mbtfm/plan/grid.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/fit_results.h"
#include "substrate/choice/factory.h"
#include "substrate/loads.h"

namespace mbtfm::plan {

using namespace tensions;

namespace {

LinearData data_of(const Scene& scene, const Experiment& e, const Point& point, int threads) {
  const auto gel = choice::make_substrate(gel_of(scene, point), scene.fit.substrate, threads);
  auto response = gel->response({substrate::ellipses_of(e.cell.adhesions)}, {points_of(e.beads)})->kept();
  return reduce(e.beads, std::move(response), {}, threads,
                allows_common_motion(scene.fit.effects) ? affine_motions(e.beads) : Eigen::MatrixXd());
}

EnsembleFit fit_of(const Scene& scene, const KnownCell& cell, const Experiment& e, LinearData data, int threads) {
  const std::vector<cables::CableNetwork> networks =
      fit::of_cables(fit::span_ensemble(e.cell, scene.fit, threads), cell.networks.front().parameters());
  return fit_ensemble(networks, std::move(data), cell.adhesion_ids, scene.fit.fit, threads);
}

}  // namespace

void sum_up(Drawn& drawn) {
  double squares = 0;
  for (const DrawnNumber& t : drawn.numbers) squares += std::pow((t.found_nN - t.true_nN) / t.predicted_error_nN, 2);
  const auto n = static_cast<double>(drawn.numbers.size());
  if (n == 0) return;
  drawn.error_over_predicted = std::sqrt(squares / n);
  drawn.by_chance = std::sqrt(0.5 / n);  // of normal errors, were they independent
}

Drawn draw_experiments(const Scene& scene, const Computed& c, const Point& point, int n_experiments, const Work& work) {
  Drawn drawn{.point = point, .n_experiments = n_experiments};
  std::vector<double> with_network, alone, fttc;
  for (int k = 0; k < n_experiments; ++k) {
    work.tell(0.6 + 0.35 * k / n_experiments, "drawing experiments");
    const Experiment e = experiment_of(scene, c.cell, point, static_cast<std::uint64_t>(k), work.threads);
    LinearData data = data_of(scene, e, point, work.threads);
    add_errors_along(alone, free_forces_nN(data.reduced), c.cell.forces_nN);
    const EnsembleFit fit = fit_of(scene, c.cell, e, std::move(data), work.threads);
    add_errors_along(with_network, adhesion_forces_nN(fit), c.cell.forces_nN);
    add_errors_along(fttc, fttc_forces_nN(scene, e, point, work.threads), c.cell.forces_nN);
    for (std::size_t i = 1; i < fit.tensions.fibre_ids.size(); ++i)
      drawn.numbers.push_back({.experiment = k + 1,
                               .id = fit.tensions.fibre_ids[i],
                               .true_nN = c.cell.tensions_nN[static_cast<Eigen::Index>(i)],
                               .found_nN = fit.tensions.nN[i].value,
                               .predicted_error_nN = standard_error_nN(c, i, point),
                               .stated_error_nN = fit.tensions.nN[i].standard_error});
  }
  drawn.forces = {robust_error(with_network), robust_error(alone), robust_error(fttc)};
  sum_up(drawn);
  return drawn;
}

}  // namespace mbtfm::plan
