/// tracking_cells [scenario] [first seed] [last seed] [threads] [noise] [photons]: tracked beads of simulated cells,
/// each of which has a step of its own (`noise`, relative to the largest displacement), and whether their flags are
/// right.
///
/// Peaks: detected beads that the field moves by more than 5 px; how many of them are tracked rightly, and wrongly.
/// A vector is wrong where it is further than 1 px from the step of every bead within 2 px that both images show; beads
/// that leave the picture are rightly flagged, too.
#include <cstdio>
#include <cstdlib>
#include <map>

#include "samples/drawing/render.h"
#include "samples/experiment/experiment.h"
#include "segment/beads/plane.h"
#include "tests/support/tracking_accuracy.h"

namespace {

using namespace mbtfm;

struct Pair {
  experiment::Experiment experiment;
  images::Image relaxed, stressed;
  beads::Neighbours shown;    ///< relaxed places of all beads, um
  std::vector<char> is_lost;  ///< by bead: not in the stressed image
};

Pair drawn(const drawing::ScenarioParameters& p, int threads) {
  Pair pair{experiment::simulate(p, threads), {}, {}, {}, {}};
  const drawing::MicroscopeParameters m = drawing::at_quality(p.microscope);
  std::vector<Vec2> relaxed, stressed;
  for (const Bead& bead : pair.experiment.measured) {
    relaxed.push_back(bead.position_um);
    stressed.push_back(bead.position_um + bead.displacement_um);
  }
  const drawing::BeadImages spots = drawing::bead_spots(relaxed, stressed, p.lost_bead_fraction, m, p.seed);
  pair.relaxed = drawing::recorded(drawing::photons_of(spots.relaxed, m, threads), m, p.seed, 2, threads);
  pair.stressed = drawing::recorded(drawing::photons_of(spots.stressed, m, threads), m, p.seed, 3, threads);
  std::size_t next = 0;  // the spots that are there lie in the order of the beads
  for (const Vec2 end : stressed) {
    const bool is_shown = next < spots.stressed.size() && spots.stressed[next].position_um == end;
    pair.is_lost.push_back(!is_shown);
    next += is_shown;
  }
  pair.shown = beads::Neighbours(std::move(relaxed), 1);
  return pair;
}

struct Flags {
  int n = 0, n_right = 0;
};

struct Peaks {
  int n = 0, n_right = 0, n_wrong = 0;
};

struct Counts {
  std::map<std::string, Flags> flags;
  Peaks peaks;
  test::MeanSquare own, field;  ///< px, of a component, about the bead's own step and about the field
  test::MeanSquare variance;    ///< of error/sigma about the field
  Counts& operator+=(const Counts& other) {
    for (const auto& [name, f] : other.flags) flags[name].n += f.n, flags[name].n_right += f.n_right;
    peaks.n += other.peaks.n, peaks.n_right += other.peaks.n_right, peaks.n_wrong += other.peaks.n_wrong;
    own += other.own, field += other.field, variance += other.variance;
    return *this;
  }
};

constexpr double kLost = 1e3;  ///< px

Counts counted(const beads::Tracking& tracking, const Pair& pair, const drawing::MicroscopeParameters& m) {
  Counts counts;
  const double pixel = m.pixel_size_um, margin = 3 * tracking.bead_sigma_um, side = drawing::field_um(m);
  for (const Bead& bead : tracking.field) {
    const auto around = pair.shown.within(bead.position_um, 2 * pixel, 3);
    double off = around.empty() ? 0 : kLost;  // chance spots have no step of their own
    bool is_leaving = false;
    for (const int k : around) {
      const Bead& truth = pair.experiment.measured[k];
      const Vec2 end = truth.position_um + truth.displacement_um;
      if (std::min({end.x, end.y, side - end.x, side - end.y}) < margin) is_leaving = true;
      if (!pair.is_lost[k]) off = std::min(off, norm(bead.displacement_um - truth.displacement_um) / pixel);
    }
    const bool is_good = bead.flag.empty();
    Flags& flags = counts.flags[bead.flag];
    ++flags.n;
    flags.n_right += is_good ? off <= 1 : off > 1 || is_leaving;
    if (around.empty()) continue;
    const Vec2 field_um = pair.experiment.displacement[around[0]].displacement_um;
    if (norm(field_um) > 5 * pixel) {
      ++counts.peaks.n;
      if (is_good) ++(off <= 1 ? counts.peaks.n_right : counts.peaks.n_wrong);
    }
    if (!is_good) continue;
    if (off < kLost) counts.own.add(0.5 * off * off);
    const Vec2 error = bead.displacement_um - field_um;
    counts.field.add(0.5 * dot(error, error) / (pixel * pixel));
    counts.variance.add(0.5 * dot(error, error) / (bead.sigma_um * bead.sigma_um));
  }
  return counts;
}

void print(const char* what, const Counts& counts) {
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
  std::printf("seed  tracked  wrong recall prec.  own    field  var   peaks       flags that are right\n");
  Counts all;
  for (int seed = static_cast<int>(argument(2, 101)); seed <= argument(3, 105); ++seed) {
    p.seed = static_cast<std::uint64_t>(seed);
    const Pair pair = drawn(p, threads);
    const auto tracking = beads::track_beads(pair.relaxed, pair.stressed, p.microscope.pixel_size_um, {}, threads);
    const Counts counts = counted(tracking, pair, p.microscope);
    print(std::to_string(seed).c_str(), counts);
    all += counts;
  }
  print("all", all);
}
