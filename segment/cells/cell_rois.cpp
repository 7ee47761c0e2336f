#include "segment/cells/cell_rois.h"

#include <cmath>

#include "segment/cells/overlay.h"

namespace mbtfm::cells {
namespace {

std::uint32_t argb(Colour c) { return 0xFF000000u | c.red << 16 | c.green << 8 | c.blue; }

std::vector<Vec2> in_px(const std::vector<Vec2>& points_um, double pixel_um, double shift_px) {
  std::vector<Vec2> points_px;
  for (const Vec2 p : points_um) points_px.push_back((1 / pixel_um) * p - Vec2{shift_px, shift_px});
  return points_px;
}

/// "adhesion 12"; of those that nobody saw "anchor 12" or "candidate 12".
std::string name_in_set(const Adhesion& a) {
  return std::string(is_assumed(a.origin) ? name_of(a.origin) : "adhesion") + " " + std::to_string(a.adhesion_id);
}

}  // namespace

std::vector<rois::Roi> rois_of(const Cell& cell, double pixel_um) {
  std::vector<rois::Roi> rois;
  const auto add = [&](rois::RoiShape shape, const std::string& name, Colour colour) -> rois::Roi& {
    rois.emplace_back();
    rois.back().shape = shape;
    rois.back().name = name;
    rois.back().stroke_argb = argb(colour);
    return rois.back();
  };
  add(rois::RoiShape::polygon, "outline", kOutlineColour).points_px = in_px(cell.outline_um, pixel_um, 0);
  for (std::size_t i = 0; i < cell.holes_um.size(); ++i)
    add(rois::RoiShape::polygon, "hole " + std::to_string(i + 1), kOutlineColour).points_px =
        in_px(cell.holes_um[i], pixel_um, 0);
  for (const Adhesion& a : cell.adhesions) {
    const Vec2 half = 0.5 * a.major_axis_um * Vec2{std::cos(a.angle_rad), std::sin(a.angle_rad)};
    rois::Roi& roi = add(rois::RoiShape::ellipse, name_in_set(a), kAdhesionColour);
    roi.points_px = in_px({a.position_um - half, a.position_um + half}, pixel_um, 0);
    roi.aspect_ratio = a.minor_axis_um / a.major_axis_um;
  }
  constexpr double kCentre_px = 0.5;  // ImageJ counts a line's points from pixel centres
  for (const Fibre& f : cell.fibres) {
    const std::string name = std::string(name_of(f.type)) + " " + std::to_string(f.fibre_id);
    add(rois::RoiShape::polyline, name, colour_of(f.type)).points_px = in_px(f.points_um, pixel_um, kCentre_px);
  }
  return rois;
}

}  // namespace mbtfm::cells
