#include <Eigen/Geometry>

#include "mbtfm/tensions/error_budget.h"
#include "mbtfm/tensions/placement.h"
#include "mbtfm/tensions/series.h"
#include "tests/support/layer_data.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

using test::TensionScene;

/// A round cell with two fibres whose images lie off its beads.
struct ShiftedCell {
  Cell cell;  ///< as the images have it
  TensionScene scene;
  Placement truth;

  LinearData data_of(const DisplacementField& beads) const { return test::data_on_layer(beads, cell, test::kGel); }

  /// Fitted on the network that made the forces.
  std::pair<EnsembleFit, FoundPlacement> fit(Switch setting = Switch::automatic) const {
    return fit_on(scene.cables.network(), setting);
  }

  std::pair<EnsembleFit, FoundPlacement> fit_on(const Network& network, Switch setting = Switch::automatic) const {
    std::vector<cables::CableNetwork> networks;
    networks.emplace_back(network, scene.cables.parameters());
    LinearData data = data_of(scene.beads);
    const Trial start = uniform_start({networks.front(), data.reduced, scene.adhesion_ids});
    PlacedCell place = place_cell(
        cell, networks.front(), scene.beads, data, [&](const DisplacementField& at) { return data_of(at); }, test::kGel,
        {}, start, setting, 1);
    EnsembleFit found = fit_ensemble(networks, std::move(place.data), scene.adhesion_ids, {}, 1);
    if (!place.effect.is_on) return {std::move(found), {place.placement, Eigen::Vector3d::Zero()}};
    const MotionsBeside motions = motions_beside(found.data, found);
    return {std::move(found), placement_among(motions, place.placement)};
  }
};

ShiftedCell shifted_cell(Vec2 shift_um, double turn_rad, double noise, unsigned seed) {
  Cell cell = test::round_cell(12, 9, {{1, 5}, {2, 7}});
  ShiftedCell result{.cell = cell,
                     .scene = test::scene_of(cell, Eigen::Vector3d(0.1, 6, 3), 900, noise, 5),
                     .truth = {.centre_um = {30, 30}, .shift_um = shift_um, .turn_rad = turn_rad}};
  // the beads and what they do lie elsewhere
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  TensionScene& scene = result.scene;
  for (std::size_t i = 0; i < scene.points_um.size(); ++i) {
    scene.points_um[i] = result.truth.of(scene.points_um[i]);
    auto u = scene.displacement_um.segment<2>(2 * static_cast<Eigen::Index>(i));
    u = Eigen::Vector2d(c * u[0] - s * u[1], s * u[0] + c * u[1]);
  }
  test::measure(scene, noise, seed);
  return result;
}

TEST(Placement, motions_are_the_derivatives_of_the_displacement) {
  const Cell cell = test::round_cell(12, 7);
  std::vector<Vec2> beads;
  for (int i = 0; i < 400; ++i) beads.push_back({13 + 1.7 * (i % 20), 13 + 1.7 * (i / 20)});
  Eigen::VectorXd forces(14);
  for (int i = 0; i < 14; ++i) forces[i] = std::sin(1 + i);
  const auto model = [&](const Placement& at) -> Eigen::VectorXd {
    DisplacementField places;
    for (const Vec2 p : beads) places.push_back({.position_um = p});
    const auto gel = greens::make_greens(test::kGel, {.model = substrate::ModelKind::half_space}, 1);
    const Eigen::VectorXd seen =
        gel->compliance_um_per_nN(points_of(in_cell_frame(places, at)), substrate::ellipses_of(cell.adhesions)) *
        forces;
    Eigen::VectorXd u(seen.size());
    for (Eigen::Index row = 0; row < seen.size(); row += 2)
      u.segment<2>(row) = Eigen::Rotation2Dd(at.turn_rad) * seen.segment<2>(row);
    return u;
  };
  const Vec2 centre{30, 30};
  const Eigen::MatrixXd motions = placement_motions(test::kGel, substrate::ellipses_of(cell.adhesions), forces, beads,
                                                    model({.centre_um = centre}), centre, 2);
  constexpr double kStep = 1e-3;
  const Placement steps[] = {{centre, {kStep, 0}, 0}, {centre, {0, kStep}, 0}, {centre, {}, kStep}};
  for (int k = 0; k < 3; ++k) {
    const Placement back{centre, -1 * steps[k].shift_um, -steps[k].turn_rad};
    const Eigen::VectorXd wanted = (model(steps[k]) - model(back)) / (2 * kStep);
    // beyond four semi-axes a point force's: (1/4)² / 2 of a part that is small
    EXPECT_LE((motions.col(k) - wanted).norm(), 0.01 * wanted.norm()) << k;
  }
}

