#include "mbtfm/plan/answer.h"

#include <cmath>

#include "pipeline/contract/listed.h"

namespace mbtfm::plan {

namespace {

std::string percent(double share) { return brief(100 * share) + " %"; }

bool can_be_had(const Needed& n, double most_beads_per_um2) {
  return n.beads_per_um2 && *n.beads_per_um2 <= most_beads_per_um2;
}

const Expected& expected_of(const Grid& grid, const Point& p, Quantity quantity) {
  return *std::ranges::find_if(grid.expected, [&](const Expected& e) {
    return e.quantity == quantity && e.point.youngs_modulus_kPa == p.youngs_modulus_kPa &&
           e.point.beads_per_um2 == p.beads_per_um2 && e.point.noise_um == p.noise_um;
  });
}

std::string about_adhesions(const Plan& plan, const Point& p) {
  const Expected& with = expected_of(plan.grid, p, Quantity::adhesion_force);
  const Expected& alone = expected_of(plan.grid, p, Quantity::free_force);
  std::string text =
      "At " + about(p.beads_per_um2) + " per µm² the force of the middle adhesion has a standard error of " +
      about(with.standard_error_nN) + " nN with the network and " + about(alone.standard_error_nN) +
      " nN without it, and FTTC errs by " + about(expected_of(plan.grid, p, Quantity::fttc_force).standard_error_nN) +
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
  if (!n.beads_per_um2) return "";
  const std::string half = "That holds for half of the fibres. ";
  if (n.of_most <= plan.most_beads_per_um2)
    return half + "Nine in ten need " + density_text(plan.asked.beads_per_um2, n.of_most) + " beads per µm².";
  if (std::isfinite(n.of_most))
    return half + "Nine in ten need " + about(n.of_most) + " beads per µm², more than the " +
           about(plan.most_beads_per_um2) + " that can be told apart.";
  return half +
         "Nine in ten do not reach it with any number of beads: for some of them mesh and segmentation alone make a "
         "larger error.";
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
  if (d.tensions.empty()) return "";
  constexpr double kUseless = 0.5;  // of chance: fewer than eight tensions
  const char* verdict = 2 * d.by_chance > kUseless ? "So few tensions hardly check the plan. "
                        : std::abs(d.error_over_predicted - 1) < 2 * d.by_chance + kDrawnMargin
                            ? "The plan holds. "
                            : "The plan does not hold well here: allow for that factor. ";
  return checked_with(d, brief(d.point.beads_per_um2) + (d.point.beads_per_um2 == 1 ? " bead" : " beads") + " per µm²",
                      std::to_string(d.tensions.size()) + (d.tensions.size() == 1 ? " tension" : " tensions")) +
         verdict + "Single adhesions' forces were off by " + about(d.forces.with_network_nN) +
         " nN with the network, by " + about(d.forces.alone_nN) + " nN without it, and by " + about(d.forces.fttc_nN) +
         " nN with FTTC.";
}

/// Why no number of beads suffices. @param densest  of the points asked for
std::string why_none(const Plan& plan, const Point& densest) {
  if (plan.grid.model_error_nN >= plan.asked.target_nN)
    return "networks and segmentation alone make an error of " + about(plan.grid.model_error_nN) + " nN.";
  return "with " + brief(densest.beads_per_um2) + " per µm² the noise alone makes an error of " +
         about(expected_of(plan.grid, densest, Quantity::fibres).from_beads_nN) + " nN.";
}

}  // namespace

double answered_gel_kPa(const Asked& asked, double own_kPa) {
  return *std::ranges::min_element(asked.youngs_modulus_kPa, {},
                                   [&](double E) { return std::abs(std::log(E / own_kPa)); });
}

double density_that_suffices(const std::vector<double>& densities, std::optional<double> needed) {
  const auto enough = std::ranges::find_if(densities, [&](double density) { return needed && density >= *needed; });
  return enough == densities.end() ? densities.back() : *enough;
}

std::string about(double value) { return significant(value, 2); }

std::string density_text(const std::vector<double>& densities, double needed) {
  return needed <= densities.front() ? "at most " + brief(densities.front()) : about(needed);
}

std::string of_other_gels(const Asked& asked, double gel_kPa, const std::function<std::string(double)>& needs) {
  std::string text;
  for (const double E : asked.youngs_modulus_kPa) {
    if (E != gel_kPa) text += (text.empty() ? "; a gel of " : ", one of ") + brief(E) + " kPa needs " + needs(E);
  }
  return text;
}

Point answered_point(const Asked& asked, const Grid& grid, double own_kPa) {
  Point point{answered_gel_kPa(asked, own_kPa), asked.beads_per_um2.back(), asked.noise_um.front()};
  if (grid.needed.empty()) return point;
  point.beads_per_um2 = density_that_suffices(
      asked.beads_per_um2, needed_of(grid.needed, point.youngs_modulus_kPa, point.noise_um).beads_per_um2);
  return point;
}

std::string answer_sentence(const Plan& plan) {
  if (plan.grid.needed.empty()) return "The cell has no stress fibre whose tension could be seen.";
  const double gel_kPa = answered_gel_kPa(plan.asked, plan.own_kPa), noise_um = plan.asked.noise_um.front();
  const std::string asked_for =
      "to see " + brief(plan.asked.tension_nN) + " nN per fibre to " + percent(plan.asked.within);
  const std::string with = "With " + std::string(gel_kPa == plan.own_kPa ? "your" : "a") + " gel of " + brief(gel_kPa) +
                           " kPa and a noise of " + brief(noise_um) + " µm ";
  const Needed& n = needed_of(plan.grid.needed, gel_kPa, noise_um);
  const std::string others = of_other_gels(plan.asked, gel_kPa, [&](double E) {
    const Needed& other = needed_of(plan.grid.needed, E, noise_um);
    return can_be_had(other, plan.most_beads_per_um2) ? density_text(plan.asked.beads_per_um2, *other.beads_per_um2)
                                                      : std::string("more beads than can be told apart");
  });
  if (!n.beads_per_um2)
    return with + "no number of beads suffices " + asked_for + ": " +
           why_none(plan, {gel_kPa, plan.asked.beads_per_um2.back(), noise_um});
  if (!can_be_had(n, plan.most_beads_per_um2))
    return with + "you would need " + about(*n.beads_per_um2) + " beads per µm² " + asked_for + ", more than the " +
           about(plan.most_beads_per_um2) + " that can be told apart" + others + ".";
  return with + "you need " + density_text(plan.asked.beads_per_um2, *n.beads_per_um2) + " beads per µm² " + asked_for +
         others + ".";
}

std::vector<std::string> further_sentences(const Plan& plan) {
  std::vector<std::string> sentences;
  const auto add = [&](const std::string& text) {
    if (!text.empty()) sentences.push_back(text);
  };
  const Point point = answered_point(plan.asked, plan.grid, plan.own_kPa);
  if (!plan.grid.needed.empty())
    add(about_most_fibres(plan, needed_of(plan.grid.needed, point.youngs_modulus_kPa, point.noise_um)));
  add(about_adhesions(plan, point));
  add(about_cells(plan));
  if (plan.drawn) add(about_drawn(*plan.drawn));
  return sentences;
}

}  // namespace mbtfm::plan
