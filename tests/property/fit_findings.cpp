/// What the fit of a cell notices: nothing on a sound one, and each fault of its inputs by its own finding.
#include "mbtfm/fit/files.h"
#include "mbtfm/fit/fit_cell.h"
#include "mbtfm/tensions/findings.h"
#include "pipeline/contract/errors.h"
#include "tests/support/findings.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::fit {
namespace {

using test::fires;

/// A round cell with three fibres, whose network moves 900 beads; noise of 3 % of the largest displacement.
class FitFindings : public ::testing::Test {
 protected:
  static constexpr double kNoise = 0.03, kRadius_um = 12;
  static constexpr Vec2 kCentre_um{30, 30};

  void SetUp() override {
    cell_ = test::round_cell(kRadius_um, 11);
    test::add_ventral(cell_, 1, 5);
    test::add_ventral(cell_, 2, 8);
    test::add_ventral(cell_, 4, 9);
    pull(Eigen::Vector4d(0.06, 2.5, 1.7, 2));
    parameters_.gel = test::kGel;
    parameters_.gel.youngs_modulus_sigma_kPa = 0.4;
  }
  /// @param tensions_nN  the network's, then the fibres'
  void pull(const Eigen::VectorXd& tensions_nN, int n_beads = 900, unsigned seed = 1) {
    // chance names a missing fibre or adhesion in one sound cell of twenty: of seeds 1 to 12, in that of seed 5
    const test::TensionScene scene = test::scene_of(cell_, tensions_nN, n_beads, kNoise, seed);
    inputs_ = {.cell = cell_, .network = scene.cables.network(), .beads = scene.beads};
  }
  void without_fibre(int fibre_id) {
    std::erase_if(inputs_.cell.fibres, [=](const Fibre& f) { return f.fibre_id == fibre_id; });
    inputs_.network = mesh::generate_network(inputs_.cell, parameters_.network).network;
  }
  template <class Change>
  void each_bead(const Change& change) {
    for (Bead& bead : inputs_.beads) change(bead);
  }
  /// A further force on the gel.
  void push(Vec2 at_um, Vec2 force_nN) {
    const auto gel = greens::make_greens(test::kGel, {.model = substrate::ModelKind::layer}, 1);
    const Eigen::VectorXd u = gel->compliance_um_per_nN(points_of(inputs_.beads), {{at_um, 0.4, 0.4, 0}}) *
                              Eigen::Vector2d(force_nN.x, force_nN.y);
    for (std::size_t i = 0; i < inputs_.beads.size(); ++i) {
      const auto row = 2 * static_cast<Eigen::Index>(i);
      inputs_.beads[i].displacement_um += Vec2{u[row], u[row + 1]};
    }
  }
  /// A corner of the image out of focus.
  void blur_a_corner() {
    test::Normal normal(3);
    each_bead([&](Bead& b) {
      if (b.position_um.x > 21 || b.position_um.y > 21) return;
      b.displacement_um += 3 * b.sigma_um * Vec2{normal(), normal()};
    });
  }
  std::vector<Finding> found() const { return report_of(fit_cell(inputs_, parameters_, 2)).findings; }

