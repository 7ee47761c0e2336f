#include "samples/plan/answer.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "pipeline/contract/counted.h"

namespace mbtfm::plan {

namespace {

std::string percent(double share) { return brief(100 * share) + " %"; }

bool can_be_had(const Needed& n, double most_beads_per_um2) { return n.density && *n.density <= most_beads_per_um2; }

/// The gel of the list that the answer speaks of: the cell's own, or the nearest to it.
double answered_gel_kPa(const Asked& asked, double own_kPa) {
  return *std::ranges::min_element(asked.youngs_modulus_kPa, {},
                                   [&](double E) { return std::abs(std::log(E / own_kPa)); });
}

const Needed& needed_of(const std::vector<Needed>& needed, double youngs_modulus_kPa, double noise_um) {
  return *std::ranges::find_if(
      needed, [&](const Needed& n) { return n.youngs_modulus_kPa == youngs_modulus_kPa && n.noise_um == noise_um; });
}

/// "With your gel of 8 kPa and a noise of 0.05 µm"
std::string with_gel(const Asked& asked, double own_kPa) {
  const double gel_kPa = answered_gel_kPa(asked, own_kPa);
  return "With " + std::string(gel_kPa == own_kPa ? "your" : "a") + " gel of " + brief(gel_kPa) +
         " kPa and a noise of " + brief(asked.noise_um.front()) + " µm";
}

/// "; a gel of 4 kPa needs 0.15, one of 16 kPa needs 1.2": of all gels but one. @param needs  what follows "needs"
std::string of_other_gels(const Asked& asked, double gel_kPa, const std::function<std::string(double)>& needs) {
  std::string text;
  for (const double E : asked.youngs_modulus_kPa)
    if (E != gel_kPa) text += (text.empty() ? "; a gel of " : ", one of ") + brief(E) + " kPa needs " + needs(E);
  return text;
}

/// What drawn experiments may be off by beyond chance: as much as such plans are off by anyway (docs/planning.md).
double allowed_of(const Drawn& d) {
  constexpr double kMargin = 0.1;
  return 2 * d.by_chance + kMargin;
}

/// "Checked with 2 simulated experiments at 8 kPa, … of 1). ". @param density, what  "0.5 beads per µm²", "12 tensions"
std::string checked_with(const Drawn& d, const std::string& density, const std::string& what) {
  return "Checked with " + counted(d.n_experiments, "simulated experiments") + " at " +
         brief(d.point.youngs_modulus_kPa) + " kPa, " + density + " and " + brief(d.point.noise_um) +
         " µm: the errors of " + what + " were " + about(d.error_over_predicted) +
         " times those predicted (root mean square; by chance within " + about(2 * d.by_chance) + " of 1). ";
}

// --- a flat cell

std::string about_adhesions(const Plan& plan, const Point& p) {
  const Expected& with = expected_of(plan.grid, p, Quantity::adhesion_force);
  const Expected& alone = expected_of(plan.grid, p, Quantity::free_force);
  std::string text = "At " + about(p.density) + " per µm² the force of the middle adhesion has a standard error of " +
                     about(with.standard_error_nN) + " nN with the network and " + about(alone.standard_error_nN) +
                     " nN without it, and FTTC errs by " +
                     about(expected_of(plan.grid, p, Quantity::fttc_force).standard_error_nN) +
                     " nN; the smallest force seen is three times that. ";
  const std::string pair = "Without the network two adhesions of " + brief(plan.asked.tension_nN) + " nN each are ";
  if (!alone.least_distance_um) return text + pair + "not told apart at any distance in a cell.";
  const std::string distance = about(*alone.least_distance_um) + " µm";
  return text + pair +
         (*alone.least_distance_um > plan.grid.touching_um ? "told apart if they are " + distance + " apart or more"
                                                           : "told apart even where they touch, at " + distance) +
         ".";
}

/// Nothing where not even half of the fibres meet the target.
std::string about_most_fibres(const Plan& plan, const Needed& n) {
  if (!n.density) return "";
  const std::string half = "That holds for half of the fibres. ";
  if (!n.of_most)
    return half +
           "No number of beads brings nine in ten there: for some, mesh and segmentation alone make a larger error.";
  if (*n.of_most <= plan.most_beads_per_um2)
    return half + "Nine in ten need " + density_text(plan.asked.densities, *n.of_most) + " beads per µm².";
  return half + "Nine in ten need " + about(*n.of_most) + " beads per µm², more than the " +
         about(plan.most_beads_per_um2) + " that can be told apart.";
}

std::string about_cells(const Plan& plan) {
  std::string text;
  for (const CellNumbers& n : plan.cells) {
    if (n.difference != plan.parameters.difference) continue;
    if (n.fibres_per_cell != std::max(1.0, std::round(n.scatter.fibres_per_cell))) continue;
    text += (text.empty() ? "" : ", ") + std::string(n.cells ? std::to_string(*n.cells) : "more than 10000") +
            " cells for " + name_of(n.scatter.type) + "s (" + brief(n.fibres_per_cell) + " in each cell)";
  }
  if (text.empty()) return text;
  return "To see a difference of " + percent(plan.parameters.difference) + " between two conditions with a chance of " +
         percent(plan.parameters.power) + ", each condition needs " + text + ".";
}

std::string about_drawn(const Drawn& d) {
  if (d.numbers.empty()) return "";
  constexpr double kUseless = 0.5;  // of chance: fewer than eight tensions
  const char* verdict = 2 * d.by_chance > kUseless ? "So few tensions hardly check the plan. "
                        : std::abs(d.error_over_predicted - 1) < allowed_of(d)
                            ? "The plan holds. "
                            : "The plan does not hold well here: allow for that factor. ";
  return checked_with(d, brief(d.point.density) + (d.point.density == 1 ? " bead" : " beads") + " per µm²",
                      counted(std::ssize(d.numbers), "tensions")) +
         verdict + "Single adhesions' forces were off by " + about(d.forces.with_network_nN) +
         " nN with the network, by " + about(d.forces.alone_nN) + " nN without it, and by " + about(d.forces.fttc_nN) +
         " nN with FTTC.";
}

/// Why no number of beads suffices. @param densest  of the points asked for
std::string why_none(const Plan& plan, const Point& densest) {
  if (plan.grid.model_error_nN >= plan.asked.target_nN)
    return "networks and segmentation alone make an error of " + about(plan.grid.model_error_nN) + " nN.";
  return "with " + brief(densest.density) + " per µm² the noise alone makes an error of " +
         about(expected_of(plan.grid, densest, Quantity::fibres).from_beads_nN) + " nN.";
}

// --- in space

/// Two digits, without an exponent.
std::string about_count(double n) {
  const double unit = std::pow(10, std::max(0.0, std::floor(std::log10(std::max(n, 1.0))) - 1));
  return std::to_string(std::lround(unit * std::round(n / unit)));
}

/// "0.0024 beads per µm³ (610 in this field)"
std::string beads_text(const SpacePlan& plan, const std::string& density, double beads_per_um3) {
  return density + " beads per µm³ (" + about_count(beads_per_um3 * plan.volume_um3) + " in this field)";
}

/// "0.0024", or "at most 0.001", or "more than 0.03"
std::string needed_text(const SpacePlan& plan, std::optional<double> beads_per_um3) {
  return beads_per_um3 ? density_text(plan.asked.densities, *beads_per_um3)
                       : "more than " + about(most_beads_per_um3(plan.asked.densities));
}

std::string about_pair(const SpacePlan& plan, std::optional<double> least_distance_um) {
  const std::string pair = "Where the image shows two patches of " + brief(plan.asked.tension_nN) +
                           " nN each, and nothing else pulls, their forces are ";
  return pair + (least_distance_um ? "told apart if they are " + about(*least_distance_um) + " µm apart or more."
                                   : "not told apart at any distance in a cell.");
}

/// Standard errors allow for tractions beside the patches. Where there are none, experiments err by less.
std::string about_drawn_in_space(const Drawn& d) {
  const double allowed = allowed_of(d);
  const char* verdict = "The plan holds.";
  if (d.error_over_predicted > 1 + allowed) verdict = "The plan does not hold well here: allow for that factor.";
  if (d.error_over_predicted < 1 - allowed)
    verdict = "The plan is on the safe side: it allows for forces beside the patches, of which there are few here.";
  return checked_with(d, brief(d.point.density) + " beads per µm³",
                      std::to_string(d.numbers.size()) + " components of forces") +
         verdict;
}

}  // namespace

std::string about(double value) { return significant(value, 2); }

std::string density_text(const std::vector<double>& densities, double needed) {
  return needed <= densities.front() ? "at most " + brief(densities.front()) : about(needed);
}

Point answered_point(const Asked& asked, const std::vector<Needed>& needed, double own_kPa) {
  Point point{answered_gel_kPa(asked, own_kPa), asked.densities.back(), asked.noise_um.front()};
  if (needed.empty()) return point;
  const std::optional<double> least = needed_of(needed, point.youngs_modulus_kPa, point.noise_um).density;
  const auto enough = std::ranges::find_if(asked.densities, [&](double density) { return least && density >= *least; });
  if (enough != asked.densities.end()) point.density = *enough;
  return point;
}

std::string answer_sentence(const Plan& plan) {
  if (plan.grid.needed.empty()) return "The cell has no stress fibre whose tension could be seen.";
  const double gel_kPa = answered_gel_kPa(plan.asked, plan.own_kPa), noise_um = plan.asked.noise_um.front();
  const std::string asked_for =
      "to see " + brief(plan.asked.tension_nN) + " nN per fibre to " + percent(plan.asked.within);
  const std::string with = with_gel(plan.asked, plan.own_kPa) + " ";
  const Needed& n = needed_of(plan.grid.needed, gel_kPa, noise_um);
  const std::string others = of_other_gels(plan.asked, gel_kPa, [&](double E) {
    const Needed& other = needed_of(plan.grid.needed, E, noise_um);
    return can_be_had(other, plan.most_beads_per_um2) ? density_text(plan.asked.densities, *other.density)
                                                      : std::string("more beads than can be told apart");
  });
  if (!n.density)
    return with + "no number of beads suffices " + asked_for + ": " +
           why_none(plan, {gel_kPa, plan.asked.densities.back(), noise_um});
  if (!can_be_had(n, plan.most_beads_per_um2))
    return with + "you would need " + about(*n.density) + " beads per µm² " + asked_for + ", more than the " +
           about(plan.most_beads_per_um2) + " that can be told apart" + others + ".";
  return with + "you need " + density_text(plan.asked.densities, *n.density) + " beads per µm² " + asked_for + others +
         ".";
}

std::string answer_sentence(const SpacePlan& plan) {
  const double gel_kPa = answered_gel_kPa(plan.asked, plan.own_kPa), noise_um = plan.asked.noise_um.front();
  const auto needed = [&](double E) { return needed_of(plan.grid.needed, E, noise_um).density; };
  const std::optional<double> n = needed(gel_kPa);
  return with_gel(plan.asked, plan.own_kPa) + " (" + brief(plan.axial_noise * noise_um) + " µm along z) you need " +
         (n ? beads_text(plan, needed_text(plan, n), *n) : needed_text(plan, n) + " beads per µm³") + " to see " +
         brief(plan.asked.tension_nN) + " nN per patch to " + percent(plan.asked.within) +
         of_other_gels(plan.asked, gel_kPa, [&](double E) { return needed_text(plan, needed(E)); }) + ".";
}

std::vector<std::string> further_sentences(const Plan& plan) {
  std::vector<std::string> sentences;
  const Point point = answered_point(plan.asked, plan.grid.needed, plan.own_kPa);
  if (!plan.grid.needed.empty())
    sentences.push_back(about_most_fibres(plan, needed_of(plan.grid.needed, point.youngs_modulus_kPa, point.noise_um)));
  sentences.push_back(about_adhesions(plan, point));
  sentences.push_back(about_cells(plan));
  if (plan.drawn) sentences.push_back(about_drawn(*plan.drawn));
  std::erase(sentences, "");
  return sentences;
}

std::vector<std::string> further_sentences(const SpacePlan& plan) {
  const Point point = answered_point(plan.asked, plan.grid.needed, plan.own_kPa);
  const Needed& n = needed_of(plan.grid.needed, point.youngs_modulus_kPa, point.noise_um);
  const auto error = [&](SpaceQuantity quantity) {
    return about(expected_of(plan.grid, point, quantity).standard_error_nN) + " nN";
  };
  std::vector<std::string> sentences;
  if (n.density)
    sentences.push_back("That holds for half of the patches. Nine in ten need " + needed_text(plan, n.of_most) +
                        " beads per µm³.");
  const SpaceExpected& patch = expected_of(plan.grid, point, SpaceQuantity::force);
  sentences.push_back("At " + beads_text(plan, about(point.density), point.density) +
                      " the force of the middle patch has a standard error of " + error(SpaceQuantity::force) + ", " +
                      error(SpaceQuantity::tangential_force) + " along the surface and " +
                      error(SpaceQuantity::normal_force) + " normal to it; the total force has " +
                      error(SpaceQuantity::total_force) + ", the net force " + error(SpaceQuantity::net_force) +
                      ". The smallest force seen is three times the patch's error. In the map, forces closer than " +
                      about(*patch.resolution_um) + " µm look like one; from twice that they mostly look like two.");
  sentences.push_back(about_pair(plan, patch.least_distance_um));
  if (plan.drawn) sentences.push_back(about_drawn_in_space(*plan.drawn));
  return sentences;
}

}  // namespace mbtfm::plan
