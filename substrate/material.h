/// What the gel is made of: one modulus, or one that changes with depth.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/gel.h"

namespace mbtfm::substrate {

inline double shear_modulus_kPa(const Gel& gel) { return gel.youngs_modulus_kPa / (2 * (1 + gel.poisson_ratio)); }
/// Lamé's first; infinite at a Poisson ratio of 1/2.
inline double lame_modulus_kPa(const Gel& gel) {
  return 2 * shear_modulus_kPa(gel) * gel.poisson_ratio / (1 - 2 * gel.poisson_ratio);
}

/// Young's modulus (kPa) at a depth (um) below the surface.
struct ModulusAtDepth {
  double depth_um = 0, youngs_modulus_kPa = 0;
};

/// Linear between its depths, even above the first and below the last; two moduli at one depth are a step. Empty: the
/// gel's own modulus everywhere.
using ModulusProfile = std::vector<ModulusAtDepth>;

/// Reads "0:16, 10:16, 10:8.4": depth (um) and modulus (kPa), by rising depth.
/// @throws UsageError where it is no such list
ModulusProfile profile_of(const std::string& text);

struct Material {
  Gel gel;  ///< its Poisson ratio holds at every depth
  ModulusProfile profile;
};

/// The modulus at a depth over the gel's; at a step, that of the side on which `towards_um` lies.
double relative_modulus(const Material& material, double depth_um, double towards_um);
/// The same all the way between two depths; nothing where it changes there.
std::optional<double> even_modulus(const Material& material, double low_um, double high_um);
/// Depths within the gel at which the modulus jumps.
std::vector<double> steps_um(const Material& material);

}  // namespace mbtfm::substrate
