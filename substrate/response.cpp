#include "substrate/response.h"

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::substrate {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

class Dense final : public Response {
 public:
  Dense(MatrixXd compliance_um_per_nN, int threads) : matrix_(std::move(compliance_um_per_nN)), threads_(threads) {}

  Index rows() const override { return matrix_.rows(); }
  Index cols() const override { return matrix_.cols(); }
  MatrixXd displace(const MatrixXd& forces_nN) const override {
    return forces_nN.cols() == 1 ? MatrixXd(matrix_ * forces_nN) : numerics::product(matrix_, forces_nN, threads_);
  }
  MatrixXd pull_back(const MatrixXd& displacements) const override {
    return displacements.cols() == 1 ? MatrixXd(matrix_.transpose() * displacements)
                                     : numerics::transposed_product(matrix_, displacements, threads_);
  }
  MatrixXd upper_gram(const VectorXd& weight) const override {
    MatrixXd square = MatrixXd::Zero(cols(), cols());
    numerics::add_upper_gram(weight.cwiseSqrt().asDiagonal() * matrix_, square, threads_);
    return square;
  }
  SharedResponse at_points(const std::vector<Index>& points) const override {
    std::vector<Index> rows;
    for (const Index p : points) rows.insert(rows.end(), {2 * p, 2 * p + 1});
    return dense_response(matrix_(rows, Eigen::all), threads_);
  }

 private:
  MatrixXd matrix_;
  int threads_;
};

}  // namespace

SharedResponse dense_response(MatrixXd compliance_um_per_nN, int threads) {
  return std::make_shared<Dense>(std::move(compliance_um_per_nN), threads);
}

bool is_large(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses) {
  constexpr double kLargestDense = 5e7;  // numbers: 0.4 GB
  return 4.0 * static_cast<double>(points_um.size()) * static_cast<double>(ellipses.size()) > kLargestDense;
}

SharedResponse pointwise_response(const Substrate& model, const std::vector<Vec2>& points_um,
                                  const std::vector<Ellipse>& ellipses, int threads) {
  if (is_large(points_um, ellipses)) return blocked_response(model, points_um, ellipses, threads);
  return dense_response(model.compliance_um_per_nN(points_um, ellipses), threads);
}

}  // namespace mbtfm::substrate
