#include "mbtfm/fit/readings.h"
#include "mbtfm/fit/ready_cell.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "substrate/choice/factory.h"
#include "tests/support/findings.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::fit {
namespace {

constexpr double kSide_um = 60;  ///< of the images

/// A cell without any symmetry, and what its forces do to beads: exact but for noise of a fiftieth of the largest.
struct Scene {
  Parameters parameters;
  std::unique_ptr<substrate::Substrate> gel;
  Cell cell;
  DisplacementField beads;
  double noise_um = 0;
  Eigen::VectorXd forces_nN;  ///< of one pattern: its size is the only unknown

  GelUnderCell on() const { return {.gel = *gel, .cell = cell, .parameters = parameters, .threads = 2}; }
};

Scene scene_with_noise() {
  Scene scene;
  scene.parameters.gel = test::kGel;
  scene.gel = choice::make_substrate(scene.parameters.gel, scene.parameters.substrate, 2);
  scene.cell = test::round_cell(12, 11);
  scene.cell.adhesions.erase(scene.cell.adhesions.begin() + 3);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0, 1);
  scene.forces_nN.resize(2 * static_cast<Eigen::Index>(scene.cell.adhesions.size()));
  Eigen::Index row = 0;
  for (Adhesion& a : scene.cell.adhesions) {
    a.position_um += Vec2{-4 + 1.5 * normal(random), 3 + 1.5 * normal(random)};
    const Vec2 inward = (1.0 / 12) * (Vec2{26, 33} - a.position_um);
    const double size_nN = 4 * std::exp(0.5 * normal(random));
    scene.forces_nN.segment<2>(row) << size_nN * inward.x, size_nN * inward.y;
    row += 2;
  }
  for (int i = 0; i < 2000; ++i) {
    const double x = std::generate_canonical<double, 53>(random), y = std::generate_canonical<double, 53>(random);
    scene.beads.push_back({.position_um = {kSide_um * x, kSide_um * y}});
  }
  const Eigen::VectorXd u = response_of(scene.on(), scene.beads)->displace(scene.forces_nN);
  const double sigma_um = scene.noise_um = 0.02 * u.cwiseAbs().maxCoeff();
  for (std::size_t i = 0; i < scene.beads.size(); ++i) {
    const auto at = 2 * static_cast<Eigen::Index>(i);
    scene.beads[i].displacement_um = {u[at] + sigma_um * normal(random), u[at + 1] + sigma_um * normal(random)};
    scene.beads[i].sigma_um = sigma_um;
  }
  return scene;
}

DisplacementField changed(DisplacementField beads, const std::function<void(Bead&)>& change) {
  for (Bead& b : beads) change(b);
  return beads;
}

TEST(Readings, name_the_way_in_which_images_or_tables_lie_wrong) {
  const Scene scene = scene_with_noise();
  struct Case {
    const char* says;
    std::function<void(Bead&)> wrong;
  };
  const Case cases[] = {
      {"mirrored from left to right",
       [](Bead& b) {
         b.position_um.x = kSide_um - b.position_um.x;
         b.displacement_um.x *= -1;
       }},
      {"mirrored from top to bottom",
       [](Bead& b) {
         b.position_um.y = kSide_um - b.position_um.y;
         b.displacement_um.y *= -1;
       }},
      {"turned by 180 degrees",
       [](Bead& b) {
         b.position_um = Vec2{kSide_um, kSide_um} - b.position_um;
         b.displacement_um = -1 * b.displacement_um;
       }},
      {"turned by 90 degrees to the left",  // of images turned to the right, where +x becomes +y, downwards
       [](Bead& b) {
         b.position_um = {kSide_um - b.position_um.y, b.position_um.x};
         b.displacement_um = {-b.displacement_um.y, b.displacement_um.x};
       }},
      {"turned by 90 degrees to the right",
       [](Bead& b) {
         b.position_um = {b.position_um.y, kSide_um - b.position_um.x};
         b.displacement_um = {b.displacement_um.y, -b.displacement_um.x};
       }},
      {"transposed (rows",
       [](Bead& b) {
         std::swap(b.position_um.x, b.position_um.y);
         std::swap(b.displacement_um.x, b.displacement_um.y);
       }},
      {"uy (or ux) gets the other sign", [](Bead& b) { b.displacement_um.x *= -1; }},
      {"uy (or ux) gets the other sign", [](Bead& b) { b.displacement_um.y *= -1; }},
      {"ux and uy are exchanged", [](Bead& b) { std::swap(b.displacement_um.x, b.displacement_um.y); }},
  };
  for (const Case& c : cases) {
    const Reading reading = best_reading(scene.on(), changed(scene.beads, c.wrong), scene.forces_nN, scene.noise_um);
    EXPECT_TRUE(has_words(reading.what, c.says)) << c.says << ", but";
    EXPECT_TRUE(test::fires("wrong-orientation", noticed_reading(Symptom::read_otherwise, reading))) << c.says;
  }
}

TEST(Readings, name_the_factor_of_places_that_are_in_another_unit) {
  const Scene scene = scene_with_noise();
  for (const double factor : {0.5, 2.0, 10.0}) {
    const Reading reading =
        best_reading(scene.on(), changed(scene.beads, [&](Bead& b) { b.position_um = factor * b.position_um; }),
                     scene.forces_nN, scene.noise_um);
    const std::string before = "once the places of the beads are multiplied by ";
    ASSERT_EQ(reading.what.find(before), 0u) << reading.what;
    // the steps of the search are 2 %
    EXPECT_NEAR(std::stod(reading.what.substr(before.size())) * factor, 1, 0.02);
    EXPECT_GT(reading.unexplained_as_is, 2 * reading.unexplained_share) << factor;
  }
}

TEST(Readings, name_a_field_that_was_smoothed) {
  const Scene scene = scene_with_noise();
  constexpr double kSigma_um = 2;
  DisplacementField smooth = scene.beads;
  for (Bead& b : smooth) {
    Vec2 sum;
    double weight = 0;
    for (const Bead& other : scene.beads) {
      const Vec2 d = other.position_um - b.position_um;
      const double w = std::exp(-dot(d, d) / (2 * kSigma_um * kSigma_um));
      sum += w * other.displacement_um;
      weight += w;
    }
    b.displacement_um = (1 / weight) * sum;
  }
  const auto of = [&](const DisplacementField& beads) {
    return best_smoothing(data_of(scene.on(), beads), scene.forces_nN, scene.noise_um);
  };
  const Reading reading = of(smooth);
  EXPECT_TRUE(has_words(reading.what, "over 4 um"));
  EXPECT_TRUE(test::fires("field-smoothed", noticed_reading(Symptom::field_smoothed, reading)));
  const Reading of_sharp = of(scene.beads);
  EXPECT_FALSE(test::fires("field-smoothed", noticed_reading(Symptom::field_smoothed, of_sharp))) << of_sharp.what;
}

TEST(Readings, find_nothing_better_where_the_reading_is_right_and_the_model_lacks_an_adhesion) {
  Scene scene = scene_with_noise();
  scene.cell.adhesions.pop_back();
  const Reading reading =
      best_reading(scene.on(), scene.beads,
                   scene.forces_nN.head(2 * static_cast<Eigen::Index>(scene.cell.adhesions.size())), scene.noise_um);
  EXPECT_FALSE(test::fires("wrong-orientation", noticed_reading(Symptom::read_otherwise, reading))) << reading.what;
}

}  // namespace
}  // namespace mbtfm::fit
