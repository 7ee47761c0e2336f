/// segmentation_accuracy [scenario] [first seed] [last seed] [true-adhesions] [name=value …]: how well simulated cells
/// are segmented, at three image qualities; mean over the seeds. `true-adhesions` judges the fibres apart from the
/// adhesions. What is lost of the fibres, and where, is of the ordinary images.
#include <cstdio>
#include <cstdlib>

#include "pipeline/contract/errors.h"
#include "tests/support/fibre_losses.h"
#include "tests/support/settings.h"

namespace {

/// How many of the fibres said to be one with some confidence are one.
struct Calibration {
  static constexpr double kLimits[] = {0.3, 0.6, 0.8, 0.9, 0.97, 1.0001};
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
  void print() const {
    std::printf("confidence of a fibre: stated, true, fibres\n");
    for (const Bin& b : bins)
      if (b.n > 0) std::printf("  %.2f  %.2f  %d\n", b.sum / b.n, 1.0 * b.n_true / b.n, b.n);
  }
};

}  // namespace

int main(int argc, char** argv) {
  using namespace mbtfm;
  using namespace mbtfm::test;
  const std::string scenario = argc > 1 ? argv[1] : "u2os";
  const int first = argc > 2 ? std::atoi(argv[2]) : 1, last = argc > 3 ? std::atoi(argv[3]) : 4;
  const bool has_true_adhesions = argc > 4 && std::string(argv[4]) == "true-adhesions";
  const std::vector<std::string> settings(argv + std::min(argc, has_true_adhesions ? 5 : 4), argv + argc);
  std::map<std::string, std::map<std::string, double>> table;
  Calibration calibration;
  FibreLosses losses;
  const std::vector<std::string> qualities = {"poor", "ordinary", "good"};
  for (const std::string& quality : qualities) {
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
      for (const Fibre& f : found.fibres) calibration.add(f.confidence, is_true_fibre(f, cell.truth.fibres, 0.4));
      if (quality == "ordinary") add_losses(losses, cell, found);
      for (const auto& [name, value] : accuracy_of(cell.truth, found))
        table[name][quality] += value / (last - first + 1);
    }
  }
  std::printf("%-42s %9s %9s %9s   (%s, seeds %d to %d)\n", "", "poor", "ordinary", "good", scenario.c_str(), first,
              last);
  for (auto& [name, row] : table)
    std::printf("%-42s %9.3f %9.3f %9.3f\n", name.c_str(), row["poor"], row["ordinary"], row["good"]);
  calibration.print();
  print(losses);
}