TEST(Placement, what_carries_a_bead_changes_its_displacement_by_as_much_as_the_field_differs) {
  const Cell cell = test::round_cell(12, 7);
  constexpr double kWay_um = 0.4;  // the adhesions' radius a
  std::vector<Vec2> beads, carried;
  Eigen::VectorXd by(800), forces(14);
  for (int i = 0; i < 400; ++i) {
    const Vec2 way{kWay_um * std::sin(3 * i), kWay_um * std::cos(3 * i)};
    beads.push_back({13 + 1.7 * (i % 20), 13 + 1.7 * (i / 20)});
    carried.push_back(beads.back() + way);
    by.segment<2>(2 * i) << way.x, way.y;
  }
  for (int i = 0; i < 14; ++i) forces[i] = std::sin(1 + i);
  const auto gel = greens::make_greens(test::kGel, {.model = substrate::ModelKind::half_space}, 1);
  const std::vector<substrate::Ellipse> ellipses = substrate::ellipses_of(cell.adhesions);
  const Eigen::VectorXd wanted =
      (gel->compliance_um_per_nN(carried, ellipses) - gel->compliance_um_per_nN(beads, ellipses)) * forces;
  // Exact near an adhesion. From r = 4 a on by the slope halfway, which leaves way² / (4 r²) of 1/r.
  EXPECT_LE((carried_um(test::kGel, ellipses, forces, beads, by, 2) - wanted).norm(), 1.0 / 64 * wanted.norm());
}

TEST(Placement, frames_are_each_others_inverse) {
  const Placement placement{.centre_um = {30, 20}, .shift_um = {0.4, -0.7}, .turn_rad = 0.3};
  const DisplacementField beads = {{.position_um = {3, 4}, .displacement_um = {0.1, -0.2}}};
  const DisplacementField seen = in_cell_frame(beads, placement);
  EXPECT_LE(norm(placement.of(seen[0].position_um) - beads[0].position_um), 1e-13);
  const DisplacementField back = in_bead_frame(seen, beads, placement);
  EXPECT_LE(norm(back[0].displacement_um - beads[0].displacement_um), 1e-15);
}

TEST(Placement, wherever_the_images_say_the_cell_lies_the_tensions_are_the_same) {
  const auto [still, no_shift] = shifted_cell({}, 0, 0.03, 4).fit();
  for (const Vec2 shift : {Vec2{0.3, -0.2}, Vec2{-1, 0.6}}) {
    const ShiftedCell off = shifted_cell(shift, 0.01, 0.03, 4);
    const auto [fit, found] = off.fit();
    EXPECT_LE((values_of(fit) - values_of(still)).norm(), 0.3 * std::sqrt(still.tensions.covariance_nN2.trace()))
        << "what is left of the shift is linear to a fraction of the error";
    EXPECT_LE(norm(found.placement.shift_um - shift - no_shift.placement.shift_um), 0.5 * found.sigma.head(2).norm());
    EXPECT_NEAR(found.placement.turn_rad, 0.01 + no_shift.placement.turn_rad, 0.5 * found.sigma[2]);
  }
}

/// Forces that are not the truth's make a field that tells too little of each step: the rest is found by further ones.
/// A cell where it should be tells what noise and the other network make of its place.
TEST(Placement, is_found_whole_on_a_network_that_is_not_the_cells_own) {
  mesh::NetworkParameters other = test::thesis_network();
  other.edge_length_um = 2;
  constexpr unsigned kSeeds = 4;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const ShiftedCell still = shifted_cell({}, 0, 0.03, seed);
    const Network network = mesh::generate_network(still.cell, other).network;
    const FoundPlacement at_rest = still.fit_on(network).second;
    for (const double turn_rad : {0.02, -0.05}) {
      const FoundPlacement found = shifted_cell({0.1, 0}, turn_rad, 0.03, seed).fit_on(network).second;
      const Vec2 shift = found.placement.of({30, 30}) - at_rest.placement.of({30, 30});
      // at rest up to two standard errors by noise are left to one step, which misses a third of them at most
      EXPECT_NEAR(found.placement.turn_rad - at_rest.placement.turn_rad, turn_rad, 2.0 / 3 * found.sigma[2]) << seed;
      EXPECT_NEAR(shift.x, 0.1, 2.0 / 3 * found.sigma[0]) << seed;
      EXPECT_NEAR(shift.y, 0, 2.0 / 3 * found.sigma[1]) << seed;
    }
  }
}

