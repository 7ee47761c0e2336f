#include "segment/beads/given_field.h"

#include <numbers>
#include <random>

#include "pipeline/contract/errors.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/text.h"
#include "segment/beads/pair_look.h"
#include "tests/support/bead_pair.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::beads {
namespace {

std::filesystem::path write(const test::TemporaryFolder& folder, const std::string& text) {
  files::write_text(folder / "field.csv", text);
  return folder / "field.csv";
}

TEST(GivenField, columns_are_mapped_and_pixels_become_um) {
  const test::TemporaryFolder folder;
  TrackParameters p;
  p.x_column = "x", p.y_column = "y", p.ux_column = "u", p.uy_column = "v", p.sigma_column = "error";
  p.length_unit = LengthUnit::px;
  p.pixel_size_um = 0.5;
  for (const char separator : {',', ';', '\t'}) {
    std::string text = "i,x,y,u,v,error\n1,0,3,2,-1,0.1\n2,9,4,1,0.5,0.2";
    std::replace(text.begin(), text.end(), ',', separator);
    const DisplacementField field = read_given_field(write(folder, text), p).field;
    ASSERT_EQ(field.size(), 2u);
    EXPECT_EQ(field[0].position_um, (Vec2{0.25, 1.75}));
    EXPECT_EQ(field[0].displacement_um, (Vec2{1, -0.5}));
    EXPECT_EQ(field[1].sigma_um, 0.1);
    EXPECT_EQ(field[0].flag, "");
  }
}

TEST(GivenField, a_grid_of_a_known_field_keeps_its_peaks_and_shows_its_noise) {
  const test::TemporaryFolder folder;
  const auto peaks = test::ring_of_adhesions(512, 8.3);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0, 0.05);
  files::CsvText csv({"x_um", "y_um", "ux_um", "uy_um"});
  for (int j = 0; j < 64; ++j)
    for (int i = 0; i < 64; ++i) {
      const Vec2 place{8 * i + 4.0, 8 * j + 4.0}, u = test::displacement(peaks, place);
      csv.add(place.x).add(place.y).add(u.x + normal(random)).add(u.y + normal(random)).end_row();
    }
  const DisplacementField field = read_given_field(write(folder, csv.str()), {}).field;
  EXPECT_NEAR(field[0].sigma_um, 0.05, 0.01);
  int n_flagged = 0;
  for (const Bead& bead : field)
    if (!bead.flag.empty()) ++n_flagged;
  EXPECT_LE(n_flagged, 0.01 * static_cast<double>(field.size()));
  EXPECT_LT(outwardness(field), -0.5);
}

/// A cell that contracts, and in a corner of the picture beads that are pulled out of it as strongly: the field's
/// centre lies between the two, and all that moves in the corner moves away from it.
TEST(GivenField, a_strong_neighbour_in_a_corner_is_no_push) {
  for (const double strength : {0.3, 0.4}) {
    DisplacementField alone, beside;
    for (int i = 0; i < 1600; ++i) {
      const Vec2 place{2.0 * (i % 40) + 1, 2.0 * (i / 40) + 1}, d = place - Vec2{30, 30}, e = place - Vec2{72, 72};
      const Vec2 own = (-0.1 * std::exp(-std::pow((norm(d) - 15) / 6, 2)) / norm(d)) * d;
      const double others = strength * std::exp(-dot(e, e) / 50) / std::numbers::sqrt2;
      alone.push_back({.position_um = place, .displacement_um = own, .sigma_um = 0.003, .flag = {}});
      beside.push_back(
          {.position_um = place, .displacement_um = own + Vec2{others, others}, .sigma_um = 0.003, .flag = {}});
    }
    EXPECT_LT(outwardness(beside), 0.3);  // finding pushes-outward
    EXPECT_LT(outwardness(alone), -0.9);
    for (Bead& bead : alone) bead.displacement_um = -1 * bead.displacement_um;
    EXPECT_GT(outwardness(alone), 0.9) << "exchanged";
  }
}

