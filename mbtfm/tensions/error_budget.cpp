#include "mbtfm/tensions/error_budget.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/search.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/stage/parameters.h"
#include "substrate/greens/models.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::tensions {

namespace {

using substrate::Ellipse;

/// Sums of forces that have a budget of their own besides the tensions, by force: the total; through the cut, if any.
MatrixXd sums_of(const EnsembleFit& fit) {
  MatrixXd sums = directions_of(adhesion_forces_nN(fit), fit.data.dimension);
  if (!fit.cut) return sums;
  sums.conservativeResize(Eigen::NoChange, 2);
  sums.col(1) = along_cut(fit.cut->direction(), sums.rows());
  return sums;
}

/// Linear answers of the tensions and, in the last rows, of the sums of forces.
struct Gain {
  MatrixXd of_tensions;  ///< where the tensions change
  MatrixXd of_forces;    ///< where the beads show these forces in excess of the model's, by adhesion
  MatrixXd of_model;     ///< where the model's forces lack these, tensions being what they are, and the beads show them
};

/// dt = Cov Jᵀ C e / s² for an error e of the forces; total force: d|R| = eᵀ (dR/dt dt + dR).
Gain gain_of(const EnsembleFit& fit, const MeshFit& mesh) {
  const Index n = mesh.covariance_nN2.rows();
  const MatrixXd sums = sums_of(fit);
  Gain gain{MatrixXd::Identity(n + sums.cols(), n), {}, {}};
  gain.of_tensions.bottomRows(sums.cols()) =
      numerics::small_transposed_product(by_network_force(fit, sums), mesh.force_derivatives);
  gain.of_forces = numerics::small_product(gain.of_tensions, mesh.by_force);
  gain.of_forces.bottomRows(sums.cols()) += (sums - by_network_force(fit, sums)).transpose();  // as forces of their own
  gain.of_model = gain.of_forces;
  gain.of_model.bottomRows(sums.cols()) -= sums.transpose();
  return gain;
}

VectorXd variances(const MatrixXd& gain, const VectorXd& variance) { return gain.cwiseAbs2() * variance; }

/// The parts that each mesh shows, in squares, mean over the meshes.
struct MeanVariances {
  VectorXd beads, mesh, model, solver, place;
};

/// s² of the beads alone over the variance that the fit counts with: the rest is the model's where no model error is.
double bead_share(const BudgetInputs& in) {
  if (in.fit.model_error || !in.data.has_errors) return 1;
  return std::min(1.0, noise_variance(in.data) / in.fit.misfit.variance);
}

/// How far the iterations stopped from the minimum, and the forces from balance.
VectorXd solver_error(const EnsembleFit& fit, const MeshFit& mesh, const Gain& gain) {
  const double imbalance = mesh.fit.trial.rest->imbalance_nN() / std::max(fit.forces.nN.norm(), 1e-300);
  VectorXd slope = mesh.local.g;
  for (Index i = 0; i < slope.size(); ++i) {
    if (mesh.local.tensions_nN[i] <= 0) slope[i] = std::min(slope[i], 0.0);  // at its bound, where the minimum is
  }
  const VectorXd step = numerics::matvec(mesh.response, slope);
  return numerics::matvec(gain.of_tensions, step).cwiseAbs() +
         imbalance * numerics::matvec(gain.of_tensions, mesh.local.tensions_nN).cwiseAbs();
}

/// Motions of the cell's place, pulled back to the forces: Gᵀ W² U with Uᵀ W² U = 1, the other motions taken off. With
/// B = (MᵀW²M + Λ)⁻¹ and L Lᵀ its block of the place, U = M B_place L⁻ᵀ.
MatrixXd pulled_place(const BudgetInputs& in) {
  const Index n = in.n_of_place;
  const MatrixXd columns = in.data.motions.inverse.rightCols(n);
  const MatrixXd upper = numerics::SmallCholesky(columns.bottomRows(n)).upper();
  return in.data.response->pull_back(
      squared_weights(in.data).asDiagonal() *
      numerics::small_product(numerics::small_product(in.data.motions.shapes, columns), numerics::inverse(upper)));
}

/// By how much the tensions' covariance would fall if the place were known: Cov − (Cov⁻¹ + V Vᵀ/s²)⁻¹ with V = Jᵀ U.
MatrixXd covariance_by_place(const EnsembleFit& fit, const MeshFit& mesh, const MatrixXd& pulled) {
  const MatrixXd answered = numerics::small_product(
      mesh.noise_covariance_nN2, numerics::small_transposed_product(mesh.force_derivatives, pulled));  // Cov V
  MatrixXd middle =
      numerics::small_product(numerics::small_transposed_product(pulled, mesh.force_derivatives), answered);
  middle.diagonal().array() += fit.misfit.variance;
  return numerics::small_product(answered, numerics::solve_symmetric(middle, answered.transpose()));
}

MeanVariances mean_variances(const BudgetInputs& in) {
  const Index n_rows = static_cast<Index>(in.fit.tensions.fibre_ids.size()) + (in.fit.cut ? 2 : 1);
  const double n = static_cast<double>(in.fit.meshes.size());
  const VectorXd none = VectorXd::Zero(n_rows);
  MeanVariances mean{none, none, none, none, none};
  const MatrixXd pulled = in.n_of_place > 0 ? pulled_place(in) : MatrixXd();
  for (const MeshFit& mesh : in.fit.meshes) {
    const Gain gain = gain_of(in.fit, mesh);
    const VectorXd noise = numerics::small_product(gain.of_tensions, mesh.noise_covariance_nN2)
                               .cwiseProduct(gain.of_tensions)
                               .rowwise()
                               .sum();
    mean.beads += bead_share(in) / n * noise;
    if (in.n_of_place > 0) {
      const MatrixXd by_place = covariance_by_place(in.fit, mesh, pulled);
      mean.place += bead_share(in) / n *
                    numerics::small_product(gain.of_tensions, by_place).cwiseProduct(gain.of_tensions).rowwise().sum();
    }
    mean.solver += solver_error(in.fit, mesh, gain).cwiseAbs2() / n;
    mean.model += (1 - bead_share(in)) / n * noise;
    if (!in.fit.model_error) continue;
    const ModelError& error = *in.fit.model_error;
    const VectorXd of_mesh = variances(gain.of_model, error.least_phi_nN * error.loads_nN);
    mean.mesh += of_mesh / n;
    mean.model += (variances(gain.of_model, error.stated_variance_nN2) - of_mesh) / n;
  }
  return mean;
}

/// Answers to displacements of the beads: those of the forces that these displacements look like, (GᵀW²G)⁻¹ GᵀW² du.
BeadAnswers answers_of(const BudgetInputs& in, const Gain& gain) {
  return {in.data, solve_normal(in.data.reduced, gain.of_forces.transpose()).transpose()};
}

/// What an ellipse's standard errors make of it, and of the vertices that it holds.
struct Variation {
  substrate::Ellipse ellipse;
  Vec2 shift_um;
  double growth = 0, turn_rad = 0;
};

std::vector<Variation> variations_of(const substrate::Ellipse& ellipse, const SegmentationErrors& p) {
  const double turn_rad = p.adhesion_angle_error_deg * std::numbers::pi / 180;
  std::vector<Variation> all = {{ellipse, {p.adhesion_shift_error_um, 0}},
                                {ellipse, {0, p.adhesion_shift_error_um}},
                                {ellipse, {}, p.adhesion_area_error / 2},
                                {ellipse, {}, 0, turn_rad}};
  for (Variation& v : all) {
    v.ellipse.centre_um += v.shift_um;
    v.ellipse.semi_major_um *= 1 + v.growth;
    v.ellipse.semi_minor_um *= 1 + v.growth;
    v.ellipse.angle_rad += v.turn_rad;
  }
  return all;
}

// A shift's field falls as 1/r², so its effect on beads evenly spread as 1/r²: 3 % of its variance lies further than
// this many semi-axes. There base and sides of the gel change nothing.
constexpr double kReach = 6;

std::vector<Index> beads_near(const LinearData& data, const substrate::Ellipse& ellipse) {
  std::vector<Index> near;
  const double reach_um = kReach * ellipse.semi_major_um;
  for (Index b = 0; b < std::ssize(data.position_um); ++b) {
    const Vec2 d = data.position_um[b] - ellipse.centre_um;
    if (dot(d, d) < reach_um * reach_um) near.push_back(b);
  }
  return near;
}

/// Forces of the first network by adhesion of the cell, as weights by adhesion of the network.
MatrixXd by_network_adhesion(const BudgetInputs& in, const MatrixXd& by_cell_adhesion) {
  const std::vector<int>& ids = in.networks.front().adhesion_ids();
  const Index each = in.data.dimension;
  MatrixXd weights(each * std::ssize(ids), by_cell_adhesion.rows());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto at = std::ranges::find(in.cell.adhesions, ids[i], &Adhesion::adhesion_id);
    weights.middleRows(each * static_cast<Index>(i), each) =
        by_cell_adhesion.middleCols(each * (at - in.cell.adhesions.begin()), each).transpose();
  }
  return weights;
}

