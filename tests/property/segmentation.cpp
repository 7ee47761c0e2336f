/// What must not change a segmentation, or change it in a known way.
#include <gtest/gtest.h>

#include "segment/cells/segment_cell.h"
#include "tests/support/drawn_image.h"

namespace mbtfm::cells {
namespace {

using namespace mbtfm::test;

constexpr double kPixel_um = DrawnScene::kPixel_um;
constexpr double kSide_um = 25.6;

Segmentation segmented(const images::Image& adhesion, const images::Image& actin) {
  SegmentParameters p;
  p.pixel_size_um = kPixel_um;
  return segment_cell(images::Channel{"adhesion", adhesion}, images::Channel{"actin", actin}, p);
}

/// `b` is `a` after `move`: same numbers, every adhesion and fibre type again.
template <class Move>
void expect_moved(const Segmentation& a, const Segmentation& b, Move move) {
  std::vector<Adhesion> expected = a.cell.adhesions;
  for (Adhesion& adhesion : expected) adhesion.position_um = move(adhesion.position_um);
  const AdhesionScore score = score_adhesions(expected, b.cell.adhesions);
  EXPECT_EQ(score.n_matched, score.n_true);
  EXPECT_EQ(score.n_found, score.n_true);
  EXPECT_LT(score.centre_error_um, 0.02);  // backgrounds on coarse grids shift: a fifth of a pixel
  EXPECT_NEAR(score.area_ratio, 1, 0.02);
  ASSERT_EQ(a.cell.fibres.size(), b.cell.fibres.size());
  for (const Fibre& f : a.cell.fibres) {
    Polyline line = f.points_um;
    for (Vec2& p : line) p = move(p);
    const bool is_there = std::any_of(b.cell.fibres.begin(), b.cell.fibres.end(), [&](const Fibre& g) {
      return g.type == f.type && covered_share(line, g.points_um, 0.15) > 0.9;
    });
    EXPECT_TRUE(is_there);
  }
}

TEST(Segmentation, turns_with_the_image) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    const DrawnScene s = drawn_scene(20, seed);
    const auto turn = [](int column, int row) { return std::pair(255 - row, column); };
    expect_moved(segmented(s.adhesion_image, s.actin_image),
                 segmented(mapped(s.adhesion_image, turn), mapped(s.actin_image, turn)), [](Vec2 p) {
                   return Vec2{kSide_um - p.y, p.x};
                 });
  }
}

TEST(Segmentation, mirrors_with_the_image) {
  const DrawnScene s = drawn_scene(20, 4);
  const auto mirror = [](int column, int row) { return std::pair(255 - column, row); };
  expect_moved(segmented(s.adhesion_image, s.actin_image),
               segmented(mapped(s.adhesion_image, mirror), mapped(s.actin_image, mirror)), [](Vec2 p) {
                 return Vec2{kSide_um - p.x, p.y};
               });
}

TEST(Segmentation, moves_with_the_image) {
  const DrawnScene s = drawn_scene(20, 5);
  const auto shift = [](int column, int row) { return std::pair((column + 6) % 256, row); };
  expect_moved(segmented(s.adhesion_image, s.actin_image),
               segmented(mapped(s.adhesion_image, shift), mapped(s.actin_image, shift)), [](Vec2 p) {
                 return Vec2{p.x + 6 * kPixel_um, p.y};
               });
}

TEST(Segmentation, does_not_depend_on_gain_and_offset) {
  const DrawnScene s = drawn_scene(20, 6);
  images::Image adhesion = s.adhesion_image, actin = s.actin_image;
  for (images::Image* image : {&adhesion, &actin})
    for (float& value : image->pixels) value = 4 * value + 1024;  // powers of two: exact but for the last bits
  const Segmentation a = segmented(s.adhesion_image, s.actin_image), b = segmented(adhesion, actin);
  expect_moved(a, b, [](Vec2 p) { return p; });
}

}  // namespace
}  // namespace mbtfm::cells
