/// What a confocal microscope makes of a bead in a gel.
#pragma once

#include <vector>

namespace mbtfm::drawing {

/// The optics that look into a gel.
struct Optics {
  double numerical_aperture = 0.9;  ///< of an objective for thick specimens
  double excitation_um = 0.488, emission_um = 0.52;
  double gel_index = 1.36;         ///< polyacrylamide of 10 %
  double immersion_index = 1.333;  ///< water
  double bead_diameter_um = 0.5;
};

/// Light of a bead by the distance of the focus from it, 1 where a bead without aberration is in focus. Rotationally
/// symmetric: the product of excitation and detection, each
///
///   h = |∫ J0(k NA r ρ) exp(i k [z sqrt(n² - NA²ρ²) + d (sqrt(n² - NA²ρ²) - sqrt(n_i² - NA²ρ²))]) ρ dρ|²,  0 < ρ < 1
///
/// at depth d below the gel's surface (Hell, Reiner, Cremer & Stelzer, J Microsc 169:391, 1993), averaged over the
/// bead's volume and the pixel. The shift of the focus, which is the same for all, is taken off: z counts from the
/// brightest plane.
class PointSpread {
 public:
  PointSpread(const Optics& optics, double deepest_um, double pixel_um, int threads);
  double at(double r_um, double z_um, double depth_um) const;

  static constexpr double kReach_um = 1.6, kReachAlongZ_um = 4;  ///< beyond it is taken for dark

 private:
  double deepest_um_;
  std::vector<float> table_;  ///< by depth, z, r
};

}  // namespace mbtfm::drawing
