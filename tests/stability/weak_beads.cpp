/// Bead images that single beads cannot be followed in, and two of unequal focus.
#include "tests/support/weak_beads.h"
#include "tests/support/hard_case.h"

namespace mbtfm::beads {
namespace {

TrackParameters by(TrackMethod method) {
  TrackParameters parameters = test::in_relaxed_frame();
  parameters.method = method;
  return parameters;
}

/// Wider than the windows: narrower ones no window shows.
std::vector<test::Peak> wide_adhesions() {
  auto peaks = test::ring_of_adhesions(512, 2);
  for (test::Peak& peak : peaks) peak.radius *= 4;
  return peaks;
}

/// Mean square of the errors of good places over their variances; 1 where sigma is right.
double squared_over_variance(const Tracking& tracking, const std::vector<test::Peak>& peaks, Vec2 drift) {
  double sum = 0;
  for (const Bead& place : tracking.field) {
    if (!place.flag.empty()) continue;
    const Vec2 error = place.displacement_um + tracking.common.drift_um - drift -
                       test::displacement(peaks, place.position_um - Vec2{0.5, 0.5});
    sum += 0.5 * dot(error, error) / (place.sigma_um * place.sigma_um);
  }
  return sum / tracking.n_good;
}

TEST(WeakBeads, windows_follow_dense_weak_and_mottled_beads_and_their_standard_errors_hold) {
  const auto peaks = wide_adhesions();
  const Vec2 drift{1.7, -0.6};
  struct Case {
    const char* name;
    test::BeadScene scene;
    test::Weakness weakness;
  };
  const Case cases[] = {{"dense", {.n_beads = 20000}, {}},
                        {"weak, few grey levels", {.brightness = 25}, {.levels = 40}},
                        {"mottled", {.brightness = 60}, {.mottle = 30, .levels = 60}}};
  std::string out;
  for (Case c : cases) {
    double sum = 0;
    constexpr int kSeeds = 2;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      SCOPED_TRACE(std::string(c.name) + ", seed " + std::to_string(seed));
      c.scene.drift = drift;
      c.scene.seed = seed;
      const auto pair = test::weakened(test::draw_bead_pair(peaks, c.scene), c.weakness, seed);
      const Tracking tracking = track_beads(pair.relaxed, pair.stressed, 1.0, by(TrackMethod::correlation), 2);
      EXPECT_TRUE(tracking.windows.is_on);
      EXPECT_GE(tracking.n_good, 2.0 / 3 * static_cast<double>(tracking.field.size()));
      sum += squared_over_variance(tracking, peaks, drift) / kSeeds;
    }
    out += (out.empty() ? "" : "; ") + std::string(c.name) + " " + test::two_digits(std::sqrt(sum));
    EXPECT_GE(std::sqrt(sum), 0.8) << c.name;
    EXPECT_LE(std::sqrt(sum), 1.3) << c.name;
  }
  test::came_out(out);
}

TEST(WeakBeads, are_followed_by_windows_of_themselves_and_strong_ones_are_not) {
  const auto peaks = wide_adhesions();
  const auto strong = test::draw_bead_pair(peaks, {.seed = 1});
  const Tracking by_beads = track_beads(strong.relaxed, strong.stressed, 1.0, by(TrackMethod::automatic), 2);
  EXPECT_FALSE(by_beads.windows.is_on);
  EXPECT_EQ(by_beads.window_um, 0);
  const auto weak = test::weakened(test::draw_bead_pair(peaks, {.brightness = 25, .seed = 1}), {.levels = 40}, 1);
  EXPECT_THROW(track_beads(weak.relaxed, weak.stressed, 1.0, by(TrackMethod::beads), 2), NotFollowed);
  const Tracking by_windows = track_beads(weak.relaxed, weak.stressed, 1.0, by(TrackMethod::automatic), 2);
  EXPECT_TRUE(by_windows.windows.is_on);
  EXPECT_GT(by_windows.window_um, 0);
  EXPECT_TRUE(has_words(by_windows.windows.why, "single beads cannot be followed"));
}

TEST(WeakBeads, in_a_part_of_the_image_are_followed_by_windows_beside_the_strong_ones) {
  const auto peaks = wide_adhesions();
  constexpr int kWeak_px = 200;
  const auto strong = test::draw_bead_pair(peaks, {.seed = 3});
  const auto weak = test::draw_bead_pair(peaks, {.brightness = 25, .seed = 4});
  auto mixed = strong;
  for (const auto& [into, from] :
       {std::pair(&mixed.relaxed, &weak.relaxed), std::pair(&mixed.stressed, &weak.stressed)}) {
    for (int j = 0; j < into->height; ++j)
      for (int i = 0; i < kWeak_px; ++i) into->at(i, j) = from->at(i, j);
  }
  const auto followed = [&](TrackMethod method) {
    return track_beads(mixed.relaxed, mixed.stressed, 1.0, by(method), 2);
  };
  const auto good_at_left = [&](const Tracking& tracking) {
    return std::ranges::count_if(tracking.field,
                                 [&](const Bead& b) { return b.flag.empty() && b.position_um.x < kWeak_px - 20; });
  };
  const Tracking beads = followed(TrackMethod::beads), both = followed(TrackMethod::automatic);
  EXPECT_EQ(beads.n_windows, 0);
  EXPECT_FALSE(both.windows.is_on);
  ASSERT_GT(both.n_windows, 20);
  EXPECT_GT(good_at_left(both), 2 * good_at_left(beads) + 20);
  EXPECT_NEAR(both.share_of_gaps, kWeak_px / 512.0, 0.15);
  Tracking windows = both;
  windows.field.erase(windows.field.begin(), windows.field.end() - both.n_windows);
  windows.n_good = both.n_windows;
  const double ratio = std::sqrt(squared_over_variance(windows, peaks, {}));
  test::came_out(std::to_string(both.n_windows) + " windows, " + test::two_digits(ratio));
  EXPECT_GE(ratio, 0.8);
  EXPECT_LE(ratio, 1.3);
  EXPECT_EQ(track_beads(strong.relaxed, strong.stressed, 1.0, by(TrackMethod::automatic), 2).n_windows, 0);
}

TEST(WeakBeads, the_hint_of_what_cannot_be_followed_names_what_helps) {
  const auto other = test::draw_bead_pair({}, {.width = 256, .n_beads = 1000, .seed = 2});
  const auto one = test::draw_bead_pair({}, {.width = 256, .n_beads = 1000, .seed = 1});
  const auto weak =
      test::weakened(test::draw_bead_pair(wide_adhesions(), {.brightness = 25, .seed = 1}), {.levels = 40}, 1);
  const auto hint = [&](const images::Image& relaxed, const images::Image& stressed) -> std::string {
    const auto error =
        test::caught<NotFollowed>([&] { track_beads(relaxed, stressed, 1.0, by(TrackMethod::beads), 2); });
    return error ? error->remedy.value_or("none was tried") : "found";
  };
  EXPECT_EQ(hint(weak.relaxed, weak.stressed).substr(0, 19), "track.method = auto");
  EXPECT_EQ(hint(one.relaxed, other.stressed), "");
}

TEST(Focus, of_twenty_sound_pairs_is_never_called_different) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto pair =
        test::draw_bead_pair(test::ring_of_adhesions(192, 4), {.width = 192, .n_beads = 500, .seed = seed});
    const Tracking tracking = track_beads(pair.relaxed, pair.stressed, 1.0, by(TrackMethod::beads), 2);
    EXPECT_NEAR(tracking.sizes.ratio, 1, 0.05) << "seed " << seed;  // a tenth of what the finding asks
    EXPECT_LT(tracking.sizes.elongation - 1, 0.02 + 3 * tracking.sizes.elongation_sigma) << "seed " << seed;
  }
}

