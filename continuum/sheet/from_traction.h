/// Tensions of a sheet from the tractions under it ("monolayer stress microscopy").
#pragma once

#include <optional>
#include <vector>

#include "continuum/sheet/elements.h"
#include "continuum/sheet/forward.h"

namespace mbtfm::sheet {

/// What is out of balance of the tractions, and what of them the sheet cannot take.
struct Unbalanced {
  double net_force_share = 0;   ///< |Σ F| / Σ |F|
  double net_torque_share = 0;  ///< |Σ (x − c) × F| / Σ |x − c| |F|
  double outside_share = 0;     ///< of Σ |F|: outside of the area
};

/// Errors of the tractions. Neighbours share theirs over a distance, as smoothing makes them.
struct TractionNoise {
  double sigma_kPa = 0;       ///< of a component
  double correlation_um = 0;  ///< within squares of this side errors are the same
};

/// Standard errors that follow from those of the tractions, by drawing them.
struct TensionErrors {
  static constexpr int kDraws = 48;  ///< an error of an error of a tenth
  double mean_nN_per_um = 0;         ///< of the mean tension over the area
  std::vector<double> by_triangle;   ///< of the mean tension there
};

/// What the sheet beyond the cuts does to what is seen.
struct CutPull {
  Vec2 force_nN;
  double length_um = 0;  ///< of the cuts
};

struct FromTraction {
  Solution solution;      ///< u is of a sheet with the material's stiffness, up to a motion as a whole
  Unbalanced unbalanced;  ///< before it was taken off
  Balance balance;
  std::optional<CutPull> cut;  ///< where the sheet is held at cuts
  std::optional<TensionErrors> errors;
};

/// A fifth: what smoothing and noise leave of a whole colony's forces is below.
inline constexpr double kMostUnbalanced = 0.2;

/// What is taken for known along a cut, of which nothing is known.
enum class CutEdge {
  held,     ///< no displacement across the cut, no shear: as where the sheet beyond mirrors what is seen
  clamped,  ///< no displacement at all
  free      ///< as a rim: nothing pulls there
};

/// S of a free sheet under −T: div S = T, S n = 0 on the rims. An elastic law decides what balance alone does not; S
/// does not depend on its modulus. A patch whose centre lies in the region acts as the square of its area; the
/// others are left out. A net force and torque are taken off by an even traction and an even turn (least squares in T),
/// as far as no cut can carry them.
/// @param most_unbalanced  share of net force or torque. @throws InputError where more is out of balance
FromTraction tensions_from(const std::vector<GroundPatch>& tractions, const Region& region, const Material& material,
                           const TriangleSize& size, int threads, double most_unbalanced = kMostUnbalanced,
                           const std::optional<TractionNoise>& noise = {}, CutEdge at_cuts = CutEdge::held);

/// Of ½ tr S and S_xy, over the part of the sheet inside of an outline.
struct TensionFigures {
  double mean_nN_per_um = 0;
  double variation = 0;  ///< standard deviation over mean
  double shear_nN_per_um = 0;
  double area_um2 = 0;
};
TensionFigures figures_inside(const Solution& solution, const Polygon& outline_um);

/// How far from the cuts two solutions on the same triangles differ in ½ tr S by more than this.
double reach_of_cuts_um(const Solution& a, const Solution& b, const Cuts& cuts, double difference_nN_per_um);

}  // namespace mbtfm::sheet