TEST(GivenField, growth_is_taken_off_and_a_field_without_it_stays_as_it_is) {
  const auto peaks = test::ring_of_adhesions(512, 8.3);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0, 0.05);
  for (const double growth : {0.0, 0.003}) {
    DisplacementField field, truth;
    for (int j = 0; j < 64; ++j)
      for (int i = 0; i < 64; ++i) {
        const Vec2 place{8 * i + 4.0, 8 * j + 4.0}, u = test::displacement(peaks, place);
        truth.push_back({.position_um = place, .displacement_um = u, .sigma_um = 0.05});
        field.push_back(truth.back());
        const double x = normal(random);
        field.back().displacement_um = u + growth * (place - Vec2{256, 256}) + Vec2{x, normal(random)};
      }
    TrackParameters parameters;
    parameters.drift_affine = Switch::automatic;
    const DisplacementField before = field;
    const GivenMotion motion = take_motion_off(field, parameters);
    EXPECT_EQ(motion.affine.is_on, growth > 0) << motion.affine.why;
    EXPECT_NEAR(motion.common.growth, growth, 0.05 / 256);  // the noise of one point, at the border
    for (std::size_t k = 0; k < field.size(); ++k) {
      if (!motion.affine.is_on) EXPECT_EQ(field[k].displacement_um, before[k].displacement_um);
      // six standard deviations of the noise
      EXPECT_LT(norm(field[k].displacement_um - truth[k].displacement_um), 0.3);
    }
  }
}

TEST(GivenField, places_of_the_relaxed_picture_are_moved_with_the_stage_and_asked_for) {
  const Vec2 drift{3, -2};
  DisplacementField truth;
  for (int j = 0; j < 32; ++j)
    for (int i = 0; i < 32; ++i) {
      const Vec2 place{4 * i + 2.0, 4 * j + 2.0};
      truth.push_back({place, test::displacement(test::ring_of_adhesions(128, 2), place), 0.01, ""});
    }
  DisplacementField given = truth;  // the relaxed picture, which the stage has left
  for (Bead& bead : given) bead.position_um = bead.position_um - drift, bead.displacement_um += drift;
  DisplacementField as_it_is = given;
  const GivenMotion asked = take_motion_off(as_it_is, {});
  ASSERT_TRUE(asked.unplaced_um);
  EXPECT_NEAR(*asked.unplaced_um, norm(drift), 0.1);
  TrackParameters said;
  said.places = TablePlaces::cell;
  EXPECT_FALSE(take_motion_off(as_it_is, said).unplaced_um);
  said.places = TablePlaces::relaxed;
  EXPECT_FALSE(take_motion_off(given, said).unplaced_um);
  for (std::size_t k = 0; k < truth.size(); ++k) {
    // the tail of the adhesions' pull hides some hundredths of a micrometre of the drift
    EXPECT_LT(norm(given[k].position_um - truth[k].position_um), 0.1);
    EXPECT_LT(norm(given[k].displacement_um - truth[k].displacement_um), 0.1);
  }
}

TEST(GivenField, what_cannot_be_used_is_flagged_and_kept) {
  const test::TemporaryFolder folder;
  files::CsvText csv({"x_um", "y_um", "ux_um", "uy_um", "sigma_um"});
  for (int j = 0; j < 8; ++j)
    for (int i = 0; i < 8; ++i) {
      const bool is_outlier = i == 4 && j == 4;
      csv.add(1.0 * i).add(1.0 * j).add(is_outlier ? 3.0 : 0.1 * i).add(0.05 * j).add(0.01).end_row();
    }
  csv.add(3.0).add(3.0).add(0.3).add(0.15).add(0.01).end_row();
  csv.add(3.5).add(3.5).add("NaN").add(0.15).add(0.01).end_row();
  csv.add(2.5).add(3.5).add("").add(0.15).add(0.01).end_row();
  const DisplacementField field = read_given_field(write(folder, csv.str()), {}).field;
  ASSERT_EQ(field.size(), 67u);
  EXPECT_EQ(field[36].flag, "neighbours disagree");
  EXPECT_EQ(field[64].flag, "duplicate");
  EXPECT_EQ(field[65].flag, "not a number");
  EXPECT_EQ(field[66].flag, "not a number");
  EXPECT_EQ(std::count_if(field.begin(), field.end(), [](const Bead& b) { return b.flag.empty(); }), 63);
}

