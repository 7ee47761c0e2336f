/// One outline laid onto another of the same shape: shift, turn and mirror.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::mean {

/// Mirrored (y to -y) if so, turned, and moved: what lies at `from_um` comes to `to_um`.
struct Motion {
  Vec2 from_um, to_um;
  double angle_rad = 0;  ///< from +x towards +y
  bool is_mirrored = false;

  Vec2 vector(Vec2 v) const;  ///< mirrored and turned
  Vec2 vector_back(Vec2 v) const;
  Vec2 place_um(Vec2 p) const { return to_um + vector(p - from_um); }
  Vec2 back_um(Vec2 p) const { return from_um + vector_back(p - to_um); }
};

Polygon moved(const Polygon& polygon, const Motion& motion);
/// Of its area.
Vec2 centroid_um(const Polygon& polygon);
/// Radius of the circle of the same area.
double size_um(const Polygon& polygon);

/// A way to lay one onto the other that no small motion makes better.
struct Way {
  Motion motion;
  double misfit_um = 0;  ///< root mean square distance, of each outline's points from the other
  double shift_error_um = 0, angle_error_rad = 0;  ///< from the misfit, as many independent parts as it has
  double correlation = 0;                          ///< of two images where they overlap, 1 at best
};

/// Root mean square distance of each outline's points from the other.
double misfit_um(const Polygon& a_um, const Polygon& b_um);

enum class Mirrors { tried, not_tried };

/// All ways, the best first: from each angle where the misfit of outlines with a common centroid has a minimum.
/// Source: iterated closest points (Besl, McKay, IEEE PAMI 14 (1992) 239) with distances along the normal (Chen,
/// Medioni 1992).
std::vector<Way> ways_onto(const Polygon& outline_um, const Polygon& reference_um, Mirrors mirrors);

/// Two ways fit equally well where their misfits differ by less than a tenth, or less than can be seen: 1e-3 of the
/// size.
bool fit_equally(const Way& a, const Way& b, double size_um);

// The motions that leave a shape as it is.

/// Schoenflies' symbol: C4 (turns by a quarter), C4v (mirrors, too), C1 (none), C1v (one mirror), Cinfv (a circle).
struct Symmetry {
  int n_turns = 1;
  bool has_mirrors = false;
  bool is_circle = false;
};
/// @throws UsageError where it is none of these
Symmetry symmetry_of(const std::string& text);

/// The motions of the group about the shape's centroid, the identity first; of a circle 72 turns. The mirrors' axes are
/// where the shape is nearest to its mirror image.
std::vector<Motion> motions_of(const Symmetry& symmetry, const Polygon& reference_um);

/// Root mean square distance of the shape from itself moved, the largest over the motions.
double asymmetry_um(const Polygon& reference_um, const std::vector<Motion>& motions);

/// Whether two ways to lay an outline onto the shape differ by a motion of the group.
bool are_equivalent(const Way& a, const Way& b, const std::vector<Motion>& motions);

}  // namespace mbtfm::mean
