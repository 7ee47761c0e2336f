#include "mbtfm/plan/space_answer.h"

#include <algorithm>
#include <cmath>

#include "mbtfm/plan/answer.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::plan {

using files::kResult;
using files::member;
using files::Table;

namespace {

const SpaceExpected& expected_of(const SpaceGrid& grid, const SpacePoint& p, SpaceQuantity quantity) {
  return *std::ranges::find_if(grid.expected, [&](const SpaceExpected& e) {
    return e.quantity == quantity && e.point.youngs_modulus_kPa == p.youngs_modulus_kPa &&
           e.point.beads_per_um3 == p.beads_per_um3 && e.point.noise_um == p.noise_um;
  });
}

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
  return beads_per_um3 ? density_text(plan.asked.beads_per_um3, *beads_per_um3)
                       : "more than " + about(most_beads_per_um3(plan.asked.beads_per_um3));
}

std::string about_pair(const SpacePlan& plan, std::optional<double> least_distance_um) {
  const std::string pair = "Where the image shows two patches of " + brief(plan.asked.tension_nN) +
                           " nN each, and nothing else pulls, their forces are ";
  return pair + (least_distance_um ? "told apart if they are " + about(*least_distance_um) + " µm apart or more."
                                   : "not told apart at any distance in a cell.");
}

/// Standard errors allow for tractions beside the patches. Where there are none, experiments err by less.
std::string about_drawn(const SpaceDrawn& d) {
  const double allowed = 2 * d.by_chance + kDrawnMargin;
  const char* verdict = "The plan holds.";
  if (d.error_over_predicted > 1 + allowed) verdict = "The plan does not hold well here: allow for that factor.";
  if (d.error_over_predicted < 1 - allowed)
    verdict =
        "The plan is on the safe side: it allows for forces beside the patches, as the reconstruction does, and there "
        "are few of them here.";
  return checked_with(d, brief(d.point.beads_per_um3) + " beads per µm³",
                      std::to_string(d.forces.size()) + " components of forces") +
         verdict;
}

}  // namespace

SpacePoint answered_point(const Asked& asked, const SpaceGrid& grid, double own_kPa) {
  SpacePoint point{answered_gel_kPa(asked, own_kPa), asked.beads_per_um3.back(), asked.noise_um.front()};
  point.beads_per_um3 = density_that_suffices(
      asked.beads_per_um3, needed_of(grid.needed, point.youngs_modulus_kPa, point.noise_um).beads_per_um3);
  return point;
}

std::string answer_sentence(const SpacePlan& plan) {
  const double gel_kPa = answered_gel_kPa(plan.asked, plan.own_kPa), noise_um = plan.asked.noise_um.front();
  const std::string asked_for =
      " to see " + brief(plan.asked.tension_nN) + " nN per patch to " + brief(100 * plan.asked.within) + " %";
  const std::string text = "With " + std::string(gel_kPa == plan.own_kPa ? "your" : "a") + " gel of " + brief(gel_kPa) +
                           " kPa and a noise of " + brief(noise_um) + " µm (" + brief(plan.axial_noise * noise_um) +
                           " µm along z) you need ";
  const auto needed = [&](double E) { return needed_of(plan.grid.needed, E, noise_um).beads_per_um3; };
  const std::optional<double> n = needed(gel_kPa);
  return text + (n ? beads_text(plan, needed_text(plan, n), *n) : needed_text(plan, n) + " beads per µm³") + asked_for +
         of_other_gels(plan.asked, gel_kPa, [&](double E) { return needed_text(plan, needed(E)); }) + ".";
}

std::vector<std::string> further_sentences(const SpacePlan& plan) {
  const SpacePoint point = answered_point(plan.asked, plan.grid, plan.own_kPa);
  const SpaceNeeded& n = needed_of(plan.grid.needed, point.youngs_modulus_kPa, point.noise_um);
  const auto error = [&](SpaceQuantity quantity) {
    return about(expected_of(plan.grid, point, quantity).standard_error_nN) + " nN";
  };
  std::vector<std::string> sentences;
  if (n.beads_per_um3)
    sentences.push_back("That holds for half of the patches. Nine in ten need " + needed_text(plan, n.of_most) +
                        " beads per µm³.");
  const SpaceExpected& patch = expected_of(plan.grid, point, SpaceQuantity::force);
  sentences.push_back(
      "At " + beads_text(plan, about(point.beads_per_um3), point.beads_per_um3) +
      " the force of the middle patch has a standard error of " + error(SpaceQuantity::force) + ", " +
      error(SpaceQuantity::tangential_force) + " along the surface and " + error(SpaceQuantity::normal_force) +
      " normal to it; the total force has " + error(SpaceQuantity::total_force) + ", the net force " +
      error(SpaceQuantity::net_force) +
      ". The smallest force that can be seen is three times the patch's error. In the map, forces closer than " +
      about(*patch.resolution_um) + " µm look like one; from about twice that on they are mostly seen as two.");
  sentences.push_back(about_pair(plan, patch.least_distance_um));
  if (plan.drawn) sentences.push_back(about_drawn(*plan.drawn));
  return sentences;
}

