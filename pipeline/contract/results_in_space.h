/// What is found for a cell in space.
#pragma once

#include <optional>

#include "pipeline/contract/geometry.h"

namespace mbtfm {

/// A place of the surface of a gel in space, and what it carries.
struct SurfaceTraction {
  Vec3 position_um, traction_kPa;
  std::optional<Vec3> sigma_kPa;
  double area_um2 = 0;  ///< that it represents
  std::optional<double> resolution_um;
  double normal_kPa = 0, tangential_kPa = 0;
  Vec3 displacement_um;
};

/// The force on a part of that surface, an adhesion's.
struct PartForce {
  int adhesion_id = 0;
  Vec3 position_um;
  double area_um2 = 0;  ///< of the curved surface
  Vec3 force_nN;
  Vec3 sigma_nN;                             ///< standard error, with what smoothing took away
  std::optional<double> magnitude_sigma_nN;  ///< along the force
  /// Its direction as seen from above, from +x towards +y, and the standard error of it: that of the force across
  /// itself over its length, and not more than that of any direction, 180°/√3.
  double angle_deg = 0, angle_sigma_deg = 0;
};

}  // namespace mbtfm
