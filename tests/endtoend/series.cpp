/// A cell followed over time, through the programs.
#include <algorithm>
#include <sstream>

#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

/// The cell pulls twice as hard in the second frame; the third could not be tracked.
void write_frames(const fs::path& track) {
  DisplacementField field = files::read_displacement(track / "displacement.csv");
  files::write_displacement(track / "displacement_0001.csv", field);
  for (Bead& bead : field) bead.displacement_um = 2 * bead.displacement_um;
  files::write_displacement(track / "displacement_0002.csv", field);
  files::write_text(track / "frames.csv", "frame,image,refused\n1,a.tif,\n2,b.tif,\n3,c.tif,out of focus\n");
}

TEST(Series, a_run_with_frames_gives_tracks_and_a_changed_frame_is_seen) {
  const test::TemporaryFolder folder;
  const fs::path cell = folder / "cell";
  output_of("mbtfm-simulate --scenario two-adhesions --seed 1 --noise 0.05 --beads 800 --quiet --out " + cell.string());
  write_frames(cell / "2_track");
  std::string toml = files::read_text(cell / "cell.toml");
  files::write_text(cell / "cell.toml", toml + "\n[fit]\nframe_interval_s = 30\n");
  const Outcome run = run_program("mbtfm run " + cell.string());
  ASSERT_EQ(run.code, 0) << run.output;

  const auto single = files::read_tensions(cell / "4_fit/tensions.csv");
  const files::CsvTable tracks(cell / "4_fit/tracks.csv");
  ASSERT_EQ(tracks.n_rows(), 2 * static_cast<int>(single.size()));
  const auto n = static_cast<int>(single.size());
  for (int i = 0; i < n; ++i) {
    const double first = tracks.number(i, "tension_nN"), second = tracks.number(n + i, "tension_nN");
    const double sigma = tracks.number(n + i, "sigma_nN");
    // fitted twice, from different starts: the same to less than any bead could tell
    EXPECT_NEAR(first, single[i].tension_nN, 0.2 * tracks.number(i, "sigma_nN"));
    // … and with the same error, that of the cell's place in it; where a fit ends changes it by less
    const double high = *single[i].high_nN;
    EXPECT_NEAR(tracks.number(i, "high_nN"), high, 1e-3 * high);
    // twice the displacement is twice the tension while no cable is stretched
    EXPECT_NEAR(second, 2 * first, 4 * sigma);
    EXPECT_EQ(tracks.number(n + i, "time_s"), 30);
  }
  const files::CsvTable frames(cell / "4_fit/frames.csv");
  ASSERT_EQ(frames.n_rows(), 3);
  EXPECT_EQ(frames.text(2, "refused"), "out of focus");
  EXPECT_NEAR(frames.number(1, "total_force_nN"), 2 * frames.number(0, "total_force_nN"),
              4 * frames.number(1, "total_force_sigma_nN"));
  EXPECT_TRUE(fs::exists(cell / "4_fit/tracks.svg"));
  EXPECT_TRUE(has_words(files::read_text(cell / "4_fit/series.png"), std::string("acTL\0\0\0\2", 8))) << "two frames";
  EXPECT_TRUE(has_words(run.output, "; over 2 frames from "));
  EXPECT_TRUE(has_words(files::read_text(cell / "report.html"), "Over 2 frames the total force goes from ",
                        "1 frame could not be fitted", "data:image/png", files::read_text(cell / "4_fit/tracks.svg")));

  output_of("mbtfm batch --table " + folder.path().string());
  const files::CsvTable batch(folder / "batch.csv");
  EXPECT_NEAR(batch.number(0, "last_force_nN"), 2 * batch.number(0, "first_force_nN"),
              4 * frames.number(1, "total_force_sigma_nN"));
  EXPECT_NEAR(batch.number(0, "largest_force_change_nN"), batch.number(0, "first_force_nN"),
              4 * frames.number(1, "total_force_sigma_nN"));

  const std::string before = files::read_text(cell / "4_fit/tracks.csv");
  DisplacementField field = files::read_displacement(cell / "2_track/displacement_0002.csv");
  for (Bead& bead : field) bead.displacement_um = 1.5 * bead.displacement_um;
  files::write_displacement(cell / "2_track/displacement_0002.csv", field);
  output_of("mbtfm run " + cell.string());
  EXPECT_TRUE(has_words(files::read_text(cell / "4_fit/record.json"), "--kept"));
  const std::string after = files::read_text(cell / "4_fit/tracks.csv");
  EXPECT_EQ(after.substr(0, after.find("\n2,")), before.substr(0, before.find("\n2,")));  // the first frame's rows
  EXPECT_NEAR(files::CsvTable(cell / "4_fit/frames.csv").number(1, "total_force_nN"),
              3 * frames.number(0, "total_force_nN"), 4 * frames.number(1, "total_force_sigma_nN"));
  EXPECT_TRUE(has_words(run_program("mbtfm run " + cell.string()).output, "up to date"));
  fs::remove(cell / "2_track/displacement_0002.csv");  // nothing is there to make it from
  EXPECT_EQ(run_program("mbtfm run " + cell.string()).code, 3);
  files::write_displacement(cell / "2_track/displacement_0002.csv", field);

  files::write_text(cell / "2_track/frames.csv", "frame,image,refused\n1,a.tif,\n2,b.tif,\n");
  output_of("mbtfm run " + cell.string());
  EXPECT_EQ(files::CsvTable(cell / "4_fit/frames.csv").n_rows(), 2);
}

/// A fibre that the beads show is fitted in each frame, and not in the first alone: frames are compared with each
/// other.
TEST(Series, a_fibre_that_was_not_segmented_is_fitted_in_each_frame) {
  const test::TemporaryFolder folder;
  const fs::path cell = folder / "cell";
  output_of("mbtfm-simulate --scenario u2os --seed 3 --noise_um 0.02 --beads_per_um2 0.5 --quiet --out " +
            cell.string());
  const auto truth = files::read_tensions(cell / "truth/tensions.csv");
  const int strongest = std::ranges::max_element(truth.begin() + 1, truth.end(), {}, &Tension::tension_nN)->fibre_id;
  for (const char* table : {"fibres.csv", "fibre_points.csv"}) {
    std::istringstream lines(files::read_text(cell / "1_segment" / table));
    std::string kept;
    for (std::string line; std::getline(lines, line);)
      if (!line.starts_with(std::to_string(strongest) + ",")) kept += line + "\n";
    files::write_text(cell / "1_segment" / table, kept);
  }
  write_frames(cell / "2_track");
  ASSERT_EQ(run_program("mbtfm run " + cell.string()).code, 0);
  ASSERT_GE(files::CsvTable(cell / "4_fit/missing_fibres.csv").n_rows(), 1);
  const files::CsvTable frames(cell / "4_fit/frames.csv");
  const FitSummary fit = files::read_fit_summary(cell / "4_fit/fit.json");
  const double sigma = frames.number(0, "total_force_sigma_nN");
  EXPECT_NEAR(frames.number(0, "total_force_nN"), fit.total_force_nN, 0.2 * sigma) << "the same beads";
  EXPECT_NEAR(frames.number(1, "total_force_nN"), 2 * fit.total_force_nN, 4 * frames.number(1, "total_force_sigma_nN"));
}

}  // namespace
}  // namespace mbtfm
