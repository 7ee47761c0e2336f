#include "mbtfm/tensions/findings.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "mbtfm/tensions/missing.h"
#include "mbtfm/tensions/robust.h"
#include "pipeline/contract/counted.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/with_error.h"

namespace mbtfm::tensions {

namespace {

using Noticed = std::optional<Finding>;

// What the residuals of the beads say against a fit.

/// Places that missing-fibre and missing-adhesion name: what the beads there leave has its cause already.
std::vector<Vec2> named_places(const FitOutcome& o) {
  std::vector<Vec2> places;
  for (const MissingAdhesion& a : o.missing_adhesions) places.push_back(a.position_um);
  for (const MissingFibre& f : o.missing)
    for (const Adhesion& a : o.cell.adhesions)
      if (a.adhesion_id == f.start_adhesion_id || a.adhesion_id == f.end_adhesion_id) places.push_back(a.position_um);
  return places;
}

/// By bead: in use, and not beside one of these places.
std::vector<bool> elsewhere(const LinearData& data, const std::vector<Vec2>& places) {
  constexpr double kNear_um = 6;  // reach of a force among those of many others, as the search for it has it
  std::vector<bool> is_elsewhere;
  for (Index b = 0; b < std::ssize(data.position_um); ++b)
    is_elsewhere.push_back(is_used(data, b) && std::ranges::none_of(places, [&](Vec2 place) {
                             return norm(data.position_um[b] - place) < kNear_um;
                           }));
  return is_elsewhere;
}

/// Squares that the forces leave of these beads, over those of the noise.
double left_of(const FitOutcome& o, const std::vector<bool>& beads) {
  const VectorXd residual = evened_residual_um(o.data, adhesion_forces_nN(o.fit));
  const Index each = o.data.dimension;
  double squares = 0, n = 0;
  for (Index b = 0; b < std::ssize(beads); ++b) {
    if (!beads[b]) continue;
    squares += residual.segment(each * b, each).squaredNorm();
    n += static_cast<double>(each);
  }
  return n > 0 && o.summary.noise_um > 0 ? squares / (n * std::pow(o.summary.noise_um, 2)) : 0;
}

/// A note where another finding names the cause.
Severity beneath_named(Symptom symptom, double number_elsewhere) {
  const KnownSymptom& known = properties_of(symptom);
  return number_elsewhere > known.threshold ? known.severity : Severity::note;
}

/// Of a component along the surface.
double stated_noise_um(const LinearData& data) {
  double squares = 0, n = 0;
  for (Index i = 0; i < data.weight_per_um.size(); i += data.dimension) {
    if (data.weight_per_um[i] <= 0) continue;
    squares += 1 / (data.weight_per_um[i] * data.weight_per_um[i]);
    n += 1;
  }
  return n > 0 ? std::sqrt(squares / n) : 0;
}

/// A square of the picture with some sixty beads.
struct Region {
  Vec2 centre_um;
  double side_um = 0, chi_squared = 0;  ///< by degree of freedom
};

/// The one whose beads the model explains worst. @param residual  evened  @param beads  those to look at
Region worst_region(const LinearData& data, const VectorXd& residual, double noise_um, const std::vector<bool>& beads) {
  constexpr double kBeads = 60, kFewest = 30;
  const Extent field = extent_of(data.position_um);
  const Vec2 low = field.low_um;
  const double n = static_cast<double>(data.position_um.size());
  const double side_um = std::sqrt(kBeads / std::max(1.0, n) * field.area_um2());
  if (!(side_um > 0) || noise_um <= 0) return {};
  struct Sum {
    double squares = 0, n = 0;
  };
  std::map<std::pair<int, int>, Sum> sums;
  for (std::size_t b = 0; b < data.position_um.size(); ++b) {
    const Index each = data.dimension, row = each * static_cast<Index>(b);
    if (!beads[b]) continue;
    const Vec2 at = (1 / side_um) * (data.position_um[b] - low);
    Sum& sum = sums[{static_cast<int>(at.x), static_cast<int>(at.y)}];
    sum.squares += residual.segment(row, each).squaredNorm() / (static_cast<double>(each) * noise_um * noise_um);
    sum.n += 1;
  }
  Region worst{.centre_um = {}, .side_um = side_um, .chi_squared = 0};
  for (const auto& [at, sum] : sums) {
    if (sum.n < kFewest || sum.squares / sum.n <= worst.chi_squared) continue;
    worst.centre_um = low + side_um * Vec2{at.first + 0.5, at.second + 0.5};
    worst.chi_squared = sum.squares / sum.n;
  }
  return worst;
}

/// All squares together, a note where missing-fibre or missing-adhesion names the places that have them.
Noticed unexplained(const FitOutcome& o) {
  const double all = relative_l2(o.data, adhesion_forces_nN(o.fit));
  const double ratio = o.summary.expected_relative_l2 > 0 ? std::pow(all / o.summary.expected_relative_l2, 2) : 0;
  const std::vector<Vec2> places = named_places(o);
  const double beside = places.empty() ? ratio : left_of(o, elsewhere(o.data, places));
  return noticed(Symptom::unexplained_displacement, ratio,
                 {.severity = beneath_named(Symptom::unexplained_displacement, beside)});
}

/// Far from the cell.
Noticed noise_disagrees(const FitOutcome& o) {
  const double stated = stated_noise_um(o.data);
  if (!o.data.has_errors || stated <= 0) return {};
  return noticed(Symptom::noise_disagrees, o.summary.noise_um / stated,
                 {.at = o.has_far_beads ? "Beads far from the cell" : "Beads"});
}

/// The same of the worst region.
Noticed beads_disagree(const FitOutcome& o) {
  const VectorXd residual = evened_residual_um(o.data, adhesion_forces_nN(o.fit));
  const auto worst_among = [&](const std::vector<Vec2>& places) {
    return worst_region(o.data, residual, o.summary.noise_um, elsewhere(o.data, places));
  };
  const double beside = worst_among(named_places(o)).chi_squared;
  const Region worst = worst_among({});
  return noticed(Symptom::beads_disagree_by_region, worst.chi_squared,
                 {.at = "the square of " + brief(worst.side_um) + " um about (" + brief(worst.centre_um.x) + ", " +
                        brief(worst.centre_um.y) + ") um",
                  .severity = beneath_named(Symptom::beads_disagree_by_region, beside)});
}

/// Of the beads that determine the tensions.
Noticed telling_beads_scatter(const FitOutcome& o) {
  const double stated = stated_noise_um(o.data);
  if (stated <= 0 || o.summary.noise_um <= 0) return {};
  const Unexplained& left = o.fit.misfit;
  const double ratio = left.leverage_weighted_variance / std::pow(o.summary.noise_um / stated, 2);
  constexpr double kErrors = 3;  // of the ratio by chance
  return noticed(Symptom::telling_beads_scatter, ratio - kErrors * left.leverage_weighted_error,
                 {.value = brief(std::sqrt(ratio))});
}

/// "3, 7 and 12"; of many the first ones.
std::string listed(const std::vector<int>& ids) {
  constexpr std::size_t kMost = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, ids.size()); ++i) {
    if (i > 0) text += i + 1 == ids.size() ? " and " : ", ";
    text += std::to_string(ids[i]);
  }
  return ids.size() > kMost ? text + ", ..." : text;
}

