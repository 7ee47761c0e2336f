#include "mbtfm/spatial/repeated.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/report.h"
#include "pipeline/numerics/dense.h"
#include "substrate/choice/factory.h"
#include "substrate/choice/large_strain.h"

namespace mbtfm::spatial {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// Mean over the corners of a face.
std::vector<double> sizes_of(const Problem& problem, const SpatialReconstruction& r) {
  std::vector<double> sizes(problem.mesh.leaves.size(), 0);
  for (std::size_t f = 0; f < sizes.size(); ++f) {
    for (const int corner : problem.mesh.quads.faces[f]) {
      Vector3d t = Vector3d::Zero();
      for (const auto& [vertex, share] : shares_of(problem.mesh, corner))
        t += share * r.traction_kPa.segment<3>(3 * Index{vertex});
      sizes[f] += t.norm() / 4;
    }
  }
  return sizes;
}

/// By vertex: whether its tractions are more than noise, and its spot is seen.
std::vector<bool> is_resolved(const SpatialReconstruction& r) {
  constexpr double kSides = 2;       // on which faces show a change at all (Nyquist)
  constexpr double kSquares = 11.3;  // of three standard normal numbers, once in a hundred times
  std::vector<bool> is_resolved;
  for (Index v = 0; v < r.resolved.size(); ++v) {
    const Vector3d t = r.traction_kPa.segment<3>(3 * v);
    const Matrix3d C = r.covariance_kPa2.block<3, 3>(3 * v, 3 * v);
    is_resolved.push_back(r.resolved[v] * kSides * kSides >= 1 &&
                          t.dot(Vector3d(numerics::solve_symmetric(C, t))) > kSquares);
  }
  return is_resolved;
}

}  // namespace

std::vector<bool> faces_to_split(const Problem& problem, const SpatialReconstruction& r, Refine rule) {
  const TractionMesh& mesh = problem.mesh;
  std::vector<bool> split(mesh.leaves.size(), false);
  if (rule == Refine::threshold) {
    constexpr double kShare = 0.4;  // thesis 2.3.3
    const std::vector<double> sizes = sizes_of(problem, r);
    std::vector<double> sorted = sizes;
    const auto n_kept = static_cast<std::ptrdiff_t>(std::floor((1 - kShare) * static_cast<double>(sorted.size())));
    std::nth_element(sorted.begin(), sorted.begin() + n_kept, sorted.end());
    for (std::size_t f = 0; f < split.size(); ++f) split[f] = sizes[f] >= sorted[n_kept];
  }
  if (rule == Refine::resolved && r.covariance_kPa2.size() > 0) {
    const std::vector<bool> at = is_resolved(r);
    for (std::size_t f = 0; f < split.size(); ++f) {
      for (const int corner : mesh.quads.faces[f]) {
        if (corner < mesh.n_vertices() && at[corner]) split[f] = true;
      }
    }
  }
  return split;
}

Refined refined(Problem problem, SpatialReconstruction found, Refine rule,
                const std::function<Problem(TractionMesh)>& remade,
                const std::function<SpatialReconstruction(const Problem&)>& again) {
  const std::vector<bool> wanted = faces_to_split(problem, found, rule);
  const std::vector<double> sizes = sizes_of(problem, found);
  std::vector<std::size_t> order;
  for (std::size_t f = 0; f < wanted.size(); ++f) {
    if (wanted[f]) order.push_back(f);
  }
  std::ranges::stable_sort(order, std::ranges::greater{}, [&](std::size_t f) { return sizes[f]; });
  const auto mesh_with = [&](std::ptrdiff_t n_split) {
    std::vector<bool> split(wanted.size(), false);
    for (std::ptrdiff_t k = 0; k < n_split; ++k) split[order[k]] = true;
    return with_split(problem.mesh, problem.ground, split);
  };
  std::ptrdiff_t n_split = std::ssize(order);
  TractionMesh mesh = mesh_with(n_split);
  const int most = std::max(kMostVertices, problem.mesh.n_vertices());
  for (; mesh.n_vertices() > most; mesh = mesh_with(n_split)) n_split -= (n_split + 19) / 20;
  if (n_split == 0) return {std::move(problem), std::move(found), 0};
  Problem next = remade(std::move(mesh));
  SpatialReconstruction r = again(next);
  return {std::move(next), std::move(r), static_cast<int>(n_split)};
}

double mean_traction_kPa(const Problem& problem, const VectorXd& traction_kPa) {
  double fourth = 0, square = 0;
  for (Index v = 0; v < problem.mesh.n_vertices(); ++v) {
    const double t2 = traction_kPa.segment<3>(3 * v).squaredNorm();
    const double area = problem.mesh.areas_um2[v];
    square += area * t2;
    fourth += area * t2 * t2;
  }
  return square > 0 ? std::sqrt(fourth / square) : 0;
}

Effect decide_strain(const Problem& problem, const VectorXd& traction_kPa, const substrate::SubstrateParameters& gel) {
  return choice::decide_large_strain(gel,
                                     choice::left_out_in_gel(problem.gel, mean_traction_kPa(problem, traction_kPa)));
}

Strained on_strained_gel(const Problem& at_rest, SpatialReconstruction found, const substrate::SubstrateParameters& gel,
                         const std::function<SpatialReconstruction(const Problem&)>& again, int threads) {
  constexpr int kMostSteps = 8;
  constexpr double kSettled = 0.01;  // of the tractions: far below what noise makes of them
  substrate::SubstrateParameters of_model = gel;
  of_model.model = substrate::ModelKind::curved;
  of_model.effects.large_strain = Switch::on;
  const auto model = choice::make_substrate(at_rest.gel, of_model, threads);
  const auto response = response_of_vertices(*model, at_rest);
  Strained strained{at_rest, std::move(found), 0};
  double change = 1;
  for (; change > kSettled && strained.steps < kMostSteps; ++strained.steps) {
    const VectorXd before = strained.reconstruction.traction_kPa;
    const substrate::Tangent tangent = response->about(before);
    strained.problem = at_rest.with_response(tangent.response->matrix(), tangent.displacement_um, before);
    strained.reconstruction = again(strained.problem);
    const VectorXd& now = strained.reconstruction.traction_kPa;
    change = (now - before).norm() / std::max(now.norm(), 1e-300);
  }
  if (change > kSettled) {
    throw NotSolved({.reason = "the tractions did not settle on the strained gel in " + std::to_string(kMostSteps) +
                               " steps: switch effects.large_strain off"});
  }
  strained.problem.figures = model->figures();
  return strained;
}

}  // namespace mbtfm::spatial
