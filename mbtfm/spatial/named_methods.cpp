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

/// The minimum of |P W S (u − G L x)|² + lambda² |x|², which tikhonov found, by conjugate gradients. With exact steps
/// along lines Fletcher and Reeves' are the same (Nocedal & Wright, Numerical Optimization, 2006, 5.2).
struct Descent {
  VectorXd x;
  int steps = 0;
  bool is_settled = false;
};
/// @param settled  of the slope at none
Descent descend(const Problem& problem, const Basis& basis, const SpatialReconstruction& tikhonov, double settled,
                int most, int threads) {
  const inverse::Rows rows = rows_of(problem, tikhonov.weighing.by_row);
  const MatrixXd A = rows.of(basis.response(problem.response_um_per_kPa, threads));
  const double lambda2 = *tikhonov.lambda * *tikhonov.lambda;
  VectorXd downhill = numerics::transposed_matvec(A, rows.of(problem.displacement_um())), step = downhill;
  Descent found{.x = VectorXd::Zero(A.cols())};
  double square = downhill.squaredNorm();
  for (const double enough = settled * settled * square; found.steps < most && square > enough; ++found.steps) {
    const VectorXd moved = numerics::transposed_matvec(A, numerics::matvec(A, step)) + lambda2 * step;
    const double length = square / step.dot(moved);
    found.x += length * step;
    downhill -= length * moved;
    const double next = downhill.squaredNorm();
    step = downhill + next / square * step;
    square = next;
  }
  found.is_settled = found.steps < most;
  return found;
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
  constexpr int kMost = 20000;
  const Descent found = descend(problem, basis, r, 1e-12, kMost, threads);
  if (!found.is_settled)
    throw NotSolved({.reason = "adjoint: the equations are not solved after " + std::to_string(kMost) + " steps"});
  r.traction_kPa = basis.tractions(found.x);
  r.figures.emplace_back("adjoint_solves", std::int64_t{2 * found.steps});
  return r;
}

SpatialReconstruction reconstruct_thesis_cg(const Problem& problem, const tractions::TractionParameters& traction,
                                            const SpatialParameters& parameters, int threads) {
  SpatialReconstruction r = reconstruct_tikhonov(problem, traction, parameters, threads);
  if (!r.lambda) return r;
  const Basis basis = orthonormal_basis(problem.norm_um2());
  constexpr int kMost = 5000, kSolvesOfLine = 10;  // Numerical Recipes' bracket and parabolas take about so many
  const Descent found = descend(problem, basis, r, 1e-6, kMost, threads);
  r.traction_kPa = basis.tractions(found.x);
  // of each unknown by a step e, [T(x + e) − T(x − e)] / 2e: of a sum of squares that is the slope itself
  const std::int64_t n_solves = std::int64_t{found.steps} * (found.x.size() + 1 + kSolvesOfLine);
  r.figures.emplace_back("thesis_steps", std::int64_t{found.steps});
  r.figures.emplace_back("thesis_direct_solves", n_solves);
  r.remark = "the thesis' program would solve the gel " + std::to_string(n_solves) + " times for this";
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
