#include "continuum/sheet/mesh_size.h"

#include <algorithm>
#include <cmath>

#include "pipeline/numerics/order_statistics.h"
#include "substrate/material.h"

namespace mbtfm::sheet {

double narrow_um(const Region& region) {
  double area = 0, along = 0;
  for (std::size_t r = 0; r < region.rims.size(); ++r) {
    area += (r == 0 ? 1 : -1) * std::abs(signed_area_um2(region.rims[r].points_um()));
    along += region.rims[r].length_um();
  }
  return 2 * area / along;
}

TriangleSize size_on_springs(const Region& region, double penetration_um) {
  const double narrow = narrow_um(region);
  constexpr double kPerPenetration = 8, kPerWidth = 15;  // measured: 1e-4 of the largest displacement and tension
  constexpr double kMostTriangles = 1e5;                 // some seconds; a penetration length far below the width
  TriangleSize size{.at_curves_um = std::min(penetration_um / kPerPenetration, narrow / kPerWidth),
                    .largest_um = narrow / 10,
                    .growth = 0.13,
                    .most_turn_rad = 0.2,
                    .most_notch_rad = 0.05};
  while (expected_triangles(region, size) > kMostTriangles) size = with_edge(size, 1.2 * size.at_curves_um);
  return size;
}

TriangleSize size_on_gel(const Region& region, const Material& material, const Gel& gel,
                         std::optional<double> adhesion_nN_per_um3, const substrate::Capabilities& can, Strain strain) {
  const double narrow = narrow_um(region);
  const double mu = substrate::shear_modulus_kPa(gel);
  // how far into the sheet its edge is felt: the gel's counterpart of a penetration length
  double reach = material.stiffness_nN_per_um() * (1 - gel.poisson_ratio) / mu;
  if (adhesion_nN_per_um3) reach = std::max(reach, std::sqrt(material.stiffness_nN_per_um() / *adhesion_nN_per_um3));
  // measured: 1 % of the largest displacement, which lies at the edge; finer where a soft sheet gives way near it alone
  const double per_width = std::clamp(1.6 * narrow / reach, 60.0, 90.0);
  // as expected_triangles() counts: half a GB of compliances at the most, or some seconds where a lattice has them
  const double most = substrate::is_alike_everywhere(can) && strain == Strain::small ? 4000 : 1500;
  TriangleSize size{.at_curves_um = narrow / per_width, .largest_um = narrow / 4, .growth = 0.9, .most_turn_rad = 0.35};
  while (expected_triangles(region, size) > most) size = with_edge(size, 1.1 * size.at_curves_um);
  return size;
}

TriangleSize size_for_fit(const Region& region) {
  const double narrow = narrow_um(region);
  return {.at_curves_um = narrow / 40, .largest_um = narrow / 4, .growth = 0.9, .most_turn_rad = 0.35};
}

TriangleSize size_for_tractions(const Region& region, const std::vector<GroundPatch>& tractions) {
  const double narrow = narrow_um(region);
  std::vector<double> areas;
  for (const GroundPatch& patch : tractions) areas.push_back(patch.area_um2);
  const double side = areas.empty() ? narrow / 20 : std::sqrt(numerics::median(areas));
  const double size = std::clamp(1.5 * side, narrow / 100, narrow / 8);
  return {.at_curves_um = size, .largest_um = size, .growth = 0.5, .most_turn_rad = 0.6, .most_notch_rad = 0.6};
}

TriangleSize with_edge(TriangleSize size, double at_curves_um) {
  const double ratio = at_curves_um / size.at_curves_um;
  return {.at_curves_um = at_curves_um,
          .largest_um = ratio * size.largest_um,
          .growth = size.growth,
          .most_turn_rad = std::min(0.5, ratio * size.most_turn_rad),
          .most_notch_rad = std::min(0.5, ratio * size.most_notch_rad)};
}

}  // namespace mbtfm::sheet
