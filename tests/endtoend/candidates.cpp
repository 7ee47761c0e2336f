/// Cells without an adhesion image, and with masks of other programs, from the images to the report.
#include "pipeline/contract/results.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "segment/images/image.h"
#include "tests/support/findings.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

constexpr const char* kScenario =
    "pixel_size_um = 0.1\n[gel]\nyoungs_modulus_kPa = 8.4\npoisson_ratio = 0.49\nthickness_um = 60\n"
    "[scenario]\ndiameter_um = 24\nimage_size_px = 400\nn_adhesions = 24\nn_ventral = 3\nn_dorsal = 2\nn_arc = 0\n"
    "noise = 0.07\nbeads = 1500\n";

class WithoutAdhesions : public ::testing::Test {
 protected:
  void SetUp() override {
    files::write_text(folder_ / "scenario.toml", kScenario);
    output_of("mbtfm-simulate --quiet --images --scenario " + (folder_ / "scenario.toml").string() +
              " --seed 3 --out " + cell().string());
    true_total_nN_ = total_nN(cell() / "truth/adhesion_forces.csv");
  }
  fs::path cell() const { return folder_ / "cell"; }
  static double total_nN(const fs::path& file) {
    double sum = 0;
    for (const AdhesionForce& f : files::read_adhesion_forces(file)) sum += norm(f.force_nN);
    return sum;
  }
  void set(const std::string& settings) {
    files::write_text(cell() / "cell.toml", files::read_text(cell() / "cell.toml") + settings);
  }

  test::TemporaryFolder folder_;
  double true_total_nN_ = 0;
};

TEST_F(WithoutAdhesions, a_cell_is_fitted_on_candidates_and_says_so) {
  fs::remove(cell() / "paxillin.tif");
  const Outcome run = run_program("mbtfm run " + cell().string());
  ASSERT_EQ(run.code, 0) << run.output;
  EXPECT_TRUE(test::fires("adhesions-assumed", run.output)) << run.output;
  EXPECT_TRUE(has_words(run.output, "caution (adhesions-assumed): Forces act on", "as no image shows any"));
  const Cell found = files::read_cell(cell() / "1_segment");
  EXPECT_TRUE(
      std::ranges::all_of(found.adhesions, [](const Adhesion& a) { return a.origin == AdhesionOrigin::candidate; }));
  EXPECT_TRUE(fs::exists(cell() / "1_segment/adhesions_2.csv"));
  const FitSummary fit = files::read_fit_summary(cell() / "4_fit/fit.json");
  // Candidates at the rim may be micrometres beside an adhesion; what the whole cell pulls with is known all the same.
  EXPECT_NEAR(fit.total_force_nN / true_total_nN_, 1, 0.3);
  ASSERT_TRUE(fit.error_budget);
  const auto spread = std::ranges::find(fit.more, "total_force_spread_by_placement_nN", &Figures::value_type::first);
  ASSERT_NE(spread, fit.more.end());
  EXPECT_GE(fit.error_budget->total_force_parts_nN.segmentation, std::get<double>(spread->second));
  EXPECT_TRUE(has_words(files::read_text(cell() / "report.html"),
                        "No adhesion was seen: forces are placed where adhesions may be", "candidate, not seen",
                        "traction density"));
  output_of("mbtfm stats " + folder_.path().string());

  // an adhesion image that comes later takes the candidates' place
  fs::copy(cell() / "actin.tif", cell() / "adhesion_mask.tif");
  EXPECT_TRUE(has_words(output_of("mbtfm run " + cell().string(), 3), "adhesion_mask.tif"));
}

TEST_F(WithoutAdhesions, masks_of_what_is_true_give_the_forces) {
  fs::remove(cell() / "paxillin.tif");
  const images::Image actin = images::read_image(cell() / "actin.tif");
  images::Image outline = actin, spots = actin;
  const Cell truth = files::read_cell(cell() / "truth");
  for (int j = 0; j < actin.height; ++j)
    for (int i = 0; i < actin.width; ++i) {
      const Vec2 at{(i + 0.5) * 0.1, (j + 0.5) * 0.1};
      outline.at(i, j) = contains(truth.outline_um, at) ? 255.0f : 0.0f;
      spots.at(i, j) = 0;
      for (const Adhesion& a : truth.adhesions)
        if (contains(ellipse_corners(a, 64), at)) spots.at(i, j) = static_cast<float>(a.adhesion_id);
    }
  images::write_tiff(cell() / "outline_mask.tif", outline);
  images::write_tiff(cell() / "adhesion_mask.tif", spots);
  const Outcome run = run_program("mbtfm run " + cell().string());
  ASSERT_EQ(run.code, 0) << run.output;
  EXPECT_FALSE(test::fires("adhesions-assumed", run.output)) << run.output;
  const Cell found = files::read_cell(cell() / "1_segment");
  EXPECT_EQ(found.adhesions.size(), truth.adhesions.size());
  const double area_um2 = std::abs(signed_area_um2(truth.outline_um));
  EXPECT_NEAR(std::abs(signed_area_um2(found.outline_um)), area_um2, 0.01 * area_um2);
  EXPECT_NEAR(files::read_fit_summary(cell() / "4_fit/fit.json").total_force_nN / true_total_nN_, 1, 0.2);
  EXPECT_FALSE(fs::exists(cell() / "1_segment/adhesions_2.csv"));

  set("\n[segment]\nadhesions = \"pattern\"\n");
  const Outcome pattern = run_program("mbtfm run " + cell().string());
  ASSERT_EQ(pattern.code, 0) << pattern.output;
  EXPECT_TRUE(has_words(pattern.output, "note (adhesions-assumed)"));
  set("candidate_spacing_um = 0.5\n");
  fs::remove(cell() / "adhesion_mask.tif");
  EXPECT_TRUE(
      has_words(output_of("mbtfm run " + cell().string(), 2), "adhesions = pattern: no adhesion mask is given"));
}

}  // namespace
}  // namespace mbtfm
