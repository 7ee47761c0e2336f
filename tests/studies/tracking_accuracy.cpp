/// tracking_accuracy [first seed] [last seed] [threads] [peak_px] [brightness] [beads]: errors of tracked beads on
/// simulated pairs of 512² pixels with 5 242 (or `beads`) beads of 1.3 px that shot and read noise blur; one line a
/// seed, then the mean.
/// tracking_accuracy scenes [first seed] [last seed] [threads] [part of a name] [correlation]: the same of scenes from
/// small to large pulls, and of poor pictures. Of all scenes: the share of seeds that are followed, rms of all and in
/// steep places (px), share of the peak that is found, error over stated sigma, silent wrong beads (%), seconds.
#include <cstdio>
#include <ctime>
#include <string>

#include "pipeline/contract/errors.h"
#include "tests/support/tracking_accuracy.h"

namespace {

using namespace mbtfm;

constexpr double kPixel_um = 0.16;
int beads_at(double per_um2) { return static_cast<int>(per_um2 * 512 * 512 * kPixel_um * kPixel_um); }

struct Named {
  std::string name;
  std::vector<test::Peak> peaks = test::ring_of_strain(512, 8, 0.27);
  test::BeadScene scene{.n_beads = beads_at(0.8)};
};

std::vector<Named> named_scenes() {
  std::vector<Named> all;
  for (const double per_um2 : {0.8, 0.15}) {
    const std::string density = per_um2 > 0.5 ? " px, dense" : " px, loose";
    for (const auto& [peak, strain] : {std::pair(3.0, 0.19), {8.0, 0.27}, {15.0, 0.36}, {30.0, 0.45}}) {
      all.push_back({std::to_string(static_cast<int>(peak)) + density,
                     test::ring_of_strain(512, peak, strain),
                     {.n_beads = beads_at(per_um2)}});
    }
    // four adhesions on a thin gel are what the picture has room for
    all.push_back({"75" + density, test::ring_of_strain(512, 75, 0.73, 4, 0.7), {.n_beads = beads_at(per_um2)}});
  }
  const auto add = [&](const char* name, const auto& change) { change(all.emplace_back(Named{.name = name}).scene); };
  add("stressed blurred", [](auto& s) { s.defocus = std::hypot(3, s.bead_sigma) / s.bead_sigma; });
  add("both blurred", [](auto& s) { s.bead_sigma = 3, s.brightness *= 1.3 * 1.3 / 9; });
  add("dim", [](auto& s) { s.brightness /= 5; });
  add("lost", [](auto& s) { s.lost = 0.05; });
  // NA 1, 0.6 um: 0.21 lambda/NA is 0.8 px, 4 pi n sigma²/lambda is 3 px
  add("in depth", [](auto& s) { s.n_beads = 24000, s.bead_sigma = 0.8, s.depth = 4 / kPixel_um; });
  return all;
}

/// Of the processor: others may work on this machine, too.
double seconds_since(std::clock_t begin) { return double(std::clock() - begin) / CLOCKS_PER_SEC; }

/// What is taken for the stage's motion is another study's: it is added to what each bead does.
beads::Tracking with_motion_of_all(beads::Tracking tracking) {
  for (Bead& bead : tracking.field)
    bead.displacement_um += tracking.stressed.motion.at(bead.position_um - Vec2{0.5, 0.5});
  return tracking;
}

void scenes(int first, int last, int threads, const std::string& part, beads::TrackMethod method) {
  beads::TrackParameters parameters;
  parameters.drift_affine = Switch::automatic;
  parameters.method = method;
  std::printf("%-18s seeds  beads    rms    steep  peak   err/s  silent %%  windows  s\n", "");
  for (Named& named : named_scenes()) {
    if (named.name.find(part) == std::string::npos) continue;
    test::TrackingErrors sum;
    int n_followed = 0, n_windows = 0;
    double seconds = 0;
    for (int seed = first; seed <= last; ++seed) {
      named.scene.seed = static_cast<std::uint64_t>(seed);
      const auto pair = test::draw_bead_pair(named.peaks, named.scene);
      const auto begin = std::clock();
      try {
        const auto tracking =
            beads::track_beads(pair.relaxed, pair.stressed, 1.0, test::in_relaxed_frame(parameters), threads);
        sum += test::errors_of(with_motion_of_all(tracking), named.peaks);
        n_windows += tracking.windows.is_on ? static_cast<int>(tracking.field.size()) : tracking.n_windows;
        ++n_followed;
      } catch (const InvalidData& error) {
        std::printf("  %s %d: %s expected %s, found %s\n", named.name.c_str(), seed, error.element.c_str(),
                    error.expected.c_str(), error.found.c_str());
      }
      seconds += seconds_since(begin);
    }
    const int n = last - first + 1;
    std::printf("%-18s %d/%d  %5.1f %%  %.3f  %.3f  %.3f  %5.2f  %7.3f  %6d  %.2f\n", named.name.c_str(), n_followed, n,
                100.0 * sum.n_good / std::max(1, sum.n_beads), sum.all.root(), sum.steep.root(), sum.peak.mean(),
                std::sqrt(sum.variance.mean()), 100.0 * sum.n_silent / std::max(1, sum.n_good), n_windows / n,
                seconds / n);
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto argument = [&](int k, double otherwise) { return argc > k ? std::atof(argv[k]) : otherwise; };
  if (argc > 1 && std::string(argv[1]) == "scenes") {
    scenes(static_cast<int>(argument(2, 1)), static_cast<int>(argument(3, 4)), static_cast<int>(argument(4, 2)),
           argc > 5 ? argv[5] : "", argc > 6 ? beads::TrackMethod::correlation : beads::TrackMethod::automatic);
    return 0;
  }
  const int first = static_cast<int>(argument(1, 1)), last = static_cast<int>(argument(2, 4));
  const auto peaks = test::ring_of_adhesions(512, argument(4, 8.3));
  test::BeadScene scene{
      .n_beads = static_cast<int>(argument(6, 5242)), .brightness = argument(5, 1500), .drift = {1.7, -0.6}};
  std::printf("seed   tracked  rms    <.5    >2     >6     var    steep  drift  wrong  s\n");
  test::TrackingErrors sum;
  for (int seed = first; seed <= last; ++seed) {
    scene.seed = static_cast<std::uint64_t>(seed);
    const auto pair = test::draw_bead_pair(peaks, scene);
    const auto begin = std::clock();
    const auto tracking = beads::track_beads(pair.relaxed, pair.stressed, 1.0, test::in_relaxed_frame(),
                                             static_cast<int>(argument(3, 2)));
    const test::TrackingErrors e = test::errors_of(tracking, peaks, scene.drift);
    std::printf("%4d   %s  %.2f\n", seed, test::line_of(e).c_str(), seconds_since(begin));
    std::fflush(stdout);
    sum += e;
  }
  std::printf("all    %s\n", test::line_of(sum).c_str());
}
