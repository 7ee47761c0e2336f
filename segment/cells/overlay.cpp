#include "segment/cells/overlay.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "pipeline/contract/polyline.h"
#include "segment/cells/grid.h"

namespace mbtfm::cells {
namespace {

const cv::Scalar kInk(15, 15, 15), kPaper(255, 255, 255);  // red, green, blue
const cv::Scalar kLeftOut(190, 190, 190), kDoubtful(150, 150, 110);
constexpr double kRingDash_px = 7, kFibreDash_px = 22;
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr int kShift = 4;           // OpenCV's drawing takes fixed-point coordinates: sixteenths of a pixel
constexpr double kLongSide = 1600;  // px: two screens' pixels for each where a page shows it 700 px wide
constexpr double kHalo_um = 1;      // of what is left out: light beside it is its own
constexpr double kMargin_um = 3;    // around the cell, so that one sees what the outline leaves out
constexpr double kFibreText = 1.0, kAdhesionText = 0.6, kLegendText = 1.0;  // times 22 px: height of a capital
constexpr double kStemOfU = 4;  // px from the left of the letter's box at size 1

cv::Scalar scalar(Colour c) { return cv::Scalar(c.red, c.green, c.blue); }

/// The fainter, the less probable it is what it is drawn as.
cv::Scalar faded(const cv::Scalar& colour, double probability) {
  constexpr double kFaintest = 0.3;
  return colour * (kFaintest + (1 - kFaintest) * probability);
}
cv::Scalar faded_colour(const Fibre& f) { return faded(scalar(colour_of(f.type)), f.confidence); }

/// What does not lie in one of the things that are no part of the cell: a dead cell may be ten times as bright.
cv::Mat without(const cv::Mat& values, const cv::Mat& is_left_out) {
  std::vector<float> kept;
  for (int j = 0; j < values.rows; ++j)
    for (int i = 0; i < values.cols; ++i)
      if (is_left_out.at<unsigned char>(j, i) == 0) kept.push_back(values.at<float>(j, i));
  return kept.empty() ? values : cv::Mat(kept, true);
}

/// Part of an image at the size of the picture, 0 to 1 between its 1 % and its 99.8 % quantile, brightened by a root so
/// that faint structure shows.
/// @param is_left_out  at the picture's size: what sets no level; empty: nothing
cv::Mat stretched(const images::Image& image, const cv::Rect& part, cv::Size size, const cv::Mat& is_left_out) {
  cv::Mat values;
  cv::resize(matrix_of(image)(part), values, size, 0, 0, size.width < part.width ? cv::INTER_AREA : cv::INTER_CUBIC);
  const cv::Mat counted = is_left_out.empty() ? values : without(values, is_left_out);
  const double low = quantile(counted, 0.01), high = quantile(counted, 0.998);
  values = cv::min(cv::max((values - low) / std::max(high - low, 1e-12), 0.0), 1.0);
  cv::pow(values, 0.7, values);
  return values;
}

cv::Mat background(const std::optional<images::Channel>& adhesion, const std::optional<images::Channel>& actin,
                   const cv::Rect& part, cv::Size size, const cv::Mat& is_left_out) {
  cv::Mat planes[3];
  const cv::Mat none = cv::Mat::zeros(size, CV_32F);
  const cv::Mat grey = actin ? stretched(actin->image, part, size, is_left_out) : none;
  const cv::Mat purple = adhesion ? stretched(adhesion->image, part, size, is_left_out) : none;
  // alone, a channel may use the whole range; together they share it
  const double share_grey = adhesion ? 150 : 210, share_purple = actin ? 150 : 210;
  const double tint[3] = {1.0, actin ? 0.1 : 1.0, actin ? 0.95 : 1.0};  // alone it is grey, so that marks stand out
  cv::Mat rgb;
  for (int i = 0; i < 3; ++i) {
    const cv::Mat sum = share_grey * grey + share_purple * tint[i] * purple;
    sum.convertTo(planes[i], CV_8U);
  }
  cv::merge(planes, 3, rgb);
  return rgb;
}

/// Where a text's lower left corner lies, and what it covers.
struct Place {
  cv::Point origin;
  cv::Rect covered;
};

int thickness_of(double size) { return size >= 1 ? 2 : 1; }

Place centred_text(cv::Point2d centre, const std::string& text, double size) {
  int baseline = 0;
  const cv::Size box = cv::getTextSize(text, kFont, size, thickness_of(size), &baseline);
  const cv::Point origin(cvRound(centre.x) - box.width / 2, cvRound(centre.y) + box.height / 2);
  constexpr int kRim = 3;
  return {origin, {origin.x - kRim, origin.y - box.height - kRim, box.width + 2 * kRim, box.height + 2 * kRim}};
}

/// The part of the images around the cell, enlarged or reduced to a size that suits a screen.
class Canvas {
 public:
  Canvas(const std::optional<images::Channel>& adhesion, const std::optional<images::Channel>& actin,
         const Extent& view, const Segmentation& s, double long_side) {
    const double pixel_size_um = s.pixel_size_um;
    const images::Image& any = actin ? actin->image : adhesion->image;
    const Vec2 low = (1 / pixel_size_um) * view.low_um, high = (1 / pixel_size_um) * view.high_um;
    const cv::Rect wanted(cv::Point(cvFloor(low.x), cvFloor(low.y)), cv::Point(cvCeil(high.x), cvCeil(high.y)));
    const cv::Rect part = wanted & cv::Rect(0, 0, any.width, any.height);
    const double zoom = long_side / std::max(part.width, part.height);
    pixel_um_ = pixel_size_um / zoom;
    corner_um_ = {part.x * pixel_size_um, part.y * pixel_size_um};
    const cv::Size size(std::max(1, cvRound(part.width * zoom)), std::max(1, cvRound(part.height * zoom)));
    cv::Mat is_left_out;
    for (const auto* things : {&s.left_out_um, &s.cell.neighbours_um}) {
      for (const Polygon& thing : *things) {
        if (is_left_out.empty()) is_left_out = cv::Mat::zeros(size, CV_8U);
        std::vector<cv::Point> points;
        for (const Vec2 p : thing) points.emplace_back(cvRound(at(p).x), cvRound(at(p).y));
        cv::fillPoly(is_left_out, std::vector{points}, 255);
      }
    }
    if (!is_left_out.empty()) cv::dilate(is_left_out, is_left_out, cv::Mat(), {-1, -1}, cvRound(kHalo_um / pixel_um_));
    picture_ = background(adhesion, actin, part, size, is_left_out);
  }

