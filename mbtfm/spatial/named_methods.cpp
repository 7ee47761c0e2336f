/// Methods of others, on the same gel and the same beads, to be compared with.
#include <algorithm>
#include <cmath>

#include "mbtfm/spatial/problem.h"
#include "mbtfm/spatial/reconstruction.h"
#include "mbtfm/spatial/traction_mesh.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/report.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::spatial {

namespace {

/// |W (u − A x)|² + lambda² |x|², of which tikhonov found the minimum.
struct Functional {
  MatrixXd response;  ///< W A
  VectorXd data;      ///< W u
  double lambda2 = 0;

  VectorXd half_slope(const VectorXd& x) const {
    return lambda2 * x - numerics::transposed_matvec(response, numerics::minus_matvec(data, response, x));
  }
};

Functional functional_of(const Problem& problem, const Basis& basis, const SpatialReconstruction& r, int threads) {
  const Rows rows(problem, r.weighing.by_row);
  return {rows.of(basis.response(problem.response_um_per_kPa, threads)), rows.of(problem.displacement_um()),
          *r.lambda * *r.lambda};
}

/// The displacement of the beads around a vertex, by the inverse of their distance.
Eigen::Vector3d interpolated_um(const Problem& problem, const numerics::Near& beads, const Vec3& at) {
  constexpr int kNearest = 4;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = 0;
  for (const int b : beads.nearest(at, kNearest)) {
    const double weight = 1 / std::max(norm(beads.points()[b] - at), 1e-6);
    sum += weight * problem.observed.displacement_um.segment<3>(3 * b);
    weights += weight;
  }
  return sum / weights;
}

}  // namespace

SpatialReconstruction reconstruct_adjoint(const Problem& problem, const tractions::TractionParameters& traction,
                                          const SpatialParameters& parameters, int threads) {
  SpatialReconstruction r = reconstruct_tikhonov(problem, traction, parameters, threads);
  if (!r.lambda) return r;
  const Basis basis = orthonormal_basis(problem.norm_um2());
  const Functional f = functional_of(problem, basis, r, threads);
  constexpr double kSettled = 1e-12;
  constexpr int kMost = 20000;
  VectorXd x = VectorXd::Zero(f.response.cols()), downhill = -f.half_slope(x), step = downhill;
  const double first = downhill.squaredNorm();
  double square = first;
  int iterations = 0;
  for (; iterations < kMost && square > kSettled * kSettled * first; ++iterations) {
    const VectorXd moved =
        numerics::transposed_matvec(f.response, numerics::matvec(f.response, step)) + f.lambda2 * step;
    const double length = square / step.dot(moved);
    x += length * step;
    downhill -= length * moved;
    const double next = downhill.squaredNorm();
    step = downhill + next / square * step;
    square = next;
  }
  if (iterations == kMost)
    throw NotSolved({.reason = "adjoint: the equations are not solved after " + std::to_string(kMost) + " steps"});
  r.traction_kPa = basis.tractions(x);
  r.figures.emplace_back("adjoint_solves", std::int64_t{2 * iterations});
  return r;
}

SpatialReconstruction reconstruct_thesis_cg(const Problem& problem, const tractions::TractionParameters& traction,
                                            const SpatialParameters& parameters, int threads) {
  SpatialReconstruction r = reconstruct_tikhonov(problem, traction, parameters, threads);
  if (!r.lambda) return r;
  const Basis basis = orthonormal_basis(problem.norm_um2());
  const Functional f = functional_of(problem, basis, r, threads);
  constexpr double kSettled = 1e-6;                // of the slope
  constexpr int kMost = 5000, kSolvesOfLine = 10;  // Numerical Recipes' bracket and parabolas take about so many
  VectorXd x = VectorXd::Zero(f.response.cols());
  // the differences of a sum of squares: of each unknown by a step e, [T(x + e) − T(x − e)] / 2e, is the slope itself
  VectorXd downhill = -2 * f.half_slope(x), step = downhill;
  const double first = downhill.norm();
  int steps = 0;
  for (; steps < kMost && downhill.norm() > kSettled * first; ++steps) {
    const VectorXd moved = numerics::matvec(f.response, step);
    const double length = 0.5 * downhill.dot(step) / (moved.squaredNorm() + f.lambda2 * step.squaredNorm());
    x += length * step;
    const VectorXd next = -2 * f.half_slope(x);
    step = next + next.squaredNorm() / downhill.squaredNorm() * step;  // Fletcher & Reeves
    downhill = next;
  }
  r.traction_kPa = basis.tractions(x);
  r.figures.emplace_back("thesis_steps", std::int64_t{steps});
  r.figures.emplace_back("thesis_direct_solves", std::int64_t{steps} * (f.response.cols() + 1 + kSolvesOfLine));
  r.remark = "the thesis' program would solve the gel " +
             std::to_string(std::int64_t{steps} * (f.response.cols() + 1 + kSolvesOfLine)) + " times for this";
  return r;
}

