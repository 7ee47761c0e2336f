/// Faults of pictures are as large as the scenario says.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "samples/drawing/faults.h"
#include "samples/drawing/rough_day.h"

namespace mbtfm::drawing {
namespace {

/// Counts that are all different.
images::Image ramp() {
  images::Image image = blank_image(64, 0.1);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i + 1);
  return image;
}

TEST(Faults, saturate_the_share_of_pixels_asked_for) {
  images::Image image = ramp();
  FaultParameters faults;
  faults.saturated = 0.02;
  spoil(faults, image);
  const float largest = *std::ranges::max_element(image.pixels);
  const auto n = static_cast<double>(std::ranges::count(image.pixels, largest));
  EXPECT_NEAR(n / 4096, 0.02, 2.0 / 4096);  // whole pixels
}

TEST(Faults, pad_left_and_above_by_a_turned_frame_and_nothing_else) {
  const images::Image whole = ramp();
  images::Image image = whole;
  FaultParameters faults;
  faults.padding_px = 5;
  spoil(faults, image);
  for (int j = 0; j < 64; ++j)
    for (int i = 0; i < 64; ++i)
      EXPECT_EQ(image.at(i, j), i < 5 + 0.0175 * j || j < 5 - 0.0175 * i ? 0 : whole.at(i, j));
}

TEST(Faults, debris_lies_beside_the_cell) {
  Cell cell;
  for (int k = 0; k < 60; ++k)
    cell.outline_um.push_back(Vec2{50, 50} + 15 * Vec2{std::cos(k * 0.10472), std::sin(k * 0.10472)});
  FaultParameters faults;
  faults.n_specks = 20, faults.n_dead_cells = 1;
  images::Image paxillin = blank_image(1000, 0.1), actin = paxillin;
  add_debris(cell, faults, 7, paxillin, actin);
  double inside = 0, all = 0;
  for (int j = 0; j < 1000; ++j) {
    for (int i = 0; i < 1000; ++i) {
      const double light = paxillin.at(i, j) + actin.at(i, j);
      all += light;
      if (norm(Vec2{0.1 * (i + 0.5), 0.1 * (j + 0.5)} - Vec2{50, 50}) < 14.9) inside += light;
    }
  }
  EXPECT_GT(all, 0);
  EXPECT_LT(inside, 0.01 * all);  // three standard deviations of a speck and more away: 1.1 % of one beyond
}

TEST(RoughDay, is_drawn_by_its_number_alone) {
  const ScenarioParameters a = rough_day({}, 5), again = rough_day({}, 5), b = rough_day({}, 6);
  EXPECT_EQ(a.drift_x_um, again.drift_x_um);
  EXPECT_EQ(a.faults.light_lost, again.faults.light_lost);
  EXPECT_NE(a.drift_x_um, b.drift_x_um);
  EXPECT_EQ(a.seed, 5u);
}

TEST(RoughDay, faults_happen_as_often_as_they_should) {
  constexpr int kDays = 400;
  int n_neighbours = 0, n_specks = 0;
  for (int day = 1; day <= kDays; ++day) {
    const ScenarioParameters p = rough_day({}, static_cast<std::uint64_t>(day));
    n_neighbours += p.neighbour_x_um.has_value();
    n_specks += p.faults.n_specks > 0;
    EXPECT_LE(std::hypot(p.drift_x_um, p.drift_y_um), field_um(p.microscope) / 3) << day;
  }
  // binomial, 0.3 of 400: sd 9.2, four of them
  EXPECT_NEAR(n_neighbours, 0.3 * kDays, 37);
  EXPECT_NEAR(n_specks, 0.3 * kDays, 37);
}

}  // namespace
}  // namespace mbtfm::drawing
