/// What a reader should know first: what was found, how good it is, what to distrust.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/stage_state.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/kinds.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/page.h"
#include "pipeline/report/results.h"
#include "pipeline/report/stage_page.h"
#include "pipeline/report/tensions.h"
#include "pipeline/report/texts.h"

namespace mbtfm::report {
namespace {

/// Two digits, or all before the point: more would not last from one experiment to the next.
std::string two_digits(double value) {
  const std::string text = std::abs(value) >= 9.95 ? fmt::format("{:.0f}", value) : fmt::format("{:.2g}", value);
  return text[0] == '-' ? "−" + text.substr(1) : text;
}

std::string percent(double share) { return two_digits(100 * share) + " %"; }

/// Empty where the image shows the whole cell.
std::string of_cut(const FitSummary& fit) {
  if (!figure_of(fit, "cut_force_nN")) return {};
  const auto of = [&](const char* name) { return readable(figure_of(fit, name).value_or(0)); };
  return " " + sentence("cell.cut", of("cut_force_nN"), of("cut_force_sigma_nN"), of("cut_force_x_nN"),
                        of("cut_force_x_sigma_nN"), of("cut_force_y_nN"), of("cut_force_y_sigma_nN"));
}

/// Those that were seen, and those that were put where nobody saw one.
std::string adhesions_in_words(const Cell& cell) {
  std::size_t n_anchors = 0, n_candidates = 0;
  for (const Adhesion& a : cell.adhesions) {
    n_anchors += a.origin == AdhesionOrigin::anchor;
    n_candidates += a.origin == AdhesionOrigin::candidate;
  }
  const std::size_t n_seen = cell.adhesions.size() - n_anchors - n_candidates;
  std::string text;
  const auto add = [&](std::size_t n, const char* one, const char* many) {
    if (n > 0) text += (text.empty() ? "" : ", ") + counted(n, one, many);
  };
  add(n_seen, "adhesion", "adhesions");
  add(n_anchors, "anchor at the end of a fibre", "anchors at ends of fibres");
  add(n_candidates, "candidate for an adhesion", "candidates for adhesions");
  return text.empty() ? "0 adhesions" : text;
}

std::string of_candidates(const Cell& cell) {
  if (!has_origin(cell, AdhesionOrigin::candidate)) return {};
  return std::ranges::all_of(cell.adhesions, [](const Adhesion& a) { return is_assumed(a.origin); })
             ? " " + sentence("cell.candidates-alone")
             : " " + sentence("cell.candidates-too");
}

/// If the beads do not determine the network's tension, its part of the force may come out at any size.
std::string parts_of_total(const CellResults& results) {
  const auto network = results.tensions.find(0);
  if (network != results.tensions.end() && !network->second.identifiable) return sentence("cell.network-unresolved");
  return sentence("cell.fibres-and-network", readable(results.fit.fibre_force_nN),
                  readable(results.fit.network_force_nN));
}

/// With its standard error, where the fit states one.
std::string total_in_words(const FitSummary& fit) {
  if (!fit.error_budget) return readable(fit.total_force_nN) + " nN";
  return with_error(fit.total_force_nN, total(fit.error_budget->total_force_parts_nN), "nN");
}

std::string what(const CellResults& results) {
  int n_by_type[std::size(kFibreTypes)] = {};
  for (const Fibre& fibre : results.cell.fibres) ++n_by_type[static_cast<int>(fibre.type)];
  std::string others;
  for (const FibreType type : {FibreType::edge, FibreType::unclassified})
    if (const int n = n_by_type[static_cast<int>(type)]; n > 0) others += fmt::format(", {} {}", n, name_of(type));
  return sentence("cell.what", counted(results.cell.fibres.size(), "stress fibre", "stress fibres"), n_by_type[0],
                  counted(n_by_type[1], "transverse arc", "transverse arcs"), n_by_type[2], others,
                  adhesions_in_words(results.cell), total_in_words(results.fit), parts_of_total(results)) +
         of_candidates(results.cell) + of_cut(results.fit);
}

std::string truth(const CellResults& results) {
  const Comparison& comparison = *results.comparison;
  std::string text =
      sentence("cell.truth", counted(comparison.n_matched, "fibre", "fibres"), percent(comparison.relative_error));
  if (const Coverage coverage = coverage_of(results); coverage.n > 0)
    text += sentence("cell.truth-in-intervals", coverage.n_inside, coverage.n);
  if (comparison.n_long > 0) {
    text += sentence("cell.truth-long-fibres", comparison.n_long_found_and_typed,
                     counted(comparison.n_long, "true fibre", "true fibres"), kLongFibre_um,
                     comparison.n_long_found_and_typed == 1 ? "was" : "were");
  }
  if (comparison.true_total_force_nN) {
    text += fmt::format("; the total force deviates by {}",
                        percent(comparison.total_force_nN / *comparison.true_total_force_nN - 1));
  }
  return text + ".";
}

/// Empty for results of a version that did not compute it.
std::string explained_by_network(const FitSummary& fit) {
  const auto share = figure_of(fit, "network_explains"), beside_nN = figure_of(fit, "force_beside_network_nN");
  if (!share || !beside_nN || *beside_nN <= 0) return "";
  return " " +
         sentence("cell.beside-network", two_digits(*beside_nN), percent(std::sqrt(std::clamp(1 - *share, 0.0, 1.0))));
}

/// Of models.csv.
enum class Compared { no_fibres, full, adhesion_forces, sheet, sheet_with_bundles };
constexpr auto words(Compared) {
  return std::array{"no-fibres", "full", "adhesion-forces", "sheet", "sheet-with-bundles"};
}

/// Empty if the network with its fibres fits best.
std::string another_model(const FitSummary& fit) {
  const auto over = figure_of(fit, "bic_of_cables_over_best");
  if (!over || *over <= 0) return "";
  const auto best = std::ranges::find(fit.more, "best_model_by_bic", &Figures::value_type::first);
  const auto* name = best == fit.more.end() ? nullptr : std::get_if<std::string>(&best->second);
  const auto which = name == nullptr ? std::nullopt : named<Compared>(*name);
  if (!which) return "";
  constexpr std::array kModels = {"a network without fibres", "this one",
                                  "forces of the adhesions that no network joins", "a sheet that contracts evenly",
                                  "an evenly contracting sheet with these fibres in it"};
  return sentence("cell.another-model", kModels[static_cast<std::size_t>(*which)], *over);
}

/// The displacement that the model explains, against what the noise would allow.
std::string quality(const FitSummary& fit) {
  if (!(fit.expected_relative_l2 > 0)) return sentence("cell.misfit", percent(fit.relative_l2));
  const double left2 = std::pow(fit.relative_l2, 2), noise2 = std::pow(fit.expected_relative_l2, 2);
  std::string text;
  if (left2 <= noise2) {
    text = sentence("cell.misfit-is-noise", two_digits(1000 * fit.noise_um), percent(fit.relative_l2),
                    percent(fit.expected_relative_l2));
  } else {
    text = sentence("cell.misfit-and-noise", 100 * noise2 / left2, two_digits(1000 * fit.noise_um),
                    100 * (1 - noise2 / left2), percent(fit.relative_l2), percent(fit.expected_relative_l2));
  }
  constexpr double kLarge = 0.3;  // a reader may take it for a bad fit
  if (fit.expected_relative_l2 > kLarge) {
    text += " " + sentence("cell.misfit-counts-far-beads");
  }
  return text + explained_by_network(fit);
}

/// Empty for results of a version that did not compute them.
std::string energy_and_moment(const CellResults& results) {
  const FitSummary& fit = results.fit;
  std::string text;
  const auto energy = figure_of(fit, "strain_energy_fJ"), energy_sigma = figure_of(fit, "strain_energy_sigma_fJ");
  if (energy && energy_sigma) text += sentence("cell.energy", with_error(*energy, *energy_sigma, "fJ")) + " ";
  if (energy && has_assumed(results.cell)) text += sentence("cell.energy-at-assumed") + " ";
  const auto moment = figure_of(fit, "contractile_moment_nN_um"),
             moment_sigma = figure_of(fit, "contractile_moment_sigma_nN_um"),
             major = figure_of(fit, "contractile_moment_major_nN_um"),
             minor = figure_of(fit, "contractile_moment_minor_nN_um"),
             axis = figure_of(fit, "contractile_moment_axis_deg");
  if (moment && moment_sigma && major && minor && axis) {
    text += sentence("cell.moment", with_error(*moment, *moment_sigma, "nN µm"), readable(*major), *axis,
                     readable(std::abs(*minor) < 1e-9 * std::abs(*major) ? 0 : *minor));  // or it is rounding
  }
  return text;
}

/// Sentences on outputs that are not what a stage made of its inputs.
std::vector<std::string> on_outputs(const Provenance& provenance) {
  std::vector<std::string> sentences;
  std::string given;
  for (const StageLine& stage : provenance.stages) {
    if (named<StageState>(stage.state) == StageState::given) given += (given.empty() ? "" : ", ") + stage.name;
    if (named<StageState>(stage.state) == StageState::replaced)
      sentences.push_back("The outputs of " + stage.name + " are not its own: " + stage.why + ".");
  }
  if (!given.empty()) sentences.push_back(sentence("cell.given", given));
  return sentences;
}

std::string item(const char* kind, const char* mark, const std::string& text, const std::string& more = {}) {
  return fmt::format("<li class=\"{}\">{}{}{}</li>\n", kind, mark, printed(text), more);
}

constexpr const char* kPage = "docs/findings.md";

/// The remedy in sight; number, threshold, its reason and the page's name unfold. A report goes where the pages do
/// not: it names them, and links to none. @param next  has the remedy, too, if it is the same
std::string details_of(const Finding& f, const Finding* next) {
  std::string html;
  const bool is_repeated = next && next->remedy == f.remedy && next->severity == f.severity;
  if (is_open(f) && !f.remedy.empty() && !is_repeated) html += "<br><i>What to do:</i> " + printed(f.remedy);
  if (f.number && f.threshold) {
    html += fmt::format("<details><summary>{}</summary>{}: {}. Threshold: {}; {}.{} ({})</details>", html_escaped(f.id),
                        printed(f.number_is), readable(*f.number), readable(*f.threshold), printed(f.reason),
                        is_open(f) ? "" : " " + printed(f.remedy), kPage);
  } else if (is_open(f)) {
    html += fmt::format(" <span class=\"page\">({}: “{}”)</span>", kPage, html_escaped(f.id));
  }
  return html;
}

/// By Severity: the item's class and its mark.
constexpr std::pair<const char*, const char*> kItems[] = {
    {"fact", "<b>Note:</b> "}, {"caution", "<b>Caution:</b> "}, {"bad", "<b>Distrust:</b> "}};

/// Open ones, the gravest first, and notes, each as the stages gave them.
struct Items {
  std::string open, notes;
};
void add_findings(std::vector<Finding> findings, Items& items) {
  std::ranges::stable_sort(findings, std::ranges::greater(), &Finding::severity);
  for (std::size_t i = 0; i < findings.size(); ++i) {
    const Finding& f = findings[i];
    const auto& [kind, mark] = kItems[static_cast<std::size_t>(f.severity)];
    (is_open(f) ? items.open : items.notes) +=
        item(kind, mark, f.text, details_of(f, i + 1 < findings.size() ? &findings[i + 1] : nullptr));
  }
}

/// @param may_be_sound  else a tick would say what nobody asked
std::string list_with(const std::vector<std::string>& facts, Items items, bool may_be_sound) {
  std::string html = "<ul class=\"findings\">\n";
  for (const std::string& fact : facts) html += item("fact", "", fact);
  if (items.open.empty() && may_be_sound) items.open = item("good", "<b>✓</b> ", sentence("cell.nothing-open"));
  return html + items.open + items.notes + "</ul>\n";
}

/// Stages that compare a model with the beads.
enum class Judging { fit, traction };
constexpr auto words(Judging) { return std::array{"fit", "traction"}; }

/// Without one there is nothing that a tick could mean.
bool was_asked(const Provenance& provenance) {
  return std::ranges::any_of(provenance.stages, [](const StageLine& stage) {
    const auto state = named<StageState>(stage.state);
    return named<Judging>(stage.name) && (state == StageState::must_run || state == StageState::up_to_date);
  });
}

}  // namespace

std::vector<std::string> facts_of(const CellResults& results) {
  std::vector<std::string> facts;
  if (std::string text = another_model(results.fit); !text.empty()) facts.push_back(std::move(text));
  facts.push_back(what(results));
  if (const std::string text = energy_and_moment(results); !text.empty()) facts.push_back(text);
  if (results.comparison) facts.push_back(truth(results));
  facts.push_back(quality(results.fit));
  return facts;
}

std::string findings_section(const std::vector<std::string>& facts, const Provenance& provenance) {
  Items items;
  for (const StageLine& stage : provenance.stages)
    if (!stage.converged) items.open += item("bad", "<b>Distrust:</b> ", sentence("cell.not-converged", stage.name));
  add_findings(provenance.findings, items);
  if (const auto& accuracy = provenance.accuracy) {
    const std::string text = "Verified by the error budget: " + accuracy->verdict + ".";
    (accuracy->is_met ? items.notes : items.open) +=
        accuracy->is_met ? item("fact", "", text) : item("caution", "<b>Caution:</b> ", text);
  }
  for (const std::string& sentence : on_outputs(provenance)) items.notes += item("fact", "", sentence);
  return section("In short", list_with(facts, std::move(items), was_asked(provenance)));
}

std::string list_of(const std::vector<std::string>& facts, const std::vector<Finding>& findings) {
  Items items;
  add_findings(findings, items);
  return list_with(facts, std::move(items), true);
}

}  // namespace mbtfm::report
