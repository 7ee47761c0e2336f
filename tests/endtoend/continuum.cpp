/// mbtfm-indent and mbtfm-mean as a person runs them.
#include "pipeline/contract/beads.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "segment/images/image.h"
#include "tests/support/findings.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

using test::fires;

class Continuum : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string settings(const std::string& cell) const {
    files::write_text(
        file("cell.toml"),
        "[gel]\nyoungs_modulus_kPa = 10\npoisson_ratio = 0.49\nthickness_um = 60\nradius_um = 100\n[cell]\n" + cell);
    return file("cell.toml");
  }
  test::TemporaryFolder folder_;
};

constexpr const char* kCell =
    "volume_um3 = 5000\nheight_um = 7.5\nyoungs_modulus_kPa = 10\npoisson_ratio = 0.49\ncontraction_kPa = 30\n";

TEST_F(Continuum, a_cell_on_a_gel_gives_the_table_that_the_formats_promise) {
  const std::string outcome = test::output_of("mbtfm-indent --config " + settings(kCell) + " --out " + file("out"));
  EXPECT_TRUE(fires("large-strain", "would contract", outcome)) << outcome;
  EXPECT_FALSE(fires("cases-not-solved", outcome)) << outcome;
  const files::CsvTable table(file("out/indent.csv"));
  ASSERT_EQ(table.n_rows(), 1);
  // notes of an independent program: half a percent
  for (const auto& [column, value] : {std::pair{"depth_0_um", 0.1593}, std::pair{"depth_5_um", 0.2649},
                                      std::pair{"largest_u_um", 0.9592}, std::pair{"lift_um", 0.1027}})
    EXPECT_NEAR(table.number(0, column), value, 0.005 * value) << column;
  EXPECT_EQ(table.number(0, "height_um"), 7.5);
  EXPECT_EQ(table.number(0, "modulus_ratio"), 1);
  EXPECT_LT(table.number(0, "error_um"), 0.002);
  for (const char* name : {"indent.json", "indent.vtu"}) EXPECT_FALSE(files::read_text(file("out/") + name).empty());
}

TEST_F(Continuum, a_sweep_finds_the_height_that_presses_deepest) {
  test::output_of("mbtfm-indent --config " + settings(kCell) + " --order 4 --towards_rim 4 --out " + file("out") +
                  " --sweep 'height_um=5.3..11.3:4 modulus_ratio=0.5,1'");
  EXPECT_EQ(files::CsvTable(file("out/indent.csv")).n_rows(), 8);
  const files::CsvTable optima(file("out/optima.csv"));
  ASSERT_EQ(optima.n_rows(), 4);
  const std::vector<double> heights = {8.11, 7.81, 8.71, 8.40};  // at the surface and 5 um below, as published
  for (int row = 0; row < 4; ++row) {
    EXPECT_NEAR(optima.number(row, "height_um"), heights[row], 0.1) << row;
    EXPECT_LT(optima.number(row, "height_error_um"), 0.1);
  }
  EXPECT_TRUE(has_words(files::read_text(file("out/indent.svg")), "<svg"));
}

/// On a soft gel Newton's method finds no equilibrium of large strains for cells above 9 um.
TEST_F(Continuum, cases_of_a_sweep_that_are_not_solved_say_so_in_their_row) {
  const std::string large =
      "mbtfm-indent --config " + settings(kCell) + " --strain large --order 4 --towards_rim 4 --out " + file("out");
  const std::string outcome = test::output_of(large + " --sweep 'height_um=5.3,7.4,9.5 modulus_ratio=0.1'", 4);
  EXPECT_TRUE(fires("cases-not-solved", outcome)) << outcome;
  EXPECT_FALSE(fires("large-strain", "would contract", outcome)) << "they are computed: " << outcome;
  const files::CsvTable table(file("out/indent.csv"));
  ASSERT_EQ(table.n_rows(), 3);
  for (int row = 0; row < 3; ++row) {
    const bool is_solved = table.text(row, "not_solved").empty();
    EXPECT_EQ(is_solved, row < 2) << row;
    EXPECT_EQ(table.optional_number(row, "depth_0_um").has_value(), is_solved) << row;
    EXPECT_GT(table.number(row, "contact_radius_um"), 0);
  }
  EXPECT_EQ(files::CsvTable(file("out/optima.csv")).n_rows(), 0);  // 7.4 um presses deepest, but beside a hole
  for (const char* name : {"indent.json", "indent.vtu", "indent.svg"})
    EXPECT_FALSE(files::read_text(file("out/") + name).empty()) << name;
  std::filesystem::remove_all(file("out"));
  EXPECT_EQ(test::run_program(large + " --height_um 9.5 --sweep modulus_ratio=0.1").code,
            7);  // none is solved: nothing is written
  EXPECT_FALSE(std::filesystem::exists(file("out/indent.csv")));
}

