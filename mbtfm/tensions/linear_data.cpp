#include "mbtfm/tensions/linear_data.h"

#include <algorithm>
#include <cmath>

#include "mbtfm/inverse/rows.h"
#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::tensions {

namespace {

/// U with Uᵀ U = A, and how many of its pivots are more than rounding. What no bead feels gets a small stiffness: any
/// force there explains as much as another.
struct Root {
  MatrixXd U;
  Index n_felt = 0;
};

/// Of a normal matrix: what of its trace before anything was taken off it is rounding.
constexpr double kRounding = 1e-13;

/// @param trace  of the normal matrix before anything was taken off it: its rounding stays
Root root_of(MatrixXd A, double trace, int threads) {
  const VectorXd diagonal = A.diagonal();
  const double least = kRounding * std::max(trace, 1e-300);
  numerics::mirror_upper(A);  // Cholesky takes the upper half: the lower one keeps it for a second try
  bool is_definite = numerics::upper_cholesky(A, threads) && A.diagonal().cwiseAbs2().minCoeff() > least;
  double ridge = 0;
  while (!is_definite) {  // where motions explain nearly all, what they leave is off by the rounding of their inverse
    ridge = std::max(least, 10 * ridge);
    MBTFM_ASSERT(ridge <= 1e7 * least);
    numerics::mirror_lower(A);
    A.diagonal() = diagonal.array() + ridge;
    is_definite = numerics::upper_cholesky(A, threads);
  }
  const Index n_felt = (A.diagonal().array().square() > 4 * std::max(ridge, least)).count();
  numerics::clear_below_diagonal(A);
  return {std::move(A), n_felt};
}

/// The root of UᵀU − FFᵀ.
Root root_less(const MatrixXd& U, const MatrixXd& F, int threads) {
  const double trace = U.squaredNorm(), least = kRounding * std::max(trace, 1e-300);
  MatrixXd root = U;
  const bool is_definite = numerics::downdate_upper(root, F.transpose());
  if (is_definite && root.diagonal().cwiseAbs2().minCoeff() > 4 * least) return {std::move(root), U.cols()};
  root.setZero();
  numerics::add_upper_gram(U, root, threads);
  numerics::add_upper_gram(F.transpose(), root, threads, -1);
  return root_of(std::move(root), trace, threads);
}

/// (MᵀW²M + Λ)⁻¹, by rank. With Λ motions of different units go together: each counts as a multiple of itself.
/// @param square  MᵀW²M
MatrixXd inverse_of_motions(MatrixXd square, const VectorXd& precision) {
  if (square.cols() == 0) return square;
  if (precision.size() == 0) return numerics::pseudo_inverse(square);
  square.diagonal() += precision;
  const VectorXd size = square.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  square = numerics::scaled_on_both_sides(square, size);
  return numerics::scaled_on_both_sides(numerics::pseudo_inverse(square), size);
}

MatrixXd inverse_of_motions(const LinearData& data, const VectorXd& weight) {
  return inverse_of_motions(
      numerics::small_transposed_product(data.motions.shapes, weight.asDiagonal() * data.motions.shapes),
      data.motions.precision);
}

/// F with FFᵀ what these motions explain of a Gram matrix Gᵀ W² P G.
/// @param inverse  of their own square, Λ included
MatrixXd explained_by(const LinearData& data, const VectorXd& weight, const MatrixXd& motions,
                      const MatrixXd& inverse) {
  if (motions.cols() == 0) return MatrixXd(data.response->cols(), 0);
  const auto [values, vectors] = numerics::symmetric_eigen(inverse);
  const MatrixXd unit = numerics::small_product(motions, vectors * values.cwiseMax(0).cwiseSqrt().asDiagonal());
  return data.response->pull_back(weight.asDiagonal() * unit);
}

/// @param root  C
Explained explained(const LinearData& data, const VectorXd& weight, const MatrixXd& root, const VectorXd& u) {
  const VectorXd weighted = weight.cwiseProduct(less_motion(data, u));
  MatrixXd target = data.response->pull_back(weighted);
  numerics::solve_upper_transposed(root, target);
  return {.target = target, .floor_squared = std::max(0.0, weighted.dot(u) - target.squaredNorm())};
}

/// From C with Gᵀ W² P G = Cᵀ C, and y = C⁻ᵀ Gᵀ W² P u.
ReducedData reduced_by(const LinearData& data, const VectorXd& weight, Root C) {
  auto [target, floor_squared] = explained(data, weight, C.U, data.displacement_um);
  return {.compliance = std::make_shared<const MatrixXd>(std::move(C.U)),
          .target = std::move(target),
          .floor_squared = floor_squared,
          .n_components = data.n_used,
          .n_felt = C.n_felt,
          .is_upper = true,
          .dimension = data.dimension};
}

/// Motions that cost a component of the beads each, as nothing is known of their sizes.
Index n_unexpected(const Motions& motions) { return motions.shapes.cols() - (motions.precision.array() > 0).count(); }

}  // namespace