  Cell cell_;
  Inputs inputs_;
  Parameters parameters_;
};

TEST_F(FitFindings, a_sound_cell_has_none) {
  const std::vector<Finding> of_sound = found();
  EXPECT_TRUE(of_sound.empty()) << test::ids_of(of_sound);
  test::expect_silent({"common-motion", "channel-shift", "misfit", "large-strain"}, of_sound);
  test::expect_silent({"noise-unknown", "noise-understated", "misfit-in-a-region", "misfit-near-adhesions",
                       "adhesions-without-beads", "cell-cut"},
                      of_sound);
  test::expect_silent(
      {"missing-fibre", "missing-adhesion", "fibre-without-tension", "not-identifiable", "wide-interval"}, of_sound);
  test::expect_silent({"wide-interval", "mesh-error", "forces-out-of-balance", "assumed-input"}, of_sound);
}

TEST_F(FitFindings, a_gel_that_grew_between_the_images_is_named_and_taken_off) {
  each_bead([](Bead& b) { b.displacement_um += 0.003 * (b.position_um - kCentre_um); });
  EXPECT_TRUE(fires("common-motion", found()));
}

/// The image of a lens that distorts by 0.7 % at the border.
TEST_F(FitFindings, a_motion_of_all_beads_that_is_not_even_is_named) {
  each_bead([](Bead& b) {
    const Vec2 d = 1.0 / 27 * (b.position_um - kCentre_um);
    b.displacement_um += 0.2 * dot(d, d) * d;
  });
  EXPECT_TRUE(fires("common-motion", "uneven motion", found()));
}

TEST_F(FitFindings, a_cell_beside_its_place_on_the_beads_is_moved_there_and_named) {
  each_bead([](Bead& b) { b.position_um += Vec2{0.6, -0.4}; });
  EXPECT_TRUE(fires("channel-shift", found()));
}

TEST_F(FitFindings, beads_of_a_mirrored_image_are_not_explained) {
  each_bead([](Bead& b) {
    b.position_um.x = 2 * kCentre_um.x - b.position_um.x;
    b.displacement_um.x *= -1;
  });
  EXPECT_TRUE(fires("misfit", "it is wrong", found()));
}

TEST_F(FitFindings, a_fibre_that_was_not_segmented_is_named_and_its_displacement_unexplained) {
  without_fibre(1);
  const std::vector<Finding> findings = found();
  EXPECT_TRUE(fires("missing-fibre", findings));
  EXPECT_TRUE(fires("misfit", "No forces at the adhesions", findings));
}

TEST_F(FitFindings, a_force_away_from_all_adhesions_is_named) {
  push(kCentre_um + Vec2{1, -5}, {2, 0});
  push(kCentre_um + Vec2{7, -5}, {-2, 0});
  EXPECT_TRUE(fires("missing-adhesion", found()));
}

TEST_F(FitFindings, a_fibre_is_held_where_the_beads_show_its_adhesion) {
  constexpr int kMissed = 5;
  const Vec2 missed_um = cell_.adhesions[kMissed - 1].position_um;
  std::erase_if(inputs_.cell.adhesions, [](const Adhesion& a) { return a.adhesion_id == kMissed; });
  inputs_.cell.fibres.front().end_adhesion_id.reset();
  inputs_.network = mesh::generate_network(inputs_.cell, parameters_.network).network;
  const FittedCell fitted = fit_cell(inputs_, parameters_, 2);
  const std::vector<MissingAdhesion>& missing = fitted.checks.missing_adhesions;
  ASSERT_EQ(missing.size(), 1u);
  EXPECT_LE(norm(missing.front().position_um - missed_um), 1) << "places are a micrometre apart";
  const Cell& held = fitted.ready.scene.cell;
  EXPECT_EQ(held.adhesions.back().origin, AdhesionOrigin::beads);
  EXPECT_EQ(held.fibres.front().end_adhesion_id, held.adhesions.back().adhesion_id);
  const Tension& fibre = *std::ranges::find(fitted.found.tensions, 1, &Tension::fibre_id);
  EXPECT_LE(std::abs(fibre.tension_nN - 2.5), 3 * fibre.sigma_nN.value());
  EXPECT_LE(fibre.sigma_nN.value(), 0.5) << "and is known";
}

/// As if the picture of the adhesions were another cell's.
TEST_F(FitFindings, adhesions_are_not_added_where_most_are_missing) {
  std::erase_if(inputs_.cell.adhesions, [](const Adhesion& a) { return a.adhesion_id % 4 != 2; });
  inputs_.cell.fibres.clear();
  inputs_.network = mesh::generate_network(inputs_.cell, parameters_.network).network;
  const FittedCell fitted = fit_cell(inputs_, parameters_, 2);
  EXPECT_FALSE(fitted.checks.missing_adhesions.empty());
  EXPECT_EQ(fitted.ready.scene.cell.adhesions.size(), inputs_.cell.adhesions.size());
  EXPECT_TRUE(fires("misfit", report_of(fitted).findings));
}

/// What a force that has its finding leaves around it is no second cause; what is left at another place is.
TEST_F(FitFindings, what_is_left_beside_a_named_force_is_open_only_if_more_is_left_elsewhere) {
  const auto is_open_among = [](const std::vector<Finding>& findings, const std::string& id) {
    return std::ranges::any_of(findings, [&](const Finding& f) { return f.id == id && is_open(f); });
  };
  const Vec2 places[] = {kCentre_um + Vec2{1, -5}, kCentre_um + Vec2{7, -5}};
  push(places[0], {0, 3});
  push(places[1], {0, -3});
  test::Normal normal(2);
  each_bead([&](Bead& b) {  // nor do beads around follow any force
    if (std::ranges::any_of(places, [&](Vec2 p) { return norm(b.position_um - p) < 4; }))
      b.displacement_um += 4 * b.sigma_um * Vec2{normal(), normal()};
  });
  const std::vector<Finding> findings = found();
  EXPECT_TRUE(is_open_among(findings, "missing-adhesion"));
  EXPECT_TRUE(fires("misfit-in-a-region", findings));
  EXPECT_FALSE(is_open_among(findings, "misfit-in-a-region"));
  blur_a_corner();
  EXPECT_TRUE(is_open_among(found(), "misfit-in-a-region"));
}

TEST_F(FitFindings, a_gel_too_soft_for_small_strains_is_named) {
  each_bead([](Bead& b) {
    b.displacement_um = 8 * b.displacement_um;
    b.sigma_um *= 8;
  });
  EXPECT_TRUE(fires("large-strain", "Small-strain", found()));
}

/// Without errors, and with none far from the cell: what is left is then the only measure of itself.
TEST_F(FitFindings, beads_without_errors_are_doubted_if_none_lie_far_from_the_cell) {
  each_bead([](Bead& b) { b.sigma_um = 0; });
  EXPECT_FALSE(fires("noise-unknown", found()));
  std::erase_if(inputs_.beads, [](const Bead& b) { return norm(b.position_um - kCentre_um) > kRadius_um + 6; });
  EXPECT_TRUE(fires("noise-unknown", found()));
}

TEST_F(FitFindings, beads_that_scatter_more_than_they_state_are_named) {
  each_bead([](Bead& b) { b.sigma_um /= 1.6; });
  EXPECT_TRUE(fires("noise-understated", "as they state", found()));
}

TEST_F(FitFindings, beads_that_are_wrong_in_one_region_are_named_with_the_place) {
  blur_a_corner();
  EXPECT_TRUE(fires("misfit-in-a-region", found()));
}

/// Half of those within 2 um, by five standard errors, as beads that are matched with their neighbours.
TEST_F(FitFindings, beads_that_are_wrong_beside_adhesions_are_named) {
  const Eigen::VectorXd tensions_nN = Eigen::Vector4d(0.06, 2.5, 1.7, 2);
  constexpr unsigned kSeeds = 5;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    pull(tensions_nN, 8000, seed);
    EXPECT_FALSE(fires("misfit-near-adhesions", found())) << seed;
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> turn(0, 2 * std::numbers::pi), chance(0, 1);
    each_bead([&](Bead& b) {
      const auto is_beside = [&](const Adhesion& a) { return norm(a.position_um - b.position_um) < 2; };
      if (std::ranges::none_of(cell_.adhesions, is_beside) || chance(random) > 0.5) return;
      const double angle = turn(random);
      b.displacement_um += 5 * b.sigma_um * Vec2{std::cos(angle), std::sin(angle)};
    });
    EXPECT_TRUE(fires("misfit-near-adhesions", found())) << seed;
  }
}

