/// Symmetries of traction reconstructions, and what they do at borders, with nothing and with bad input.
#include "mbtfm/tractions/fttc.h"
#include "pipeline/contract/errors.h"
#include "tests/support/ellipse_scene.h"

namespace mbtfm::tractions {
namespace {

using test::ellipse_scene;
using test::EllipseScene;
using test::forces_of;
using test::half_space;

/// Those of flat surfaces.
const std::vector<TractionMethod> kMethods = {TractionMethod::fttc, TractionMethod::sparse, TractionMethod::trpf,
                                              TractionMethod::bem, TractionMethod::adhesion_forces};

/// With what every method asks for.
TractionInputs full_inputs_of(const EllipseScene& scene) {
  TractionInputs inputs = inputs_of(scene);
  inputs.outline_um = {{8, 9}, {56, 9}, {56, 57}, {8, 57}};
  return inputs;
}

TractionParameters parameters_of(TractionMethod method) {
  TractionParameters parameters = half_space(method);
  parameters.element_um = 4;
  return parameters;
}

template <class Map>
TractionInputs mapped(TractionInputs inputs, const Map& map, Vec2 centre, double turn_rad, double mirror) {
  for (Bead& b : inputs.beads) {
    b.position_um = centre + map(b.position_um - centre);
    b.displacement_um = map(b.displacement_um);
  }
  for (Adhesion& a : inputs.adhesions) {
    a.position_um = centre + map(a.position_um - centre);
    a.angle_rad = mirror * a.angle_rad + turn_rad;
  }
  for (Vec2& corner : inputs.outline_um) corner = centre + map(corner - centre);
  return inputs;
}

template <class Map>
void expect_mapped_forces(const Map& map, double turn_rad, double mirror) {
  const EllipseScene scene = ellipse_scene(48, 0.03, 4);
  for (const TractionMethod method : kMethods) {
    const TractionInputs inputs = full_inputs_of(scene);
    const Reconstruction before = reconstruct(inputs, parameters_of(method), 1);
    const Reconstruction after = reconstruct(mapped(inputs, map, {32, 32}, turn_rad, mirror), parameters_of(method), 2);
    for (std::size_t a = 0; a < before.forces.size(); ++a) {
      const Vec2 expected = map(before.forces[a].force_nN);
      // Sums run in another order: rounding, and what iterations that stop at 1e-3 make of it.
      EXPECT_NEAR(norm(after.forces[a].force_nN - expected), 0, 2e-3 * norm(expected)) << name_of(method) << " " << a;
    }
  }
}

TEST(Tractions, a_turned_scene_has_turned_forces) {
  expect_mapped_forces([](Vec2 v) { return Vec2{-v.y, v.x}; }, std::numbers::pi / 2, 1);
}

TEST(Tractions, a_mirrored_scene_has_mirrored_forces) {
  expect_mapped_forces([](Vec2 v) { return Vec2{v.x, -v.y}; }, 0, -1);
}

TEST(Tractions, know_no_length_but_the_scenes_own) {
  // Twice as large in every length, lambda's too: tractions stay, forces grow fourfold.
  constexpr double kTwice = 2;
  const EllipseScene scene = ellipse_scene(48, 0.03, 4);
  for (const TractionMethod method : {TractionMethod::fttc, TractionMethod::trpf, TractionMethod::bem}) {
    TractionParameters parameters = parameters_of(method);
    parameters.lambda_um_per_kPa = 1;  // smooths by tens of per cent, so that a lambda in another unit shows
    const TractionInputs inputs = full_inputs_of(scene);
    TractionInputs larger = mapped(
        inputs, [](Vec2 v) { return kTwice * v; }, {32, 32}, 0, 1);
    for (Bead& b : larger.beads) b.sigma_um *= kTwice;
    for (Adhesion& a : larger.adhesions) {
      a.area_um2 *= kTwice * kTwice;
      a.major_axis_um *= kTwice;
      a.minor_axis_um *= kTwice;
    }
    const Reconstruction one = reconstruct(inputs, parameters, 1);
    parameters.lambda_um_per_kPa = kTwice;
    parameters.element_um *= kTwice;
    parameters.grow_um *= kTwice;
    const Reconstruction two = reconstruct(larger, parameters, 1);
    for (std::size_t a = 0; a < one.forces.size(); ++a) {
      const Vec2 expected = kTwice * kTwice * one.forces[a].force_nN;
      // as above; and the disc that stands for a point does not grow: (0.1 um over the beads' distance)²
      EXPECT_NEAR(norm(two.forces[a].force_nN - expected), 0, 0.01 * norm(expected)) << name_of(method) << " " << a;
    }
  }
}

TEST(Tractions, forces_are_found_on_gels_of_any_compressibility) {
  // Without noise the errors left are those of the lattice and of the ellipses' rims: the same for every gel.
  const EllipseScene scene = ellipse_scene(64, 0);
  std::vector<substrate::Ellipse> ellipses;
  std::vector<Vec2> points;
  for (const Adhesion& a : scene.adhesions) ellipses.push_back(substrate::ellipse_of(a));
  for (const Bead& b : scene.field) points.push_back(b.position_um);
  for (const GelModel model : values_of<GelModel>())
    for (const double nu : {0.0, 0.25, 0.49, 0.4999, 0.4999999}) {
      TractionInputs inputs = inputs_of(scene);
      inputs.gel = {.youngs_modulus_kPa = 8.4, .poisson_ratio = nu, .thickness_um = 20};
      const auto greens = greens::make_greens(inputs.gel, {.model = substrate::kind_of(model)}, 2);
      const std::vector<Vec2> u = greens->displacements_um(points, ellipses, scene.forces_nN);
      for (std::size_t i = 0; i < u.size(); ++i) inputs.beads[i].displacement_um = u[i];
      for (const auto& [method, most] :
           {std::pair{TractionMethod::fttc, 0.05}, {TractionMethod::adhesion_forces, 1e-6}}) {
        TractionParameters parameters = half_space(method);
        parameters.gel_model = model;
        EXPECT_LE(test::force_error(scene, forces_of(reconstruct(inputs, parameters, 2))), most)
            << name_of(method) << ", " << name_of(model) << ", nu " << nu;
      }
    }
}

TEST(Tractions, are_the_same_bits_for_any_number_of_threads) {
  TractionInputs inputs = inputs_of(ellipse_scene(32, 0.05, 8));
  inputs.outline_um = {{10, 10}, {54, 10}, {54, 54}, {10, 54}};
  TractionParameters parameters = half_space(TractionMethod::fttc);
  parameters.element_um = 6;
  for (const TractionMethod method : kMethods) {
    parameters.method = method;
    const Reconstruction one = reconstruct(inputs, parameters, 1);
    for (const int threads : {2, 4}) {
      const Reconstruction many = reconstruct(inputs, parameters, threads);
      for (std::size_t p = 0; p < one.patches.size(); ++p)
        ASSERT_EQ(many.patches[p].traction_kPa, one.patches[p].traction_kPa) << name_of(method) << ", " << threads;
      for (std::size_t a = 0; a < one.forces.size(); ++a) {
        ASSERT_EQ(many.forces[a].force_nN, one.forces[a].force_nN) << name_of(method) << ", " << threads;
        ASSERT_EQ(many.forces[a].sigma_nN, one.forces[a].sigma_nN) << name_of(method) << ", " << threads;
      }
    }
  }
}

TEST(Fttc, a_scene_turned_by_any_angle_has_the_same_forces_turned) {
  // Off the lattice's axes cells cut the ellipses otherwise: a few per cent of the force at their rims.
  const auto forces = [](double turn) {
    const Reconstruction r =
        reconstruct(inputs_of(ellipse_scene(128, 0, 1, turn)), half_space(TractionMethod::fttc), 1);
    return r.forces;
  };
  const auto straight = forces(0);
  for (const double turn : {0.3, 1.1}) {
    const auto turned = forces(turn);
    for (std::size_t a = 0; a < straight.size(); ++a) {
      const Vec2 f = straight[a].force_nN;
      const Vec2 expected{std::cos(turn) * f.x - std::sin(turn) * f.y, std::sin(turn) * f.x + std::cos(turn) * f.y};
      EXPECT_LE(norm(turned[a].force_nN - expected), 0.03 * norm(f)) << turn;
    }
  }
}

TEST(Fttc, odd_and_even_lattices_agree) {
  // Cells of another size cut the grown ellipses otherwise: as for the turned scene.
  TractionParameters parameters = half_space(TractionMethod::fttc);
  for (const double padding : {1.0, 1.5}) {
    parameters.padding = padding;
    const EllipseScene even = ellipse_scene(128, 0), odd = ellipse_scene(127, 0);
    const Reconstruction one = reconstruct(inputs_of(even), parameters, 1);
    const Reconstruction other = reconstruct(inputs_of(odd), parameters, 1);
    for (std::size_t a = 0; a < one.forces.size(); ++a)
      EXPECT_LE(norm(one.forces[a].force_nN - other.forces[a].force_nN), 0.03 * norm(one.forces[a].force_nN))
          << "padding " << padding;
  }
}

TEST(Fttc, cross_validation_smooths_more_where_there_is_more_noise) {
  double before = 0;
  for (const double noise : {0.01, 0.03, 0.1, 0.2}) {
    const EllipseScene scene = ellipse_scene(96, noise, 2, 0, 64, false);
    const LatticeProblem problem(scene.field, scene.gel, {.model = GelModel::half_space, .padding = 1.5, .threads = 1});
    TikhonovSolver solver(problem);
    const LambdaScan scan = scan_lambda(problem, solver);
    EXPECT_GT(scan.by_gcv, before);
    before = scan.by_gcv;
  }
}

TEST(Fttc, a_field_cut_at_the_border_does_not_inflate_the_contractile_moment) {
  const EllipseScene whole = ellipse_scene(128, 0.02, 6);
  const auto moment = [](const EllipseScene& scene, bool is_near) {
    TractionInputs inputs = inputs_of(scene);
    if (!is_near) inputs.adhesions.clear();
    return sums_of(reconstruct(inputs, half_space(TractionMethod::fttc), 1), inputs, 1.5).contractile_moment_nN_um();
  };
  double truth = 0;
  for (std::size_t a = 0; a < whole.forces_nN.size(); ++a)
    truth -= dot(whole.adhesions[a].position_um - Vec2{32, 32}, whole.forces_nN[a]);
  // cut 1.5 um from the outermost adhesion's rim: 48 of 64 um
  const EllipseScene cut = ellipse_scene(96, 0.02, 6, 0, 48);
  EXPECT_NEAR(moment(cut, true), moment(whole, true), 0.05 * truth);
  EXPECT_LE(moment(cut, false), 1.1 * truth);
}

TEST(Fttc, scattered_beads_and_a_lattice_show_the_same) {
  const EllipseScene scene = ellipse_scene(96, 0);
  std::vector<substrate::Ellipse> ellipses;
  for (const Adhesion& a : scene.adhesions) ellipses.push_back(substrate::ellipse_of(a));
  const auto greens = greens::make_greens(scene.gel, {.model = substrate::ModelKind::half_space}, 2);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place(0, 64);
  std::vector<Vec2> points;
  for (int i = 0; i < 10000; ++i) {
    const double x = place(random);
    points.push_back({x, place(random)});
  }
  const std::vector<Vec2> u = greens->displacements_um(points, ellipses, scene.forces_nN);
  TractionInputs inputs = inputs_of(scene);
  inputs.beads.clear();
  std::normal_distribution<double> noise(0, 0.02);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec2 error{noise(random), noise(random)};
    inputs.beads.push_back({.position_um = points[i], .displacement_um = u[i] + error, .sigma_um = 0.02});
  }
  const Reconstruction r = reconstruct(inputs, half_space(TractionMethod::fttc), 1);
  // As many beads on a lattice are the best spread they can have; chance leaves holes between scattered ones.
  const EllipseScene even = ellipse_scene(100, 0.02 / scene.largest_um, 3);
  const Reconstruction r_even = reconstruct(inputs_of(even), half_space(TractionMethod::fttc), 1);
  const double on_lattice = test::force_error(even, forces_of(r_even)),
               scattered = test::force_error(scene, forces_of(r));
  EXPECT_LE(scattered, 2 * on_lattice);
}

TEST(Tractions, where_nothing_moves_there_is_no_traction_and_that_is_said) {
  EllipseScene scene = ellipse_scene(32, 0);
  for (Bead& b : scene.field) b.displacement_um = {};
  TractionInputs inputs = inputs_of(scene);
  inputs.outline_um = {{10, 10}, {54, 10}, {54, 54}, {10, 54}};
  TractionParameters parameters = half_space(TractionMethod::fttc);
  parameters.element_um = 8;
  for (const TractionMethod method : kMethods) {
    parameters.method = method;
    const Reconstruction r = reconstruct(inputs, parameters, 1);
    for (const GroundPatch& p : r.patches) EXPECT_EQ(p.traction_kPa, (Vec2{})) << name_of(method);
    EXPECT_FALSE(r.patches.empty());
    EXPECT_TRUE(has_words(r.remark, "no bead has moved")) << name_of(method);
  }
}

TEST(Tractions, bad_input_is_named) {
  const EllipseScene scene = ellipse_scene(16, 0.05);
  const TractionInputs inputs = full_inputs_of(scene);
  const auto expect_rejected = [](const TractionInputs& bad, TractionMethod method, const std::string& word) {
    const auto error = test::caught<InvalidData>([&] { reconstruct(bad, parameters_of(method), 1); });
    ASSERT_TRUE(error) << name_of(method) << " took it: " << word;
    EXPECT_TRUE(has_words(error->what(), word)) << name_of(method) << ": " << error->what();
  };
  for (const TractionMethod method : kMethods) {
    TractionInputs bad = inputs;
    bad.beads[7].displacement_um.x = std::nan("");
    expect_rejected(bad, method, "displacement of bead 7");
    bad = inputs;
    for (const std::size_t n_beads : {1, 0}) {
      bad.beads.resize(n_beads);
      expect_rejected(bad, method, std::to_string(n_beads));
    }
  }
  for (const TractionMethod method : {TractionMethod::fttc, TractionMethod::sparse}) {
    TractionInputs bad = inputs;
    bad.beads[9].position_um = bad.beads[4].position_um;
    expect_rejected(bad, method, "position of bead 9");
    bad = inputs;
    for (Bead& b : bad.beads) b.position_um.y = 3;
    expect_rejected(bad, method, "");
  }
  TractionInputs few = inputs;
  few.beads.resize(7);
  expect_rejected(few, TractionMethod::adhesion_forces, "8 adhesions");
  expect_rejected(few, TractionMethod::trpf, "16 unknown");
}

}  // namespace
}  // namespace mbtfm::tractions
