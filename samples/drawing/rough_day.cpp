#include "samples/drawing/rough_day.h"

#include <cmath>
#include <numbers>

#include "samples/drawing/random.h"

namespace mbtfm::drawing {

ScenarioParameters rough_day(ScenarioParameters p, std::uint64_t number) {
  Random random(number, Stream::faults, 2);
  const auto between = [&](double low, double high) { return low * std::pow(high / low, random.uniform()); };
  const auto happens = [&](double share) { return random.uniform() < share; };
  const auto direction = [&](double length) {
    const double angle = 2 * std::numbers::pi * random.uniform();
    return length * Vec2{std::cos(angle), std::sin(angle)};
  };
  p.seed = number;
  p.images = true;
  p.gel.youngs_modulus_kPa = between(3, 15);
  p.noise_um = between(0.01, 0.03);
  p.beads_per_um2 = between(0.25, 1);
  p.mechanics.simulation_edge_length_um = between(0.7, 1.3);

  // The stage: a third of the field at most.
  const Vec2 drift = direction(between(0.05, field_um(p.microscope) / 3));
  p.drift_x_um = drift.x, p.drift_y_um = drift.y;
  if (happens(0.3)) p.turn_deg = random.uniform(-1, 1);
  if (happens(0.3)) {
    const Vec2 place = direction(random.uniform(70, 100));  // of centres: cells are 66 um wide
    p.neighbour_x_um = place.x, p.neighbour_y_um = place.y;
  }

  // What else lies there, and how it was recorded. Each number is drawn whether it is used or not, so that a fault that
  // is taken out leaves the others as they are.
  FaultParameters& f = p.faults;
  const auto if_happens = [&](double share, auto& member, double value) {
    if (happens(share)) member = static_cast<std::remove_reference_t<decltype(member)>>(value);
  };
  if_happens(0.3, f.n_specks, between(1, 8));
  if_happens(1, f.speck_brightness, between(2, 40));
  if_happens(0.2, f.n_dead_cells, between(1, 3));
  if_happens(0.2, f.relaxed_defocus, random.uniform(1, 1.8));
  if_happens(0.2, f.stressed_defocus, random.uniform(1, 1.8));
  if_happens(0.3, f.light_lost, random.uniform(0, 0.5));
  if_happens(0.2, f.saturated, between(0.001, 0.03));
  if_happens(0.2, f.padding_px, between(3, 60));
  if_happens(0.1, f.scale_bar_px, 100);
  if_happens(0.3, f.n_hot_pixels, between(3, 200));
  if_happens(0.3, p.microscope.blurred_bead_fraction, random.uniform(0.1, 0.6));
  if_happens(0.3, p.microscope.unevenness, random.uniform(0.25, 0.6));
  if_happens(0.3, p.microscope.haze, between(0.35, 1.5));
  if_happens(0.2, p.microscope.scan_phase_px, random.uniform(-2, 2));
  p.mechanics.simulation_network = static_cast<TrueNetwork>(random.uniform(0, std::size(words(TrueNetwork{}))));
  return p;
}

}  // namespace mbtfm::drawing
