#include <gtest/gtest.h>
#include <sys/wait.h>

#include <fstream>
#include <sstream>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/files.h"
#include "segment/image.h"
#include "tests/support/bead_pair.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm {
namespace {

struct Ended {
  int code = 0;
  std::string said;
};

Ended run_track(const test::TemporaryFolder& folder, const std::string& arguments) {
  const std::string log = (folder / "log").string();
  const std::string command = MBTFM_BINARY_DIR "/bin/mbtfm-track " + arguments + " >" + log + " 2>&1";
  const int status = std::system(command.c_str());
  std::stringstream said;
  said << std::ifstream(log).rdbuf();
  return {WEXITSTATUS(status), said.str()};
}

std::string files(const test::TemporaryFolder& folder, const std::string& relaxed, const std::string& stressed) {
  return "--relaxed " + (folder / relaxed).string() + " --stressed " + (folder / stressed).string() + " --out " +
         (folder / "out").string();
}

void write(const std::filesystem::path& file, segment::Image image, std::optional<double> pixel_size_um) {
  image.pixel_size_um = pixel_size_um;
  segment::write_tiff(file, image);
}

TEST(TrackEndToEnd, images_become_a_displacement_file_in_um) {
  const test::TemporaryFolder folder;
  const auto pair = test::draw_bead_pair({}, {.width = 128, .n_beads = 330, .drift = {2, 1}});
  write(folder / "r.tif", pair.relaxed, 0.2);
  write(folder / "s.tif", pair.stressed, 0.2);
  const Ended ended = run_track(folder, files(folder, "r.tif", "s.tif"));
  ASSERT_EQ(ended.code, 0) << ended.said;
  const DisplacementField field = read_displacement(folder / "out/displacement.csv");
  EXPECT_GT(field.size(), 150u);
  for (const Bead& bead : field) EXPECT_LE(std::max(bead.position_um.x, bead.position_um.y), 128 * 0.2);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/displacement.vtp"));
}

TEST(TrackEndToEnd, a_folder_of_frames_is_tracked_against_one_relaxed_image) {
  const test::TemporaryFolder folder;
  const auto one = test::draw_bead_pair({}, {.width = 128, .n_beads = 330, .drift = {2, 1}});
  const auto two = test::draw_bead_pair({}, {.width = 128, .n_beads = 330, .drift = {-3, 2}});  // of the same beads
  write(folder / "r.tif", one.relaxed, 0.2);
  std::filesystem::create_directory(folder / "frames");
  write(folder / "frames/a.tif", one.stressed, 0.2);
  write(folder / "frames/b.tif", two.stressed, 0.2);
  const Ended ended = run_track(folder, files(folder, "r.tif", "frames"));
  ASSERT_EQ(ended.code, 0) << ended.said;
  const CsvTable frames(folder / "out/frames.csv");
  ASSERT_EQ(frames.n_rows(), 2);
  EXPECT_NEAR(frames.number(0, "drift_x_um"), 0.4, 0.005);
  EXPECT_NEAR(frames.number(1, "drift_x_um"), -0.6, 0.005);
  const auto first = read_displacement(folder / "out/displacement_0001.csv");
  EXPECT_EQ(first.size(), read_displacement(folder / "out/displacement_0002.csv").size());
  EXPECT_EQ(read_text(folder / "out/displacement.csv"), read_text(folder / "out/displacement_0001.csv"));
}

TEST(TrackEndToEnd, displacements_of_another_program_take_the_place_of_images) {
  const test::TemporaryFolder folder;
  write_text(folder / "piv.csv", "x,y,u,v\n0,0,1,0\n10,0,1,0\n0,10,1,0\n10,10,NaN,0\n");
  const std::string out = " --out " + (folder / "out").string();
  const std::string given = "--displacement " + (folder / "piv.csv").string() + out;
  const std::string columns = " --x_column x --y_column y --ux_column u --uy_column v";
  const Ended ended = run_track(folder, given + columns + " --length_unit px --pixel_size_um 0.5");
  ASSERT_EQ(ended.code, 0) << ended.said;
  EXPECT_NE(ended.said.find("1 flagged"), std::string::npos) << ended.said;
  const DisplacementField field = read_displacement(folder / "out/displacement.csv");
  ASSERT_EQ(field.size(), 4u);
  EXPECT_EQ(field[1].position_um, (Vec2{5.25, 0.25}));
  EXPECT_EQ(field[1].displacement_um, (Vec2{0.5, 0}));
  EXPECT_EQ(field[3].flag, "not a number");
  EXPECT_EQ(run_track(folder, given).code, 3);                                                  // other columns
  EXPECT_EQ(run_track(folder, given + columns + " --length_unit px").code, 2);                  // of which size?
  EXPECT_EQ(run_track(folder, given + " --relaxed " + (folder / "piv.csv").string()).code, 2);  // which of them?
  EXPECT_EQ(run_track(folder, out).code, 2);
}

TEST(TrackEndToEnd, what_is_wrong_with_the_images_is_said_and_nothing_is_left) {
  const test::TemporaryFolder folder;
  const auto pair = test::draw_bead_pair({}, {.width = 128, .n_beads = 330});
  const auto small = test::draw_bead_pair({}, {.width = 96, .n_beads = 200});
  const auto dark = test::draw_bead_pair({}, {.width = 128, .n_beads = 0});
  write(folder / "r.tif", pair.relaxed, 0.2);
  write(folder / "small.tif", small.stressed, 0.2);
  write(folder / "dark.tif", dark.stressed, 0.2);
  write(folder / "other_scale.tif", pair.stressed, 0.25);
  write(folder / "no_scale.tif", pair.stressed, std::nullopt);
  std::filesystem::copy_file(folder / "r.tif", folder / "cut.tif");
  std::filesystem::resize_file(folder / "cut.tif", 3000);
  const struct {
    const char *relaxed, *stressed;
    std::vector<std::string> said;
  } cases[] = {{"r.tif", "none.tif", {"none.tif"}},
               {"r.tif", "cut.tif", {"cut.tif"}},
               {"r.tif", "small.tif", {"small.tif", "r.tif", "128 x 128", "96 x 96"}},
               {"r.tif", "dark.tif", {"dark.tif", "beads", "none"}},
               {"r.tif", "other_scale.tif", {"other_scale.tif", "r.tif", "0.25"}},
               {"no_scale.tif", "no_scale.tif", {"no_scale.tif", "calibration", "pixel_size_um"}}};
  for (const auto& c : cases) {
    const Ended ended = run_track(folder, files(folder, c.relaxed, c.stressed));
    EXPECT_EQ(ended.code, 3) << ended.said;
    for (const std::string& word : c.said)
      EXPECT_NE(ended.said.find(word), std::string::npos) << word << ": " << ended.said;
    EXPECT_FALSE(std::filesystem::exists(folder / "out/displacement.csv")) << c.stressed;
  }
}

}  // namespace
}  // namespace mbtfm
