#include "mbtfm/spatial/problem.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "mbtfm/spatial/reconstruction.h"
#include "mbtfm/spatial/traction_mesh.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/numerics/dense.h"
#include "substrate/choice/factory.h"
#include "substrate/response.h"

namespace mbtfm::spatial {

namespace {

/// Whether a face has a part in the region.
bool touches(const TractionMesh& mesh, const Leaf& leaf, const Expected& expected) {
  constexpr int kParts = 8;  // of a side
  const Vec2 low = mesh.low_corner_um(leaf), size = mesh.size_um(leaf);
  for (int k = 0; k < (kParts + 1) * (kParts + 1); ++k) {
    const double x = k % (kParts + 1), y = k / (kParts + 1);
    if (expected.is_part(low + Vec2{x / kParts * size.x, y / kParts * size.y})) return true;
  }
  return false;
}

/// Small faces in the region, and larger ones where little is expected.
TractionMesh graded_lattice(const Ground& ground, const Expected& expected, double spacing_um) {
  constexpr int kLevels = 2;
  TractionMesh mesh =
      make_traction_mesh(ground, expected.over, std::ldexp(spacing_um, kLevels), [](Vec2) { return true; });
  for (int level = 0; level < kLevels; ++level) {
    std::vector<bool> is_split;
    for (const Leaf& leaf : mesh.leaves) is_split.push_back(touches(mesh, leaf, expected));
    mesh = with_split(mesh, ground, is_split);
  }
  return mesh;
}

/// @param by_beads_um  spacing where `meshing` has none
TractionMesh lattice_for(const Ground& ground, const Expected& expected, const Meshing& meshing, double by_beads_um) {
  const Vec2 size = expected.over.high_um - expected.over.low_um;
  const bool is_graded = meshing.refine == Refine::region && expected.background > 0 && expected.background < 1;
  double spacing = meshing.spacing_um.value_or(by_beads_um);
  if (starts_coarse(meshing.refine)) spacing *= 2;
  if (!meshing.spacing_um && !is_graded) spacing = std::max(spacing, std::sqrt(size.x * size.y / kMostVertices));
  if (spacing > std::max(size.x, size.y)) {
    throw UsageError("traction.spacing_um = " + brief(spacing) + ": the beads lie over " + brief(size.x) + " x " +
                     brief(size.y) + " um");
  }
  constexpr int kMostAtAll = 5000;  // the norm's own decomposition then takes half a minute
  const auto require_few = [&](double n, double most) {
    if (n <= most) return;
    throw UsageError("traction.spacing_um = " + brief(spacing) + " makes " + brief(n) + " vertices of tractions, " +
                     std::to_string(kMostAtAll) +
                     " are the most: choose a wider spacing, or a region with traction.background = 0");
  };
  constexpr double kWider = 1.05, kMostLooked = 1e6;  // of all places, where those of a region are wanted alone
  require_few(size.x * size.y / (spacing * spacing), kMostLooked);
  TractionMesh mesh = is_graded ? graded_lattice(ground, expected, spacing)
                                : make_traction_mesh(ground, expected.over, spacing, [&](Vec2 middle) {
                                    return expected.background > 0 || expected.is_part(middle);
                                  });
  for (; is_graded && !meshing.spacing_um && mesh.n_vertices() > kMostVertices; spacing *= kWider)
    mesh = graded_lattice(ground, expected, kWider * spacing);
  require_few(mesh.n_vertices(), kMostAtAll);
  return mesh;
}

/// Displacements under an even traction on each face: of quads that share no vertex, all four alike.
MatrixXd facet_response(const substrate::Substrate& model, const TractionMesh& mesh,
                        const substrate::Observations& at) {
  substrate::SurfaceMesh apart;
  const auto n_faces = static_cast<Index>(mesh.quads.faces.size());
  MatrixXd even = MatrixXd::Zero(12 * n_faces, 3 * n_faces);
  for (Index f = 0; f < n_faces; ++f) {
    std::array<int, 4> corners{};
    for (std::size_t i = 0; i < 4; ++i) {
      corners[i] = static_cast<int>(apart.points_um.size());
      apart.points_um.push_back(mesh.quads.points_um[mesh.quads.faces[f][i]]);
      for (Index c = 0; c < 3; ++c) even(3 * Index{corners[i]} + c, 3 * f + c) = 1;
    }
    apart.faces.push_back(corners);
  }
  return model.response({apart, 3}, at)->displace(even);
}

/// To tractions at the free vertices alone.
class OfFreeVertices final : public substrate::Response {
 public:
  OfFreeVertices(substrate::LazyResponse of_all, const TractionMesh& mesh)
      : OfFreeVertices(std::move(of_all), by_component(mesh)) {}

