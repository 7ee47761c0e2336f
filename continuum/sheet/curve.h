/// A closed line through the corners of a polygon: smooth, with its sharp corners kept.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::sheet {

/// Cubic between neighbouring points, tangents of the parabola through three (fourth order in their distance). A turn
/// by more than 40° is a corner: an outline of ten points is still smooth, a rectangle is not. The steps of pixels, of
/// which every second point turns by more, are averaged away first.
class Curve {
 public:
  /// @param points_um  at least three, no two in a row equal
  explicit Curve(const Polygon& points_um);

  double length_um() const { return start_um_.back(); }
  Vec2 at(double s_um) const;  ///< s: length along the chords, in [0, length_um()], periodic
  /// From the points around, positive where it turns from +x towards +y; of two neighbours the larger.
  double curvature_per_um(double s_um) const;
  const std::vector<double>& corners_um() const { return corners_um_; }  ///< rising
  /// Of the point nearest to it.
  double nearest_um(Vec2 point_um) const;
  const Polygon& points_um() const { return points_um_; }  ///< turning from +x towards +y
  /// The piece of points_um() on which s lies.
  std::size_t piece_at(double s_um) const;

 private:
  double wrapped(double s_um) const;
  Polygon points_um_;
  std::vector<double> start_um_;                ///< by point, and the whole length
  std::vector<Vec2> tangent_in_, tangent_out_;  ///< at each point, before and behind it
  std::vector<double> turn_per_um_;             ///< at each point
  std::vector<double> corners_um_;
};

/// Two pieces of the rings that cross or touch, if any do, as "piece 3 of ring 0 and piece 17 of ring 0".
std::string crossing_of(const std::vector<Polygon>& rings_um);

}  // namespace mbtfm::sheet
