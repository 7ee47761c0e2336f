/// Products and factors of large upper triangles, with a third of the arithmetic that full matrices would take. Cut in
/// pieces of fixed size, so that the bits are the same for any number of threads.
#pragma once

#include <Eigen/Core>
#include <functional>

namespace mbtfm::numerics {

/// square += U diag(weight) Uᵀ, on and above its diagonal. What is below the diagonal of the square is spoiled.
void add_triangle_outer(const Eigen::MatrixXd& U, const Eigen::VectorXd& weight, Eigen::MatrixXd& square,
                        int threads = 1);

/// A = R Rᵀ with R upper triangular, in place. Of A what is below the diagonal does not count.
/// @return whether A is positive definite; if not, it is spoiled
bool upper_root(Eigen::MatrixXd& A, int threads = 1);

/// R becomes the upper triangle R⁻¹ U, zero below its diagonal.
void divide_into(const Eigen::MatrixXd& U, Eigen::MatrixXd& R, int threads = 1);

/// Calls body(first, block) with the columns first, first + 1, … of UᵀU, one block of columns after the other: each
/// down to its last diagonal entry alone.
void for_each_gram_block(const Eigen::MatrixXd& U, int threads,
                         const std::function<void(Eigen::Index first, const Eigen::MatrixXd& block)>& body);

}  // namespace mbtfm::numerics