  Index rows() const override { return of_all_->rows(); }
  Index cols() const override { return constraint_.cols(); }
  MatrixXd displace(const MatrixXd& tractions) const override { return of_all_->displace(constraint_ * tractions); }
  MatrixXd pull_back(const MatrixXd& displacements) const override {
    return constraint_.transpose() * of_all_->pull_back(displacements);
  }
  MatrixXd matrix() const override { return of_all_->displace(MatrixXd(constraint_)); }
  substrate::SharedResponse kept() const override { return substrate::dense_response(matrix()); }
  substrate::Tangent about(const VectorXd& tractions) const override {
    substrate::Tangent tangent = of_all_->about(constraint_ * tractions);
    tangent.response = std::make_shared<OfFreeVertices>(tangent.response, constraint_);
    return tangent;
  }

  using Constraint = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  OfFreeVertices(substrate::LazyResponse of_all, Constraint constraint)
      : of_all_(std::move(of_all)), constraint_(std::move(constraint)) {}

 private:
  static Constraint by_component(const TractionMesh& mesh) {
    std::vector<Eigen::Triplet<double>> shares;
    for (Index row = 0; row < mesh.constraint.rows(); ++row) {
      for (Constraint::InnerIterator it(mesh.constraint, row); it; ++it) {
        for (Index c = 0; c < 3; ++c)
          shares.emplace_back(static_cast<int>(3 * row + c), static_cast<int>(3 * it.col() + c), it.value());
      }
    }
    Constraint all(3 * mesh.constraint.rows(), 3 * mesh.constraint.cols());
    all.setFromTriplets(shares.begin(), shares.end());
    return all;
  }

