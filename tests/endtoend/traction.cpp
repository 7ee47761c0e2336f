/// The executables that reconstruct tractions and compare them with the fit.
#include <nlohmann/json.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/json_record.h"
#include "tests/support/ellipse_scene.h"
#include "tests/support/findings.h"
#include "tests/support/program.h"

namespace mbtfm::tractions {
namespace {

class TractionProgram : public testing::Test {
 protected:
  void SetUp() override {
    files::write_text(folder / "cell.toml",
                      "[gel]\nyoungs_modulus_kPa = 8.4\npoisson_ratio = 0.49\nthickness_um = 1000\n");
  }
  Outcome run(const std::string& more = {}) const {
    return run_in(folder, "mbtfm-traction --gel cell.toml --displacement displacement.csv --out traction.csv " + more);
  }
  test::TemporaryFolder folder;
};

TEST_F(TractionProgram, writes_what_it_says_for_every_method) {
  const test::EllipseScene scene = test::ellipse_scene(48, 0.03);
  files::write_displacement(folder / "displacement.csv", scene.field);
  files::write_adhesions(folder / "adhesions.csv", scene.adhesions);
  files::write_outline(folder / "outline.csv", {{8, 8}, {57, 8}, {57, 57}, {8, 57}});
  for (const std::string method : {"fttc", "sparse", "trpf", "bem", "adhesion-forces"}) {
    for (const auto& entry : fs::directory_iterator(folder.path()))
      if (entry.path().filename().string().starts_with("traction")) fs::remove(entry);
    output_of(run("--element_um 6 --adhesions adhesions.csv --outline outline.csv --method " + method));
    const files::CsvTable map(folder / "traction.csv");
    map.require({"x_um", "y_um", "tx_kPa", "ty_kPa"});
    EXPECT_GT(map.n_rows(), 0);
    EXPECT_EQ(map.has("sigma_x_kPa"), method != "sparse");
    EXPECT_EQ(map.has("sigma_y_kPa"), method != "sparse");
    EXPECT_EQ(files::read_adhesion_forces(folder / "traction_adhesion_forces.csv").size(), 8u);
    const bool has_scan = method != "sparse" && method != "adhesion-forces";
    for (const auto& [ending, is_there] :
         {std::pair{".vtp", true}, {".json", true}, {"_lambda.csv", has_scan}, {"_lambda.svg", has_scan}})
      EXPECT_EQ(fs::exists(folder / (std::string("traction") + ending)), is_there) << method << ending;
  }
}

TEST_F(TractionProgram, warns_where_tractions_push_outward_as_after_a_swap_of_the_images) {
  test::EllipseScene scene = test::ellipse_scene(48, 0.1);
  for (const bool is_swapped : {false, true}) {
    for (Bead& b : scene.field) b.displacement_um = (is_swapped ? -1.0 : 1.0) * b.displacement_um;
    files::write_displacement(folder / "displacement.csv", scene.field);
    for (const std::string method : {"fttc", "sparse"})
      EXPECT_EQ(has_words(output_of(run("--method " + method)), "swapped"), is_swapped) << method;
  }
}

TEST_F(TractionProgram, refuses_bad_displacements_and_names_them) {
  const std::string header = "x_um,y_um,ux_um,uy_um,sigma_um\n", bead = "1,2,0.1,0.1,0.01\n";
  const std::pair<std::string, std::string> cases[] = {
      {header, "three beads"},                                            // none
      {header + bead, "three beads"},                                     // one
      {header + bead + "2,2,nan,0,0.01\n3,5,0,0,0.01\n", "ux_um"},        // not a number
      {header + bead + "2,4,0,0,0.01\n3,5,0,0,0.01\n" + bead, "bead 3"},  // the same place twice
      {header + "1,2,0,0,0.01\n2,4,0,0,0.01\n3,5,0,0,0.01\n", "3 zeros"}};
  for (const auto& [text, word] : cases) {
    files::write_text(folder / "displacement.csv", text);
    EXPECT_TRUE(has_words(output_of(run(), 3), word));
    EXPECT_FALSE(fs::exists(folder / "traction.csv"));
  }
}

TEST_F(TractionProgram, leaves_out_vectors_that_share_a_value_as_a_mask_writes_it) {
  test::EllipseScene scene = test::ellipse_scene(48, 0.05);
  const auto total_nN = [&] {
    files::write_displacement(folder / "displacement.csv", scene.field);
    EXPECT_EQ(has_words(output_of(run()), "input-not-used"), scene.field[0].displacement_um.x == -1);
    return files::JsonRecord(folder / "traction.json", "figures").at("total_force_nN").number();
  };
  const double whole_nN = total_nN();
  for (std::size_t k = 0; k < scene.field.size(); k += 17) scene.field[k].displacement_um = {-1, -1};
  EXPECT_NEAR(total_nN() / whole_nN, 1, 0.1);  // one bead in 17 less; read as -1 um they make it many times as large
}

TEST_F(TractionProgram, takes_a_field_without_errors_and_says_which_it_assumed) {
  constexpr double kNoise = 0.05;
  const test::EllipseScene scene = test::ellipse_scene(48, kNoise);
  files::CsvText csv({"x_um", "y_um", "ux_um", "uy_um"});
  for (const Bead& b : scene.field)
    csv.add(b.position_um.x).add(b.position_um.y).add(b.displacement_um.x).add(b.displacement_um.y).end_row();
  files::write_text(folder / "displacement.csv", csv.str());
  EXPECT_TRUE(has_words(output_of(run()), "the field states no errors"));
  // 2304 beads: half of them tell the noise to 2.5 %
  const double assumed_um = files::JsonRecord(folder / "traction.json", "figures").at("assumed_sigma_um").number();
  EXPECT_NEAR(assumed_um / (kNoise * scene.largest_um), 1, 0.075);
}

TEST_F(TractionProgram, refuses_a_modulus_in_pascal_unless_asked_to_and_takes_an_incompressible_gel) {
  files::write_displacement(folder / "displacement.csv", test::ellipse_scene(32, 0.05).field);
  const auto run_on = [&](const std::string& toml) {
    files::write_text(folder / "cell.toml", "[gel]\nyoungs_modulus_kPa = " + toml);
    return run();
  };
  EXPECT_TRUE(has_words(output_of(run_on("8400\n"), 3), "8400 Pa is 8.4 kPa"));
  EXPECT_FALSE(fs::exists(folder / "traction.csv"));
  EXPECT_EQ(run_on("8400\n[checks]\nallow = [\"youngs_modulus_kPa\"]\n").code, 0);
  EXPECT_EQ(run_on("8.4\npoisson_ratio = 0.5\n").code, 0);
  EXPECT_EQ(run_on("8.4\npoisson_ratio = 0.501\n").code, 3);
}

/// Two adhesions on a wave that pull at each other and at the gel, and beads below.
class TractionInSpace : public testing::Test {
 protected:
  void SetUp() override {
    files::write_text(folder_ / "cell.toml",
                      "[gel]\nyoungs_modulus_kPa = 10\npoisson_ratio = 0.45\nthickness_um = 30\n[substrate]\n"
                      "displacement_tolerance = 0\n");
    output_of(run_in(folder_,
                     "mbtfm-surface --formula 'wave amplitude_um=3 period_um=40' --low_x_um -24 --low_y_um -24 "
                     "--high_x_um 24 --high_y_um 24 --out surface.vtp"));
    files::write_text(
        folder_ / "adhesions.csv",
        "adhesion_id,x_um,y_um,area_um2,major_axis_um,minor_axis_um,angle_deg,eccentricity,mean_intensity\n"
        "1,-9,2,38.48,7,7,0,0,1\n2,9,-2,38.48,7,7,0,0,1\n");
    files::write_text(folder_ / "adhesion_forces.csv", "adhesion_id,fx_nN,fy_nN,fz_nN\n1,60,-10,-15\n2,-60,10,15\n");
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> across(-18, 18), down(4, 14);
    std::string points = "x_um,y_um,z_um\n";
    for (int b = 0; b < 350; ++b)
      points += brief(across(random)) + "," + brief(across(random)) + "," + brief(down(random)) + "\n";
    files::write_text(folder_ / "points.csv", points);
    output_of(run_in(folder_,
                     "mbtfm-substrate --gel cell.toml --surface surface.vtp --adhesions adhesions.csv --forces "
                     "adhesion_forces.csv --points points.csv --out exact.csv"));
    std::vector<BeadInSpace> beads = files::read_displacement_in_space(folder_ / "exact.csv");
    std::normal_distribution<double> noise(0, 0.01);
    for (BeadInSpace& b : beads) {
      const double x = noise(random), y = noise(random), z = 3 * noise(random);
      b.displacement_um += Vec3{x, y, z};
      b.sigma_um = 0.01;
      b.sigma_z_um = 0.03;
    }
    files::write_displacement_in_space(folder_ / "displacement_3d.csv", beads);
  }
  Outcome run(const std::string& more, const std::string& displacement = "displacement_3d.csv") const {
    return run_in(folder_, "mbtfm-traction --gel cell.toml --surface surface.vtp --displacement " + displacement +
                               " --out traction_3d.csv " + more);
  }
  test::TemporaryFolder folder_;
};

TEST_F(TractionInSpace, finds_forces_of_adhesions_on_a_wave_with_their_errors) {
  for (const std::string method : {"auto", "patches"}) {
    output_of(run("--spacing_um 4 --grow_um 3 --adhesions adhesions.csv --method " + method));
    const files::CsvTable forces(folder_ / "traction_3d_adhesion_forces.csv");
    ASSERT_EQ(forces.n_rows(), 2);
    for (int row = 0; row < 2; ++row) {
      const double sign = row == 0 ? 1 : -1;
      const auto is_within = [&](const char* of, double truth) {
        const double sigma = forces.number(row, std::string("sigma_") + of);
        // four standard errors, and what coarse elements without a tolerance leave: a tenth of 63 nN
        EXPECT_NEAR(forces.number(row, of), truth, 4 * sigma + 6.3) << method << ", " << of << " of " << row + 1;
        EXPECT_GT(sigma, 0);
      };
      is_within("fx_nN", 60 * sign);
      is_within("fy_nN", -10 * sign);
      is_within("fz_nN", -15 * sign);
    }
    const files::CsvTable map(folder_ / "traction_3d.csv");
    map.require({"x_um", "y_um", "z_um", "tx_kPa", "ty_kPa", "tz_kPa", "sigma_tx_kPa", "resolution_um", "normal_kPa"});
    for (const char* name : {"traction_3d.vtp", "traction_3d.json"}) EXPECT_TRUE(fs::exists(folder_ / name)) << name;
  }
}

/// The files are of an even lattice of the smallest faces, whatever the faces.
TEST_F(TractionInSpace, splits_faces_by_each_rule_and_writes_an_even_lattice) {
  files::write_text(folder_ / "outline.csv", "x_um,y_um\n-12,-2\n12,-2\n12,2\n-12,2\n");
  const auto number = [&](const std::string& name) {
    return nlohmann::json::parse(files::read_text(folder_ / "traction_3d.json")).at(name).get<double>();
  };
  for (const std::string rule : {"none", "region", "resolved", "threshold"}) {
    output_of(run("--spacing_um 3 --method tikhonov --outline outline.csv --refine " + rule));
    const files::CsvTable map(folder_ / "traction_3d.csv");
    Vec3 sum;
    for (int row = 0; row < map.n_rows(); ++row)
      sum += map.number(row, "area_um2") *
             Vec3{map.number(row, "tx_kPa"), map.number(row, "ty_kPa"), map.number(row, "tz_kPa")};
    // two opposite forces of 63 nN
    EXPECT_LE(norm(sum), 20) << rule;
    const double spacing = number("spacing_x_um");
    for (int row = 0; row < map.n_rows(); ++row) {
      const double steps = (map.number(row, "x_um") - map.number(0, "x_um")) / spacing;
      EXPECT_NEAR(steps, std::round(steps), 1e-3) << rule;
    }
    if (rule == "none") {
      EXPECT_EQ(number("n_unknowns"), 3 * map.n_rows());
    } else {
      // the beads may resolve no more than the large faces show
      const bool is_split = rule == "region" || number("n_faces_split") > 0;
      EXPECT_TRUE(is_split || rule != "threshold");
      EXPECT_EQ(number("n_unknowns") < 3 * map.n_rows(), is_split) << rule;
      EXPECT_EQ(number("largest_spacing_um") > 1.5 * spacing, is_split) << rule;
    }
  }
  EXPECT_TRUE(has_words(output_of(run("--spacing_um 4 --method direct --refine resolved"), exit_code::kUsage),
                        "direct states no resolution"));
}

TEST_F(TractionInSpace, lambda_that_it_shows_is_the_one_to_be_given) {
  const std::string dense = "--spacing_um 5 --method tikhonov ";
  const auto lambda = [&]() {
    return nlohmann::json::parse(files::read_text(folder_ / "traction_3d.json")).at("lambda_um_per_kPa").get<double>();
  };
  ASSERT_EQ(run(dense).code, 0);
  const double chosen = lambda();
  const std::string map = files::read_text(folder_ / "traction_3d.csv");
  const files::CsvTable scan(folder_ / "traction_3d_lambda.csv");
  for (int row = 0; row < scan.n_rows(); ++row) {
    const double length_um = scan.number(row, "length_um");
    EXPECT_NEAR(scan.number(row, "lambda") * 10, length_um, 1e-3 * length_um) << "times Young's modulus";
  }
  ASSERT_EQ(run(dense + "--lambda_um_per_kPa " + std::to_string(chosen)).code, 0);
  EXPECT_NEAR(lambda(), chosen, 1e-5);
  const files::CsvTable again(folder_ / "traction_3d.csv");
  files::write_text(folder_ / "first.csv", map);
  const files::CsvTable first(folder_ / "first.csv");
  double apart = 0, size = 0;
  for (int row = 0; row < first.n_rows(); ++row) {
    apart += std::abs(again.number(row, "tx_kPa") - first.number(row, "tx_kPa"));
    size += std::abs(first.number(row, "tx_kPa"));
  }
  EXPECT_LE(apart, 0.01 * size) << "lambda is written with six digits";
}

/// A gel of another Poisson's ratio, by beads so exact that it shows, is an error that the risk knows of. Of beads
/// astray, a third of them here, l2 can tell no direction from noise: little is left, and no end of the scan followed.
TEST_F(TractionInSpace, says_which_criterion_chose_lambda_in_the_end) {
  std::vector<BeadInSpace> beads = files::read_displacement_in_space(folder_ / "exact.csv");
  for (BeadInSpace& b : beads) b.sigma_um = 1e-5, b.sigma_z_um = 3e-5;
  files::write_displacement_in_space(folder_ / "exact_beads.csv", beads);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> box(-5, 5);
  for (std::size_t b = 0; b < beads.size(); b += 3) beads[b].displacement_um = {box(random), box(random), box(random)};
  files::write_displacement_in_space(folder_ / "astray.csv", beads);
  const std::string dense = "--spacing_um 4 --method tikhonov ";
  const auto text = [&](const char* name) { return files::read_text(folder_ / name); };
  const auto expect_chosen = [&](const Outcome& outcome, const std::string& by, const char* file_says) {
    ASSERT_EQ(outcome.code, 0) << outcome.output;
    EXPECT_TRUE(has_words(outcome.output, "um (" + by + ")"));
    EXPECT_FALSE(test::fires("lambda-unbounded", outcome.output)) << outcome.output;
    EXPECT_TRUE(has_words(text("traction_3d.json"), std::string("\"lambda_by\": \"") + file_says + '"'));
    EXPECT_TRUE(has_words(text("traction_3d_lambda.svg"), "Chosen, " + (by == "given" ? "as given" : by) + ":"));
  };
  const auto of_astray = run(dense, "astray.csv");
  expect_chosen(of_astray, "by risk", "risk");
  EXPECT_TRUE(test::fires("outliers", "noise has them", of_astray.output)) << of_astray.output;
  expect_chosen(run(dense + "--lambda_by evidence"), "by evidence", "evidence");
  const auto of_another_gel = run(dense + "--poisson_ratio 0.3", "exact_beads.csv");
  expect_chosen(of_another_gel, "by risk", "risk");
  EXPECT_TRUE(test::fires("misfit", "The tractions leave", of_another_gel.output)) << of_another_gel.output;
  expect_chosen(run(dense), "by risk", "risk");
  expect_chosen(run(dense + "--lambda_um_per_kPa 0.01"), "given", "given");
}

TEST_F(TractionInSpace, says_whether_a_common_motion_was_looked_for) {
  const std::string dense = "--spacing_um 4 --method ";
  EXPECT_TRUE(has_words(run(dense + "tikhonov").output, "common motion: on (auto): found with the tractions: shift x"));
  EXPECT_TRUE(
      has_words(run(dense + "tikhonov --common_motion off").output, "common motion: off (as switched): switched off"));
  EXPECT_TRUE(has_words(run(dense + "direct").output, "common motion: off (auto): the displacement is imposed"));
  EXPECT_TRUE(has_words(output_of(run(dense + "direct --common_motion on"), 2),
                        "direct imposes the displacement as it was measured"));
}

TEST_F(TractionInSpace, doubts_a_total_force_that_no_cell_has) {
  const std::string cell = "--spacing_um 4 --grow_um 3 --adhesions adhesions.csv";
  EXPECT_FALSE(has_words(run(cell).output, "total force of the cell"));
  const auto outcome = run(cell + " --youngs_modulus_kPa 900");  // 90 times the gel's own: 125 nN become 11 000 nN
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_TRUE(has_words(outcome.output, "the total force of the cell is"));
}

TEST_F(TractionInSpace, refuses_what_shows_nothing_and_leaves_no_file) {
  files::write_text(folder_ / "flat.csv", "x_um,y_um,ux_um,uy_um,sigma_um\n1,2,0.1,0.2,0.01\n");
  files::write_text(folder_ / "few.csv", "x_um,y_um,z_um,ux_um,uy_um,uz_um\n1,2,5,0.1,0.2,0.01\n3,2,5,0.1,0.2,0.01\n");
  files::write_text(folder_ / "outline.csv", "x_um,y_um\n100,100\n120,100\n120,120\n");
  const auto refused = [&](const Outcome& outcome, int code, const char* says) {
    EXPECT_EQ(outcome.code, code) << outcome.output;
    EXPECT_TRUE(has_words(outcome.output, says));
    EXPECT_FALSE(fs::exists(folder_ / "traction_3d.csv"));
  };
  refused(run("", "flat.csv"), exit_code::kInput, "z_um");
  refused(run("", "few.csv"), exit_code::kInput, "at least 4 beads");
  refused(run("--outline outline.csv"), exit_code::kInput, "the outline above the beads");
  refused(run("--method fttc"), exit_code::kUsage, "group-l1");
  refused(run("--method patches"), exit_code::kUsage, "--adhesions");
}

TEST(CalibrateProgram, finds_the_lambda_at_which_both_methods_have_the_same_force) {
  const test::TemporaryFolder folder;
  constexpr int kNotConverged = 4;  // its fit says a force that would turn the line, were it not left out
  for (const int strength : {1, 2, 3, kNotConverged}) {
    test::EllipseScene scene = test::ellipse_scene(64, 0.03, static_cast<unsigned>(strength));
    for (Bead& b : scene.field) b.displacement_um = double(strength) * b.displacement_um;
    const fs::path cell = folder / ("cell_" + std::to_string(strength));
    for (const char* name : {"1_segment", "2_track", "4_fit"}) fs::create_directories(cell / name);
    files::write_text(cell / "cell.toml",
                      "[gel]\nyoungs_modulus_kPa = 8.4\npoisson_ratio = 0.49\nthickness_um = 1000\n");
    files::write_displacement(cell / "2_track/displacement.csv", scene.field);
    files::write_outline(cell / "1_segment/outline.csv", {{8, 8}, {57, 8}, {57, 57}, {8, 57}});
    FitSummary fit;
    fit.converged = strength != kNotConverged;
    fit.total_force_nN = fit.converged ? 89.8 * strength : 1;
    files::write_fit_summary(cell / "4_fit/fit.json", fit);
  }
  EXPECT_TRUE(has_words(output_of(run_in(folder, "mbtfm-calibrate --cells . --out calibration.csv")),
                        "FTTC gives the forces of the fit at lambda E", "1 left out, whose fit has not converged"));
  const files::CsvTable table(folder / "calibration.csv");
  // forces in proportion, and the same noise: nearly one line at any lambda; the less smoothing the steeper
  for (int row = 1; row < table.n_rows(); ++row) {
    EXPECT_GT(table.number(row, "slope"), table.number(row - 1, "slope"));
    EXPECT_GT(table.number(row, "correlation"), 0.9);
  }
  EXPECT_EQ(files::CsvTable(folder / "calibration_cells.csv").n_rows(), 3 * table.n_rows());
  EXPECT_FALSE(has_words(files::read_text(folder / "calibration_cells.csv"), "cell_4"));
  EXPECT_TRUE(has_words(files::read_text(folder / "calibration.svg"), "slope one at ℓ = "));
}

}  // namespace
}  // namespace mbtfm::tractions
