#include "mbtfm/sheets/stiffness_table.h"

#include <cmath>
#include <numbers>

#include "pipeline/numerics/parallel.h"

namespace mbtfm::sheets {
namespace {

constexpr double kSoftest = 0.03, kStiffest = 300;  // M / (mu R)

}  // namespace

StiffnessTable::StiffnessTable(const SheetShape& shape, const sheet::OnGel& ground, const Gel& gel, double size_um,
                               int threads)
    : n_contractions_(static_cast<int>(shape.contractions.size())),
      n_loads_(n_contractions_ + (shape.has_line ? 1 : 0)) {
  scale_nN_per_um_ = gel.youngs_modulus_kPa / (2 * (1 + gel.poisson_ratio)) * size_um;
  low_ = std::log(kSoftest * scale_nN_per_um_);
  high_ = std::log(kStiffest * scale_nN_per_um_);
  sheet::Sheet unit;
  unit.n_rims = shape.n_rims;
  std::vector<sheet::NodeVectors> loads;
  for (const std::vector<double>& contraction : shape.contractions) {
    unit.contraction_nN_per_um = contraction;
    loads.push_back(sheet::forces_of_contraction_nN(*shape.elements, unit));
  }
  if (shape.has_line) {
    unit.contraction_nN_per_um = sheet::even(*shape.elements, 0);
    unit.line_tension_nN = 1;
    loads.push_back(sheet::forces_of_contraction_nN(*shape.elements, unit));
  }
  forces_nN_.resize(2 * std::ssize(ground.patches()), kNodes * n_loads_);
  for (int k = 0; k < kNodes; ++k)
    nodes_.push_back(0.5 * (low_ + high_) - 0.5 * (high_ - low_) * std::cos((k + 0.5) * std::numbers::pi / kNodes));
  numerics::parallel_for(kNodes * n_loads_, threads, [&](int j) {
    const double M = std::exp(nodes_[static_cast<std::size_t>(j / n_loads_)]);
    const double nu = shape.poisson_ratio;
    const sheet::Material material{M * (1 - nu * nu) / shape.thickness_um, nu, shape.thickness_um};
    forces_nN_.col(j) =
        (1 + M / scale_nN_per_um_) * ground.solve(material, loads[static_cast<std::size_t>(j % n_loads_)]).forces_nN;
  });
}

double StiffnessTable::softest_nN_per_um() const { return std::exp(low_); }
double StiffnessTable::stiffest_nN_per_um() const { return std::exp(high_); }

/// Lagrange's polynomials of Chebyshev's nodes, by the barycentric formula (Berrut & Trefethen, SIAM Rev. 46 (2004)
/// 501).
Eigen::VectorXd StiffnessTable::basis(double log_stiffness) const {
  Eigen::VectorXd weights(kNodes);
  for (int k = 0; k < kNodes; ++k) {
    const double off = log_stiffness - nodes_[static_cast<std::size_t>(k)];
    if (off == 0) return Eigen::VectorXd::Unit(kNodes, k);
    weights(k) = (k % 2 == 0 ? 1 : -1) * std::sin((k + 0.5) * std::numbers::pi / kNodes) / off;
  }
  return weights / weights.sum();
}

Eigen::MatrixXd StiffnessTable::shares(double stiffness_nN_per_um) const {
  const Eigen::VectorXd weights = basis(std::log(stiffness_nN_per_um)) / (1 + stiffness_nN_per_um / scale_nN_per_um_);
  Eigen::MatrixXd shares = Eigen::MatrixXd::Zero(kNodes * n_loads_, n_loads_);
  for (int k = 0; k < kNodes; ++k)
    for (int load = 0; load < n_loads_; ++load) shares(k * n_loads_ + load, load) = weights(k);
  return shares;
}

}  // namespace mbtfm::sheets
