/// A sheet bonded to a gel, directly or through the springs of its adhesions.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "continuum/sheet/large_strain.h"
#include "continuum/sheet/patches.h"
#include "substrate/compliance.h"

namespace mbtfm::sheet {

/// Each triangle that adheres is a patch of even traction. With F the patches' forces, C the gel's compliance, κ the
/// springs of the adhesions over the areas A, W the means over patches of the sheet's displacement:
///
///   W u = (C + 1 / κA) F,   K u = f − Wᵀ F,   F without net force and torque
///
/// u eliminated, by conjugate gradients on balanced forces; the preconditioner is the same sheet on springs as stiff as
/// the gel under each patch. C is the mean displacement of a patch (its centre's where the other is far) by forces
/// spread over the ellipses that represent the patches, made symmetric.
class OnGel {
 public:
  /// @param adhering  the triangles that are patches, rising
  /// @param held  unset: by the number of patches
  /// @throws as substrate::Substrate::response; InvalidData where fewer than two triangles adhere
  OnGel(const Elements& elements, const substrate::Substrate& gel, std::vector<int> adhering, int threads,
        std::optional<Held> held = {});

  struct Solution {
    NodeVectors u;
    VectorXd forces_nN;  ///< by patch, x and y
    Report report;
  };
  /// Small strains. @param adhesion_nN_per_um3  unset: bonded
  /// @param load_nN  on the nodes, balanced: forces_of_contraction_nN
  /// @throws NotSolved where the iteration does not end
  Solution solve(const Material& material, std::optional<double> adhesion_nN_per_um3, const NodeVectors& load_nN) const;
  /// The same of several loads side by side, u and forces by column, which takes far less time than one by one.
  struct Solutions {
    MatrixXd u, forces_nN;
    Report report;
  };
  Solutions solve_all(const Material& material, std::optional<double> adhesion_nN_per_um3,
                      const MatrixXd& loads_nN) const;

  /// Large strains of the sheet; those of the gel are small, and its forces act where its surface is at rest. Energy of
  /// the sheet and ½ (W u)ᵀ (C + 1 / κA)⁻¹ W u of what holds it, by Newton's method in load steps.
  /// @throws as in_load_steps; NotSolved where the gel's compliance is not definite
  Solution solve_large(const Sheet& sheet, ContractionMeasure measure, std::optional<double> adhesion_nN_per_um3) const;

  /// For sheets of any stiffness on adhesions of any stiffness, the equations of forces F = V a, V balanced:
  ///
  ///   (Vᵀ C V + Vᵀ A⁻¹ V / κ + Vᵀ W K₁⁻¹ Wᵀ V / M) a = Vᵀ W K₁⁻¹ f / M,   K₁ of a sheet with M = 1
  struct Reduced {
    MatrixXd gel, slip, sheet, pull;  ///< the last by load
  };
  /// @param forces_nN  V: by patch and component × any number  @param loads_nN  as of solve_all()
  Reduced reduced(const MatrixXd& forces_nN, double poisson_ratio, const MatrixXd& loads_nN) const;

  const std::vector<int>& triangles() const { return patches_.triangles; }  ///< by patch
  const std::vector<substrate::Ellipse>& patches() const { return patches_.ellipses; }
  const std::vector<double>& areas_um2() const { return patches_.areas_um2; }
  Held held() const { return held_; }
  /// Displacement of the gel under each patch.
  MatrixXd gel_um(const MatrixXd& forces_nN) const { return compliance_->displace(forces_nN); }

 private:
  VectorXd slip_um_per_nN(std::optional<double> adhesion_nN_per_um3) const;
  VectorXd spring_nN_per_um(const VectorXd& slip_um_per_nN) const;
  void add_springs(Stiffness& stiffness, const VectorXd& spring_nN_per_um) const;
  Patches patches_;
  int threads_;
  Held held_;
  std::unique_ptr<PatchCompliance> compliance_;
  std::vector<std::array<double, 6>> weights_;  ///< W
};

}  // namespace mbtfm::sheet
