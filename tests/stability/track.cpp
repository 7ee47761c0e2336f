#include "mbtfm/tractions/field_of_adhesions.h"
#include "pipeline/contract/errors.h"
#include "pipeline/stage/parameters.h"
#include "segment/beads/given_field.h"
#include "tests/support/hard_case.h"
#include "tests/support/tracked_cell.h"

namespace mbtfm::beads {
namespace {

/// Share of the good beads that are more than `limit` px off.
double share_wrong(const Tracking& tracking, const std::vector<test::Peak>& peaks, double limit) {
  int n_wrong = 0;
  for (const Bead& bead : tracking.field) {
    const Vec2 truth = test::displacement(peaks, bead.position_um - Vec2{0.5, 0.5});
    if (bead.flag.empty() && norm(bead.displacement_um - truth) > limit) ++n_wrong;
  }
  return n_wrong / std::max(1.0, static_cast<double>(tracking.n_good));
}

/// Whether a bead went where none of those around went, one of which it is.
bool is_stranger(Vec2 displacement, const std::vector<int>& around, const test::BeadPair& pair) {
  return std::none_of(around.begin(), around.end(),
                      [&](int k) { return norm(displacement - pair.displacements[k]) < 1; });
}

TEST(TrackStability, lost_beads_uneven_light_and_another_exposure_cost_beads_but_not_trust) {
  const auto peaks = test::ring_of_adhesions(384, 6);
  const auto pair = test::draw_bead_pair(
      peaks, {.width = 384, .n_beads = 2950, .lost = 0.05, .uneven_light = 0.5, .gain = 0.7, .offset = 200, .seed = 4});
  const Tracking tracking = track_beads(pair.relaxed, pair.stressed, 1.0, test::in_relaxed_frame(), 2);
  // one bead in ten has lost its partner, and crowded as they are (one in two touches another) its neighbours suffer
  EXPECT_GE(tracking.n_good, 0.8 * static_cast<double>(tracking.field.size()));
  EXPECT_LE(share_wrong(tracking, peaks, 1.0), 0.01);
  test::came_out(std::to_string(tracking.n_good) + " of " + std::to_string(tracking.field.size()) + " tracked, " +
                 test::two_digits(100 * share_wrong(tracking, peaks, 1.0)) + " % wrong");
}

/// Loose beads: each takes a step of its own, so that most windows hold beads that moved otherwise.
TEST(TrackStability, loose_beads_are_followed_and_their_steps_are_in_the_standard_errors) {
  const auto peaks = test::ring_of_adhesions(384, 6);
  constexpr double kStep = 0.6;  // px
  double squares = 0, n = 0, n_beads = 0, n_wrong = 0;
  for (const std::uint64_t seed : {101u, 102u}) {
    const auto pair = test::draw_bead_pair(peaks, {.width = 384, .n_beads = 1500, .jitter = kStep, .seed = seed});
    const Tracking tracking = track_beads(pair.relaxed, pair.stressed, 1.0, test::in_relaxed_frame(), 2);
    n_beads += static_cast<double>(tracking.field.size());
    const Neighbours truth(pair.positions, 8);
    for (const Bead& bead : tracking.field) {
      const Vec2 place = bead.position_um - Vec2{0.5, 0.5};
      const auto around = truth.within(place, 2, 3);
      if (!bead.flag.empty() || around.empty()) continue;
      const Vec2 error = bead.displacement_um - test::displacement(peaks, place);
      squares += 0.5 * dot(error, error) / (bead.sigma_um * bead.sigma_um);
      ++n;
      n_wrong += is_stranger(bead.displacement_um, around, pair);
    }
  }
  EXPECT_GE(n, 0.93 * n_beads);
  EXPECT_LE(n_wrong, 0.01 * n);
  test::came_out(test::two_digits(100 * n / n_beads) + " % followed, " + test::two_digits(100 * n_wrong / n) +
                 " % wrong, " + test::two_digits(squares / n));
  EXPECT_GE(squares / n, 0.7);
  EXPECT_LE(squares / n, 1.4);
}

struct InPeaks {
  double n = 0, n_right = 0, n_wrong = 0;  ///< beads that the field moves by 5 px and more
};

/// Beads that step on their own, under adhesions that pull them by many spacings.
InPeaks followed_in_peaks(const std::vector<test::Peak>& peaks, const FieldModel& model) {
  InPeaks counts;
  for (const std::uint64_t seed : {101u, 102u, 103u}) {
    const auto pair = test::draw_bead_pair(
        peaks, {.width = 384, .n_beads = 1500, .brightness_spread = 0.25, .jitter = 0.9, .lost = 0.015, .seed = seed});
    const Tracking tracking = RelaxedBeads(pair.relaxed, {}, 2, model).track(pair.stressed, 1.0);
    const Neighbours truth(pair.positions, 8);
    for (const Bead& bead : tracking.field) {
      const Vec2 place = bead.position_um - Vec2{0.5, 0.5};
      const auto around = truth.within(place, 2, 3);
      if (around.empty() || norm(test::displacement(peaks, place)) < 5) continue;
      ++counts.n;
      if (!bead.flag.empty()) continue;
      ++(is_stranger(bead.displacement_um, around, pair) ? counts.n_wrong : counts.n_right);
    }
  }
  return counts;
}

std::string told(const InPeaks& counts) {
  return test::two_digits(100 * counts.n_right / counts.n) + " % found, " +
         test::two_digits(100 * counts.n_wrong / counts.n) + " % wrong";
}

/// Where a peak falls by half within a bead distance no two loose beads move alike, and windows lose them.
TEST(TrackStability, loose_beads_in_steep_peaks_are_found) {
  const InPeaks counts = followed_in_peaks(test::ring_of_adhesions(384, 12), {});
  // windows alone find two thirds; a share of a hundred beads is good to 0.04
  EXPECT_GE(counts.n_right, 0.75 * counts.n);
  EXPECT_LE(counts.n_wrong, 0.1 * (counts.n_right + counts.n_wrong));
  test::came_out(told(counts));
}

/// Discs; those of twice the peaks' radius move as far.
std::vector<Adhesion> adhesions_at(const std::vector<test::Peak>& peaks, Vec2 shifted_by, double by_radius) {
  std::vector<Adhesion> adhesions;
  for (const test::Peak& peak : peaks) {
    const double radius_um = by_radius * peak.radius;
    adhesions.push_back({.adhesion_id = static_cast<int>(adhesions.size()) + 1,
                         .position_um = peak.centre + shifted_by,
                         .area_um2 = std::numbers::pi * radius_um * radius_um,
                         .major_axis_um = 2 * radius_um,
                         .minor_axis_um = 2 * radius_um});
  }
  return adhesions;
}

FieldModel model_with(const std::vector<Adhesion>& adhesions) {
  const auto field = std::make_shared<tractions::FieldOfAdhesions>(adhesions, 2);
  return [field](const DisplacementField& beads) { return field->um(beads); };
}

/// Of a simulated cell: what is found of beads that move by 5 px and more.
test::Peaks followed_in_cell(std::uint64_t seed, bool adhesions_are_known) {
  drawing::ScenarioParameters p;
  stage::ParameterList list;
  declare(list, p);
  stage::read_toml(list, drawing::scenario_file("u2os"));
  p.noise = 0.07;
  p.seed = seed;
  const test::CellPair pair = test::drawn_pair(p, 2);
  const FieldModel model = adhesions_are_known ? model_with(pair.experiment.cell.adhesions) : FieldModel{};
  const Tracking tracking = RelaxedBeads(pair.relaxed, {}, 2, model).track(pair.stressed, p.microscope.pixel_size_um);
  return test::counted(tracking, pair, p.microscope).peaks;
}

TEST(TrackStability, adhesions_show_which_loose_bead_is_which) {
  const test::Peaks alone = followed_in_cell(1, false), guided = followed_in_cell(1, true);
  EXPECT_LE(guided.n - guided.n_right, 0.75 * (alone.n - alone.n_right));
  EXPECT_LE(guided.n_wrong, alone.n_wrong);
  test::came_out(std::to_string(guided.n_right) + " found and " + std::to_string(guided.n_wrong) + " wrong of " +
                 std::to_string(guided.n) + "; without adhesions " + std::to_string(alone.n_right) + " and " +
                 std::to_string(alone.n_wrong));
}

/// A bead comes to rest where the next one lay: windows take one for the other, and both bear each other out.
TEST(TrackStability, beads_that_took_each_others_places_are_exchanged_beside_adhesions) {
  int n = 0, n_right = 0, n_wrong = 0;
  for (const std::uint64_t seed : {44u, 49u}) {
    const test::Peaks peaks = followed_in_cell(seed, true);
    n += peaks.n, n_right += peaks.n_right, n_wrong += peaks.n_wrong;
  }
  EXPECT_LE(n_wrong, 1);
  EXPECT_GE(n_right, 0.75 * n);
  test::came_out(std::to_string(n_right) + " found and " + std::to_string(n_wrong) + " wrong of " + std::to_string(n));
}

TEST(TrackStability, adhesions_of_the_wrong_size_or_place_cost_few_beads) {
  const auto peaks = test::ring_of_adhesions(384, 12);
  const InPeaks alone = followed_in_peaks(peaks, {});
  for (const auto& [name, adhesions] : {std::pair("right", adhesions_at(peaks, {0.5, 0.5}, 2)),
                                        std::pair("half as wide", adhesions_at(peaks, {0.5, 0.5}, 1)),
                                        std::pair("elsewhere", adhesions_at(peaks, {30, -20}, 2))}) {
    const InPeaks guided = followed_in_peaks(peaks, model_with(adhesions));
    EXPECT_GE(guided.n_right, alone.n_right - 0.05 * alone.n) << name << ": " << told(guided);
    EXPECT_LE(guided.n_wrong, alone.n_wrong + 0.05 * alone.n) << name << ": " << told(guided);
  }
}

/// Good beads that went where none did.
int n_wrong(const Tracking& tracking, const test::BeadPair& pair) {
  const Neighbours truth(pair.positions, 8);
  return static_cast<int>(std::count_if(tracking.field.begin(), tracking.field.end(), [&](const Bead& bead) {
    const auto around = truth.within(bead.position_um - Vec2{0.5, 0.5}, 2, 3);
    return bead.flag.empty() && is_stranger(bead.displacement_um + tracking.common.drift_um, around, pair);
  }));
}

/// The wide window then finds one in six: its neighbours are elsewhere.
TEST(TrackStability, sparse_beads_that_scatter_by_many_widths_are_matched) {
  const auto peaks = test::ring_of_adhesions(384, 6);
  double n_good = 0, n_beads = 0, n_strangers = 0;
  for (const std::uint64_t seed : {101u, 102u, 103u}) {
    const auto pair = test::draw_bead_pair(
        peaks, {.width = 384, .n_beads = 300, .brightness_spread = 0.25, .jitter = 5, .lost = 0.015, .seed = seed});
    const Tracking tracking = track_beads(pair.relaxed, pair.stressed, 1.0, test::in_relaxed_frame(), 2);
    n_good += tracking.n_good;
    n_beads += static_cast<double>(tracking.field.size());
    n_strangers += n_wrong(tracking, pair);
  }
  // a share of eight hundred beads is good to 0.015
  EXPECT_GE(n_good, 0.75 * n_beads);
  EXPECT_LE(n_strangers, 0.1 * n_good);
  test::came_out(test::two_digits(100 * n_good / n_beads) + " % found, " +
                 test::two_digits(100 * n_strangers / n_good) + " % of them wrong");
}

TEST(TrackStability, a_bead_that_vanished_is_not_matched_with_a_stranger_far_away) {
  const auto peaks = test::ring_of_adhesions(256, 4);
  int n_vanished = 0, n_matched = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const auto pair = test::draw_bead_pair(
        peaks, {.width = 256, .n_beads = 150, .brightness_spread = 0.25, .jitter = 0.6, .lost = 0.2, .seed = seed});
    const Tracking tracking = track_beads(pair.relaxed, pair.stressed, 1.0, test::in_relaxed_frame(), 2);
    const Neighbours truth(pair.positions, 8);
    for (const Bead& bead : tracking.field) {
      if (!truth.within(bead.position_um - Vec2{0.5, 0.5}, 2, 1).empty()) continue;
      ++n_vanished;
      n_matched += bead.flag.empty();
    }
  }
  ASSERT_GE(n_vanished, 100);
  EXPECT_LE(n_matched, 0.1 * n_vanished);
  test::came_out(std::to_string(n_vanished - n_matched) + " of " + std::to_string(n_vanished));
}

/// Where beads scatter so, many registrations run off; one that did once asked for more memory than there is.
TEST(TrackStability, beads_that_are_lost_stay_in_the_picture) {
  constexpr double kSide = 400, kDistance = 5;
  const auto peaks = test::ring_of_adhesions(kSide, 6);
  const auto pair = test::draw_bead_pair(peaks, {.width = static_cast<int>(kSide),
                                                 .n_beads = static_cast<int>(std::pow(kSide / kDistance, 2)),
                                                 .bead_sigma = 1.0,
                                                 .brightness_spread = 0.25,
                                                 .jitter = 0.4 * kDistance,
                                                 .lost = 0.03,
                                                 .seed = 7});
  for (const Bead& bead : track_beads(pair.relaxed, pair.stressed, 1.0, test::in_relaxed_frame(), 2).field) {
    const Vec2 from_middle = bead.position_um + bead.displacement_um - Vec2{0.5 * kSide, 0.5 * kSide};
    EXPECT_LE(std::max(std::abs(from_middle.x), std::abs(from_middle.y)), 0.5 * kSide + 64);
  }
}

TEST(TrackStability, faint_beads_are_tracked_with_larger_errors) {
  const auto peaks = test::ring_of_adhesions(256, 2);
  const auto bright = test::draw_bead_pair(peaks, {.width = 256, .n_beads = 700});
  const auto faint = test::draw_bead_pair(peaks, {.width = 256, .n_beads = 700, .brightness = 150});
  const auto mean_sigma = [](const Tracking& tracking) {
    double sum = 0;
    for (const Bead& bead : tracking.field) sum += bead.flag.empty() ? bead.sigma_um : 0;
    return sum / tracking.n_good;
  };
  const Tracking of_bright = track_beads(bright.relaxed, bright.stressed, 1.0, {}, 2);
  const Tracking of_faint = track_beads(faint.relaxed, faint.stressed, 1.0, {}, 2);
  EXPECT_GT(mean_sigma(of_faint), 1.5 * mean_sigma(of_bright));
  test::came_out(test::two_digits(mean_sigma(of_faint) / mean_sigma(of_bright)) + " times as large");
  EXPECT_LE(share_wrong(of_faint, peaks, 1.0), 0.01);
}

std::string what_is_wrong(const images::Image& relaxed, const images::Image& stressed,
                          const TrackParameters& parameters = {}) {
  const auto error = test::caught<InvalidData>([&] { track_beads(relaxed, stressed, 1.0, parameters); });
  return error ? error->what() : "nothing";
}

TEST(TrackStability, images_without_beads_are_refused) {
  const auto pair = test::draw_bead_pair({}, {.width = 128, .n_beads = 300});
  const auto noise = test::draw_bead_pair({}, {.width = 128, .n_beads = 0});
  images::Image constant = pair.relaxed;
  std::fill(constant.pixels.begin(), constant.pixels.end(), 7.0f);
  const std::string relaxed = "the relaxed image: expected bright beads on a darker ground, found none";
  const std::string stressed = "the stressed image: expected bright beads on a darker ground, found none";
  EXPECT_EQ(what_is_wrong(constant, pair.stressed), relaxed);
  EXPECT_EQ(what_is_wrong(pair.relaxed, constant), stressed);
  EXPECT_EQ(what_is_wrong(constant, constant), relaxed);
  EXPECT_EQ(what_is_wrong(noise.relaxed, noise.stressed), relaxed);
  // where nothing stands out of the noise no remedy is tried, each of which takes as long as tracking does
  const auto error = test::caught<NotFollowed>([&] { track_beads(pair.relaxed, noise.stressed, 1.0, {}); });
  ASSERT_TRUE(error);
  EXPECT_EQ(error->what(), stressed);
  EXPECT_FALSE(error->remedy);
}

TEST(TrackStability, pictures_of_different_beads_or_turned_against_each_other_give_no_field) {
  const auto one = test::draw_bead_pair({}, {.width = 256, .n_beads = 1000, .turn_rad = 0.17, .seed = 1});
  const auto other = test::draw_bead_pair({}, {.width = 256, .n_beads = 1000, .seed = 2});
  const std::string refused = "the stressed image: expected the beads of the relaxed image, displaced, found ";
  EXPECT_EQ(what_is_wrong(one.relaxed, other.stressed).substr(0, refused.size()), refused);
  EXPECT_NE(what_is_wrong(one.relaxed, one.stressed), "nothing");
  const auto little = test::draw_bead_pair({}, {.width = 256, .n_beads = 1000, .turn_rad = 0.02, .seed = 1});
  EXPECT_TRUE(
      has_words(what_is_wrong(little.relaxed, little.stressed), "(effects.drift_affine = off), found a turn of 1.1"));
  TrackParameters parameters;
  parameters.drift_affine = Switch::on;
  EXPECT_EQ(what_is_wrong(one.relaxed, other.stressed, parameters).substr(0, refused.size()), refused);
  EXPECT_EQ(what_is_wrong(one.relaxed, one.stressed, parameters), "nothing");
}

TEST(TrackStability, few_beads_of_another_place_are_not_taken_for_the_same) {
  int n_refused = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const auto one = test::draw_bead_pair({}, {.width = 80, .n_beads = 24, .bead_sigma = 2.1, .seed = seed});
    const auto other = test::draw_bead_pair({}, {.width = 80, .n_beads = 24, .bead_sigma = 2.1, .seed = 100 + seed});
    try {
      const Tracking tracking = track_beads(one.relaxed, other.stressed, 1.0);
      EXPECT_GE(tracking.n_good, 0.2 * static_cast<double>(tracking.field.size())) << "seed " << seed;
    } catch (const InvalidData&) {
      ++n_refused;
    }
  }
  test::came_out(std::to_string(n_refused) + " of 30 refused");
}

