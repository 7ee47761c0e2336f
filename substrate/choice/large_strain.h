/// What large strains change of a gel's displacement: a Neo-Hookean gel less a linear one, both on the same elements,
/// whose own errors are the same in both. Added to a linear model that is exact, or has other effects, it needs far
/// coarser elements than a field would.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "substrate/compliance.h"
#include "substrate/response.h"

namespace mbtfm::choice {

class LargeStrain {
 public:
  /// @param gel  of one modulus
  /// @param near_nN  forces like those to come: ellipses that they hardly load stay out of it, as they strain nothing
  /// @param elements_across  the square root of an ellipse's area over the side of the elements that carry it
  /// @throws as Substrate::response
  LargeStrain(const Gel& gel, const std::vector<substrate::Ellipse>& ellipses, const std::vector<Vec2>& points_um,
              const VectorXd& near_nN, int threads, double elements_across = 1);
  /// By how much the points move otherwise than by G F, to first order about these forces; 2·points, and
  /// 2·points × 2·ellipses.
  /// @throws NotSolved where the gel finds no state under them
  substrate::Tangent about(const VectorXd& forces_nN) const;

 private:
  std::vector<Index> taken_;  ///< of the ellipses, ascending
  std::unique_ptr<substrate::Substrate> elements_;
  substrate::LazyResponse response_;  ///< of those taken
};

/// Relative L2 error of the change by its elements, at beads all over the surface: measured (notes/accuracy.md).
constexpr double kStrainElementsError = 0.35;

/// Of forces spread over ellipses: the root mean square of the tractions, by the squares of the forces, as these make
/// the squares of the displacement.
double mean_traction_kPa(const std::vector<substrate::Ellipse>& ellipses, const VectorXd& forces_nN);

/// What linear theory leaves out of the displacement, as a share of its L2 norm, within a factor of two: everywhere in
/// the gel, or at beads all over its surface, most of them far from the adhesions, which are small. Measured
/// (notes/accuracy.md).
double left_out_in_gel(const Gel& gel, double traction_kPa);
double left_out_at_beads(const Gel& gel, double traction_kPa);

/// Whether that calls for large strains. Never on where the material is linear, but its number says whether that
/// matters. @throws UsageError as decide
Effect decide_large_strain(const substrate::SubstrateParameters& parameters, double left_out);

}  // namespace mbtfm::choice