/// What an adhesion's standard errors change, variation by variation.
struct AdhesionChanges {
  std::vector<Index> near;  ///< beads
  MatrixXd displacement;    ///< theirs: components × variations
  MatrixXd by_vertices;     ///< answers to the vertices held otherwise: rows × variations
};

AdhesionChanges changes_of(const BudgetInputs& in, std::size_t adhesion, const substrate::Substrate& half_space,
                           const network::GeometryAnswer& sums, Index n_sums) {
  const Adhesion& a = in.cell.adhesions[adhesion];
  const substrate::Ellipse ellipse = substrate::ellipse_of(a);
  const Index each = in.data.dimension;
  const VectorXd force_nN = in.fit.forces.nN.segment(each * static_cast<Index>(adhesion), each);
  const std::vector<Variation> variations = variations_of(ellipse, in.segmentation);
  std::vector<substrate::Ellipse> ellipses{ellipse};
  for (const Variation& variation : variations) ellipses.push_back(variation.ellipse);
  AdhesionChanges changes{.near = beads_near(in.data, ellipse), .displacement = {}, .by_vertices = {}};
  std::vector<Vec3> places_um;
  for (const Index b : changes.near) places_um.push_back(place_of_bead(in.data, b));
  const MatrixXd fields = response_to(ellipses, places_um, each, half_space)->matrix();
  const auto n = static_cast<Index>(variations.size());
  changes.displacement.resize(fields.rows(), n);
  changes.by_vertices = MatrixXd::Zero(n_sums, n);
  for (Index v = 0; v < n; ++v) {
    const Variation& variation = variations[v];
    changes.displacement.col(v) = (fields.middleCols(each * (v + 1), each) - fields.leftCols(each)) * force_nN;
    changes.by_vertices.col(v) = sums.to_adhesion(a.adhesion_id, [&](Vec2 point_um) {
      const Vec2 arm = point_um - a.position_um;
      return variation.shift_um + variation.growth * arm + variation.turn_rad * Vec2{-arm.y, arm.x};
    });
  }
  return changes;
}

