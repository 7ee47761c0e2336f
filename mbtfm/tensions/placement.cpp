#include "mbtfm/tensions/placement.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/robust.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/stopwatch.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/files/csv.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/stage/effects.h"
#include "substrate/compliance.h"
#include "substrate/greens/half_space.h"

namespace mbtfm::tensions {

namespace {

using substrate::Ellipse;

constexpr double kDegree = 180 / std::numbers::pi;

/// d/dx and d/dy of a displacement.
struct Slopes {
  Vec2 by_x, by_y;
};

/// Of Cerruti's point force u = k/r [(1 − nu) F + nu (e·F) e], k = (1 + nu)/(pi E).
Slopes slopes_of_point(const Gel& gel, Vec2 offset_um, Vec2 F) {
  const double r = std::sqrt(dot(offset_um, offset_um)), nu = gel.poisson_ratio;  // hypot is slow
  const double scale = (1 + nu) / (std::numbers::pi * gel.youngs_modulus_kPa * r * r);
  const Vec2 e = (1 / r) * offset_um;
  const double along = dot(e, F);
  const Vec2 fall = (1 - nu) * F + 3 * nu * along * e;
  return {scale * (-e.x * fall + nu * F.x * e + Vec2{nu * along, 0}),
          scale * (-e.y * fall + nu * F.y * e + Vec2{0, nu * along})};
}

/// Of the force spread over the ellipse, by differences of the exact field.
Slopes slopes_of_ellipse(const greens::HalfSpaceEllipse& field, double step_um, Vec2 at, Vec2 F) {
  const auto difference = [&](Vec2 h) {
    return 1 / (2 * step_um) * (field.compliance_um_per_nN(at + h) - field.compliance_um_per_nN(at - h)) * F;
  };
  return {difference({step_um, 0}), difference({0, step_um})};
}

constexpr double kPoint = 4;  // semi-axes: from there on the field is a point force's within (1/4)² / 2

bool is_far(const Ellipse& ellipse, Vec2 offset) {
  const double reach = kPoint * ellipse.semi_major_um;
  return dot(offset, offset) > reach * reach;
}

Vec2 force_on(const VectorXd& forces_nN, std::size_t ellipse) {
  const auto row = 2 * static_cast<Index>(ellipse);
  return {forces_nN[row], forces_nN[row + 1]};
}

/// Shift x, y and turn with standard errors, of what the fit leaves of the beads, tensions and common motion following.
struct Step {
  Eigen::Vector3d value, sigma;
};

Step step_of(const LinearData& data, const Trial& trial, const MatrixXd& derivatives, const MatrixXd& placement) {
  const MatrixXd of_free = of_free_tensions(derivatives, trial.tensions_nN);
  // all by way of the forces: beads × tensions are too many numbers
  MatrixXd weighted(placement.rows(), 4);
  weighted << less_motion(data, placement), residual_um(data, trial.forces_nN);
  weighted = squared_weights(data).asDiagonal() * weighted;
  const MatrixXd pulled = numerics::small_transposed_product(of_free, data.response->pull_back(weighted));
  const Index n = 3 + of_free.cols();
  MatrixXd H(n, n);
  H.topLeftCorner<3, 3>() = numerics::small_transposed_product(placement, weighted.leftCols<3>());
  H.bottomLeftCorner(of_free.cols(), 3) = pulled.leftCols<3>();
  H.topRightCorner(3, of_free.cols()) = pulled.leftCols<3>().transpose();
  H.bottomRightCorner(of_free.cols(), of_free.cols()) = numerics::gram(displace(data.reduced, of_free, data.threads));
  VectorXd g(n);
  g << numerics::transposed_matvec(placement, weighted.col(3)), pulled.col(3);
  const MatrixXd inverse = numerics::pseudo_inverse(H);
  return {.value = numerics::matvec(inverse, g).head<3>(),
          .sigma = (noise_variance(data) * inverse.diagonal().head<3>()).cwiseSqrt()};
}

double mean_semi_minor_um(const Cell& cell) {
  double sum = 0;
  for (const Adhesion& a : cell.adhesions) sum += substrate::ellipse_of(a).semi_minor_um;
  return sum / std::max<double>(1, static_cast<double>(cell.adhesions.size()));
}

std::string in_words(Vec2 shift_um, const Eigen::Vector3d& sigma) {
  return with_error(shift_um, {sigma[0], sigma[1]}) + " um";
}

/// The step after one that missed: a step goes by J of what is left, J = 1 but for Broyden's first update with what
/// came of the one before. All in standard errors, which are alike for shifts and turn.
/// @param planned, went  the step before, as it was to be and as it was taken
Eigen::Vector3d corrected(const Step& step, const Eigen::Vector3d& planned, const Eigen::Vector3d& went) {
  constexpr double kMost = 2;  // times as far, or half as far, along the way that was gone
  const auto in_errors = [&](const Eigen::Vector3d& v) -> Eigen::Vector3d { return v.cwiseQuotient(step.sigma); };
  const Eigen::Vector3d left = in_errors(step.value), d = in_errors(went),
                        missed = in_errors(planned - step.value - went);
  const double square = std::max(d.squaredNorm(), 1e-300);
  const double along = std::clamp(1 + d.dot(missed) / square, 1 / kMost, kMost);
  return step.sigma.cwiseProduct(left - missed * (d.dot(left) / square / along));
}

/// How far a step moves the adhesions, root mean square: about their centre shift and turn add by squares.
double way_um(const Eigen::Vector3d& step, double lever_um) { return std::hypot(step[0], step[1], step[2] * lever_um); }

/// The placement, then a small step in the cell's frame.
Placement moved(Placement placement, const Eigen::Vector3d& step) {
  placement.shift_um += placement.turned({step[0], step[1]});
  placement.turn_rad += step[2];
  return placement;
}

/// Of the adhesions about their centre, root mean square.
double lever_of(const Cell& cell, Vec2 centre_um) {
  double squares = 0;
  for (const Adhesion& a : cell.adhesions) squares += dot(a.position_um - centre_um, a.position_um - centre_um);
  return std::sqrt(squares / std::max<double>(1, static_cast<double>(cell.adhesions.size())));
}

}  // namespace

Vec2 Placement::turned(Vec2 v) const {
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  return {c * v.x - s * v.y, s * v.x + c * v.y};
}

Vec2 Placement::of(Vec2 place_um) const { return centre_um + shift_um + turned(place_um - centre_um); }

DisplacementField in_cell_frame(DisplacementField beads, const Placement& p) {
  const Placement back{.centre_um = {}, .shift_um = {}, .turn_rad = -p.turn_rad};
  for (Bead& bead : beads) {
    bead.position_um = p.centre_um + back.turned(bead.position_um - p.centre_um - p.shift_um);
    bead.displacement_um = back.turned(bead.displacement_um);
  }
  return beads;
}

DisplacementField in_bead_frame(DisplacementField fitted, const DisplacementField& beads, const Placement& p) {
  for (std::size_t i = 0; i < fitted.size(); ++i) {
    fitted[i].position_um = beads[i].position_um;
    fitted[i].displacement_um = p.turned(fitted[i].displacement_um);
  }
  return fitted;
}

MatrixXd placement_motions(const Gel& gel, const std::vector<substrate::Ellipse>& ellipses, const VectorXd& forces_nN,
                           const std::vector<Vec2>& beads_um, const VectorXd& model_um, Vec2 centre_um, int threads) {
  constexpr double kStep = 0.05;  // of the semi-minor axis, over which differences are taken
  std::vector<greens::HalfSpaceEllipse> fields;
  for (const substrate::Ellipse& e : ellipses) fields.emplace_back(gel, e);
  MatrixXd motions(model_um.size(), 3);
  numerics::parallel_for(static_cast<int>(beads_um.size()), threads, [&](int b) {
    const Vec2 at = beads_um[b];
    Slopes sum;
    for (std::size_t k = 0; k < ellipses.size(); ++k) {
      const substrate::Ellipse& e = ellipses[k];
      const Vec2 offset = at - e.centre_um;
      const Vec2 F = force_on(forces_nN, k);
      const Slopes one = is_far(e, offset) ? slopes_of_point(gel, offset, F)
                                           : slopes_of_ellipse(fields[k], kStep * e.semi_minor_um, at, F);
      sum.by_x += one.by_x;
      sum.by_y += one.by_y;
    }
    // a cell that goes forth leaves the beads behind; a turn carries the displacement along
    const Vec2 d = at - centre_um;
    const auto row = 2 * static_cast<Index>(b);
    const Vec2 turned = Vec2{-model_um[row + 1], model_um[row]} + d.y * sum.by_x - d.x * sum.by_y;
    motions.middleRows<2>(row) << -sum.by_x.x, -sum.by_y.x, turned.x, -sum.by_x.y, -sum.by_y.y, turned.y;
  });
  return motions;
}

VectorXd carried_um(const Gel& gel, const std::vector<Ellipse>& ellipses, const VectorXd& forces_nN,
                    const std::vector<Vec2>& beads_um, const VectorXd& by_um, int threads) {
  std::vector<greens::HalfSpaceEllipse> fields;
  for (const Ellipse& e : ellipses) fields.emplace_back(gel, e);
  VectorXd change(by_um.size());
  numerics::parallel_for(static_cast<int>(beads_um.size()), threads, [&](int b) {
    const auto row = 2 * static_cast<Index>(b);
    const Vec2 at = beads_um[b], by{by_um[row], by_um[row + 1]}, middle = at + 0.5 * by;
    Vec2 sum;
    for (std::size_t k = 0; k < ellipses.size(); ++k) {
      const Vec2 offset = middle - ellipses[k].centre_um, F = force_on(forces_nN, k);
      if (is_far(ellipses[k], offset)) {
        const Slopes slopes = slopes_of_point(gel, offset, F);
        sum += by.x * slopes.by_x + by.y * slopes.by_y;
        continue;
      }
      sum += (fields[k].compliance_um_per_nN(at + by) - fields[k].compliance_um_per_nN(at)) * F;
    }
    change.segment<2>(row) << sum.x, sum.y;
  });
  return change;
}

LinearData with_place(LinearData data, const Cell& cell, const Gel& gel, const VectorXd& forces_nN, Vec2 centre_um,
                      int threads) {
  const MatrixXd motions = placement_motions(gel, substrate::ellipses_of(cell.adhesions), forces_nN, data.position_um,
                                             data.response->displace(forces_nN), centre_um, threads);
  return with_more_motions(std::move(data), motions);
}

PlacedCell place_cell(const Cell& cell, const network::Contractile& network, const DisplacementField& beads,
                      LinearData data, const DataOf& data_of, const Gel& gel, const FitParameters& parameters,
                      const Trial& start, Switch setting, int threads) {
  const Stopwatch watch;
  constexpr double kFarthest_um = 5;  // filters are off by a micrometre at most, a stage that comes back by some
  constexpr double kLinear = 0.25;    // semi-minor axes: what its square adds is as a shift by an eighth of that
  // Standard errors by noise. A step is a tenth to a third too short (docs/theory/fit.md), so that the rest of one is
  // not found: of a cell that has moved to a sixth of a standard error, of one that lies where it should to one. All
  // three of such a cell are below three errors in 99 of 100, below two in 87: the rest would pay for new data.
  constexpr double kSmall = 0.5, kSmallAtRest = 3;
  constexpr int kMostPasses = 12;  // far off it takes four
  const double width_um = mean_semi_minor_um(cell);
  const std::vector<substrate::Ellipse> ellipses = substrate::ellipses_of(cell.adhesions);
  const Placement none{.centre_um = centre_of(cell.adhesions, &Adhesion::position_um), .shift_um = {}};
  const double lever_um = lever_of(cell, none.centre_um);
  PlacedCell result{.placement = none, .data = {}, .start = start, .effect = {}};
  const auto off = [&](const std::string& why) {
    result.placement = none;
    result.data = std::move(data);
    result.effect = stage::decided(EffectKind::channel_shift, setting, false, why);
    return result;
  };
  if (setting == Switch::off) return off("switched off in [effects]: cell and beads are taken to lie on each other");
  FitParameters rough = parameters;
  rough.tolerance = std::max(rough.tolerance, 0.02);  // the pattern of the forces is all that is asked for
  LinearData there = data;
  Eigen::Vector3d planned = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> went;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const TensionProblem problem(network, there.reduced, adhesion_ids_of(cell), {}, threads);
    const TensionFit fit = fit_tensions(
        problem, rough, threads, pass == 0 ? start : scaled_to_data(problem, result.start.tensions_nN, &result.start),
        Search::nearest);
    result.start = fit.trial;
    const VectorXd model_um = there.response->displace(fit.trial.forces_nN);
    const MatrixXd motions =
        placement_motions(gel, ellipses, fit.trial.forces_nN, there.position_um, model_um, none.centre_um, threads);
    const MatrixXd derivatives = problem.force_derivatives(fit.trial);
    // A stray bead near an adhesion, where the field is steep, moves a cell by several of its errors.
    if (parameters.loss != Loss::squares) there = without_strays(std::move(there), fit.trial, derivatives, motions);
    const Step step = step_of(there, fit.trial, derivatives, motions);
    const double length_um = way_um(step.value, lever_um), sigma_um = std::max(step.sigma[0], step.sigma[1]);
    if (setting == Switch::automatic && !(sigma_um < 0.5 * width_um)) {
      return off("the beads do not tell it: " + in_words(moved(result.placement, step.value).shift_um, step.sigma));
    }
    const double small = pass == 0 ? kSmallAtRest : kSmall;
    const bool is_found = (step.value.array().abs() < small * step.sigma.array()).all() || pass + 1 == kMostPasses;
    if (is_found && length_um < kLinear * width_um) {
      result.data = with_more_motions(unweighted(std::move(there)), motions);
      result.effect = stage::decided(EffectKind::channel_shift, setting, true, "found with the tensions");
      result.effect.seconds = watch.seconds();
      return result;
    }
    // steps no longer than the field is linear for
    const Eigen::Vector3d next = went ? corrected(step, planned, *went) : step.value;
    const double next_um = way_um(next, lever_um);
    went = std::min(1.0, width_um / next_um) * next;
    planned = step.value;
    result.placement = moved(result.placement, *went);
    if (norm(result.placement.shift_um) > kFarthest_um) break;
    there = data_of(in_cell_frame(beads, result.placement));
  }
  return off("no place within " + brief(kFarthest_um) + " um suits the beads");
}

