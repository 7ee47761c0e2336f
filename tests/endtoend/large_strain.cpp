/// A cell that strains its gel beyond linear elasticity, simulated and fitted.
#include "pipeline/contract/results.h"
#include "pipeline/files/csv_files.h"
#include "tests/support/findings.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

class LargeStrains : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    made_ = new test::TemporaryFolder;
    // its elements are finer than the fit's, and noise of two thousandths lets the gel's law be seen
    output_of(
        "mbtfm-simulate --quiet --scenario two-adhesions --seed 3 --beads 6000 "
        "--youngs_modulus_kPa 11 --noise 0.002 --simulation_material neo-hooke --out " +
        (*made_ / "cell").string());
    toml_ = files::read_text(*made_ / "cell/cell.toml");
    linear_ = run_program("mbtfm run --verbose " + (*made_ / "cell").string());
    ASSERT_EQ(linear_.code, 0) << linear_.output;
    fs::copy(*made_ / "cell", *made_ / "large", fs::copy_options::recursive);
    files::write_text(*made_ / "large/cell.toml", toml_ + kNeoHooke);
    large_ = run_program("mbtfm run --verbose " + (*made_ / "large").string());
    ASSERT_EQ(large_.code, 0) << large_.output;
  }
  static void TearDownTestSuite() { delete made_; }

  /// Finished, and fitted linearly.
  void SetUp() override { fs::copy(*made_ / "cell", cell(), fs::copy_options::recursive); }
  fs::path cell() const { return folder_ / "cell"; }

  Outcome run(const std::string& settings) {
    files::write_text(cell() / "cell.toml", toml_ + settings);
    return run_program("mbtfm run --verbose " + cell().string());
  }
  /// Of the forces found, |F − true| / |true|.
  static double error(const fs::path& of_cell) {
    const auto truth = files::read_adhesion_forces(of_cell / "truth/adhesion_forces.csv"),
               found = files::read_adhesion_forces(of_cell / "4_fit/adhesion_forces.csv");
    double off = 0, size = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      off += std::pow(norm(found.at(i).force_nN - truth[i].force_nN), 2);
      size += std::pow(norm(truth[i].force_nN), 2);
    }
    return std::sqrt(off / size);
  }

  static inline const std::string kNeoHooke = "\n[substrate]\nmaterial = 'neo-hooke'\n";
  static inline test::TemporaryFolder* made_ = nullptr;
  static inline Outcome linear_, large_;

 private:
  static inline std::string toml_;
  test::TemporaryFolder folder_;
};

TEST_F(LargeStrains, a_fit_that_has_them_comes_nearer_to_the_truth_than_one_that_has_not) {
  EXPECT_TRUE(has_words(linear_.output, "large strain: off (auto)"));
  EXPECT_TRUE(has_words(large_.output, "large strain: on (auto)"));
  const double error_of_linear = error(*made_ / "cell"), error_of_large = error(*made_ / "large");
  RecordProperty("errors", std::to_string(error_of_linear) + " " + std::to_string(error_of_large));
  EXPECT_LT(error_of_large, 0.6 * error_of_linear);
}

/// The images of a real cell show its adhesions under their own pull; the simulator draws them at rest.
TEST_F(LargeStrains, a_cell_seen_under_load_is_led_back_to_the_gel_at_rest) {
  const double error_at_rest = error(*made_ / "large");
  std::vector<Adhesion> adhesions = files::read_adhesions(cell() / "1_segment/adhesions.csv");
  std::string centres = "x_um,y_um\n";
  for (const Adhesion& a : adhesions)
    centres += std::to_string(a.position_um.x) + "," + std::to_string(a.position_um.y) + "\n";
  files::write_text(cell() / "centres.csv", centres);
  const std::string truth = (cell() / "truth").string();
  const Outcome moved = run_program(
      "mbtfm-substrate --quiet --youngs_modulus_kPa 11 --material neo-hooke --large_strain on --displacement_tolerance "
      "0 --elements_across_adhesion 2 --growth 8 --adhesions " +
      truth + "/adhesions.csv --forces " + truth + "/adhesion_forces.csv --points " +
      (cell() / "centres.csv").string() + " --out " + (cell() / "moved.csv").string());
  ASSERT_EQ(moved.code, 0) << moved.output;
  const DisplacementField by = files::read_displacement(cell() / "moved.csv");
  for (std::size_t a = 0; a < adhesions.size(); ++a) {
    EXPECT_GT(norm(by.at(a).displacement_um), 0.5);  // half an adhesion
    adhesions[a].position_um += by[a].displacement_um;
  }
  files::write_adhesions(cell() / "1_segment/adhesions.csv", adhesions);
  EXPECT_TRUE(has_words(output_of(run(kNeoHooke)), "beads under load: on (auto)", "large strain: on (auto)"));
  RecordProperty("errors", std::to_string(error_at_rest) + " " + std::to_string(error(cell())));
  EXPECT_NEAR(error(cell()), error_at_rest, 0.002);
}

TEST_F(LargeStrains, switched_off_they_change_nothing) {
  const std::string forces = files::read_text(cell() / "4_fit/adhesion_forces.csv");
  ASSERT_EQ(run(kNeoHooke + "[effects]\nlarge_strain = 'off'\n").code, 0);
  EXPECT_EQ(files::read_text(cell() / "4_fit/adhesion_forces.csv"), forces);
}

TEST_F(LargeStrains, what_has_no_model_of_them_is_refused_or_said) {
  const std::string kGraded = "\n[substrate]\nmaterial = 'neo-hooke'\nmodulus_profile = '0:11, 60:33'\n";
  EXPECT_TRUE(has_words(output_of(run(kGraded + "[effects]\nlarge_strain = 'on'\n"), 2), "one modulus alone"));
  EXPECT_TRUE(has_words(output_of(run(kGraded)), "one modulus alone"));
}

TEST_F(LargeStrains, a_gel_too_soft_for_its_forces_is_fitted_linearly_and_named) {
  // the same displacement on a gel of another modulus: tractions over the modulus stay, so the forces are raised
  DisplacementField beads = files::read_displacement(cell() / "2_track/displacement.csv");
  for (Bead& b : beads) {
    b.displacement_um = 6 * b.displacement_um;
    b.sigma_um *= 6;
  }
  files::write_displacement(cell() / "2_track/displacement.csv", beads);
  const std::string outcome = output_of(run(kNeoHooke));
  EXPECT_TRUE(has_words(outcome, "large strain: off (auto)", "found no state at rest"));
  EXPECT_TRUE(test::fires("large-strain", "Small-strain", outcome)) << outcome;
}

}  // namespace
}  // namespace mbtfm