VectorXd segmentation_variances(const BudgetInputs& in, const Gain& gain, const BeadAnswers& answers, int threads) {
  const auto sums = in.fit.meshes.front().fit.trial.rest->answer_to_geometry(by_network_adhesion(in, gain.of_model));
  const auto half_space = greens::make_greens(in.gel, {.model = substrate::ModelKind::half_space}, 1);
  std::vector<AdhesionChanges> changes(in.cell.adhesions.size());
  numerics::parallel_for(static_cast<int>(changes.size()), threads, [&](int i) {
    changes[i] = changes_of(in, static_cast<std::size_t>(i), *half_space, *sums, gain.of_model.rows());
  });
  VectorXd variance = sums->variance_of_free_ends(values_of(in.fit), in.segmentation.fibre_end_error_um);
  answers.for_each_block([&](Index first, const MatrixXd& of_beads) {
    std::vector<VectorXd> by_adhesion(changes.size());
    numerics::parallel_for(static_cast<int>(changes.size()), threads, [&](int i) {
      const AdhesionChanges& c = changes[i];
      MatrixXd answer = c.by_vertices.middleRows(first, of_beads.rows());
      const Index each = in.data.dimension;
      for (Index b = 0; b < std::ssize(c.near); ++b)
        answer += numerics::small_product(of_beads.middleCols(each * c.near[b], each),
                                          c.displacement.middleRows(each * b, each));
      by_adhesion[i] = answer.cwiseAbs2().rowwise().sum();
    });
    for (const VectorXd& v : by_adhesion) variance.segment(first, of_beads.rows()) += v;
  });
  return variance;
}

