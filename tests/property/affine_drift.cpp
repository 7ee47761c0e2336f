/// Whether the tracker takes turn, growth and shear off is decided by the pictures.
#include "tests/support/bead_pair.h"

namespace mbtfm::beads {
namespace {

const std::vector<test::Peak> kCell = test::ring_of_adhesions(384, 6);

Tracking tracked(double turn_rad, std::uint64_t seed, Switch drift = Switch::automatic) {
  const auto pair = test::draw_bead_pair(
      kCell, {.width = 384, .n_beads = 2950, .turn_rad = turn_rad, .drift = {2, -1}, .seed = seed});
  TrackParameters parameters;
  parameters.drift_affine = drift;
  return track_beads(pair.relaxed, pair.stressed, 0.1, parameters, 2);
}

TEST(AffineDrift, is_taken_off_where_the_border_is_turned) {
  for (const double turn_rad : {-0.002, 0.17}) {
    const Tracking tracking = tracked(turn_rad, 3);
    EXPECT_TRUE(tracking.affine.is_on) << turn_rad << ": " << tracking.affine.why;
    EXPECT_NEAR(tracking.common.turn_rad, turn_rad, 4 * tracking.common.turn_sigma_rad);
    EXPECT_LT(tracking.common.turn_sigma_rad, 5e-4);
  }
}

TEST(AffineDrift, is_left_where_nothing_is_turned) {
  for (const std::uint64_t seed : {1, 2}) {
    const Tracking tracking = tracked(0, seed);
    EXPECT_FALSE(tracking.affine.is_on) << seed << ": " << tracking.affine.why;
  }
}

/// Some 30 beads that are turned by more than a small angle: no turn stands out of their correlation. In the first
/// picture the turn was taken off, in the second nothing was and the angle is chance.
TEST(AffineDrift, a_field_that_was_found_is_kept_where_turning_back_fails) {
  for (const auto& [peak_px, seed] : {std::pair(0.0, 1), std::pair(3.0, 2)}) {
    const auto peaks = peak_px > 0 ? test::ring_of_adhesions(96, peak_px) : std::vector<test::Peak>{};
    const auto pair = test::draw_bead_pair(
        peaks, {.width = 96, .n_beads = 30, .turn_rad = 0.0105, .seed = static_cast<std::uint64_t>(seed)});
    TrackParameters parameters;
    parameters.method = TrackMethod::beads;
    parameters.drift_affine = Switch::on;
    EXPECT_THROW(track_beads(pair.relaxed, pair.stressed, 0.1, parameters), NotFollowed);
    parameters.drift_affine = Switch::automatic;
    const Tracking tracking = track_beads(pair.relaxed, pair.stressed, 0.1, parameters);
    EXPECT_GT(std::abs(tracking.common.turn_rad), 0.01);
    EXPECT_EQ(tracking.affine.is_on, peak_px == 0);
  }
}

TEST(AffineDrift, the_question_changes_nothing_where_the_answer_is_no) {
  const DisplacementField asked = tracked(0, 1).field, not_asked = tracked(0, 1, Switch::off).field;
  ASSERT_EQ(asked.size(), not_asked.size());
  for (std::size_t i = 0; i < asked.size(); ++i) {
    // one least squares, another column beside it: rounding of sums of some thousand terms
    EXPECT_NEAR(norm(asked[i].displacement_um - not_asked[i].displacement_um), 0, 1e-10);
    EXPECT_EQ(asked[i].flag, not_asked[i].flag);
  }
}

}  // namespace
}  // namespace mbtfm::beads
