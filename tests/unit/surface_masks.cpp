/// The surface of a gel from masks.
#include "pipeline/contract/errors.h"
#include "substrate/surface/points.h"
#include "substrate/surface/voxels.h"
#include "tests/support/test.h"

namespace mbtfm::surface {
namespace {

using HeightOf = std::function<double(Vec2)>;

VoxelStack masks_of(const HeightOf& height) {
  VoxelStack s{.n_x = 60, .n_y = 50, .n_z = 40, .pixel_um = 0.5, .step_um = 1};
  for (int k = 0; k < s.n_z; ++k)
    for (int j = 0; j < s.n_y; ++j)
      for (int i = 0; i < s.n_x; ++i)
        s.share.push_back(k * s.step_um > height({(i + 0.5) * s.pixel_um, (j + 0.5) * s.pixel_um}) ? 1 : 0);
  return s;
}
float& voxel(VoxelStack& s, int i, int j, int k) { return s.share[(k * s.n_y + j) * s.n_x + i]; }

double slope(Vec2 p) { return 10 + 0.6 * p.x - 0.3 * p.y; }
double bump(Vec2 p) { return 20 - 8 * std::exp(-0.02 * (std::pow(p.x - 15, 2) + std::pow(p.y - 12, 2))); }

TEST(Masks, show_the_surface_far_finer_than_their_slices) {
  for (const HeightOf& height : {HeightOf(slope), HeightOf(bump)}) {
    const VoxelPoints found = points_of_masks(masks_of(height));
    EXPECT_EQ(found.n_voxels_left_out, 0);
    for (const Vec3& p : found.points_um) EXPECT_LE(std::abs(p.z - height({p.x, p.y})), 0.5 + 1e-9);  // half a slice
    const PointFit fit = fit_points(found.points_um, std::vector(found.points_um.size(), found.sigma_um));
    double square = 0;
    int n = 0;
    for (double y = 2; y < 23; y += 0.9)
      for (double x = 2; x < 28; x += 0.9, ++n) square += std::pow(fit.height_um({x, y}) - height({x, y}), 2);
    EXPECT_LT(std::sqrt(square / n), 1 / std::sqrt(12.0));  // the error of one column
  }
}

/// A slope that is no simple fraction meets slices at every height alike.
TEST(Masks, a_columns_stated_error_is_its_root_mean_square) {
  const auto askew = [](Vec2 p) { return 10 + std::numbers::sqrt2 / 3 * p.x - std::numbers::sqrt3 / 5 * p.y; };
  const VoxelPoints found = points_of_masks(masks_of(askew));
  double square = 0;
  for (const Vec3& p : found.points_um) square += std::pow(p.z - askew({p.x, p.y}), 2);
  // 3000 columns tell it to 1/sqrt(6000), were they independent
  EXPECT_NEAR(std::sqrt(square / static_cast<double>(found.points_um.size())) / found.sigma_um, 1, 0.05);
}

TEST(Masks, specks_and_bubbles_do_not_matter) {
  VoxelStack s = masks_of(slope);
  const VoxelPoints clean = points_of_masks(s);
  voxel(s, 5, 5, 2) = voxel(s, 6, 5, 2) = 1;
  voxel(s, 20, 20, 35) = voxel(s, 40, 20, 38) = voxel(s, 40, 21, 38) = 0;
  const VoxelPoints found = points_of_masks(s);
  EXPECT_EQ(found.n_voxels_left_out, 5);
  ASSERT_EQ(found.points_um.size(), clean.points_um.size());
  for (std::size_t k = 0; k < clean.points_um.size(); ++k) EXPECT_EQ(found.points_um[k].z, clean.points_um[k].z);
}

TEST(Masks, an_overhang_is_refused_by_place) {
  VoxelStack s = masks_of([](Vec2) { return 20; });
  for (int k = 8; k < 12; ++k)
    for (int i = 10; i < 20; ++i) voxel(s, i, 7, k) = 1;  // a roof
  for (int k = 8; k < 21; ++k) voxel(s, 10, 7, k) = 1;    // on a wall
  const InvalidData error = test::thrown<InvalidData>([&] { points_of_masks(s); });
  EXPECT_TRUE(has_words(error.element, "x, y = 5.75, 3.75")) << error.what();
}

TEST(Masks, with_the_gel_black_or_without_a_surface_are_refused) {
  EXPECT_THROW(points_of_masks(masks_of([](Vec2) { return 100; })), InvalidData);
  EXPECT_THROW(points_of_masks(masks_of([](Vec2) { return -1; })), InvalidData);
  VoxelStack s = masks_of([](Vec2) { return 20; });
  for (float& share : s.share) share = 1 - share;
  EXPECT_THROW(points_of_masks(s), InvalidData);
}

TEST(Masks, crests_that_the_last_slice_cuts_off_from_each_other_all_count) {
  const auto crests = [](Vec2 p) { return 39 - 8 * std::cos(2 * std::numbers::pi * p.x / 10); };
  const VoxelPoints found = points_of_masks(masks_of(crests));
  EXPECT_EQ(found.n_voxels_left_out, 0);
  int n_right = 0;
  for (const Vec3& p : found.points_um) n_right += p.x > 25;
  EXPECT_GT(n_right, 0);
}

}  // namespace
}  // namespace mbtfm::surface
