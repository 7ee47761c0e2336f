#include "segment/cells/hand_drawn.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/candidates.h"
#include "segment/cells/ellipse.h"
#include "segment/cells/fibre_ends.h"
#include "segment/cells/fibre_profile.h"
#include "segment/cells/grid.h"

namespace mbtfm::cells {
namespace {

std::string called(const RoiSet& set, const rois::Roi& roi) { return set.name + ": '" + roi.name + "'"; }

/// A selection may touch the border of its image, and by rounding pass it by a pixel; further out it was drawn on
/// another image.
void require_inside(const std::vector<Vec2>& points_px, const Field& field, const std::string& where) {
  constexpr double kSlack_px = 1;
  for (const Vec2 p : points_px) {
    if (p.x >= -kSlack_px && p.y >= -kSlack_px && p.x <= field.width_px + kSlack_px &&
        p.y <= field.height_px + kSlack_px)
      continue;
    throw InputError(where,
                     "a selection within the image's " + std::to_string(field.width_px) + " x " +
                         std::to_string(field.height_px) + " pixels",
                     "a point at " + std::to_string(std::lround(p.x)) + ", " + std::to_string(std::lround(p.y)),
                     "was it drawn on this image, not on a larger one or a crop?");
  }
}

std::vector<Vec2> line_um(const std::vector<Vec2>& points_px, double pixel_um) {
  std::vector<Vec2> points_um;
  for (const Vec2 p : points_px)
    if (points_um.empty() || !(pixel_um * p == points_um.back())) points_um.push_back(pixel_um * p);
  return points_um;
}

Polygon area_um(const RoiSet& set, const rois::Roi& roi, const Field& field) {
  const std::string where = called(set, roi);
  if (!rois::is_area(roi.shape)) {
    throw InputError(where, "an area: polygon, freehand, traced, oval, ellipse, rectangle or composite",
                     std::string(name_of(roi.shape)),
                     rois::is_line(roi.shape) ? "lines of fibres belong to fibres.zip; draw areas with the polygon tool"
                                              : "draw the area with the polygon, freehand or oval tool");
  }
  if (roi.is_spline) require_inside(roi.points_px, field, where);  // before it is drawn
  const Polygon polygon_px = rois::area_px(roi);
  require_inside(polygon_px, field, where);
  Polygon polygon_um = line_um(polygon_px, field.pixel_um);
  if (polygon_um.size() > 1 && polygon_um.front() == polygon_um.back()) polygon_um.pop_back();
  if (polygon_um.size() < 3)
    throw InputError(where, "at least three points", std::to_string(polygon_um.size()) + " different ones");
  // a hundredth of a pixel: what the rounding of float coordinates may leave of a line
  if (!(std::abs(signed_area_um2(polygon_um)) > 0.01 * field.pixel_um * field.pixel_um))
    throw InputError(where, "an area > 0", "none between its points");
  return polygon_um;
}

/// Ovals and ellipses are known exactly.
std::optional<Adhesion> drawn_ellipse(const rois::Roi& roi, double pixel_um) {
  Vec2 centre, axis;
  double other = 0;
  if (roi.shape == rois::RoiShape::oval) {
    centre = roi.corner_px + 0.5 * roi.size_px;
    axis = {roi.size_px.x, 0};
    other = std::abs(roi.size_px.y);
  } else if (roi.shape == rois::RoiShape::ellipse) {
    centre = 0.5 * (roi.points_px[0] + roi.points_px[1]);
    axis = roi.points_px[1] - roi.points_px[0];
    other = std::abs(roi.aspect_ratio) * norm(axis);
  } else {
    return std::nullopt;
  }
  if (other > norm(axis)) {
    const double longer = other / norm(axis);
    other = norm(axis);
    axis = longer * Vec2{-axis.y, axis.x};
  }
  Adhesion adhesion;
  adhesion.position_um = pixel_um * centre;
  adhesion.major_axis_um = pixel_um * norm(axis);
  adhesion.minor_axis_um = pixel_um * other;
  adhesion.angle_rad = std::atan(axis.y / axis.x);  // of an axis without direction: -90° to 90°
  adhesion.area_um2 = std::numbers::pi / 4 * adhesion.major_axis_um * adhesion.minor_axis_um;
  adhesion.eccentricity = std::sqrt(std::max(0.0, 1 - std::pow(other / norm(axis), 2)));
  return adhesion;
}

Adhesion ellipse_of(const rois::Roi& roi, const Polygon& polygon_um, const Field& field, const std::string& where) {
  if (const auto ellipse = drawn_ellipse(roi, field.pixel_um)) return *ellipse;
  try {
    return ellipse_of_polygon(polygon_um);
  } catch (const InvalidData& error) {
    throw InputError(where, error.expected, error.found, "draw it again");
  }
}

/// See `hand_drawn_adhesions`. An area without a pixel's centre is as bright as the pixel at its own.
double height_within(const Polygon& area_um, const Adhesion& adhesion, const images::Image& image, double pixel_um) {
  double sum = 0;
  int n_inside = 0;
  const std::optional<double> around = level_around(adhesion, image, pixel_um, [&](int i, int j, Vec2 centre_um) {
    if (!contains(area_um, centre_um)) return true;
    sum += image.at(i, j);
    ++n_inside;
    return false;
  });
  const Vec2 c = adhesion.position_um;
  const double inside = n_inside > 0
                            ? sum / n_inside
                            : image.at(pixel_at(c.x, pixel_um, image.width), pixel_at(c.y, pixel_um, image.height));
  return inside - around.value_or(0);
}

/// The words of a selection's name, in small letters.
std::vector<std::string> words_of(const std::string& name) {
  std::vector<std::string> words(1);
  for (const char c : name)
    if (std::isalpha(static_cast<unsigned char>(c)))
      words.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    else if (!words.back().empty())
      words.emplace_back();
  return words;
}

/// The program's own anchors and candidates, given back by hand, stay what they are.
AdhesionOrigin stated_origin(const std::string& name) {
  for (const std::string& word : words_of(name)) {
    const std::optional<AdhesionOrigin> origin = named<AdhesionOrigin>(word);
    if (origin && is_assumed(*origin)) return *origin;
  }
  return AdhesionOrigin::drawn;
}

/// The type that a name's words or the group state; none where neither does.
std::optional<FibreType> stated_type(const rois::Roi& roi, const std::string& where) {
  std::optional<FibreType> type;
  for (const std::string& word : words_of(roi.name)) {
    const std::optional<FibreType> stated = named<FibreType>(word);
    if (stated && type && *stated != *type) throw InputError(where, "one fibre type in its name", "two");
    if (stated) type = stated;
  }
  const bool is_type = roi.group >= 1 && roi.group <= 1 + static_cast<int>(FibreType::edge);
  if (!type && is_type) type = kFibreTypes[roi.group - 1];
  return type;
}

/// Matrix points on the line, a pixel apart, and its end.
std::vector<cv::Point2d> pixels_along(const Polyline& line_um, double pixel_um) {
  std::vector<cv::Point2d> points;
  double ahead_um = 0;  // from the segment's begin to the next point
  for (std::size_t i = 0; i + 1 < line_um.size(); ++i) {
    const Vec2 step = line_um[i + 1] - line_um[i];
    for (; ahead_um < norm(step); ahead_um += pixel_um)
      points.push_back(to_pixels(line_um[i] + (ahead_um / norm(step)) * step, pixel_um));
    ahead_um -= norm(step);
  }
  points.push_back(to_pixels(line_um.back(), pixel_um));
  return points;
}

void set_profile(Fibre& fibre, const rois::Roi& roi, const std::optional<images::Channel>& actin, double pixel_um,
                 const FibreParameters& p) {
  fibre.width_um = roi.stroke_width_px > 0 ? roi.stroke_width_px * pixel_um : p.fibre_width_um;
  if (!actin) return;
  const Profile profile = profile_across(matrix_of(actin->image), pixels_along(fibre.points_um, pixel_um),
                                         1.5 * p.fibre_width_um / pixel_um);
  fibre.mean_intensity = profile.height;
  if (profile.height > 0 && profile.width_px > 0) fibre.width_um = profile.width_px * pixel_um;
}

Fibre drawn_fibre(const RoiSet& set, const rois::Roi& roi, const Field& field) {
  const std::string where = called(set, roi);
  if (!rois::is_line(roi.shape)) {
    throw InputError(where, "a line: straight, segmented or freehand", std::string(name_of(roi.shape)),
                     rois::is_area(roi.shape) ? "areas belong to adhesions.zip or outline.roi" : "");
  }
  if (roi.is_spline) require_inside(roi.points_px, field, where);  // before it is drawn
  const Polyline line = rois::line_px(roi);
  require_inside(line, field, where);
  Fibre fibre;
  fibre.points_um = line_um(line, field.pixel_um);
  if (fibre.points_um.size() < 2)
    throw InputError(where, "at least two points", std::to_string(fibre.points_um.size()) + " different ones");
  if (length_um(fibre.points_um) < field.pixel_um)
    throw InputError(where, "a line of at least a pixel's length", mbtfm::images::in_um(length_um(fibre.points_um)));
  return fibre;
}

}  // namespace

CellOutline hand_drawn_outline(const RoiSet& set, const Field& field) {
  std::vector<Polygon> rings_um;
  for (const rois::Roi& roi : set.rois) {
    if (roi.shape != rois::RoiShape::composite) rings_um.push_back(area_um(set, roi, field));
    for (const Polygon& path_px : roi.paths_px) {
      rois::Roi path;
      path.name = roi.name;
      path.points_px = path_px;
      rings_um.push_back(area_um(set, path, field));
    }
  }
  const auto area_of = [](const Polygon& ring) { return std::abs(signed_area_um2(ring)); };
  const auto largest = std::max_element(rings_um.begin(), rings_um.end(),
                                        [&](const Polygon& a, const Polygon& b) { return area_of(a) < area_of(b); });
  if (largest == rings_um.end()) throw InputError(set.name, "an area, the cell's outline", "none");
  CellOutline cell;
  std::swap(cell.outer_um, *largest);
  rings_um.erase(largest);
  cell.holes_um = std::move(rings_um);
  cell.area_um2 = area_of(cell.outer_um);
  for (const Polygon& hole : cell.holes_um) {
    cell.area_um2 -= area_of(hole);
    if (!contains(cell.outer_um, hole.front())) {
      throw InputError(set.name, "one outline, and in it any holes", "areas beside each other",
                       "keep the cell's alone: an image of several cells is segmented cell by cell");
    }
  }
  CutRing cut =
      cut_by_border(cell.outer_um, {field.width_px * field.pixel_um, field.height_px * field.pixel_um}, field.pixel_um);
  cell.outer_um = std::move(cut.points_um);
  cell.is_cut = std::move(cut.is_cut);
  return cell;
}

std::vector<Adhesion> hand_drawn_adhesions(const RoiSet& set, const std::optional<images::Channel>& adhesion,
                                           const Field& field) {
  std::vector<Adhesion> adhesions;
  for (const rois::Roi& roi : set.rois) {
    const Polygon polygon_um = area_um(set, roi, field);
    Adhesion a = ellipse_of(roi, polygon_um, field, called(set, roi));
    a.adhesion_id = static_cast<int>(adhesions.size()) + 1;
    a.origin = stated_origin(roi.name);
    if (adhesion) a.mean_intensity = height_within(polygon_um, a, adhesion->image, field.pixel_um);
    adhesions.push_back(a);
  }
  return adhesions;
}

std::vector<Adhesion> each_once(const std::vector<Adhesion>& drawn) {
  constexpr double kSamePlace = 0.1, kSameArea = 0.1;  // of its width, of its area: nobody draws it so again by hand
  std::vector<Adhesion> once;
  for (const Adhesion& a : drawn) {
    const bool is_there = std::ranges::any_of(once, [&](const Adhesion& other) {
      return norm(a.position_um - other.position_um) < kSamePlace * a.minor_axis_um &&
             std::abs(a.area_um2 - other.area_um2) < kSameArea * a.area_um2;
    });
    if (is_there) continue;
    once.push_back(a);
    once.back().adhesion_id = static_cast<int>(once.size());
  }
  return once;
}

std::vector<DrawnLine> drawn_lines(const RoiSet& set, const std::optional<images::Channel>& actin, const Field& field,
                                   const FibreParameters& p) {
  std::vector<DrawnLine> lines;
  for (const rois::Roi& roi : set.rois) {
    const std::string where = called(set, roi);
    DrawnLine line{.fibre = drawn_fibre(set, roi, field), .stated = stated_type(roi, where), .where = where};
    set_profile(line.fibre, roi, actin, field.pixel_um, p);
    line.fibre.confidence = 1;  // a person says that it is one
    line.fibre.fibre_id = static_cast<int>(lines.size()) + 1;
    lines.push_back(std::move(line));
  }
  return lines;
}

std::vector<Vec2> held_ends_um(const DrawnLine& line) {
  const Polyline& points = line.fibre.points_um;
  const int n = line.stated ? n_held_ends(*line.stated) : 2;
  if (n == 0) return {};
  if (n == 1) return {points.front()};
  return {points.front(), points.back()};
}

namespace {

bool states_its_ends(const DrawnLine& line) { return line.stated && *line.stated != FibreType::unclassified; }

/// Ends that may be tied. Of a dorsal fibre one: that which reaches an adhesion, as the program's own fibres are given
/// back in either direction; its start if that does not decide.
EndsToTie ends_of(const DrawnLine& line, const std::vector<Adhesion>& adhesions, const Polygon& outline_um,
                  double reach_um) {
  if (!line.stated || n_held_ends(*line.stated) == 2) return {};
  if (n_held_ends(*line.stated) == 0) return {.start = false, .end = false};
  Fibre tried = line.fibre;
  tie_ends(tried, adhesions, outline_um, reach_um);
  const bool is_end = tried.end_adhesion_id && !tried.start_adhesion_id;
  return {.start = !is_end, .end = is_end};
}

/// The end of a fibre where an anchor can be: in the cell, or on its edge where it was drawn a little outside.
Vec2 place_of_anchor(Vec2 end_um, const CellOutline& cell, const std::string& where) {
  if (cell.outer_um.empty()) return end_um;
  constexpr double kFarthest_um = 3;  // as of adhesions: further out it is another cell's, or the outline is wrong
  const auto is_in_ring = [&](const Polygon& ring) { return contains(ring, end_um); };
  const auto hole = std::ranges::find_if(cell.holes_um, is_in_ring);
  if (is_in_ring(cell.outer_um) && hole == cell.holes_um.end()) return end_um;
  const Polygon& ring = hole == cell.holes_um.end() ? cell.outer_um : *hole;
  const Vec2 nearest = nearest_on_boundary_um(ring, end_um);
  if (norm(nearest - end_um) > kFarthest_um)
    throw InputError(where, "ends in the cell, where they can be held",
                     "one " + brief(norm(nearest - end_um)) + " um outside the outline",
                     "check the outline in overlay.png, and draw it, too, if it is wrong (outline_roi)");
  return nearest;
}

/// Tie a line's free end that must be held, its last point, to an anchor of its own.
int add_anchor(Polyline& line, std::vector<Adhesion>& all, const CellOutline& cell, double area_um2,
               const std::string& where) {
  Adhesion made = anchor(place_of_anchor(line.back(), cell, where), area_um2);
  made.adhesion_id = next_id(all);
  if (!(made.position_um == line.back())) {
    line.back() = made.position_um;
    if (line.size() > 1 && line[line.size() - 2] == line.back()) line.pop_back();
  }
  all.push_back(made);
  return made.adhesion_id;
}

/// Tie the line, and make the anchors that its type asks for.
Fibre held(DrawnLine line, std::vector<Adhesion>& all, const CellOutline& cell, const FibreParameters& p,
           double anchor_area_um2, const Cuts& cuts) {
  const EndsToTie ends = ends_of(line, all, cell.outer_um, p.fibre_reach_um);
  Fibre& fibre = line.fibre;
  tie_ends(fibre, all, cell.outer_um, p.fibre_reach_um, ends);
  lead_to_cut(fibre, cuts, p.fibre_reach_um);
  if (fibre.points_um.size() < 2)
    throw InputError(line.where, "a line from one adhesion to another or beyond", "one within a single adhesion");
  if (!line.stated) return fibre;
  fibre.type = *line.stated;
  fibre.type_reason = "named or grouped so by hand";
  if (!states_its_ends(line)) return fibre;
  const auto hold = [&](bool is_asked, std::optional<int>& adhesion_id) {
    if (is_asked && !adhesion_id && !is_on_cut(fibre.points_um.back(), cuts))
      adhesion_id = add_anchor(fibre.points_um, all, cell, anchor_area_um2, line.where);
  };
  hold(ends.end, fibre.end_adhesion_id);
  std::reverse(fibre.points_um.begin(), fibre.points_um.end());
  hold(ends.start, fibre.start_adhesion_id);
  std::reverse(fibre.points_um.begin(), fibre.points_um.end());
  fibre.type_confidence = 1;
  return fibre;
}

}  // namespace

HeldFibres hold_fibres(std::vector<DrawnLine> lines, const std::vector<Adhesion>& adhesions, const CellOutline& cell,
                       const FibreParameters& p, double anchor_area_um2, const Cuts& cuts) {
  std::vector<Adhesion> all = adhesions;
  std::vector<std::optional<Fibre>> fibres(lines.size());
  // first those whose types ask for anchors, which then hold the others, too
  for (const bool is_stated : {true, false}) {
    for (std::size_t i = 0; i < lines.size(); ++i)
      if (states_its_ends(lines[i]) == is_stated)
        fibres[i] = held(std::move(lines[i]), all, cell, p, anchor_area_um2, cuts);
  }
  HeldFibres result;
  for (std::optional<Fibre>& fibre : fibres) result.fibres.push_back(std::move(*fibre));
  result.anchors.assign(all.begin() + static_cast<std::ptrdiff_t>(adhesions.size()), all.end());
  return result;
}

}  // namespace mbtfm::cells
