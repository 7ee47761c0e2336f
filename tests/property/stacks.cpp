/// Laws of following beads in space.
#include "pipeline/numerics/near.h"
#include "pipeline/numerics/order_statistics.h"
#include "segment/beads/track.h"
#include "segment/stacks/mean_by_depth.h"
#include "segment/stacks/run.h"
#include "segment/stacks/spots.h"
#include "segment/stacks/track.h"
#include "tests/support/findings.h"
#include "tests/support/stack_scene.h"

namespace mbtfm::stacks {
namespace {

using test::bead_clouds;
using test::BeadClouds;

struct Score {
  double followed = 0, wrong = 0;
};
/// Of those that have a partner.
Score score_of(const BeadClouds& clouds, const Matching& matching) {
  Score score;
  int n_good = 0;
  for (std::size_t k = 0; k < clouds.relaxed.size(); ++k) {
    const Match& m = matching.matches[k];
    if (m.flag != TrackFlag::none) continue;
    ++n_good;
    if (m.partner == static_cast<int>(k) && k < clouds.displacement.size())
      score.followed += 1.0 / static_cast<double>(clouds.displacement.size());
    else
      score.wrong += 1;
  }
  score.wrong /= std::max(1, n_good);
  return score;
}

/// A cell's pull: 3 um on its rim, strains of 0.3.
Vec3 pull(Vec3 x) {
  const Vec3 d{x.x - 50, x.y - 50, x.z};
  const double a = std::exp(-dot(d, d) / (2 * 15 * 15));
  return {-0.3 * d.x * a, -0.3 * d.y * a, 1.5 * a};
}

constexpr double kLeastFollowed = 0.95, kMostWrong = 0.01;  // what the program promises

TEST(Stacks, beads_are_followed_whatever_a_cell_a_stage_and_a_dish_do) {
  struct Case {
    const char* what;
    std::function<Vec3(Vec3)> displacement;
  };
  const auto turned = [](double degrees) {
    return [angle = degrees * std::numbers::pi / 180](Vec3 x) {
      const double c = std::cos(angle), s = std::sin(angle), dx = x.x - 50, dy = x.y - 50;
      return Vec3{c * dx - s * dy - dx, s * dx + c * dy - dy, 0};
    };
  };
  const std::vector<Case> cases = {
      {"at rest", [](Vec3) { return Vec3{}; }},
      {"a cell pulls", pull},
      {"a stage that went far",
       [](Vec3 x) {
         return pull(x) + Vec3{25, -18, 6};
       }},
      {"a gel that swells",
       [](Vec3 x) {
         return Vec3{0.04 * (x.x - 50), 0.04 * (x.y - 50), 0.06 * x.z};
       }},
      {"a dish that is turned a little", turned(2)},
      {"a dish that is turned",
       [&](Vec3 x) {
         return turned(-23)(x) + Vec3{5, 3, -2};
       }},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.what);
    const BeadClouds clouds = bead_clouds(1500, 0.03, 0.05, 1, c.displacement);
    const Score score = score_of(clouds, match(clouds.relaxed, clouds.stressed, {}, 2));
    EXPECT_GT(score.followed, kLeastFollowed);
    EXPECT_LT(score.wrong, kMostWrong);
  }
}

TEST(Stacks, the_roles_of_the_two_stacks_may_be_exchanged) {
  const BeadClouds clouds = bead_clouds(1500, 0.03, 0.05, 2, pull);
  const Matching there = match(clouds.relaxed, clouds.stressed, {}, 2);
  const Matching back = match(clouds.stressed, clouds.relaxed, {}, 2);
  int n_both = 0, n_other = 0;
  for (std::size_t k = 0; k < there.matches.size(); ++k) {
    if (there.matches[k].flag != TrackFlag::none) continue;
    const Match& m = back.matches[there.matches[k].partner];
    if (m.flag != TrackFlag::none) continue;
    m.partner == static_cast<int>(k) ? ++n_both : ++n_other;
  }
  EXPECT_GT(n_both, static_cast<int>(kLeastFollowed * 1500));
  EXPECT_EQ(n_other, 0);
}

TEST(Stacks, beads_of_another_place_are_refused) {
  const BeadClouds clouds = bead_clouds(400, 0.03, 0, 3, pull), others = bead_clouds(400, 0.03, 0, 4, pull);
  EXPECT_THROW(match(clouds.relaxed, others.stressed, {}, 2), beads::NotFollowed);
}

TEST(Stacks, too_few_beads_are_refused_with_the_number_that_would_do) {
  const BeadClouds clouds = bead_clouds(25, 0.03, 0, 5, pull);
  const beads::NotFollowed error =
      test::thrown<beads::NotFollowed>([&] { follow(clouds.relaxed, clouds.stressed, {}, Switch::automatic, {}, 1); });
  EXPECT_TRUE(has_words(error.expected, "40"));
  EXPECT_EQ(error.found, "25");
}

/// Beads at rest are at rest again whatever the slices did; the cell's pull stays.
TEST(Stacks, drift_of_slices_and_the_turn_are_taken_off) {
  const auto drift = [](Vec3 x) {
    return Vec3{0.6 * std::sin(x.z / 8) + 0.004 * (x.y - 50), 0.02 * x.z - 0.004 * (x.x - 50), 0.7};
  };
  const BeadClouds clouds = bead_clouds(4000, 0.02, 0.03, 6, [&](Vec3 x) { return pull(x) + drift(x); });
  const Followed followed = follow(clouds.relaxed, clouds.stressed, {}, Switch::automatic, {}, 2);
  EXPECT_TRUE(followed.common.has_slice_drift);
  std::vector<double> across, along;
  for (std::size_t k = 0; k < clouds.displacement.size(); ++k) {
    const BeadInSpace& bead = followed.field[k];
    if (!bead.flag.empty()) continue;
    const Vec3 off = bead.displacement_um - pull(clouds.relaxed[k].position_um);
    across.push_back(std::hypot(off.x, off.y)), along.push_back(std::abs(off.z));
  }
  ASSERT_GT(across.size(), 3500u);
  // errors of two places, 0.028 and 0.085 um, whose medians are 1.18 and 0.67 of that, and a half more for what is
  // left of a sine of 8 um between places 0.8 um apart, and of the cell's own mean motion
  EXPECT_LT(numerics::median(across), 1.5 * 1.18 * 0.028);
  EXPECT_LT(numerics::median(along), 1.5 * 0.67 * 0.085);
}

/// The strain that neighbours' affine maps miss is many times the beads' errors here, everywhere. It is none of theirs.
TEST(Stacks, errors_are_raised_where_beads_state_too_little_and_not_where_the_gel_is_bent) {
  const auto bent = [](Vec3 x) {
    return Vec3{1.2 * std::sin(x.x / 9) * std::cos(x.z / 14), 1.2 * std::cos(x.y / 10), 0.8 * std::sin(x.x / 12)};
  };
  for (const double stated : {1.0, 0.4}) {
    SCOPED_TRACE(stated);
    BeadClouds clouds = bead_clouds(5000, 0.02, 0.03, 8, bent);
    for (auto* cloud : {&clouds.relaxed, &clouds.stressed})
      for (PlacedBead& bead : *cloud) bead.sigma_um *= stated, bead.sigma_z_um *= stated;
    const Followed followed = follow(clouds.relaxed, clouds.stressed, {}, Switch::off, {}, 2);
    EXPECT_GT(followed.n_good, 4500);
    EXPECT_GT(followed.neighbours_um, 2 * std::numbers::sqrt2 * 0.02) << "then this asks nothing";
    for (const double ratio : {followed.error_ratio, followed.error_ratio_z}) {
      EXPECT_GT(ratio * stated, 0.8);
      EXPECT_LT(ratio * stated, 1.3);
    }
  }
}

TEST(Stacks, without_drift_of_slices_none_is_taken_off) {
  const BeadClouds clouds = bead_clouds(3000, 0.02, 0.03, 7, pull);
  const Followed followed = follow(clouds.relaxed, clouds.stressed, {}, Switch::automatic, {}, 2);
  EXPECT_FALSE(followed.common.has_slice_drift) << followed.common.slice_drift_ratio;
}

/// A mean that is the same at every depth: no drift fits it better than none, and the ratio is still a number.
TEST(Stacks, the_ratio_of_a_stage_at_rest_is_a_number) {
  MeanByDepth mean{.z_um = {0, 1, 2, 3, 4, 5},
                   .um = Eigen::MatrixX2d::Constant(6, 2, 0.1),
                   .noise_um2 = 1e-10 * Eigen::MatrixXd::Identity(6, 6),
                   .field_um = std::vector<double>(6, 0),
                   .beads_by_place = std::vector<double>(6, 10)};
  const StageByDepth stage = stage_by_depth(mean, true);
  EXPECT_EQ(stage.log_likelihood_gain, 0);
  EXPECT_NEAR(stage.shift_um.x(), 0.1, 1e-9);
}

/// What its neighbours add to a bead's variance is a sum of theirs: along z it is to that across as theirs are.
TEST(Stacks, neighbours_add_their_own_errors_along_each_axis) {
  const BeadClouds clouds = bead_clouds(500, 0.03, 0, 3, [](Vec3) { return Vec3{0.2, -0.1, 0.3}; });
  constexpr double kAlong = 3;  // errors along z over those across
  const Matching matching = match(clouds.relaxed, clouds.stressed, {}, 1);
  int n = 0;
  for (std::size_t k = 0; k < clouds.relaxed.size(); ++k) {
    const Match& m = matching.matches[k];
    if (m.flag != TrackFlag::none) continue;
    const PlacedBead &a = clouds.relaxed[k], &b = clouds.stressed[m.partner];
    const double own = a.sigma_um * a.sigma_um + b.sigma_um * b.sigma_um, all = m.sigma_um * m.sigma_um;
    EXPECT_GT(all, own);
    EXPECT_NEAR(m.sigma_z_um * m.sigma_z_um, kAlong * kAlong * all, 1e-9 * all);
    ++n;
  }
  EXPECT_GT(n, 300);
}

/// Four adhesions whose pulls reach the rim of the view and leave a mean at each depth.
Vec3 pull_everywhere(Vec3 x) {
  Vec3 u;
  for (const auto& [px, py, fx, fy] :
       {std::array{25.0, 25.0, 0.5, 0.3}, {75.0, 30.0, -0.2, 0.5}, {30.0, 75.0, 0.6, -0.1}, {75.0, 75.0, -0.1, -0.3}}) {
    const double dx = x.x - px, dy = x.y - py, dz = x.z + 6;
    const double a = 12 / std::sqrt(dx * dx + dy * dy + dz * dz);
    u += Vec3{a * fx, a * fy, 0};
  }
  return u;
}

/// What is left of the truth but for one shift of all, which none can tell from a stage that moved as a whole.
double rms_beyond_a_shift(const BeadClouds& clouds, const Followed& followed) {
  std::vector<Vec3> off;
  Vec3 mean;
  for (std::size_t k = 0; k < clouds.displacement.size(); ++k) {
    if (!followed.field[k].flag.empty()) continue;
    off.push_back(followed.field[k].displacement_um - pull_everywhere(clouds.relaxed[k].position_um));
    mean += off.back();
  }
  double squares = 0;
  for (const Vec3& o : off) {
    const Vec3 left = o - 1.0 / static_cast<double>(off.size()) * mean;
    squares += left.x * left.x + left.y * left.y;
  }
  return std::sqrt(squares / (2.0 * static_cast<double>(off.size())));
}

TEST(Stacks, the_mean_pull_of_a_cell_that_fills_the_view_is_no_drift_of_slices) {
  const BeadClouds clouds = bead_clouds(1000, 0.02, 0.03, 8, pull_everywhere);
  const Followed followed = follow(clouds.relaxed, clouds.stressed, {}, Switch::automatic, {}, 2);
  EXPECT_FALSE(followed.common.has_slice_drift) << followed.common.slice_drift_ratio;
  EXPECT_GE(followed.common.slice_drift_ratio, 0);
  // errors of two places; what a turn of the field looks like adds some
  EXPECT_LT(rms_beyond_a_shift(clouds, followed), 1.5 * std::numbers::sqrt2 * 0.02);
}

/// A microscope whose stage jumps from slice to slice of 0.5 um.
TEST(Stacks, jumps_of_the_stage_under_a_cell_that_fills_the_view_are_taken_off) {
  const auto jumps = [](Vec3 x) {
    const double slice = x.z / 0.5, below = std::floor(slice), share = slice - below;
    const auto at = [](double k) { return 0.15 * std::sin(12.9898 * k * k + 1); };
    return Vec3{(1 - share) * at(below) + share * at(below + 1), 0, 0};
  };
  const BeadClouds clouds = bead_clouds(4000, 0.02, 0.03, 9, [&](Vec3 x) { return pull_everywhere(x) + jumps(x); });
  const Followed followed = follow(clouds.relaxed, clouds.stressed, {}, Switch::automatic, {0, 0.5}, 2);
  EXPECT_TRUE(followed.common.has_slice_drift);
  // errors of two places, 0.028 um, and of the depth, 0.06 um where the stage jumps by some 0.6 um per um
  EXPECT_LT(rms_beyond_a_shift(clouds, followed), 1.25 * std::hypot(0.028, 0.036));
}

/// Neighbours of few beads lie a dozen slices off, and the stage has moved between: that is no error of the beads. What
/// is not known of the drift is one.
TEST(Stacks, errors_of_few_beads_hold_where_the_slices_drift) {
  constexpr double kStep_um = 0.5, kSigma_um = 0.014;
  test::Normal step(11, 0.03);
  std::vector<Vec2> walk = {{0, 0}};
  for (int k = 0; k < 400; ++k) walk.push_back(walk.back() + Vec2{step(), step()});
  const auto drift = [&](Vec3 x) {
    const double slice = std::clamp(x.z / kStep_um, 0.0, 399.0);
    const auto below = static_cast<std::size_t>(slice);
    const double share = slice - static_cast<double>(below);
    const Vec2 at = (1 - share) * walk[below] + share * walk[below + 1];
    return Vec3{at.x, at.y, 0};
  };
  const BeadClouds clouds = bead_clouds(1500, kSigma_um, 0.03, 10, [&](Vec3 x) { return pull(x) + drift(x); });
  const Followed followed = follow(clouds.relaxed, clouds.stressed, {}, Switch::automatic, {0, kStep_um}, 2);
  ASSERT_TRUE(followed.common.has_slice_drift);
  EXPECT_LT(followed.error_ratio, 1.3);
  std::vector<double> over;
  Vec3 mean;
  for (std::size_t k = 0; k < clouds.displacement.size(); ++k) {
    const BeadInSpace& bead = followed.field[k];
    if (bead.flag.empty()) mean += 1.0 / followed.n_good * (bead.displacement_um - pull(clouds.relaxed[k].position_um));
  }
  for (std::size_t k = 0; k < clouds.displacement.size(); ++k) {
    const BeadInSpace& bead = followed.field[k];
    if (!bead.flag.empty()) continue;
    const Vec3 off = bead.displacement_um - pull(clouds.relaxed[k].position_um) - mean;  // a shift is no drift
    over.push_back(std::hypot(off.x, off.y) / bead.sigma_um / 1.1774);  // median of a Rayleigh variable
  }
  EXPECT_GT(numerics::median(over), 0.8);
  EXPECT_LT(numerics::median(over), 1.3);
}

// --- findings

using test::fires;

std::vector<Finding> found_of(const BeadClouds& clouds) {
  return findings_of(follow(clouds.relaxed, clouds.stressed, {}, Switch::automatic, {}, 2), {}, 0);
}

/// One cell under which the gel is at rest, and what may be wrong with its stacks.
TEST(StackFindings, a_sound_pair_has_none_and_each_fault_its_own) {
  constexpr double kError_um = 0.03;
  const BeadClouds sound = bead_clouds(1200, kError_um, 0.03, 1, pull);
  const std::vector<Finding> of_sound = found_of(sound);
  EXPECT_TRUE(of_sound.empty()) << test::ids_of(of_sound);
  test::expect_silent({"nothing-moves", "beads-lost", "few-beads-at-rest", "common-motion", "noise-understated"},
                      of_sound);

  EXPECT_TRUE(fires("nothing-moves", found_of(bead_clouds(1200, kError_um, 0.03, 2, [](Vec3) { return Vec3{}; }))));
  // a third of the beads of each stack are not in the other
  EXPECT_TRUE(fires("beads-lost", found_of(bead_clouds(1000, kError_um, 0.5, 3, pull))));
  // a cell that fills the field: its pull is 30 standard errors and more nearly everywhere
  const auto everywhere = [](Vec3 x) { return Vec3{2 * std::sin(x.x / 12), 2 * std::sin(x.y / 9), std::sin(x.x / 7)}; };
  EXPECT_TRUE(fires("few-beads-at-rest", found_of(bead_clouds(1200, kError_um, 0.03, 4, everywhere))));
  const auto drift = [](Vec3 x) { return pull(x) + Vec3{0.4 * std::sin(x.z / 8), 0, 0}; };
  EXPECT_TRUE(fires("common-motion", "slices", found_of(bead_clouds(1200, kError_um, 0.03, 5, drift))));

  BeadClouds too_sure = sound;
  for (auto* cloud : {&too_sure.relaxed, &too_sure.stressed})
    for (PlacedBead& bead : *cloud) bead.sigma_um /= 2, bead.sigma_z_um /= 2;
  EXPECT_TRUE(fires("noise-understated", "lie together", found_of(too_sure)));
  for (const double left : {0.8, 0.3}) {
    BeadClouds bleached = sound;
    for (PlacedBead& bead : bleached.relaxed) bead.brightness = 1000;
    for (PlacedBead& bead : bleached.stressed) bead.brightness = 1000 * left;
    EXPECT_EQ(fires("beads-lost", "dimmer stack", found_of(bleached)), left < 0.5) << left;
  }
  // of the pictures themselves
  const Followed followed = follow(sound.relaxed, sound.stressed, {}, Switch::automatic, {}, 2);
  EXPECT_TRUE(fires("defocused", findings_of(followed, {.across = 1.1, .along = 1.6}, 0)));
  EXPECT_FALSE(fires("defocused", findings_of(followed, {.across = 1.1, .along = 1 / 1.4}, 0)));
  EXPECT_TRUE(fires("saturated", findings_of(followed, {}, 0.002)));
}

// --- pictures

struct Errors {
  std::vector<double> across, along;  ///< over the standard errors
  int n_found = 0, n_spurious = 0;
};

TEST(Stacks, places_have_the_errors_they_claim) {
  Errors errors;
  int n_beads = 0;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const test::StackScene scene = test::stack_scene(250, seed, [](Vec3) { return Vec3{0.21, -0.17, 0.33}; });
    const Scale scale{.pixel_um = scene.microscope.pixel_size_um,
                      .step_um = scene.microscope.focus_step_um(),
                      .first_um = 0,
                      .z_points = ZPoints::into_gel,
                      .depth = scene.microscope.n_slices};
    std::vector<PlacedBead> found[2];
    for (const bool is_stressed : {false, true})
      found[is_stressed] = placed(detect(scene.stack(is_stressed, seed), 5, "test", 2), scale);
    const Matching matching = match(found[0], found[1], {}, 2);
    std::vector<Vec3> places;
    for (const auto& bead : scene.relaxed) places.push_back(bead.position_um);
    const numerics::Near near(places, 2);
    n_beads += 250;
    for (std::size_t k = 0; k < found[0].size(); ++k) {
      if (near.within(found[0][k].position_um, 0.8, 1).empty()) ++errors.n_spurious;
      const Match& m = matching.matches[k];
      if (m.flag != TrackFlag::none || found[0][k].flag != TrackFlag::none) continue;
      const PlacedBead &a = found[0][k], &b = found[1][m.partner];
      const Vec3 off = b.position_um - a.position_um - Vec3{0.21, -0.17, 0.33};
      errors.across.push_back(std::abs(off.x) / std::hypot(a.sigma_um, b.sigma_um));
      errors.across.push_back(std::abs(off.y) / std::hypot(a.sigma_um, b.sigma_um));
      errors.along.push_back(std::abs(off.z) / std::hypot(a.sigma_z_um, b.sigma_z_um));
      ++errors.n_found;
    }
  }
  EXPECT_GT(errors.n_found, 0.8 * n_beads);  // a tenth lies at the rim
  EXPECT_LT(errors.n_spurious, 0.03 * n_beads);
  // 68 % of normal errors lie within one standard error; the promise is 0.8 to 1.3
  for (const auto* over : {&errors.across, &errors.along}) {
    const double ratio = numerics::quantile(*over, 0.683);
    EXPECT_GT(ratio, 0.8);
    EXPECT_LT(ratio, 1.3);
  }
}

