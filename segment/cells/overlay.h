/// Pictures of a segmentation on its images, to judge it by eye. Internal to segment/ (OpenCV).
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/extent.h"
#include "segment/cells/segment_cell.h"
#include "segment/images/png.h"

namespace mbtfm::cells {

struct Colour {
  std::uint8_t red, green, blue;
};

// Those of the report's plots (Okabe & Ito's palette, which colour-blind people can separate), lighter for the dark
// ground.
inline constexpr Colour kVentralColour{0, 214, 143}, kDorsalColour{86, 180, 255}, kArcColour{255, 183, 40},
    kEdgeColour{255, 122, 82}, kUnclassifiedColour{184, 184, 184}, kAdhesionColour{255, 170, 235},
    kOutlineColour{225, 225, 225}, kUnexplainedColour{90, 60, 255};

constexpr Colour colour_of(FibreType type) {
  constexpr Colour kOfType[] = {kDorsalColour, kArcColour, kVentralColour, kEdgeColour, kUnclassifiedColour};
  return kOfType[static_cast<int>(type)];
}

/// The part of the images that holds the cell: actin in grey, adhesions in purple, both stretched to their own
/// contrast; over them the outline, the adhesions' ellipses and the fibres in the colours that their types have in the
/// report (Okabe & Ito's palette, which colour-blind people can separate), fainter the less sure ones, dashed the
/// lines that may be fibres, all fibre ids, and the adhesion ids that have room, the largest adhesions' first, dots on
/// bright actin that is in no fibre; below a legend and a scale bar.
images::Picture draw_overlay(const std::optional<images::Channel>& adhesion,
                             const std::optional<images::Channel>& actin, const Segmentation& segmentation);

/// The same part of the images without any mark, and where it lies, for pages that draw the marks themselves.
struct Ground {
  images::Picture picture;
  Vec2 low_um, size_um;
};
Ground draw_ground(const std::optional<images::Channel>& adhesion, const std::optional<images::Channel>& actin,
                   const Segmentation& segmentation);

/// The part of the specimen that a picture shows: the cell and a margin around it.
Extent view_of(const Segmentation& segmentation);

/// @param rgb  8-bit red, green, blue
images::Picture picture_of(const cv::Mat& rgb);
/// The same in small, without text: outline, ellipses and fibres (8-bit red, green, blue).
cv::Mat draw_thumbnail(const std::optional<images::Channel>& adhesion, const std::optional<images::Channel>& actin,
                       const Segmentation& segmentation, const Extent& view, int long_side_px);

}  // namespace mbtfm::cells