  void line(const Polyline& points_um, bool is_closed, const cv::Scalar& colour, int thickness) {
    std::vector<cv::Point> points;
    for (const Vec2 p : points_um) {
      const cv::Point2d q = at(p) * (1 << kShift);
      points.emplace_back(cvRound(q.x), cvRound(q.y));
    }
    cv::polylines(picture_, points, is_closed, colour, thickness, cv::LINE_AA, kShift);
  }
  /// The same in dashes: what nobody has seen, and edge fibres, for eyes that see no colours.
  void dashed_line(Polyline points_um, bool is_closed, const cv::Scalar& colour, int thickness, double dash_px) {
    if (is_closed) points_um.push_back(points_um.front());
    constexpr double kGap = 0.7;  // of a dash: still a line for the eye
    Polyline dash{points_um.front()};
    double left_um = dash_px * pixel_um_;
    bool is_gap = false;
    const auto end_piece = [&] {
      if (!is_gap && dash.size() > 1) line(dash, false, colour, thickness);
      is_gap = !is_gap;
      left_um = (is_gap ? kGap : 1) * dash_px * pixel_um_;
      dash = {dash.back()};
    };
    for (std::size_t i = 1; i < points_um.size(); ++i) {
      Vec2 rest = points_um[i] - dash.back();
      while (norm(rest) > left_um) {
        dash.push_back(dash.back() + (left_um / norm(rest)) * rest);
        end_piece();
        rest = points_um[i] - dash.back();
      }
      left_um -= norm(rest);
      dash.push_back(points_um[i]);
    }
    end_piece();
  }
  /// Keep labels off this place.
  void occupy(const Polyline& points_um) {
    std::vector<cv::Point2f> points;
    for (const Vec2 p : points_um) points.emplace_back(at(p));
    taken_.push_back(cv::boundingRect(points));
  }
  /// Text on a dark rim, centred on the first of the points where it hides no other; nowhere if there is none.
  void label(const std::vector<Vec2>& candidates_um, const std::string& text, const cv::Scalar& colour, double size) {
    const cv::Rect whole(0, 0, picture_.cols, picture_.rows);
    for (const Vec2 candidate : candidates_um) {
      const Place place = centred_text(at(candidate), text, size);
      const auto hides = [&](const cv::Rect& other) { return (other & place.covered).area() > 0; };
      if ((whole & place.covered) != place.covered || std::any_of(taken_.begin(), taken_.end(), hides)) continue;
      cv::putText(picture_, text, place.origin, kFont, size, kInk, thickness_of(size) + 4, cv::LINE_AA);
      cv::putText(picture_, text, place.origin, kFont, size, colour, thickness_of(size), cv::LINE_AA);
      taken_.push_back(place.covered);
      return;
    }
  }
  const cv::Mat& picture() const { return picture_; }
  double pixel_um() const { return pixel_um_; }
  Vec2 corner_um() const { return corner_um_; }