TEST(Stacks, the_same_beads_for_any_number_of_threads) {
  const test::StackScene scene = test::stack_scene(200, 11, pull);
  const Detection one = detect(scene.stack(false, 11), 5, "test", 1),
                  two = detect(scene.stack(false, 11), 5, "test", 2);
  ASSERT_EQ(one.spots.size(), two.spots.size());
  for (std::size_t k = 0; k < one.spots.size(); ++k) {
    EXPECT_EQ(one.spots[k].place, two.spots[k].place);
    EXPECT_EQ(one.spots[k].sigma_z, two.spots[k].sigma_z);
  }
}

TEST(Stacks, noise_alone_shows_no_beads) {
  test::StackScene scene = test::stack_scene(0, 1, pull);
  try {
    const Detection found = detect(scene.stack(false, 1), 5, "test", 2);
    EXPECT_LT(found.spots.size(), 5u);
  } catch (const beads::NotFollowed&) {
    SUCCEED();
  }
}

/// A stack whose dark is cut off at zero, as recordings of 8 bits have it: its noise is that of rounding alone, and
/// every tenth voxel has a grain or two of light.
TEST(Stacks, grains_of_light_in_a_dark_that_is_cut_off_are_no_beads) {
  const test::StackScene scene = test::stack_scene(120, 5, pull);
  std::vector<images::Image> stack = scene.stack(false, 5);
  std::vector<double> dark(stack.front().pixels.begin(), stack.front().pixels.end());
  const double zero = numerics::quantile(dark, 0.5), largest = numerics::quantile(dark, 0.9999);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  for (images::Image& slice : stack) {
    for (float& v : slice.pixels) {
      const double beyond_noise = std::max(0.0, (v - zero) / (largest - zero) - 0.15);
      const double grain = unit(random) < 0.1 ? 1 + std::floor(2 * unit(random)) : 0;
      v = static_cast<float>(std::min(255.0, std::floor(200 * beyond_noise) + grain));
    }
    slice.full_scale = 255;
  }
  const Detection found = detect(std::move(stack), 5, "test", 2);
  // a tenth of the beads lies beyond the rim, and a few are too dim
  EXPECT_GT(found.spots.size(), 60u);
  EXPECT_LT(found.spots.size(), 130u);
}

