#include "segment/rois/roi.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::rois {
namespace {

// Places in the header (bytes), values of its fields
constexpr std::size_t kVersion = 4, kType = 6, kTop = 8, kLeft = 10, kBottom = 12, kRight = 14, kPoints = 16,
                      kFloats = 18, kStrokeWidth = 34, kCompositeSize = 36, kStrokeColour = 40, kSubtype = 48,
                      kOptions = 50, kAspectRatio = 52, kCornerDiameter = 54, kHeader2 = 60, kCoordinates = 64;
constexpr std::size_t kNameOffset = 16, kNameLength = 20, kGroup = 30, kFloatStrokeWidth = 36, kHeader2Size = 64;
constexpr int kSpline = 1, kSubPixel = 128;
constexpr int kTextSubtype = 1, kEllipseSubtype = 3, kImageSubtype = 4;
constexpr int kFreehandType = 7;
constexpr RoiShape kShapes[] = {
    RoiShape::polygon,  RoiShape::rectangle,          RoiShape::oval,     RoiShape::line,   RoiShape::freehand_line,
    RoiShape::polyline, RoiShape::point /* "none" */, RoiShape::freehand, RoiShape::traced, RoiShape::angle,
    RoiShape::point};

// Beyond it a float has lost the fractions of pixels, and no image goes there.
constexpr double kFarthest_px = 1 << 21;
// Of the line through a spline's nodes, drawn by hand: twice around an image of 2^14 pixels a side. The curve gets a
// point every two pixels.
constexpr double kLongestSpline_px = 1 << 17;

/// Big-endian numbers at places of a string; a place beyond its end is an InputError.
class Bytes {
 public:
  Bytes(std::string_view bytes, const std::string& where) : bytes_(bytes), where_(where) {}
  std::uint32_t number(std::size_t at, int n_bytes) const {
    require(at, static_cast<std::size_t>(n_bytes));
    std::uint32_t value = 0;
    for (int i = 0; i < n_bytes; ++i) value = value << 8 | static_cast<unsigned char>(bytes_[at + i]);
    return value;
  }
  int whole(std::size_t at) const { return static_cast<std::int16_t>(number(at, 2)); }
  double real(std::size_t at) const {
    const float value = std::bit_cast<float>(number(at, 4));
    if (!std::isfinite(value)) throw InputError(where_, "finite coordinates", "NaN or infinity");
    return value;
  }
  double coordinate(std::size_t at) const {
    const double value = real(at);
    if (std::abs(value) > kFarthest_px)
      refuse("coordinates up to " + std::to_string(std::lround(kFarthest_px)) + " pixels", brief(value));
    return value;
  }
  [[noreturn]] void refuse(const std::string& expected, const std::string& found) const {
    throw InputError(where_, expected, found, "the file may be damaged: save the selection again");
  }
  void require(std::size_t at, std::size_t n_bytes) const {
    if (at <= bytes_.size() && n_bytes <= bytes_.size() - at) return;
    throw InputError(where_, "a whole ImageJ ROI", "only " + std::to_string(bytes_.size()) + " bytes",
                     "the file may be truncated or damaged: save the selection again");
  }

