#include "continuum/sheet/patch_compliance.h"

#include "continuum/sheet/lattice_compliance.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::sheet {
namespace {

class DenseCompliance final : public PatchCompliance {
 public:
  DenseCompliance(const Patches& patches, const substrate::Substrate& gel, int threads)
      : compliance_(gel.compliance_um_per_nN(patches.centres_um(), patches.ellipses)) {
    const auto near = neighbours_of(patches, [](double sizes) { return kMeanReach * sizes; });
    const std::vector<MatrixXd> columns = near_columns(patches, gel, near, threads);
    for (std::size_t j = 0; j < near.size(); ++j)
      for (std::size_t k = 0; k < near[j].size(); ++k)
        compliance_.block<2, 2>(2 * near[j][k], 2 * static_cast<Index>(j)) =
            columns[j].middleRows<2>(2 * static_cast<Index>(k));
    for (Index j = 0; j < compliance_.cols(); ++j)
      for (Index i = j; i < compliance_.rows(); ++i)
        compliance_(i, j) = compliance_(j, i) = 0.5 * (compliance_(i, j) + compliance_(j, i));
  }
  MatrixXd displace(const MatrixXd& forces_nN) const override {
    if (forces_nN.cols() == 1)  // half the memory read
      return compliance_.selfadjointView<Eigen::Lower>() * forces_nN.col(0);
    return numerics::product(compliance_, forces_nN, 1);
  }
  VectorXd diagonal_um_per_nN() const override { return compliance_.diagonal(); }
  MatrixXd matrix_um_per_nN() const override { return compliance_; }

 private:
  MatrixXd compliance_;
};

}  // namespace

MatrixXd PatchCompliance::matrix_um_per_nN() const {
  const Index n = diagonal_um_per_nN().size();
  return displace(MatrixXd::Identity(n, n));
}

Held held_for(int n_patches, const substrate::Capabilities& gel) {
  constexpr int kMostDense = 2000;
  return n_patches > kMostDense && substrate::is_alike_everywhere(gel) ? Held::lattice : Held::dense;
}

std::unique_ptr<PatchCompliance> compliance_of(const Patches& patches, const substrate::Substrate& gel, Held held,
                                               int threads) {
  if (held == Held::lattice) return std::make_unique<LatticeCompliance>(patches, gel, threads);
  return std::make_unique<DenseCompliance>(patches, gel, threads);
}

std::vector<MatrixXd> near_columns(const Patches& patches, const substrate::Substrate& gel,
                                   const std::vector<std::vector<int>>& near, int threads) {
  std::vector<MatrixXd> columns(near.size());
  numerics::parallel_for(patches.n(), threads, [&](int j) {
    const std::vector<int>& of = near[j];
    const auto n_points = [&](int i) {
      const double sizes = patches.size_um(i) + patches.size_um(j);
      return norm(patches.centre_um(i) - patches.centre_um(j)) < kMeanReach * sizes ? Elements::kPoints : 1;
    };
    std::vector<Vec2> points;
    for (const int i : of) {
      if (n_points(i) == 1) points.push_back(patches.centre_um(i));
      for (int p = 0; p < n_points(i) && n_points(i) > 1; ++p) points.push_back(patches.at(i, p).place_um);
    }
    const MatrixXd field = gel.compliance_um_per_nN(points, {patches.ellipses[j]});
    MatrixXd& column = columns[j];
    column.resize(2 * std::ssize(of), 2);
    Index row = 0, to = 0;
    for (const int i : of) {
      Eigen::Matrix2d mean = Eigen::Matrix2d::Zero();
      const int n = n_points(i);
      for (int p = 0; p < n; ++p, row += 2) mean += (n == 1 ? 1 : patches.share(i, p)) * field.middleRows<2>(row);
      column.middleRows<2>(to) = mean;
      to += 2;
    }
  });
  return columns;
}

}  // namespace mbtfm::sheet