Noticed explains_little(const FitOutcome& o) {
  const double noise = o.summary.expected_relative_l2 * o.summary.expected_relative_l2;  // of the beads' own squares
  if (noise <= 0 || noise >= 1) return {};
  const double share = unexplained_share(o.summary);
  // of the noise's squares, which far beads determine, and of what is left
  const double sigma = 2 * noise / (1 - noise) / std::sqrt(static_cast<double>(std::max<Index>(1, o.data.n_used)));
  return noticed(Symptom::explains_little, share - 3 * sigma, {.value = brief(100 * (1 - share))});
}

Noticed strain_beyond_linear(const FitOutcome& o) {
  return o.strain.is_on ? Noticed() : noticed(Symptom::strain_beyond_linear, o.strain.number.value_or(0));
}

Noticed noise_unknown(const FitOutcome& o) {
  const bool is_known = o.data.has_errors || o.has_far_beads;
  return noticed(Symptom::noise_unknown, is_known ? 0 : static_cast<double>(o.data.position_um.size()));
}

/// How many, and which.
Noticed noticed_of(Symptom symptom, const std::vector<int>& ids) {
  return noticed(symptom, static_cast<double>(ids.size()), {.at = listed(ids)});
}

/// "from adhesion 3 to 12 with 5.1 +- 0.4 nN (fibre 7 ends beside them); ..."
std::string listed(const std::vector<MissingFibre>& fibres) {
  std::string text;
  constexpr std::size_t kMost = 4;
  for (std::size_t i = 0; i < std::min(kMost, fibres.size()); ++i) {
    const MissingFibre& f = fibres[i];
    text += (i > 0 ? "; " : "") + std::string("from adhesion ") + std::to_string(f.start_adhesion_id) + " to " +
            std::to_string(f.end_adhesion_id) + " with " + with_error(f.tension_nN, sigma_nN(f)) + " nN";
    if (f.beside_fibre_id) text += " (fibre " + std::to_string(*f.beside_fibre_id) + " ends beside them)";
  }
  return fibres.size() > kMost ? text + "; ... (missing_fibres.csv)" : text;
}