TEST(Focus, of_equal_images_is_equal_and_a_blurred_one_is_found) {
  const auto peaks = test::ring_of_adhesions(384, 6);
  for (const double blur : {1.0, 1.5})
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      SCOPED_TRACE(seed);
      const auto pair = test::draw_bead_pair(peaks, {.width = 384, .n_beads = 1500, .defocus = blur, .seed = seed});
      const Tracking tracking = track_beads(pair.relaxed, pair.stressed, 1.0, by(TrackMethod::beads), 2);
      // neighbours in the wider window take a quarter of the difference away at most
      EXPECT_NEAR(tracking.sizes.ratio, blur, 0.25 * (blur - 1) + 5 * tracking.sizes.sigma);
      EXPECT_LT(tracking.sizes.sigma, 0.02);
    }
}

TEST(Ghosts, of_a_mixed_picture_have_the_share_that_was_mixed_and_sound_pictures_have_none) {
  const auto peaks = test::ring_of_adhesions(384, 6);
  for (const double drift : {0.0, 3.0}) {
    for (const float share : {0.0f, 0.2f}) {
      for (const bool is_relaxed : {true, false}) {
        SCOPED_TRACE(testing::Message() << drift << " px, " << share << (is_relaxed ? " relaxed" : " stressed"));
        auto pair = test::draw_bead_pair(
            peaks, {.width = 384, .n_beads = 1500, .bead_aspect = 1.2, .drift = {drift, 0}, .seed = 4});
        images::Image& mixed = is_relaxed ? pair.relaxed : pair.stressed;
        const images::Image& other = is_relaxed ? pair.stressed : pair.relaxed;
        for (std::size_t k = 0; k < mixed.pixels.size(); ++k)
          mixed.pixels[k] = (1 - share) * mixed.pixels[k] + share * other.pixels[k];
        const Ghosts found = track_beads(pair.relaxed, pair.stressed, 1.0, by(TrackMethod::beads), 2).ghosts;
        // a ghost that touches its bead shortens the step between both by its share, so that it reads larger
        EXPECT_NEAR(found.share, share, 0.02 + share * share + 4 * found.sigma);
        EXPECT_LT(found.sigma, 0.02);
        if (share > 0) EXPECT_EQ(found.is_relaxed, is_relaxed);
      }
    }
  }
}

TEST(Focus, beads_that_are_not_round_are_measured) {
  const auto peaks = test::ring_of_adhesions(384, 6);
  for (const double aspect : {1 / 1.2, 1 / 1.1, 1.1, 1.2}) {
    SCOPED_TRACE(aspect);
    const auto pair = test::draw_bead_pair(peaks, {.width = 384, .n_beads = 1500, .bead_aspect = aspect, .seed = 4});
    const BeadSizes sizes = track_beads(pair.relaxed, pair.stressed, 1.0, by(TrackMethod::beads), 2).sizes;
    const double longer = std::max(aspect, 1 / aspect);
    EXPECT_NEAR(sizes.elongation, longer, 0.2 * (longer - 1) + 3 * sizes.elongation_sigma);
    EXPECT_LT(sizes.elongation_sigma, 0.02);
    const double direction = aspect > 1 ? 0.5 * std::numbers::pi : 0;
    EXPECT_NEAR(std::abs(std::sin(sizes.angle_rad - direction)), 0, 0.087);
    EXPECT_TRUE(sizes.is_of_pixels);
  }
}

}  // namespace
}  // namespace mbtfm::beads