TEST(Stacks, beads_whose_light_is_cut_off_are_flagged_and_the_others_are_not) {
  test::StackScene scene = test::stack_scene(150, 21, pull);
  for (std::size_t k = 0; k < 15; ++k) scene.relaxed[k].brightness = 60;
  std::vector<images::Image> stack = scene.stack(false, 21);
  for (images::Image& slice : stack) {
    slice.full_scale = 1500;
    for (float& v : slice.pixels) v = std::min(v, 1500.0f);
  }
  const Detection found = detect(std::move(stack), 5, "test", 2);
  const Scale scale{scene.microscope.pixel_size_um, scene.microscope.focus_step_um(), 0, ZPoints::into_gel,
                    scene.microscope.n_slices};
  const std::vector<PlacedBead> beads = placed(found, scale);
  std::vector<Vec3> places;
  for (const PlacedBead& bead : beads) places.push_back(bead.position_um);
  const numerics::Near near(places, 2);
  int n_flagged = 0, n_inside = 0;
  for (std::size_t k = 0; k < scene.relaxed.size(); ++k) {
    const auto at = near.within(scene.relaxed[k].position_um, 0.8, 1);
    if (at.empty() || beads[at[0]].flag == TrackFlag::edge) continue;
    const bool is_flagged = beads[at[0]].flag == TrackFlag::saturated;
    if (k < 15)
      ++n_inside, n_flagged += is_flagged;
    else
      EXPECT_FALSE(is_flagged) << "bead " << k;
  }
  EXPECT_GE(n_inside, 8);
  EXPECT_EQ(n_flagged, n_inside);
}

TEST(Stacks, slices_out_of_the_gel_are_its_mirror_image) {
  const Scale into{0.2, 0.5, 3, ZPoints::into_gel, 40}, out{0.2, 0.5, 3, ZPoints::out_of_gel, 40};
  EXPECT_DOUBLE_EQ(into.place_um({0, 0, 0}).z, 3.25);
  EXPECT_DOUBLE_EQ(out.place_um({0, 0, 39}).z, 3.25);
  EXPECT_DOUBLE_EQ(into.place_um({9, 4, 7}).x, out.place_um({9, 4, 7}).x);
}

}  // namespace
}  // namespace mbtfm::stacks
