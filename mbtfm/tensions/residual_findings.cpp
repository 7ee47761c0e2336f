#include "mbtfm/tensions/residual_findings.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "mbtfm/tensions/robust.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::tensions {

namespace {

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
  for (std::size_t b = 0; b < data.position_um.size(); ++b)
    is_elsewhere.push_back(
        data.weight_per_um[2 * static_cast<Index>(b)] > 0 &&
        std::ranges::none_of(places, [&](Vec2 place) { return norm(data.position_um[b] - place) < kNear_um; }));
  return is_elsewhere;
}

/// Squares that the forces leave of these beads, over those of the noise.
double left_of(const FitOutcome& o, const std::vector<bool>& beads) {
  const VectorXd residual = residual_um(o.data, adhesion_forces_nN(o.fit));
  double squares = 0, n = 0;
  for (std::size_t b = 0; b < beads.size(); ++b) {
    if (!beads[b]) continue;
    squares += residual.segment<2>(2 * static_cast<Index>(b)).squaredNorm();
    n += 2;
  }
  return n > 0 && o.summary.noise_um > 0 ? squares / (n * std::pow(o.summary.noise_um, 2)) : 0;
}

/// A note where another finding names the cause.
Severity beneath_named(Symptom symptom, double number_elsewhere) {
  const KnownSymptom& known = properties_of(symptom);
  return number_elsewhere > known.threshold ? known.severity : Severity::note;
}

double stated_noise_um(const LinearData& data) {
  double squares = 0, n = 0;
  for (Index i = 0; i < data.weight_per_um.size(); ++i) {
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

/// The one whose beads the model explains worst. @param residual  um, 2·beads  @param beads  those to look at
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
    const auto row = 2 * static_cast<Index>(b);
    if (!beads[b]) continue;
    const Vec2 at = (1 / side_um) * (data.position_um[b] - low);
    Sum& sum = sums[{static_cast<int>(at.x), static_cast<int>(at.y)}];
    sum.squares += residual.segment<2>(row).squaredNorm() / (2 * noise_um * noise_um);
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

}  // namespace

std::optional<Finding> unexplained(const FitOutcome& o) {
  const double all = relative_l2(o.data, adhesion_forces_nN(o.fit));
  const double ratio = o.summary.expected_relative_l2 > 0 ? std::pow(all / o.summary.expected_relative_l2, 2) : 0;
  const std::vector<Vec2> places = named_places(o);
  const double beside = places.empty() ? ratio : left_of(o, elsewhere(o.data, places));
  return noticed(Symptom::unexplained_displacement, ratio,
                 {.severity = beneath_named(Symptom::unexplained_displacement, beside)});
}

std::optional<Finding> noise_disagrees(const FitOutcome& o) {
  const double stated = stated_noise_um(o.data);
  if (!o.data.has_errors || stated <= 0) return {};
  return noticed(Symptom::noise_disagrees, o.summary.noise_um / stated,
                 {.at = o.has_far_beads ? "Beads far from the cell" : "Beads"});
}

std::optional<Finding> beads_disagree(const FitOutcome& o) {
  const VectorXd residual = residual_um(o.data, adhesion_forces_nN(o.fit));
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

std::optional<Finding> telling_beads_scatter(const FitOutcome& o) {
  const double stated = stated_noise_um(o.data);
  if (stated <= 0 || o.summary.noise_um <= 0) return {};
  const Unexplained& left = o.fit.misfit;
  const double ratio = left.telling_variance / std::pow(o.summary.noise_um / stated, 2);
  constexpr double kErrors = 3;  // of the ratio by chance
  return noticed(Symptom::telling_beads_scatter, ratio - kErrors * left.telling_error,
                 {.value = brief(std::sqrt(ratio))});
}

}  // namespace mbtfm::tensions
