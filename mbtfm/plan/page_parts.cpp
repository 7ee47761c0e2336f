#include "mbtfm/plan/page_parts.h"

#include <algorithm>

#include "pipeline/contract/numbers.h"
#include "pipeline/contract/version.h"

namespace mbtfm::plan {

namespace {

std::string colour(std::size_t k) { return charts::kColours[k % std::size(charts::kColours)]; }

std::string dashed(const Asked& asked) { return "Dashed: the target of " + brief(asked.target_nN) + " nN."; }

}  // namespace

charts::Chart error_chart(const Asked& asked, double noise_um, const std::string& density,
                          const std::vector<double>& densities, const std::string& what, std::vector<double> all_errors,
                          const std::function<std::vector<ErrorDot>(double)>& dots_of) {
  all_errors.push_back(asked.target_nN);
  charts::Chart chart(
      "Noise " + brief(noise_um) + " µm", charts::axis_over(density, densities, charts::Scale::logarithmic),
      charts::axis_over("standard error of the " + what + " (nN)", all_errors, charts::Scale::logarithmic));
  for (std::size_t k = 0; k < asked.youngs_modulus_kPa.size(); ++k) {
    const std::string gel = brief(asked.youngs_modulus_kPa[k]) + " kPa";
    std::vector<Vec2> points;
    for (const ErrorDot& dot : dots_of(asked.youngs_modulus_kPa[k])) {
      points.push_back({dot.density, dot.standard_error_nN});
      chart.dot(points.back(), 3.5, "fill:" + colour(k) + ";stroke:#fff",
                gel + ", " + brief(dot.density) + " " + density + ": " + brief(dot.standard_error_nN) +
                    " nN, of which " + brief(dot.from_beads_nN) + " by the beads" + dot.further);
    }
    chart.curve(points, "fill:none;stroke-width:2;stroke:" + colour(k));
    chart.key(gel, colour(k));
  }
  chart.level(asked.target_nN, "stroke:#333;stroke-width:1.5;stroke-dasharray:6 4");
  return chart;
}

std::string svg_of(const std::vector<charts::Chart>& charts, const std::string& what, const Asked& asked) {
  return charts::svg_file(charts, std::min<int>(2, static_cast<int>(charts.size())), {what, dashed(asked)});
}

std::string figures_of(const std::vector<charts::Chart>& charts, const Asked& asked) {
  std::string html;
  for (const charts::Chart& chart : charts) html += report::figure(chart, dashed(asked));
  return html;
}

charts::Chart drawn_chart(const std::string& what, const std::vector<DrawnDot>& dots) {
  std::vector<double> both;
  for (const DrawnDot& d : dots) both.insert(both.end(), {d.true_nN, d.found_nN});
  charts::Chart chart("Drawn experiments", charts::axis_over("true " + what + " (nN)", both, charts::Scale::linear),
                      charts::axis_over("found, ± predicted standard error (nN)", both, charts::Scale::linear));
  const auto [least, most] = std::ranges::minmax(both);
  const double from = std::min(0.0, least);
  chart.curve({{from, from}, {most, most}}, "fill:none;stroke:#999;stroke-width:1");
  for (const DrawnDot& d : dots) {
    const std::string of = colour(static_cast<std::size_t>(d.experiment));
    chart.error({d.true_nN, d.found_nN - d.predicted_error_nN}, {d.true_nN, d.found_nN + d.predicted_error_nN},
                "stroke-width:1;stroke:" + of);
    chart.dot({d.true_nN, d.found_nN}, 3, "fill:" + of + ";stroke:#fff",
              d.name + ": true " + brief(d.true_nN) + " nN, found " + brief(d.found_nN) + " ± " +
                  brief(d.predicted_error_nN) + " nN");
  }
  return chart;
}

report::Table needed_rows(const Asked& asked, const std::vector<Needed>& needed,
                          const std::function<std::string(const Needed&)>& text_of) {
  report::Table table{.columns = {number("gel (kPa)")}};
  for (const double noise_um : asked.noise_um) table.columns.push_back(number("noise " + brief(noise_um) + " µm"));
  for (const double E : asked.youngs_modulus_kPa) {
    std::vector<std::string> row = {brief(E)};
    for (const Needed& n : needed)
      if (n.youngs_modulus_kPa == E) row.push_back(text_of(n));
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string paragraphs(const std::vector<std::string>& texts) {
  std::string html;
  for (const std::string& text : texts) html += "<p>" + report::html_escaped(text) + "</p>\n";
  return html;
}

std::string head_of(const std::string& name, const std::string& answer, const std::vector<std::string>& further) {
  return "<h1>Plan: " + report::html_escaped(name) + "</h1><p class=\"sub\">mbtfm " + std::string(kVersion) +
         "</p>\n<p><b>" + report::html_escaped(answer) + "</b></p>\n" + paragraphs(further);
}

}  // namespace mbtfm::plan