TEST(TrackStability, one_bead_and_a_pixel_without_a_number_are_refused) {
  const auto pair = test::draw_bead_pair({}, {.width = 128, .n_beads = 300});
  images::Image one = test::draw_bead_pair({}, {.width = 128, .n_beads = 0}).relaxed;
  test::add_bead(one, {60.3, 50.8}, 3000, 1.3);
  EXPECT_NE(what_is_wrong(pair.relaxed, one), "nothing");
  EXPECT_NE(what_is_wrong(one, one), "nothing");
  images::Image broken = pair.stressed;
  broken.at(6, 11) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(what_is_wrong(pair.relaxed, broken),
            "the stressed image: expected a number in every pixel, found none at column 7, row 12");
}

TEST(TrackStability, exchanged_images_are_refused_unless_a_cell_may_push) {
  const auto peaks = test::ring_of_adhesions(384, 6);
  const auto pair = test::draw_bead_pair(peaks, {.width = 384, .n_beads = 2950});
  EXPECT_EQ(what_is_wrong(pair.relaxed, pair.stressed), "nothing");
  EXPECT_TRUE(has_words(what_is_wrong(pair.stressed, pair.relaxed), "exchanged"));
  TrackParameters parameters;
  parameters.may_push = true;
  EXPECT_GT(outwardness(track_beads(pair.stressed, pair.relaxed, 1.0, parameters, 2).field), 0.5);
}

