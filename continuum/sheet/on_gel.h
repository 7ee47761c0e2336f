/// A sheet bonded to a gel, directly or through the springs of its adhesions.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "continuum/sheet/sheet.h"
#include "pipeline/contract/report.h"
#include "substrate/compliance.h"

namespace mbtfm::sheet {

/// Each triangle that adheres is a patch of even traction. With F the patches' forces, C the gel's compliance (and the
/// springs'), W the means over patches of the sheet's displacement:
///
///   W u = C F,   K u = f − Wᵀ F,   F without net force and torque
///
/// u eliminated, by conjugate gradients on balanced forces; the preconditioner is the same sheet on springs as stiff as
/// the gel under each patch. C is the mean displacement of a patch (its centre's where the other is far) by forces
/// spread over the ellipses that stand for the patches, made symmetric.
class OnGel {
 public:
  /// @param adhesion_nN_per_um3  unset: bonded
  /// @param adhering  the triangles that are patches, rising
  /// @throws as substrate::Substrate::response; InvalidData where fewer than two triangles adhere
  OnGel(const Elements& elements, const substrate::Substrate& gel, std::optional<double> adhesion_nN_per_um3,
        std::vector<int> adhering, int threads);

  struct Solution {
    NodeVectors u;
    Eigen::VectorXd forces_nN;  ///< by patch, x and y
    Report report;
  };
  /// Small strains. @param load_nN  on the nodes, balanced: forces_of_contraction_nN
  /// @throws NotSolved where the iteration does not end
  Solution solve(const Material& material, const NodeVectors& load_nN) const;

  const std::vector<int>& triangles() const { return adhering_; }  ///< by patch
  const std::vector<substrate::Ellipse>& patches() const { return ellipses_; }
  const std::vector<double>& areas_um2() const { return areas_um2_; }
  /// Displacement of the gel under each patch.
  Eigen::VectorXd gel_um(const Eigen::VectorXd& forces_nN) const;

 private:
  void average_near(const substrate::Substrate& gel, const std::vector<Vec2>& centres);
  Eigen::VectorXd ground_um(const Eigen::VectorXd& forces_nN) const;
  const Elements& elements_;
  int threads_;
  std::optional<double> adhesion_;
  std::vector<int> adhering_;
  std::vector<substrate::Ellipse> ellipses_;
  std::vector<double> areas_um2_;
  std::vector<std::array<double, 6>> weights_;  ///< W
  Eigen::MatrixXd compliance_;                  ///< lower half
};

/// The ellipse that stands for a triangle of the mesh: of its area and centre.
substrate::Ellipse patch_of(const Elements& elements, int triangle);

/// The ellipse of a triangle: of its centre, area and the ratio and direction of its axes of inertia.
substrate::Ellipse ellipse_of(Vec2 a, Vec2 b, Vec2 c);

}  // namespace mbtfm::sheet
