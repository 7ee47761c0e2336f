/// The masks of the cells in an image: what stands out, less haze and debris, cut where cells touch; and the place of
/// an edge in profiles across it. Internal to segment/ (OpenCV types).
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::cells {

constexpr double kMaskSigma_px = 1.5;  ///< of the smoothing of masks
constexpr double kBand_um = 3;         ///< brightness inside and outside is compared within this distance

/// The image at the resolution of the masks, and how it is scaled.
struct Scene {
  cv::Mat full, smooth;
  double pixel_um, full_pixel_um, band_px, noise;
  cv::Mat recorded_px;  ///< distance from the image's padding, 0 in it; empty: it has none
  double px_of(double area_um2) const { return area_um2 / (pixel_um * pixel_um); }
  Vec2 field_um() const { return {full.cols * full_pixel_um, full.rows * full_pixel_um}; }
  /// A ring as near as this to the image's border is one that the border has made: rings go through pixels' centres.
  double border_um() const { return 1.5 * pixel_um; }
};

/// A cell's mask, and where nothing near is a sharp edge.
struct Body {
  cv::Mat mask, soft;
};

/// Parts of a mask by label, from 1, of at least `smallest` pixels each, the largest first.
struct Parts {
  struct Part {
    int label, n_pixels;
    cv::Rect box;
  };
  cv::Mat labels;
  std::vector<Part> parts;
  cv::Mat mask(const Part& part) const { return labels == part.label; }
};

Parts parts_of(const cv::Mat& mask, double smallest);

/// Otsu's threshold of log(1 + brightness): cells are bright by a factor, not by an amount.
/// @param within  a mask: the threshold of the pixels in it alone; empty: of all
cv::Mat first_mask(const cv::Mat& image, double noise, const cv::Mat& within = {});

/// All cells; holes filled. @param bright  everything that stands out
Body cells_in(const Scene& scene, const cv::Mat& bright, double smallest);

/// Gaps in the cells where it is as dark as outside: less than half of the way up to the cells' edges, and in parts
/// within a quarter.
cv::Mat holes_in(const cv::Mat& values, const cv::Mat& mask, double band_px, double noise, double smallest);

/// The narrowest place between two parts of a mask.
struct Neck {
  cv::Point at;         ///< its middle (pixel)
  double width_px = 0;  ///< of the largest disc that passes through
};

/// A mask cut at its necks.
struct CutMask {
  cv::Mat mask;
  cv::Mat cuts;             ///< the pixels that were taken out
  std::vector<Neck> necks;  ///< one for each cut
};

/// Use it for a mask without holes, where parts may be several cells. Of all ways between two parts the widest counts:
/// the disc that passes along it against the largest disc that fits into the narrower part. A cut is made where
///
///   width of the way < `narrow` · diameter of the narrower part's disc,
///
/// and each side is at least `smallest` pixels and, unless the image's border cuts it, `kLeastShare` of the whole: less
/// is a protrusion. An elongated cell is as wide in its middle as in both halves, and is left whole.
///
/// The image's border is no edge: a cell that it cuts is as wide there as it looks. Time and memory grow with the
/// pixels (a union of the distance map's basins from its peaks down: Vincent & Soille, IEEE PAMI 13:583, 1991).
CutMask cut_at_necks(const cv::Mat& mask, double narrow, double smallest);

/// Move a closed ring onto the edge of the cell in the image, to a tenth of a pixel's order.
///
/// Across the edge the brightness is modelled as ground + step + slope inside + a line, all at one place d: the cell is
/// brighter than its surroundings, and the actin cortex, thinner than the microscope resolves, lies along its membrane,
/// so that its image is a line centred on the edge. (The half-height of that line lies 1.2 of its standard deviations
/// outside.) The squared residuals of all places are the cost, and the ring takes the places of least total cost plus
/// (d − d')² of neighbours over (0.1 um)², by dynamic programming (Amini, Weymouth & Jain 1990).
/// @param ring      px, at equal distances
/// @param may_move  by point
std::vector<cv::Point2d> on_edge(const cv::Mat& image, const std::vector<cv::Point2d>& ring,
                                 const std::vector<bool>& may_move, double pixel_um);

}  // namespace mbtfm::cells
