/// tracking_piv FOLDER [window_px]: how far tracked beads are from a reference by image correlation, and how much of
/// that is the correlation's own. FOLDER has forPIV/000k.tif (even: relaxed) and reference/PIVn.txt (x y u v, px).
///
/// From the beads found and their displacements as tracked a pair is drawn anew, so that its truth is known exactly; it
/// is correlated in the same windows. What a perfect tracker differs from that by is the correlation's.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "tests/support/bead_pair.h"
#include "tests/support/piv.h"

namespace {

using namespace mbtfm;

struct Reference {
  std::vector<Vec2> places, u;
};

Reference read_reference(const std::filesystem::path& file) {
  Reference result;
  std::ifstream in(file);
  for (double x, y, u, v; in >> x >> y >> u >> v;) result.places.push_back({x, y}), result.u.push_back({u, v});
  return result;
}

/// The beads of the relaxed image, moved as tracked, on the image's own background, with its noise.
test::BeadPair redrawn(const segment::Image& relaxed, const segment::Tracking& tracking) {
  const auto beads = segment::detect_beads(relaxed);
  test::BeadPair pair;
  std::vector<float> sorted = relaxed.pixels;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 4), sorted.end());
  const float background = sorted[sorted.size() / 4];
  for (segment::Image* image : {&pair.relaxed, &pair.stressed}) {
    *image = relaxed;
    std::fill(image->pixels.begin(), image->pixels.end(), background);
  }
  const std::vector<test::Moved> moved = test::moved_beads(tracking);
  for (const segment::DetectedBead& bead : beads) {
    const auto nearest = std::min_element(moved.begin(), moved.end(), [&](const auto& a, const auto& b) {
      return norm(a.place - bead.position_px) < norm(b.place - bead.position_px);
    });
    test::add_bead(pair.relaxed, bead.position_px, bead.brightness, tracking.bead_sigma_um);
    test::add_bead(pair.stressed, bead.position_px + nearest->u, bead.brightness, tracking.bead_sigma_um);
    pair.positions.push_back(bead.position_px);
    pair.displacements.push_back(nearest->u);
  }
  std::mt19937_64 random(101);
  std::normal_distribution<float> noise(0, 0.02f * background);
  for (segment::Image* image : {&pair.relaxed, &pair.stressed}) {
    for (float& value : image->pixels) value += noise(random);
  }
  return pair;
}

std::vector<Vec2> seen(const std::vector<test::Moved>& beads, const std::vector<Vec2>& places, double bead_sigma,
                       int window) {
  std::vector<Vec2> result;
  for (const Vec2 place : places) result.push_back(test::as_correlation_sees(beads, place, bead_sigma, window));
  return result;
}

std::vector<Vec2> correlated(const segment::Image& relaxed, const segment::Image& stressed,
                             const std::vector<Vec2>& places, const std::vector<Vec2>& about, int window) {
  std::vector<Vec2> result;
  for (std::size_t k = 0; k < places.size(); ++k) {
    result.push_back(test::piv_displacement(relaxed, stressed, places[k], about[k], window));
  }
  return result;
}

void print(const char* what, const std::vector<Vec2>& ours, const std::vector<Vec2>& theirs) {
  const test::Agreement found = test::agreement(ours, theirs);
  std::printf("  %-58s median %.3f px, r %.3f\n", what, found.median_px, found.correlation);
}

}  // namespace

int main(int argc, char** argv) {
  const std::filesystem::path folder = argc > 1 ? argv[1] : ".";
  const int window = argc > 2 ? std::atoi(argv[2]) : 32;
  for (const int frame : {1, 2}) {
    const auto image = [&](int k) {
      return segment::read_image(folder / "forPIV" / ("000" + std::to_string(k) + ".tif"));
    };
    const segment::Image relaxed = image(2 * frame - 2), stressed = image(2 * frame - 1);
    const Reference reference = read_reference(folder / "reference" / ("PIV" + std::to_string(frame) + ".txt"));
    const auto tracking = segment::track_beads(relaxed, stressed, 1.0, {}, 2);
    const double sigma = tracking.bead_sigma_um;
    const auto& places = reference.places;
    const std::vector<Vec2> ours = seen(test::moved_beads(tracking), places, sigma, window);
    std::printf("frame %d: %d of %zu beads, scatter %.2f px\n", frame, tracking.n_good, tracking.field.size(),
                tracking.scatter_um);
    print("tracked, against the reference", ours, reference.u);
    const auto own = correlated(relaxed, stressed, places, ours, window);
    print("correlation in our windows, against the reference", own, reference.u);
    print("tracked, against correlation in our windows", ours, own);
    const auto pair = redrawn(relaxed, tracking);
    std::vector<test::Moved> truth;
    for (std::size_t k = 0; k < pair.positions.size(); ++k) truth.push_back({pair.positions[k], pair.displacements[k]});
    const auto perfect = seen(truth, places, sigma, window);
    const auto drawn = correlated(pair.relaxed, pair.stressed, places, perfect, window);
    print("drawn anew: a perfect tracker, against correlation", perfect, drawn);
    const auto again =
        seen(test::moved_beads(segment::track_beads(pair.relaxed, pair.stressed, 1.0, {}, 2)), places, sigma, window);
    print("drawn anew: tracked, against correlation", again, drawn);
    print("drawn anew: tracked, against a perfect tracker", again, perfect);
    print("correlation of the pair drawn anew, against the reference", drawn, reference.u);
  }
}
