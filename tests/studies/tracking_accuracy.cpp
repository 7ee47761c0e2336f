/// tracking_accuracy [first seed] [last seed] [threads] [peak_px] [brightness] [beads]: errors of tracked beads on
/// simulated pairs of 512² pixels with 5 242 (or `beads`) beads of 1.3 px that shot and read noise blur; one line a
/// seed, then the mean.
#include <chrono>
#include <cstdio>

#include "tests/support/tracking_accuracy.h"

int main(int argc, char** argv) {
  using namespace mbtfm;
  const auto argument = [&](int k, double otherwise) { return argc > k ? std::atof(argv[k]) : otherwise; };
  const int first = static_cast<int>(argument(1, 1)), last = static_cast<int>(argument(2, 4));
  const auto peaks = test::ring_of_adhesions(512, argument(4, 8.3));
  test::BeadScene scene{
      .n_beads = static_cast<int>(argument(6, 5242)), .brightness = argument(5, 1500), .drift = {1.7, -0.6}};
  std::printf("seed   tracked  rms    <.5    >2     >6     var    steep  drift  wrong  s\n");
  test::TrackingErrors sum;
  for (int seed = first; seed <= last; ++seed) {
    scene.seed = static_cast<std::uint64_t>(seed);
    const auto pair = test::draw_bead_pair(peaks, scene);
    const auto begin = std::chrono::steady_clock::now();
    const auto tracking = beads::track_beads(pair.relaxed, pair.stressed, 1.0, test::in_relaxed_frame(),
                                             static_cast<int>(argument(3, 2)));
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    const test::TrackingErrors e = test::errors_of(tracking, peaks, scene.drift);
    std::printf("%4d   %s  %.2f\n", seed, test::line_of(e).c_str(), seconds.count());
    std::fflush(stdout);
    sum += e;
  }
  std::printf("all    %s\n", test::line_of(sum).c_str());
}