/// What these forces make of the beads on such a gel.
VectorXd field_um(const BudgetInputs& in, const Gel& gel, substrate::ModelKind model, int threads) {
  return response_to(substrate::ellipses_of(in.cell.adhesions), places_of_beads(in.data), in.data.dimension,
                     *greens::make_greens(gel, {.model = model}, threads))
      ->kept()
      ->displace(in.fit.forces.nN);
}

/// The tensions and the sums of forces.
VectorXd values_of_rows(const EnsembleFit& fit) {
  const VectorXd& tensions_nN = fit.meshes.front().fit.trial.tensions_nN;
  const VectorXd sums_nN = numerics::transposed_matvec(sums_of(fit), adhesion_forces_nN(fit));
  VectorXd values(tensions_nN.size() + sums_nN.size());
  values << tensions_nN, sums_nN;
  return values;
}

/// An error of all adhesions' fields alike changes the tensions in proportion; errors by adhesion add up in squares.
/// No model shows which of the two it is: both are counted.
VectorXd substrate_variances(const BudgetInputs& in, const Gain& gain, const BeadAnswers& answers, int threads) {
  const VectorXd values = values_of_rows(in.fit);
  VectorXd variance = (in.substrate_error * values).cwiseAbs2();
  for (Index a = 0, each = in.data.dimension; a < in.fit.forces.nN.size(); a += each)
    variance +=
        (in.substrate_error * gain.of_forces.middleCols(a, each) * in.fit.forces.nN.segment(a, each)).cwiseAbs2();
  if (!in.lacks_base) return variance;
  const VectorXd field = field_um(in, in.gel, substrate::ModelKind::layer, threads) -
                         field_um(in, in.gel, substrate::ModelKind::half_space, threads);  // by the base
  answers.for_each_block([&](Index first, const MatrixXd& of_beads) {
    variance.segment(first, of_beads.rows()) += numerics::matvec(of_beads, field).cwiseAbs2();
  });
  return variance;
}

/// Of what the user states of the gel; none where nothing is stated. Forces and tensions are proportional to the
/// modulus (but for the stretch of cables); what another thickness or Poisson's ratio changes of the displacement is
/// taken for force.
std::optional<VectorXd> gel_variances(const BudgetInputs& in, const BeadAnswers& answers, int threads) {
  const Gel& gel = in.gel;
  if (!gel.youngs_modulus_sigma_kPa && !gel.thickness_sigma_um && !gel.poisson_ratio_sigma) return std::nullopt;
  const VectorXd values = values_of_rows(in.fit);
  VectorXd variance = (gel.youngs_modulus_sigma_kPa.value_or(0) / gel.youngs_modulus_kPa * values).cwiseAbs2();
  for (const Gel& other : gels_an_error_away(gel)) {
    const VectorXd change = field_um(in, other, substrate::ModelKind::layer, threads) -
                            field_um(in, gel, substrate::ModelKind::layer, threads);
    answers.for_each_block([&](Index first, const MatrixXd& of_beads) {
      variance.segment(first, of_beads.rows()) += numerics::matvec(of_beads, change).cwiseAbs2();
    });
  }
  return variance;
}

