/// The page of a cell whose beads are in space.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/results.h"
#include "pipeline/files/json.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/kinds.h"
#include "pipeline/report/maps.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/page.h"
#include "pipeline/report/space_results.h"
#include "pipeline/report/texts.h"

namespace mbtfm::report {
namespace {

/// Net force or moment, with its standard error where there is one.
struct Sum {
  double size = 0;
  std::optional<double> sigma = {};  ///< along itself
};
Sum sum_of(const SpaceResults& r, const std::string& name, const std::string& unit) {
  const Vec3 v = r.vector(name, unit);
  Sum sum{.size = norm(v)};
  if (sum.size > 0) sum.sigma = r.find(name + "_sigma_along_" + unit);
  return sum;
}

std::vector<std::string> facts_of(const SpaceResults& r) {
  const Sum force = sum_of(r, "net_force", "nN"), moment = sum_of(r, "moment", "nN_um");
  const double total = r.number("total_force_nN");
  std::vector<std::string> facts;
  facts.push_back(sentence("space.energy", readable(r.number("strain_energy_fJ"))));
  if (const auto moment_found = r.find("contractile_moment_nN_um"))
    facts.back() +=
        " " + sentence("space.moment", with_error(*moment_found, r.find("contractile_moment_sigma_nN_um"), "nN µm"));
  facts.push_back(sentence("space.balance", with_error(force.size, force.sigma, "nN"),
                           readable(total > 0 ? 100 * force.size / total : 0),
                           with_error(moment.size, moment.sigma, "nN µm")));
  if (const auto imbalance = r.find("imbalance_chi_squared")) {
    facts.back() += " " + sentence("space.balance-tested", readable(*imbalance),
                                   readable(properties_of(Symptom::tractions_out_of_balance).threshold));
  }
  facts.push_back(sentence("space.total", with_error(total, r.find("total_force_sigma_nN"), "nN"),
                           r.texts.at("tractions_over"), readable(r.number("normal_force_nN")),
                           readable(largest_kPa(map_of(r)))));
  if (const auto flipped = r.find("flipped_z_chi_squared")) {
    facts.push_back(sentence("space.sign-of-z", readable(std::abs(*flipped)), *flipped < 0 ? "smaller" : "larger",
                             *flipped < 0 ? " " + sentence("space.sign-of-z-hint") : ""));
  }
  if (r.find("common_turn_deg")) {
    std::string shifts;
    for (const std::string axis : {"x", "y", "z"}) {
      const std::string name = "common_shift_" + axis;
      if (const auto shift = r.find(name + "_um"))
        shifts += axis + " " + with_error(*shift, r.find(name + "_sigma_um"), "µm") + ", ";
    }
    facts.push_back(sentence("space.shift", shifts));
  }
  if (const auto resolution = r.find("median_resolution_um")) {
    facts.push_back(sentence("space.resolution", readable(*resolution), readable(r.number("effective_unknowns")),
                             readable(r.number("n_unknowns"))));
  }
  return facts;
}

std::string how_lambda(const SpaceResults& r) {
  if (r.texts.at("method") == "group-l1") return sentence("space.lambda-of-group-l1");
  const auto by = r.texts.find("lambda_by");
  if (!r.find("lambda_um_per_kPa") || by == r.texts.end()) return {};
  const std::string lambda = readable(r.number("lambda_um_per_kPa")) + " µm/kPa";
  if (by->second == "given") return sentence("space.lambda-given", lambda);
  const auto of_sums = r.find("lambda_of_sums_um_per_kPa");
  return sentence("space.lambda-chosen", by->second, lambda) +
         (of_sums ? " " + sentence("space.lambda-of-sums", readable(*of_sums)) : "");
}

std::string svg_of(const Path& file, const std::string& title, const std::string& caption) {
  if (!files::is_own_file(file)) return {};
  return fmt::format(
      "<figure><h3>{0}</h3><img alt=\"{0}\" style=\"width:100%\" src=\"{1}\"><figcaption>{2}</figcaption></figure>\n",
      html_escaped(title), data_address(file, "image/svg+xml"), html_escaped(caption));
}

std::string space_section(const SpaceResults& r) {
  const ColourScale colours = traction_colours(r);
  return section("In space", "<figure><h3>Tractions on the surface</h3>\n" + picture_in_space(r, colours) +
                                 legend(colour_bar(colours)) + "<figcaption>" + sentence("space.picture") +
                                 "</figcaption></figure>\n");
}

std::string map_section(const SpaceResults& r) {
  std::string html = "<div class=\"grid\">\n" + html_of(normal_map(r)) + html_of(tangential_map(r));
  for (const auto& map : {error_map(r), resolution_map(r)})
    if (map) html += html_of(*map);
  return section("Tractions", html + "</div>\n");
}

std::string data_section(const SpaceResults& r) {
  std::string html = "<div class=\"grid\">\n";
  for (const Figure& slice : bead_slices(r)) html += html_of(slice);
  return section(
      "Surface and beads",
      html + "</div>\n" + svg_of(r.folder / "3_surface/surface.svg", "The surface", sentence("space.surface-picture")));
}

std::string lambda_section(const SpaceResults& r) {
  const std::string text = how_lambda(r);
  if (text.empty()) return {};
  return section("Regularisation", "<p>" + html_escaped(text) + "</p>\n" +
                                       svg_of(r.folder / "4_traction/traction_lambda.svg", "Criteria by λ",
                                              sentence("space.lambda-picture")));
}

std::string force_section(const SpaceResults& r) {
  if (r.forces.empty()) return {};
  std::vector<PartForce> forces = r.forces;
  std::ranges::stable_sort(forces, std::greater{}, [](const PartForce& f) { return norm(f.force_nN); });
  Table table{
      "Forces of the adhesions",
      {number("adhesion"), number("force (nN)"), number("std. error (nN)"), number("Fx (nN)"), number("Fy (nN)"),
       number("Fz (nN), into the gel"), number("area (µm²)"), number("x (µm)"), number("y (µm)"), number("z (µm)")}};
  for (const PartForce& f : forces) {
    const std::optional<int> decimals = decimals_for(f.magnitude_sigma_nN);
    table.rows.push_back({std::to_string(f.adhesion_id), rounded(norm(f.force_nN), decimals),
                          rounded(f.magnitude_sigma_nN, decimals), rounded(f.force_nN.x, decimals),
                          rounded(f.force_nN.y, decimals), rounded(f.force_nN.z, decimals), rounded(f.area_um2, 2),
                          fmt::format("{:.1f}", f.position_um.x), fmt::format("{:.1f}", f.position_um.y),
                          fmt::format("{:.1f}", f.position_um.z)});
  }
  const Path file = r.folder / "4_traction/traction_adhesion_forces.csv";
  return section(
      "Forces of the adhesions",
      paragraph("space.adhesions") + html_of(table, {r.name + "_" + file.filename().string(), files::read_text(file)}));
}

std::string methods(const SpaceResults& r, const Provenance& provenance) {
  std::vector<double> sigma, sigma_z;
  int n_good = 0;
  for (const BeadInSpace& bead : r.beads) {
    if (!bead.flag.empty()) continue;
    ++n_good;
    sigma.push_back(bead.sigma_um);
    sigma_z.push_back(bead.sigma_z_um);
  }
  std::string text = sentence("space.methods", program_of(provenance), n_good);
  if (!sigma.empty() && numerics::median(sigma) > 0)
    text += sentence("space.methods-noise", readable(1000 * numerics::median(sigma)),
                     readable(1000 * numerics::median(sigma_z)));
  return text + sentence("space.methods-fit", readable(r.gel.youngs_modulus_kPa), readable(r.gel.poisson_ratio),
                         readable(r.gel.thickness_um), readable(r.number("spacing_x_um")),
                         readable(r.number("spacing_y_um")), r.number("n_unknowns"), r.texts.at("method"),
                         r.texts.at("tractions_over"), how_lambda(r), readable(r.number("relative_l2")));
}

std::string figure_pairs(const SpaceResults& r) {
  std::vector<std::pair<std::string, std::string>> pairs;
  for (const auto& [name, value] : r.texts) pairs.emplace_back(name, value);
  for (const auto& [name, value] : r.numbers) pairs.emplace_back(name, readable(value));
  return html_of_pairs("The reconstruction in numbers", pairs);
}

}  // namespace

CellPage page_in_space(const Path& cell, const Provenance& provenance) {
  const SpaceResults r = read_space_results(cell);
  return {.name = r.name,
          .what = sentence("space.subtitle"),
          .sub = sentence("space.gel", readable(r.gel.youngs_modulus_kPa), readable(r.gel.poisson_ratio),
                          readable(r.gel.thickness_um), provenance.kind_because),
          .facts = facts_of(r),
          .body = truth_section(cell) + space_section(r) + map_section(r) + force_section(r) + data_section(r) +
                  lambda_section(r),
          .methods = methods(r, provenance),
          .figures = folded("Figures of the tractions", figure_pairs(r))};
}

Result result_in_space(const Path& cell, const Path& report) {
  const SpaceResults r = read_space_results(cell);
  const Sum force = sum_of(r, "net_force", "nN");
  const std::optional<double> total_sigma_nN = r.find("total_force_sigma_nN");
  const std::string line = "total force " + with_error(r.number("total_force_nN"), total_sigma_nN, "nN") +
                           "; net force " + with_error(force.size, force.sigma, "nN") + "; strain energy " +
                           readable(r.number("strain_energy_fJ")) + " fJ";
  const nlohmann::ordered_json event = {{"event", "result"},
                                        {"total_force_nN", r.number("total_force_nN")},
                                        {"total_force_error_nN", files::json_of(total_sigma_nN)},
                                        {"net_force_nN", force.size},
                                        {"net_force_error_nN", files::json_of(force.sigma)},
                                        {"strain_energy_fJ", r.number("strain_energy_fJ")},
                                        {"report", report.string()}};
  return {line, files::json_text(event) + "\n"};
}

}  // namespace mbtfm::report