TEST_F(Continuum, what_is_no_cell_or_no_gel_for_it_is_refused) {
  const auto refused = [&](const std::string& cell, const std::string& words) {
    EXPECT_TRUE(
        has_words(test::output_of("mbtfm-indent --config " + settings(cell) + " --out " + file("out"), 2), words));
    EXPECT_FALSE(std::filesystem::exists(file("out/indent.csv")));
  };
  refused("height_um = 22\n", "whole sphere");
  refused("height_um = 7.5\npoisson_ratio = 0.4999999\n", "keeps its volume");
  refused("height_um = 7.5\npoisson_ratio = 0.3\n", "at most 0.4");
  refused("volume_um3 = 5000\n", "height_um is missing");
  refused("height_um = 0.3\n", "radius_um");
}

constexpr const char* kOnOutline =
    "height_um = 7.5\nyoungs_modulus_kPa = 10\npoisson_ratio = 0.49\ncontraction_kPa = 30\n";

TEST_F(Continuum, a_contact_that_is_an_outline_is_solved_in_space) {
  Polygon square = {{10, 20}, {46, 20}, {46, 56}, {10, 56}};
  files::write_outline(file("outline.csv"), square);
  const std::string outcome = test::output_of("mbtfm-indent --config " + settings(kOnOutline) + " --outline " +
                                              file("outline.csv") + " --towards_rim 2 --out " + file("out"));
  EXPECT_TRUE(fires("large-strain", "would contract", outcome)) << outcome;
  const files::CsvTable table(file("out/indent.csv"));
  ASSERT_EQ(table.n_rows(), 1);
  EXPECT_NEAR(table.number(0, "contact_area_um2"), 36 * 36, 0.01);
  // the circle of this area presses 0.2654 um deep; a square's longer rim takes some per cent of it
  EXPECT_LT(table.number(0, "depth_5_um"), 0.2654);
  EXPECT_GT(table.number(0, "depth_5_um"), 0.9 * 0.2654);
  EXPECT_GT(table.number(0, "error_um"), 0);
  EXPECT_TRUE(has_words(files::read_text(file("out/indent.json")), "\"n_sectors\": 16"));
  EXPECT_FALSE(files::read_text(file("out/indent.vtu")).empty());
}

TEST_F(Continuum, outlines_that_are_no_contact_are_refused_with_the_file_and_the_place) {
  const auto refused = [&](const std::vector<Polygon>& rings, const std::string& flags, int code,
                           const std::string& words) {
    files::write_outline(file("outline.csv"), rings.front(), {rings.begin() + 1, rings.end()});
    const std::string outcome = test::output_of("mbtfm-indent --config " + settings(kOnOutline) + " --outline " +
                                                    file("outline.csv") + " --out " + file("out") + flags,
                                                code);
    EXPECT_TRUE(has_words(outcome, words));
    EXPECT_EQ(outcome.find("outline.csv") != std::string::npos, code == 3) << outcome;
    EXPECT_FALSE(std::filesystem::exists(file("out/indent.csv")));
  };
  const Polygon square = {{0, 0}, {36, 0}, {36, 36}, {0, 36}};
  refused({{{0, 0}, {40, 40}, {40, 0}, {0, 30}}}, "", 3, "piece 1 of ring 0 and piece 3 of ring 0 cross");
  refused({{{0, 0}, {40, 0}, {40, 40}, {36, 40}, {36, 4}, {0, 4}}}, "", 3, "from point 3 at (36, 40)");
  refused({{{0, 0}, {110, 0}, {110, 20}, {0, 20}}}, "", 3, "half the gel's radius_um");
  refused({square, {{10, 10}, {10, 20}, {20, 20}}}, "", 3, "without holes");
  refused({{{0, 0}, {36, 0}}}, "", 3, "outline");
  refused({square}, " --sweep modulus_ratio=1,2", 2, "--sweep");
  refused({square}, " --strain large", 2, "large strains");
  refused({square}, " --volume_um3 5000", 2, "volume_um3");
  refused({square}, " --depths_um 70", 2, "a depth of reading");
}

