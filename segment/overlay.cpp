#include "segment/overlay.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "segment/ellipse.h"
#include "segment/grid.h"

namespace mbtfm::segment {

namespace {

/// Colours are red, green, blue.
const cv::Scalar kVentral(240, 110, 10), kDorsal(86, 180, 233), kArc(240, 228, 66), kAdhesion(0, 220, 160),
    kOutline(255, 255, 255), kInk(20, 20, 20), kPaper(255, 255, 255);
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr int kShift = 4;  // OpenCV's drawing takes fixed-point coordinates: sixteenths of a pixel
constexpr int kFooter = 64;

cv::Scalar colour_of(FibreType type) {
  return type == FibreType::ventral ? kVentral : type == FibreType::dorsal ? kDorsal : kArc;
}

/// 0 to 1 between the 1 % and the 99.8 % quantile, brightened by a root so that faint structure shows.
cv::Mat stretched(const Image& image) {
  const cv::Mat values = matrix_of(image);
  const double low = quantile(values, 0.01), high = quantile(values, 0.998);
  cv::Mat result = (values - low) / std::max(high - low, 1e-12);
  result = cv::min(cv::max(result, 0.0), 1.0);
  cv::pow(result, 0.7, result);
  return result;
}

cv::Mat background(const std::optional<Channel>& adhesion, const std::optional<Channel>& actin) {
  const Image& any = actin ? actin->image : adhesion->image;
  cv::Mat planes[3];
  const cv::Mat grey = actin ? stretched(actin->image) : cv::Mat::zeros(any.height, any.width, CV_32F);
  const cv::Mat purple = adhesion ? stretched(adhesion->image) : cv::Mat::zeros(any.height, any.width, CV_32F);
  // alone, a channel may use the whole range; together they share it
  const double share_grey = adhesion ? 150 : 210, share_purple = actin ? 150 : 210;
  const double tint[3] = {1.0, actin ? 0.1 : 0.7, 0.95};
  cv::Mat rgb;
  for (int i = 0; i < 3; ++i) {
    const cv::Mat sum = share_grey * grey + share_purple * tint[i] * purple;
    sum.convertTo(planes[i], CV_8U);
  }
  cv::merge(planes, 3, rgb);
  return rgb;
}

class Canvas {
 public:
  Canvas(const cv::Mat& rgb, double pixel_um)
      : zoom_(std::max(1, static_cast<int>(std::lround(2048.0 / std::max(rgb.cols, rgb.rows))))),
        pixel_um_(pixel_um / zoom_) {
    cv::resize(rgb, picture_, cv::Size(), zoom_, zoom_, cv::INTER_CUBIC);
  }

  void line(const Polyline& points_um, bool is_closed, const cv::Scalar& colour, int thickness) {
    std::vector<cv::Point> points;
    for (const Vec2 p : points_um) points.push_back(fixed(p));
    cv::polylines(picture_, points, is_closed, colour, thickness, cv::LINE_AA, kShift);
  }
  /// Text centred on a point, on a dark rim.
  void label(Vec2 at_um, const std::string& text, const cv::Scalar& colour, double size) {
    int baseline = 0;
    const cv::Size box = cv::getTextSize(text, kFont, size, 1, &baseline);
    const cv::Point2d c = to_pixels(at_um, pixel_um_);
    cv::Point at(cvRound(c.x) - box.width / 2, cvRound(c.y) + box.height / 2);
    at.x = std::clamp(at.x, 1, std::max(1, picture_.cols - box.width - 1));
    at.y = std::clamp(at.y, box.height + 1, picture_.rows - 2);
    cv::putText(picture_, text, at, kFont, size, kInk, 3, cv::LINE_AA);
    cv::putText(picture_, text, at, kFont, size, colour, 1, cv::LINE_AA);
  }
  const cv::Mat& picture() const { return picture_; }
  double pixel_um() const { return pixel_um_; }

