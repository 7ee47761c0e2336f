/// The contact of a cell with its gel where it is no circle: a line around its centroid, and the sectors that follow
/// it.
#pragma once

#include <vector>

#include "continuum/solids/section.h"
#include "pipeline/contract/geometry.h"

namespace mbtfm::solids {

/// A contact, seen from its centroid.
class Contact {
 public:
  /// @param outline_um  distinct points that do not cross
  /// @throws InvalidData where a ray from the centroid meets it more than once
  explicit Contact(const Polygon& outline_um);

  Vec2 centroid_um() const { return centroid_um_; }
  double area_um2() const { return area_um2_; }
  double equal_radius_um() const;  ///< of the circle of this area
  double largest_radius_um() const;
  /// Distance of the outline from the centroid. @param angle  from x towards y
  double radius_um_at(double angle) const;

 private:
  double area_um2_ = 0;
  Vec2 centroid_um_;
  std::vector<Vec2> from_centroid_um_;  ///< by rising angle in [0, 2 pi)
  std::vector<double> angles_;
};

/// The section of a sphere with this height and contact's area.
Section section_on(const Contact& contact, double height_um);

/// The circle in sectors.
struct Sectors {
  std::vector<double> angles;  ///< between them, from 0 to 2 pi
  double off_um = 0;           ///< largest distance between the outline and its polynomials
  int n() const { return static_cast<int>(angles.size()) - 1; }
};
/// 12, halved until polynomials of the order are within a hundredth of the contact's mean radius of its outline.
/// @throws InvalidData where that takes more than 32
Sectors sectors_of(const Contact& contact, int order);

/// @throws InvalidData where the contact is wider than half the slab
void expect_on_slab(const Contact& contact, const Slab& slab);

}  // namespace mbtfm::solids