Vec3 place_of_bead(const LinearData& data, Index bead) {
  const auto& [x, y] = data.position_um[bead];
  return {x, y, data.height_um.empty() ? 0 : -data.height_um[bead]};
}

std::vector<Vec3> places_of_beads(const LinearData& data) {
  std::vector<Vec3> places_um;
  for (Index b = 0; b < std::ssize(data.position_um); ++b) places_um.push_back(place_of_bead(data, b));
  return places_um;
}

LinearData reduce(const DisplacementField& beads, MatrixXd compliance_um_per_nN, const std::vector<bool>& is_used) {
  return reduce(beads, substrate::dense_response(std::move(compliance_um_per_nN)), is_used);
}

LinearData reduce(const DisplacementField& beads, substrate::SharedResponse response, const std::vector<bool>& is_used,
                  int threads, MatrixXd motions) {
  const Index n_rows = 2 * static_cast<Index>(beads.size());
  MBTFM_ASSERT(response->rows() == n_rows);
  LinearData data;
  data.threads = threads;
  data.motions.shapes = std::move(motions);
  data.n_used = -data.motions.shapes.cols();
  data.has_errors = state_errors(beads);
  data.position_um = points_of(beads);
  data.displacement_um = inverse::components_of(beads);
  data.weight_per_um = VectorXd::Zero(n_rows);
  for (std::size_t i = 0; i < beads.size(); ++i) {
    if (!is_used.empty() && !is_used[i]) continue;
    data.weight_per_um.segment<2>(2 * static_cast<Index>(i)).setConstant(data.has_errors ? 1 / beads[i].sigma_um : 1);
    data.n_used += 2;
  }
  data.response = std::move(response);
  return reweighted(std::move(data), VectorXd::Ones(n_rows / 2));
}

Motions joined(Motions those, const Motions& these) {
  const Index n = those.shapes.cols(), n_more = these.shapes.cols();
  const auto join = [&](const MatrixXd& first, const MatrixXd& then) {  // by column; zero of those that have none
    MatrixXd both =
        MatrixXd::Zero(std::max(first.rows(), then.rows()), first.size() + then.size() > 0 ? n + n_more : 0);
    if (first.size() > 0) both.leftCols(n) = first;
    if (then.size() > 0) both.rightCols(n_more) = then;
    return both;
  };
  those.shapes = join(those.shapes, these.shapes);
  those.precision = join(those.precision.transpose(), these.precision.transpose()).transpose();
  those.forces = join(those.forces, these.forces);
  return those;
}

Motions joined_ahead(const Motions& those, Index n_last, const Motions& these) {
  const auto part = [&](Index first, Index count) {
    const auto columns = [&](const MatrixXd& of) -> MatrixXd {
      return of.size() > 0 ? MatrixXd(of.middleCols(first, count)) : of;
    };
    return Motions{.shapes = columns(those.shapes),
                   .precision = columns(those.precision.transpose()).transpose(),
                   .forces = columns(those.forces)};
  };
  const Index n_first = those.shapes.cols() - n_last;
  return joined(joined(part(0, n_first), these), part(n_first, n_last));
}

