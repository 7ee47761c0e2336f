#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "pipeline/charts/chart.h"
#include "pipeline/report/tension_plot.h"
#include "pipeline/statistics/rank_tests.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {
namespace {

using charts::html_escaped;
using charts::readable;
using charts::round_below;

constexpr double kWidth_px = 560, kHeight_px = 360, kLeft_px = 62, kTop_px = 16, kRight_px = 16, kBottom_px = 56;
constexpr double kInkWidth_px = kWidth_px - kLeft_px - kRight_px, kInkHeight_px = kHeight_px - kTop_px - kBottom_px;

/// Opens a figure that can also stand alone as a file.
std::string begin(const std::string& label) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\" "
      "font-family=\"system-ui,DejaVu Sans,sans-serif\" font-size=\"14\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
      kWidth_px, kHeight_px, html_escaped(label));
}

double y_of(double value, double largest) { return kTop_px + kInkHeight_px * (1 - value / largest); }
double x_of(double value, double largest) { return kLeft_px + kInkWidth_px * value / largest; }

std::string y_axis(double largest, const std::string& label) {
  std::string svg;
  const double step = round_below(largest / 3);
  for (int i = 0; i * step <= largest; ++i) {
    svg += fmt::format(
        "<path d=\"M{0},{1:.1f}H{2}\" stroke=\"#e3e5e8\"/><text x=\"{3}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">{5}</text>",
        kLeft_px, y_of(i * step, largest), kWidth_px - kRight_px, kLeft_px - 6, y_of(i * step, largest) + 5,
        readable(i * step));
  }
  return svg + fmt::format("<text transform=\"translate(16,{:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                           kTop_px + kInkHeight_px / 2, html_escaped(label));
}

std::string x_axis(double largest, const std::string& label) {
  std::string svg;
  const double step = round_below(largest / 4);
  for (int i = 0; i * step <= largest; ++i) {
    svg += fmt::format(
        "<path d=\"M{0:.1f},{1}v4\" stroke=\"#444\"/><text x=\"{0:.1f}\" y=\"{2}\" "
        "text-anchor=\"middle\">{3}</text>",
        x_of(i * step, largest), kTop_px + kInkHeight_px, kTop_px + kInkHeight_px + 18, readable(i * step));
  }
  return svg + fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n",
                           kLeft_px + kInkWidth_px / 2, kTop_px + kInkHeight_px + 40, html_escaped(label));
}

/// Between −0.5 and 0.5, evenly spread whatever the number of points (golden ratio).
double spread(int i) {
  constexpr double kGolden = 0.61803398874989485;
  return std::fmod(i * kGolden, 1.0) - 0.5;
}

}  // namespace

std::string tensions_by_type_svg(const Study& study) {
  std::map<FibreType, std::vector<MeasuredFibre>> by_type;
  double largest = 0;
  for (const MeasuredFibre& f : measured_fibres(study)) {
    by_type[f.fibre->type].push_back(f);
    largest = std::max(largest, f.tension->tension_nN);
  }
  largest = largest > 0 ? 1.05 * largest : 1;
  std::string svg = begin("tension by fibre type") + y_axis(largest, "tension (nN)");
  constexpr double kColumn_px = kInkWidth_px / std::size(kFibreTypes);
  for (std::size_t i = 0; i < std::size(kFibreTypes); ++i) {
    const FibreType type = kFibreTypes[i];
    const auto& fibres = by_type[type];
    const double centre = kLeft_px + kColumn_px * (static_cast<double>(i) + 0.5);
    std::vector<double> tensions;
    for (const MeasuredFibre& f : fibres) {
      tensions.push_back(f.tension->tension_nN);
      svg += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\" fill-opacity=\".6\"><title>{}, fibre "
          "{}: {} nN</title></circle>\n",
          centre + 0.5 * kColumn_px * spread(static_cast<int>(tensions.size())), y_of(tensions.back(), largest),
          report::colour_of(type), html_escaped(f.cell->name), f.fibre->fibre_id, readable(tensions.back()));
    }
    if (!tensions.empty()) {
      svg += fmt::format("<path d=\"M{:.1f},{:.1f}h{:.1f}\" stroke=\"#000\" stroke-width=\"2.5\"/>\n",
                         centre - 0.3 * kColumn_px, y_of(describe(tensions).median, largest), 0.6 * kColumn_px);
    }
    svg += fmt::format(
        "<text x=\"{0:.1f}\" y=\"{1}\" text-anchor=\"middle\">{2}</text><text x=\"{0:.1f}\" y=\"{3}\" "
        "text-anchor=\"middle\" fill=\"#555\">n = {4}</text>\n",
        centre, kTop_px + kInkHeight_px + 20, report::full_name_of(type), kTop_px + kInkHeight_px + 40, fibres.size());
  }
  return svg + "</svg>\n";
}