 private:
  cv::Point fixed(Vec2 p) const {
    const cv::Point2d q = to_pixels(p, pixel_um_) * (1 << kShift);
    return {cvRound(q.x), cvRound(q.y)};
  }
  int zoom_;
  double pixel_um_;
  cv::Mat picture_;
};

/// 1, 2 or 5 times a power of ten, at most `limit`.
double round_length(double limit) {
  const double power = std::pow(10, std::floor(std::log10(limit)));
  return power * (limit >= 5 * power ? 5 : limit >= 2 * power ? 2 : 1);
}

void draw_legend(cv::Mat& footer, const Segmentation& s, double pixel_um) {
  const double size = footer.cols < 1200 ? 0.5 : 0.75;
  const int middle = footer.rows / 2 + 6;
  int x = 16;
  const auto entry = [&](const cv::Scalar& colour, const std::string& text) {
    cv::line(footer, {x, middle - 6}, {x + 30, middle - 6}, kInk, 6, cv::LINE_AA);
    cv::line(footer, {x, middle - 6}, {x + 30, middle - 6}, colour, 4, cv::LINE_AA);
    cv::putText(footer, text, {x + 38, middle}, kFont, size, kInk, 1, cv::LINE_AA);
    int baseline = 0;
    x += 60 + cv::getTextSize(text, kFont, size, 1, &baseline).width;
  };
  for (const FibreType type : kFibreTypes) {
    const auto n =
        std::count_if(s.cell.fibres.begin(), s.cell.fibres.end(), [&](const Fibre& f) { return f.type == type; });
    entry(colour_of(type), std::string(name_of(type)) + " " + std::to_string(n));
  }
  entry(kAdhesion, "adhesion " + std::to_string(s.cell.adhesions.size()));
  entry(kOutline, "outline");
  const double bar_um = round_length(0.2 * footer.cols * pixel_um);
  const int bar = cvRound(bar_um / pixel_um), right = footer.cols - 16;
  cv::rectangle(footer, {right - bar, middle + 2}, {right, middle + 10}, kInk, cv::FILLED);
  char text[32];
  std::snprintf(text, sizeof text, "%g um", bar_um);
  int baseline = 0;
  const cv::Size box = cv::getTextSize(text, kFont, size, 1, &baseline);
  cv::putText(footer, text, {right - (bar + box.width) / 2, middle - 6}, kFont, size, kInk, 1, cv::LINE_AA);
}

}  // namespace

Picture draw_overlay(const std::optional<Channel>& adhesion, const std::optional<Channel>& actin,
                     const Segmentation& s) {
  Canvas canvas(background(adhesion, actin), s.pixel_size_um);
  canvas.line(s.cell.outline_um, true, kOutline, 1);
  for (const Adhesion& a : s.cell.adhesions) canvas.line(ellipse_polygon(a, 32), true, kAdhesion, 1);
  for (const Fibre& f : s.cell.fibres) canvas.line(f.points_um, false, colour_of(f.type), 2);
  constexpr double kSmall = 0.35, kLarge = 0.6;
  for (const Adhesion& a : s.cell.adhesions)
    canvas.label(a.position_um + Vec2{0, a.major_axis_um / 2 + 8 * canvas.pixel_um()}, std::to_string(a.adhesion_id),
                 kAdhesion, kSmall);
  for (const Fibre& f : s.cell.fibres)
    canvas.label(f.points_um[f.points_um.size() / 2], std::to_string(f.fibre_id), colour_of(f.type), kLarge);
  cv::Mat whole(canvas.picture().rows + kFooter, canvas.picture().cols, CV_8UC3, kPaper);
  canvas.picture().copyTo(whole(cv::Rect(0, 0, whole.cols, canvas.picture().rows)));
  cv::Mat footer = whole(cv::Rect(0, canvas.picture().rows, whole.cols, kFooter));
  draw_legend(footer, s, canvas.pixel_um());
  return {whole.cols, whole.rows, std::vector<std::uint8_t>(whole.data, whole.data + whole.total() * 3)};
}

}  // namespace mbtfm::segment
