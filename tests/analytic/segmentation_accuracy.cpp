/// What the segmentation must reach on simulated cells whose truth is known. The seeds served no tuning.
#include "tests/support/segmentation_accuracy.h"

namespace mbtfm::test {
namespace {

constexpr std::uint64_t kFirstSeed = 101, kLastSeed = 103;

Accuracy mean_accuracy(const std::string& scenario, const std::string& quality) {
  Accuracy mean;
  for (std::uint64_t seed = kFirstSeed; seed <= kLastSeed; ++seed) {
    const SimulatedCell cell = simulated_cell(scenario, quality, seed);
    const Cell found = cells::segment_cell(cell.adhesion, cell.actin, cells::SegmentParameters{}).cell;
    for (const auto& [name, value] : accuracy_of(cell.truth, found))
      mean[name] += value / static_cast<double>(kLastSeed - kFirstSeed + 1);
  }
  return mean;
}

struct Bars {
  double f1, area_bias, area_error, centre_um, orientation_deg, centreline_f1, one_piece, type_right, outline_iou;
};

void expect_reaches(Accuracy a, const Bars& bars) {
  EXPECT_GE(a["adhesion F1"], bars.f1);
  EXPECT_LE(std::abs(a["adhesion area bias"]), bars.area_bias);
  EXPECT_LE(a["adhesion area error, median"], bars.area_error);
  EXPECT_LE(a["adhesion centre error, median (um)"], bars.centre_um);
  EXPECT_LE(a["adhesion orientation error, median (deg)"], bars.orientation_deg);
  EXPECT_GE(a["fibre centreline F1 (0.25 um)"], bars.centreline_f1);
  EXPECT_GE(a["fibres in one piece"], bars.one_piece);
  EXPECT_GE(a["fibre type right"], bars.type_right);
  EXPECT_GE(a["outline IoU"], bars.outline_iou);
}

TEST(SegmentationAccuracy, of_ordinary_images) {
  for (const char* scenario : {"u2os", "crowded"}) {
    SCOPED_TRACE(scenario);
    expect_reaches(mean_accuracy(scenario, "ordinary"), {.f1 = 0.92,
                                                         .area_bias = 0.10,
                                                         .area_error = 0.20,
                                                         .centre_um = 0.08,
                                                         .orientation_deg = 6,
                                                         .centreline_f1 = 0.90,
                                                         .one_piece = 0.85,
                                                         .type_right = 0.90,
                                                         .outline_iou = 0.96});
  }
}

TEST(SegmentationAccuracy, of_good_images) {
  expect_reaches(mean_accuracy("u2os", "good"), {.f1 = 0.97,
                                                 .area_bias = 0.05,
                                                 .area_error = 0.10,
                                                 .centre_um = 0.04,
                                                 .orientation_deg = 3,
                                                 .centreline_f1 = 0.95,
                                                 .one_piece = 0.92,
                                                 .type_right = 0.95,
                                                 .outline_iou = 0.98});
}

/// Lines beside fibres are taken from three deviations on. Their place makes them likely, which must not get lost: it
/// did once, and a fifth of the fibres were stated with less than 0.3.
TEST(SegmentationAccuracy, of_fibres_in_bundles_is_not_stated_to_be_low) {
  int n = 0, n_low = 0;
  for (std::uint64_t seed = kFirstSeed; seed <= kLastSeed; ++seed) {
    const SimulatedCell cell = simulated_cell("dense", "ordinary", seed);
    const Cell found = cells::segment_cell(cell.adhesion, cell.actin, cells::SegmentParameters{}).cell;
    for (const Fibre& f : found.fibres) {
      if (!is_true_fibre(f, cell.truth.fibres, 0.4)) continue;
      ++n;
      n_low += f.confidence < 0.3;
    }
  }
  EXPECT_GT(n, 60);
  EXPECT_LT(n_low, 0.05 * n);
}

}  // namespace
}  // namespace mbtfm::test