/// Where the field is steep, beside the adhesions, a bead that is followed wrongly wants the cell elsewhere: one that
/// is far off, and one that is off by so little that much of it looks like a force and a shift.
TEST(Placement, stray_beads_near_adhesions_do_not_move_the_cell) {
  mesh::NetworkParameters other = test::thesis_network();
  other.edge_length_um = 2;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const ShiftedCell off = shifted_cell({0.3, -0.2}, 0.01, 0.03, seed);
    const Network network = mesh::generate_network(off.cell, other).network;
    const FoundPlacement sound = off.fit_on(network).second;
    const DisplacementField beads = in_cell_frame(off.scene.beads, off.truth);
    for (const double by_um : {3 * off.scene.largest_um, 7 * 0.03 * off.scene.largest_um}) {
      ShiftedCell astray = off;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2 adhesion = off.cell.adhesions[2 * k].position_um;
        const auto distance = [&](const Bead& bead) { return norm(bead.position_um - adhesion); };
        const auto nearest = std::ranges::min_element(beads, {}, distance) - beads.begin();
        astray.scene.beads[nearest].displacement_um += {0, by_um};
      }
      const FoundPlacement found = astray.fit_on(network).second;
      // the loss that the fit itself takes leaves a part of each
      EXPECT_LE(norm(found.placement.shift_um - sound.placement.shift_um), 2.0 / 3 * sound.sigma.head<2>().norm())
          << seed << " " << by_um;
    }
  }
}

TEST(Placement, is_found_within_its_stated_error) {
  constexpr int kDraws = 40;
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (unsigned seed = 1; seed <= kDraws; ++seed) {
    const ShiftedCell off = shifted_cell({0.2, 0.1}, 0.005, 0.05, seed);
    const auto [fit, found] = off.fit();
    const Placement& p = found.placement;
    // the same place, told of another centre
    const Vec2 shift = p.of(off.truth.centre_um) - off.truth.centre_um;
    const Eigen::Vector3d error(shift.x - 0.2, shift.y - 0.1, p.turn_rad - 0.005);
    squares += error.cwiseQuotient(found.sigma).cwiseAbs2() / kDraws;
  }
  // a mean of 40 squared normal numbers has a standard deviation of .22
  for (const double square : squares) EXPECT_NEAR(square, 1, 4 * 0.22);
}

TEST(Placement, beads_that_do_not_determine_it_leave_the_cell_where_it_is) {
  const ShiftedCell noisy = shifted_cell({0.2, 0.1}, 0, 3, 1);
  const LinearData data = noisy.data_of(noisy.scene.beads);
  const Trial start = uniform_start({noisy.scene.cables, data.reduced, noisy.scene.adhesion_ids});
  const auto place = [&](Switch setting) {
    return place_cell(
        noisy.cell, noisy.scene.cables, noisy.scene.beads, data,
        [&](const DisplacementField& at) { return noisy.data_of(at); }, test::kGel, {}, start, setting, 1);
  };
  for (const Switch setting : {Switch::automatic, Switch::off}) {
    const PlacedCell stays = place(setting);
    EXPECT_FALSE(stays.effect.is_on) << name_of(setting);
    EXPECT_EQ(norm(stays.placement.shift_um), 0) << name_of(setting);
    EXPECT_EQ(stays.data.motions.shapes.cols(), 6) << name_of(setting);
  }
}

