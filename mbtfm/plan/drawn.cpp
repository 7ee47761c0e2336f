#include "mbtfm/plan/drawn.h"

#include <algorithm>
#include <cmath>

#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/ensemble.h"
#include "pipeline/numerics/order_statistics.h"
#include "samples/drawing/random.h"

namespace mbtfm::plan {

using namespace tensions;

namespace {

/// Displacements on a gel of another modulus, with noise.
DisplacementField measured(const BeadsOnGel& beads, const Eigen::VectorXd& forces_nN, const Point& point,
                           drawing::Random& random) {
  DisplacementField field = exact_beads(beads.places_um, *beads.response, forces_nN, point.noise_um);
  for (Bead& b : field) {
    const double x = random.normal(), y = random.normal();
    b.displacement_um =
        (beads.modulus_kPa / point.youngs_modulus_kPa) * b.displacement_um + point.noise_um * Vec2{x, y};
  }
  return field;
}

EnsembleFit fit_of(const Scene& scene, const KnownCell& cell, const BeadsOnGel& beads, const DisplacementField& field,
                   const Point& point, int threads) {
  auto response =
      substrate::dense_response((beads.modulus_kPa / point.youngs_modulus_kPa) * beads.response->matrix(), threads);
  LinearData data = reduce(field, std::move(response), {}, threads,
                           allows_common_motion(scene.fit.effects) ? affine_motions(field) : Eigen::MatrixXd());
  return fit_ensemble(cell.networks, std::move(data), cell.adhesion_ids, scene.fit.fit, threads, {});
}

void sum_up(Drawn& drawn) {
  double squares = 0;
  std::vector<double> stated;
  for (const DrawnTension& t : drawn.tensions) {
    squares += std::pow((t.found_nN - t.true_nN) / t.predicted_error_nN, 2);
    stated.push_back(t.stated_error_nN / t.predicted_error_nN);
  }
  const auto n = static_cast<double>(drawn.tensions.size());
  if (n == 0) return;
  drawn.error_over_predicted = std::sqrt(squares / n);
  drawn.stated_over_predicted = numerics::median_in(stated);
  drawn.by_chance = std::sqrt(0.5 / n);  // of normal errors, were they independent
}

}  // namespace

Drawn draw_experiments(const Scene& scene, const Computed& c, const Point& point, int n_experiments, const Work& work) {
  Drawn drawn{.point = point, .tensions = {}, .n_experiments = n_experiments};
  for (int k = 0; k < n_experiments; ++k) {
    work.tell(0.6 + 0.35 * k / n_experiments, "drawing experiments");
    const auto draw = static_cast<std::uint64_t>(k) + 1;
    const BeadsOnGel beads = beads_on_gel(scene, c.cell, point.beads_per_um2, draw, work.threads);
    drawing::Random random(scene.experiment.seed, drawing::Stream::noise, draw);
    const DisplacementField field = measured(beads, c.cell.forces_nN, point, random);
    const EnsembleFit fit = fit_of(scene, c.cell, beads, field, point, work.threads);
    for (std::size_t i = 1; i < fit.fibre_ids.size(); ++i)
      drawn.tensions.push_back({.experiment = k + 1,
                                .fibre_id = fit.fibre_ids[i],
                                .true_nN = c.cell.tensions_nN[static_cast<Eigen::Index>(i)],
                                .found_nN = fit.tensions_nN[i].value,
                                .predicted_error_nN = standard_error_nN(c, i, point),
                                .stated_error_nN = fit.tensions_nN[i].standard_error});
  }
  sum_up(drawn);
  return drawn;
}

}  // namespace mbtfm::plan