TEST_F(FitFindings, adhesions_beyond_the_beads_are_named) {
  const Vec2 bare = cell_.adhesions.front().position_um;
  std::erase_if(inputs_.beads, [&](const Bead& b) { return norm(b.position_um - bare) < 6; });
  EXPECT_TRUE(fires("adhesions-without-beads", found()));
}

TEST_F(FitFindings, a_fibre_that_came_after_the_network_is_named) {
  test::add_ventral(inputs_.cell, 3, 10);
  EXPECT_TRUE(fires("fibre-without-tension", found()));
}

TEST_F(FitFindings, a_network_with_a_fibre_that_is_none_of_the_cells_is_refused) {
  inputs_.network_file = "network.vtu";
  inputs_.cell.fibres.pop_back();
  const InputError error = test::thrown<InputError>([&] { found(); });
  EXPECT_EQ(error.where, "network.vtu");
  EXPECT_TRUE(has_words(error.found, "fibre 3"));
}

TEST_F(FitFindings, a_fibre_that_was_drawn_twice_is_resolved_by_no_beads) {
  test::add_ventral(cell_, 1, 5);
  Polyline& bowed = cell_.fibres.back().points_um;
  bowed.insert(bowed.begin() + 1, 0.5 * (bowed.front() + bowed.back()) + Vec2{0.05, 0.05});
  Eigen::VectorXd tensions_nN(5);
  tensions_nN << 0.06, 1.2, 1.7, 2, 1.3;
  pull(tensions_nN);
  EXPECT_TRUE(fires("not-identifiable", found()));
}

