#include "mbtfm/tensions/edge_forces.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/missing_adhesions.h"
#include "mbtfm/tensions/search.h"
#include "pipeline/contract/extent.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/distributions.h"
#include "pipeline/numerics/order_statistics.h"
#include "substrate/greens/models.h"
#include "substrate/models.h"

namespace mbtfm::tensions {

namespace {

constexpr double kApartOnEdge_um = 2;  // of the places: beads are as far apart

/// None on the edge itself.
Vec2 inward_normal(const Cell& cell, Vec2 place_um) {
  const Vec2 inward = place_um - nearest_on_boundary_um(cell.outline_um, place_um);
  return 1 / std::max(norm(inward), 1e-300) * inward;
}

/// Forces of 1 nN in all, which balance.
struct Ring {
  std::vector<substrate::Ellipse> discs;
  std::vector<Vec2> forces_nN;
};

Ring ring_along_edge(const Cell& cell) {
  std::vector<double> depths_um;
  for (const Adhesion& a : cell.adhesions) depths_um.push_back(distance_to_boundary_um(cell.outline_um, a.position_um));
  const double depth_um = std::max(kApartOnEdge_um, numerics::quantile(std::move(depths_um), 0.75)),
               radius_um = kApartOnEdge_um / std::sqrt(std::numbers::pi);
  const auto [low, high] = extent_of(cell.outline_um);
  Ring ring;
  for (double y = low.y + kApartOnEdge_um / 2; y < high.y; y += kApartOnEdge_um) {
    for (double x = low.x + kApartOnEdge_um / 2; x < high.x; x += kApartOnEdge_um) {
      const Vec2 place{x, y};
      const double edge_um = distance_to_boundary_um(cell.outline_um, place);
      if (edge_um <= 0 || edge_um > depth_um || !is_free(cell, place)) continue;
      if (distance_to_cut_um(cell, place) <= edge_um) continue;  // the cell goes on there
      ring.discs.push_back(
          {.centre_um = place, .semi_major_um = radius_um, .semi_minor_um = radius_um, .angle_rad = 0});
      ring.forces_nN.push_back(inward_normal(cell, place));
    }
  }
  const Vec2 mean = centre_of(ring.forces_nN);
  double sum = 0;
  for (Vec2& force : ring.forces_nN) sum += norm(force = force - mean);
  for (Vec2& force : ring.forces_nN) force = 1 / std::max(sum, 1e-300) * force;
  return ring;
}

/// Of the adhesions that are too small to be found: those below the smallest one, where the logarithms of areas are
/// normal (Cohen, Technometrics 1 (1959) 217), but no more than were found; the smaller half's mean force each.
double unseen_nN(const std::vector<Adhesion>& adhesions, const VectorXd& forces_nN) {
  std::vector<double> areas_um2;
  for (const Adhesion& a : adhesions) areas_um2.push_back(a.area_um2);
  const double smallest_um2 = std::ranges::min(areas_um2), middle_um2 = numerics::median(areas_um2);
  double mean = 0, square = 0, n_small = 0, small_nN = 0;  // of ln(area / smallest)
  for (std::size_t a = 0; a < areas_um2.size(); ++a) {
    const double x = std::log(areas_um2[a] / smallest_um2);
    mean += x / static_cast<double>(areas_um2.size());
    square += x * x / static_cast<double>(areas_um2.size());
    if (areas_um2[a] > middle_um2) continue;
    n_small += 1;
    small_nN += forces_nN.segment<2>(2 * static_cast<Index>(a)).norm();
  }
  double low = -8, high = 0;  // of the smallest one, in standard deviations from the law's mean
  while (high - low > 1e-3) {
    const double h = 0.5 * (low + high), above = numerics::normal_above(h),
                 Z = std::exp(-0.5 * h * h) / std::sqrt(2 * std::numbers::pi) / above;
    const bool is_below = (square - mean * mean) * (Z - h) * (Z - h) < (1 - Z * (Z - h)) * mean * mean;
    (is_below ? high : low) = h;
  }
  const double share = numerics::normal_below(high);
  return share / (1 - share) * static_cast<double>(areas_um2.size()) * small_nN / n_small;
}

/// Of the beads, 2·beads × 1; no rows where no place is free.
MatrixXd displacement_by_ring(const LinearData& data, const Cell& cell, const Gel& gel) {
  const Ring ring = ring_along_edge(cell);
  if (ring.discs.empty()) return {};
  return numerics::matvec(greens::make_greens(gel, {.model = substrate::ModelKind::layer}, data.threads)
                              ->compliance_um_per_nN(data.position_um, ring.discs),
                          substrate::column_of(ring.forces_nN));
}

}  // namespace

EdgeForces edge_forces(const EnsembleFit& fit, const Cell& cell, const Gel& gel) {
  if (are_assumed(cell.adhesions)) return {};
  const VectorXd forces_nN = adhesion_forces_nN(fit);
  double inward_nN = 0;
  for (std::size_t a = 0; a < cell.adhesions.size(); ++a) {
    const Vec2 place = cell.adhesions[a].position_um;
    const auto at = 2 * static_cast<Index>(a);
    inward_nN += dot(inward_normal(cell, place), {forces_nN[at], forces_nN[at + 1]});
  }
  const MatrixXd shape = displacement_by_ring(fit.data, cell, gel);
  if (shape.size() == 0 || inward_nN <= 0) return {};
  const Left left(fit);
  const Scores scores = left.scores_of(pattern_of(fit.data, shape));
  const double information = scores.information(0, 0);
  if (!(information > 0)) return {};
  // 1.4 to 1.8 in simulated cells; of few adhesions it may be any number
  const double per_inward = std::min(3.0, total_nN(forces_nN) / inward_nN),
               z = scores.scores[0] / std::sqrt(information),
               sigma_nN = per_inward * std::sqrt(left.variance() / information),
               r = 1 / (1 + std::pow(sigma_nN / (0.5 * unseen_nN(cell.adhesions, forces_nN)), 2)),
               log_factor = std::log(2 * std::sqrt(1 - r)) + 0.5 * r * z * z +
                            std::log(std::max(numerics::normal_below(std::sqrt(r) * z), 1e-300));
  return {.probability = 1 / (1 + 2 * std::exp(-log_factor)),
          .sum_nN = std::max(0.0, r * z * sigma_nN),
          .sigma_nN = std::sqrt(r) * sigma_nN,
          .per_inward = per_inward};
}

EnsembleFit with_edge_forces(EnsembleFit fit, EdgeForces found, const Cell& cell, const Gel& gel, Index n_last) {
  if (found.are_there()) {
    const MotionsBeside beside = find_forces_beside(fit, displacement_by_ring(fit.data, cell, gel), n_last);
    found.sum_nN = found.per_inward * std::max(0.0, beside.values[0]);
    found.sigma_nN = found.per_inward * beside.sigma[0];
  }
  fit.forces.edge = found;
  const double sum_nN = found.sum_nN, p = found.probability,
               squares = found.sigma_nN * found.sigma_nN + 0.25 * sum_nN * sum_nN,
               variance = found.are_there() ? squares + (1 - p) * sum_nN * sum_nN : p * (squares + sum_nN * sum_nN);
  fit.forces.away_nN2 += variance;
  for (Estimate* sum : {&fit.total_force_nN, &fit.network_force_nN}) {
    if (found.are_there()) sum->value += sum_nN;
    sum->standard_error = std::hypot(sum->standard_error, std::sqrt(variance));
  }
  return fit;
}

}  // namespace mbtfm::tensions
