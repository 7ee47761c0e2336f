#include "mbtfm/plan/experiment.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mbtfm/plan/precision.h"
#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::plan {

using namespace tensions;

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
  const BeadsOnGel beads = beads_on_gel(scene, cell, point.density, kFirst + draw, threads);
  return {as_segmented(scene.cell.cell, scene.fit.segmentation, segmentation),
          measured(beads, cell.forces_nN, point, noise)};
}

Gel gel_of(const Scene& scene, const Point& point) {
  Gel gel = scene.fit.gel;
  gel.youngs_modulus_kPa = point.youngs_modulus_kPa;
  return gel;
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

void add_errors_along(std::vector<double>& errors_nN, const Eigen::VectorXd& found_nN, const Eigen::VectorXd& true_nN) {
  const Eigen::VectorXd along = directions_of(true_nN);
  for (Eigen::Index row = 0; row < true_nN.size(); row += 2)
    errors_nN.push_back(std::abs(along.segment<2>(row).dot(found_nN.segment<2>(row) - true_nN.segment<2>(row))));
}

double robust_error(std::vector<double> magnitudes) {
  constexpr double kNormalOfMedian = 1.4826;  // standard deviation of a normal variable over its median magnitude
  return kNormalOfMedian * numerics::median_in(magnitudes);
}

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

}  // namespace mbtfm::plan
