/// Inside of the bead tracker: parts of the picture in which single beads cannot be followed, as where it is out of
/// focus, or mottled, or crowded.
#pragma once

#include <vector>

#include "segment/beads/scene.h"

namespace mbtfm::beads {

/// Squares of the picture in which sixteen beads are good elsewhere. A square is a gap if fewer than four are: of
/// sixteen at random that is chance in one of ten thousand.
class Gaps {
 public:
  /// Both must outlive this.
  Gaps(const Scene& scene, const std::vector<Track>& tracks);
  /// Of the picture.
  double share() const { return share_; }
  /// A fiftieth of the picture, and two squares at least: less is noticed by nobody, and takes the time of windows.
  bool are_large() const;
  bool hold(Vec2 place_px) const;
  /// Whether the gel could have a motion (px) there beside what some bead nearby does: what contradicts all of them is
  /// another part of a pattern that repeats itself, or chance.
  bool allow(Vec2 place_px, Vec2 u_px, double sigma_px) const;

 private:
  int square_of(Vec2 place_px) const;
  const Scene& scene_;
  const std::vector<Track>& tracks_;
  double side_x_ = 1, side_y_ = 1, share_ = 0;
  int nx_ = 1, ny_ = 1;
  std::vector<bool> is_gap_;
};

}  // namespace mbtfm::beads
