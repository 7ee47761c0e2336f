/// tracking_cells [scenario] [first seed] [last seed] [threads] [noise] [photons] [alone]: tracked beads of simulated
/// cells, each of which has a step of its own (`noise`, relative to the largest displacement), and whether their flags
/// are right. `alone`: without the cell's adhesions.
///
/// Peaks: detected beads that the field moves by more than 5 px; how many of them are tracked rightly, and wrongly.
/// A vector is wrong where it is further than 1 px from the step of every bead within 2 px that both images show; beads
/// that leave the picture are rightly flagged, too.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "mbtfm/tractions/field_of_adhesions.h"
#include "tests/support/tracked_cell.h"

namespace {

using namespace mbtfm;

void print(const char* what, const test::Counts& counts) {
  int n = 0, n_flagged = 0, n_right = 0, n_missed = 0;
  for (const auto& [name, f] : counts.flags) {
    n += f.n;
    if (name.empty()) {
      n_missed = f.n - f.n_right;
    } else {
      n_flagged += f.n, n_right += f.n_right;
    }
  }
  std::printf("%s  %6.1f %%  %4d  %.3f  %.3f  %.3f  %.3f  %.2f   %d+%d of %d ", what, 100.0 * (n - n_flagged) / n,
              n_missed, n_right / std::max(1.0, 1.0 * n_right + n_missed), n_right / std::max(1.0, 1.0 * n_flagged),
              counts.own.root(), counts.field.root(), counts.variance.mean(), counts.peaks.n_right,
              counts.peaks.n_wrong, counts.peaks.n);
  for (const auto& [name, f] : counts.flags) {
    if (!name.empty()) std::printf("  %s %d of %d", name.c_str(), f.n_right, f.n);
  }
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const auto argument = [&](int k, double otherwise) { return argc > k ? std::atof(argv[k]) : otherwise; };
  drawing::ScenarioParameters p;
  stage::ParameterList list;
  declare(list, p);
  stage::read_toml(list, drawing::scenario_file(argc > 1 ? argv[1] : "u2os"));
  const int threads = static_cast<int>(argument(4, 2));
  p.noise = argument(5, p.noise);
  p.microscope.bead_photons = argument(6, p.microscope.bead_photons);
  const bool is_alone = argc > 7 && std::string(argv[7]) == "alone";
  std::printf("seed  tracked  wrong recall prec.  own    field  var   peaks       flags that are right\n");
  test::Counts all;
  for (int seed = static_cast<int>(argument(2, 101)); seed <= argument(3, 105); ++seed) {
    p.seed = static_cast<std::uint64_t>(seed);
    const test::CellPair pair = test::drawn_pair(p, threads);
    tractions::FieldOfAdhesions field(pair.experiment.cell.adhesions, threads);
    const beads::FieldModel model = [&](const DisplacementField& found) { return field.um(found); };
    const auto tracking = beads::RelaxedBeads(pair.relaxed, {}, threads, is_alone ? beads::FieldModel{} : model)
                              .track(pair.stressed, p.microscope.pixel_size_um);
    const test::Counts counts = test::counted(tracking, pair, p.microscope);
    print(std::to_string(seed).c_str(), counts);
    all += counts;
  }
  print("all", all);
}
