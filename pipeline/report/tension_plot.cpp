#include "pipeline/report/tension_plot.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/report/svg.h"

namespace mbtfm::report {
namespace {

constexpr double kWidth_px = 560, kLeft_px = 104, kRight_px = 16, kRow_px = 20, kTop_px = 34, kBottom_px = 46;

/// Largest value to show.
double largest_nN(const std::vector<FibreRow>& rows) {
  double largest = 0;
  for (const FibreRow& row : rows) {
    largest =
        std::max({largest, row.tension.tension_nN, row.tension.high_nN.value_or(0), row.true_tension_nN.value_or(0)});
  }
  return largest > 0 ? 1.03 * largest : 1;
}

std::string axis(double largest, double px_per_nN, double bottom) {
  std::string svg;
  const double step = round_below(largest / 4);
  for (int i = 0; i * step <= largest; ++i) {
    const double x = kLeft_px + px_per_nN * i * step;
    svg += fmt::format(
        "<path d=\"M{0:.1f},{1}V{2:.1f}\" class=\"grid\"/><text x=\"{0:.1f}\" y=\"{3:.1f}\" "
        "text-anchor=\"middle\">{4}</text>",
        x, kTop_px, bottom, bottom + 17, readable(i * step));
  }
  return svg + fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">tension (nN)</text>\n",
                           (kLeft_px + kWidth_px - kRight_px) / 2, bottom + 37);
}

std::string mark(double x, double y, const char* colour, bool is_filled) {
  return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4.5\" style=\"stroke:{};stroke-width:2;fill:{}\"/>", x, y,
                     colour, is_filled ? colour : "#fff");
}

std::string truth_mark(double x, double y) {
  return fmt::format("<path d=\"M{:.1f},{:.1f}l5,5l-5,5l-5,-5z\" style=\"fill:#fff;stroke:#000;stroke-width:1.4\"/>", x,
                     y - 5);
}

std::string legend(bool has_truth, bool has_unidentifiable) {
  std::string svg = mark(kLeft_px, 14, "#555", true) +
                    fmt::format("<path d=\"M{:.0f},14h26\" style=\"stroke:#555;stroke-width:2\"/>", kLeft_px - 13) +
                    fmt::format("<text x=\"{:.0f}\" y=\"19\">fit, 95 % interval</text>", kLeft_px + 20);
  if (has_truth) {
    svg += truth_mark(kLeft_px + 188, 14) + fmt::format("<text x=\"{:.0f}\" y=\"19\">truth</text>", kLeft_px + 199);
  }
  if (has_unidentifiable) {
    svg += mark(kLeft_px + 268, 14, "#555", false) +
           fmt::format("<text x=\"{:.0f}\" y=\"19\">not identifiable</text>", kLeft_px + 279);
  }
  return svg + "\n";
}

std::string row_of(const FibreRow& row, double y, double px_per_nN) {
  const char* colour = colour_of(row.fibre->type);
  const double x = kLeft_px + px_per_nN * row.tension.tension_nN;
  std::string hover = fmt::format("fibre {} ({}): {} nN", row.fibre->fibre_id, full_name_of(row.fibre->type),
                                  readable(row.tension.tension_nN));
  std::string svg;
  if (row.tension.low_nN && row.tension.high_nN) {
    hover += fmt::format(" [{}, {}]", readable(*row.tension.low_nN), readable(*row.tension.high_nN));
    svg += fmt::format(
        "<path d=\"M{0:.1f},{1:.1f}H{2:.1f}M{0:.1f},{3:.1f}v8M{2:.1f},{3:.1f}v8\" "
        "style=\"stroke:{4};stroke-width:2\"/>",
        kLeft_px + px_per_nN * *row.tension.low_nN, y, kLeft_px + px_per_nN * *row.tension.high_nN, y - 4, colour);
  }
  svg += mark(x, y, colour, row.tension.identifiable);
  if (row.true_tension_nN) {
    hover += ", truth " + readable(*row.true_tension_nN);
    svg += truth_mark(kLeft_px + px_per_nN * *row.true_tension_nN, y);
  }
  return fmt::format("<g><title>{}</title><text x=\"{:.0f}\" y=\"{:.1f}\" text-anchor=\"end\">{} {}</text>{}</g>\n",
                     html_escaped(hover), kLeft_px - 8, y + 5, name_of(row.fibre->type), row.fibre->fibre_id, svg);
}

}  // namespace

const char* colour_of(FibreType type) {
  switch (type) {
    case FibreType::dorsal:
      return "#0072B2";
    case FibreType::arc:
      return "#B87A00";
    case FibreType::ventral:
      return "#00805C";
  }
  return "#555";
}

const char* full_name_of(FibreType type) {
  switch (type) {
    case FibreType::dorsal:
      return "dorsal";
    case FibreType::arc:
      return "transverse arc";
    case FibreType::ventral:
      return "ventral";
  }
  return "";
}

std::vector<FibreRow> fibre_rows(const CellResults& results) {
  std::vector<FibreRow> rows;
  for (const Fibre& fibre : results.cell.fibres) {
    const auto tension = results.tensions.find(fibre.fibre_id);
    if (tension == results.tensions.end()) continue;
    FibreRow row;
    row.fibre = &fibre;
    row.tension = tension->second;
    if (results.comparison) {
      for (const ComparedFibre& compared : results.comparison->fibres) {
        if (!compared.found || compared.found->fibre_id != fibre.fibre_id || !compared.truth) continue;
        row.true_tension_nN = compared.true_tension_nN;
        row.true_fibre_id = compared.truth->fibre_id;
        row.true_type = compared.truth->type;
      }
    }
    rows.push_back(row);
  }
  std::stable_sort(rows.begin(), rows.end(), [](const FibreRow& a, const FibreRow& b) {
    return a.fibre->type != b.fibre->type ? a.fibre->type < b.fibre->type : a.tension.tension_nN > b.tension.tension_nN;
  });
  return rows;
}

std::string tension_plot(const CellResults& results) {
  const std::vector<FibreRow> rows = fibre_rows(results);
  const double largest = largest_nN(rows);
  const double px_per_nN = (kWidth_px - kLeft_px - kRight_px) / largest;
  const double bottom = kTop_px + kRow_px * static_cast<double>(rows.size());
  const bool has_unidentifiable =
      std::any_of(rows.begin(), rows.end(), [](const FibreRow& row) { return !row.tension.identifiable; });
  std::string svg = fmt::format("<svg viewBox=\"0 0 {} {:.0f}\" role=\"img\" aria-label=\"tensions of the fibres\">\n",
                                kWidth_px, bottom + kBottom_px);
  svg += axis(largest, px_per_nN, bottom) + legend(results.comparison.has_value(), has_unidentifiable);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    svg += row_of(rows[i], kTop_px + kRow_px * (static_cast<double>(i) + 0.5), px_per_nN);
  }
  return svg + "</svg>\n";
}

}  // namespace mbtfm::report
