#include "mbtfm/plan/drawn.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mbtfm/fit/networks.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/numerics/order_statistics.h"
#include "substrate/choice/factory.h"

namespace mbtfm::plan {

using namespace tensions;

namespace {

struct Experiment {
  Cell cell;  ///< as segmented
  DisplacementField beads;
};

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

Experiment experiment_of(const Scene& scene, const KnownCell& cell, const Point& point, std::uint64_t draw,
                         int threads) {
  constexpr std::uint64_t kFirst = 100;  // the plan itself takes the first draws of beads
  drawing::Random noise(scene.experiment.seed, drawing::Stream::noise, kFirst + draw),
      segmentation(scene.experiment.seed, drawing::Stream::specimen, kFirst + draw);
  const BeadsOnGel beads = beads_on_gel(scene, cell, point.beads_per_um2, kFirst + draw, threads);
  return {as_segmented(scene.cell.cell, scene.fit.segmentation, segmentation),
          measured(beads, cell.forces_nN, point, noise)};
}

Gel gel_of(const Scene& scene, const Point& point) {
  Gel gel = scene.fit.gel;
  gel.youngs_modulus_kPa = point.youngs_modulus_kPa;
  return gel;
}

LinearData data_of(const Scene& scene, const Experiment& e, const Point& point, int threads) {
  const auto gel = choice::make_substrate(gel_of(scene, point), scene.fit.substrate, threads);
  auto response = gel->response({ellipses_of(e.cell)}, {points_of(e.beads)})->kept();
  return reduce(e.beads, std::move(response), {}, threads,
                allows_common_motion(scene.fit.effects) ? affine_motions(e.beads) : Eigen::MatrixXd());
}

EnsembleFit fit_of(const Scene& scene, const KnownCell& cell, const Experiment& e, LinearData data, int threads) {
  const std::vector<cables::CableNetwork> networks =
      fit::of_cables(fit::span_ensemble(e.cell, scene.fit, threads), cell.networks.front().parameters());
  return fit_ensemble(networks, std::move(data), cell.adhesion_ids, scene.fit.fit, threads);
}

Eigen::VectorXd fttc_forces_nN(const Scene& scene, const Experiment& e, const Point& point, int threads) {
  const tractions::TractionParameters parameters;
  const tractions::Reconstruction r = tractions::reconstruct_fttc(
      {.beads = e.beads, .gel = gel_of(scene, point), .adhesions = {}, .outline_um = e.cell.outline_um}, parameters,
      threads);
  Eigen::VectorXd forces_nN(2 * static_cast<Eigen::Index>(e.cell.adhesions.size()));
  Eigen::Index row = 0;
  for (const AdhesionForce& f : tractions::forces_by_adhesion(r.patches, e.cell.adhesions, parameters.grow_um)) {
    forces_nN.segment<2>(row) << f.force_nN.x, f.force_nN.y;
    row += 2;
  }
  return forces_nN;
}

/// Along the true forces.
void add_errors(std::vector<double>& errors_nN, const Eigen::VectorXd& found_nN, const Eigen::VectorXd& true_nN) {
  const Eigen::VectorXd along = directions_of(true_nN);
  for (Eigen::Index row = 0; row < true_nN.size(); row += 2)
    errors_nN.push_back(std::abs(along.segment<2>(row).dot(found_nN.segment<2>(row) - true_nN.segment<2>(row))));
}

double robust_error(std::vector<double> magnitudes) {
  constexpr double kNormalOfMedian = 1.4826;  // standard deviation of a normal variable over its median magnitude
  return kNormalOfMedian * numerics::median_in(magnitudes);
}

void sum_up(Drawn& drawn) {
  double squares = 0;
  for (const DrawnTension& t : drawn.tensions) squares += std::pow((t.found_nN - t.true_nN) / t.predicted_error_nN, 2);
  const auto n = static_cast<double>(drawn.tensions.size());
  if (n == 0) return;
  drawn.error_over_predicted = std::sqrt(squares / n);
  drawn.by_chance = std::sqrt(0.5 / n);  // of normal errors, were they independent
}

}  // namespace

Cell as_segmented(Cell cell, const SegmentationErrors& p, drawing::Random& random) {
  for (Adhesion& a : cell.adhesions) {
    const double x = random.normal(), y = random.normal();
    a.position_um += p.adhesion_shift_error_um * Vec2{x, y};
    const double growth = std::exp(0.5 * p.adhesion_area_error * random.normal());
    a.major_axis_um *= growth;
    a.minor_axis_um *= growth;
    a.area_um2 *= growth * growth;
    a.angle_rad += p.adhesion_angle_error_deg * std::numbers::pi / 180 * random.normal();
  }
  const auto move_end = [&](Vec2& end, const Vec2 before) {
    constexpr double kMost = 0.9;  // of the last piece: a fibre does not turn back
    const double length_um = norm(end - before);
    const double by_um = std::max(-kMost * length_um, p.fibre_end_error_um * random.normal());
    end += (by_um / length_um) * (end - before);
  };
  for (Fibre& f : cell.fibres) {
    const auto n = f.points_um.size();
    if (!f.start_adhesion_id) move_end(f.points_um.front(), f.points_um[1]);
    if (!f.end_adhesion_id) move_end(f.points_um.back(), f.points_um[n - 2]);
  }
  return cell;
}

Drawn draw_experiments(const Scene& scene, const Computed& c, const Point& point, int n_experiments, const Work& work) {
  Drawn drawn{.point = point, .tensions = {}, .forces = {}, .n_experiments = n_experiments};
  std::vector<double> with_network, alone, fttc;
  for (int k = 0; k < n_experiments; ++k) {
    work.tell(0.6 + 0.35 * k / n_experiments, "drawing experiments");
    const Experiment e = experiment_of(scene, c.cell, point, static_cast<std::uint64_t>(k), work.threads);
    LinearData data = data_of(scene, e, point, work.threads);
    add_errors(alone, free_forces_nN(data.reduced), c.cell.forces_nN);
    const EnsembleFit fit = fit_of(scene, c.cell, e, std::move(data), work.threads);
    add_errors(with_network, adhesion_forces_nN(fit), c.cell.forces_nN);
    add_errors(fttc, fttc_forces_nN(scene, e, point, work.threads), c.cell.forces_nN);
    for (std::size_t i = 1; i < fit.fibre_ids.size(); ++i)
      drawn.tensions.push_back({.experiment = k + 1,
                                .fibre_id = fit.fibre_ids[i],
                                .true_nN = c.cell.tensions_nN[static_cast<Eigen::Index>(i)],
                                .found_nN = fit.tensions_nN[i].value,
                                .predicted_error_nN = standard_error_nN(c, i, point),
                                .stated_error_nN = fit.tensions_nN[i].standard_error});
  }
  drawn.forces = {robust_error(with_network), robust_error(alone), robust_error(fttc)};
  sum_up(drawn);
  return drawn;
}

}  // namespace mbtfm::plan