 private:
  std::string_view bytes_;
  const std::string& where_;
};

void append_utf8(std::string& text, std::uint32_t c) {
  const auto put = [&](std::uint32_t byte) { text += static_cast<char>(byte); };
  if (c < 0x80) return put(c);
  if (c < 0x800) {
    put(0xC0 | c >> 6);
  } else if (c < 0x10000) {
    put(0xE0 | c >> 12);
    put(0x80 | (c >> 6 & 0x3F));
  } else {
    put(0xF0 | c >> 18);
    put(0x80 | (c >> 12 & 0x3F));
    put(0x80 | (c >> 6 & 0x3F));
  }
  put(0x80 | (c & 0x3F));
}

/// Add the points of a Bézier curve of these control points, the first of which is there already; one point: itself.
void append_curve(Polygon& path, std::vector<Vec2> nodes) {
  if (nodes.size() == 1) path.push_back(nodes.front());
  constexpr int kSteps = 16;  // a quarter of a circle to 2e-4 of its radius
  for (int step = 1; step <= kSteps && nodes.size() > 1; ++step) {
    const double t = static_cast<double>(step) / kSteps;
    std::vector<Vec2> p = nodes;  // de Casteljau
    for (std::size_t n = p.size() - 1; n > 0; --n)
      for (std::size_t i = 0; i < n; ++i) p[i] = (1 - t) * p[i] + t * p[i + 1];
    path.push_back(p.front());
  }
}

/// The name in UTF-16 as UTF-8; half of a surrogate pair becomes U+FFFD.
std::string name_in(const Bytes& bytes, std::size_t header2) {
  const std::size_t at = bytes.number(header2 + kNameOffset, 4), length = bytes.number(header2 + kNameLength, 4);
  if (at == 0 || length == 0) return {};
  bytes.require(at, 2 * length);
  std::string name;
  for (std::size_t i = 0; i < length; ++i) {
    std::uint32_t c = bytes.number(at + 2 * i, 2);
    if (c >= 0xD800 && c < 0xE000) {
      const std::uint32_t low = c < 0xDC00 && i + 1 < length ? bytes.number(at + 2 * (i + 1), 2) : 0;
      const bool is_pair = low >= 0xDC00 && low < 0xE000;
      c = is_pair ? 0x10000 + ((c - 0xD800) << 10) + (low - 0xDC00) : 0xFFFD;
      i += is_pair;
    }
    append_utf8(name, c);
  }
  return name;
}

std::vector<Vec2> points_in(const Bytes& bytes, bool is_sub_pixel, Vec2 corner) {
  std::size_t n = bytes.number(kPoints, 2);
  if (n == 0) n = bytes.number(kFloats, 4);  // more than 65535 points
  const std::size_t n_shorts = kCoordinates + 4 * n;
  bytes.require(kCoordinates, is_sub_pixel ? 12 * n : 4 * n);
  std::vector<Vec2> points;
  points.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    if (is_sub_pixel) {
      points.push_back({bytes.coordinate(n_shorts + 4 * i), bytes.coordinate(n_shorts + 4 * (n + i))});
    } else {
      const std::size_t at = kCoordinates + 2 * i;
      points.push_back(corner +
                       Vec2{static_cast<double>(bytes.whole(at)), static_cast<double>(bytes.whole(at + 2 * n))});
    }
  }
  return points;
}

/// The paths of a composite selection: moves, lines, parabolas, cubics and ends of java.awt.geom.PathIterator.
std::vector<Polygon> paths_in(const Bytes& bytes) {
  const std::size_t n = bytes.number(kCompositeSize, 4);
  bytes.require(kCoordinates, 4 * n);
  constexpr std::size_t kPointsOf[] = {1, 1, 2, 3, 0};  // by kind of segment
  std::vector<Polygon> paths;
  for (std::size_t i = 0; i < n;) {
    const double kind = bytes.real(kCoordinates + 4 * i++);
    const bool is_known = kind >= 0 && kind <= 4 && kind == std::floor(kind) && (kind == 0 || !paths.empty());
    const std::size_t n_points = is_known ? kPointsOf[static_cast<int>(kind)] : 0;
    if (!is_known || i + 2 * n_points > n) bytes.refuse("a path that ImageJ knows", "a damaged one");
    if (kind == 0) paths.emplace_back();
    Polygon nodes;
    if (n_points > 1) nodes.push_back(paths.back().back());
    for (std::size_t k = 0; k < n_points; ++k, i += 2)
      nodes.push_back({bytes.coordinate(kCoordinates + 4 * i), bytes.coordinate(kCoordinates + 4 * i + 4)});
    append_curve(paths.back(), nodes);
  }
  return paths;
}

