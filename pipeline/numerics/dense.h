/// Products and factorisations of large dense matrices, by BLAS and LAPACK: several times quicker than Eigen's, which
/// is compiled here for any processor. Cut in pieces of fixed size, so that the bits are the same for any number of
/// threads.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>

namespace mbtfm {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
}  // namespace mbtfm

namespace mbtfm::numerics {

/// How the numbers of a factor are kept. `single_`: 7 digits, of which the condition of the matrix takes its share;
/// half the memory, nearly twice the speed.
enum class Precision { single_, double_ };
constexpr auto words(Precision) { return std::array{"single", "double"}; }

/// A B
MatrixXd product(const MatrixXd& A, const MatrixXd& B, int threads = 1);
/// Aᵀ B
MatrixXd transposed_product(const MatrixXd& A, const MatrixXd& B, int threads = 1);

/// square += factor Aᵀ A, on and above its diagonal.
/// @param square  n × n, A being k × n
void add_upper_gram(const MatrixXd& A, MatrixXd& square, int threads = 1, double factor = 1);
/// square += A Aᵀ, on and above its diagonal.
void add_upper_outer(const MatrixXd& A, MatrixXd& square, int threads = 1);
/// Aᵀ A, symmetric.
MatrixXd gram(const MatrixXd& A, int threads = 1);

/// Copy what is above the diagonal to below it, or the other way round.
void mirror_upper(MatrixXd& square);
void mirror_lower(MatrixXd& square);
void clear_below_diagonal(MatrixXd& square);

/// A = Uᵀ U with U upper triangular. Of A, what is below the diagonal neither counts nor changes.
/// @return whether A is positive definite; if not, its upper half is spoiled
bool upper_cholesky(MatrixXd& A, int threads = 1);

/// UᵀU − BᵀB = VᵀV: U becomes V, by one hyperbolic rotation for each of its rows and each of the few rows of B (Golub &
/// Van Loan, Matrix Computations, 4th ed., 6.5.4).
/// @return whether the difference is positive definite; if not, U is spoiled
bool downdate_upper(MatrixXd& U, MatrixXd B);

/// B = U B for the upper triangle U.
void multiply_upper(const MatrixXd& U, MatrixXd& B, int threads = 1);

/// U⁻¹ B and U⁻ᵀ B for the upper triangle U, in place.
void solve_upper(const MatrixXd& U, MatrixXd& B, int threads = 1);
void solve_upper_transposed(const MatrixXd& U, MatrixXd& B, int threads = 1);

/// A = V diag(values) Vᵀ of a symmetric A, by LAPACK's divide and conquer.
struct SymmetricEigen {
  VectorXd values;   ///< rising
  MatrixXd vectors;  ///< by column
};
/// @param A  what is below the diagonal does not count
SymmetricEigen symmetric_eigen(MatrixXd A);

// Eigen's own, for the small matrices of many places: compiled here once, since each place that names them costs
// seconds. small_product() and the like sum in Eigen's order, product() and the like in BLAS'.

using MatrixView = Eigen::Ref<const MatrixXd>;  ///< a matrix, or a block of one
using VectorView = Eigen::Ref<const VectorXd>;

/// A x and Aᵀ x.
VectorXd matvec(const MatrixView& A, const VectorView& x);
VectorXd transposed_matvec(const MatrixView& A, const VectorView& x);
/// c + A x and c − A x.
VectorXd plus_matvec(const VectorView& c, const MatrixView& A, const VectorView& x);
VectorXd minus_matvec(const VectorView& c, const MatrixView& A, const VectorView& x);
/// xᵀ S x with a square S.
double quadratic_form(const MatrixView& S, const VectorView& x);
/// The same of each column of X.
VectorXd quadratic_forms(const MatrixXd& S, const MatrixXd& X);

/// A B, Aᵀ B and factor A B.
MatrixXd small_product(const MatrixView& A, const MatrixView& B);
MatrixXd small_transposed_product(const MatrixView& A, const MatrixView& B);
MatrixXd small_product(double factor, const MatrixView& A, const MatrixView& B);
/// C + A B and C − A B.
MatrixXd plus_product(const MatrixView& C, const MatrixView& A, const MatrixView& B);
MatrixXd minus_product(const MatrixView& C, const MatrixView& A, const MatrixView& B);
/// A S Aᵀ with a square S.
MatrixXd congruence(const MatrixView& A, const MatrixView& S);
/// A diag(w) Aᵀ.
MatrixXd weighted_outer(const MatrixView& A, const VectorView& w);
/// diag(d) S diag(d).
MatrixXd scaled_on_both_sides(const MatrixView& S, const VectorView& d);

/// A = L Lᵀ, where rounding leaves A positive definite.
class SmallCholesky {
 public:
  explicit SmallCholesky(const MatrixView& A);
  bool is_definite() const;
  VectorXd solve(const VectorView& b) const;         ///< A⁻¹ b
  MatrixXd solve_matrix(const MatrixView& B) const;  ///< A⁻¹ B
  MatrixXd inverse() const;
  MatrixXd solve_lower(const MatrixView& B) const;  ///< L⁻¹ B
  VectorXd multiply(const VectorView& x) const;     ///< L (Lᵀ x)
  double log_determinant() const;
  MatrixXd upper() const;  ///< Lᵀ

 private:
  std::shared_ptr<const Eigen::LLT<MatrixXd>> llt_;
};

/// A⁻¹ of any regular A.
MatrixXd inverse(const MatrixView& A);
/// A^(−1/2) of a symmetric A, no eigenvalue counting as less than this one.
MatrixXd inverse_root(const MatrixView& A, double least);
/// Unit vectors at right angles to this one and to each other, by column: n × (n − 1).
MatrixXd across(const VectorView& vector);

/// X of A X = B with a symmetric A, semidefinite up to rounding, by LDLᵀ with pivots.
MatrixXd solve_symmetric(const MatrixXd& A, const MatrixXd& B);
/// A⁻¹, the same way.
MatrixXd inverse_symmetric(const MatrixXd& A);

/// The shortest X with the least |A X − B|, by rank.
MatrixXd shortest_solution(const MatrixXd& A, const MatrixXd& B);
/// A⁺, by rank.
MatrixXd pseudo_inverse(const MatrixXd& A);

/// Orthonormal columns that span those of A, by rank.
MatrixXd orthonormal_basis(const MatrixXd& A);
/// The left singular vectors of A whose values are more than this part of the largest, in falling order (LAPACK).
MatrixXd principal_directions(MatrixXd A, double least_part);

}  // namespace mbtfm::numerics