FoundPlacement placement_among(const MotionsBeside& motions, Placement placement) {
  return {.placement = moved(placement, motions.values.tail<3>()), .sigma = motions.sigma.tail<3>()};
}

Figures figures_of(const FoundPlacement& found) {
  return {{"channel_shift_x_um", found.placement.shift_um.x},
          {"channel_shift_y_um", found.placement.shift_um.y},
          {"channel_shift_sigma_um", std::max(found.sigma[0], found.sigma[1])},
          {"channel_turn_deg", kDegree * found.placement.turn_rad},
          {"channel_turn_sigma_deg", kDegree * found.sigma[2]}};
}

std::string sentence_of(const FoundPlacement& found) {
  return in_words(found.placement.shift_um, found.sigma) + ", turned by " +
         with_error(kDegree * found.placement.turn_rad, kDegree * found.sigma[2]) + " degrees";
}

namespace {

/// What independent forces leave of the beads. Of exact data that is rounding, and says nothing.
double left_by_forces(const ReducedData& reduced, double floor_squared) {
  constexpr double kRounding = 1e-10;  // of the squares; those of G'G are rounded to its condition
  return std::max(floor_squared, kRounding * (reduced.floor_squared + reduced.target.squaredNorm()));
}

/// Twice the logarithm of the odds of the other state.
/// @param floor_squared  what independent forces leave in that state
double evidence_of(const LinearData& data, const ReducedData& other, double floor_squared) {
  return static_cast<double>(data.n_used) *
         std::log(left_by_forces(data.reduced, data.reduced.floor_squared) / left_by_forces(other, floor_squared));
}

double largest_displacement_um(const DisplacementField& beads) {
  double largest = 0;
  for (const Bead& b : beads) largest = std::max(largest, norm(b.displacement_um));
  return largest;
}

}  // namespace