RoiShape shape_in(const Bytes& bytes, const std::string& where) {
  const std::uint32_t type = bytes.number(kType, 1), subtype = bytes.number(kSubtype, 2);
  if (type >= std::size(kShapes))
    throw InputError(where, "a selection that ImageJ knows", "type " + std::to_string(type));
  if (bytes.number(kCompositeSize, 4) > 0) return RoiShape::composite;
  if (type == 1 && subtype == kTextSubtype) return RoiShape::text;
  if (type == 1 && subtype == kImageSubtype) return RoiShape::image;
  return type == kFreehandType && subtype == kEllipseSubtype ? RoiShape::ellipse : kShapes[type];
}

void read_geometry(Roi& roi, const Bytes& bytes) {
  // fractions came with version 222, for rectangles and ovals with 223
  const bool is_box = roi.shape == RoiShape::rectangle || roi.shape == RoiShape::oval;
  const bool is_sub_pixel =
      (bytes.number(kOptions, 2) & kSubPixel) != 0 && bytes.whole(kVersion) >= (is_box ? 223 : 222);
  const auto reals = [&](int i) {
    return Vec2{bytes.coordinate(kFloats + 8 * i), bytes.coordinate(kFloats + 8 * i + 4)};
  };
  const Vec2 corner{static_cast<double>(bytes.whole(kLeft)), static_cast<double>(bytes.whole(kTop))};
  const Vec2 far_corner{static_cast<double>(bytes.whole(kRight)), static_cast<double>(bytes.whole(kBottom))};
  switch (roi.shape) {
    case RoiShape::rectangle:
      roi.corner_diameter_px = bytes.whole(kCornerDiameter);
      [[fallthrough]];
    case RoiShape::oval:
      roi.corner_px = is_sub_pixel ? reals(0) : corner;
      roi.size_px = is_sub_pixel ? reals(1) : far_corner - corner;
      break;
    case RoiShape::ellipse:
      roi.aspect_ratio = bytes.real(kAspectRatio);
      [[fallthrough]];
    case RoiShape::line:
      roi.points_px = {reals(0), reals(1)};
      break;
    case RoiShape::composite:
      roi.paths_px = paths_in(bytes);
      break;
    case RoiShape::text:
    case RoiShape::image:
      break;
    default:
      roi.points_px = points_in(bytes, is_sub_pixel, corner);
      roi.is_spline = (bytes.number(kOptions, 2) & kSpline) != 0;
      if (roi.is_spline && length_um(roi.points_px) > kLongestSpline_px) {
        bytes.refuse("a spline of at most " + std::to_string(std::lround(kLongestSpline_px)) + " pixels",
                     "one of " + brief(length_um(roi.points_px)));
      }
  }
}

// ---- writing

struct Writer {
  std::string bytes;
  void number(std::size_t at, std::uint32_t value, int n_bytes) {
    if (bytes.size() < at + n_bytes) bytes.resize(at + n_bytes);
    for (int i = 0; i < n_bytes; ++i) bytes[at + i] = static_cast<char>(value >> 8 * (n_bytes - 1 - i));
  }
  void real(std::size_t at, double value) { number(at, std::bit_cast<std::uint32_t>(static_cast<float>(value)), 4); }
};

int type_of(RoiShape shape) {
  if (shape == RoiShape::ellipse) return kFreehandType;
  return static_cast<int>(std::find(std::begin(kShapes), std::end(kShapes), shape) - std::begin(kShapes));
}

void write_points(Writer& out, const std::vector<Vec2>& points) {
  const auto [low, high] = extent_of(points);
  const auto whole = [](double value) { return static_cast<std::uint32_t>(static_cast<int>(std::floor(value))); };
  out.number(kTop, whole(low.y), 2);
  out.number(kLeft, whole(low.x), 2);
  out.number(kBottom, whole(high.y) + 1, 2);
  out.number(kRight, whole(high.x) + 1, 2);
  const std::size_t n = points.size(), n_shorts = kCoordinates + 4 * n;
  out.number(kPoints, static_cast<std::uint32_t>(n), 2);
  for (std::size_t i = 0; i < n; ++i) {
    out.number(kCoordinates + 2 * i, whole(points[i].x) - whole(low.x), 2);
    out.number(kCoordinates + 2 * (n + i), whole(points[i].y) - whole(low.y), 2);
    out.real(n_shorts + 4 * i, points[i].x);
    out.real(n_shorts + 4 * (n + i), points[i].y);
  }
}

