/// Bad input: an error that names file, place, expectation and finding; a non-zero exit code; nothing half-written.
#include <gtest/gtest.h>

#include <random>

#include <fstream>

#include "pipeline/files/csv_files.h"
#include "pipeline/files/text.h"
#include "segment/images/image.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

namespace fs = std::filesystem;
using test::Outcome;
using test::run_program;
using test::TemporaryFolder;

constexpr int kUsage = 2, kInput = 3, kOutput = 5;

class Errors : public ::testing::Test {
 protected:
  /// A small cell: two adhesions and a fibre, with images.
  static void SetUpTestSuite() {
    scene_ = new TemporaryFolder;
    const Outcome made = run_program("mbtfm-simulate --scenario two-adhesions --seed 3 --images --quiet --out " +
                                     (scene_->path() / "cell").string());
    ASSERT_EQ(made.code, 0) << made.output;
  }
  static void TearDownTestSuite() { delete scene_; }

  void SetUp() override { fs::copy(scene_->path() / "cell", cell_, fs::copy_options::recursive); }

  void replace_in_toml(const std::string& what, const std::string& by) const {
    std::string text = files::read_text(cell_ / "cell.toml");
    const auto at = text.find(what);
    ASSERT_NE(at, std::string::npos) << text;
    text.replace(at, text.find('\n', at) - at, by);
    files::write_text(cell_ / "cell.toml", text);
  }

  /// Run the cell, expect this code and these words, and that no output was left in `folder`.
  void expect_error(int code, const std::vector<std::string>& words, const std::string& folder) const {
    const Outcome outcome = run_program("mbtfm run " + cell_.string());
    EXPECT_EQ(outcome.code, code) << outcome.output;
    for (const std::string& word : words) {
      EXPECT_NE(outcome.output.find(word), std::string::npos) << "'" << word << "' is not in: " << outcome.output;
    }
    if (!fs::exists(cell_ / folder)) return;
    for (const auto& entry : fs::directory_iterator(cell_ / folder)) {
      ADD_FAILURE() << "left behind: " << entry.path();
    }
  }

  TemporaryFolder folder_;
  fs::path cell_ = folder_ / "cell";
  static inline TemporaryFolder* scene_ = nullptr;
};

TEST_F(Errors, a_missing_image_is_named) {
  fs::remove(cell_ / "actin.tif");
  expect_error(kInput, {"actin.tif"}, "1_segment");
}

TEST_F(Errors, an_empty_folder_is_told_what_it_lacks) {
  fs::remove_all(cell_);
  fs::create_directory(cell_);
  expect_error(kInput, {"cell.toml"}, "1_segment");
}

TEST_F(Errors, a_truncated_image_is_named) {
  fs::resize_file(cell_ / "actin.tif", fs::file_size(cell_ / "actin.tif") / 3);
  expect_error(kInput, {"actin.tif"}, "1_segment");
}

TEST_F(Errors, images_of_different_sizes_are_named_with_their_sizes) {
  images::Image small = images::read_image(cell_ / "actin.tif");
  small.height /= 2;
  small.pixels.resize(static_cast<std::size_t>(small.width) * small.height);
  images::write_tiff(cell_ / "actin.tif", small);
  expect_error(kInput, {"actin.tif", std::to_string(small.height)}, "1_segment");
}

TEST_F(Errors, bead_images_of_different_sizes_are_named_with_their_sizes) {
  images::Image small = images::read_image(cell_ / "beads_relaxed.tif");
  small.height /= 2;
  small.pixels.resize(static_cast<std::size_t>(small.width) * small.height);
  images::write_tiff(cell_ / "beads_relaxed.tif", small);
  expect_error(kInput, {"beads_relaxed.tif", std::to_string(small.height)}, "2_track");
}

TEST_F(Errors, an_image_without_adhesions_says_so) {
  images::Image noise = images::read_image(cell_ / "paxillin.tif");
  std::mt19937_64 random(1);
  for (float& value : noise.pixels) value = 200 + static_cast<float>(random() % 32);
  images::write_tiff(cell_ / "paxillin.tif", noise);
  expect_error(kInput, {"no adhesion", "paxillin.tif"}, "1_segment");
}