/// The stressed image shows the relaxed gel.
TEST_F(FitFindings, beads_that_did_not_move_show_no_tension) {
  test::Normal normal(3);
  each_bead([&](Bead& b) { b.displacement_um = b.sigma_um * Vec2{normal(), normal()}; });
  const std::vector<Finding> findings = found();
  EXPECT_TRUE(fires("not-identifiable", "actin network", findings)) << test::ids_of(findings);
}

/// As of a weak fibre under much noise.
TEST_F(FitFindings, an_interval_wider_than_twice_its_tension_is_named) {
  const FittedCell cell = fit_cell(inputs_, parameters_, 2);
  std::vector<Tension> tensions = cell.found.tensions;
  const auto of_these = [&] {
    return tensions::findings_of({cell.fit, cell.fit.data, cell.seen, cell.found.summary, tensions,
                                  cell.checks.missing_fibres, cell.checks.missing_adhesions, cell.motions.common,
                                  cell.motions.curved, cell.motions.placement, cell.ready.beyond,
                                  cell.ready.decisions.strain, true});
  };
  EXPECT_FALSE(fires("wide-interval", of_these()));
  tensions.back().low_nN = 0;
  tensions.back().high_nN = 3 * tensions.back().tension_nN;
  EXPECT_TRUE(fires("wide-interval", of_these()));
}

/// Along a fibre that was drawn where there is none the gel is pushed apart.
TEST_F(FitFindings, a_fibre_that_would_have_to_push_is_at_zero) {
  const Vec2 from = cell_.adhesions[3].position_um, to = cell_.adhesions[8].position_um;
  const Vec2 along = (4 / norm(to - from)) * (to - from);
  push(from, -1 * along);
  push(to, along);
  EXPECT_TRUE(fires("wide-interval", "are zero", found()));
}

TEST_F(FitFindings, one_mesh_and_a_modulus_without_an_error_are_named) {
  parameters_.fit.n_meshes = 1;
  parameters_.gel.youngs_modulus_sigma_kPa.reset();
  const std::vector<Finding> findings = found();
  EXPECT_TRUE(fires("mesh-error", "One mesh", findings));
  EXPECT_TRUE(fires("assumed-input", "youngs_modulus_sigma_kPa", findings));
}

/// No input makes these: a fault of the program would.
TEST_F(FitFindings, forces_and_torques_out_of_balance_are_named) {
  const FittedCell cell = fit_cell(inputs_, parameters_, 2);
  const auto of = [&](const tensions::EnsembleFit& fit) {
    return tensions::findings_of({fit, cell.fit.data, cell.seen, cell.found.summary, cell.found.tensions,
                                  cell.checks.missing_fibres, cell.checks.missing_adhesions, cell.motions.common,
                                  cell.motions.curved, cell.motions.placement, cell.ready.beyond,
                                  cell.ready.decisions.strain, true});
  };
  tensions::EnsembleFit pushed = cell.fit, turned = cell.fit;
  pushed.forces.nN[0] += 1e-5 * cell.fit.total_force_nN.value;
  turned.forces.torques_nN_um[0] += 1e-5 * cell.fit.forces.torques_nN_um.cwiseAbs().sum();
  EXPECT_TRUE(fires("forces-out-of-balance", "forces", of(pushed)));
  EXPECT_FALSE(fires("forces-out-of-balance", "torques", of(pushed)));
  EXPECT_TRUE(fires("forces-out-of-balance", "torques", of(turned)));
  EXPECT_FALSE(fires("forces-out-of-balance", "forces", of(turned)));
}

}  // namespace
}  // namespace mbtfm::fit