LinearData with_motions(LinearData data, Motions motions) {
  MBTFM_ASSERT(motions.precision.size() == 0 || motions.precision.size() == motions.shapes.cols());
  data.n_used += n_unexpected(data.motions) - n_unexpected(motions);
  data.motions = std::move(motions);
  const VectorXd as_they_are = data.bead_weight;
  return reweighted(std::move(data), as_they_are);
}

LinearData with_more_motions(LinearData data, const MatrixXd& motions) {
  const VectorXd weight = squared_weights(data);
  const MatrixXd beside = less_motion(data, motions);
  Root root = root_less(
      *data.reduced.compliance,
      explained_by(data, weight, beside,
                   inverse_of_motions(numerics::small_transposed_product(motions, weight.asDiagonal() * beside), {})),
      data.threads);
  data.n_used -= motions.cols();
  data.motions = joined(std::move(data.motions), {.shapes = motions});
  data.motions.inverse = inverse_of_motions(data, weight);
  data.reduced = reduced_by(data, weight, std::move(root));
  return data;
}

MatrixXd motion_in(const LinearData& data, const MatrixXd& displacements) {
  const MatrixXd weighted = squared_weights(data).asDiagonal() * data.motions.shapes;
  return numerics::small_product(data.motions.inverse, numerics::small_transposed_product(weighted, displacements));
}

std::optional<OwnForces> own_forces_in(const LinearData& data) {
  const MatrixXd& E = data.motions.forces;
  if (E.size() == 0) return std::nullopt;
  const MatrixXd weighted = squared_weights(data).asDiagonal() * data.motions.shapes;
  const MatrixXd gain = numerics::small_product(E, data.motions.inverse);
  return OwnForces{.left = numerics::minus_product(MatrixXd::Identity(E.rows(), E.rows()), gain,
                                                   data.response->pull_back(weighted).transpose()),
                   .found_nN = numerics::matvec(gain, numerics::transposed_matvec(weighted, data.displacement_um)),
                   .covariance = numerics::small_product(gain, E.transpose())};
}

MatrixXd less_motion(const LinearData& data, MatrixXd displacements) {
  if (data.motions.shapes.cols() > 0)
    displacements -= numerics::small_product(data.motions.shapes, motion_in(data, displacements));
  return displacements;
}

VectorXd residual_um(const LinearData& data, const VectorXd& forces_nN) {
  return less_motion(data, data.displacement_um - data.response->displace(forces_nN));
}

VectorXd evened_residual_um(const LinearData& data, const VectorXd& forces_nN) {
  VectorXd residual = residual_um(data, forces_nN);
  for (Index row = 0; row < residual.size(); ++row)
    if (const Index along_x = row - row % data.dimension; is_used(data, row / data.dimension))
      residual[row] *= data.weight_per_um[row] / data.weight_per_um[along_x];
  return residual;
}

bool is_used(const LinearData& data, Index bead) { return data.weight_per_um[data.dimension * bead] > 0; }

LinearData reweighted(LinearData data, const VectorXd& bead_weight) {
  data.bead_weight = bead_weight;
  data.reduced.compliance.reset();  // not two of them in memory
  const VectorXd weight = squared_weights(data);
  data.motions.inverse = inverse_of_motions(data, weight);
  MatrixXd A = data.response->upper_gram(weight);
  const double trace = A.diagonal().sum();
  numerics::add_upper_gram(explained_by(data, weight, data.motions.shapes, data.motions.inverse).transpose(), A,
                           data.threads, -1);
  data.reduced = reduced_by(data, weight, root_of(std::move(A), trace, data.threads));
  return data;
}

LinearData unweighted(LinearData data) {
  const VectorXd ones = VectorXd::Ones(data.bead_weight.size());
  if (data.bead_weight == ones) return data;
  return reweighted(std::move(data), ones);
}

LinearData with_response(LinearData data, substrate::SharedResponse response) {
  data.response = std::move(response);
  const Index n_beads = data.bead_weight.size();
  return reweighted(std::move(data), VectorXd::Ones(n_beads));
}

LinearData about_forces(LinearData data, substrate::SharedResponse response, const VectorXd& measured_um,
                        VectorXd offset_um) {
  data.displacement_um = measured_um - offset_um;
  data.offset_um = std::move(offset_um);
  return with_response(std::move(data), std::move(response));
}