DisplacementField under_load(DisplacementField beads) {
  for (Bead& b : beads) b.position_um += b.displacement_um;
  return beads;
}

BeadsOfState take_state(const DisplacementField& at_rest, LinearData data,
                        const std::function<LinearData(const DisplacementField&)>& data_of, double size_um,
                        double tolerance, Switch setting, const Carried& carried) {
  constexpr EffectKind kKind = EffectKind::beads_under_load;
  constexpr double kVeryStrong = 10;
  constexpr double kHopeless = -100;  // estimates of -230 to -450 were -350 to -470
  const Stopwatch watch;
  BeadsOfState result{.beads = at_rest, .data = std::move(data), .effect = {}};
  const double largest = largest_displacement_um(at_rest);
  if (setting == Switch::off || (setting == Switch::automatic && !(largest > tolerance * size_um))) {
    result.effect = stage::decided(kKind, setting, largest / size_um, tolerance,
                                   "over the size of an adhesion the largest displacement is");
    return result;
  }
  if (setting == Switch::automatic && carried) {  // the exact answer costs as much as all that went before
    const VectorXd there = result.data.displacement_um - carried(result.data);
    const double estimate = evidence_of(result.data, result.data.reduced, explained(result.data, there).floor_squared);
    if (estimate < kHopeless) {
      result.effect = stage::decided(
          kKind, setting, estimate, kHopeless,
          "twice the logarithm of the odds, estimated with the forces that explain the beads at rest, is");
      result.effect.seconds = watch.seconds();
      return result;
    }
  }
  DisplacementField moved = under_load(at_rest);
  LinearData loaded = data_of(moved);
  const double evidence = evidence_of(result.data, loaded.reduced, loaded.reduced.floor_squared);
  result.effect =
      stage::decided(kKind, setting, evidence, kVeryStrong,
                     "twice the logarithm of the odds, by what independent forces of the adhesions leave, is");
  result.effect.seconds = watch.seconds();
  if (!result.effect.is_on) return result;
  result.beads = std::move(moved);
  result.data = std::move(loaded);
  return result;
}

}  // namespace mbtfm::tensions
