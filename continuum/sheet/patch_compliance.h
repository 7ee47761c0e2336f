/// How the gel under a sheet answers to the forces of the sheet's patches.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "continuum/sheet/patches.h"
#include "pipeline/contract/words.h"
#include "substrate/compliance.h"

namespace mbtfm::sheet {

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
