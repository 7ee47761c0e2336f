/// mbtfm-sheet as a person runs it.
#include "pipeline/files/csv_files.h"
#include "pipeline/files/json_record.h"
#include "segment/images/image.h"
#include "segment/rois/roi.h"
#include "tests/support/findings.h"
#include "tests/support/program.h"
#include "tests/support/sheets.h"
#include "tests/support/tables.h"

namespace mbtfm {
namespace {

using test::row_with;

constexpr const char* kSheet =
    "[sheet]\nyoungs_modulus_kPa = 1\npoisson_ratio = 0.3\nthickness_um = 0.4\ncontraction_nN_per_um = 0.02\n";

class Sheet : public testing::Test {
 protected:
  void SetUp() override {
    files::write_outline(folder_ / "outline.csv", test::circle(25, 180));
    files::write_text(folder_ / "points.csv", "x_um,y_um\n20,0\n0,-20\n30,0\n");
  }
  Outcome run(const std::string& settings, const std::string& more = {}, const std::string& outline = "outline.csv") {
    files::write_text(folder_ / "cell.toml", settings);
    return run_in(folder_, "mbtfm-sheet --quiet --outline " + outline + " --config cell.toml --out out " + more);
  }
  static constexpr const char* kRecord = "--record record.json ";
  bool fires(const std::string& id, const std::string& words = "") const {
    return test::fires(id, words, files::read_text(folder_ / "record.json"));
  }
  double figure(const std::string& name) {
    return files::JsonRecord(folder_ / "out" / "sheet.json", "figures of a sheet").at(name).number();
  }
  /// The tractions of this file with x >= 0 alone.
  std::string right_half(const std::filesystem::path& file) const {
    const files::CsvTable whole(file);
    std::string half = "x_um,y_um,tx_kPa,ty_kPa,area_um2\n";
    for (int row = 0; row < whole.n_rows(); ++row) {
      if (whole.number(row, "x_um") < 0) continue;
      for (const char* column : {"x_um", "y_um", "tx_kPa", "ty_kPa"}) half += whole.text(row, column) + ",";
      half += whole.text(row, "area_um2") + "\n";
    }
    return half;
  }
  /// Tractions that grow outwards from the middle by so much a um.
  void write_radial_tractions(double outward_kPa_per_um) const {
    std::ofstream file(folder_ / "traction.csv");
    file << "x_um,y_um,tx_kPa,ty_kPa\n";
    for (int y = -30; y <= 30; y += 3)
      for (int x = -30; x <= 30; x += 3)
        file << x << ',' << y << ',' << outward_kPa_per_um * x << ',' << outward_kPa_per_um * y << '\n';
  }
  test::TemporaryFolder folder_;
};

TEST_F(Sheet, springs_alone_need_no_gel_and_carry_the_tension_that_balance_asks_for) {
  output_of(run(std::string(kSheet) + "adhesion_stiffness_nN_per_um3 = 0.03\n", "--points points.csv"));
  // each patch's force acts at its centre, where a traction that grows across the patch has it a little further out
  EXPECT_NEAR(figure("mean_tension_nN_per_um"), figure("virial_tension_nN_per_um"), 1e-3 * 0.02);
  EXPECT_LE(figure("net_force_nN"), 1e-9 * figure("total_force_nN"));
  const files::CsvTable sheet(folder_ / "out" / "sheet.csv");
  ASSERT_EQ(sheet.n_rows(), 3);
  EXPECT_LT(sheet.number(0, "ux_um"), 0);
  EXPECT_NEAR(sheet.number(1, "uy_um"), -sheet.number(0, "ux_um"), 1e-4 * std::abs(sheet.number(0, "ux_um")));
  EXPECT_TRUE(sheet.text(2, "ux_um").empty()) << "outside of the sheet";
}

TEST_F(Sheet, its_tractions_give_its_tensions_back) {
  ASSERT_EQ(run(std::string(kSheet) + "adhesion_stiffness_nN_per_um3 = 0.003\n").code, 0);
  const double mean = figure("mean_tension_nN_per_um");
  std::filesystem::rename(folder_ / "out" / "traction.csv", folder_ / "traction.csv");
  const std::string traction = "--record record.json --traction traction.csv";
  output_of(run("[sheet]\npoisson_ratio = 0.3\n", traction));
  test::expect_silent({"cell-cut", "mesh-error", "tractions-out-of-balance"},
                      files::read_text(folder_ / "record.json"));
  EXPECT_NEAR(figure("inside_mean_tension_nN_per_um"), mean, 0.01 * 0.02);
  EXPECT_NEAR(figure("mean_tension_nN_per_um"), figure("exact_virial_tension_nN_per_um"), 1e-9 * mean);
  files::write_outline(folder_ / "area.csv", test::circle(22, 180));
  ASSERT_EQ(run("[sheet]\npoisson_ratio = 0.3\n", traction + " --area area.csv").code, 0);
  EXPECT_TRUE(fires("tractions-out-of-balance", "outside of the area"));
}

/// On stiff springs the tension rises within a few micrometres of the edge.
TEST_F(Sheet, one_of_triangles_too_large_for_its_tensions_is_doubted) {
  for (const double mesh_um : {1.5, 12.0}) {
    output_of(
        run(std::string(kSheet) + "adhesion_stiffness_nN_per_um3 = 0.03\nmesh_um = " + std::to_string(mesh_um) + "\n",
            kRecord));
    EXPECT_EQ(fires("mesh-error", "between the mesh"), mesh_um > 10) << figure("mesh_relative_error");
  }
}

/// The half of a disc that the image shows: what lies beyond pulls on it, and it has the tension of the whole.
TEST_F(Sheet, one_that_the_image_cuts_is_held_at_the_cut_and_said_to_be) {
  ASSERT_EQ(run(std::string(kSheet) + "adhesion_stiffness_nN_per_um3 = 0.003\n").code, 0);
  const double mean = figure("mean_tension_nN_per_um");
  files::write_text(folder_ / "traction.csv", right_half(folder_ / "out/traction.csv"));
  Polygon half;
  for (int i = -60; i <= 60; ++i) {
    const double t = std::numbers::pi * i / 120;
    half.push_back({std::abs(i) == 60 ? 0 : 25 * std::cos(t), 25 * std::sin(t)});
  }
  std::vector<bool> is_cut(half.size());
  is_cut.back() = true;
  files::write_outline(folder_ / "half.csv", half, {}, is_cut);
  output_of(run("[sheet]\npoisson_ratio = 0.3\n", "--record record.json --traction traction.csv", "half.csv"));
  EXPECT_TRUE(fires("cell-cut", "cuts the sheet"));
  EXPECT_TRUE(has_words(files::read_text(folder_ / "out" / "sheet.html"), "The image cuts the sheet"));
  // triangles of the whole lie across the cut: some of the forces are on the other side of it
  EXPECT_NEAR(figure("inside_mean_tension_nN_per_um"), mean, 0.05 * mean);
  EXPECT_LT(figure("inside_mean_tension_cut_free_nN_per_um"), 0.8 * mean);
  EXPECT_NEAR(figure("cut_length_um"), 50, 1e-6);
  EXPECT_NEAR(figure("virial_tension_nN_per_um"), figure("mean_tension_nN_per_um"), 1e-9 * mean);
  EXPECT_NEAR(figure("net_force_nN"), figure("cut_pull_nN"), 1e-9 * figure("total_force_nN"));
}

/// The limit is 0.02 of the half width, here 25 um: 0.5 um.
TEST_F(Sheet, one_that_is_too_thick_for_a_sheet_is_doubted_and_a_thin_one_is_not) {
  for (const double thickness_um : {0.45, 0.55}) {
    output_of(run("[sheet]\nyoungs_modulus_kPa = 1\nthickness_um = " + std::to_string(thickness_um) +
                      "\ncontraction_nN_per_um = 0.02\nadhesion_stiffness_nN_per_um3 = 0.003\n",
                  kRecord));
    EXPECT_EQ(fires("sheet-thick"), thickness_um > 0.5);
  }
}

TEST_F(Sheet, a_mask_is_an_outline_and_a_band_contracts_alone) {
  const std::string springs = std::string(kSheet) + "adhesion_stiffness_nN_per_um3 = 0.003\n";
  ASSERT_EQ(run(springs).code, 0);
  const double mean = figure("mean_tension_nN_per_um"), whole_nN = figure("total_force_nN");
  constexpr double kPixel_um = 0.25;
  images::Image mask{.width = 240, .height = 240, .pixels = std::vector<float>(240 * 240)};
  for (int j = 0; j < mask.height; ++j)
    for (int i = 0; i < mask.width; ++i)
      mask.at(i, j) = std::hypot(i + 0.5 - 120, j + 0.5 - 120) * kPixel_um < 25 ? 1.0F : 0.0F;
  images::write_tiff(folder_ / "mask.tif", mask);
  output_of(run("pixel_size_um = 0.25\n" + springs, {}, "mask.tif"));
  EXPECT_NEAR(figure("mean_tension_nN_per_um"), mean, 0.02 * mean);  // steps of a pixel in 100 of the radius
  // a band of the whole width is the even sheet; of a fifth of it, what is inside is drawn outwards and pulls less
  ASSERT_EQ(run(springs + "edge_band_um = 25.1\n").code, 0);
  EXPECT_NEAR(figure("mean_tension_nN_per_um"), mean, 1e-9 * mean);
  ASSERT_EQ(run(springs + "edge_band_um = 5\n").code, 0);
  EXPECT_LT(figure("mean_tension_nN_per_um"), 0.8 * mean);
  EXPECT_LT(figure("total_force_nN"), 0.5 * whole_nN);
  EXPECT_GT(figure("total_force_nN"), 0);
  EXPECT_LE(figure("net_force_nN"), 1e-9 * figure("total_force_nN"));
}

TEST_F(Sheet, tractions_in_pascals_are_refused) {
  write_radial_tractions(-10);
  const std::string outcome = output_of(run("[sheet]\npoisson_ratio = 0.3\n", "--traction traction.csv"), 3);
  EXPECT_TRUE(has_words(outcome, "200 Pa are 0.2 kPa"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

TEST_F(Sheet, tractions_that_push_outward_are_asked_about) {
  for (const double outward : {0.01, -0.01}) {
    write_radial_tractions(outward);
    output_of(run("[sheet]\npoisson_ratio = 0.3\n", "--record record.json --traction traction.csv"));
    EXPECT_EQ(fires("pushes-outward", "sheet pushes outward"), outward > 0);
    EXPECT_EQ(figure("mean_tension_nN_per_um") < 0, outward > 0);
  }
}

/// Beads on a lattice about a sheet that pulls on its gel, with noise of 10 nm.
class FittedSheet : public Sheet {
 protected:
  /// @param more  of [sheet]
  void move_beads(const std::string& more, const std::string& arguments = {}) {
    std::string points = "x_um,y_um\n";
    for (int i = -20; i <= 20; ++i)
      for (int j = -20; j <= 20; ++j) points += std::to_string(2 * i) + "," + std::to_string(2 * j) + "\n";
    files::write_text(folder_ / "beads.csv", points);
    output_of(run(gel_ + sheet_ + "mesh_um = 0.8\nyoungs_modulus_kPa = " + std::to_string(modulus_kPa_) + "\n" + more,
                  "--beads beads.csv " + arguments, outline_));
    DisplacementField beads = files::read_displacement(folder_ / "out" / "displacement.csv");
    test::Normal noise(3, 0.01);
    for (Bead& bead : beads) {
      bead.displacement_um += Vec2{noise(), noise()};
      bead.sigma_um = 0.01;
    }
    files::write_displacement(folder_ / "displacement.csv", beads);
  }
  Outcome fit(const std::string& more, const std::string& arguments = {}) {
    const auto outcome = run(gel_ + sheet_ + mesh_ + more, "--displacement displacement.csv " + arguments, outline_);
    EXPECT_EQ(outcome.code, 0) << outcome.output;
    return outcome;
  }
  /// A row of sheet_fit.csv lies within four of its errors of the truth, or has a limit on the right side of it.
  void expect(const std::string& quantity, const std::string& part, double truth) {
    const files::CsvTable table(folder_ / "out" / "sheet_fit.csv");
    const int row = row_with(table, {{"quantity", quantity}, {"part", part}});
    if (const auto sigma = table.optional_number(row, "sigma"))
      EXPECT_NEAR(table.number(row, "value"), truth, 4 * *sigma) << quantity << part;
    else
      EXPECT_TRUE(table.optional_number(row, "low").value_or(0) <= truth &&
                  truth <= table.optional_number(row, "high").value_or(1e300))
          << quantity << part;
  }
  double modulus_kPa_ = 30;
  std::string gel_ = "[gel]\nyoungs_modulus_kPa = 1\npoisson_ratio = 0.49\nthickness_um = 60\n";
  std::string sheet_ = "[sheet]\npoisson_ratio = 0.3\nthickness_um = 0.4\n", mesh_ = "mesh_um = 2\n",
              outline_ = "outline.csv";
};

/// Beads of a computed gel, with noise, are fitted: the sheet that moved them comes back within its errors.
TEST_F(FittedSheet, contraction_and_stiffness_come_back_from_beads) {
  move_beads("contraction_nN_per_um = 0.5\n");
  const Outcome outcome = fit("", kRecord);
  test::expect_silent({"misfit", "pushes-outward", "sheet-thick", "mesh-error"},
                      files::read_text(folder_ / "record.json"));
  const files::CsvTable found(folder_ / "out" / "sheet_fit.csv");
  for (int row = 0; row < found.n_rows(); ++row) {
    // a contraction that varies by 20 % moves the stiffness of so stiff a sheet by a factor of e
    EXPECT_EQ(!found.optional_number(row, "sigma"), found.text(row, "quantity") == "stiffness_nN_per_um");
    if (!found.optional_number(row, "sigma")) continue;
    double squares = 0;
    for (const char* part :
         {"by_beads", "by_motion", "by_model", "by_variation", "by_mesh", "by_outline", "by_substrate"})
      squares += std::pow(found.number(row, part), 2);
    EXPECT_NEAR(std::sqrt(squares) / found.number(row, "sigma"), 1, 1e-4) << "six digits each";
    EXPECT_FALSE(found.optional_number(row, "by_gel")) << "nothing is said of its errors";
  }
  EXPECT_TRUE(has_words(files::read_text(folder_ / "out" / "sheet.html"), "Where the errors come from"));
  EXPECT_EQ(found.text(0, "quantity"), "contraction_nN_per_um");
  EXPECT_NEAR(found.number(0, "value"), 0.5, 4 * found.number(0, "sigma"));
  EXPECT_EQ(found.text(1, "quantity"), "stiffness_nN_per_um");
  EXPECT_TRUE(fires("not-identifiable", "sheet's stiffness"));
  EXPECT_FALSE(fires("not-identifiable", "end of the range"));
  EXPECT_NEAR(found.number(1, "value") / (30 * 0.4 / (1 - 0.09)), 1, 0.5) << "the contraction is even, here";
  EXPECT_LT(figure("aic"), figure("aic_of_nothing") - 1000);
  EXPECT_FALSE(has_words(outcome.output, "explains")) << "the sheet explains the beads";
  // a gel whose modulus is known to 10 %, and whose thickness to a third
  const double sigma = found.number(0, "sigma");
  output_of(run(gel_ + "youngs_modulus_sigma_kPa = 0.1\nthickness_sigma_um = 20\n" + sheet_ + mesh_,
                "--displacement displacement.csv"));
  const files::CsvTable doubtful(folder_ / "out" / "sheet_fit.csv");
  EXPECT_GT(doubtful.number(0, "sigma"), std::hypot(sigma, 0.1 * 0.99 * found.number(0, "value")));
  EXPECT_LT(doubtful.number(0, "sigma"), std::hypot(sigma, 0.2 * found.number(0, "value")));
  EXPECT_GT(doubtful.number(0, "by_gel"), 0.1 * 0.99 * found.number(0, "value"));
  EXPECT_EQ(run(gel_ + sheet_ + "strain = \"large\"\n", "--displacement displacement.csv").code, 2);
  // a contraction that may vary, and does not
  output_of(run(gel_ + sheet_ + mesh_ + "fit_parts = \"field\"\nfield_points = 6\n",
                "--record record.json --displacement displacement.csv"));
  test::expect_silent({"not-identifiable", "misfit"}, files::read_text(folder_ / "record.json"));
  const files::CsvTable places(folder_ / "out" / "contraction.csv");
  for (int row = 0; row < places.n_rows(); ++row)
    EXPECT_NEAR(places.number(row, "contraction_nN_per_um"), 0.5, 4 * places.number(row, "sigma_nN_per_um"));
  EXPECT_EQ(files::CsvTable(folder_ / "out" / "sheet_fit.csv").text(0, "part"), "mean");
  EXPECT_TRUE(has_words(files::read_text(folder_ / "out" / "sheet.svg"), ">Contraction<"));
  output_of(run(gel_ + sheet_ + mesh_ + "fit_parts = \"field\"\nfit_adhesion_stiffness = true\n",
                "--displacement displacement.csv"),
            2);
}

/// Of a sheet a hundred times stiffer than its gel the beads tell by how much it shrinks, and no more.
TEST_F(FittedSheet, the_stiffness_of_one_far_stiffer_than_its_gel_is_called_unknown) {
  modulus_kPa_ = 6000;
  move_beads("contraction_nN_per_um = 70\n");
  fit("", kRecord);
  EXPECT_TRUE(fires("not-identifiable", "sheet's stiffness"));
}

/// Beads that move outward, as if the two images were exchanged, and beads that a rigid sheet moves.
TEST_F(Sheet, one_that_expands_or_has_the_stiffness_of_a_bound_is_doubted) {
  test::Normal noise(3, 0.01);
  const auto fitted = [&](const std::function<double(double)>& outward_um) {
    DisplacementField beads;
    for (int i = -20; i <= 20; ++i)
      for (int j = -20; j <= 20; ++j) {
        const Vec2 at{2.0 * i, 2.0 * j};
        const double r = norm(at), x = noise(), y = noise();
        beads.push_back({.position_um = at,
                         .displacement_um = (r > 0 ? outward_um(r) / r : 0) * at + Vec2{x, y},
                         .sigma_um = 0.01});
      }
    files::write_displacement(folder_ / "displacement.csv", beads);
    output_of(
        run("[gel]\nyoungs_modulus_kPa = 1\npoisson_ratio = 0.49\nthickness_um = 60\n[sheet]\npoisson_ratio = 0.3\n"
            "thickness_um = 0.4\nmesh_um = 2\n",
            "--record record.json --displacement displacement.csv"));
    return files::read_text(folder_ / "record.json");
  };
  const auto radial = [](double r) { return 0.8 * r / 25 * std::exp(-std::pow(r / 25, 4)); };
  const std::string outward = fitted(radial);
  EXPECT_TRUE(test::fires("pushes-outward", "sheet pushes outward", outward)) << outward;
  EXPECT_TRUE(has_words(outward, "\"bad\"")) << "ten and more standard errors";
  const std::string inward = fitted([&](double r) { return -radial(r); });
  EXPECT_FALSE(test::fires("pushes-outward", "sheet pushes outward", inward)) << inward;
  EXPECT_TRUE(test::fires("misfit", "exceed noise", inward)) << "an even contraction has not this profile";
  // a narrow ring: no sheet, however soft, pulls so near to its edge
  const std::string at_rim = fitted([](double r) { return -0.8 * std::exp(-std::pow((r - 25) / 1.5, 2)); });
  EXPECT_TRUE(test::fires("not-identifiable", "end of the range", at_rim)) << at_rim;
}

TEST_F(FittedSheet, a_line_tension_comes_back_beside_the_contraction) {
  // around a disc a line pulls as its contraction does: an ellipse tells the two apart
  files::write_outline(folder_ / "ellipse.csv",
                       test::ring([](double t) { return 12 / std::hypot(0.5 * std::cos(t), std::sin(t)); }, 180));
  outline_ = "ellipse.csv";
  move_beads("contraction_nN_per_um = 0.5\nline_tension_nN = 4\n");
  fit("fit_line_tension = true\n");
  expect("contraction_nN_per_um", "", 0.5);
  expect("line_tension_nN", "", 4);
}

TEST_F(FittedSheet, the_stiffness_of_the_adhesions_comes_back_and_is_called_for) {
  move_beads("contraction_nN_per_um = 0.5\nadhesion_stiffness_nN_per_um3 = 0.05\n");
  fit("fit_adhesion_stiffness = true\n");
  expect("contraction_nN_per_um", "", 0.5);
  expect("adhesion_stiffness_nN_per_um3", "", 0.05);
  const files::CsvTable models(folder_ / "out" / "sheet_models.csv");
  ASSERT_EQ(models.text(models.n_rows() - 1, "model"), "sheet-on-springs");
  EXPECT_LT(models.number(models.n_rows() - 1, "bic"), models.number(models.n_rows() - 2, "bic"));
}

/// The beads of the computed gel lie where they are seen while the sheet pulls, as its outline does. A tracker gives
/// their places at rest: taken for places under load, they blur the pull at the edge.
TEST_F(FittedSheet, beads_that_were_seen_under_load_show_the_contraction_if_they_are_taken_there) {
  move_beads("contraction_nN_per_um = 3\n");
  DisplacementField beads = files::read_displacement(folder_ / "displacement.csv");
  for (Bead& bead : beads) bead.position_um = bead.position_um - bead.displacement_um;
  files::write_displacement(folder_ / "displacement.csv", beads);
  const auto contraction = [&](const std::string& switched) {
    fit("[effects]\nbeads_under_load = \"" + switched + "\"\n");
    const files::CsvTable found(folder_ / "out" / "sheet_fit.csv");
    EXPECT_EQ(found.text(0, "quantity"), "contraction_nN_per_um");
    return std::pair(found.number(0, "value"), figure("relative_l2"));
  };
  const auto [there, left_there] = contraction("on");
  expect("contraction_nN_per_um", "", 3);
  const auto [at_rest, left_at_rest] = contraction("off");
  EXPECT_LT(std::abs(there - 3), 0.5 * std::abs(at_rest - 3));
  EXPECT_LT(left_there, left_at_rest);
}

TEST_F(FittedSheet, cells_contract_each_by_their_own) {
  // a cell in one quarter; the rest is no cell
  images::Image label{.width = 30, .height = 30, .pixels = std::vector<float>(30 * 30, 1), .pixel_size_um = 1};
  images::write_tiff(folder_ / "cells.tif", label);
  files::write_text(folder_ / "contractions.csv", "cell,contraction_nN_per_um\n1,0.8\n");
  const std::string cells = "--pixel_size_um 1 --cells cells.tif";
  move_beads("contraction_nN_per_um = 0.3\n", cells + " --contractions contractions.csv");
  fit("fit_parts = \"cells\"\n", cells);
  expect("contraction_nN_per_um", "cell 1", 0.8);
  expect("contraction_nN_per_um", "no cell", 0.3);
  const files::CsvTable models(folder_ / "out" / "sheet_models.csv");
  ASSERT_EQ(models.text(models.n_rows() - 1, "model"), "sheet-in-parts");
  EXPECT_LT(models.number(models.n_rows() - 1, "bic"), models.number(models.n_rows() - 2, "bic") - 10);
}

TEST_F(FittedSheet, a_band_contracts_by_its_own) {
  move_beads("contraction_nN_per_um = 0.5\nedge_band_um = 6\n");
  fit("fit_parts = \"edge\"\nedge_band_um = 6\n");
  expect("contraction_nN_per_um", "edge", 0.5);
  expect("contraction_nN_per_um", "inside", 0);
  const files::CsvTable models(folder_ / "out" / "sheet_models.csv");
  EXPECT_EQ(models.text(models.n_rows() - 1, "model"), "sheet-in-parts");
}

TEST_F(FittedSheet, bundles_in_it_have_their_tensions) {
  // none pulls: each is bounded at zero, and the sheet is as without them
  files::write_text(folder_ / "fibre_points.csv",
                    "fibre_id,point,x_um,y_um\n7,0,-15,5\n7,1,15,5\n9,0,-10,-8\n9,1,12,-8\n");
  move_beads("contraction_nN_per_um = 0.5\n");
  fit("", "--bundles fibre_points.csv");
  expect("contraction_nN_per_um", "", 0.5);
  const files::CsvTable table(folder_ / "out" / "sheet_fit.csv");
  int n_bundles = 0;
  for (int row = 0; row < table.n_rows(); ++row) {
    if (table.text(row, "quantity") != "bundle_tension_nN") continue;
    ++n_bundles;
    EXPECT_GE(table.number(row, "value"), 0);
    EXPECT_EQ(table.number(row, "low"), 0);
  }
  EXPECT_EQ(n_bundles, 2);
}

TEST_F(Sheet, an_imagej_selection_is_an_outline_and_a_stress_times_thickness_a_contraction) {
  const std::string springs = "adhesion_stiffness_nN_per_um3 = 0.003\n";
  ASSERT_EQ(run(std::string(kSheet) + springs).code, 0);
  const double mean = figure("mean_tension_nN_per_um");
  rois::Roi roi;
  roi.name = "sheet";
  for (const Vec2 p : test::circle(25, 180)) roi.points_px.push_back(4 * (p + Vec2{30, 30}));
  files::write_text(folder_ / "outline.roi", rois::encode_roi(roi));
  // 0.05 kPa x 0.4 um
  ASSERT_EQ(run("pixel_size_um = 0.25\n[sheet]\nyoungs_modulus_kPa = 1\npoisson_ratio = 0.3\nthickness_um = 0.4\n"
                "contraction_kPa = 0.05\n" +
                    springs,
                {}, "outline.roi")
                .code,
            0);
  EXPECT_NEAR(figure("contraction_nN_per_um"), 0.02, 1e-12);
  EXPECT_NEAR(figure("mean_tension_nN_per_um"), mean, 2e-3 * mean);
}

TEST_F(Sheet, tractions_of_a_larger_area_show_both_means_their_errors_and_what_is_out_of_balance) {
  ASSERT_EQ(run(std::string(kSheet) + "adhesion_stiffness_nN_per_um3 = 0.003\n").code, 0);
  const double mean = figure("mean_tension_nN_per_um");
  std::filesystem::rename(folder_ / "out" / "traction.csv", folder_ / "traction.csv");
  files::write_outline(folder_ / "area.csv", test::circle(32, 180));
  const std::string traction = "--traction traction.csv";
  output_of(run("[sheet]\npoisson_ratio = 0.3\ntraction_sigma_kPa = 0.0005\n", traction + " --area area.csv"));
  // beyond what pulls a sheet of no traction bears what its inner edge has: the mean inside is higher
  EXPECT_GT(figure("inside_mean_tension_nN_per_um"), figure("mean_tension_nN_per_um"));
  EXPECT_NEAR(figure("virial_tension_nN_per_um"), figure("mean_tension_nN_per_um"), 1e-9 * mean);
  EXPECT_GT(figure("mean_tension_sigma_nN_per_um"), 0);
  EXPECT_LT(figure("mean_tension_sigma_nN_per_um"), 0.2 * mean);
  EXPECT_NE(figure("inside_mean_tension_nu_0_nN_per_um"), figure("inside_mean_tension_nu_05_nN_per_um"));
  // half of the forces: those of one side
  files::write_text(folder_ / "traction.csv", right_half(folder_ / "traction.csv"));
  std::filesystem::remove_all(folder_ / "out");
  EXPECT_TRUE(has_words(output_of(run("[sheet]\npoisson_ratio = 0.3\n", traction), 3), "most_unbalanced"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  output_of(run("[sheet]\npoisson_ratio = 0.3\nmost_unbalanced = 1\n", "--record record.json " + traction));
  EXPECT_TRUE(fires("tractions-out-of-balance", "Net force"));
}

TEST_F(Sheet, large_strains_are_computed_on_a_gel_if_they_are_asked_for) {
  const std::string gel = "[gel]\nyoungs_modulus_kPa = 1\npoisson_ratio = 0.45\nthickness_um = 60\n",
                    soft =
                        "[sheet]\nyoungs_modulus_kPa = 20\npoisson_ratio = 0.3\nthickness_um = 0.4\nmesh_um = 2\n"
                        "contraction_nN_per_um = 2\n";  // a free sheet would contract by 0.17
  std::map<std::string, double> largest_um;
  for (const std::string strain : {"auto", "small", "large"}) {
    output_of(run(gel + soft + "strain = \"" + strain + "\"\n"));
    largest_um[strain] = figure("largest_displacement_um");
    EXPECT_GT(figure("total_force_nN"), 0);
    EXPECT_LE(figure("net_force_nN"), 1e-7 * figure("total_force_nN"));
  }
  EXPECT_EQ(largest_um["auto"], largest_um["small"]);
  EXPECT_GT(std::abs(largest_um["large"] / largest_um["small"] - 1), 5e-3);
}

TEST_F(Sheet, a_line_tension_keeps_strains_small_and_the_finding_says_what_that_costs) {
  // a free sheet would contract by 0.07: above the limit of 0.05
  const std::string strong =
      "[sheet]\nyoungs_modulus_kPa = 1\npoisson_ratio = 0.3\nthickness_um = 0.4\ncontraction_nN_per_um = 0.04\n"
      "adhesion_stiffness_nN_per_um3 = 0.003\n";
  for (const bool has_line : {false, true}) {
    output_of(run(strong + (has_line ? "line_tension_nN = 0.1\n" : ""), kRecord));
    EXPECT_EQ(fires("large-strain", "would contract"), has_line);
  }
}

struct Refused {
  const char* name;
  std::string settings, says;
  int code;
};

TEST_F(Sheet, what_cannot_be_is_refused_by_name) {
  const std::string springs = "adhesion_stiffness_nN_per_um3 = 0.03\n";
  const std::vector<Refused> cases = {
      {"no ground", kSheet, "no ground", 2},
      {"no modulus", "[sheet]\nthickness_um = 1\ncontraction_nN_per_um = 1\n" + springs, "youngs_modulus_kPa", 2},
      {"two contractions", std::string(kSheet) + "contraction_kPa = 1\n" + springs, "both given", 2},
      {"negative stiffness", std::string(kSheet) + "adhesion_stiffness_nN_per_um3 = -1\n",
       "adhesion_stiffness_nN_per_um3", 3},
      {"collapse",
       "[sheet]\nyoungs_modulus_kPa = 1\npoisson_ratio = 0.3\nthickness_um = 0.4\ncontraction_nN_per_um = 0.4\n" +
           springs,
       "contract by 0.7", 2},
      {"no tractions", std::string(kSheet) + "ground = \"none\"\n", "--traction", 2}};
  for (const Refused& refused : cases) {
    const auto outcome = run(refused.settings);
    EXPECT_EQ(outcome.code, refused.code) << refused.name << ": " << outcome.output;
    EXPECT_TRUE(has_words(outcome.output, refused.says)) << refused.name;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out")) << refused.name << ": something was written";
  }
  files::write_outline(folder_ / "beside.csv", {{40, 0}, {60, 0}, {60, 20}, {40, 20}});
  const auto beside = run(std::string(kSheet) + springs, "--adhesive beside.csv");
  EXPECT_EQ(beside.code, 3) << beside.output;
  EXPECT_TRUE(has_words(beside.output, "beside.csv: expected an area beneath the sheet"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  files::write_outline(folder_ / "eight.csv", {{0, 0}, {40, 40}, {40, 0}, {0, 40}});
  files::write_text(folder_ / "line.csv", "x_um,y_um\n0,1e-300\n20,2e-300\n40,1e-300\n20,0\n");
  const auto line = run(std::string(kSheet) + springs, "", "line.csv");
  EXPECT_EQ(line.code, 3) << line.output;
  EXPECT_TRUE(has_words(line.output, "line.csv: expected an outline"));
  EXPECT_TRUE(has_words(output_of(run(std::string(kSheet) + springs, "", "eight.csv"), 3),
                        "piece 1 of ring 0 and piece 3 of ring 0 cross"));
}

/// The folder of a cell whose images were simulated, to be run as a sheet.
class SheetsOfImages : public Sheet {
 protected:
  void SetUp() override {
    output_of(
        "mbtfm-simulate --quiet --scenario contracting-disc --images --radius_um 14 --image_size_px 480 --beads 2500 "
        "--mesh_um 0.7 --out " +
        cell_.string());
    std::string toml = files::read_text(cell_ / "cell.toml");
    toml.insert(toml.find("[sheet]\n") + 8, "mesh_um = 0.6\n");
    files::write_text(cell_ / "cell.toml", toml);
  }
  void add(const std::string& text) {
    files::write_text(cell_ / "cell.toml", files::read_text(cell_ / "cell.toml") + "\n" + text);
  }
  const std::filesystem::path study_ = folder_ / "study", cell_ = study_ / "cell";
};

TEST_F(SheetsOfImages, give_contraction_and_stiffness_back_in_one_command_and_in_a_batch) {
  EXPECT_TRUE(has_words(output_of("mbtfm run " + cell_.string()), "a contracting sheet, as run.model is sheet",
                        "mbtfm: contraction 2"));
  const std::string compared = output_of("mbtfm compare " + cell_.string());
  EXPECT_TRUE(has_words(compared, "contraction_nN_per_um"));
  EXPECT_TRUE(has_words(compared, " 2\n")) << "the truth";
  EXPECT_TRUE(has_words(files::read_text(cell_ / "report.html"), "Beside the truth"));
  const files::CsvTable truth(cell_ / "truth/sheet.csv"), fitted(cell_ / "3_sheet/sheet_fit.csv");
  for (int row = 0; row < 2; ++row) {
    ASSERT_EQ(truth.text(row, "quantity"), fitted.text(row, "quantity"));
    // three standard errors, and what these triangles leave of the sheet: 2 %
    const double value = truth.number(row, "value");
    if (!fitted.optional_number(row, "sigma")) {  // a contraction that varies would move it by a factor of e
      EXPECT_EQ(fitted.text(row, "quantity"), "stiffness_nN_per_um");
      continue;
    }
    EXPECT_NEAR(fitted.number(row, "value"), value, 3 * fitted.number(row, "sigma") + 0.02 * value)
        << truth.text(row, "quantity");
    // the beads' noise gives a tenth; outline, triangles and the gel come on top, and then a contraction that varies
    EXPECT_LT(std::sqrt(std::pow(fitted.number(row, "sigma"), 2) - std::pow(fitted.number(row, "by_variation"), 2)),
              0.2 * value);
    EXPECT_NEAR(files::JsonRecord(cell_ / "3_sheet/sheet.json", "figures").at("outline_error_um").number(), 0.05, 1e-9);
    EXPECT_LT(fitted.number(row, "by_beads"), 0.15 * value);
  }
  for (const char* page : {"report.html", "3_sheet/sheet.html"})
    for (const char* words : {"In short", "Caution:", "What the beads show", "stiffness (nN/µm)", "<svg"})
      EXPECT_TRUE(has_words(files::read_text(cell_ / page), words)) << page << ": " << words;

  const std::string study = study_.string();
  EXPECT_TRUE(has_words(output_of("mbtfm batch " + study + " --list"), "sheet,up to date"));
  output_of("mbtfm batch " + study + " --quiet");
  const files::CsvTable batch(study_ / "batch_all.csv");
  ASSERT_EQ(batch.n_rows(), 1);
  EXPECT_NEAR(batch.number(0, "sheet.contraction_nN_per_um"), fitted.number(0, "value"), 1e-4);
  output_of("mbtfm verify " + cell_.string());
  output_of(run_in(folder_, "mbtfm repeat " + cell_.string() + " --quiet --out again"));
  EXPECT_TRUE(has_words(output_of("mbtfm stats " + study), "1 sheet; 0 cells left out"));
  add("[effects]\ncommon_motion = \"off\"\n");
  EXPECT_TRUE(has_words(output_of("mbtfm batch " + study + " --list"), "track,up to date", "sheet,run"));
}

TEST_F(SheetsOfImages, take_a_mask_for_the_outline_and_say_what_lacks) {
  std::filesystem::remove(cell_ / "1_segment/outline.csv");
  std::filesystem::remove(cell_ / "1_segment");
  EXPECT_TRUE(has_words(output_of("mbtfm run " + cell_.string(), 3), "actin.tif"));
  images::Image mask{.width = 480, .height = 480, .pixels = std::vector<float>(480 * 480, 0)};
  for (int j = 0; j < 480; ++j)
    for (int i = 0; i < 480; ++i)
      if (std::hypot(i + 0.5 - 240, j + 0.5 - 240) < 140) mask.at(i, j) = 255;
  images::write_tiff(cell_ / "outline_mask.tif", mask);
  EXPECT_TRUE(has_words(output_of("mbtfm run " + cell_.string()), "its outline is outline_mask"));
  const files::CsvTable truth(cell_ / "truth/sheet.csv"), fitted(cell_ / "3_sheet/sheet_fit.csv");
  EXPECT_NEAR(fitted.number(0, "value"), truth.number(0, "value"), 0.1 * truth.number(0, "value"));
  const files::JsonRecord figures(cell_ / "3_sheet/sheet.json", "figures of a sheet");
  EXPECT_NEAR(figures.at("outline_error_um").number(), 0.1, 1e-9) << "a pixel";
}

/// Sheets of known contractions under two conditions, from simulated beads to the study's tables.
TEST(SheetStudies, a_known_difference_of_contraction_is_found_and_the_tables_agree_with_the_batch) {
  const test::TemporaryFolder folder;
  const std::map<std::string, std::vector<double>> contractions = {{"control", {1.8, 2.0, 2.1, 2.3}},
                                                                   {"drug", {0.9, 1.1, 1.2, 1.4}}};
  std::map<std::string, double> truth_of, mean_of;
  int seed = 0;
  for (const auto& [condition, list] : contractions)
    for (const double contraction : list) {
      const std::string name = condition + "/" + std::to_string(++seed);
      const auto cell = folder / name;
      output_of("mbtfm-simulate --quiet --scenario contracting-disc --radius_um 14 --beads 1500 --mesh_um 0.7 --seed " +
                std::to_string(seed) + " --contraction_nN_per_um " + std::to_string(contraction) + " --out " +
                cell.string());
      std::string toml = files::read_text(cell / "cell.toml");
      toml.insert(toml.find("[sheet]\n") + 8, "mesh_um = 2\n");
      files::write_text(cell / "cell.toml", toml);
      truth_of[name] = files::CsvTable(cell / "truth/sheet.csv").number(0, "value");
      mean_of[condition] += truth_of[name] / static_cast<double>(list.size());
    }
  const std::string study = folder.path().string();
  output_of("mbtfm batch " + study + " --quiet --jobs 2 --threads 2");
  EXPECT_TRUE(has_words(output_of("mbtfm stats " + study + " --condition-from folder"), "8 sheets; 0 cells left out"));

  const files::CsvTable batch(folder / "batch_all.csv"), cells(folder / "statistics/cells.csv"),
      sheets(folder / "statistics/sheets.csv"), tests(folder / "statistics/tests.csv");
  std::map<std::string, double> found_of;  // plain means
  for (const auto& [name, truth] : truth_of) {
    const int row = row_with(cells, {{"cell", name}}), in_batch = row_with(batch, {{"cell", name}}),
              in_sheets = row_with(sheets, {{"cell", name}, {"quantity", "contraction_nN_per_um"}});
    EXPECT_EQ(cells.text(row, "model"), "sheet");
    const std::map<std::string, std::string> in_batch_as = {{"contraction_nN_per_um", "sheet.contraction_nN_per_um"},
                                                            {"mean_tension_nN_per_um", "sheet.mean_tension_nN_per_um"},
                                                            {"sheet_force_nN", "sheet.total_force_nN"},
                                                            {"strain_energy_fJ", "sheet.strain_energy_fJ"},
                                                            {"cell_area_um2", "sheet.area_um2"}};
    for (const auto& [column, of_stage] : in_batch_as) {
      const double value = batch.number(in_batch, of_stage);
      EXPECT_NEAR(cells.number(row, column), value, 1e-5 * std::abs(value)) << name << column << ": six digits";
      EXPECT_GT(value, 0) << column;
    }
    const double value = cells.number(row, "contraction_nN_per_um"), sigma = sheets.number(in_sheets, "sigma");
    EXPECT_EQ(sheets.text(in_sheets, "value"), cells.text(row, "contraction_nN_per_um"));
    EXPECT_NEAR(value, truth, 4 * sigma) << name;
    EXPECT_LT(sigma, 0.2 * truth) << name << ": then this asks little";
    found_of[cells.text(row, "condition")] += value / 4;
  }
  const int row = row_with(tests, {{"quantity", "contraction_nN_per_um"},
                                   {"question", "between conditions"},
                                   {"test", "mixed model"},
                                   {"group_a", "drug"},
                                   {"group_b", "control"}});
  const double truth = mean_of["drug"] - mean_of["control"];
  EXPECT_LE(tests.number(row, "effect_low"), truth);
  EXPECT_GE(tests.number(row, "effect_high"), truth);
  EXPECT_LT(tests.number(row, "effect_high"), 0) << "four and four sheets of 0.2 nN/um scatter: five standard errors";
  EXPECT_LT(tests.number(row, "p_holm"), 0.05);
  const files::CsvTable summaries(folder / "statistics/summaries.csv");
  for (const auto& [condition, mean] : found_of) {
    const int at = row_with(summaries, {{"quantity", "contraction_nN_per_um"}, {"condition", condition}});
    EXPECT_NEAR(summaries.number(at, "mean"), mean, 1e-5 * mean);
    EXPECT_EQ(summaries.number(at, "n_cells"), 4);
  }
  EXPECT_TRUE(has_words(files::read_text(folder / "statistics/report.html"),
                        "Contraction of sheets, drug minus control: −", "[95 % CI −"));
  EXPECT_TRUE(std::filesystem::exists(folder / "statistics/figures/primary.svg"));
  EXPECT_TRUE(std::filesystem::exists(folder / "statistics/figures/sheets.svg"));
}

TEST_F(Sheet, a_sheet_pulls_only_where_it_adheres) {
  files::write_outline(folder_ / "ring.csv", test::circle(20, 120), {test::circle(14, 120)});
  const std::string soft = std::string(kSheet) + "adhesion_stiffness_nN_per_um3 = 0.03\n";
  ASSERT_EQ(run(soft, "--adhesive ring.csv").code, 0);
  const files::CsvTable traction(folder_ / "out" / "traction.csv");
  double area = 0;
  for (int row = 0; row < traction.n_rows(); ++row) {
    const double r = std::hypot(traction.number(row, "x_um"), traction.number(row, "y_um"));
    const double t = std::hypot(traction.number(row, "tx_kPa"), traction.number(row, "ty_kPa"));
    EXPECT_EQ(t > 0, 14 < r && r < 20) << r;
    if (t > 0) area += traction.number(row, "area_um2");
  }
  // triangles end at the ring's border, which has corners every 3 degrees
  EXPECT_NEAR(area, std::numbers::pi * (400 - 196), 2e-3 * area);
}

TEST_F(Sheet, cells_of_a_label_image_contract_each_by_its_own) {
  // two halves, of which the right one pulls alone
  images::Image image;
  image.width = image.height = 60;
  image.pixel_size_um = 1;
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 60; ++x) image.pixels.push_back(x < 30 ? 1.F : 2.F);
  images::write_tiff(folder_ / "cells.tif", image);
  Polygon moved = test::circle(25, 180);
  for (Vec2& p : moved) p += Vec2{30, 30};
  files::write_outline(folder_ / "moved.csv", moved);
  files::write_text(folder_ / "contractions.csv", "cell,contraction_nN_per_um\n1,0\n2,0.02\n");
  const std::string cells = "--pixel_size_um 1 --cells cells.tif";
  const std::string settings =
      "[sheet]\nyoungs_modulus_kPa = 1\npoisson_ratio = 0.3\nthickness_um = 0.4\n"
      "adhesion_stiffness_nN_per_um3 = 0.03\n";
  auto outcome = run(settings, cells + " --contractions contractions.csv", "moved.csv");
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  const files::CsvTable tension(folder_ / "out" / "cell_tension.csv");
  ASSERT_EQ(tension.n_rows(), 2);
  EXPECT_GT(tension.number(1, "mean_tension_nN_per_um"), 4 * std::abs(tension.number(0, "mean_tension_nN_per_um")));
  files::write_text(folder_ / "contractions.csv", "cell,contraction_nN_per_um\n2,0.02\n");
  outcome = run(settings, cells + " --contractions contractions.csv", "moved.csv");
  EXPECT_EQ(outcome.code, 3);
  EXPECT_TRUE(has_words(outcome.output, "none of cell 1"));
}

}  // namespace
}  // namespace mbtfm
