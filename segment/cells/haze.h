/// Where a cell ends that is out of focus. Internal to segment/ (OpenCV types).
#pragma once

#include <opencv2/core.hpp>

namespace mbtfm::cells {

/// A cell's mask, and where nothing near is a sharp edge.
struct Body {
  cv::Mat mask, soft;
};

/// The mask of a cell less the rim of light around it that the cell's blur makes.
///
/// A blur that is even in all directions, however wide, leaves half of a cell's height at its edge: the height over the
/// ground far away (I − B), against the height that the cell reaches further in (P − B). Beginning at the mask's
/// edge, points below half of it are taken off, until none is left:
///
///   I − B < (P − B) / 2
///
/// - B: the mean of the image well beyond the mask's reach, as it is near this place.
/// - I: the image opened by a disc wider than fibres and filopodia, which are neither rim nor plateau.
/// - P: the greatest I within two bands in the mask, but no more than the mask's median: the edge of a cell's thick
/// middle
///   is not the edge of the cell.
///
/// It begins only where the mask ends in haze: along three bands of its edge or more, most of it soft. Soft is an
/// edge whose height falls as behind a blur of a micrometre or more. A sharp edge stays, however dim the lamella
/// is that it ends.
/// @param values   grey values, smoothed
/// @param mask     255 in cells, 0 outside
/// @param band_um  > 0
/// @returns the mask itself, and nothing soft, where all of the image lies near a cell: there the ground is not known
Body without_haze(const cv::Mat& values, const cv::Mat& mask, double pixel_um, double band_um);

}  // namespace mbtfm::cells