Table<SpaceExpected> space_expected_table() {
  using Row = SpaceExpected;
  return {
      .file = "plan/plan.csv of a cell in space",
      .row = "each gel, density, noise and quantity",
      .columns = {
          {"youngs_modulus_kPa", "of the gel", member(&Row::point, &SpacePoint::youngs_modulus_kPa), kResult},
          {"beads_per_um3", "beads by volume", member(&Row::point, &SpacePoint::beads_per_um3), kResult},
          {"noise_um", "standard deviation of a displacement component along x or y",
           member(&Row::point, &SpacePoint::noise_um), kResult},
          {"quantity", "what is estimated; total force: the sum of the magnitudes of the patches' forces",
           &Row::quantity},
          {"n", "how many of them the cell has; of several, the numbers are medians", &Row::n},
          {"standard_error_nN", "as the reconstruction states it", &Row::standard_error_nN, kResult},
          {"from_beads_nN", "by the noise of the beads", &Row::from_beads_nN, kResult},
          {"from_background_nN", "by tractions beside the patches that the beads do not tell from them",
           &Row::from_background_nN, kResult},
          {"target_nN", "standard error that is asked for", &Row::target_nN, kResult},
          {"share_within", "of the n, whose standard error is the target or less", &Row::share_within, kResult},
          {"smallest_seen_nN", "three standard errors", &Row::smallest_seen_nN, kResult},
          {"resolution_um",
           "in the map, at the middle patch: forces closer together than this look like one; from about twice that on "
           "they are mostly seen as two",
           &Row::resolution_um, kResult},
          {"least_distance_um",
           "of two patches of the force asked for, from centre to centre, whose forces are told apart where the image "
           "shows them and nothing else pulls; empty: of another quantity, or at no distance",
           &Row::least_distance_um, kResult},
          {"numbers_told", "how many numbers of the tractions the beads tell", &Row::degrees, kResult},
          {"largest_displacement_um", "of all beads", &Row::largest_displacement_um, kResult},
          {"beyond_linear", "share of the displacement that linear elasticity leaves out", &Row::left_out, kResult}}};
}

Table<SpaceNeeded> space_needed_table() {
  using Row = SpaceNeeded;
  return {
      .file = "plan/plan_needed.csv of a cell in space",
      .row = "each gel and noise",
      .columns = {{"youngs_modulus_kPa", "of the gel", &Row::youngs_modulus_kPa, kResult},
                  {"noise_um", "standard deviation of a displacement component along x or y", &Row::noise_um, kResult},
                  {"beads_per_um3",
                   "at which half of the patches are within the target, and no less than the least asked for; empty: "
                   "more than four times the densest asked for",
                   &Row::beads_per_um3, kResult},
                  {"beads_per_um3_for_nine_in_ten", "the same for nine patches in ten", &Row::of_most, kResult}}};
}

Table<SpaceDrawnForce> space_drawn_table() {
  using Row = SpaceDrawnForce;
  return {.file = "plan/plan_drawn.csv of a cell in space",
          .row = "each component of each patch's force in each drawn experiment",
          .columns = {
              {"experiment", "counts from 1", &Row::experiment},
              {"adhesion_id", "label of the patch", &Row::adhesion_id},
              {"component",
               "`along the surface`: as the true force goes there; `normal`: out of the gel; `across`: square to both",
               &Row::component},
              {"true_nN", "its true value", &Row::true_nN, kResult},
              {"found_nN", "as reconstructed", &Row::found_nN, kResult},
              {"predicted_error_nN", "standard error by the plan", &Row::predicted_error_nN, kResult}}};
}

}  // namespace mbtfm::plan