TEST(Placement, its_part_of_an_error_is_what_beads_would_show_more_if_it_were_known) {
  const ShiftedCell still = shifted_cell({}, 0, 0.05, 3);
  std::vector<cables::CableNetwork> networks;
  networks.emplace_back(still.scene.cables.network(), still.scene.cables.parameters());
  const LinearData known = still.data_of(still.scene.beads);
  const EnsembleFit with_known = test::fit_to(known, still.scene);
  const Eigen::VectorXd& forces = with_known.forces.nN;
  const LinearData unknown =
      with_more_motions(known, placement_motions(test::kGel, still.scene.ellipses, forces, still.scene.points_um,
                                                 known.response->displace(forces), {30, 30}, 1));
  const EnsembleFit fit = fit_ensemble(networks, unknown, still.scene.adhesion_ids, {}, 1);
  const ErrorBudget budget = error_budget(
      {.fit = fit, .data = fit.data, .networks = networks, .cell = still.cell, .gel = test::kGel, .n_of_place = 3}, 1);
  const auto noise = [](const EnsembleFit& of) -> Eigen::VectorXd {
    return of.meshes.front().noise_covariance_nN2.diagonal() / of.misfit.variance;
  };
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double more = fit.misfit.variance * (noise(fit)[i] - noise(with_known)[i]);
    ASSERT_TRUE(budget.tensions[i].parts_nN.place);
    // the two fits end at tensions that differ by a fraction of an error
    EXPECT_NEAR(std::pow(*budget.tensions[i].parts_nN.place, 2), more, 0.1 * more) << i;
    EXPECT_GT(more, 0);
  }
}

TEST(Placement, frames_of_a_series_hold_the_error_of_the_place) {
  const ShiftedCell shifted = shifted_cell({}, 0, 0.05, 4);
  std::vector<cables::CableNetwork> networks;
  networks.emplace_back(shifted.scene.cables.network(), shifted.scene.cables.parameters());
  const LinearData data = shifted.data_of(shifted.scene.beads);
  const std::pair<EnsembleFit, FoundPlacement> known = shifted.fit(Switch::on);
  const EnsembleFit& single = known.first;
  const Trial start = next_start(single);
  const auto frame_fit = [&](const AllowMore& allow) {
    return fit_series({{.frame = 1, .beads = shifted.scene.beads}}, networks, data.response, {},
                      shifted.scene.adhesion_ids, {}, true, false, 1, start, {}, allow)
        .front();
  };
  const FrameFit held = frame_fit({});
  const FrameFit allowed = frame_fit([&](LinearData frame, const Eigen::VectorXd& forces_nN) {
    return with_place(std::move(frame), shifted.cell, test::kGel, forces_nN, known.second.placement.centre_um, 1);
  });
  for (std::size_t i = 0; i < single.tensions.nN.size(); ++i) {
    // the forces whose motions are allowed are those of a rough fit here, of the fit's end there
    EXPECT_NEAR(*allowed.tensions[i].sigma_nN, single.tensions.nN[i].standard_error,
                0.02 * *allowed.tensions[i].sigma_nN)
        << i;
    EXPECT_GT(*allowed.tensions[i].sigma_nN, *held.tensions[i].sigma_nN) << i;
  }
  EXPECT_GT(allowed.total_force_nN.standard_error, held.total_force_nN.standard_error);
}

TEST(Placement, added_motions_reduce_as_if_they_had_been_there_from_the_first) {
  const TensionScene scene = test::tension_scene("case_21", 80, 0.05, 7);
  const Eigen::MatrixXd affine = affine_motions(scene.beads);
  const LinearData once = reduce(scene.beads, substrate::dense_response(scene.compliance_um_per_nN), {}, 1, affine);
  const LinearData twice = with_more_motions(
      reduce(scene.beads, substrate::dense_response(scene.compliance_um_per_nN), {}, 1, affine.leftCols(2)),
      affine.rightCols(4));
  EXPECT_EQ(once.n_used, twice.n_used);
  EXPECT_NEAR(once.reduced.floor_squared, twice.reduced.floor_squared, 1e-9 * once.reduced.floor_squared);
  const Eigen::VectorXd forces = scene.forces_nN;
  EXPECT_NEAR((displace(once.reduced, forces) - once.reduced.target).norm(),
              (displace(twice.reduced, forces) - twice.reduced.target).norm(), 1e-8 * once.reduced.target.norm());
}

}  // namespace
}  // namespace mbtfm::tensions
