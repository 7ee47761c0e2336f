/// Inside of the bead tracker: where each bead has gone, and parts of the picture in which single beads cannot be
/// followed, as where it is out of focus, or mottled, or crowded.
#pragma once

#include <optional>
#include <vector>

#include "segment/beads/coarse_field.h"
#include "segment/beads/local_motion.h"
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

struct Followed {
  std::vector<Track> tracks;
  int n_by_grid = 0;      ///< found from the grid's prediction, and not contradicted by their neighbours
  double period_px = 0;   ///< of a pattern that repeats itself; 0: it does not
  bool has_gaps = false;  ///< parts of the picture have no beads that are found so
};

/// What leads from beads that are found to those around them. Where motions are far and steep what many do together
/// may miss a bead, and false ones bear each other out: there each bead leads by itself, too, to beads found before as
/// well, at the cost of a few registrations each.
enum class Led { together, by_each };

/// Find the beads with the wide window: from the grid's prediction, then, where that fails, from the motion of the
/// beads already tracked around, again and again.
Followed follow(const Scene& scene, const GridField& grid, const TrackParameters& parameters, Led led);

/// Of unrelated pictures the wide window finds one bead in twenty "again", by chance, and all that comes after finds up
/// to two in five; of related ones each finds most. Of beads that scatter by more than their width, but by less than
/// a quarter of their distance, the window finds few and what comes after three in four.
/// @throws NotFollowed where fewer than two in three are found in the end, and fewer than one in five there or by the
/// grid
void require_common_beads(int n_by_grid, int n_in_the_end, int n_beads);

/// What the good tracks around say of each good one.
/// @param expected  by bead, px: beads are compared in what they do beside it; empty: nothing is
std::vector<std::optional<LocalMotion>> motions_around(const Scene& scene, const std::vector<Track>& tracks,
                                                       const std::vector<Vec2>& expected = {});

/// Median standard deviation (px) of single beads about those around them.
double typical_spread(const std::vector<std::optional<LocalMotion>>& around);

/// Flag tracks that contradict those around them "neighbours disagree"; how many.
int flag_outliers(const Scene& scene, double threshold, std::vector<Track>& tracks);

/// By bead, px: how far those around it miss its expected motion, which are compared in all that they do; 0 without
/// a good track.
/// @param beside  motions_around() with what is expected
std::vector<double> missed_around(const Scene& scene, const std::vector<Track>& tracks,
                                  const std::vector<std::optional<LocalMotion>>& beside);

/// The same of what beads do beside their expected motions (px), of which half of what the beads around do not show
/// may be wrong.
int flag_outliers_beside(const std::vector<Vec2>& expected, const Scene& scene, double threshold,
                         std::vector<Track>& tracks);

/// Flag "neighbours disagree" what moves by itself: a gel cannot do that.
///
/// What pulls a bead pulls those around it, too. About a patch of force of radius a that moves its middle by U beside
/// what the surroundings do, they move as the surface of an incompressible half-space does (Cerruti),
///
///   u(d) = c + G d + d H d + (a/|d|) (U + (U·e) e),   U = u_bead − c,   e = d/|d|,
///
/// of which c, G, H and a are fitted to the good beads around, softened within two bead sigmas. A right bead at an
/// adhesion has an a of some pixels; a false partner has a = 0, or less if it stays behind where the others are pulled.
/// Asked are beads that contradict their neighbours, and beads of groups that no way of small steps connects with most
/// of the picture: those agree with one another, and so only the beads beyond the group are witnesses. A bead is
/// flagged if U is above `threshold` standard deviations and a = 0 is likelier than the radius of what a lens shows, a
/// bead's.
/// @param scatter_px  of single beads beyond their own errors
/// @return how many
int flag_unpulled(const Scene& scene, double threshold, const std::vector<char>& is_contradicted, double scatter_px,
                  std::vector<Track>& tracks);

}  // namespace mbtfm::beads