/// The search for neighbours takes memory for the points, not for the ways between them.
TEST(GivenField, points_on_a_line_and_points_astray_are_read) {
  const test::TemporaryFolder folder;
  for (const bool is_line : {true, false}) {
    files::CsvText csv({"x_um", "y_um", "ux_um", "uy_um"});
    for (int i = 0; i < 40; ++i)
      csv.add(is_line ? 1.0 * i : i % 20).add(is_line ? 0.0 : i / 20).add(0.1).add(0.01 * i).end_row();
    csv.add(9e5).add(is_line ? 0.0 : 9e5).add(0.1).add(0.1).end_row();
    EXPECT_EQ(read_given_field(write(folder, csv.str()), {}).field.size(), 41u);
  }
}

/// Thirty adhesions anywhere, two in three of them known, forces towards the middle, and their displacement by Cerruti.
TEST(GivenField, turned_or_mirrored_as_a_whole_is_named_by_forces_at_the_adhesions) {
  std::mt19937_64 random(61);
  std::uniform_real_distribution<> within(15, 85);
  std::normal_distribution<> noise(0, 0.005);
  const Vec2 middle{50, 50};
  std::vector<Vec2> adhesions, forces;
  for (int k = 0; k < 30; ++k) {
    adhesions.push_back({within(random), 0.6 * within(random) + 20});
    forces.push_back(0.05 * (middle - adhesions.back()));
  }
  DisplacementField field;
  for (int j = 0; j < 25; ++j) {
    for (int i = 0; i < 25; ++i) {
      Bead& bead = field.emplace_back();
      bead.position_um = {4.0 * i + 2, 4.0 * j + 2};
      for (std::size_t k = 0; k < adhesions.size(); ++k) {
        const Vec2 d = bead.position_um - adhesions[k];
        const double r = std::hypot(norm(d), 0.8), e = 3.0;
        const Vec2 direction = 1 / r * d;
        bead.displacement_um +=
            1.49 / (std::numbers::pi * e * r) * (0.51 * forces[k] + 0.49 * dot(direction, forces[k]) * direction);
      }
      bead.displacement_um += {noise(random), noise(random)};
    }
  }
  const std::vector<Vec2> found(adhesions.begin(), adhesions.begin() + 20);
  EXPECT_EQ(orientation_of_forces(field, found, middle), "");
  const auto turned_back = [&](Vec2 v, const Orientation& as) {
    for (int k = 0; k < as.quarter_turns; ++k) v = {v.y, -v.x};
    return as.is_mirrored ? Vec2{-v.x, v.y} : v;
  };
  for (const Orientation& as : kOtherOrientations) {
    DisplacementField wrong = field;
    for (Bead& bead : wrong) {
      bead.position_um = middle + turned_back(bead.position_um - middle, as);
      bead.displacement_um = turned_back(bead.displacement_um, as);
    }
    EXPECT_EQ(orientation_of_forces(wrong, found, middle), as.name);
  }
}

TEST(GivenField, what_is_wrong_with_a_file_is_said) {
  const test::TemporaryFolder folder;
  EXPECT_THROW(read_given_field(write(folder, "x_um,y_um,u,v\n1,2,3,4\n"), {}), InputError);
  EXPECT_THROW(read_given_field(write(folder, "x_um,y_um,ux_um,uy_um\nNaN,2,3,4\n"), {}), InputError);
  EXPECT_THROW(read_given_field(write(folder, "x_um,y_um,ux_um,uy_um\n1,2,NaN,4\n"), {}), InputError);
  EXPECT_THROW(read_given_field(write(folder, "x_um,y_um,ux_um,uy_um\n"), {}), InputError);
  EXPECT_THROW(read_given_field(write(folder, "x_um,y_um,ux_um,uy_um\n1e200,2,3,4\n"), {}), InputError);
  TrackParameters pixels;
  pixels.length_unit = LengthUnit::px;
  EXPECT_THROW(read_given_field(write(folder, "x,y,u,v\n1,2,3,4\n"), pixels), UsageError);
}

}  // namespace
}  // namespace mbtfm::beads
