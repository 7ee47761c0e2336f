/// Cables in equilibrium, as a fit of tensions sees them.
#pragma once

#include <memory>
#include <vector>

#include "network/cables/cables.h"

namespace mbtfm::cables {

class CablesAtRest final : public network::AtRest {
 public:
  CablesAtRest(CableNetwork cables, std::vector<double> tensions_nN, Equilibrium equilibrium);
  const Equilibrium& equilibrium() const { return equilibrium_; }

  const Report& report() const override;
  double imbalance_nN() const override;
  Eigen::VectorXd forces_nN() const override;
  Eigen::VectorXd network_part_nN() const override;
  Eigen::VectorXd torques_nN_um() const override;
  network::CutReaction cut_reaction() const override;
  Eigen::MatrixXd force_derivatives(int threads) const override;
  std::unique_ptr<network::GeometryAnswer> answer_to_geometry(const Eigen::MatrixXd& weights) const override;

 private:
  CableNetwork cables_;
  std::vector<double> tensions_nN_;
  Equilibrium equilibrium_;
};

}  // namespace mbtfm::cables
