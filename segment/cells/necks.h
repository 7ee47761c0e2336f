/// Cells that touch, separated at the neck between them. Internal to segment/ (OpenCV types).
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace mbtfm::cells {

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

}  // namespace mbtfm::cells