TEST_F(Errors, a_constant_image_is_called_so) {
  images::Image flat = images::read_image(cell_ / "paxillin.tif");
  std::fill(flat.pixels.begin(), flat.pixels.end(), 200.0f);
  images::write_tiff(cell_ / "paxillin.tif", flat);
  expect_error(kInput, {"every pixel is 200", "paxillin.tif"}, "1_segment");
}

TEST_F(Errors, an_unknown_key_names_its_line_and_the_nearest_known_one) {
  replace_in_toml("pixel_size_um", "pixel_sise_um = 0.1");
  expect_error(kInput, {"cell.toml:", "'pixel_sise_um'", "pixel_size_um"}, "1_segment");
}

TEST_F(Errors, a_missing_pixel_size_is_asked_for) {
  replace_in_toml("pixel_size_um", "");
  for (const char* name : {"paxillin.tif", "actin.tif", "beads_stressed.tif", "beads_relaxed.tif"}) {
    images::Image image = images::read_image(cell_ / name);
    image.pixel_size_um.reset();
    images::write_tiff(cell_ / name, image);
  }
  expect_error(kInput, {"pixel_size_um"}, "1_segment");
}

TEST_F(Errors, a_negative_modulus_is_refused_before_anything_runs) {
  replace_in_toml("youngs_modulus_kPa", "youngs_modulus_kPa = -8.4");
  expect_error(kInput, {"cell.toml:", "youngs_modulus_kPa", "a number >= 0.001", "-8.4"}, "1_segment");
}

TEST_F(Errors, a_poisson_ratio_of_one_half_is_refused_before_anything_runs) {
  replace_in_toml("poisson_ratio", "poisson_ratio = 0.51");
  expect_error(kInput, {"cell.toml:", "poisson_ratio", "<= 0.5", "'0.51'"}, "1_segment");
}

TEST_F(Errors, not_a_number_in_a_table_names_file_line_and_column) {
  fs::create_directory(cell_ / "2_track");
  files::write_text(cell_ / "2_track/displacement.csv",
                    "x_um,y_um,ux_um,uy_um,sigma_um\n1,2,0.1,0.1,0.02\n3,4,nan,0,0.02\n");
  expect_error(kInput, {"displacement.csv:3", "'ux_um'", "'nan'"}, "4_fit");
}

TEST_F(Errors, an_adhesion_outside_the_outline_is_named) {
  fs::create_directory(cell_ / "1_segment");
  for (const char* file : {"adhesions.csv", "fibres.csv", "fibre_points.csv", "outline.csv"}) {
    fs::copy(cell_ / "truth" / file, cell_ / "1_segment" / file);
  }
  auto adhesions = files::read_adhesions(cell_ / "1_segment/adhesions.csv");
  adhesions.push_back(adhesions.front());
  adhesions.back().adhesion_id = 77;
  adhesions.back().position_um = {1000, 1000};
  files::write_adhesions(cell_ / "1_segment/adhesions.csv", adhesions);
  expect_error(kInput, {"adhesion 77", "outline"}, "3_network");
}

TEST_F(Errors, a_full_disk_leaves_nothing_and_says_so) {
  // A limit on the size of files, its signal ignored, fails a write half-way as a full disk does.
  const Outcome outcome = run_program("mbtfm-network --edge_length_um 0.5 --cell " + (cell_ / "truth").string() +
                                          " --out " + (folder_ / "new/network.vtu").string(),
                                      "trap '' XFSZ; ulimit -f 8; ");
  EXPECT_EQ(outcome.code, kOutput) << outcome.output;
  EXPECT_NE(outcome.output.find("network.vtu"), std::string::npos) << outcome.output;
  EXPECT_FALSE(fs::exists(folder_ / "new")) << "neither the file nor the folder made for it";
}

TEST_F(Errors, a_wrong_flag_names_it) {
  const Outcome outcome = run_program("mbtfm-network --sed 3");
  EXPECT_EQ(outcome.code, kUsage);
  EXPECT_NE(outcome.output.find("--sed"), std::string::npos) << outcome.output;
}

}  // namespace
}  // namespace mbtfm
