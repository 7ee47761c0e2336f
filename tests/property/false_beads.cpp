/// Beads that were given another one's partner, without pictures: tracks on a surface that is pulled.
#include "segment/beads/measure.h"
#include "tests/support/bead_pair.h"

namespace mbtfm::beads {
namespace {

constexpr double kNoise = 0.2;  // px

struct Field {
  Scene scene;
  std::vector<Track> tracks;
};

/// Beads 11 px apart, as 0.8 of them on a um² at 0.1 um by pixel, that follow these peaks, each with noise of its own.
/// @param places  where there is a bead, too
Field followed(const std::vector<test::Peak>& peaks, std::uint64_t seed, const std::vector<Vec2>& places = {}) {
  constexpr int kWidth = 400, kBeads = 1300;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0, kWidth);
  std::normal_distribution<double> noise(0, kNoise);
  Side side;
  side.bead_sigma = 1.5;
  side.spacing = kWidth / std::sqrt(1.0 * kBeads);
  side.positions = places;
  while (side.positions.size() < kBeads) {
    const double x = place(random);
    side.positions.push_back({x, place(random)});
  }
  for (const Vec2 at : side.positions) side.beads.push_back({at, 1});
  side.neighbours = Neighbours(side.positions, side.spacing);
  side.around = beads_around(side, 1);
  Field field;
  for (const Vec2 at : side.positions) {
    Track track;
    const double x = noise(random);
    track.found.motion.u = test::displacement(peaks, at) + Vec2{x, noise(random)};
    track.found.sigma_px = kNoise;
    track.flag = TrackFlag::none;
    field.tracks.push_back(track);
  }
  field.scene.relaxed = std::make_shared<const Side>(std::move(side));
  return field;
}

int n_flagged(Field& field) {
  const int before = n_good(field.tracks);
  pooled(field.scene, 4, field.tracks);
  return before - n_good(field.tracks);
}

TEST(FalseBeads, a_bead_that_moves_alone_is_flagged_and_one_that_an_adhesion_pulls_is_not) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    const Vec2 adhesion{120, 200}, alone{280, 200};
    Field field = followed({{adhesion, {6, 0}, 3}}, seed, {adhesion, alone});
    field.tracks[1].found.motion.u += {0, 6};
    EXPECT_EQ(n_flagged(field), 1) << seed;
    EXPECT_EQ(field.tracks[0].flag, TrackFlag::none) << seed;
    EXPECT_EQ(field.tracks[1].flag, TrackFlag::neighbours_disagree) << seed;
  }
}

TEST(FalseBeads, a_group_whose_surroundings_do_not_stretch_towards_it_is_flagged_and_one_that_is_pulled_is_not) {
  for (const std::uint64_t seed : {5, 6, 7}) {
    const Vec2 pulled{100, 200}, alone{300, 200};
    Field field = followed({{pulled, {30, 0}, 25}}, seed);
    std::vector<int> group = field.scene.relaxed->neighbours.within(alone, 100, 10);
    for (const int k : group) field.tracks[k].found.motion.u += {30, 10};
    EXPECT_EQ(n_flagged(field), 10) << seed;
    for (const int k : group) EXPECT_EQ(field.tracks[k].flag, TrackFlag::neighbours_disagree) << seed;
  }
}

}  // namespace
}  // namespace mbtfm::beads
