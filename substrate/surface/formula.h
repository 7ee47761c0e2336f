/// Surfaces by formula.
#pragma once

#include <functional>
#include <string>

#include "pipeline/contract/surface.h"

namespace mbtfm::surface {

/// Reads a name and its numbers: "wave amplitude_um=12 period_um=70 phase_um=35". All are z in um, into the gel:
///
/// - flat: z_um
/// - wave: -amplitude_um cos(2 pi (v - phase_um)/period_um), v = x cos(angle_deg) + y sin(angle_deg)
/// - eggbox: -amplitude_um cos(k x) cos(k y), k = 2 pi/period_um
/// - groove: depth_um/2 [tanh((v + width_um/2)/wall_um) - tanh((v - width_um/2)/wall_um)]
/// - well: depth_um/2 [1 - tanh((r - radius_um)/wall_um)], r from (x_um, y_um)
/// - cap: a segment of a sphere of radius_um that bulges out of the gel by height_um at (x_um, y_um)
///
/// Numbers that may be left out (phase, angle, x, y, z) are 0.
/// @throws UsageError where it is no such text
std::function<double(Vec2)> formula_of(const std::string& text);
/// The names and their numbers, for help.
std::string formulas_listed();

/// Heights of a function on a lattice over a rectangle. The spacing is made smaller so that its lines end at the rims.
/// @throws UsageError where the rectangle is empty; InvalidData where the lattice would have fewer than 4 x 4 vertices
HeightMap sampled(const std::function<double(Vec2)>& height_um, Vec2 low_um, Vec2 high_um, double spacing_um);

}  // namespace mbtfm::surface
