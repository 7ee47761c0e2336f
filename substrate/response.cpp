#include "substrate/response.h"

#include <algorithm>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::substrate {
namespace {

class Dense final : public KeptResponse {
 public:
  Dense(MatrixXd compliance_um_per_nN, int threads) : matrix_(std::move(compliance_um_per_nN)), threads_(threads) {}

  Index rows() const override { return matrix_.rows(); }
  Index cols() const override { return matrix_.cols(); }
  MatrixXd matrix() const override { return matrix_; }
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

class Lazy final : public Response {
 public:
  explicit Lazy(Answers answers) : answers_(std::move(answers)) {}

  Index rows() const override { return answers_.rows; }
  Index cols() const override { return answers_.cols; }
  MatrixXd matrix() const override {
    return answers_.matrix ? answers_.matrix() : answers_.displace(MatrixXd::Identity(cols(), cols()));
  }
  MatrixXd displace(const MatrixXd& forces_nN) const override {
    MBTFM_ASSERT(forces_nN.rows() == cols());
    return answers_.displace ? answers_.displace(forces_nN) : MatrixXd(matrix() * forces_nN);
  }
  MatrixXd pull_back(const MatrixXd& displacements) const override {
    MBTFM_ASSERT(displacements.rows() == rows());
    return matrix().transpose() * displacements;
  }
  SharedResponse kept() const override { return answers_.kept ? answers_.kept() : dense_response(matrix()); }
  Tangent about(const VectorXd& forces_nN) const override {
    return answers_.about ? answers_.about(forces_nN) : Response::about(forces_nN);
  }

 private:
  Answers answers_;
};

/// x, y and z by point.
MatrixXd interleaved(const MatrixXd& along, const MatrixXd& normal) {
  MatrixXd all(along.rows() + normal.rows(), along.cols());
  for (Index i = 0; i < normal.rows(); ++i) {
    all.middleRows(3 * i, 2) = along.middleRows(2 * i, 2);
    all.row(3 * i + 2) = normal.row(i);
  }
  return all;
}

/// The points, so many at a time: some MB of matrix.
MatrixXd displaced(const MatrixAt& matrix_at, const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses,
                   const MatrixXd& forces_nN) {
  constexpr std::size_t kBlock = 2048;
  MatrixXd displacements(2 * static_cast<Index>(points_um.size()), forces_nN.cols());
  for (std::size_t begin = 0; begin < points_um.size(); begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, points_um.size());
    const std::vector<Vec2> block(points_um.begin() + static_cast<std::ptrdiff_t>(begin),
                                  points_um.begin() + static_cast<std::ptrdiff_t>(end));
    displacements.middleRows(2 * static_cast<Index>(begin), 2 * static_cast<Index>(block.size())) =
        matrix_at(block, ellipses) * forces_nN;
  }
  return displacements;
}

}  // namespace

MatrixXd KeptResponse::matrix() const { return displace(MatrixXd::Identity(cols(), cols())); }

SharedResponse dense_response(MatrixXd compliance_um_per_nN, int threads) {
  return std::make_shared<Dense>(std::move(compliance_um_per_nN), threads);
}

LazyResponse lazy_response(Answers answers) { return std::make_shared<Lazy>(std::move(answers)); }

LazyResponse joined(LazyResponse along, LazyResponse normal) {
  return lazy_response({.rows = along->rows() + normal->rows(),
                        .cols = along->cols(),
                        .matrix = [=] { return interleaved(along->matrix(), normal->matrix()); },
                        .displace =
                            [=](const MatrixXd& forces_nN) {
                              return interleaved(along->displace(forces_nN), normal->displace(forces_nN));
                            }});
}

LazyResponse pointwise_response(MatrixAt matrix_at, const std::vector<Vec2>& points_um,
                                const std::vector<Ellipse>& ellipses, int threads) {
  constexpr double kLargestDense = 5e7;  // numbers: 0.4 GB
  const double numbers = 4.0 * static_cast<double>(points_um.size()) * static_cast<double>(ellipses.size());
  const bool is_large = numbers > kLargestDense;
  const auto kept = [=] {
    if (is_large) return blocked_response(matrix_at, points_um, ellipses, threads);
    return dense_response(matrix_at(points_um, ellipses), threads);
  };
  return lazy_response({.rows = 2 * static_cast<Index>(points_um.size()),
                        .cols = 2 * static_cast<Index>(ellipses.size()),
                        .matrix = [=] { return matrix_at(points_um, ellipses); },
                        .displace =
                            [=](const MatrixXd& forces_nN) {
                              return is_large ? kept()->displace(forces_nN)
                                              : displaced(matrix_at, points_um, ellipses, forces_nN);
                            },
                        .kept = kept});
}

}  // namespace mbtfm::substrate
