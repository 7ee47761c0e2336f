/// Tractions from displacements that other programs wrote, beside what those programs made of them; and the executable.
#include <gtest/gtest.h>

#include <fstream>
#include <numbers>

#include "mbtfm/traction.h"
#include "tests/support/ellipse_scene.h"
#include "tests/support/program.h"

namespace mbtfm::inverse {
namespace {

namespace fs = std::filesystem;

const fs::path kData = fs::path(MBTFM_SOURCE_DIR) / "../shared/data";

/// Two vector fields compared: |a − b| / |b|, correlation of all components, mean magnitude of each.
struct Comparison {
  double relative_rms = 0, correlation = 0, mean_one = 0, mean_other = 0;
};

Comparison compare(const std::vector<Vec2>& one, const std::vector<Vec2>& other) {
  double dd = 0, aa = 0, bb = 0, ab = 0;
  Comparison c;
  for (std::size_t i = 0; i < one.size(); ++i) {
    dd += dot(one[i] - other[i], one[i] - other[i]);
    aa += dot(one[i], one[i]);
    bb += dot(other[i], other[i]);
    ab += dot(one[i], other[i]);
    c.mean_one += norm(one[i]) / static_cast<double>(one.size());
    c.mean_other += norm(other[i]) / static_cast<double>(one.size());
  }
  c.relative_rms = std::sqrt(dd / bb);
  c.correlation = ab / std::sqrt(aa * bb);
  return c;
}

std::vector<Vec2> tractions_of(const Reconstruction& r) {
  std::vector<Vec2> tractions;
  for (const Patch& p : r.patches) tractions.push_back(p.traction_kPa);
  return tractions;
}

std::vector<std::vector<double>> read_rows(const fs::path& file, std::size_t n_columns) {
  std::ifstream stream(file);
  std::vector<std::vector<double>> rows;
  std::vector<double> row(n_columns);
  while (true) {
    for (double& value : row) stream >> value;
    if (!stream) return rows;
    rows.push_back(row);
  }
}

TEST(OthersData, tractions_of_a_monolayer_are_those_of_the_program_that_published_them) {
  const fs::path folder = kData / "beads/mdck_pdms_bism/reference";
  if (!fs::exists(folder)) GTEST_SKIP() << "no ../shared/data here";
  for (const char* frame : {"1", "2"}) {
    TractionInputs inputs{.beads = {},
                          .gel = {.youngs_modulus_kPa = 15, .poisson_ratio = 0.499999, .thickness_um = 1e6},
                          .adhesions = {},
                          .outline_um = {}};
    for (const auto& row : read_rows(folder / ("PIV" + std::string(frame) + ".txt"), 4)) {
      inputs.beads.push_back({.position_um = {0.64 * row[0], 0.64 * row[1]},
                              .displacement_um = {0.64 * row[2], 0.64 * row[3]},
                              .sigma_um = 0,
                              .flag = {}});
    }
    std::vector<Vec2> published;
    for (const auto& row : read_rows(folder / ("Traction_PIV" + std::string(frame) + ".txt"), 5)) {
      published.push_back({row[2] / 1000, row[3] / 1000});
    }
    TractionParameters parameters;
    parameters.gel_model = "half-space";
    parameters.padding = 1;
    parameters.read_out = "points";
    parameters.lambda_um_per_kPa = 0.9;  // sqrt(8.1e-19) m/Pa
    Reconstruction r = reconstruct(inputs, parameters, 1);
    ASSERT_EQ(r.patches.size(), published.size());
    const Comparison same = compare(tractions_of(r), published);
    parameters.lambda_um_per_kPa = {};
    parameters.read_out = "cells";
    parameters.padding = 1.5;
    r = reconstruct(inputs, parameters, 1);
    const Comparison own = compare(tractions_of(r), published);
    std::printf("monolayer %s: relative rms %.4f; own lambda %.2f um/kPa: r %.3f, mean |T| %.1f of %.1f Pa\n", frame,
                same.relative_rms, *r.lambda, own.correlation, 1000 * own.mean_one, 1000 * own.mean_other);
    EXPECT_LE(same.relative_rms, 0.02);
    EXPECT_GE(own.correlation, 0.95);
    if (frame == std::string("1")) {
      EXPECT_NEAR(1000 * own.mean_one, 225.35, 0.15 * 225.35);
    }
  }
}

TEST(OthersData, discs_of_a_synthetic_cell_carry_their_tractions) {
  const fs::path folder = kData / "displacement/easytfm_synthetic";
  if (!fs::exists(folder)) GTEST_SKIP() << "no ../shared/data here";
  constexpr double kPixel_um = 0.1;
  TractionInputs inputs{.beads = {},
                        .gel = {.youngs_modulus_kPa = 10, .poisson_ratio = 0.3, .thickness_um = 1e6},
                        .adhesions = {},
                        .outline_um = {}};
  const CsvTable field(folder / "converted_frame1.csv");
  for (int row = 0; row < field.n_rows(); ++row) {
    inputs.beads.push_back({.position_um = kPixel_um * Vec2{field.number(row, "x_px"), field.number(row, "y_px")},
                            .displacement_um = kPixel_um * Vec2{field.number(row, "u_px"), field.number(row, "v_px")},
                            .sigma_um = 0,
                            .flag = {}});
  }
  const CsvTable discs(folder / "derived_discs_frame1.csv");
  for (int row = 0; row < discs.n_rows(); ++row) {
    const double radius = kPixel_um * discs.number(row, "radius_px");
    inputs.adhesions.push_back({.adhesion_id = row + 1,
                                .position_um = kPixel_um * Vec2{discs.number(row, "cx_px"), discs.number(row, "cy_px")},
                                .area_um2 = std::numbers::pi * radius * radius,
                                .major_axis_um = 2 * radius,
                                .minor_axis_um = 2 * radius,
                                .angle_rad = 0,
                                .eccentricity = 0,
                                .mean_intensity = 1});
  }
  TractionParameters parameters;
  parameters.method = "adhesion-forces";
  parameters.gel_model = "half-space";
  const Reconstruction r = reconstruct(inputs, parameters, 2);
  double furthest = 0;
  int n_inside = 0;
  for (int row = 0; row < discs.n_rows(); ++row) {
    const Patch& p = r.patches[static_cast<std::size_t>(row)];
    const Vec2 off = 1000 * p.traction_kPa - Vec2{discs.number(row, "tx_Pa"), discs.number(row, "ty_Pa")};
    furthest = std::max(furthest, norm(off));
    const double sigma_Pa = 1000 * *r.forces[static_cast<std::size_t>(row)].sigma_nN / p.area_um2;
    n_inside += std::abs(1000 * norm(p.traction_kPa) - discs.number(row, "t_Pa")) <= sigma_Pa;
    if (discs.number(row, "t_Pa") < 50) {
      std::printf("weak disc: %.1f +- %.1f Pa, listed %.1f\n", 1000 * norm(p.traction_kPa), sigma_Pa,
                  discs.number(row, "t_Pa"));
    }
  }
  const double residual_px2 = std::get<double>(r.figures.front().second) / (kPixel_um * kPixel_um);
  std::printf("synthetic discs: furthest %.2f Pa, residual variance %.5f px2, %d of %d inside one sigma\n", furthest,
              residual_px2, n_inside, discs.n_rows());
  EXPECT_LE(furthest, 10);
  EXPECT_LE(residual_px2, 0.0026);
}

TEST(TractionProgram, writes_what_it_says_for_every_method) {
  const test::TemporaryFolder folder;
  const test::EllipseScene scene = test::ellipse_scene(48, 0.03);
  write_displacement(folder / "displacement.csv", scene.field);
  write_adhesions(folder / "adhesions.csv", scene.adhesions);
  write_outline(folder / "outline.csv", {{8, 8}, {57, 8}, {57, 57}, {8, 57}});
  write_text(
      folder / "cell.toml",
      "[gel]\nyoungs_modulus_kPa = 8.4\npoisson_ratio = 0.49\nthickness_um = 1000\n[traction]\nelement_um = 6\n");
  const auto at = [&](const std::string& name) { return (folder / name).string(); };
  for (const std::string method : {"fttc", "sparse", "trpf", "bem", "adhesion-forces"}) {
    const auto run =
        test::run_program("mbtfm-traction --method " + method + " --gel " + at("cell.toml") + " --displacement " +
                          at("displacement.csv") + " --adhesions " + at("adhesions.csv") + " --outline " +
                          at("outline.csv") + " --out " + at(method + ".csv"));
    ASSERT_EQ(run.code, 0) << run.output;
    const CsvTable map(folder / (method + ".csv"));
    map.require({"x_um", "y_um", "tx_kPa", "ty_kPa"});
    EXPECT_GT(map.n_rows(), 0);
    EXPECT_EQ(read_adhesion_forces(folder / (method + "_adhesion_forces.csv")).size(), 8u);
    for (const char* ending : {".vtp", ".json"})
      EXPECT_TRUE(fs::exists(folder / (method + ending))) << method << ending;
    const bool has_scan = method != "sparse" && method != "adhesion-forces";
    for (const char* ending : {"_lambda.csv", "_lambda.svg"}) {
      EXPECT_EQ(fs::exists(folder / (method + ending)), has_scan) << method << ending;
    }
  }
}

TEST(CalibrateProgram, finds_the_lambda_at_which_both_methods_have_the_same_force) {
  const test::TemporaryFolder folder;
  for (const int strength : {1, 2, 3}) {
    test::EllipseScene scene = test::ellipse_scene(64, 0.03, static_cast<unsigned>(strength));
    for (Bead& b : scene.field) b.displacement_um = double(strength) * b.displacement_um;
    const fs::path cell = folder / ("cell_" + std::to_string(strength));
    for (const char* name : {"1_segment", "2_track", "4_fit"}) fs::create_directories(cell / name);
    write_text(cell / "cell.toml", "[gel]\nyoungs_modulus_kPa = 8.4\npoisson_ratio = 0.49\nthickness_um = 1000\n");
    write_displacement(cell / "2_track/displacement.csv", scene.field);
    write_outline(cell / "1_segment/outline.csv", {{8, 8}, {57, 8}, {57, 57}, {8, 57}});
    FitSummary fit;
    fit.total_force_nN = 89.8 * strength;
    fit.converged = true;
    write_fit_summary(cell / "4_fit/fit.json", fit);
  }
  const auto run = test::run_program("mbtfm-calibrate --cells " + folder.path().string() + " --out " +
                                     (folder / "calibration.csv").string());
  ASSERT_EQ(run.code, 0) << run.output;
  EXPECT_NE(run.output.find("FTTC gives the forces of the fit at lambda E"), std::string::npos) << run.output;
  const CsvTable table(folder / "calibration.csv");
  // forces in proportion, and the same noise: nearly one line at any lambda; the less smoothing the steeper
  for (int row = 1; row < table.n_rows(); ++row) {
    EXPECT_GT(table.number(row, "slope"), table.number(row - 1, "slope"));
    EXPECT_GT(table.number(row, "correlation"), 0.9);
  }
  EXPECT_EQ(CsvTable(folder / "calibration_cells.csv").n_rows(), 3 * table.n_rows());
  const std::string picture = read_text(folder / "calibration.svg");
  EXPECT_NE(picture.find("slope one at ℓ = "), std::string::npos);
}

}  // namespace
}  // namespace mbtfm::inverse