std::string forces_by_cell_svg(const Study& study) {
  std::vector<const StudyCell*> cells;
  double largest = 0;
  for (const StudyCell& cell : study.cells) {
    cells.push_back(&cell);
    largest = std::max(largest, 1.05 * cell.fit.total_force_nN);
  }
  if (!(largest > 0)) largest = 1;
  std::stable_sort(cells.begin(), cells.end(), [](const StudyCell* a, const StudyCell* b) {
    return a->fit.total_force_nN > b->fit.total_force_nN;
  });
  std::string svg = begin("total force by cell") + y_axis(largest, "total force (nN)");
  const double column = kInkWidth_px / static_cast<double>(cells.size());
  const double bar = std::min(60.0, 0.8 * column);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const FitSummary& fit = cells[i]->fit;
    const double left = kLeft_px + column * (static_cast<double>(i) + 0.5) - bar / 2;
    const double network = std::clamp(fit.network_force_nN, 0.0, fit.total_force_nN);
    const double y_network = y_of(network, largest), y_total = y_of(fit.total_force_nN, largest);
    svg += fmt::format(
        "<g><title>{}: {} nN, of the network {} nN</title><rect x=\"{:.1f}\" y=\"{:.1f}\" "
        "width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#0072B2\"/>",
        html_escaped(cells[i]->name), readable(fit.total_force_nN), readable(network), left, y_total, bar,
        y_network - y_total);
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"#c9ccd1\"/></g>\n",
                       left, y_network, bar, kTop_px + kInkHeight_px - y_network);
  }
  svg += fmt::format(
      "<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{} cells; blue: fibres, grey: actin network"
      "</text>\n",
      kLeft_px + kInkWidth_px / 2, kTop_px + kInkHeight_px + 30, cells.size());
  return svg + "</svg>\n";
}

std::string adhesion_forces_svg(const Study& study) {
  struct Point {
    double area_um2, force_nN;
    bool connected;
  };
  std::vector<Point> points;
  double largest_area = 0, largest_force = 0;
  for (const StudyCell& cell : study.cells) {
    std::map<int, double> area;
    for (const Adhesion& adhesion : cell.cell.adhesions) area[adhesion.adhesion_id] = adhesion.area_um2;
    for (const AdhesionForce& force : cell.forces) {
      points.push_back({area.at(force.adhesion_id), norm(force.force_nN), force.connected});
      largest_area = std::max(largest_area, 1.05 * points.back().area_um2);
      largest_force = std::max(largest_force, 1.05 * points.back().force_nN);
    }
  }
  if (!(largest_force > 0)) largest_force = 1;
  std::string svg = begin("force against area of the adhesions") + y_axis(largest_force, "force (nN)");
  svg += x_axis(largest_area, "area (µm²)");
  for (const Point& p : points) {
    svg += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.6\" stroke=\"#0072B2\" fill=\"{}\" "
        "fill-opacity=\".7\"/>\n",
        x_of(p.area_um2, largest_area), y_of(p.force_nN, largest_force), p.connected ? "#0072B2" : "#fff");
  }
  return svg + "</svg>\n";
}

}  // namespace mbtfm::statistics