SpatialReconstruction reconstruct_direct(const Problem& problem, int threads) {
  if (problem.observed.n_components() != 3) throw UsageError("direct: displacement along z is missing");
  SpatialReconstruction r;
  const std::vector<Vec3> vertices = problem.vertices_um();
  const numerics::Near beads = near_beads(problem.observed);
  VectorXd imposed(problem.n_unknowns());
  for (std::size_t v = 0; v < vertices.size(); ++v)
    imposed.segment<3>(3 * static_cast<Index>(v)) = interpolated_um(problem, beads, vertices[v]);
  // by normal equations: the compliance of the surface is symmetric but for the lattice
  MatrixXd normal = numerics::gram(problem.surface_um_per_kPa, threads);
  MatrixXd right = numerics::transposed_matvec(problem.surface_um_per_kPa, imposed);
  normal.diagonal().array() += 1e-12 * normal.diagonal().maxCoeff();  // rounding
  if (!numerics::upper_cholesky(normal, threads))
    throw NotSolved({.reason = "direct: tractions do not follow from the displacement of the surface"});
  numerics::solve_upper_transposed(normal, right);
  numerics::solve_upper(normal, right);
  r.traction_kPa = right.col(0);
  const VectorXd even = VectorXd::Ones(problem.observed.displacement_um.size());
  const VectorXd residual = problem.residual(r.traction_kPa, even);
  r.weighing = weigh(BeadLoss::l2, problem.observed, residual, 0);
  const VectorXd of_nothing = problem.residual(VectorXd::Zero(problem.n_unknowns()), even);
  r.relative_l2 = residual.norm() / std::max(of_nothing.norm(), 1e-300);
  r.remark = "direct imposes the noise of the beads with their displacement: no map to be believed";
  return r;
}

SpatialReconstruction reconstruct_green(const Problem& problem, const tractions::TractionParameters& traction,
                                        const SpatialParameters& parameters, int threads) {
  const auto& faces = problem.mesh.quads.faces;
  const auto n_faces = static_cast<Index>(faces.size());
  MBTFM_ASSERT(problem.facet_response_um_per_kPa.cols() == 3 * n_faces);
  // for people, the traction of a vertex is the mean over its facets; |x|² the sum of squares times area
  VectorXd roots(n_faces), n_at = VectorXd::Zero(problem.mesh.n_vertices());
  MatrixXd shapes = MatrixXd::Zero(problem.mesh.n_vertices(), n_faces);
  for (Index f = 0; f < n_faces; ++f) {
    const Leaf& leaf = problem.mesh.leaves[f];
    const Vec2 size = problem.mesh.size_um(leaf), middle = problem.mesh.low_corner_um(leaf) + 0.5 * size;
    roots[f] = problem.expected.amplitude(middle) / std::sqrt(size.x * size.y * problem.ground.stretch(middle));
    for (const int v : faces[f]) {
      if (v >= problem.mesh.n_vertices()) continue;  // it hangs
      shapes(v, f) = 1;
      n_at[v] += 1;
    }
  }
  shapes = n_at.cwiseInverse().asDiagonal() * shapes * roots.asDiagonal();
  MatrixXd response(problem.facet_response_um_per_kPa.rows(), 3 * n_faces);
  for (Index c = 0; c < 3; ++c) {
    for (Index f = 0; f < n_faces; ++f)
      response.col(c * n_faces + f) = roots[f] * problem.facet_response_um_per_kPa.col(3 * f + c);
  }
  return reconstruct_in(Basis(std::move(shapes)), response, problem, traction, parameters, threads);
}

}  // namespace mbtfm::spatial
