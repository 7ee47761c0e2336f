/// "Add it and run again": fibres that the beads call for, put beside the segmented ones.
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

TEST(AddFibres, fibres_that_the_beads_call_for_are_in_the_next_run) {
  const test::TemporaryFolder folder;
  const std::filesystem::path cell = folder / "cell";
  ASSERT_EQ(run_program("mbtfm-simulate --images --quiet --seed 61 --out " + cell.string()).code, 0);
  // strong fibres alone are segmented
  files::write_text(cell / "cell.toml", files::read_text(cell / "cell.toml") + "\n[segment]\nfibre_start_noise = 60\n");
  const auto fibres = [&] {
    return files::read_fibres(cell / "1_segment/fibres.csv", cell / "1_segment/fibre_points.csv");
  };
  const auto missing = [&] { return files::CsvTable(cell / "4_fit/missing_fibres.csv"); };
  const Outcome first = run_program("mbtfm run --quiet " + cell.string());
  ASSERT_EQ(first.code, 0) << first.output;
  const std::size_t n_segmented = fibres().size();
  const files::CsvTable named = missing();
  ASSERT_GT(named.n_rows(), 0);

  const Outcome added =
      run_program("mbtfm-add-fibres --rois " + (cell / "1_segment/RoiSet.zip").string() + " --missing " +
                  (cell / "4_fit/missing_fibres.csv").string() + " --out " + (cell / "fibres.zip").string());
  ASSERT_EQ(added.code, 0) << added.output;
  output_of("mbtfm run --quiet " + cell.string());
  const std::vector<Fibre> now = fibres();
  EXPECT_EQ(now.size(), n_segmented + static_cast<std::size_t>(named.n_rows()));
  for (int row = 0; row < named.n_rows(); ++row) {
    const int start = named.integer(row, "start_adhesion_id", 1), end = named.integer(row, "end_adhesion_id", 1);
    EXPECT_TRUE(std::ranges::any_of(
        now, [&](const Fibre& f) { return f.start_adhesion_id == start && f.end_adhesion_id == end; }))
        << "from adhesion " << start << " to " << end;
  }
  const files::CsvTable left = missing();
  EXPECT_NE(left.n_rows() > 0 ? left.integer(0, "start_adhesion_id", 1) : 0, named.integer(0, "start_adhesion_id", 1))
      << "what was added first is called for no longer";
}

TEST(AddFibres, a_table_of_another_run_is_refused_by_name) {
  const test::TemporaryFolder folder;
  files::write_text(folder / "missing.csv", "start_adhesion_id,end_adhesion_id,tension_nN\n1,2,3\n");
  output_of("mbtfm-add-fibres --rois " + (folder / "none.zip").string() + " --missing " +
                (folder / "missing.csv").string() + " --out " + (folder / "out.zip").string(),
            3);
  EXPECT_FALSE(std::filesystem::exists(folder / "out.zip"));
}

}  // namespace
}  // namespace mbtfm
