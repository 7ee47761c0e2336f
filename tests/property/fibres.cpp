/// What must not change the fibres of an image, or change them in a known way.
#include "tests/support/drawn_image.h"
#include "tests/support/find_fibres.h"

namespace mbtfm::beads {
namespace {

using namespace mbtfm::test;

constexpr int kSide = 256;
constexpr double kPixel_um = DrawnScene::kPixel_um;

struct Scene {
  images::Image image;
  Polygon outline_um;
  std::vector<Adhesion> adhesions;
  std::vector<Fibre> fibres() const { return cells::find_fibres(image, outline_um, adhesions, kPixel_um, {}); }
};

Scene scene_of(std::uint64_t seed) {
  const DrawnScene s = drawn_scene(20, seed);
  return {s.actin_image, ellipse_corners(ellipse(1, {12.8, 12.8}, 20, 20, 0), 64), s.adhesions};
}

/// The scene with its pixels and its places moved alike.
template <class Map, class Move>
Scene moved(const Scene& scene, Map map, Move move) {
  Scene result = scene;
  result.image = mapped(scene.image, map);
  for (Vec2& p : result.outline_um) p = move(p);
  for (Adhesion& a : result.adhesions) {
    const Vec2 tip = move(a.position_um + Vec2{std::cos(a.angle_rad), std::sin(a.angle_rad)}) - move(a.position_um);
    a.position_um = move(a.position_um);
    a.angle_rad = std::atan2(tip.y, tip.x);
  }
  return result;
}

/// Every fibre of `a` after `move` is one of `b`, within `tolerance_um`, of one type, and there are no others.
template <class Move>
void expect_alike(const std::vector<Fibre>& a, const std::vector<Fibre>& b, Move move, double tolerance_um) {
  ASSERT_EQ(a.size(), b.size());
  for (const Fibre& f : a) {
    Polyline line = f.points_um;
    for (Vec2& p : line) p = move(p);
    EXPECT_TRUE(std::any_of(b.begin(), b.end(), [&](const Fibre& g) {
      return g.type == f.type && covered_share(line, g.points_um, tolerance_um) == 1 &&
             covered_share(g.points_um, line, tolerance_um) == 1 && std::abs(g.width_um - f.width_um) < tolerance_um;
    }));
  }
}

// a pixel of the filter's grid, over which an end's place may round to the one side or the other
constexpr double kEnd_um = 0.2;

TEST(Fibres, turn_with_the_image) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    const Scene scene = scene_of(seed);
    Scene turned = scene;
    const auto turn = [](Vec2 p) { return Vec2{kSide * kPixel_um - p.y, p.x}; };
    const auto times = [turn](int quarters) {
      return [quarters, turn](Vec2 p) {
        for (int i = 0; i < quarters; ++i) p = turn(p);
        return p;
      };
    };
    for (int quarters = 1; quarters < 4; ++quarters) {
      turned = moved(
          turned, [](int c, int r) { return std::pair(kSide - 1 - r, c); }, turn);
      expect_alike(scene.fibres(), turned.fibres(), times(quarters), kEnd_um);
    }
  }
}

TEST(Fibres, mirror_with_the_image) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    const Scene scene = scene_of(seed);
    const auto flip = [](Vec2 p) { return Vec2{kSide * kPixel_um - p.x, p.y}; };
    const Scene mirrored = moved(
        scene, [](int c, int r) { return std::pair(kSide - 1 - c, r); }, flip);
    expect_alike(scene.fibres(), mirrored.fibres(), flip, kEnd_um);
  }
}

TEST(Fibres, shift_with_the_image) {
  const Scene scene = scene_of(4);
  for (const int n : {1, 2, 7}) {
    SCOPED_TRACE(n);
    const auto shift = [n](Vec2 p) { return Vec2{p.x + n * kPixel_um, p.y + 2 * n * kPixel_um}; };
    const Scene shifted = moved(
        scene, [n](int c, int r) { return std::pair((c + n) % kSide, (r + 2 * n) % kSide); }, shift);
    expect_alike(scene.fibres(), shifted.fibres(), shift, kEnd_um);
  }
}

TEST(Fibres, do_not_depend_on_gain_and_offset) {
  const Scene scene = scene_of(5);
  Scene other = scene;
  for (float& value : other.image.pixels) value = 4 * value + 1024;  // exact but for the last bits
  expect_alike(
      scene.fibres(), other.fibres(), [](Vec2 p) { return p; }, 0.02);
}

}  // namespace
}  // namespace mbtfm::beads
