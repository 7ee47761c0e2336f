/// What happens beside the cell moves no force of it: the stage between the pictures, another cell in the field.
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/own_files.h"
#include "tests/support/findings.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

/// A cell between two adhesions, and what a run makes of its pictures.
struct SimulatedRun {
  test::TemporaryFolder folder;
  FitSummary fit;
  DisplacementField found, truth;
  std::string output;
  explicit SimulatedRun(const std::string& simulation) {
    output_of("mbtfm-simulate --quiet --scenario two-adhesions --seed 3 --noise_um 0.02 --images " + simulation +
              " --out " + (folder / "cell").string());
    output = output_of("mbtfm run --verbose " + (folder / "cell").string());
    fit = files::read_fit_summary(folder / "cell/4_fit/fit.json");
    found = files::read_displacement(folder / "cell/2_track/displacement.csv");
    truth = files::read_displacement(folder / "cell/truth/displacement.csv");
  }
};

double total_force_sigma_nN(const FitSummary& fit) {
  const auto found = std::ranges::find(fit.more, "total_force_sigma_nN", [](const auto& entry) { return entry.first; });
  return std::get<double>(found->second);
}

/// Of the good beads, the share whose place at rest is a bead's true place.
double share_in_place(const SimulatedRun& run) {
  int n = 0, n_in_place = 0;
  for (const Bead& bead : run.found) {
    if (!bead.flag.empty()) continue;
    ++n;
    constexpr double kOnePixel_um = 0.1;  // beads are found to a tenth of it, and two are four pixels apart
    n_in_place += std::ranges::any_of(
        run.truth, [&](const Bead& b) { return norm(b.position_um - bead.position_um) < kOnePixel_um; });
  }
  return static_cast<double>(n_in_place) / n;
}

const SimulatedRun& at_rest() {
  static const SimulatedRun made("");
  return made;
}

class StageMoves : public ::testing::TestWithParam<const char*> {};

TEST_P(StageMoves, beads_are_where_the_cell_was_and_the_force_stays) {
  const SimulatedRun moved(GetParam());
  // of 2 500 beads some lie beyond the field's border, where the truth has none; neighbours whose light melts together
  EXPECT_GT(share_in_place(moved), 0.95);
  EXPECT_GT(share_in_place(at_rest()), 0.95);
  // the pictures have other noise: two independent errors, three standard deviations of their difference
  const double sigma_nN = std::hypot(total_force_sigma_nN(at_rest().fit), total_force_sigma_nN(moved.fit));
  EXPECT_NEAR(moved.fit.total_force_nN, at_rest().fit.total_force_nN, 3 * sigma_nN) << moved.output;
}

INSTANTIATE_TEST_SUITE_P(ByDriftAndTurn, StageMoves,
                         ::testing::Values("--drift_x_um=3 --drift_y_um=-1.5", "--drift_x_um=-9 --drift_y_um=12",
                                           "--drift_x_um=1 --drift_y_um=2 --turn_deg=1"));

TEST(CellWithRelaxedBeads, are_asked_for_in_the_images_table) {
  const SimulatedRun& moved = at_rest();
  files::write_text(moved.folder / "cell/cell.toml",
                    files::read_text(moved.folder / "cell/cell.toml") + "\n[images]\ncell_with = \"relaxed\"\n");
  output_of("mbtfm run " + (moved.folder / "cell").string());
  EXPECT_TRUE(has_words(files::read_text(moved.folder / "cell/run.json"), "\"cell_with\": \"relaxed\""));
}

/// A cell whose segmentation and beads are given.
FitSummary fit_of(const std::string& simulation, const std::string& settings, std::string& findings) {
  const test::TemporaryFolder folder;
  const std::string cell = (folder / "cell").string();
  output_of("mbtfm-simulate --quiet --scenario two-adhesions --seed 3 --noise_um 0.01 " + simulation + " --out " +
            cell);
  files::write_text(cell + "/cell.toml", files::read_text(cell + "/cell.toml") + settings);
  output_of("mbtfm run " + cell);
  findings = files::read_text(cell + "/run.json");
  return files::read_fit_summary(cell + "/4_fit/fit.json");
}

/// A cell of 8 by 30 um at a distance of 14 um: its pull is as large where this one's adhesions are as a tenth of
/// theirs.
TEST(Neighbour, pulls_and_leaves_the_force_of_this_cell_as_it_is) {
  std::string alone_findings, findings, findings_without;
  const FitSummary alone = fit_of("", "", alone_findings);
  const FitSummary beside = fit_of("--neighbour_y_um=14", "", findings);
  const FitSummary taken_over = fit_of("--neighbour_y_um=14", "\n[effects]\nbeyond_cut = \"off\"\n", findings_without);
  EXPECT_FALSE(test::fires("neighbour-pulls", alone_findings));
  EXPECT_TRUE(test::fires("neighbour-pulls", findings));
  // the same noise, but other beads are used: three standard errors
  const double sigma_nN = std::hypot(total_force_sigma_nN(alone), total_force_sigma_nN(beside));
  EXPECT_NEAR(beside.total_force_nN, alone.total_force_nN, 3 * sigma_nN);
  EXPECT_GT(std::abs(taken_over.total_force_nN - alone.total_force_nN),
            std::abs(beside.total_force_nN - alone.total_force_nN));
}

/// One of the two is the cell whose truth is there; the other's pull is allowed for.
TEST(AllCells, have_a_folder_each_and_the_force_that_one_alone_has) {
  const test::TemporaryFolder folder;
  const std::string cell = (folder / "cell").string();
  output_of(
      "mbtfm-simulate --quiet --scenario two-adhesions --seed 3 --noise_um 0.02 --images --neighbour_y_um=14 --out " +
      cell);
  files::write_text(cell + "/cell.toml", files::read_text(cell + "/cell.toml") + "\n[segment]\ncell = 0\n");
  output_of("mbtfm run " + cell);
  double truth_nN = 0, least = 1e9;
  for (const AdhesionForce& f : files::read_adhesion_forces(cell + "/truth/adhesion_forces.csv"))
    truth_nN += norm(f.force_nN);
  for (const char* one : {"/cell_1", "/cell_2"}) {
    EXPECT_TRUE(test::fires("neighbour-pulls", files::read_text(cell + one + "/run.json"))) << one;
    const FitSummary fit = files::read_fit_summary(cell + one + "/4_fit/fit.json");
    least = std::min(least, std::abs(fit.total_force_nN - truth_nN) / total_force_sigma_nN(fit));
  }
  EXPECT_LT(least, 3) << "standard errors of the total force";
  EXPECT_FALSE(files::is_file(cell + "/cell_3/cell.toml"));
  const std::string refused = output_of("mbtfm run --set segment.cell=2 " + cell, 2);
  EXPECT_TRUE(has_words(refused, "write cell = 2 below [segment] in " + cell + "/cell.toml")) << refused;
}

TEST(AllCells, leave_a_cell_of_the_users_own_as_it_is) {
  const test::TemporaryFolder folder;
  const std::string own = "pixel_size_um = 0.2\n";
  files::write_text(folder / "cell.toml", "pixel_size_um = 0.1\n[segment]\ncell = 0\n");
  fs::create_directories(folder / "cell_1");
  files::write_text(folder / "cell_1/cell.toml", own);
  EXPECT_TRUE(has_words(output_of("mbtfm run " + (folder / "").string(), 2), "would overwrite it"));
  EXPECT_EQ(files::read_text(folder / "cell_1/cell.toml"), own);
}

}  // namespace
}  // namespace mbtfm
