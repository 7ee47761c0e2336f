/// segmentation_accuracy [scenario] [first seed] [last seed] [true-adhesions] [name=value …]: how well simulated cells
/// are segmented, at three image qualities; mean over the seeds. `true-adhesions` judges the fibres apart from the
/// adhesions.
/// segmentation_accuracy adhesions SCENARIO FIRST LAST [name=value …]: the adhesions alone, and how many are merged.
/// segmentation_accuracy clutter SCENARIO FIRST LAST: the adhesions found where vesicles, haze and streaks are among
/// them, 0 to 1 of them a square micrometre by seed: whether each is one, its stated probability and the terms of it.
/// fibre_probability.py fits segment/cells/adhesions.cpp to them.
/// segmentation_accuracy real [name=value …]: adhesions and outlines of real cells that others have marked
/// (../shared/data), with default parameters, or adhesions with these.
#include <cstdio>
#include <cstdlib>

#include "pipeline/contract/errors.h"
#include "tests/support/find_fibres.h"
#include "tests/support/real_adhesions.h"
#include "tests/support/segmentation_accuracy.h"
#include "tests/support/settings.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::test;

/// How many of those said to be one with some probability are one.
struct Calibration {
  static constexpr double kLimits[] = {0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 1.0001};
  struct Bin {
    int n = 0, n_true = 0;
    double sum = 0;
  } bins[std::size(kLimits)];
  void add(double confidence, bool is_true) {
    Bin& bin = bins[std::upper_bound(std::begin(kLimits), std::end(kLimits), confidence) - std::begin(kLimits)];
    ++bin.n;
    bin.n_true += is_true;
    bin.sum += confidence;
  }
  void print(const char* what) const {
    std::printf("probability of %s: stated, true, number\n", what);
    for (const Bin& b : bins)
      if (b.n > 0) std::printf("  %.2f  %.2f  %d\n", b.sum / b.n, 1.0 * b.n_true / b.n, b.n);
  }
};

void real(const std::vector<std::string>& settings) {
  cells::AdhesionParameters p;
  stage::ParameterList list;
  declare(list, p);
  set_all(list, settings);
  if (!std::filesystem::exists(kHandMasks)) {
    std::printf("the shared data are absent: %s\n", kSharedData.c_str());
    return;
  }
  const auto print = [](const std::string& name, const Overlaps& o) {
    std::printf("%-12s %9.3f %6.3f %9.3f %6.3f %8d %6d\n", name.c_str(), o.pixels.dice, o.pixels.f1, o.ellipses.dice,
                o.ellipses.f1, o.pixels.n_true, o.pixels.n_found);
  };
  std::printf("%-12s %16s %16s %15s\n%-12s %9s %6s %9s %6s %8s %6s\n", "adhesions", "by pixels", "by ellipses",
              "number", "", "Dice", "F1", "Dice", "F1", "theirs", "found");
  Overlaps mean;
  Calibration calibration;
  for (const int i : kHandMasked) {
    for (const auto& [probability, is_true] : hand_mask_existence(i)) calibration.add(probability, is_true);
    const Overlaps o = hand_mask_overlaps(i, p);
    print("hand mask " + std::to_string(i), o);
    for (const auto& [to, from] : {std::pair(&mean.pixels, &o.pixels), {&mean.ellipses, &o.ellipses}}) {
      to->dice += from->dice / std::size(kHandMasked);
      to->f1 += from->f1 / std::size(kHandMasked);
      to->n_true += from->n_true;
      to->n_found += from->n_found;
    }
  }
  print("mean", mean);
  print("fibroblast", fibroblast_overlaps(p));
  std::printf("outline of the doublet: intersection over union %.3f\n", doublet_overlap());
  calibration.print("adhesions in the hand masks, default parameters");
}

/// Adhesions of simulated cells.
void adhesions(const std::string& scenario, int first, int last, const std::vector<std::string>& settings) {
  cells::AdhesionParameters p;
  stage::ParameterList list;
  declare(list, p);
  set_all(list, settings);
  std::printf("%-24s %6s %6s %6s %8s %8s %9s\n", "", "F1", "recall", "prec.", "merged", "split", "area bias");
  for (const std::string quality : {"poor", "ordinary", "good"}) {
    double f1 = 0, bias = 0;
    int n_true = 0, n_found = 0, n_matched = 0, n_merged = 0, n_split = 0;
    for (int seed = first; seed <= last; ++seed) {
      const SimulatedCell cell = simulated_cell(scenario, quality, static_cast<std::uint64_t>(seed));
      const auto found = cells::find_adhesions(cell.adhesion.image, *cell.adhesion.image.pixel_size_um, p);
      const AdhesionScore s = score_adhesions(cell.truth.adhesions, found);
      f1 += s.f1() / (last - first + 1), bias += (s.area_ratio - 1) / (last - first + 1);
      n_true += s.n_true, n_found += s.n_found, n_matched += s.n_matched, n_merged += s.n_merged, n_split += s.n_split;
    }
    std::printf("%-10s %-13s %6.3f %6.3f %6.3f %8.3f %8.3f %9.3f\n", scenario.c_str(), quality.c_str(), f1,
                1.0 * n_matched / n_true, 1.0 * n_matched / n_found, 1.0 * n_merged / n_true, 1.0 * n_split / n_true,
                bias);
  }
}

