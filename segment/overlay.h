/// Pictures of a segmentation on its images, to judge it by eye. Internal to segment/ (OpenCV).
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "segment/png.h"
#include "segment/segment_cell.h"

namespace mbtfm::segment {

/// The part of the images that holds the cell: actin in grey, adhesions in purple, both stretched to their own
/// contrast; over them the outline, the adhesions' ellipses and the fibres in the colours that their types have in the
/// report (Okabe & Ito's palette, which colour-blind people can tell apart), all fibre ids, and the adhesion ids that
/// have room, the largest adhesions' first, dots on bright actin that is in no fibre; below a legend and a scale bar.
Picture draw_overlay(const std::optional<Channel>& adhesion, const std::optional<Channel>& actin,
                     const Segmentation& segmentation);

/// The same part of the images without any mark, and where it lies, for pages that draw the marks themselves.
struct Ground {
  Picture picture;
  Vec2 low_um, size_um;
};
Ground draw_ground(const std::optional<Channel>& adhesion, const std::optional<Channel>& actin,
                   const Segmentation& segmentation);

/// The part of the specimen that a picture shows.
struct View {
  Vec2 low_um, high_um;
};

/// The cell and a margin around it.
View view_of(const Segmentation& segmentation);

/// The same in small, without text: outline, ellipses and fibres (8-bit red, green, blue).
cv::Mat draw_thumbnail(const std::optional<Channel>& adhesion, const std::optional<Channel>& actin,
                       const Segmentation& segmentation, const View& view, int long_side_px);

}  // namespace mbtfm::segment
