/// What the segmentation must reach on simulated cells whose truth is known. The seeds served no tuning.
#include <gtest/gtest.h>

#include "tests/support/segmentation_accuracy.h"

namespace mbtfm::test {
namespace {

constexpr std::uint64_t kFirstSeed = 101, kLastSeed = 103;

Accuracy mean_accuracy(const std::string& scenario, const std::string& quality) {
  Accuracy mean;
  for (std::uint64_t seed = kFirstSeed; seed <= kLastSeed; ++seed) {
    const SimulatedCell cell = simulated_cell(scenario, quality, seed);
    const Cell found = segment_cell(cell.adhesion, cell.actin, segment::SegmentParameters{}).cell;
    for (const auto& [name, value] : accuracy_of(cell.truth, found))
      mean[name] += value / static_cast<double>(kLastSeed - kFirstSeed + 1);
  }
  return mean;
}

TEST(SegmentationAccuracy, of_ordinary_images) {
  for (const char* scenario : {"u2os", "crowded"}) {
    SCOPED_TRACE(scenario);
    Accuracy a = mean_accuracy(scenario, "ordinary");
    EXPECT_GE(a["adhesion F1"], 0.92);
    EXPECT_LE(std::abs(a["adhesion area bias"]), 0.10);
    EXPECT_LE(a["adhesion area error, median"], 0.20);
    EXPECT_LE(a["adhesion centre error, median (um)"], 0.08);
    EXPECT_LE(a["adhesion orientation error, median (deg)"], 6);
    EXPECT_GE(a["fibre centreline F1 (0.25 um)"], 0.90);
    EXPECT_GE(a["fibres in one piece"], 0.85);
    EXPECT_GE(a["fibre type right"], 0.90);
    EXPECT_GE(a["outline IoU"], 0.96);
  }
}

TEST(SegmentationAccuracy, of_good_images) {
  Accuracy a = mean_accuracy("u2os", "good");
  EXPECT_GE(a["adhesion F1"], 0.97);
  EXPECT_LE(std::abs(a["adhesion area bias"]), 0.05);
  EXPECT_LE(a["adhesion area error, median"], 0.10);
  EXPECT_LE(a["adhesion centre error, median (um)"], 0.04);
  EXPECT_LE(a["adhesion orientation error, median (deg)"], 3);
  EXPECT_GE(a["fibre centreline F1 (0.25 um)"], 0.95);
  EXPECT_GE(a["fibres in one piece"], 0.92);
  EXPECT_GE(a["fibre type right"], 0.95);
  EXPECT_GE(a["outline IoU"], 0.98);
}

}  // namespace
}  // namespace mbtfm::test