void clutter(const std::string& scenario, int first, int last) {
  constexpr int kDensities = 8;
  for (const std::string quality : {"poor", "ordinary", "good"})
    for (int seed = first; seed <= last; ++seed) {
      const int step = seed % kDensities;
      const double per_um2 = step == 0 ? 0 : std::pow(100, step / (kDensities - 1.0) - 1);
      const SimulatedCell cell = simulated_cell(scenario, quality, static_cast<std::uint64_t>(seed), 1024, per_um2);
      for (const cells::AdhesionRegion& r :
           cells::find_adhesion_regions(cell.adhesion.image, *cell.adhesion.image.pixel_size_um, {})) {
        std::printf("%s,%s,%d,%d,%.4f", scenario.c_str(), quality.c_str(), seed,
                    is_true_adhesion(r.adhesion, cell.truth.adhesions), r.adhesion.probability.value());
        for (const double term : r.terms) std::printf(",%.5g", term);
        std::printf("\n");
      }
    }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 4 && std::string(argv[1]) == "adhesions")
    return adhesions(argv[2], std::atoi(argv[3]), std::atoi(argv[4]), {argv + 5, argv + argc}), 0;
  if (argc == 5 && std::string(argv[1]) == "clutter")
    return clutter(argv[2], std::atoi(argv[3]), std::atoi(argv[4])), 0;
  if (argc > 1 && std::string(argv[1]) == "real") return real({argv + 2, argv + argc}), 0;
  const std::string scenario = argc > 1 ? argv[1] : "u2os";
  const int first = argc > 2 ? std::atoi(argv[2]) : 1, last = argc > 3 ? std::atoi(argv[3]) : 4;
  const bool has_true_adhesions = argc > 4 && std::string(argv[4]) == "true-adhesions";
  const std::vector<std::string> settings(argv + std::min(argc, has_true_adhesions ? 5 : 4), argv + argc);
  std::map<std::string, std::map<std::string, double>> table;
  std::map<std::string, Calibration> calibrations;
  for (const std::string quality : {"poor", "ordinary", "good"})
    for (int seed = first; seed <= last; ++seed) {
      const SimulatedCell cell = simulated_cell(scenario, quality, static_cast<std::uint64_t>(seed));
      Cell found;
      try {
        cells::SegmentParameters p;
        stage::ParameterList list;
        declare(list, p);
        test::set_all(list, settings);
        found = segment_cell(cell.adhesion, cell.actin, p).cell;
        if (has_true_adhesions) {
          found.adhesions = cell.truth.adhesions;
          found.fibres = cells::find_fibres(cell.actin.image, found.outline_um, found.adhesions,
                                            *cell.actin.image.pixel_size_um, p.fibres);
        }
      } catch (const InputError& error) {
        std::fprintf(stderr, "%s seed %d: %s\n", quality.c_str(), seed, error.what());
      }
      for (const Fibre& f : found.fibres) {
        calibrations["fibres"].add(f.confidence, is_true_fibre(f, cell.truth.fibres, 0.4));
        if (const Fibre* t = true_fibre(f, cell.truth.fibres, 0.4))
          calibrations["the type " + std::string(name_of(f.type))].add(f.type_confidence, f.type == t->type);
      }
      for (const auto& [name, value] : accuracy_of(cell.truth, found))
        table[name][quality] += value / (last - first + 1);
    }
  std::printf("%-42s %9s %9s %9s   (%s, seeds %d to %d)\n", "", "poor", "ordinary", "good", scenario.c_str(), first,
              last);
  for (auto& [name, row] : table)
    std::printf("%-42s %9.3f %9.3f %9.3f\n", name.c_str(), row["poor"], row["ordinary"], row["good"]);
  for (const auto& [what, calibration] : calibrations) calibration.print(what.c_str());
}
