#include "segment/cells/channel_alignment.h"
#include "tests/support/segmentation_accuracy.h"

namespace mbtfm::cells {
namespace {

/// Fibres in all directions whose ends' lines miss their adhesions' centres by `aside_um`, and adhesions and ends that
/// belong to nothing.
struct Scene {
  std::vector<Fibre> fibres;
  std::vector<Adhesion> adhesions;
};

Scene scene(int n_fibres, double aside_um, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1);
  const auto even = [&](double from, double to) {
    return from + (to - from) * std::generate_canonical<double, 53>(random);
  };
  Scene s;
  const auto adhesion = [&](Vec2 place) {
    Adhesion a;
    a.adhesion_id = static_cast<int>(s.adhesions.size()) + 1;
    a.position_um = place;
    a.minor_axis_um = 0.5;
    a.major_axis_um = 1;
    s.adhesions.push_back(a);
  };
  for (int i = 0; i < n_fibres; ++i) {
    const double angle = even(0, 2 * std::numbers::pi), half = even(5, 15);
    const Vec2 centre{even(20, 40), even(20, 40)}, along{std::cos(angle), std::sin(angle)}, n{-along.y, along.x};
    Fibre fibre;
    for (const double side : {-1., 1.}) {
      fibre.points_um.push_back(centre + side * half * along);
      if (i % 4 > 0) adhesion(fibre.points_um.back() + even(-0.5, 0.8) * side * along + aside_um * normal(random) * n);
    }
    s.fibres.push_back(fibre);
  }
  for (int i = 0; i < 3 * n_fibres; ++i) adhesion({even(0, 60), even(0, 60)});
  return s;
}

void move(Scene& s, Vec2 shift, double turn, double growth) {
  for (Adhesion& a : s.adhesions) {
    const Vec2 d = a.position_um - Vec2{30, 30};
    a.position_um = a.position_um + shift + growth * d + turn * Vec2{-d.y, d.x};
  }
}

TEST(ChannelAlignment, is_found_within_its_stated_error) {
  constexpr int kDraws = 60;
  double squares[4] = {};
  for (unsigned seed = 1; seed <= kDraws; ++seed) {
    Scene s = scene(24, 0.06, seed);
    move(s, {0.4, -0.3}, 0.005, 0.002);
    const auto found = align_channels(s.fibres, s.adhesions);
    ASSERT_TRUE(found);
    EXPECT_TRUE(found->is_significant()) << seed;
    const Vec2 d = found->centre_um - Vec2{30, 30};
    const Vec2 shift = found->shift_um - (Vec2{0.4, -0.3} + 0.002 * d + 0.005 * Vec2{-d.y, d.x});
    squares[0] += std::pow(shift.x / found->shift_sigma_um.x, 2) / kDraws;
    squares[1] += std::pow(shift.y / found->shift_sigma_um.y, 2) / kDraws;
    squares[2] += std::pow((found->turn_rad - 0.005) / found->turn_sigma_rad, 2) / kDraws;
    squares[3] += std::pow((found->growth - 0.002) / found->growth_sigma, 2) / kDraws;
    EXPECT_LT(norm(shift), 0.1) << seed;
  }
  // a mean of 60 squared normal numbers has a standard deviation of .18; few strays make it a little wider
  for (const double square : squares) EXPECT_NEAR(square, 1.2, 4 * 0.2);
}

TEST(ChannelAlignment, images_that_lie_on_each_other_stay) {
  int n_moved = 0;
  constexpr int kDraws = 100;
  for (unsigned seed = 1; seed <= kDraws; ++seed) {
    const Scene s = scene(24, 0.1, seed);
    const auto found = align_channels(s.fibres, s.adhesions);
    n_moved += found && found->is_significant();
  }
  EXPECT_LE(n_moved, 3) << "one in 370 by chance: more than three of a hundred once in 2e5";
}

TEST(ChannelAlignment, few_ends_show_nothing) {
  EXPECT_FALSE(align_channels({}, {}));
  const Scene s = scene(3, 0.1, 1);
  EXPECT_FALSE(align_channels(s.fibres, s.adhesions));
}

TEST(ChannelAlignment, fibres_of_a_shifted_channel_are_tied_as_if_it_were_not) {
  const test::SimulatedCell cell = test::simulated_cell("u2os", "ordinary", 1);
  const auto n_tied = [](const Segmentation& s) {
    int n = 0;
    for (const Fibre& f : s.cell.fibres) n += f.start_adhesion_id.has_value() + f.end_adhesion_id.has_value();
    return n;
  };
  images::Channel shifted = cell.adhesion;
  constexpr int kRight = 4, kDown = -3;
  for (int j = 0; j < shifted.image.height; ++j)
    for (int i = 0; i < shifted.image.width; ++i)
      shifted.image.at(i, j) = cell.adhesion.image.at(std::clamp(i - kRight, 0, shifted.image.width - 1),
                                                      std::clamp(j - kDown, 0, shifted.image.height - 1));
  SegmentParameters parameters;
  parameters.pixel_size_um = 0.1;
  const Segmentation still = segment_cell(cell.adhesion, cell.actin, parameters);
  const Segmentation moved = segment_cell(shifted, cell.actin, parameters);
  EXPECT_FALSE(still.is_aligned);
  ASSERT_TRUE(moved.is_aligned);
  EXPECT_NEAR(moved.alignment->shift_um.x, 0.1 * kRight, 0.03) << "a third of a pixel";
  EXPECT_NEAR(moved.alignment->shift_um.y, 0.1 * kDown, 0.03);
  EXPECT_NEAR(n_tied(moved), n_tied(still), 2);
  parameters.align_channels = Switch::off;
  EXPECT_FALSE(segment_cell(shifted, cell.actin, parameters).is_aligned);
}

}  // namespace
}  // namespace mbtfm::cells
