/// mbtfm plan and mbtfm noise as a person runs them.
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

const std::string kSmall =
    "mbtfm plan --scenario two-adhesions --noise_um 0.02,0.05 --beads_per_um2 0.5,1 --youngs_modulus_kPa 4,8 ";

using Plan = test::InFolder;

TEST_F(Plan, a_question_is_answered_with_a_sentence_tables_a_picture_and_a_page) {
  const fs::path out = folder / "plan";
  EXPECT_TRUE(has_words(output_of(kSmall + "--drawn 1 --out " + out.string()), " to see 1 nN per fibre to 20 %",
                        "Checked with 1 simulated experiment"));
  for (const char* file :
       {"plan.html", "plan.csv", "plan_needed.csv", "plan_cells.csv", "plan_drawn.csv", "plan.svg", "plan.png"})
    EXPECT_GT(fs::file_size(out / file), 100u) << file;
  const files::CsvTable table(out / "plan.csv");
  // 2 gels, 2 densities, 2 noises; fibres, ventral fibres, network, total, adhesions three times
  EXPECT_EQ(table.n_rows(), 8 * 7);
  const std::string page = files::read_text(out / "plan.html");
  EXPECT_FALSE(has_words(page, "http://localhost"));
  EXPECT_TRUE(has_words(page, "How many cells"));
}

TEST_F(Plan, the_same_question_has_the_same_answer_for_any_number_of_threads) {
  for (const char* threads : {"1", "2"})
    output_of(kSmall + "--drawn 1 --threads " + threads + " --out " + (folder / threads).string());
  for (const char* file : {"plan.csv", "plan_drawn.csv", "plan.html"})
    EXPECT_EQ(files::read_text(folder / "1" / file), files::read_text(folder / "2" / file)) << file;
}

TEST_F(Plan, a_finished_cell_is_planned_with_by_its_own_tensions_beads_and_gel) {
  const fs::path cell = folder / "cell", out = folder / "plan";
  ASSERT_EQ(
      run_program("mbtfm-simulate --quiet --scenario two-adhesions --beads 2500 --noise_um 0.02 --out " + cell.string())
          .code,
      0);
  const std::string ask = "mbtfm plan --cell " + cell.string() + " --drawn 0 --beads_per_um2 1 --out " + out.string();
  EXPECT_EQ(run_program(ask).code, 3) << "its fit is missing";
  EXPECT_FALSE(fs::exists(out));
  ASSERT_EQ(run_program("mbtfm run --quiet " + cell.string()).code, 0);
  EXPECT_TRUE(has_words(output_of(ask), "your gel of 8.4 kPa"));
}

TEST_F(Plan, a_gel_that_hardly_moves_or_moves_too_far_is_warned_of) {
  const std::string said = run_program(
                               "mbtfm plan --scenario two-adhesions --noise_um 0.02 --beads_per_um2 0.5 "
                               "--youngs_modulus_kPa 0.05,8.4,1000 --drawn 0 --out " +
                               (folder / "plan").string())
                               .output;
  EXPECT_TRUE(has_words(said, "Mind: On 0.05 kPa linear elasticity leaves out",
                        "Mind: On 1000 kPa no bead moves by more than"));
  EXPECT_FALSE(has_words(said, "Mind: On 8.4 kPa"));
}

TEST_F(Plan, what_is_no_plan_is_refused_and_leaves_nothing_behind) {
  const std::string out = " --out " + (folder / "plan").string();
  for (const char* bad :
       {"--noise_um 0", "--noise_um a,b", "--beads_per_um2 1,-2", "--youngs_modulus_kPa 8400000000", "--within never",
        "--scenario no-such", "--beads_per_um2 20", "--beads_per_um2 0.001", "--power 2"}) {
    const Outcome outcome = run_program("mbtfm plan --scenario two-adhesions " + std::string(bad) + out);
    EXPECT_EQ(outcome.code, 2) << bad << ": " << outcome.output;
  }
  EXPECT_TRUE(has_words(output_of("mbtfm plan --scenario colony-disc" + out, 2), "is a sheet without fibres"));
  EXPECT_EQ(run_program("mbtfm plan --cell " + (folder / "nowhere").string() + out).code, 3);
  EXPECT_FALSE(fs::exists(folder / "plan"));
}

