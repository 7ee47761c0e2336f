/// A time series, picture by picture.
#include <fmt/format.h>

#include <algorithm>

#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/own_files.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/page.h"
#include "pipeline/report/report.h"
#include "pipeline/report/results.h"
#include "pipeline/report/texts.h"

namespace mbtfm::report {
namespace {

using charts::Chart;

struct Frame {
  int number = 1;
  double time = 1;  ///< s, or its number
  double force_nN = 0, sigma_nN = 0;
  std::map<int, double> tensions_nN = {};  ///< by fibre
  VectorField displacement = {};           ///< means over squares
};

std::vector<Frame> frames_of(const Path& cell, const Extent& box) {
  const files::CsvTable table(cell / "4_fit/frames.csv"), tracks(cell / "4_fit/tracks.csv");
  std::vector<Frame> frames;
  double side_um = 0;
  for (int row = 0; row < table.n_rows(); ++row) {
    const auto force_nN = table.optional_number(row, "total_force_nN");
    if (!force_nN) continue;
    Frame& frame = frames.emplace_back();
    frame.number = table.integer(row, "frame", 1);
    frame.time = table.optional_number(row, "time_s").value_or(frame.number);
    frame.force_nN = *force_nN;
    frame.sigma_nN = table.optional_number(row, "total_force_sigma_nN").value_or(0);
    const VectorField all =
        displacement_of(files::read_displacement(cell / "2_track" / files::displacement_of_frame(frame.number)));
    if (side_um == 0) side_um = averaging_side_um(all, box);
    frame.displacement = averaged(all, box, side_um).means;
  }
  for (int row = 0; row < tracks.n_rows(); ++row) {
    const auto frame = std::ranges::find(frames, tracks.integer(row, "frame", 1), &Frame::number);
    const int fibre = tracks.integer(row, "fibre_id", 0);
    if (frame != frames.end() && fibre > 0) frame->tensions_nN[fibre] = tracks.number(row, "tension_nN");
  }
  return frames;
}

Chart map_of(const Frame& frame, const CellResults& results, const Extent& box, const ColourScale& colours,
             const ArrowScale& arrows) {
  Chart map = empty_map(box, "Tensions and displacement");
  if (results.images) map.picture(box.low_um, box.high_um, data_address(results.images->file, "image/jpeg"));
  map.polygon(results.cell.outline_um, "fill:none;stroke-width:1.3;stroke:#aaa");
  for (const Fibre& fibre : results.cell.fibres) {
    const auto tension = frame.tensions_nN.find(fibre.fibre_id);
    if (tension == frame.tensions_nN.end()) continue;
    map.curve(fibre.points_um, "stroke-width:6;stroke-linecap:round;stroke:#fff");
    map.curve(fibre.points_um, "stroke-width:4;stroke-linecap:round;stroke:" + colours.colour(tension->second));
  }
  const char* const ink = results.images ? "stroke-width:1.4;stroke:#ffe14d" : "stroke-width:1.4;stroke:#111";
  for (std::size_t i = 0; i < frame.displacement.vectors.size(); ++i)
    map.arrow(frame.displacement.positions_um[i], arrows.px_per_unit * frame.displacement.vectors[i], ink);
  return map;
}

Chart curve_of(const std::vector<Frame>& frames, const Frame& now, bool has_times) {
  std::vector<double> times, forces{0};
  std::vector<Vec2> points;
  for (const Frame& frame : frames) {
    times.push_back(frame.time);
    forces.push_back(frame.force_nN + frame.sigma_nN);
    points.push_back({frame.time, frame.force_nN});
  }
  Chart chart("Total force", charts::axis_over(has_times ? "time (s)" : "frame", times, charts::Scale::linear),
              charts::axis_over("force (nN)", forces, charts::Scale::linear));
  chart.curve(points, "fill:none;stroke-width:1.6;stroke:#888");
  for (const Frame& f : frames)
    chart.error({f.time, f.force_nN - f.sigma_nN}, {f.time, f.force_nN + f.sigma_nN}, "stroke-width:1;stroke:#888");
  chart.dot({now.time, now.force_nN}, 6, "fill:#d55e00;stroke:#fff;stroke-width:1.5");
  chart.subtitle(fmt::format("frame {}{}: {} nN", now.number, has_times ? fmt::format(", {:g} s", now.time) : "",
                             readable(now.force_nN)),
                 "#333");
  return chart;
}

/// The colours of the tensions, as a chart.
Chart bar_of(const ColourScale& colours) {
  constexpr int kSteps = 60;
  Chart bar("", {colours.label, 0, colours.high}, charts::row_axis({""}));
  bar.frame_height(14);
  for (int k = 0; k < kSteps; ++k)
    bar.bar({colours.high * k / kSteps, -1}, {colours.high * (k + 1) / kSteps, 1},
            "stroke:none;fill:" + colours.colour(colours.high * (k + 0.5) / kSteps));
  return bar;
}

}  // namespace

std::vector<std::string> drawings_of_series(const Path& cell) {
  if (!files::is_own_file(cell / "4_fit/frames.csv")) return {};
  const CellResults results = read_results(cell);
  const auto [low, high] = extent_of(results.cell.outline_um);
  constexpr double kMargin_um = 3;
  const Extent box = results.images ? results.images->place
                                    : Extent{low - Vec2{kMargin_um, kMargin_um}, high + Vec2{kMargin_um, kMargin_um}};
  const std::vector<Frame> frames = frames_of(cell, box);
  ColourScale colours{.low = 0, .high = 0, .label = "fitted tension (nN)"};
  std::vector<Vec2> vectors;
  for (const Frame& frame : frames) {
    for (const auto& [fibre, tension_nN] : frame.tensions_nN) colours.high = std::max(colours.high, tension_nN);
    vectors.insert(vectors.end(), frame.displacement.vectors.begin(), frame.displacement.vectors.end());
  }
  colours.high = round_end(colours.high);
  const ArrowScale arrows = arrow_scale(vectors);
  const bool has_times = std::ranges::any_of(frames, [](const Frame& frame) { return frame.time != frame.number; });
  std::vector<std::string> drawings;
  for (const Frame& frame : frames) {
    std::vector<Chart> all = {map_of(frame, results, box, colours, arrows), curve_of(frames, frame, has_times)};
    if (colours.high > 0) all.push_back(bar_of(colours));
    drawings.push_back(charts::svg_file(all, 2, {sentence("maps.series", readable(arrows.top))}));
  }
  return drawings;
}

}  // namespace mbtfm::report
