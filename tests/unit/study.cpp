#include "pipeline/statistics/study.h"

#include <gtest/gtest.h>

#include "pipeline/contract/errors.h"
#include "pipeline/statistics/study_files.h"
#include "tests/support/fake_cell.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::statistics {
namespace {

/// Two finished cells and one without a fit.
struct FakeStudy {
  test::TemporaryFolder folder;
  FakeStudy() {
    for (const unsigned seed : {1u, 2u}) {
      const auto cell = folder / ("cell_" + std::to_string(seed));
      test::write_given_stages(cell, test::round_cell());
      test::write_invented_fit(cell, seed);
    }
    test::write_given_stages(folder / "cell_3", test::round_cell());
  }
};

TEST(Study, counts_fibres_by_type_and_leaves_out_unfinished_cells) {
  const FakeStudy fake;
  const Study study = read_study(fake.folder.path());
  EXPECT_EQ(study.unfinished, std::vector<std::string>{"cell_3"});
  const auto types = summarise_types(study, {});
  ASSERT_EQ(types.size(), 9u);  // three types of all cells, and of each of two
  EXPECT_EQ(types[2].type, FibreType::ventral);
  EXPECT_EQ(types[2].n_fibres, 4);
  EXPECT_EQ(types[2].n_cells, 2);
}

TEST(Study, tensions_that_cannot_be_identified_do_not_enter) {
  const FakeStudy fake;
  Study study = read_study(fake.folder.path());
  const auto all = measured_fibres(study).size();
  for (Tension& t : study.cells[0].tensions) {
    if (t.fibre_id == 2) t.identifiable = false;
  }
  EXPECT_EQ(measured_fibres(study).size(), all - 1);
}

TEST(Study, tests_are_made_by_fibre_and_by_cell) {
  const FakeStudy fake;
  const auto tests = test_types(read_study(fake.folder.path()));
  // each way: Kruskal-Wallis and three pairs
  ASSERT_EQ(tests.size(), 8u);
  EXPECT_EQ(tests[0].n_a, 8);
  EXPECT_EQ(tests[4].unit, Unit::cell_median);
  EXPECT_EQ(tests[4].n_a, 6);
  for (const TypeTest& t : tests) {
    EXPECT_GE(t.p_value, 0);
    EXPECT_LE(t.p_value, 1);
    EXPECT_LE(std::abs(t.effect), 1);
    EXPECT_GE(t.p_holm.value_or(1), t.p_value);
  }
}

TEST(Study, tables_have_one_line_for_each_thing) {
  const FakeStudy fake;
  const Study study = read_study(fake.folder.path());
  const auto n_lines = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n'); };
  EXPECT_EQ(n_lines(cells_csv(study)), 1 + 2);
  EXPECT_EQ(n_lines(adhesions_csv(study)), 1 + 2 * 12);
  EXPECT_EQ(n_lines(fibres_csv(study)), 1 + 2 * 4);
  EXPECT_EQ(n_lines(types_csv(study, {})), 1 + 9);
}

TEST(Study, a_folder_without_a_finished_cell_is_an_error) {
  const test::TemporaryFolder folder;
  test::write_given_stages(folder / "cell", test::round_cell());
  EXPECT_THROW(read_study(folder.path()), InputError);
}

}  // namespace
}  // namespace mbtfm::statistics
