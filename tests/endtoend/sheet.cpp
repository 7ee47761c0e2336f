/// mbtfm-sheet as a person runs it.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "pipeline/files/csv_files.h"
#include "pipeline/files/json_record.h"
#include "tests/support/program.h"
#include "tests/support/sheets.h"

namespace mbtfm {
namespace {

constexpr const char* kSheet =
    "[sheet]\nyoungs_modulus_kPa = 1\npoisson_ratio = 0.3\nthickness_um = 0.4\ncontraction_nN_per_um = 0.02\n";

class Sheet : public testing::Test {
 protected:
  void SetUp() override {
    files::write_outline(folder_ / "outline.csv", test::circle(25, 180));
    files::write_text(folder_ / "points.csv", "x_um,y_um\n20,0\n0,-20\n30,0\n");
  }
  test::Outcome run(const std::string& settings, const std::string& more = {},
                    const std::string& outline = "outline.csv") {
    files::write_text(folder_ / "cell.toml", settings);
    return test::run_program("mbtfm-sheet --quiet --outline " + (folder_ / outline).string() + " --config " +
                             (folder_ / "cell.toml").string() + " --out " + (folder_ / "out").string() + " " + more);
  }
  double figure(const std::string& name) {
    return files::JsonRecord(folder_ / "out" / "sheet.json", "figures of a sheet").at(name).number();
  }
  test::TemporaryFolder folder_;
};

TEST_F(Sheet, springs_alone_need_no_gel_and_carry_the_tension_that_balance_asks_for) {
  const auto outcome = run(std::string(kSheet) + "adhesion_stiffness_nN_per_um3 = 0.03\n",
                           "--points " + (folder_ / "points.csv").string());
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  // each patch's force acts at its centre, where a traction that grows across the patch has it a little further out
  EXPECT_NEAR(figure("mean_tension_nN_per_um"), figure("virial_tension_nN_per_um"), 1e-3 * 0.02);
  EXPECT_LE(figure("net_force_nN"), 1e-9 * figure("total_force_nN"));
  const files::CsvTable sheet(folder_ / "out" / "sheet.csv");
  ASSERT_EQ(sheet.n_rows(), 3);
  EXPECT_LT(sheet.number(0, "ux_um"), 0);
  EXPECT_NEAR(sheet.number(1, "uy_um"), -sheet.number(0, "ux_um"), 1e-4 * std::abs(sheet.number(0, "ux_um")));
  EXPECT_TRUE(sheet.text(2, "ux_um").empty()) << "outside of the sheet";
}

TEST_F(Sheet, its_tractions_give_its_tensions_back) {
  ASSERT_EQ(run(std::string(kSheet) + "adhesion_stiffness_nN_per_um3 = 0.003\n").code, 0);
  const double mean = figure("mean_tension_nN_per_um");
  std::filesystem::rename(folder_ / "out" / "traction.csv", folder_ / "traction.csv");
  const auto outcome = run("[sheet]\npoisson_ratio = 0.3\n", "--traction " + (folder_ / "traction.csv").string());
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_NEAR(figure("inside_mean_tension_nN_per_um"), mean, 0.01 * 0.02);
  EXPECT_NEAR(figure("mean_tension_nN_per_um"), figure("exact_virial_tension_nN_per_um"), 1e-9 * mean);
}

TEST_F(Sheet, tractions_in_pascals_are_refused) {
  std::ofstream file(folder_ / "traction.csv");
  file << "x_um,y_um,tx_kPa,ty_kPa\n";
  for (int y = -30; y <= 30; y += 3)
    for (int x = -30; x <= 30; x += 3) file << x << ',' << y << ',' << -10 * x << ',' << -10 * y << '\n';
  file.close();
  const auto outcome = run("[sheet]\npoisson_ratio = 0.3\n", "--traction " + (folder_ / "traction.csv").string());
  EXPECT_EQ(outcome.code, 3) << outcome.output;
  EXPECT_NE(outcome.output.find("200 Pa are 0.2 kPa"), std::string::npos) << outcome.output;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

TEST_F(Sheet, a_bonded_sheet_pulls_on_its_gel_without_net_force) {
  const auto outcome = run(
      "[gel]\nyoungs_modulus_kPa = 5\npoisson_ratio = 0.45\nthickness_um = 60\n" + std::string(kSheet), "--mesh_um 2");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  EXPECT_LE(figure("net_force_nN"), 1e-9 * figure("total_force_nN"));
  EXPECT_GT(figure("total_force_nN"), 0);
}

/// Beads of a computed gel, with noise, are fitted: the sheet that moved them comes back within its errors.
TEST_F(Sheet, contraction_and_stiffness_come_back_from_beads) {
  std::string points = "x_um,y_um\n";
  for (int i = -20; i <= 20; ++i)
    for (int j = -20; j <= 20; ++j) points += std::to_string(2 * i) + "," + std::to_string(2 * j) + "\n";
  files::write_text(folder_ / "beads.csv", points);
  const std::string gel = "[gel]\nyoungs_modulus_kPa = 1\npoisson_ratio = 0.49\nthickness_um = 60\n";
  const std::string sheet = "[sheet]\npoisson_ratio = 0.3\nthickness_um = 0.4\nmesh_um = 2\n";
  const auto made = run(gel + sheet + "youngs_modulus_kPa = 30\ncontraction_nN_per_um = 0.5\n",
                        "--beads " + (folder_ / "beads.csv").string());
  ASSERT_EQ(made.code, 0) << made.output;
  DisplacementField beads = files::read_displacement(folder_ / "out" / "displacement.csv");
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, 0.01);
  for (Bead& bead : beads) {
    bead.displacement_um += Vec2{noise(random), noise(random)};
    bead.sigma_um = 0.01;
  }
  files::write_displacement(folder_ / "displacement.csv", beads);
  const auto outcome = run(gel + sheet, "--displacement " + (folder_ / "displacement.csv").string());
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  const files::CsvTable fit(folder_ / "out" / "sheet_fit.csv");
  EXPECT_EQ(fit.text(0, "quantity"), "contraction_nN_per_um");
  EXPECT_NEAR(fit.number(0, "value"), 0.5, 4 * fit.number(0, "sigma"));
  EXPECT_EQ(fit.text(1, "quantity"), "stiffness_nN_per_um");
  EXPECT_NEAR(fit.number(1, "value"), 30 * 0.4 / (1 - 0.09), 4 * fit.number(1, "sigma"));
  EXPECT_LT(figure("aic"), figure("aic_of_nothing") - 1000);
}

struct Refused {
  const char* name;
  std::string settings, says;
  int code;
};

TEST_F(Sheet, what_cannot_be_is_refused_by_name) {
  const std::string springs = "adhesion_stiffness_nN_per_um3 = 0.03\n";
  const std::vector<Refused> cases = {
      {"no ground", kSheet, "no ground", 2},
      {"no modulus", "[sheet]\nthickness_um = 1\ncontraction_nN_per_um = 1\n" + springs, "youngs_modulus_kPa", 2},
      {"two contractions", std::string(kSheet) + "contraction_kPa = 1\n" + springs, "both given", 2},
      {"negative stiffness", std::string(kSheet) + "adhesion_stiffness_nN_per_um3 = -1\n",
       "adhesion_stiffness_nN_per_um3", 3},
      {"collapse",
       "[sheet]\nyoungs_modulus_kPa = 1\npoisson_ratio = 0.3\nthickness_um = 0.4\ncontraction_nN_per_um = 0.4\n" +
           springs,
       "contract by 0.7", 2},
      {"no tractions", std::string(kSheet) + "ground = \"none\"\n", "--traction", 2}};
  for (const Refused& refused : cases) {
    const auto outcome = run(refused.settings);
    EXPECT_EQ(outcome.code, refused.code) << refused.name << ": " << outcome.output;
    EXPECT_NE(outcome.output.find(refused.says), std::string::npos) << refused.name << ": " << outcome.output;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out")) << refused.name << ": something was written";
  }
  files::write_outline(folder_ / "eight.csv", {{0, 0}, {40, 40}, {40, 0}, {0, 40}});
  files::write_text(folder_ / "line.csv", "x_um,y_um\n0,1e-300\n20,2e-300\n40,1e-300\n20,0\n");
  const auto line = run(std::string(kSheet) + springs, "", "line.csv");
  EXPECT_EQ(line.code, 3) << line.output;
  EXPECT_NE(line.output.find("an outline around an area"), std::string::npos) << line.output;
  const auto outcome = run(std::string(kSheet) + springs, "", "eight.csv");
  EXPECT_EQ(outcome.code, 3) << outcome.output;
  EXPECT_NE(outcome.output.find("piece 1 of ring 0 and piece 3 of ring 0 cross"), std::string::npos) << outcome.output;
}

}  // namespace
}  // namespace mbtfm
