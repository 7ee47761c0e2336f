
#include "segment/beads/pair_look.h"
#include "tests/support/bead_pair.h"

namespace mbtfm::beads {
namespace {

constexpr double kSide = 192;

test::BeadPair small_pair() {
  return test::draw_bead_pair(test::ring_of_adhesions(kSide, 3), {.width = 192, .n_beads = 740});
}

/// new(i, j) = old(place(i, j))
template <class Place>
images::Image rearranged(const images::Image& image, const Place& place) {
  images::Image result = image;
  for (int j = 0; j < image.height; ++j)
    for (int i = 0; i < image.width; ++i) {
      const auto [a, b] = place(i, j);
      result.at(i, j) = image.at(a, b);
    }
  return result;
}

/// The bead nearest to a place.
const Bead& nearest(const DisplacementField& field, Vec2 place) {
  return *std::min_element(field.begin(), field.end(), [&](const Bead& a, const Bead& b) {
    return norm(a.position_um - place) < norm(b.position_um - place);
  });
}

/// `turned` tracks the same scene under a symmetry; `back` brings a vector, `back_place` a place of it home.
template <class Back, class BackPlace>
void expect_same(const Tracking& plain, const Tracking& turned, const Back& back, const BackPlace& back_place) {
  // beads at the threshold of a test fall on either side of it: as many as are flagged at all, at most
  EXPECT_NEAR(plain.n_good, turned.n_good, static_cast<double>(plain.field.size()) - plain.n_good);
  int n_same = 0;
  for (const Bead& bead : turned.field) {
    if (!bead.flag.empty()) continue;
    const Bead& other = nearest(plain.field, back_place(bead.position_um));
    // Sums in another order may choose another window, whose answer agrees within a standard error by construction.
    const double allowed = 1.5 * std::max(bead.sigma_um, other.sigma_um);
    if (other.flag.empty() && norm(back(bead.displacement_um) - other.displacement_um) < allowed) ++n_same;
  }
  EXPECT_GE(n_same, 0.95 * turned.n_good);
}

TEST(TrackProperty, a_mirrored_scene_gives_the_mirrored_field) {
  const auto pair = small_pair();
  const auto mirror = [](int i, int j) { return std::pair(191 - i, j); };
  expect_same(
      track_beads(pair.relaxed, pair.stressed, 1.0),
      track_beads(rearranged(pair.relaxed, mirror), rearranged(pair.stressed, mirror), 1.0),
      [](Vec2 u) {
        return Vec2{-u.x, u.y};
      },
      [](Vec2 p) {
        return Vec2{kSide - p.x, p.y};
      });
}

TEST(TrackProperty, a_scene_turned_by_a_quarter_gives_the_turned_field) {
  const auto pair = small_pair();
  const auto turn = [](int i, int j) { return std::pair(j, 191 - i); };
  expect_same(
      track_beads(pair.relaxed, pair.stressed, 1.0),
      track_beads(rearranged(pair.relaxed, turn), rearranged(pair.stressed, turn), 1.0),
      [](Vec2 u) {
        return Vec2{u.y, -u.x};
      },
      [](Vec2 p) {
        return Vec2{p.y, kSide - p.x};
      });
}

TEST(TrackProperty, gain_and_offset_of_an_image_do_not_matter) {
  const auto pair = small_pair();
  images::Image brighter = pair.stressed;
  for (float& value : brighter.pixels) value = 1.7f * value + 300;
  const auto same = [](Vec2 v) { return v; };
  expect_same(track_beads(pair.relaxed, pair.stressed, 1.0), track_beads(pair.relaxed, brighter, 1.0), same, same);
}

TEST(TrackProperty, swapped_images_give_the_opposite_field) {
  const auto pair = small_pair();
  const Tracking forward = track_beads(pair.relaxed, pair.stressed, 1.0);
  const Tracking backward = track_beads(pair.stressed, pair.relaxed, 1.0);
  int n_same = 0, n = 0;
  for (const Bead& bead : backward.field) {
    if (!bead.flag.empty()) continue;
    const Bead& other = nearest(forward.field, bead.position_um + bead.displacement_um);
    const Vec2 missed = bead.position_um + bead.displacement_um - other.position_um;
    if (!other.flag.empty() || norm(missed) > 0.3) continue;  // two beads of one image, one blot of the other
    ++n;
    // They see the same noise, but a tenth of it is another neighbourhood's; and what the place is off, the gradient
    // (up to a half) makes a difference.
    const double allowed = 2 * std::hypot(bead.sigma_um, other.sigma_um) + 0.5 * norm(missed);
    if (norm(bead.displacement_um + other.displacement_um) < allowed) ++n_same;
  }
  EXPECT_GE(n, 0.8 * backward.n_good);
  EXPECT_GE(n_same, 0.97 * n);
}

/// Up to a third of the picture is searched. A pull of a seventh strains the gel by 0.7, so that no window of the usual
/// search holds beads that move alike.
TEST(TrackProperty, beads_that_move_by_a_seventh_of_the_picture_are_followed) {
  const auto peaks = test::ring_of_strain(256, 37, 0.73, 4, 0.7);
  const auto pair = test::draw_bead_pair(peaks, {.width = 256, .n_beads = 1340, .seed = 11});
  TrackParameters parameters = test::in_relaxed_frame();
  parameters.drift_affine = Switch::automatic;
  const Tracking tracking = track_beads(pair.relaxed, pair.stressed, 1.0, parameters, 2);
  double furthest = 0;
  int n_right = 0;
  for (const Bead& bead : tracking.field) {
    if (!bead.flag.empty()) continue;
    const Vec2 place = bead.position_um - Vec2{0.5, 0.5}, truth = test::displacement(peaks, place);
    // a blot of two beads has the motion of either: a bead's width
    if (norm(bead.displacement_um + tracking.stressed.motion.at(place) - truth) > 1.3) continue;
    ++n_right;
    furthest = std::max(furthest, norm(truth));
  }
  EXPECT_GE(furthest, 0.95 * 37);  // beads are 7 px apart: none of them need be at the top
  // one bead in ten, 1 − exp(−density pi 1.3²), has another within its width, and of such two one may be wrong
  EXPECT_GE(n_right, 0.95 * tracking.n_good);
  EXPECT_GE(tracking.n_good, 2.0 / 3 * static_cast<double>(tracking.field.size()));
}

/// Beads that no grid leads are led by those around: without that one in two hundred takes a stranger's place unseen.
TEST(TrackProperty, hardly_a_bead_takes_the_place_of_another_where_strains_are_large) {
  const auto peaks = test::ring_of_strain(512, 75, 0.73, 4, 0.7);
  int n_wrong = 0, n_good = 0;
  for (const unsigned seed : {12u, 13u, 14u}) {
    const auto pair = test::draw_bead_pair(peaks, {.width = 512, .n_beads = 5360, .seed = seed});
    TrackParameters parameters = test::in_relaxed_frame();
    parameters.drift_affine = Switch::automatic;
    const Tracking tracking = track_beads(pair.relaxed, pair.stressed, 1.0, parameters, 2);
    n_good += tracking.n_good;
    for (const Bead& bead : tracking.field) {
      const Vec2 place = bead.position_um - Vec2{0.5, 0.5}, truth = test::displacement(peaks, place);
      const Vec2 error = bead.displacement_um + tracking.stressed.motion.at(place) - truth;
      n_wrong += bead.flag.empty() && norm(error) > 1.3;  // a bead's width
    }
  }
  EXPECT_LE(n_wrong, 0.002 * n_good);
  EXPECT_GE(n_good, 9500);  // of 10557
}

TEST(TrackProperty, a_lattice_of_windows_lies_beside_the_beads_and_leaves_them_alone) {
  const auto pair = test::draw_bead_pair({}, {.width = 192, .n_beads = 740, .drift = {1.3, -0.7}});
  TrackParameters parameters;
  const Tracking plain = track_beads(pair.relaxed, pair.stressed, 1.0, parameters, 2);
  parameters.windows_spacing_um = 12;
  const Tracking tracking = track_beads(pair.relaxed, pair.stressed, 1.0, parameters, 2);
  ASSERT_EQ(plain.field.size(), tracking.field.size());
  for (std::size_t k = 0; k < plain.field.size(); ++k)
    EXPECT_EQ(plain.field[k].displacement_um.x, tracking.field[k].displacement_um.x);
  ASSERT_EQ(tracking.lattice.size(), 16 * 16);
  double relative = 0;
  int n = 0;
  for (const Bead& window : tracking.lattice) {
    if (!window.flag.empty()) continue;
    relative += 0.5 * dot(window.displacement_um, window.displacement_um) / (window.sigma_um * window.sigma_um);
    ++n;
  }
  EXPECT_GE(n, 0.8 * 16 * 16);
  // windows three widths apart are independent: some thirty, whose scale is known to a sixth, as c is by itself
  EXPECT_NEAR(std::sqrt(relative / n), 1, 4 * std::hypot(1.0 / 6, 1.0 / 6) / 2);
}

TEST(TrackProperty, any_number_of_threads_gives_the_same_numbers) {
  const auto pair = small_pair();
  const Tracking one = track_beads(pair.relaxed, pair.stressed, 1.0, {}, 1);
  for (const int threads : {2, 4}) {
    const Tracking more = track_beads(pair.relaxed, pair.stressed, 1.0, {}, threads);
    ASSERT_EQ(one.field.size(), more.field.size());
    for (std::size_t k = 0; k < one.field.size(); ++k) {
      EXPECT_EQ(one.field[k].displacement_um, more.field[k].displacement_um);
      EXPECT_EQ(one.field[k].sigma_um, more.field[k].sigma_um);
      EXPECT_EQ(one.field[k].flag, more.field[k].flag);
    }
  }
}

images::Image point_at(int column, int row) {
  images::Image image;
  image.width = 60;
  image.height = 40;
  image.pixels.assign(60 * 40, 100);
  image.at(column, row) = 900;
  return image;
}

/// red, green and blue of a pixel.
std::array<int, 3> colour_at(const images::Picture& picture, int column, int row) {
  const std::size_t at = 3 * (static_cast<std::size_t>(row) * picture.width + column);
  return {picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]};
}

/// The cell is recorded with the stressed beads: there its places are, and there a bead's place at rest is.
TEST(PlacesAtRest, are_those_of_the_relaxed_picture_moved_as_the_stage_moved) {
  const double turn_rad = 0.02;
  const double side = 384;
  const Vec2 drift{9.3, -6.4}, middle{0.5 * side, 0.5 * side};
  const auto pair = test::draw_bead_pair(test::ring_of_adhesions(side, 6),
                                         {.width = 384, .n_beads = 2950, .turn_rad = turn_rad, .drift = drift});
  const auto tracked_with = [&](CellWith cell_with) {
    return track_beads(pair.relaxed, pair.stressed, 1, {.cell_with = cell_with, .drift_affine = Switch::on});
  };
  const Tracking relaxed = tracked_with(CellWith::relaxed), stressed = tracked_with(CellWith::stressed);
  ASSERT_EQ(relaxed.field.size(), stressed.field.size());
  const auto turned = [&](Vec2 v) {
    return Vec2{std::cos(turn_rad) * v.x - std::sin(turn_rad) * v.y,
                std::sin(turn_rad) * v.x + std::cos(turn_rad) * v.y};
  };
  int n_in_sight = 0;
  for (std::size_t k = 0; k < relaxed.field.size(); ++k) {
    const Bead &before = relaxed.field[k], &after = stressed.field[k];
    // the motion is known to hundredths of a pixel
    EXPECT_LT(norm(after.position_um - (middle + drift + turned(before.position_um - middle))), 0.1);
    EXPECT_LT(norm(after.displacement_um - turned(before.displacement_um)),
              0.02 * (0.1 + norm(before.displacement_um)));
    const bool is_in_sight =
        after.position_um.x > 0 && after.position_um.y > 0 && after.position_um.x < side && after.position_um.y < side;
    n_in_sight += is_in_sight && after.flag.empty();
    if (!is_in_sight) EXPECT_FALSE(after.flag.empty()) << "the stressed picture does not show it";
  }
  EXPECT_GT(n_in_sight, 0.85 * static_cast<double>(relaxed.field.size()));  // drift and turn take 5 % out of sight
}

TEST(PictureOfBeads, relaxed_beads_are_green_stressed_ones_purple_and_those_that_only_drifted_white) {
  using Colour = std::array<int, 3>;
  const images::Picture apart = picture_of_beads(point_at(20, 10), point_at(25, 12), {}, CellWith::stressed);
  ASSERT_EQ(apart.width, 60);
  EXPECT_EQ(colour_at(apart, 20, 10), (Colour{0, 255, 0}));
  EXPECT_EQ(colour_at(apart, 25, 12), (Colour{255, 0, 255}));
  EXPECT_EQ(colour_at(apart, 5, 5), (Colour{0, 0, 0}));
  const images::Picture drifted =
      picture_of_beads(point_at(20, 10), point_at(25, 12), {.motion = {.shift = {5, 2}}}, CellWith::relaxed);
  EXPECT_EQ(colour_at(drifted, 20, 10), (Colour{255, 255, 255}));
  const images::Picture with_stressed =
      picture_of_beads(point_at(20, 10), point_at(25, 12), {.motion = {.shift = {5, 2}}}, CellWith::stressed);
  EXPECT_EQ(colour_at(with_stressed, 25, 12), (Colour{255, 255, 255}));
}

}  // namespace
}  // namespace mbtfm::beads
