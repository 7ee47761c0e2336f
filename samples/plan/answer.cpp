#include "samples/plan/answer.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "pipeline/contract/counted.h"
#include "pipeline/report/texts.h"

namespace mbtfm::plan {

namespace {

using report::sentence;

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
  return sentence("plan.with-gel", gel_kPa == own_kPa ? "your" : "a", brief(gel_kPa), brief(asked.noise_um.front()));
}

/// "; a gel of 4 kPa needs 0.15, one of 16 kPa needs 1.2": of all gels but one. @param needs  what follows "needs"
std::string of_other_gels(const Asked& asked, double gel_kPa, const std::function<std::string(double)>& needs) {
  std::string list;
  for (const double E : asked.youngs_modulus_kPa)
    if (E != gel_kPa) list += sentence("plan.other-gel", list.empty() ? "; a gel" : ", one", brief(E), needs(E));
  return list;
}

/// What drawn experiments may be off by beyond chance: as much as such plans are off by anyway (docs/planning.md).
double allowed_of(const Drawn& d) {
  constexpr double kMargin = 0.1;
  return 2 * d.by_chance + kMargin;
}

/// @param density, what  "0.5 beads per µm²", "12 tensions"
std::string checked_with(const Drawn& d, const std::string& density, const std::string& what, const char* verdict) {
  return sentence("plan.checked", counted(d.n_experiments, "simulated experiments"), brief(d.point.youngs_modulus_kPa),
                  density, brief(d.point.noise_um), what, about(d.error_over_predicted), about(2 * d.by_chance),
                  sentence(verdict));
}

/// Whether two of them are resolved. @param touching_um  below it they touch
std::string apart(std::optional<double> least_distance_um, double touching_um) {
  if (!least_distance_um) return sentence("plan.never-apart");
  return sentence(*least_distance_um > touching_um ? "plan.apart" : "plan.apart-touching", about(*least_distance_um));
}

// --- a flat cell

std::string about_adhesions(const Plan& plan, const Point& p) {
  const Expected& with = expected_of(plan.grid, p, Quantity::adhesion_force);
  const Expected& alone = expected_of(plan.grid, p, Quantity::free_force);
  return sentence("plan.adhesions", about(p.density), about(with.standard_error_nN), about(alone.standard_error_nN),
                  about(expected_of(plan.grid, p, Quantity::fttc_force).standard_error_nN),
                  brief(plan.asked.tension_nN), apart(alone.least_distance_um, plan.grid.touching_um));
}

/// Nothing where not even half of the fibres meet the target.
std::string about_most_fibres(const Plan& plan, const Needed& n) {
  if (!n.density) return "";
  if (!n.of_most) return sentence("plan.most-never");
  if (*n.of_most <= plan.most_beads_per_um2)
    return sentence("plan.most", "fibres", density_text(plan.asked.densities, *n.of_most), "µm²");
  return sentence("plan.most-too-dense", about(*n.of_most), about(plan.most_beads_per_um2));
}

std::string about_cells(const Plan& plan) {
  std::string list;
  for (const CellNumbers& n : plan.cells) {
    if (n.difference != plan.parameters.difference) continue;
    if (n.fibres_per_cell != std::max(1.0, std::round(n.scatter.fibres_per_cell))) continue;
    list += (list.empty() ? "" : ", ") + sentence("plan.cells-of-type",
                                                  n.cells ? std::to_string(*n.cells) : "more than 10000",
                                                  name_of(n.scatter.type), brief(n.fibres_per_cell));
  }
  if (list.empty()) return list;
  return sentence("plan.cells", percent(plan.parameters.difference), percent(plan.parameters.power), list);
}

std::string about_drawn(const Drawn& d) {
  if (d.numbers.empty()) return "";
  constexpr double kUseless = 0.5;  // of chance: fewer than eight tensions
  const char* verdict = 2 * d.by_chance > kUseless                             ? "plan.too-few-drawn"
                        : std::abs(d.error_over_predicted - 1) < allowed_of(d) ? "plan.holds"
                                                                               : "plan.does-not-hold";
  return checked_with(d, brief(d.point.density) + (d.point.density == 1 ? " bead" : " beads") + " per µm²",
                      counted(std::ssize(d.numbers), "tensions"), verdict) +
         " " +
         sentence("plan.drawn-forces", about(d.forces.with_network_nN), about(d.forces.alone_nN),
                  about(d.forces.fttc_nN));
}

/// Why no number of beads suffices. @param densest  of the points asked for
std::string why_none(const Plan& plan, const Point& densest) {
  if (plan.grid.model_error_nN >= plan.asked.target_nN)
    return sentence("plan.model-alone", about(plan.grid.model_error_nN));
  return sentence("plan.noise-alone", brief(densest.density),
                  about(expected_of(plan.grid, densest, Quantity::fibres).from_beads_nN));
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

/// Standard errors allow for tractions besides the patches. If there are none, experiments err by less.
std::string about_drawn_in_space(const Drawn& d) {
  const double allowed = allowed_of(d);
  const char* verdict = d.error_over_predicted > 1 + allowed   ? "plan.does-not-hold"
                        : d.error_over_predicted < 1 - allowed ? "plan.on-safe-side"
                                                               : "plan.holds";
  return checked_with(d, brief(d.point.density) + " beads per µm³",
                      std::to_string(d.numbers.size()) + " components of forces", verdict);
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
  if (plan.grid.needed.empty()) return sentence("plan.no-fibre");
  const double gel_kPa = answered_gel_kPa(plan.asked, plan.own_kPa), noise_um = plan.asked.noise_um.front();
  const std::string with = with_gel(plan.asked, plan.own_kPa), tension = brief(plan.asked.tension_nN),
                    within = percent(plan.asked.within);
  const Needed& n = needed_of(plan.grid.needed, gel_kPa, noise_um);
  const std::string others = of_other_gels(plan.asked, gel_kPa, [&](double E) {
    const Needed& other = needed_of(plan.grid.needed, E, noise_um);
    return can_be_had(other, plan.most_beads_per_um2) ? density_text(plan.asked.densities, *other.density)
                                                      : sentence("plan.too-dense");
  });
  if (!n.density)
    return sentence("plan.answer-none", with, tension, within,
                    why_none(plan, {gel_kPa, plan.asked.densities.back(), noise_um}));
  if (!can_be_had(n, plan.most_beads_per_um2))
    return sentence("plan.answer-too-dense", with, about(*n.density), tension, within, about(plan.most_beads_per_um2),
                    others);
  return sentence("plan.answer", with, density_text(plan.asked.densities, *n.density) + " beads per µm²", tension,
                  "fibre", within, others);
}

std::string answer_sentence(const SpacePlan& plan) {
  const double gel_kPa = answered_gel_kPa(plan.asked, plan.own_kPa), noise_um = plan.asked.noise_um.front();
  const auto needed = [&](double E) { return needed_of(plan.grid.needed, E, noise_um).density; };
  const std::optional<double> n = needed(gel_kPa);
  return sentence("plan.answer",
                  with_gel(plan.asked, plan.own_kPa) + " (" + brief(plan.axial_noise * noise_um) + " µm along z)",
                  n ? beads_text(plan, needed_text(plan, n), *n) : needed_text(plan, n) + " beads per µm³",
                  brief(plan.asked.tension_nN), "patch", percent(plan.asked.within),
                  of_other_gels(plan.asked, gel_kPa, [&](double E) { return needed_text(plan, needed(E)); }));
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
  if (n.density) sentences.push_back(sentence("plan.most", "patches", needed_text(plan, n.of_most), "µm³"));
  const SpaceExpected& patch = expected_of(plan.grid, point, SpaceQuantity::force);
  sentences.push_back(sentence("plan.patch", beads_text(plan, about(point.density), point.density),
                               error(SpaceQuantity::force), error(SpaceQuantity::tangential_force),
                               error(SpaceQuantity::normal_force), error(SpaceQuantity::total_force),
                               error(SpaceQuantity::net_force), about(*patch.resolution_um)));
  sentences.push_back(sentence("plan.pair", brief(plan.asked.tension_nN), apart(patch.least_distance_um, 0)));
  if (plan.drawn) sentences.push_back(about_drawn_in_space(*plan.drawn));
  return sentences;
}

}  // namespace mbtfm::plan
