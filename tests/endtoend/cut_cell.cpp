/// Images that end before the cell does, through the whole chain.
#include "pipeline/contract/results.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "segment/images/image.h"
#include "tests/support/findings.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

/// The right part of the picture.
images::Image without_left(const images::Image& image, int n_columns) {
  images::Image part = image;
  part.width = image.width - n_columns;
  part.pixels.clear();
  for (int row = 0; row < image.height; ++row) {
    const auto begin = image.pixels.begin() + static_cast<std::ptrdiff_t>(row) * image.width;
    part.pixels.insert(part.pixels.end(), begin + n_columns, begin + image.width);
  }
  return part;
}

double figure(const FitSummary& fit, const std::string& name) {
  for (const auto& [known, value] : fit.more)
    if (known == name) return std::get<double>(value);
  ADD_FAILURE() << "no " << name << " in fit.json";
  return 0;
}

TEST(CutCell, cropped_images_are_fitted_and_the_force_through_the_cut_is_that_of_the_adhesions_outside) {
  const TemporaryFolder folder;
  const fs::path cell = folder / "cell";
  output_of("mbtfm-simulate --scenario u2os --seed 41 --noise 0.07 --images --quiet --out " + cell.string());
  double low = 1e9, high = -1e9;
  const std::vector<Polygon> rings = files::read_outline(cell / "truth/outline.csv");
  for (const Vec2 p : rings.front()) {
    low = std::min(low, p.x);
    high = std::max(high, p.x);
  }
  double pixel_um = 0;
  int n_columns = 0;
  for (const char* name : {"paxillin.tif", "actin.tif", "beads_stressed.tif", "beads_relaxed.tif"}) {
    const images::Image image = images::read_image(cell / name);
    pixel_um = image.pixel_size_um.value();
    n_columns = static_cast<int>((low + 0.25 * (high - low)) / pixel_um);
    images::write_tiff(cell / name, without_left(image, n_columns));
  }
  const double border_um = n_columns * pixel_um;
  const std::string run = output_of("mbtfm run " + cell.string());
  EXPECT_TRUE(test::fires("cell-cut", run)) << run;

  Vec2 outside_nN;
  const auto truth = files::read_adhesion_forces(cell / "truth/adhesion_forces.csv");
  for (const Adhesion& a : files::read_adhesions(cell / "truth/adhesions.csv")) {
    if (a.position_um.x >= border_um) continue;
    outside_nN += std::ranges::find(truth, a.adhesion_id, &AdhesionForce::adhesion_id)->force_nN;
  }
  const FitSummary fit = files::read_fit_summary(cell / "4_fit/fit.json");
  Vec2 inside_nN;
  for (const AdhesionForce& f : files::read_adhesion_forces(cell / "4_fit/adhesion_forces.csv"))
    inside_nN += f.force_nN;
  const Vec2 cut_nN{figure(fit, "cut_force_x_nN"), figure(fit, "cut_force_y_nN")};
  EXPECT_LE(norm(inside_nN + cut_nN), 1e-6 * norm(cut_nN));
  // segmentation adds its own error: the budget's total; four of them
  ASSERT_TRUE(fit.error_budget && fit.error_budget->cut_force);
  const double sigma_nN = total(fit.error_budget->cut_force->parts_nN);
  EXPECT_LE(norm(cut_nN - outside_nN), 4 * std::sqrt(2.0) * sigma_nN)
      << cut_nN.x << " " << cut_nN.y << " of " << outside_nN.x << " " << outside_nN.y;
  EXPECT_TRUE(has_words(files::read_text(cell / "report.html"), "Heavy grey dashes: the cut", "pass through the cut"));
}

TEST(CutCell, a_real_cell_that_leaves_its_image_is_fitted) {
  const fs::path data = test::source_folder().parent_path() / "shared/data/real/adhesions_and_beads";
  if (!fs::exists(data)) GTEST_SKIP() << data << " is not here";
  const TemporaryFolder folder;
  const fs::path cell = folder / "cell";
  fs::create_directories(cell);
  files::write_text(
      cell / "cell.toml",
      "pixel_size_um = 0.02025\n[gel]\nyoungs_modulus_kPa = 40\npoisson_ratio = 0.499\n[images]\nadhesion = \"" +
          (data / "ph_a.tif").string() + "\"\nactin = \"" + (data / "ph_a.tif").string() + "\"\nbeads_stressed = \"" +
          (data / "bead_a.tif").string() + "\"\nbeads_relaxed = \"" + (data / "bead_a.tif").string() +
          "\"\n[track]\nstressed_page = 1\nrelaxed_page = 2\n");
  output_of("mbtfm run " + cell.string());
  const FitSummary fit = files::read_fit_summary(cell / "4_fit/fit.json");
  EXPECT_TRUE(fit.converged);
  // the adhesions move into the cell, which lies below: the cut's force balances them upwards, and is known
  EXPECT_LT(figure(fit, "cut_force_y_nN") + 2 * figure(fit, "cut_force_y_sigma_nN"), 0);
}

}  // namespace
}  // namespace mbtfm
