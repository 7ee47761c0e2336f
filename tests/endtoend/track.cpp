#include <gtest/gtest.h>
#include <sys/wait.h>

#include <fstream>
#include <sstream>

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