/// A cell folder: a spiked outline, turned, with beads that its tips and its edge pull.
void write_cell(const Path& folder, double angle, std::uint64_t seed, double spike_um) {
  std::filesystem::create_directories(folder);
  const auto turned = [&](double r, double t) {
    return Vec2{60 + r * std::cos(t + angle), 60 + r * std::sin(t + angle)};
  };
  const auto radius = [&](double t) { return 25 + spike_um * std::exp((std::cos(4 * t) - 1) / 0.2); };
  Polygon outline;
  for (int k = 0; k < 200; ++k) {
    const double t = 2 * std::numbers::pi * k / 200;
    outline.push_back(turned(radius(t), t));
  }
  files::write_outline(folder / "outline.csv", outline);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> across(5, 115);
  std::normal_distribution<double> noise(0, 0.01);
  DisplacementField beads;
  for (int k = 0; k < 1500; ++k) {
    const Vec2 at = {across(random), across(random)}, arm = at - Vec2{60, 60};
    const double pull = 0.4 * std::exp(-std::pow((norm(arm) - 25) / 8, 2));
    beads.push_back({.position_um = at,
                     .displacement_um = Vec2{noise(random), noise(random)} - (pull / norm(arm)) * arm,
                     .sigma_um = 0.01});
  }
  files::write_displacement(folder / "displacement.csv", beads);
}

TEST_F(Continuum, cells_of_one_shape_have_a_mean_and_others_are_refused_by_name) {
  for (int k = 0; k < 5; ++k) write_cell(folder_ / ("cells/cell_" + std::to_string(k)), 0.4 * k, k, 12);
  std::filesystem::create_symlink("round", folder_ / "cells/round");  // in a circle: no folder, no end of the others
  const std::string settings_file = settings("");
  const std::string mean =
      "mbtfm-mean " + file("cells") + " --config " + settings_file + " --symmetry C4v --spacing_um 3";
  const std::string outcome = test::output_of(mean + " --out " + file("mean"));
  test::expect_silent({"few-cells", "registration-ambiguous"}, outcome);
  const files::CsvTable registration(file("mean/registration.csv"));
  ASSERT_EQ(registration.n_rows(), 5);
  for (int row = 0; row < 5; ++row) {
    EXPECT_FALSE(registration.truth(row, "ambiguous"));
    EXPECT_LT(registration.number(row, "misfit_um"), 0.3);  // one polygon on another: a pitch of 1 um
  }
  const files::CsvTable table(file("mean/mean.csv"));
  table.require({"x_um", "y_um", "ux_um", "uy_um", "tx_kPa", "ty_kPa", "tx_sigma_kPa", "ty_sigma_kPa", "n_cells"});
  EXPECT_TRUE(has_words(files::read_text(file("mean/mean.html")), "In short", "5 cells", "<svg"));
  for (const char* name : {"mean.vtp", "mean.json", "mean.svg", "blur.csv", "reference.csv"})
    EXPECT_FALSE(files::read_text(file("mean/") + name).empty()) << name;
  // the same cells, of which two have their outline as a mask alone
  constexpr int kSide = 480;
  for (const int k : {1, 3}) {
    const Path cell = folder_ / ("cells/cell_" + std::to_string(k));
    const Polygon outline = files::read_outline(cell / "outline.csv").front();
    images::Image mask{.width = kSide, .height = kSide, .pixels = std::vector<float>(kSide * kSide, 0)};
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i)
        if (contains(outline, 0.25 * Vec2{i + 0.5, j + 0.5})) mask.at(i, j) = 255;
    images::write_tiff(cell / "outline_mask.tif", mask);
    std::filesystem::rename(cell / "outline.csv", cell / "was_outline.csv");
  }
  EXPECT_TRUE(has_words(test::output_of(mean + " --out " + file("unknown"), 2), "pixel_size_um is missing"));
  const auto by_mask = test::run_program(mean + " --pixel_size_um 0.25 --out " + file("by_mask"));
  ASSERT_EQ(by_mask.code, 0) << by_mask.output;
  const files::CsvTable of_masks(file("by_mask/registration.csv"));
  ASSERT_EQ(of_masks.n_rows(), 5);
  for (int row = 0; row < 5; ++row) EXPECT_LT(of_masks.number(row, "misfit_um"), 0.4);
  for (const int k : {1, 3}) {
    const Path cell = folder_ / ("cells/cell_" + std::to_string(k));
    std::filesystem::rename(cell / "was_outline.csv", cell / "outline.csv");
  }
  // its own mean as a model is blurred once more
  const std::string pattern = mean + " --pattern " + file("mean/reference.csv") + " --lambda_um_per_kPa 0.1";
  test::output_of(pattern + " --model " + file("mean/mean.csv") + " --out " + file("again"));

  std::filesystem::remove(folder_ / "cells/round");
  write_cell(folder_ / "cells/round", 0, 9, 0);
  EXPECT_TRUE(has_words(test::output_of(pattern + " --out " + file("no"), 3), "cell 'round'"));
  EXPECT_FALSE(std::filesystem::exists(file("no/mean.csv")));
  const auto left = test::run_program(pattern + " --others left-out --out " + file("left"));
  EXPECT_EQ(left.code, 0) << left.output;
  EXPECT_TRUE(fires("few-cells", "not in the mean", left.output)) << left.output;
}

