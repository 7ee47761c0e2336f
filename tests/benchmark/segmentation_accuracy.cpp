/// segmentation_accuracy [scenario] [first seed] [last seed] [true-adhesions]: how well simulated cells are segmented,
/// at three image qualities; mean over the seeds. `true-adhesions` judges the fibres apart from the adhesions.
#include <cstdio>
#include <cstdlib>

#include "pipeline/contract/errors.h"
#include "tests/support/segmentation_accuracy.h"

int main(int argc, char** argv) {
  using namespace mbtfm;
  using namespace mbtfm::test;
  const std::string scenario = argc > 1 ? argv[1] : "u2os";
  const int first = argc > 2 ? std::atoi(argv[2]) : 1, last = argc > 3 ? std::atoi(argv[3]) : 4;
  const bool has_true_adhesions = argc > 4 && std::string(argv[4]) == "true-adhesions";
  std::map<std::string, std::map<std::string, double>> table;
  const std::vector<std::string> qualities = {"poor", "ordinary", "good"};
  for (const std::string& quality : qualities) {
    for (int seed = first; seed <= last; ++seed) {
      const SimulatedCell cell = simulated_cell(scenario, quality, static_cast<std::uint64_t>(seed));
      Cell found;
      try {
        const segment::SegmentParameters p;
        found = segment_cell(cell.adhesion, cell.actin, p).cell;
        if (has_true_adhesions) {
          found.adhesions = cell.truth.adhesions;
          found.fibres = find_fibres(cell.actin.image, found.outline_um, found.adhesions,
                                     *cell.actin.image.pixel_size_um, p.fibres);
        }
      } catch (const InputError& error) {
        std::fprintf(stderr, "%s seed %d: %s\n", quality.c_str(), seed, error.what());
      }
      for (const auto& [name, value] : accuracy_of(cell.truth, found))
        table[name][quality] += value / (last - first + 1);
    }
  }
  std::printf("%-42s %9s %9s %9s   (%s, seeds %d to %d)\n", "", "poor", "ordinary", "good", scenario.c_str(), first,
              last);
  for (auto& [name, row] : table)
    std::printf("%-42s %9.3f %9.3f %9.3f\n", name.c_str(), row["poor"], row["ordinary"], row["good"]);
}