Noticed missing_fibres_noticed(const FitOutcome& o) {
  return noticed(Symptom::missing_fibre, static_cast<double>(o.missing.size()), {.at = listed(o.missing)});
}

Noticed missing_adhesions_noticed(const FitOutcome& o) {
  const std::vector<MissingAdhesion>& missing = o.missing_adhesions;
  std::string places;
  constexpr std::size_t kMost = 4;
  for (std::size_t i = 0; i < std::min(kMost, missing.size()); ++i) {
    const MissingAdhesion& a = missing[i];
    places += (i > 0 ? "; " : "") + brief(norm(a.force_nN)) + " nN at (" + brief(a.position_um.x) + ", " +
              brief(a.position_um.y) + ") um";
  }
  if (missing.size() > kMost) places += "; ... (missing_adhesions.csv)";
  return noticed(Symptom::missing_adhesion, static_cast<double>(missing.size()), {.at = places});
}

Noticed fibres_without_tension(const FitOutcome& o) {
  std::vector<int> ids;
  for (const Fibre& fibre : o.cell.fibres) {
    const auto has = [&](const Tension& t) { return t.fibre_id == fibre.fibre_id; };
    if (std::ranges::none_of(o.tensions, has)) ids.push_back(fibre.fibre_id);
  }
  return noticed_of(Symptom::fibre_without_tension, ids);
}

/// Fibres whose tension is so.
template <class Predicate>
std::vector<int> fibres_whose(const std::vector<Tension>& tensions, const Predicate& is_so) {
  std::vector<int> ids;
  for (const Tension& t : tensions) {
    if (t.fibre_id > 0 && is_so(t)) ids.push_back(t.fibre_id);
  }
  return ids;
}

Noticed network_not_identifiable(const FitOutcome& o) {
  const bool is_unknown =
      std::ranges::any_of(o.tensions, [](const Tension& t) { return t.fibre_id == 0 && !t.identifiable; });
  return noticed(Symptom::network_not_identifiable, is_unknown ? 1 : 0);
}

Noticed cell_cut(const FitOutcome& o) {
  if (!o.fit.cut) return {};
  const Estimate& force = o.fit.cut->magnitude_nN;
  return noticed(Symptom::cell_cut, 1,
                 {.value = with_error(force.value, force.standard_error),
                  .at = o.beyond ? "allowed for" : "not (effects.beyond_cut = off)",
                  .severity = o.beyond ? Severity::note : Severity::caution});
}

/// "a cell 12 um away, at (80, 31) um, "; empty: none is in the image.
std::string nearest_neighbour(const Cell& cell) {
  double nearest_um = 1e300;
  Vec2 place_um;
  for (const Polygon& other : cell.neighbours_um) {
    for (const Vec2 p : other) {
      const double distance_um = distance_to_boundary_um(cell.outline_um, p);
      if (distance_um < nearest_um) nearest_um = distance_um, place_um = p;
    }
  }
  if (cell.neighbours_um.empty()) return "";
  return "a cell " + brief(nearest_um) + " um away, at (" + brief(place_um.x) + ", " + brief(place_um.y) + ") um, ";
}

Noticed neighbour_pulls(const FitOutcome& o) {
  const std::size_t n_beyond = o.beyond ? o.beyond->borders.size() : 0;
  std::string text = nearest_neighbour(o.cell);
  if (n_beyond > 0) text += "beyond the border, at the " + mbtfm::listed(o.beyond->borders) + ", ";
  if (text.empty()) return {};
  text += o.beyond ? "allowed for" : "not allowed for (effects.beyond_cut = off)";
  return noticed(Symptom::neighbour_pulls, static_cast<double>(o.cell.neighbours_um.size() + n_beyond),
                 {.at = text, .severity = o.beyond ? Severity::note : Severity::caution});
}

Noticed common_motion(const FitOutcome& o) {
  if (!o.motion) return {};
  const AffineMotion& m = o.motion->motion;
  double largest = 0;  // in standard errors
  const double values[] = {m.turn_rad, m.growth, m.stretch, m.skew};
  for (int i = 0; i < 4; ++i) largest = std::max(largest, std::abs(values[i]) / o.motion->sigma[i + 2]);
  constexpr double kLarge = 0.01;  // of all lengths: no refocus and no warming does that
  const bool is_large = std::max({std::abs(m.growth), std::abs(m.stretch), std::abs(m.skew)}) > kLarge;
  return noticed(Symptom::common_motion, largest,
                 {.value = sentence_of(*o.motion),
                  .at = is_large ? "; were both pictures taken with the same objective?" : "",
                  .severity = is_large ? Severity::caution : Severity::note});
}

