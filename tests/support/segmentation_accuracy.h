/// Simulated cells seen through a microscope of a given quality, and how well a segmentation finds what is in them.
#pragma once

#include "pipeline/contract/extent.h"
#include "pipeline/stage/parameters.h"
#include "samples/drawing/draw.h"
#include "samples/drawing/raster.h"
#include "samples/drawing/render.h"
#include "samples/drawing/scenario.h"
#include "segment/cells/segment_cell.h"
#include "tests/support/segmentation_score.h"

namespace mbtfm::test {

struct SimulatedCell {
  Cell truth;
  images::Channel adhesion, actin;
  drawing::Nucleus nucleus;
};

/// Things in an adhesion image that are no adhesions: vesicles of `density_per_um2`, a tenth as many clouds out of
/// focus, a fifth as many streaks. (0.1/b)² of them are brighter than b, in units of the mean adhesion.
inline void add_clutter(images::Image& specimen, const Polygon& outline_um, double density_per_um2,
                        std::uint64_t seed) {
  constexpr double kClouds = 0.1, kStreaks = 0.2, kKinds = 1 + kClouds + kStreaks;
  drawing::Random random(seed, drawing::Stream::optics, 77);
  const auto [low, high] = extent_of(outline_um);
  const double n = kKinds * density_per_um2 * (high.x - low.x) * (high.y - low.y);
  for (int i = 0; i < n; ++i) {
    const Vec2 at{random.uniform(low.x, high.x), random.uniform(low.y, high.y)};
    const double kind = random.uniform(0, kKinds), brightness = std::min(1.0, 0.1 / std::sqrt(1 - random.uniform()));
    const double size = random.uniform(), angle = random.uniform(0, std::numbers::pi);
    if (!contains(outline_um, at)) continue;
    if (kind < 1 + kClouds) {
      const double sigma_um = kind < 1 ? 0.08 + 0.22 * size : 0.4 + 0.8 * size;
      const double area_px = 2 * std::numbers::pi * std::pow(sigma_um / *specimen.pixel_size_um, 2);
      drawing::add_spot(specimen, {at, brightness * area_px, sigma_um});
    } else {
      const double half_um = 1 + 3 * size;
      const Vec2 way = half_um * Vec2{std::cos(angle), std::sin(angle)};
      drawing::add_line(specimen, {at - way, at + way}, random.uniform(0.1, 0.25),
                        [&](double s) { return brightness * std::sin(std::numbers::pi * s / (2 * half_um)); });
    }
  }
}

/// The images that `mbtfm-simulate --scenario … --image_quality … --seed … --images` writes, without the mechanics.
inline SimulatedCell simulated_cell(const std::string& scenario, const std::string& quality, std::uint64_t seed,
                                    int image_size_px = 1024, double clutter_per_um2 = 0) {
  drawing::ScenarioParameters p;
  stage::ParameterList list;
  declare(list, p);
  stage::read_toml(list, drawing::scenario_file(scenario));
  p.microscope.image_quality = named<drawing::ImageQuality>(quality).value();
  p.microscope.image_size_px = image_size_px;
  const drawing::MicroscopeParameters m = drawing::at_quality(p.microscope);
  constexpr int kThreads = 2;
  SimulatedCell cell{drawing::draw_cell(p.cell, p.tension, drawing::field_um(m), seed).cell, {}, {}, {}};
  const auto image = [&](const images::Image& specimen, int exposure) {
    return drawing::recorded(drawing::photons_of(specimen, m, kThreads), m, seed, exposure, kThreads);
  };
  images::Image paxillin = drawing::paxillin_specimen(cell.truth, m, seed, kThreads);
  add_clutter(paxillin, cell.truth.outline_um, clutter_per_um2, seed);
  cell.adhesion = {"paxillin.tif", image(paxillin, 0)};
  cell.actin = {"actin.tif", image(drawing::actin_specimen(cell.truth, p.actin, m, seed, kThreads), 1)};
  cell.nucleus = drawing::nucleus_of(cell.truth, seed);
  for (images::Channel* channel : {&cell.adhesion, &cell.actin}) channel->image.pixel_size_um = m.pixel_size_um;
  return cell;
}

/// What is measured of one cell, by name; lengths in um, angles in degrees.
using Accuracy = std::map<std::string, double>;

inline Accuracy accuracy_of(const Cell& truth, const Cell& found) {
  const AdhesionScore a = score_adhesions(truth.adhesions, found.adhesions);
  const FibreScore f = score_fibres(truth, found, a);
  const LineScore l = score_lines(truth.fibres, found.fibres, 0.25);
  constexpr double kDegrees = 180 / std::numbers::pi;
  Accuracy result = {{"adhesion F1", a.f1()},
                     {"adhesions merged", 1.0 * a.n_merged / std::max(1, a.n_true)},
                     {"adhesions split", 1.0 * a.n_split / std::max(1, a.n_true)},
                     {"adhesion area bias", a.area_ratio - 1},
                     {"adhesion area error, median", median(a.area_errors)},
                     {"adhesion centre error, median (um)", median(a.centre_errors_um)},
                     {"adhesion orientation error, median (deg)", kDegrees * median(a.angle_errors_rad)},
                     {"fibre centreline F1 (0.25 um)", l.f1()},
                     {"fibres in one piece", 1.0 * f.n_traced / std::max(1, f.n_true)},
                     {"fibre unclassified", 1.0 * f.n_unclassified / std::max(1, f.n_traced)},
                     {"fibre type right", 1.0 * f.n_type_right / std::max(1, f.n_traced - f.n_unclassified)},
                     {"fibre type and adhesions right", 1.0 * f.n_typed / std::max(1, f.n_traced - f.n_unclassified)},
                     {"false fibres", 1.0 * f.n_false}};
  if (!found.outline_um.empty()) result["outline IoU"] = intersection_over_union(truth.outline_um, found.outline_um);
  return result;
}

}  // namespace mbtfm::test
