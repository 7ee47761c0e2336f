/// Experiments that are simulated with the cell of a plan, and what a fit and the usual method find in them.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "mbtfm/fit/ready_cell.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tractions/fttc_mixtures.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/numerics/parallel.h"
#include "samples/plan/grid.h"
#include "samples/plan/space_grid.h"
#include "substrate/choice/factory.h"
#include "substrate/loads.h"

namespace mbtfm::plan {

using namespace tensions;
using Eigen::Vector3d;

namespace {

// draws of beads, noise and segmentation: the plan itself takes the first
constexpr std::uint64_t kDrawOfFttc = 50, kFirstDraw = 100;

/// The cell as a segmentation shows it: each adhesion and each free end of a fibre is off by chance.
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

struct Experiment {
  Cell cell;  ///< as segmented
  DisplacementField beads;
};

/// Beads at other places than the plan's, displaced on a gel of another modulus, with noise. @param draw  each has its
/// own
Experiment experiment_of(const Scene& scene, const KnownCell& cell, const Point& point, std::uint64_t draw,
                         int threads) {
  drawing::Random noise(scene.experiment.seed, drawing::Stream::noise, kFirstDraw + draw),
      segmentation(scene.experiment.seed, drawing::Stream::specimen, kFirstDraw + draw);
  const BeadsOnGel beads = beads_on_gel(scene, cell, point.density, kFirstDraw + draw, threads);
  Experiment e{as_segmented(scene.cell.cell, scene.fit.segmentation, segmentation),
               exact_beads(beads.places_um, *beads.response, cell.forces_nN, point.noise_um)};
  for (Bead& b : e.beads) {
    const double x = noise.normal(), y = noise.normal();
    b.displacement_um =
        (beads.modulus_kPa / point.youngs_modulus_kPa) * b.displacement_um + point.noise_um * Vec2{x, y};
  }
  return e;
}

/// Tractions of FTTC, summed up over each adhesion and 1.5 um around it: 2·adhesions.
Eigen::VectorXd fttc_forces_nN(const Gel& gel, const Experiment& e, int threads) {
  const tractions::TractionParameters parameters;
  const tractions::Reconstruction r = tractions::reconstruct_fttc(
      {.beads = e.beads, .gel = gel, .adhesions = {}, .outline_um = e.cell.outline_um}, parameters, threads);
  return column_of(tractions::forces_by_adhesion(r.patches, e.cell.adhesions, parameters.grow_um));
}

/// Appends the magnitudes of the errors along the true forces, one an adhesion.
void add_errors_along(std::vector<double>& errors_nN, const Eigen::VectorXd& found_nN, const Eigen::VectorXd& true_nN) {
  const Eigen::VectorXd along = directions_of(true_nN);
  for (Eigen::Index row = 0; row < true_nN.size(); row += 2)
    errors_nN.push_back(std::abs(along.segment<2>(row).dot(found_nN.segment<2>(row) - true_nN.segment<2>(row))));
}

/// One experiment on a part of the densest beads, with any noise.
tractions::FttcMixtures fttc_experiment(const Scene& scene, const Computed& c, double share_of_beads) {
  drawing::Random places(scene.experiment.seed, drawing::Stream::beads, kDrawOfFttc),
      random(scene.experiment.seed, drawing::Stream::noise, kDrawOfFttc),
      segmentation(scene.experiment.seed, drawing::Stream::specimen, kDrawOfFttc);
  const BeadsOnGel beads = some_of(c.densest, share_of_beads, places);
  const DisplacementField exact = exact_beads(beads.places_um, *beads.response, c.cell.forces_nN, 1);
  DisplacementField noise = exact;
  for (Bead& b : noise) {
    const double x = random.normal(), y = random.normal();
    b.displacement_um = {x, y};
  }
  return {exact,
          noise,
          with_modulus(scene.fit.gel, beads.modulus_kPa),
          as_segmented(scene.cell.cell, scene.fit.segmentation, segmentation).adhesions,
          {},
          1};
}

LinearData data_of(const Scene& scene, const Gel& gel, const Experiment& e, int threads) {
  const auto model = choice::make_substrate(gel, scene.fit.substrate, threads);
  auto response = model->response({substrate::ellipses_of(e.cell.adhesions)}, {points_of(e.beads)})->kept();
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

double robust_error(std::vector<double> magnitudes) {
  constexpr double kNormalOfMedian = 1.4826;  // standard deviation of a normal variable over its median magnitude
  return kNormalOfMedian * numerics::median_in(magnitudes);
}

std::vector<std::vector<double>> errors_of_fttc_nN(const Scene& scene, const Asked& asked, const Computed& c,
                                                   int threads) {
  const std::vector<Point> points = points_of(asked);
  std::vector<std::vector<double>> errors_nN(points.size());
  const auto n_densities = static_cast<int>(asked.densities.size());
  numerics::parallel_for(n_densities, threads, [&](int i) {
    // the densest, which takes longest, first
    const double density = asked.densities[n_densities - 1 - i];
    const tractions::FttcMixtures mixtures = fttc_experiment(scene, c, density / asked.densities.back());
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (points[k].density != density) continue;
      // on another gel displacements fall with its modulus, and noise counts the more
      const double factor = points[k].noise_um * points[k].youngs_modulus_kPa / c.densest.modulus_kPa;
      add_errors_along(errors_nN[k], mixtures.forces_nN(factor), c.cell.forces_nN);
    }
  });
  return errors_nN;
}

Drawn draw_experiments(const Scene& scene, const Computed& c, const Point& point, int n_experiments, const Work& work) {
  Drawn drawn{.point = point, .n_experiments = n_experiments};
  std::vector<double> with_network, alone, fttc;
  for (int k = 0; k < n_experiments; ++k) {
    work.tell(0.6 + 0.35 * k / n_experiments, "drawing experiments");
    const Experiment e = experiment_of(scene, c.cell, point, static_cast<std::uint64_t>(k), work.threads);
    const Gel gel = with_modulus(scene.fit.gel, point.youngs_modulus_kPa);
    LinearData data = data_of(scene, gel, e, work.threads);
    add_errors_along(alone, free_forces_nN(data.reduced), c.cell.forces_nN);
    const EnsembleFit fit = fit_of(scene, c.cell, e, std::move(data), work.threads);
    add_errors_along(with_network, adhesion_forces_nN(fit), c.cell.forces_nN);
    add_errors_along(fttc, fttc_forces_nN(gel, e, work.threads), c.cell.forces_nN);
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

// --- in space

namespace {

std::vector<Index> random_part(std::size_t n_all, std::size_t n, drawing::Random& random) {
  std::vector<Index> order(n_all);
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = 0; i < n; ++i)
    std::swap(order[i], order[i + static_cast<std::size_t>(random.below(static_cast<int>(n_all - i)))]);
  order.resize(n);
  std::ranges::sort(order);
  return order;
}

std::vector<PartForce> found_in(const SpaceScene& scene, const spatial::Problem& problem) {
  tractions::TractionParameters traction = scene.traction;
  traction.method = tractions::TractionMethod::tikhonov;  // the forces of adhesions of group-l1 are those of it
  return spatial::reconstruct(problem, {{}, scene.gel, adhesions_of(scene), scene.outline_um}, traction, scene.spatial,
                              1)
      .forces;
}

void add_components(std::vector<DrawnNumber>& all, int experiment, const SpacePatch& patch, const Vec3& found_nN,
                    const Eigen::Matrix3d& covariance_nN2, const Eigen::Matrix3d& directions) {
  const Vector3d along = directions.col(1), normal = directions.col(2);
  const std::pair<SpaceComponent, Vector3d> components[] = {{SpaceComponent::tangential, along},
                                                            {SpaceComponent::normal, normal},
                                                            {SpaceComponent::across, normal.cross(along)}};
  const Vector3d truth(patch.force_nN.x, patch.force_nN.y, patch.force_nN.z), found(found_nN.x, found_nN.y, found_nN.z);
  for (const auto& [component, e] : components)
    all.push_back({.experiment = experiment,
                   .id = patch.adhesion.adhesion_id,
                   .component = component,
                   .true_nN = e.dot(truth),
                   .found_nN = e.dot(found),
                   .predicted_error_nN = std::sqrt(e.dot(covariance_nN2 * e))});
}

}  // namespace

Drawn draw_experiments(const SpaceScene& scene, const SpacePool& pool, const SpaceForeseen& foreseen,
                       const Point& point, int n_experiments, const Work& work) {
  Drawn drawn{.point = point, .n_experiments = n_experiments};
  work.tell(0.8, "drawing experiments");
  std::vector<std::vector<PartForce>> found(static_cast<std::size_t>(n_experiments));
  numerics::parallel_for(n_experiments, work.threads, [&](int k) {
    constexpr std::uint64_t kFirst = 100;  // far from the stream of the pool
    drawing::Random places(scene.seed, drawing::Stream::beads, kFirst + static_cast<std::uint64_t>(k)),
        noise(scene.seed, drawing::Stream::noise, kFirst + static_cast<std::uint64_t>(k));
    const std::vector<Index> chosen = random_part(pool.beads.size(), n_beads_of(scene, point.density), places);
    // a stiffer gel is more noise
    const double over_stated = point.noise_um * point.youngs_modulus_kPa / scene.gel.youngs_modulus_kPa;
    found[k] = found_in(scene, part_of(scene, pool, chosen, over_stated, &noise));
  });
  for (std::size_t k = 0; k < found.size(); ++k) {
    for (std::size_t a = 0; a < scene.patches.size(); ++a) {
      const auto at = 3 * static_cast<Index>(a);
      add_components(drawn.numbers, static_cast<int>(k) + 1, scene.patches[a], found[k][a].force_nN,
                     foreseen.of(point).covariance_nN2.block<3, 3>(at, at), patch_directions(scene, scene.patches[a]));
    }
  }
  sum_up(drawn);
  return drawn;
}

}  // namespace mbtfm::plan
