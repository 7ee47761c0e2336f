/// What a fit of tensions asks of a model of a contractile cell: from tensions to the forces on what holds the cell.
#pragma once

#include <Eigen/Core>
#include <concepts>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "pipeline/contract/report.h"

namespace mbtfm::network {

/// What the unseen part of a cell that the image cuts pulls with, through the cut.
struct CutReaction {
  Eigen::Vector2d force_nN{0, 0};
  double torque_nN_um = 0;  ///< about the origin
};

/// How sums of the adhesion forces answer to a cell that was segmented otherwise, the tensions held.
class GeometryAnswer {
 public:
  virtual ~GeometryAnswer() = default;
  /// @param move_um  of a point of that adhesion. @returns the change by sum
  virtual Eigen::VectorXd to_adhesion(int adhesion_id, const std::function<Vec2(Vec2 point_um)>& move_um) const = 0;
  /// Variance by sum, of ends that nothing holds and whose places along the fibre have this standard error.
  virtual Eigen::VectorXd variance_of_free_ends(const Eigen::VectorXd& tensions_nN, double error_um) const = 0;
};

/// A contractile cell in equilibrium under given tensions. Forces are those on the substrate, (fx, fy) of
/// adhesion_ids()[i] at 2i, 2i+1; in space (fx, fy, fz) at 3i to 3i+2.
class AtRest {
 public:
  virtual ~AtRest() = default;
  virtual const Report& report() const = 0;
  virtual double imbalance_nN() const = 0;  ///< what is left of all net forces, as if they were at random
  virtual Eigen::VectorXd forces_nN() const = 0;
  virtual Eigen::VectorXd network_part_nN() const = 0;  ///< of the forces: without the fibres
  virtual Eigen::VectorXd torques_nN_um() const = 0;    ///< by adhesion, about the origin
  /// Zero where there is no cut. Balances the forces: its derivatives are minus the sum of theirs.
  virtual CutReaction cut_reaction() const = 0;
  /// dR/dt: 2·adhesions × tensions.
  virtual Eigen::MatrixXd force_derivatives(int threads) const = 0;
  /// @param weights  2·adhesions × sums
  virtual std::unique_ptr<GeometryAnswer> answer_to_geometry(const Eigen::MatrixXd& weights) const = 0;
};

class Contractile {
 public:
  virtual ~Contractile() = default;
  /// Labels of the tensions: front() is 0, the network; then the fibres in rising order.
  virtual const std::vector<int>& fibre_ids() const = 0;
  /// Labels of the adhesions that hold the cell, in rising order.
  virtual const std::vector<int>& adhesion_ids() const = 0;
  virtual bool is_cut() const = 0;  ///< by the image's border, where something unseen holds it, too
  /// Not converged: the report says so, nothing is thrown. May be called from several threads at once.
  /// @param tensions_nN  by label, >= 0
  /// @param nearby  a cell of this model at rest to start from, or none
  /// @param force_tolerance  instead of the model's own, where rougher than usual will do
  /// @throws InvalidData where a tension is negative, not finite or missing
  virtual std::shared_ptr<const AtRest> at_rest(const Eigen::VectorXd& tensions_nN, const AtRest* nearby = nullptr,
                                                std::optional<double> force_tolerance = {}) const = 0;
};

/// One cell by several models that have the same labels, such as cables over several meshes. They are not owned.
class Ensemble {
 public:
  template <std::derived_from<Contractile> Model>
  Ensemble(const std::vector<Model>& models) {
    for (const Model& model : models) models_.push_back(&model);
  }
  std::size_t size() const { return models_.size(); }
  const Contractile& operator[](std::size_t i) const { return *models_[i]; }
  const Contractile& front() const { return *models_.front(); }

 private:
  std::vector<const Contractile*> models_;
};

}  // namespace mbtfm::network
