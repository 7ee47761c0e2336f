#include "segment/cells/usual_sizes.h"

#include <cmath>
#include <vector>

#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/segment_cell.h"

namespace mbtfm::cells {
namespace {

struct UsualLength {
  double median_um;
  double log_sd;  ///< among cells, lenses and ways to segment
};
// Adherent cells spread over 500 to 10 000 um² (docs/plausible.md): the square root is a factor of 2.1 about 47 um in
// 95 of 100. Adhesions and fibres: medians of a cell in seven kinds of cell and microscope, .4 to .9 um and .4 to .95
// um.
constexpr UsualLength kCell{47, 0.4}, kAdhesion{0.6, 0.4}, kFibre{0.6, 0.3};

}  // namespace

SizeRatio size_ratio(const Segmentation& s) {
  double weights = 0, sum = 0;
  const auto add = [&](double length_um, const UsualLength& usual) {
    const double weight = 1 / (usual.log_sd * usual.log_sd);
    weights += weight;
    sum += weight * std::log(length_um / usual.median_um);
  };
  constexpr std::size_t kFew = 5;  // of fewer the median is one adhesion's or fibre's own
  std::vector<double> widths_um;
  for (const Adhesion& a : s.cell.adhesions)
    if (!is_assumed(a.origin)) widths_um.push_back(a.minor_axis_um);
  if (widths_um.size() >= kFew) add(numerics::median_in(widths_um), kAdhesion);
  widths_um.clear();
  for (const Fibre& f : s.cell.fibres) widths_um.push_back(f.width_um);
  if (widths_um.size() >= kFew) add(numerics::median_in(widths_um), kFibre);
  if (s.area_um2 > 0 && !s.is_cut_by_border) add(std::sqrt(s.area_um2), kCell);
  if (weights == 0) return {};
  return {.ratio = std::exp(sum / weights), .z = sum / std::sqrt(weights)};
}

}  // namespace mbtfm::cells
