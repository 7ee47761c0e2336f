/// Presets, wanted accuracy and the cost study, as a person runs them on a small cell.
#include "tests/support/program.h"

namespace mbtfm {
namespace {

class SmallCell : public testing::Test {
 protected:
  void SetUp() override {
    output_of("mbtfm-simulate --scenario ring --seed 3 --noise 0.02 --beads 800 --quiet --out " + cell.string());
  }
  Outcome run(const std::string& arguments) const { return run_program("mbtfm " + arguments + " " + cell.string()); }
  test::TemporaryFolder folder;
  fs::path cell = folder / "cell";
};

TEST_F(SmallCell, is_fitted_anew_where_the_preset_changes_and_only_then) {
  ASSERT_EQ(run("run --preset fast").code, 0);
  EXPECT_TRUE(has_words(files::read_text(cell / "run.json"), "\"preset\": \"fast\""));
  EXPECT_TRUE(has_words(files::read_text(cell / "4_fit/record.json"), "\"edge_length_um\": 2.5"));
  EXPECT_TRUE(has_words(run("run --preset fast").output, "fit      up to date"));
  EXPECT_TRUE(has_words(run("run").output, "fit      "));
  EXPECT_TRUE(has_words(files::read_text(cell / "4_fit/record.json"), "\"edge_length_um\": 1.5"));
  EXPECT_TRUE(has_words(run("run --preset standard").output, "fit      up to date"));
  EXPECT_EQ(run("run --preset quick").code, 2);
}

TEST_F(SmallCell, is_fitted_as_accurately_as_asked_for_or_says_why_not) {
  const std::string easy = output_of(run("run --accuracy 90%"));
  EXPECT_TRUE(has_words(files::read_text(cell / "run.json"), "\"met\": true")) << easy;
  EXPECT_TRUE(has_words(files::read_text(cell / "report.html"), "Verified by the error budget: tensions to"));
  EXPECT_TRUE(has_words(output_of(run("run --accuracy 0.0001%")), "no computing reaches that"));
  EXPECT_TRUE(has_words(files::read_text(cell / "report.html"), "no computing reaches that"));
  ASSERT_EQ(run("run").code, 0);
  EXPECT_FALSE(has_words(files::read_text(cell / "report.html"), "Verified by"));
  EXPECT_EQ(run("run --accuracy 1% --preset fast").code, 2);
}

TEST_F(SmallCell, has_a_cost_study_within_its_budget) {
  ASSERT_EQ(run("run").code, 0);
  output_of(run("cost --repeats 1 --budget 0.05"));
  EXPECT_TRUE(has_words(files::read_text(cell / "cost/cost.csv"), "as it is,,"));
  EXPECT_TRUE(fs::is_regular_file(cell / "cost/cost.svg"));
  EXPECT_TRUE(has_words(files::read_text(cell / "cost/cost.md"), "| knob | half the error costs |"));
  EXPECT_FALSE(fs::exists(cell / "cost/scratch"));
}

}  // namespace
}  // namespace mbtfm
