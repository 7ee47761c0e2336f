#include "mbtfm/tensions/missing_adhesions.h"

#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/fit_results.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

using test::TensionScene;

constexpr Vec2 kPlaces[] = {{26, 33}, {35, 27}};  // away from all adhesions
constexpr Vec2 kMissing_nN{1.8, -1.2};

/// A round cell with two fibres and, where asked for, two balanced forces that no adhesion bears.
struct Hidden {
  Cell cell = test::round_cell(12, 9);
  TensionScene scene;

  Hidden() : scene(scene_of(with_fibres(cell))) {}

  static Cell& with_fibres(Cell& cell) {
    test::add_ventral(cell, 1, 5);
    test::add_ventral(cell, 2, 7);
    return cell;
  }
  static TensionScene scene_of(const Cell& cell) {
    return test::scene_of(cell, Eigen::Vector3d(0.1, 6, 3), 1500, 0.05, 5);
  }
  void hide_forces() {
    std::vector<substrate::Ellipse> discs;
    for (const Vec2 place : kPlaces)
      discs.push_back({.centre_um = place, .semi_major_um = 0.6, .semi_minor_um = 0.4, .angle_rad = 1});
    const auto gel = greens::make_greens(test::kGel, {.model = substrate::ModelKind::layer}, 1);
    const Eigen::Vector4d forces(kMissing_nN.x, kMissing_nN.y, -kMissing_nN.x, -kMissing_nN.y);
    scene.displacement_um += gel->compliance_um_per_nN(scene.points_um, discs) * forces;
  }
  std::vector<MissingAdhesion> found(unsigned seed, double noise = 0.05) {
    test::measure(scene, noise, seed);
    return missing_adhesions(test::fit_to(test::with_motions(scene, scene.beads), scene), cell, test::kGel, 1);
  }
};

TEST(MissingAdhesions, forces_that_no_adhesion_bears_are_found_where_they_act) {
  Hidden hidden;
  hidden.hide_forces();
  const auto found = hidden.found(1, 0.02);
  ASSERT_EQ(found.size(), 2u);
  for (const Vec2 place : kPlaces) {
    const auto at = std::ranges::min_element(found, {}, [&](const auto& m) { return norm(m.position_um - place); });
    EXPECT_LE(norm(at->position_um - place), 1.5) << "places are a micrometre apart";
    EXPECT_NEAR(std::abs(dot(at->force_nN, kMissing_nN)), dot(kMissing_nN, kMissing_nN),
                0.5 * dot(kMissing_nN, kMissing_nN));
  }
}

TEST(MissingAdhesions, noise_calls_for_none_in_ninety_nine_cells_of_a_hundred) {
  Hidden sound;
  int n_named = 0;
  constexpr int kDraws = 400;
  for (unsigned seed = 1; seed <= kDraws; ++seed) n_named += !sound.found(seed).empty();
  EXPECT_LE(n_named, 9) << "at a chance of 1 in 100, more than 9 of 400 once in 120";
}

TEST(MissingAdhesions, a_cell_without_room_or_beads_has_none) {
  Hidden sound;
  sound.cell.outline_um = {{0, 0}, {0.1, 0}, {0.1, 0.1}};
  EXPECT_TRUE(sound.found(1).empty());
}

}  // namespace
}  // namespace mbtfm::tensions
