/// Selections (ROIs) of ImageJ: the bytes of a .roi file, and sets of them in a zip.
///
/// Coordinates here are pixels as ImageJ stores them. Area selections count from the outer corner of the top-left
/// pixel, as mbtfm does; line selections count from its centre: ImageJ 1.53t's profile along a line at x = 10 begins
/// with the value of column 10, while a rectangle from x = 10 begins with column 10's left side. `line_px` and
/// `area_px` give both from the outer corner. Source: ij.io.RoiDecoder and RoiEncoder of ImageJ 1.53t (public domain),
/// checked against that program's own files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"

namespace mbtfm::rois {

enum class RoiShape {
  polygon,
  freehand,
  traced,
  rectangle,
  oval,
  ellipse,
  composite,
  line,
  polyline,
  freehand_line,
  angle,
  point,
  text,
  image
};
/// As ImageJ's tool bar calls it, for messages: "a polygon".
constexpr auto words(RoiShape) {
  return std::array{"a polygon",  "a freehand area",       "a traced area",   "a rectangle",      "an oval",
                    "an ellipse", "a composite selection", "a straight line", "a segmented line", "a freehand line",
                    "an angle",   "a point selection",     "a text",          "an image"};
}
bool is_area(RoiShape shape);
bool is_line(RoiShape shape);

struct Roi {
  RoiShape shape = RoiShape::polygon;
  std::string name;               ///< UTF-8; without one of its own, that of the file
  std::vector<Vec2> points_px;    ///< corners, line points, or an ellipse's two ends of its major axis
  Vec2 corner_px, size_px;        ///< of a rectangle or an oval: top left, width and height
  double corner_diameter_px = 0;  ///< of a rounded rectangle's corners
  double aspect_ratio = 1;        ///< of an ellipse: minor over major axis
  std::vector<Polygon> paths_px;  ///< of a composite: several areas, or holes, which turn the other way
  bool is_spline = false;         ///< the points are the nodes of a cubic spline
  int group = 0;                  ///< ImageJ's group, 1 to 255; 0: none
  std::uint32_t stroke_argb = 0;  ///< 0: ImageJ's own colour
  double stroke_width_px = 0;     ///< 0: a hairline
};

/// @param where  names the bytes in errors
/// @throws InputError where the bytes are no ROI, end early or hold numbers that are not finite
Roi decode_roi(std::string_view bytes, const std::string& where);
/// Polygons, polylines and ellipses, with fractions of pixels, as ImageJ 1.53 writes them.
std::string encode_roi(const Roi& roi);

/// The ROIs of a .roi file or of a zip of such files, in the order of the zip; what the zip else contains is ignored.
/// @throws InputError naming the file and the entry; takes no more memory than a set of ROIs needs
std::vector<Roi> read_rois(const std::filesystem::path& file);
/// A zip that ImageJ's ROI manager opens; entries are called as the ROIs (one at least), whose names must differ. The
/// bytes depend on the ROIs alone. @throws OutputError
void write_roi_set(const std::filesystem::path& file, const std::vector<Roi>& rois);

/// The same selection in the pixels of an image that was reduced by this factor.
Roi binned(Roi roi, int binning);

/// The line of a line selection, origin at the outer corner of the top-left pixel; a spline as ImageJ draws it.
/// @throws InternalError for another selection
Polyline line_px(const Roi& roi);

/// The boundary of an area selection, origin likewise; of a composite one closed line through all its paths, by which
/// areas and moments are right and a point's crossings even or odd: the ways from path to path and back cancel; ovals
/// and ellipses with 360 corners, rounded corners with 32.
/// @throws InternalError for another selection
Polygon area_px(const Roi& roi);

}  // namespace mbtfm::rois
