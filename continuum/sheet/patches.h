/// Parts of a sheet that carry an even traction each.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <vector>

#include "continuum/sheet/elements.h"
#include "pipeline/contract/words.h"
#include "substrate/compliance.h"
#include "substrate/ellipse.h"

namespace mbtfm::sheet {

/// The ellipse that represents a triangle of the mesh: of its area and centre.
substrate::Ellipse patch_of(const Elements& elements, int triangle);

/// The ellipse of a triangle: of its centre, area and the ratio and direction of its axes of inertia.
substrate::Ellipse ellipse_of(Vec2 a, Vec2 b, Vec2 c);

struct Patches {
  const Elements* elements = nullptr;
  std::vector<int> triangles;  ///< rising
  std::vector<substrate::Ellipse> ellipses;
  std::vector<double> areas_um2;

  int n() const { return static_cast<int>(triangles.size()); }
  Vec2 centre_um(int patch) const { return ellipses[patch].centre_um; }
  std::vector<Vec2> centres_um() const;
  /// The root of its area.
  double size_um(int patch) const;
  /// At point 0 … Elements::kPoints − 1 of a patch.
  const Shape& at(int patch, int point) const { return elements->at(triangles[patch], point); }
  /// Of a point in the mean over the patch.
  double share(int patch, int point) const { return at(patch, point).weight_um2 / areas_um2[patch]; }
};
/// @throws InvalidData where there are fewer than two
Patches patches_of(const Elements& elements, std::vector<int> triangles);

/// By patch: itself and those whose centres are nearer than a function of the sum of both sizes, which must not fall;
/// rising.
std::vector<std::vector<int>> neighbours_of(const Patches& patches, const std::function<double(double)>& reach_um);

// How the gel under a sheet answers to the forces of the sheet's patches.

/// u = C F, by patch and component: F the forces, u the displacement of the gel, each column by itself. C is symmetric.
/// Of patches so near that it matters, u is the mean over the patch, of others its centre's or the mean. Calls may run
/// at one time.
class PatchCompliance {
 public:
  virtual ~PatchCompliance() = default;
  virtual MatrixXd displace(const MatrixXd& forces_nN) const = 0;
  virtual VectorXd diagonal_um_per_nN() const = 0;
  virtual MatrixXd matrix_um_per_nN() const;  ///< C itself: of few patches
};

/// How C is held.
enum class Held {
  dense,   ///< all numbers: 0.13 GB for 2 000 patches, growing with their square
  lattice  ///< near pairs of patches as such, far ones by the fast Fourier transform on a lattice
};
constexpr auto words(Held) { return std::array{"dense", "lattice"}; }

/// The lattice beyond 2 000 patches, if the gel answers alike everywhere.
Held held_for(int n_patches, const substrate::Capabilities& gel);

/// @throws as substrate::Substrate::response
std::unique_ptr<PatchCompliance> compliance_of(const Patches& patches, const substrate::Substrate& gel, Held held,
                                               int threads);

inline constexpr double kMeanReach = 2.5;  ///< sizes of both patches: beyond, the centre's value is the mean to 1 %

/// C of pairs of near patches, by patch j: of near[j], 2·near[j] × 2, by a unit force on j; means within the reach.
std::vector<MatrixXd> near_columns(const Patches& patches, const substrate::Substrate& gel,
                                   const std::vector<std::vector<int>>& near, int threads);

}  // namespace mbtfm::sheet
