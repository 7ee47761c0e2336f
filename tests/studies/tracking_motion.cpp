/// tracking_motion [first seed] [last seed] [threads]: what the tracker finds of a stressed image's motion as a whole,
/// beside simulated cells in the middle of the picture, near its corner, and cut by its border.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>

#include "pipeline/contract/affine_motion.h"
#include "pipeline/contract/errors.h"
#include "samples/drawing/render.h"
#include "samples/experiment/experiment.h"
#include "segment/beads/given_field.h"
#include "segment/beads/track.h"

namespace {

using namespace mbtfm;

struct Pair {
  images::Image relaxed, stressed;
};

using Motion = std::function<Vec2(Vec2)>;  ///< um, of what is at a place (um)

Pair drawn(const drawing::ScenarioParameters& p, const experiment::Experiment& experiment, const Motion& motion,
           int threads) {
  const drawing::MicroscopeParameters m = drawing::at_quality(p.microscope);
  std::vector<Vec2> relaxed, stressed;
  for (const Bead& bead : experiment.measured) {
    relaxed.push_back(bead.position_um);
    const Vec2 end = bead.position_um + bead.displacement_um;
    stressed.push_back(end + motion(end));
  }
  const drawing::BeadImages spots = drawing::bead_spots(relaxed, stressed, p.lost_bead_fraction, m, p.seed);
  return {drawing::recorded(drawing::photons_of(spots.relaxed, m, threads), m, p.seed, 2, threads),
          drawing::recorded(drawing::photons_of(spots.stressed, m, threads), m, p.seed, 3, threads)};
}

images::Image cropped(const images::Image& image, int left, int top, int width, int height) {
  images::Image result = image;
  result.width = width, result.height = height;
  result.pixels.clear();
  for (int j = top; j < top + height; ++j) {
    const float* row = image.pixels.data() + static_cast<std::size_t>(j) * image.width + left;
    result.pixels.insert(result.pixels.end(), row, row + width);
  }
  return result;
}

struct Crop {
  const char* name;
  int left, top, width, height;
};

struct Asked {
  const char* name;
  double growth, turn_rad, stretch, skew;
  Vec2 shift_um;
};

}  // namespace

int main(int argc, char** argv) {
  const auto argument = [&](int k, double otherwise) { return argc > k ? std::atof(argv[k]) : otherwise; };
  const int threads = static_cast<int>(argument(3, 2));
  const Crop crops[] = {{"middle", 0, 0, 1024, 1024},  {"corner", 140, 140, 884, 884}, {"cut 1", 512, 0, 512, 1024},
                        {"cut 1b", 300, 0, 724, 1024}, {"cut 2", 512, 512, 512, 512},  {"cut 2b", 320, 320, 704, 704},
                        {"cut 3", 280, 660, 464, 364}};
  const Asked motions[] = {{"none", 0, 0, 0, 0, {}},
                           {"drift", 0, 0, 0, 0, {0.83, -0.46}},
                           {"growth .1 %", 0.001, 0, 0, 0, {}},
                           {"growth -.3 %", -0.003, 0, 0, 0, {0.2, 0.3}},
                           {"shear .1 %", 0, 0, 0.0006, 0.0008, {}},
                           {"turn .3 deg", 0, 0.0052, 0, 0, {}},
                           {"all", 0.003, -0.0052, 0.001, -0.001, {0.83, -0.46}}};
  std::printf(
      "shift error um, growth %% (error), turn deg (error), rest, on, rms of field - truth over sigma; noise\n");
  for (int seed = static_cast<int>(argument(1, 1)); seed <= argument(2, 2); ++seed) {
    drawing::ScenarioParameters p;
    stage::ParameterList list;
    declare(list, p);
    stage::read_toml(list, drawing::scenario_file("u2os"));
    p.seed = static_cast<std::uint64_t>(seed);
    p.noise = argument(4, p.noise);
    const experiment::Experiment experiment = experiment::simulate(p, threads);
    for (const Asked& asked : motions) {
      const double side_um = drawing::field_um(p.microscope);
      const AffineMotion affine{.shift = asked.shift_um,
                                .turn_rad = asked.turn_rad,
                                .growth = asked.growth,
                                .stretch = asked.stretch,
                                .skew = asked.skew,
                                .centre = {0.5 * side_um, 0.5 * side_um}};
      const Motion motion = [&](Vec2 at) { return affine.at(at); };
      const Pair pair = drawn(p, experiment, motion, threads);
      for (const Crop& crop : crops) {
        // where the motion is counts only in the middle: elsewhere one of each
        if (&crop != &crops[0] && &asked != &motions[0] && &asked != &motions[6]) continue;
        const auto cut = [&](const images::Image& image) {
          return cropped(image, crop.left, crop.top, crop.width, crop.height);
        };
        const double pixel = p.microscope.pixel_size_um;
        const Vec2 middle{pixel * (crop.left + 0.5 * crop.width), pixel * (crop.top + 0.5 * crop.height)};
        const images::Image relaxed = cut(pair.relaxed), stressed = cut(pair.stressed);
        std::printf("%d %-12s %-7s ", seed, asked.name, crop.name);
        beads::TrackParameters parameters;
        parameters.drift_affine = Switch::automatic;
        try {
          const auto t = beads::track_beads(relaxed, stressed, pixel, parameters, threads);
          const Vec2 missed = t.common.drift_um - motion(middle);
          const auto& c = t.common;
          const double angle = 2 * c.shear_angle_rad;
          const Vec2 shear = c.shear * Vec2{std::cos(angle), std::sin(angle)} - Vec2{asked.stretch, asked.skew};
          std::printf(
              "%+.3f %+.3f (%.3f)  growth %+.4f (%.4f)  turn %+.4f (%.4f)  shear %+.4f %+.4f (%.4f)  rest %d %.2f %.2f "
              "%.2f %s"
              "  noise %.3f out %+.2f",
              missed.x, missed.y, c.drift_sigma_um, 100 * (c.growth - asked.growth), 100 * c.growth_sigma,
              57.2958 * (c.turn_rad - asked.turn_rad), 57.2958 * c.turn_sigma_rad, 100 * shear.x, 100 * shear.y,
              100 * c.shear_sigma, c.has_far_field, c.share_at_rest, c.share_of_border_moving, c.share_of_border_pulled,
              t.affine.is_on ? "ON " : "off", t.noise_um, beads::outwardness(t.field));
        } catch (const InvalidData& error) {
          std::printf("REFUSED %s", error.what());
        }
        if (&asked == &motions[0]) {
          try {
            const auto t = beads::track_beads(stressed, relaxed, pixel, parameters, threads);
            std::printf("  swapped out %+.2f rest %d", beads::outwardness(t.field), t.common.has_far_field);
          } catch (const InvalidData& error) {
            std::printf("  swapped REFUSED %s", error.what());
          }
        }
        std::printf("\n");
        std::fflush(stdout);
      }
    }
  }
}