TEST_F(Plan, a_modulus_in_pascals_is_refused_and_no_end_of_a_search_is_an_answer) {
  const std::string ask = "mbtfm plan --scenario two-adhesions --drawn 0 --beads_per_um2 0.5 --noise_um 0.05 --out " +
                          (folder / "plan").string() + " --youngs_modulus_kPa ";
  EXPECT_TRUE(has_words(output_of(ask + "8400", 3), "8400 Pa is 8.4 kPa"));
  EXPECT_FALSE(fs::exists(folder / "plan"));
  EXPECT_TRUE(has_words(output_of(ask + "900"),
                        "no number of beads suffices to see 1 nN per fibre to 20 %: with 0.5 per µm² the noise"));
  EXPECT_TRUE(files::CsvTable(folder / "plan/plan_needed.csv").text(0, "beads_per_um2").empty());
}

/// The example of docs/planning.md, without its last density, which takes as long as all the rest.
TEST(PlanInSpace, the_example_of_the_page_is_answered_for_each_patch_with_tables_and_a_page) {
  const test::TemporaryFolder folder;
  const std::string page = files::read_text(test::source_folder() / "docs/planning.md");
  const auto begin = page.find("mbtfm plan --scenario wave"), end = page.find('\n', begin);
  ASSERT_NE(begin, page.npos);
  std::string command = page.substr(begin, end - begin);
  const std::string last = ",0.004 ";
  ASSERT_NE(command.find(last), command.npos);
  command.replace(command.find(last), last.size(), " ");
  EXPECT_TRUE(has_words(output_of(command + " --drawn 1 --out " + (folder / "plan").string()), " beads per µm³ (",
                        "Checked with 1 simulated experiment"));
  for (const char* file : {"plan.html", "plan.csv", "plan_needed.csv", "plan_drawn.csv", "plan.svg", "plan.png"})
    EXPECT_GT(fs::file_size(folder / "plan" / file), 100u) << file;
  EXPECT_FALSE(fs::exists(folder / "plan/plan_cells.csv")) << "there are no tensions to compare";
  const files::CsvTable drawn(folder / "plan/plan_drawn.csv");
  EXPECT_EQ(drawn.n_rows(), 6 * 3);
}

TEST(PlanInSpace, what_is_no_plan_in_space_is_refused_with_the_remedy) {
  const test::TemporaryFolder folder;
  const std::string out = " --out " + (folder / "plan").string();
  const auto refusal = [&](const std::string& arguments) {
    const Outcome outcome = run_program("mbtfm plan " + arguments + out);
    EXPECT_EQ(outcome.code, 2) << arguments << ": " << outcome.output;
    return outcome.output;
  };
  EXPECT_TRUE(has_words(refusal("--scenario wave --beads_per_um2 1"), "give beads_per_um3"));
  EXPECT_TRUE(has_words(refusal("--scenario two-adhesions --beads_per_um3 1"), "give beads_per_um2"));
  EXPECT_TRUE(has_words(refusal("--scenario wave --beads_per_um3 1e-5"), "fewer than 20 beads"));
  // a finished cell in space without an image of its adhesions
  fs::create_directories(folder / "cell/2_track");
  files::write_text(folder / "cell/cell.toml",
                    "pixel_size_um = 0.1\n[gel]\nyoungs_modulus_kPa = 8\nthickness_um = 60\n");
  files::write_text(folder / "cell/2_track/displacement_3d.csv", "");
  EXPECT_TRUE(has_words(output_of("mbtfm plan --cell " + (folder / "cell").string() + out, 3),
                        "give their image, and run the cell again"));
  EXPECT_FALSE(fs::exists(folder / "plan"));
}

