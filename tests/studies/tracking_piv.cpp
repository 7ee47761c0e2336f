/// tracking_piv FOLDER [window_px] [origin_px]: how far tracked beads are from a published image correlation, and how
/// much of that is the correlation's own. FOLDER has forPIV/000k.tif (even: relaxed) and reference/PIVn.txt (x y u v,
/// px).
///
/// A correlation does not see a field but the beads of its windows, bright ones before dim ones, and sees least where
/// the gel turns within one. So from the beads found and their displacements as tracked a pair of images is drawn,
/// which is correlated as the published one was, as far as is known: that is the tracked field as their windows see it.
/// The recipe of the correlation (two passes, origin, smoothing between them) was chosen with a published field in
/// view, by what a correlation of the very images makes of it; the tracking was not.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/support/piv.h"

namespace {

using namespace mbtfm;

struct Reference {
  test::PivGrid grid;
  std::vector<Vec2> u;
};

Reference read_reference(const std::filesystem::path& file, double origin_px) {
  Reference result;
  std::ifstream in(file);
  for (double x, y, u, v; in >> x >> y >> u >> v;) {
    result.grid.middles.push_back({x - origin_px, y - origin_px});
    result.u.push_back({u, v});
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
  const double origin_px = argc > 3 ? std::atof(argv[3]) : test::kPivOrigin_px;
  for (const int frame : {1, 2}) {
    const auto image = [&](int k) {
      return images::read_image(folder / "forPIV" / ("000" + std::to_string(k) + ".tif"));
    };
    const images::Image relaxed = image(2 * frame - 2), stressed = image(2 * frame - 1);
    const auto name = "PIV" + std::to_string(frame) + ".txt";
    const auto [grid, theirs] = read_reference(folder / "reference" / name, origin_px);
    const auto tracking = beads::track_beads(relaxed, stressed, 1.0, {}, 2);
    std::printf("frame %d: %d of %zu beads, scatter %.2f px\n", frame, tracking.n_good, tracking.field.size(),
                tracking.scatter_um);
    const auto seen = [&, &grid = grid](const std::vector<test::Moved>& beads) {
      std::vector<Vec2> u;
      for (const Vec2 middle : grid.middles) {
        u.push_back(test::as_correlation_sees(beads, middle, tracking.bead_sigma_um, window));
      }
      return u;
    };
    const auto pair = test::redrawn(relaxed, tracking);
    const auto drawn = test::piv_in_two_passes(pair.relaxed, pair.stressed, grid, window);
    const auto own = test::piv_in_two_passes(relaxed, stressed, grid, window);
    print("tracked, drawn and correlated, against the reference", drawn, theirs);
    print("tracked, what most beads of a window do, against the same", seen(test::moved_beads(tracking)), theirs);
    print("correlation of our own of the images, against the same", own, theirs);
    print("tracked, drawn and correlated, against that", drawn, own);
    const auto again = beads::track_beads(pair.relaxed, pair.stressed, 1.0, {}, 2);
    std::vector<test::Moved> truth;
    for (std::size_t k = 0; k < pair.positions.size(); ++k) truth.push_back({pair.positions[k], pair.displacements[k]});
    print("drawn: tracked, against the truth", seen(test::moved_beads(again)), seen(truth));
    print("drawn: correlation, against the truth", drawn, seen(truth));
  }
}