VectorXd moved_by(const LinearData& data, const VectorXd& forces_nN) {
  VectorXd moved = data.response->displace(forces_nN);
  if (data.offset_um.size() > 0) moved += data.offset_um;
  return moved;
}

MatrixXd displace(const ReducedData& data, const MatrixXd& forces_nN, int threads) {
  if (!data.is_upper) return numerics::product(*data.compliance, forces_nN, threads);
  MatrixXd displaced = forces_nN;
  numerics::multiply_upper(*data.compliance, displaced, threads);
  return displaced;
}

VectorXd squared_weights(const LinearData& data) {
  VectorXd weight = data.weight_per_um.cwiseAbs2();
  const Index each = data.dimension;
  for (Index b = 0; b < data.bead_weight.size(); ++b) weight.segment(each * b, each) *= data.bead_weight[b];
  return weight;
}

VectorXd free_forces_nN(const ReducedData& reduced) {
  MatrixXd forces = reduced.target;
  numerics::solve_upper(*reduced.compliance, forces);
  return forces;
}

MatrixXd solve_normal(const ReducedData& reduced, MatrixXd X) {
  numerics::solve_upper_transposed(*reduced.compliance, X);
  numerics::solve_upper(*reduced.compliance, X);
  return X;
}

BeadAnswers::BeadAnswers(const LinearData& data, MatrixXd by_force) : data_(data), by_force_(std::move(by_force)) {
  MBTFM_ASSERT(by_force_.cols() == data.response->cols());
}

void BeadAnswers::for_each_block(const std::function<void(Index, const MatrixXd&)>& body) const {
  constexpr Index kNumbers = 16'000'000;  // of a block: 128 MB
  const Index at_once = std::max<Index>(1, kNumbers / std::max<Index>(1, data_.response->rows()));
  const VectorXd weight = squared_weights(data_);
  for (Index first = 0; first < n_rows(); first += at_once) {
    const Index count = std::min(at_once, n_rows() - first);
    const MatrixXd forces = by_force_.middleRows(first, count).transpose();
    body(first, less_motion(data_, data_.response->displace(forces)).transpose() * weight.asDiagonal());
  }
}

VectorXd weighted_residual(const LinearData& data, const VectorXd& forces_nN) {
  return data.weight_per_um.cwiseProduct(residual_um(data, forces_nN));
}

double total_nN(const VectorXd& forces_nN, Index dimension) {
  double sum = 0;
  for (Index row = 0; row < forces_nN.size(); row += dimension) sum += forces_nN.segment(row, dimension).norm();
  return sum;
}

Explained explained(const LinearData& data, const VectorXd& displacement_um) {
  return explained(data, squared_weights(data), *data.reduced.compliance, displacement_um);
}

double noise_variance(const LinearData& data) {
  const auto n_free = static_cast<double>(std::max<Index>(1, data.n_used - data.reduced.n_felt));
  return std::max(data.has_errors ? 1.0 : 1e-300, data.reduced.floor_squared / n_free);
}

ModelScore score_of(const std::string& name, Index n_parameters, double chi_squared, double relative_l2,
                    const LinearData& data) {
  const auto k = static_cast<double>(n_parameters);
  return {.name = name,
          .n_parameters = static_cast<int>(n_parameters),
          .chi_squared = chi_squared,
          .relative_l2 = relative_l2,
          .aic = chi_squared + 2 * k,
          .bic = chi_squared + k * std::log(static_cast<double>(data.n_used))};
}

double relative_l2(const LinearData& data, const VectorXd& forces_nN) {
  const VectorXd is_used = data.weight_per_um.unaryExpr([](double w) { return w > 0 ? 1.0 : 0.0; });
  const VectorXd residual = residual_um(data, forces_nN);
  const double scale = is_used.cwiseProduct(moved_by(data, forces_nN) + residual).norm();  // u less the motion
  const double misfit = is_used.cwiseProduct(residual).norm();
  return scale > 0 ? misfit / scale : misfit;
}

}  // namespace mbtfm::tensions