/// Of a tension at zero the part by noise and model is what its interval's upper half says: it could be that much, and
/// linear propagation knows only that it is held.
void add_room_above(const EnsembleFit& fit, MeanVariances& mean) {
  for (std::size_t i = 0; i < fit.tensions.nN.size(); ++i) {
    const Estimate& tension = fit.tensions.nN[i];
    const auto at = static_cast<Index>(i);
    if (!tension.sides_95 || !std::isfinite(tension.sides_95->above)) continue;
    const double room = std::pow(tension.sides_95->above / kNormal95, 2);
    if (tension.value > 0 || room <= mean.beads[at] + mean.mesh[at] + mean.model[at]) continue;
    const LocalMisfit& local = fit.meshes.front().local;
    const double by_noise = fit.misfit.variance * local.H(at, at);
    const double by_model = local.model_variance.size() > 0 ? local.model_variance(at, at) : 0;
    const double share = by_noise + by_model > 0 ? by_noise / (by_noise + by_model) : 1;
    mean.place[at] = 0;
    mean.beads[at] = share * room;
    mean.mesh[at] = 0;
    mean.model[at] = (1 - share) * room;
  }
}

}  // namespace

std::vector<Gel> gels_an_error_away(const Gel& gel) {
  std::vector<Gel> others;
  if (gel.thickness_sigma_um.value_or(0) > 0) {
    others.push_back(gel);
    others.back().thickness_um += *gel.thickness_sigma_um;
  }
  if (gel.poisson_ratio_sigma.value_or(0) > 0) {
    others.push_back(gel);  // to the side where there is room
    const double sigma = std::min(*gel.poisson_ratio_sigma, 0.25);
    others.back().poisson_ratio += gel.poisson_ratio > 0.25 ? -sigma : sigma;
  }
  return others;
}

void declare(stage::ParameterList& list, SegmentationErrors& p) {
  list.table("fit");
  list.add("adhesion_shift_error_um", p.adhesion_shift_error_um, Range::zero_or_size_um());
  list.add("adhesion_area_error", p.adhesion_area_error, Range::between(0, 1));
  list.add("adhesion_angle_error_deg", p.adhesion_angle_error_deg, Range::between(0, 90));
  list.add("fibre_end_error_um", p.fibre_end_error_um, Range::zero_or_size_um());
}

ErrorBudget error_budget(const BudgetInputs& in, int threads) {
  const Gain gain = gain_of(in.fit, in.fit.meshes.front());
  const BeadAnswers answers = answers_of(in, gain);
  MeanVariances mean = mean_variances(in);
  const MatrixXd sums = sums_of(in.fit);
  mean.beads.tail(sums.cols()) += own_variances(in.fit, sums);
  mean.beads[static_cast<Index>(in.fit.tensions.fibre_ids.size())] += in.fit.forces.away_nN2;
  add_room_above(in.fit, mean);
  if (in.fit.model_error)
    mean.mesh[static_cast<Index>(in.fit.tensions.fibre_ids.size())] += std::pow(roughness_of_total(in.fit).sigma_nN, 2);
  const VectorXd segmentation = segmentation_variances(in, gain, answers, threads);
  const VectorXd substrate = substrate_variances(in, gain, answers, threads);
  const std::optional<VectorXd> gel = gel_variances(in, answers, threads);
  const auto parts = [&](Index i) {
    ErrorParts p{.beads = std::sqrt(std::max(0.0, mean.beads[i] - mean.place[i])),
                 .segmentation = std::sqrt(segmentation[i]),
                 .substrate = std::sqrt(substrate[i]),
                 .solver = std::sqrt(mean.solver[i]),
                 .model = std::sqrt(mean.model[i])};
    if (in.n_of_place > 0) p.place = std::sqrt(mean.place[i]);
    if (gel) p.gel = std::sqrt((*gel)[i]);
    if (in.fit.meshes.size() > 1) p.mesh = std::sqrt(mean.mesh[i]);
    return p;
  };
  ErrorBudget budget;
  const auto n = static_cast<Index>(in.fit.tensions.fibre_ids.size());
  for (Index i = 0; i < n; ++i)
    budget.tensions.push_back(
        {.fibre_id = in.fit.tensions.fibre_ids[i], .tension_nN = in.fit.tensions.nN[i].value, .parts_nN = parts(i)});
  budget.total_force_nN = total_nN(adhesion_forces_nN(in.fit), in.data.dimension);
  budget.total_force_parts_nN = parts(n);
  if (in.fit.cut) budget.cut_force = {.force_nN = in.fit.cut->magnitude_nN.value, .parts_nN = parts(n + 1)};
  return budget;
}

}  // namespace mbtfm::tensions