images::Image cropped(const images::Image& image, int left, int top, int width, int height) {
  images::Image result = image;
  result.width = width, result.height = height;
  result.pixels.clear();
  for (int j = top; j < top + height; ++j)
    for (int i = left; i < left + width; ++i) result.pixels.push_back(image.at(i, j));
  return result;
}

/// What a picture shows of a cell that its border cuts may point anywhere: no word of exchanged images either way
/// round, and none of growth alone.
TEST(TrackStability, a_cell_that_the_border_cuts_is_never_called_exchanged) {
  const auto peaks = test::ring_of_adhesions(512, 8);
  const auto pair = test::draw_bead_pair(peaks, {.width = 512, .n_beads = 5242});
  for (const auto& [left, top, width, height] :
       {std::array{256, 0, 256, 512}, {256, 256, 256, 256}, {140, 300, 230, 212}}) {
    SCOPED_TRACE(left);
    const images::Image relaxed = cropped(pair.relaxed, left, top, width, height);
    const images::Image stressed = cropped(pair.stressed, left, top, width, height);
    EXPECT_EQ(what_is_wrong(relaxed, stressed), "nothing");
    EXPECT_EQ(what_is_wrong(stressed, relaxed), "nothing");
  }
  const auto grown = test::draw_bead_pair({}, {.width = 384, .n_beads = 2950, .growth = 0.002});
  EXPECT_EQ(what_is_wrong(grown.relaxed, grown.stressed), "nothing");
  EXPECT_EQ(what_is_wrong(grown.stressed, grown.relaxed), "nothing");
}

TEST(TrackStability, images_of_different_sizes_are_refused) {
  const auto pair = test::draw_bead_pair({}, {.width = 128, .n_beads = 300});
  const auto other = test::draw_bead_pair({}, {.width = 96, .n_beads = 170});
  EXPECT_EQ(what_is_wrong(pair.relaxed, other.stressed),
            "the stressed image: expected the relaxed image's 128 x 128 pixels, found 96 x 96");
}

}  // namespace
}  // namespace mbtfm::beads