/// UTF-8 to UTF-16; mbtfm's own names are ASCII.
void write_name(Writer& out, std::size_t header2, const std::string& name) {
  out.number(header2 + kNameOffset, static_cast<std::uint32_t>(header2 + kHeader2Size), 4);
  out.number(header2 + kNameLength, static_cast<std::uint32_t>(name.size()), 4);
  for (std::size_t i = 0; i < name.size(); ++i) {
    MBTFM_ASSERT(static_cast<unsigned char>(name[i]) < 0x80);
    out.number(header2 + kHeader2Size + 2 * i, static_cast<unsigned char>(name[i]), 2);
  }
}

}  // namespace

bool is_area(RoiShape shape) { return shape <= RoiShape::composite; }
bool is_line(RoiShape shape) { return shape >= RoiShape::line && shape <= RoiShape::freehand_line; }

Roi decode_roi(std::string_view data, const std::string& where) {
  if (!data.starts_with("Iout")) throw InputError(where, "an ImageJ ROI", "bytes of another kind");
  const Bytes bytes(data, where);
  bytes.require(0, kCoordinates);
  Roi roi;
  roi.shape = shape_in(bytes, where);
  read_geometry(roi, bytes);
  roi.stroke_argb = bytes.number(kStrokeColour, 4);
  roi.stroke_width_px = bytes.whole(kStrokeWidth);
  const std::size_t header2 = bytes.number(kHeader2, 4);
  if (header2 == 0) return roi;  // before ImageJ 1.43
  bytes.require(header2, kHeader2Size);
  roi.name = name_in(bytes, header2);
  roi.group = static_cast<int>(bytes.number(header2 + kGroup, 1));
  const double width_px = bytes.real(header2 + kFloatStrokeWidth);
  if (width_px > 0) roi.stroke_width_px = width_px;
  return roi;
}

std::string encode_roi(const Roi& roi) {
  MBTFM_ASSERT(roi.shape == RoiShape::polygon || roi.shape == RoiShape::polyline || roi.shape == RoiShape::ellipse);
  MBTFM_ASSERT(!roi.points_px.empty() && roi.points_px.size() < 65536);
  constexpr std::uint32_t kWritten = 228;  // the format of ImageJ 1.53
  Writer out;
  out.bytes = "Iout";
  out.number(kVersion, kWritten, 2);
  out.number(kType, static_cast<std::uint32_t>(type_of(roi.shape)), 1);
  out.number(kCoordinates - 1, 0, 1);
  write_points(out, roi.shape == RoiShape::ellipse ? area_px(roi) : roi.points_px);
  if (roi.shape == RoiShape::ellipse) {
    out.number(kSubtype, kEllipseSubtype, 2);
    out.real(kAspectRatio, roi.aspect_ratio);
    for (int i = 0; i < 2; ++i) {
      out.real(kFloats + 8 * i, roi.points_px[i].x);
      out.real(kFloats + 8 * i + 4, roi.points_px[i].y);
    }
  }
  out.number(kStrokeWidth, static_cast<std::uint32_t>(std::lround(roi.stroke_width_px)), 2);
  out.number(kStrokeColour, roi.stroke_argb, 4);
  out.number(kOptions, kSubPixel, 2);
  const std::size_t header2 = out.bytes.size();
  out.number(kHeader2, static_cast<std::uint32_t>(header2), 4);
  out.number(header2 + kHeader2Size - 1, 0, 1);
  out.number(header2 + kGroup, static_cast<std::uint32_t>(roi.group), 1);
  out.real(header2 + kFloatStrokeWidth, roi.stroke_width_px);
  write_name(out, header2, roi.name);
  return out.bytes;
}

}  // namespace mbtfm::rois