  substrate::LazyResponse of_all_;
  Constraint constraint_;
};

}  // namespace

std::vector<Vec3> Problem::vertices_um() const {
  std::vector<Vec3> places;
  for (int v = 0; v < mesh.n_vertices(); ++v) {
    const Vec2 p = mesh.quads.points_um[v];
    places.push_back({p.x, p.y, ground.height_um(p)});
  }
  return places;
}

MatrixXd Problem::norm_um2() const {
  return norm_of(mesh, ground, [this](Vec2 at) { return expected.amplitude(at); });
}

substrate::LazyResponse response_of_vertices(const substrate::Substrate& model, const Problem& problem) {
  auto of_all = model.response({problem.mesh.quads, 3}, problem.all_observed());
  if (problem.mesh.constraint.rows() == problem.mesh.constraint.cols()) return of_all;
  return std::make_shared<OfFreeVertices>(std::move(of_all), problem.mesh);
}

substrate::Observations Problem::all_observed() const {
  std::vector<Vec3> points = std::get<std::vector<Vec3>>(observed.at.points_um);
  for (const Vec3& v : vertices_um()) points.push_back(v);
  return {std::move(points), substrate::Components::all};
}

MatrixXd Problem::at_beads(const MatrixXd& of_all) const {
  const Index n = observed.n_components();
  MatrixXd rows(n * observed.n_beads, of_all.cols());
  for (Index b = 0; b < observed.n_beads; ++b) rows.middleRows(n * b, n) = of_all.middleRows(3 * b, n);
  return rows;
}

VectorXd Problem::displacement_um() const {
  if (offset_um.size() == 0) return observed.displacement_um;
  return observed.displacement_um - offset_um;
}

VectorXd Problem::surface_displacement_um(const VectorXd& traction_kPa) const {
  if (map) return map->displace(traction_kPa).bottomRows(n_unknowns()).col(0);
  const VectorXd u = surface_um_per_kPa * traction_kPa;
  if (surface_offset_um.size() == 0) return u;
  return u + surface_offset_um;
}

VectorXd Problem::residual(const VectorXd& traction_kPa, const VectorXd& weights_by_row) const {
  const VectorXd explained =
      map ? VectorXd(at_beads(map->displace(traction_kPa)).col(0)) : VectorXd(response_um_per_kPa * traction_kPa);
  return over_errors(displacement_um() - explained, weights_by_row);
}

VectorXd Problem::over_errors(const VectorXd& rows_um, const VectorXd& weights_by_row) const {
  if (common_um.cols() == 0) return rows_um.cwiseQuotient(observed.sigma_um);
  const MatrixXd common = rows_of(*this, weights_by_row).beside_in(rows_um);
  return (rows_um - common_um * common).cwiseQuotient(observed.sigma_um);
}

Problem Problem::with_response(const MatrixXd& matrix, const VectorXd& displaced_um, const VectorXd& about_kPa) const {
  Problem other = *this;
  other.surface_um_per_kPa = matrix.bottomRows(n_unknowns());
  other.response_um_per_kPa = at_beads(matrix);
  if (about_kPa.size() == 0) return other;
  const VectorXd offset = displaced_um - matrix * about_kPa;
  other.surface_offset_um = offset.tail(n_unknowns());
  other.offset_um = at_beads(offset).col(0);
  other.patch_response_um_per_nN.resize(0, 0);  // that of the gel at rest
  return other;
}

Problem Problem::with_beads(const std::vector<Index>& chosen, Observed of_them) const {
  MBTFM_ASSERT(!map && offset_um.size() == 0 && of_them.n_beads == std::ssize(chosen));
  Problem some{.observed = std::move(of_them), .gel = gel, .ground = ground, .expected = expected, .mesh = mesh};
  const Index n = observed.n_components();
  const auto rows_of = [&](const MatrixXd& all) {
    MatrixXd rows(all.size() > 0 ? n * std::ssize(chosen) : 0, all.cols());
    for (Index b = 0; n * b < rows.rows(); ++b) rows.middleRows(n * b, n) = all.middleRows(n * chosen[b], n);
    return rows;
  };
  some.response_um_per_kPa = rows_of(response_um_per_kPa);
  some.patch_response_um_per_nN = rows_of(patch_response_um_per_nN);
  some.facet_response_um_per_kPa = rows_of(facet_response_um_per_kPa);
  some.surface_um_per_kPa = surface_um_per_kPa;
  some.adhesion_areas_um2 = adhesion_areas_um2;
  if (common_um.cols() > 0) some.common_um = common_motions(some.observed);
  some.model_error = model_error;
  some.figures = figures;
  return some;
}

double Problem::variance_of_model() const {
  const double in_sigma = observed.displacement_um.cwiseQuotient(observed.sigma_um).squaredNorm();
  return model_error * model_error * in_sigma / static_cast<double>(observed.displacement_um.size());
}

double Problem::least_variance() const { return std::max(observed.states_errors ? 1.0 : 0.0, variance_of_model()); }

Problem make_problem(const SpatialInputs& inputs, const SpatialParameters& parameters, const Meshing& meshing,
                     const substrate::SubstrateParameters& gel, int threads) {
  const Ground ground(inputs.gel.surface.get());
  Observed observed = observe(inputs.beads, inputs.gel, ground, parameters);
  Expected expected = expected_tractions(inputs, observed, ground, parameters, meshing.grow_um);
  TractionMesh mesh = meshing.mesh
                          ? *meshing.mesh
                          : lattice_for(ground, expected, meshing, parameters.spacing_beads * observed.distance_um);
  substrate::SubstrateParameters of_model = gel;
  of_model.model = substrate::ModelKind::curved;  // the one that takes quads
  const std::shared_ptr<const substrate::Substrate> model = choice::make_substrate(inputs.gel, of_model, threads);
  Problem problem{.observed = std::move(observed),
                  .gel = inputs.gel,
                  .ground = ground,
                  .expected = std::move(expected),
                  .mesh = std::move(mesh)};
  // beads and vertices at once: the gel's factor is made once
  const auto map = response_of_vertices(*model, problem);
  if (problem.mesh.n_vertices() <= kMostVertices) {
    problem = problem.with_response(map->matrix(), {}, {});
  } else {
    problem.model = model;
    problem.map = map;
    map->displace(VectorXd::Zero(problem.n_unknowns()));  // makes the mesh, whose error is asked below
  }
  if (meshing.has_patches && !inputs.adhesions.empty()) {
    problem.patch_response_um_per_nN =
        model->response({substrate::ellipses_of(inputs.adhesions), 3}, problem.observed.at)->matrix();
    problem.adhesion_areas_um2 = adhesion_areas_um2(problem.mesh, ground, inputs.adhesions, 0);
  }
  if (meshing.has_facets) problem.facet_response_um_per_kPa = facet_response(*model, problem.mesh, problem.observed.at);
  if (gel.effects.common_motion != Switch::off) problem.common_um = common_motions(problem.observed);
  problem.model_error = model->stated_error();
  problem.figures = model->figures();
  return problem;
}

inverse::Spectrum spectrum_of(const Problem& problem, const MatrixXd& response, const VectorXd& weights_by_row,
                              double n_data, int threads) {
  const inverse::Rows rows = rows_of(problem, weights_by_row);
  return inverse::spectrum_of(rows.of(response), rows.of(problem.displacement_um()),
                              n_data - static_cast<double>(rows.n_beside()), threads);
}

MatrixXd common_motions(const Observed& observed) {
  const Index n = observed.n_components(), n_beads = observed.n_beads;
  std::vector<Index> columns = {0, 1, 6, 2};  // shifts, turn about z
  if (n == 2) columns.erase(columns.begin() + 2);
  const MatrixXd motions =
      inverse::affine_motions(std::get<std::vector<Vec3>>(observed.at.points_um))(Eigen::all, columns);
  return motions.reshaped(3, (n + 1) * n_beads).topRows(n).reshaped(n * n_beads, n + 1);
}

inverse::Rows rows_of(const Problem& problem, const VectorXd& weights_by_row, const MatrixXd& columns) {
  const Index n_common = problem.common_um.cols();
  MatrixXd beside(weights_by_row.size(), n_common + columns.cols());
  if (n_common > 0) beside.leftCols(n_common) = problem.common_um;
  if (columns.cols() > 0) beside.rightCols(columns.cols()) = columns;
  return {weights_by_row.cwiseSqrt().cwiseQuotient(problem.observed.sigma_um), beside};
}

std::optional<CommonMotionInSpace> common_motion_beside(const Problem& problem, const SpatialReconstruction& found) {
  if (problem.common_um.cols() == 0 || found.covariance_kPa2.size() == 0) return std::nullopt;
  const inverse::Rows rows = rows_of(problem, found.weighing.by_row);
  const MatrixXd by_traction = rows.beside_in(problem.response_um_per_kPa);
  const MatrixXd covariance =
      numerics::plus_product(found.variance * rows.covariance_beside(),
                             numerics::small_product(by_traction, found.covariance_kPa2), by_traction.transpose());
  const VectorXd left_um =
      numerics::minus_matvec(problem.displacement_um(), problem.response_um_per_kPa, found.traction_kPa);
  return CommonMotionInSpace{rows.beside_in(left_um), covariance.diagonal().cwiseMax(0).cwiseSqrt()};
}

Effect common_motion_effect(Switch setting, const Problem& problem, const std::optional<CommonMotionInSpace>& found) {
  if (setting == Switch::off)
    return stage::decided(EffectKind::common_motion, setting, true,
                          "switched off in [effects]: the beads at rest are taken to lie still");
  if (problem.common_um.cols() == 0)
    return stage::decided(EffectKind::common_motion, setting, false, "the displacement is imposed as it was measured");
  if (!found) return stage::decided(EffectKind::common_motion, setting, true, "found with the tractions");
  std::string why = "found with the tractions: shift";
  const Index n = found->values.size() - 1;
  constexpr std::array kAxes = {" x ", " y ", " z "};
  const auto in_unit = [&](Index k, double unit) {
    return with_error(unit * found->values[k], unit * found->sigma[k]);
  };
  for (Index k = 0; k < n; ++k) why += kAxes.at(static_cast<std::size_t>(k)) + in_unit(k, 1) + " um,";
  why += " turn " + in_unit(n, 180 / std::numbers::pi) + " degrees";
  return stage::decided(EffectKind::common_motion, setting, true, why);
}

Figures figures_of(const CommonMotionInSpace& found) {
  Figures figures;
  constexpr std::array kAxes = {"x", "y", "z"};
  const Index n = found.values.size() - 1;
  for (Index k = 0; k < n; ++k) {
    const std::string name = std::string("common_shift_") + kAxes.at(static_cast<std::size_t>(k));
    figures.emplace_back(name + "_um", found.values[k]);
    figures.emplace_back(name + "_sigma_um", found.sigma[k]);
  }
  constexpr double kDegree = 180 / std::numbers::pi;
  figures.emplace_back("common_turn_deg", kDegree * found.values[n]);
  figures.emplace_back("common_turn_sigma_deg", kDegree * found.sigma[n]);
  return figures;
}

}  // namespace mbtfm::spatial