/// A cell that hardly pulls, so that the two bead images differ by the noise alone.
class Unloaded : public ::testing::Test {
 protected:
  static constexpr double kNoise_um = 0.05;
  static constexpr double kDensity = 0.3;
  void SetUp() override {
    output_of(
        "mbtfm-simulate --quiet --scenario two-adhesions --images --ventral_median_nN 1e-5 --smallest_tension_nN 1e-6 "
        "--surface_tension_nN_per_um 0 --drift_x_um 0.31 --lost_bead_fraction 0.05 --noise_um " +
        std::to_string(kNoise_um) + " --beads_per_um2 " + std::to_string(kDensity) + " --out " + cell().string());
  }
  fs::path cell() const { return folder_ / "cell"; }
  std::string picture(const char* name) const { return (cell() / name).string(); }

 private:
  test::TemporaryFolder folder_;
};

double number_after(const std::string& text, const std::string& words) {
  const auto at = text.find(words);
  return at == text.npos ? std::nan("") : std::stod(text.substr(text.find_first_not_of(' ', at + words.size())));
}

TEST_F(Unloaded, noise_density_drift_and_share_lost_are_found) {
  const std::string found =
      output_of("mbtfm noise " + picture("beads_relaxed.tif") + " " + picture("beads_stressed.tif"));
  // the camera adds some nm to the beads' own; what neighbours tell takes some away; 800 beads tell it to 3 %
  EXPECT_NEAR(number_after(found, "noise of a displacement component"), kNoise_um, 0.15 * kNoise_um) << found;
  EXPECT_NEAR(number_after(found, "drift "), 0.31, 4 * kNoise_um / std::sqrt(kDensity * 51.2 * 51.2));
  // beads that melt together or lie on the rim are not followed
  EXPECT_NEAR(number_after(found, "beads followed"), kDensity, 0.2 * kDensity) << found;
  const double lost = number_after(found, "share lost");
  EXPECT_GT(lost, 1) << found;
  EXPECT_LT(lost, 15) << found;
  EXPECT_FALSE(has_words(found, "WARNING"));
}

TEST_F(Unloaded, one_picture_twice_or_one_alone_is_refused) {
  const std::string one = picture("beads_relaxed.tif");
  EXPECT_EQ(run_program("mbtfm noise " + one + " " + one).code, 3);
  EXPECT_EQ(run_program("mbtfm noise " + one).code, 2);
}

/// The noise that a simulation is asked for is the noise it has, whatever the gel.
TEST(SimulatedNoise, noise_in_um_and_beads_by_area_hold_on_every_gel) {
  const test::TemporaryFolder folder;
  for (const char* gel : {"1", "16"}) {
    const fs::path cell = folder / gel;
    output_of(
        "mbtfm-simulate --quiet --scenario two-adhesions --noise_um 0.03 --beads_per_um2 0.5 --youngs_modulus_kPa " +
        std::string(gel) + " --out " + cell.string());
    const auto truth = files::read_displacement(cell / "truth/displacement.csv"),
               measured = files::read_displacement(cell / "2_track/displacement.csv");
    ASSERT_EQ(measured.size(), static_cast<std::size_t>(std::lround(0.5 * 51.2 * 51.2)));
    double squares = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const Vec2 d = measured[i].displacement_um - truth[i].displacement_um;
      squares += dot(d, d);
      EXPECT_DOUBLE_EQ(measured[i].sigma_um, 0.03);
    }
    // of 2622 components: three standard deviations of their root mean square are 4 %
    EXPECT_NEAR(std::sqrt(squares / (2.0 * static_cast<double>(truth.size()))), 0.03, 0.04 * 0.03);
  }
}

}  // namespace
}  // namespace mbtfm
