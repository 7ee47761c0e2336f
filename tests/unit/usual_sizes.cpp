/// A wrong pixel size makes the cell, its adhesions and its fibres too large by one factor.
#include "segment/cells/usual_sizes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "segment/cells/segment_cell.h"

namespace mbtfm::cells {
namespace {

/// As cells are, times a factor.
Segmentation cell_of(double factor) {
  Segmentation s;
  s.area_um2 = 47 * 47 * factor * factor;
  s.cell.adhesions.resize(12);
  for (Adhesion& a : s.cell.adhesions) a.minor_axis_um = 0.6 * factor;
  s.cell.fibres.resize(6);
  for (Fibre& f : s.cell.fibres) f.width_um = 0.6 * factor;
  return s;
}

TEST(UsualSizes, ratio_is_the_factor_of_the_pixel_size) {
  for (const double factor : {0.5, 1.0, 1.1, 2.0}) {
    const SizeRatio size = size_ratio(cell_of(factor));
    EXPECT_NEAR(size.ratio, factor, 1e-12);
    // independent scatters of 0.4, 0.4 and 0.3 in the logarithm
    EXPECT_NEAR(size.z, std::log(factor) * std::sqrt(2 / 0.16 + 1 / 0.09), 1e-12);
  }
}

TEST(UsualSizes, what_was_assumed_or_is_cut_does_not_count) {
  Segmentation s = cell_of(2);
  s.is_cut_by_border = true;
  for (Adhesion& a : s.cell.adhesions) a.origin = AdhesionOrigin::candidate;
  s.cell.fibres.resize(4);  // fewer than five
  EXPECT_EQ(size_ratio(s).ratio, 1);
  EXPECT_EQ(size_ratio(s).z, 0);
}

}  // namespace
}  // namespace mbtfm::cells