Noticed curved_motion(const FitOutcome& o) {
  if (!o.curved) return {};
  return noticed(Symptom::curved_motion, o.curved->chi_squared, {.value = brief(1000 * o.curved->rms_um)});
}

Noticed channel_shift(const FitOutcome& o) {
  if (!o.place) return {};
  const Placement& place = o.place->placement;
  const Eigen::Vector3d values(place.shift_um.x, place.shift_um.y, place.turn_rad);
  constexpr double kLarge_um = 1;  // filters are off by less
  const bool is_large = norm(place.shift_um) > kLarge_um;
  return noticed(
      Symptom::channel_shift, values.cwiseAbs().cwiseQuotient(o.place->sigma).maxCoeff(),
      {.value = sentence_of(*o.place),
       .at = is_large ? "filters are off by less: do all images show the same place?" : "this was allowed for",
       .severity = is_large ? Severity::caution : Severity::note});
}

}  // namespace

double unexplained_share(const FitSummary& summary) {
  const double left = summary.relative_l2 * summary.relative_l2;
  const double noise = summary.expected_relative_l2 * summary.expected_relative_l2;
  return noise < 1 ? (left - noise) / (1 - noise) : 0;
}

std::vector<int> adhesions_without_beads(const std::vector<Adhesion>& adhesions, const std::vector<Vec2>& beads_um) {
  constexpr double kFar = 3;  // distances of beads: at random the chance is exp(−9 pi)
  const double far_um =
      kFar * std::sqrt(extent_of(beads_um).area_um2() / std::max(1.0, static_cast<double>(beads_um.size())));
  std::vector<int> ids;
  for (const Adhesion& a : adhesions) {
    const auto is_near = [&](Vec2 bead) { return norm(bead - a.position_um) <= far_um; };
    if (std::ranges::none_of(beads_um, is_near)) ids.push_back(a.adhesion_id);
  }
  return ids;
}

Imbalance imbalance_of(const EnsembleFit& fit) {
  const Index each = fit.data.dimension;
  const CutReaction cut = fit.cut ? fit.cut->reaction : CutReaction{};
  VectorXd net_nN = fit.forces.nN.reshaped(each, fit.forces.nN.size() / each).rowwise().sum();
  net_nN.head<2>() += cut.force_nN;
  constexpr double kTiny = 1e-300;  // a cell without any force is balanced
  return {.force = net_nN.norm() / std::max(total_nN(fit.forces.nN, each), kTiny),
          .torque = std::abs(fit.forces.torques_nN_um.sum() + cut.torque_nN_um) /
                    std::max(fit.forces.torques_nN_um.cwiseAbs().sum(), kTiny)};
}

std::vector<Finding> findings_of(const FitOutcome& o) {
  const Imbalance imbalance = imbalance_of(o.fit);
  const auto of_fibres = [&](Symptom symptom, const auto& is_so) {
    return noticed_of(symptom, fibres_whose(o.tensions, is_so));
  };
  const auto is_wide = [](const Tension& t) { return t.identifiable && t.tension_nN > 0 && is_uncertain(t); };
  Noticed cause = missing_fibres_noticed(o), then = missing_adhesions_noticed(o);
  if (explains_more(o.missing_adhesions, o.missing)) std::swap(cause, then);
  const EdgeForces& edge = o.fit.forces.edge;
  std::vector<Finding> findings;
  for (Noticed found :
       {cell_cut(o),
        neighbour_pulls(o),
        common_motion(o),
        curved_motion(o),
        channel_shift(o),
        std::move(cause),
        std::move(then),
        noticed(Symptom::edge_forces, edge.probability, {.at = brief(edge.sum_nN) + " nN"}),
        noticed_of(Symptom::adhesions_without_beads, adhesions_without_beads(o.cell.adhesions, o.data.position_um)),
        explains_little(o),
        unexplained(o),
        strain_beyond_linear(o),
        beads_disagree(o),
        telling_beads_scatter(o),
        noise_unknown(o),
        noise_disagrees(o),
        of_fibres(Symptom::not_identifiable, [](const Tension& t) { return !t.identifiable; }),
        network_not_identifiable(o),
        fibres_without_tension(o),
        noticed(Symptom::single_mesh, o.summary.n_meshes == 1 ? 1 : 0),
        noticed(Symptom::forces_out_of_balance, imbalance.force, {.at = "forces"}),
        noticed(Symptom::forces_out_of_balance, imbalance.torque, {.at = "torques"}),
        of_fibres(Symptom::wide_interval, is_wide),
        of_fibres(Symptom::tension_at_zero, [](const Tension& t) { return t.tension_nN == 0; })}) {
    if (found) findings.push_back(std::move(*found));
  }
  return findings;
}

}  // namespace mbtfm::tensions