 private:
  cv::Point2d at(Vec2 p_um) const { return to_pixels(p_um - corner_um_, pixel_um_); }

  double pixel_um_ = 1;
  Vec2 corner_um_;
  cv::Mat picture_;
  std::vector<cv::Rect> taken_;
};

/// Below, above, right and left of an adhesion.
std::vector<Vec2> places_beside(const Adhesion& a, double pixel_um) {
  const double gap = a.major_axis_um / 2 + 10 * pixel_um;
  return {a.position_um + Vec2{0, gap}, a.position_um - Vec2{0, gap}, a.position_um + Vec2{1.4 * gap, 0},
          a.position_um - Vec2{1.4 * gap, 0}};
}

void draw_labels(Canvas& canvas, const Cell& cell) {
  constexpr double kClear_px = 30;  // about a label's width
  for (const Fibre& f : cell.fibres)
    canvas.label(label_places_um(f, cell.fibres, kClear_px * canvas.pixel_um()),
                 letter_of(f.type) + std::to_string(f.fibre_id), scalar(colour_of(f.type)), kFibreText);
  for (const Adhesion& a : cell.adhesions) canvas.occupy(ellipse_corners(a, 16));
  std::vector<const Adhesion*> large_first;
  for (const Adhesion& a : cell.adhesions)
    if (a.origin != AdhesionOrigin::candidate) large_first.push_back(&a);  // of a lattice numbers would hide the cell
  std::stable_sort(large_first.begin(), large_first.end(),
                   [](const Adhesion* a, const Adhesion* b) { return a->area_um2 > b->area_um2; });
  for (const Adhesion* a : large_first)
    canvas.label(places_beside(*a, canvas.pixel_um()), std::to_string(a->adhesion_id), scalar(kAdhesionColour),
                 kAdhesionText);
}

/// 1, 2 or 5 times a power of ten, at most `limit`.
double round_length(double limit) {
  const double power = std::pow(10, std::floor(std::log10(limit)));
  return power * (limit >= 5 * power ? 5 : limit >= 2 * power ? 2 : 1);
}

/// A line in a colour and what it stands for. "um" is drawn as µm, which OpenCV's font lacks.
struct Entry {
  std::string text;
  cv::Scalar colour;
  int bar = 56;     ///< length of the line (px)
  int height = 10;  ///< of the line (px)
  bool is_dashed = false;
};

/// Rings that the overlay shows, in part or whole.
std::ptrdiff_t n_in_view(const Segmentation& s, const std::vector<Polygon>& rings_um) {
  const auto [low, high] = view_of(s);
  return std::ranges::count_if(rings_um, [low = low, high = high](const Polygon& ring) {
    return std::ranges::any_of(ring,
                               [&](Vec2 p) { return p.x >= low.x && p.x <= high.x && p.y >= low.y && p.y <= high.y; });
  });
}

std::vector<Entry> entries_of(const Segmentation& s, double pixel_um, int width) {
  const Cell& cell = s.cell;
  std::vector<Entry> entries;
  for (const FibreType type : kFibreTypes) {
    const auto n = std::ranges::count(cell.fibres, type, &Fibre::type);
    if (type >= FibreType::edge && n == 0) continue;
    entries.push_back(
        {std::string(name_of(type)) + " (" + letter_of(type) + ") " + std::to_string(n), scalar(colour_of(type))});
    entries.back().is_dashed = type == FibreType::edge;
  }
  const auto add_adhesions = [&](const std::string& name, bool is_dashed, const auto& is_one) {
    const auto n = std::ranges::count_if(cell.adhesions, is_one);
    if (n == 0 && !(cell.adhesions.empty() && !is_dashed)) return;
    entries.push_back({name + " " + std::to_string(n), scalar(kAdhesionColour)});
    entries.back().is_dashed = is_dashed;
  };
  add_adhesions("adhesion", false, [](const Adhesion& a) { return !is_assumed(a.origin); });
  add_adhesions("anchor", true, [](const Adhesion& a) { return a.origin == AdhesionOrigin::anchor; });
  add_adhesions("candidate", true, [](const Adhesion& a) { return a.origin == AdhesionOrigin::candidate; });
  if (!s.unexplained_um.empty()) entries.push_back({"bright actin in no fibre", scalar(kUnexplainedColour)});
  if (const std::size_t n = s.doubtful_um.size(); n > 0) {
    entries.push_back({"perhaps a fibre " + std::to_string(n), kDoubtful, 56, 4});
    entries.back().is_dashed = true;
  }
  if (const auto n = n_in_view(s, s.left_out_um) + n_in_view(s, s.cell.neighbours_um); n > 0) {
    entries.push_back({"not of this cell " + std::to_string(n), kLeftOut, 56, 4});
    entries.back().is_dashed = true;
  }
  entries.push_back({"outline", cv::Scalar(150, 150, 150), 56, 4});
  const double bar_um = round_length(0.2 * width * pixel_um);
  char text[32];
  std::snprintf(text, sizeof text, "%g um", bar_um);
  entries.push_back({text, kInk, cvRound(bar_um / pixel_um)});
  return entries;
}

int text_width(const std::string& text) {
  int baseline = 0;
  return cv::getTextSize(text, kFont, kLegendText, thickness_of(kLegendText), &baseline).width;
}

void draw_entry(cv::Mat& footer, const Entry& entry, cv::Point at) {
  const int thickness = thickness_of(kLegendText);
  const int n_dashes = entry.is_dashed ? 3 : 1, dash = entry.bar / (2 * n_dashes - 1);
  for (int i = 0; i < n_dashes; ++i) {
    const int left = at.x + 2 * i * dash, right = entry.is_dashed ? left + dash : at.x + entry.bar;
    cv::rectangle(footer, {left, at.y - entry.height / 2}, {right, at.y + entry.height / 2}, entry.colour, cv::FILLED);
  }
  const cv::Point origin(at.x + entry.bar + 14, at.y + 11);
  cv::putText(footer, entry.text, origin, kFont, kLegendText, kInk, thickness, cv::LINE_AA);
  const auto unit = entry.text.find(" um");
  if (unit == std::string::npos) return;
  const int stem = origin.x + text_width(entry.text.substr(0, unit + 1)) + cvRound(kStemOfU * kLegendText);
  cv::line(footer, {stem, origin.y}, {stem, origin.y + cvRound(7 * kLegendText)}, kInk, thickness, cv::LINE_AA);
}

/// Entries from left to right, in as many lines as they need.
cv::Mat legend(const std::vector<Entry>& entries, int width) {
  constexpr int kLine = 56, kGap = 14, kBetween = 26;
  std::vector<cv::Point> places;
  cv::Point at(kGap, kLine / 2);
  for (const Entry& entry : entries) {
    const int needed = entry.bar + kGap + text_width(entry.text);
    if (at.x > kGap && at.x + needed > width - kGap) at = {kGap, at.y + kLine};
    places.push_back(at);
    at.x += needed + kBetween;
  }
  cv::Mat footer(at.y + kLine / 2, width, CV_8UC3, kPaper);
  for (std::size_t i = 0; i < entries.size(); ++i) draw_entry(footer, entries[i], places[i]);
  return footer;
}

void draw_marks(Canvas& canvas, const Cell& cell, int thickness) {
  canvas.line(cell.outline_um, true, scalar(kOutlineColour), thickness);
  for (const Polygon& hole : cell.holes_um) canvas.line(hole, true, scalar(kOutlineColour), thickness);
  for (const Adhesion& a : cell.adhesions) {
    const Polygon ring = ellipse_corners(a, 32);
    if (is_assumed(a.origin))
      canvas.dashed_line(ring, true, scalar(kAdhesionColour), a.origin == AdhesionOrigin::anchor ? thickness : 1,
                         kRingDash_px);
    else
      canvas.line(ring, true, faded(scalar(kAdhesionColour), a.probability.value_or(1)), thickness);
  }
  for (const Fibre& f : cell.fibres)
    if (f.type == FibreType::edge)
      canvas.dashed_line(f.points_um, false, faded_colour(f), thickness + 1, kFibreDash_px);
    else
      canvas.line(f.points_um, false, faded_colour(f), thickness + 1);
}

}  // namespace

images::Picture picture_of(const cv::Mat& rgb) {
  return {rgb.cols, rgb.rows, std::vector<std::uint8_t>(rgb.data, rgb.data + rgb.total() * 3)};
}

Extent view_of(const Segmentation& s) {
  Polyline points = s.cell.outline_um;
  for (const Adhesion& a : s.cell.adhesions) points.push_back(a.position_um);
  for (const Fibre& f : s.cell.fibres) points.insert(points.end(), f.points_um.begin(), f.points_um.end());
  const auto [low, high] = extent_of(points);
  const Vec2 margin{kMargin_um, kMargin_um};
  return {low - margin, high + margin};
}

images::Picture draw_overlay(const std::optional<images::Channel>& adhesion,
                             const std::optional<images::Channel>& actin, const Segmentation& s) {
  Canvas canvas(adhesion, actin, view_of(s), s, kLongSide);
  draw_marks(canvas, s.cell, 2);
  for (const Polyline& line : s.doubtful_um) canvas.dashed_line(line, false, kDoubtful, 2, kRingDash_px);
  for (const auto* all : {&s.left_out_um, &s.cell.neighbours_um})
    for (const Polygon& ring : *all) canvas.dashed_line(ring, true, kLeftOut, 2, kRingDash_px);
  for (const Polyline& crest : s.unexplained_um)
    for (const Vec2 p : crest) canvas.line({p, p}, false, scalar(kUnexplainedColour), 6);
  draw_labels(canvas, s.cell);
  cv::Mat whole;
  const int width = canvas.picture().cols;
  cv::vconcat(canvas.picture(), legend(entries_of(s, canvas.pixel_um(), width), width), whole);
  return picture_of(whole);
}

Ground draw_ground(const std::optional<images::Channel>& adhesion, const std::optional<images::Channel>& actin,
                   const Segmentation& s) {
  constexpr double kGroundSide = 1000;  // px: a page shows it some 600 px wide, and carries it
  const Canvas canvas(adhesion, actin, view_of(s), s, kGroundSide);
  return {picture_of(canvas.picture()), canvas.corner_um(),
          canvas.pixel_um() * Vec2{double(canvas.picture().cols), double(canvas.picture().rows)}};
}

cv::Mat draw_thumbnail(const std::optional<images::Channel>& adhesion, const std::optional<images::Channel>& actin,
                       const Segmentation& s, const Extent& view, int long_side_px) {
  Canvas canvas(adhesion, actin, view, s, long_side_px);
  draw_marks(canvas, s.cell, 1);
  return canvas.picture();
}

}  // namespace mbtfm::cells