/// A square lies on itself in four ways; nobody has said that it is one.
TEST_F(Continuum, a_mean_of_few_cells_that_lie_on_each_other_in_several_ways_says_both) {
  for (int k = 0; k < 3; ++k) write_cell(folder_ / ("cells/cell_" + std::to_string(k)), 0.4 * k, k, 12);
  const std::string outcome = test::output_of("mbtfm-mean " + file("cells") + " --config " + settings("") +
                                              " --spacing_um 6 --lambda_um_per_kPa 0.1 --out " + file("mean"));
  EXPECT_TRUE(fires("few-cells", outcome)) << outcome;
  EXPECT_TRUE(fires("registration-ambiguous", outcome)) << outcome;
}

/// Spots that turn with the cell, of 0.5 um a pixel.
void write_picture(const Path& file, double angle) {
  constexpr int kSide = 240;
  images::Image image{
      .width = kSide, .height = kSide, .pixels = std::vector<float>(kSide * kSide, 100), .pixel_size_um = 0.5};
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> along(3, 24), around(0, 2 * std::numbers::pi);
  for (int spot = 0; spot < 14; ++spot) {
    const double r = along(random), t = around(random) + angle;
    const Vec2 at{60 + r * std::cos(t), 60 + r * std::sin(t)};
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i) {
        const Vec2 d = 0.5 * Vec2{i + 0.5, j + 0.5} - at;
        image.at(i, j) += static_cast<float>(400 * std::exp(-dot(d, d) / 8));
      }
  }
  images::write_tiff(file, image);
}

TEST_F(Continuum, cells_are_laid_onto_each_other_by_images_that_their_settings_name) {
  constexpr int kCells = 4;
  for (int k = 0; k < kCells; ++k) {
    const Path cell = folder_ / ("cells/cell_" + std::to_string(k));
    write_cell(cell, 0.4 * k, k, 12);
    write_picture(cell / ("day_" + std::to_string(k) + "_C2.tif"), 0.4 * k);
    files::write_text(cell / "cell.toml", "[images]\nactin = \"day_*_C2.tif\"\noutline_mask = \"cell_shape.tif\"\n");
  }
  // the outline of one is a mask with a name of its own
  const Path last = folder_ / "cells/cell_3";
  const Polygon outline = files::read_outline(last / "outline.csv").front();
  images::Image mask{.width = 480, .height = 480, .pixels = std::vector<float>(480 * 480, 0)};
  for (int j = 0; j < 480; ++j)
    for (int i = 0; i < 480; ++i)
      if (contains(outline, 0.25 * Vec2{i + 0.5, j + 0.5})) mask.at(i, j) = 255;
  images::write_tiff(last / "cell_shape.tif", mask);
  std::filesystem::remove(last / "outline.csv");
  for (int k = 0; k + 1 < kCells; ++k)  // a name that is given must be there
    std::filesystem::copy(last / "cell_shape.tif", folder_ / ("cells/cell_" + std::to_string(k)) / "cell_shape.tif");
  test::output_of("mbtfm-mean " + file("cells") + " --config " + settings("") +
                  " --register_by images --image actin --reference cell_0 --pixel_size_um 0.25 "
                  "--spacing_um 3 --out " +
                  file("mean"));
  const files::CsvTable registration(file("mean/registration.csv"));
  ASSERT_EQ(registration.n_rows(), kCells);
  for (int row = 0; row < kCells; ++row) {
    // by its outline a cell with four spikes fits in four ways; by its spots in one
    EXPECT_FALSE(registration.truth(row, "ambiguous"));
    const double turn = std::abs(std::remainder(registration.number(row, "angle_deg"), 360));
    EXPECT_NEAR(turn, 0.4 * row * 180 / std::numbers::pi, 0.5) << row;
  }
}

}  // namespace
}  // namespace mbtfm
