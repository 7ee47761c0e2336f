#include <algorithm>
#include <map>
#include <optional>

#include "continuum/solids/outputs.h"
#include "pipeline/charts/chart.h"
#include "pipeline/charts/colour_map.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::solids {
namespace {

constexpr charts::ColourMap kDepths = charts::ColourMap::viridis;
constexpr const char* kNoEquilibrium = "#cccccc";

/// By height; none where there is no equilibrium.
using DepthByHeight = std::map<double, std::optional<double>>;
/// By ratio.
using Depths = std::map<double, DepthByHeight>;

Depths depths_of(const std::vector<Indentation>& solved, std::size_t read_at) {
  Depths depths;
  for (const Indentation& one : solved) {
    auto& depth = depths[one.of.modulus_ratio][one.of.height_um];
    if (!one.failure) depth = one.reading.depth_um[read_at];
  }
  return depths;
}

double largest_of(const Depths& depths) {
  double largest = 0;
  for (const auto& [ratio, by_height] : depths)
    for (const auto& [height, depth] : by_height) largest = std::max(largest, depth.value_or(0));
  return largest;
}

std::string read_at_text(const Setting& setting, std::size_t read_at) {
  const double depth = setting.depths_um[read_at];
  return depth == 0 ? std::string("at the surface") : charts::readable(depth) + " µm below the surface";
}

/// The depth at a height, between two that are solved.
std::optional<double> between_heights(const DepthByHeight& by_height, double height) {
  const auto above = by_height.lower_bound(height);
  if (above == by_height.begin()) return above->second;
  if (above == by_height.end()) return std::prev(above)->second;
  const auto below = std::prev(above);
  const double share = (height - below->first) / (above->first - below->first);
  if (!below->second || !above->second) return std::nullopt;
  return (1 - share) * *below->second + share * *above->second;
}

/// A stripe for each stiffness, coloured by depth along the heights.
charts::Chart map_chart(const Setting& setting, const Depths& depths, const std::vector<Optimum>& optima,
                        std::size_t read_at) {
  std::vector<double> heights;
  for (const auto& [height, depth] : depths.begin()->second) heights.push_back(height);
  charts::Axis rows{.label = "E gel / E cell", .low = -0.5, .high = static_cast<double>(depths.size()) - 0.5};
  int row = 0;
  for (const auto& [ratio, by_height] : depths) rows.names.emplace_back(row++, charts::readable(ratio));
  charts::Chart chart("Depth " + read_at_text(setting, read_at),
                      {.label = "height of the cell (µm)", .low = heights.front(), .high = heights.back()}, rows);
  const double largest = largest_of(depths);
  chart.subtitle("0 (dark) to " + charts::readable(largest) + " µm (yellow)", "#444444");
  constexpr int kStripes = 60;  // along a row: finer than the eye resolves colours
  row = 0;
  for (const auto& [ratio, by_height] : depths) {
    for (int k = 0; k < kStripes; ++k) {
      const double low = heights.front() + (heights.back() - heights.front()) * k / kStripes;
      const double high = heights.front() + (heights.back() - heights.front()) * (k + 1) / kStripes;
      const auto depth = between_heights(by_height, 0.5 * (low + high));
      const std::string colour = depth ? charts::hex(charts::colour_at(kDepths, *depth / largest)) : kNoEquilibrium;
      chart.bar({low, row - 0.5}, {high, row + 0.5}, "fill:" + colour + ";stroke:" + colour + ";stroke-width:0.5",
                "height " + charts::readable(0.5 * (low + high)) + " µm, ratio " + charts::readable(ratio) + ": " +
                    (depth ? charts::readable(*depth) + " µm" : "no equilibrium"));
    }
    for (const Optimum& best : optima) {
      if (best.modulus_ratio != ratio || best.read_at_um != setting.depths_um[read_at]) continue;
      const Vec2 error = {best.height_error_um, 0}, at = {best.height_um, static_cast<double>(row)};
      chart.error(at - error, at + error, "stroke:#ffffff;stroke-width:2");
      chart.diamond(at, 4.5, "fill:#D55E00;stroke:#ffffff;stroke-width:1",
                    charts::readable(best.height_um) + " ± " + charts::readable(best.height_error_um) + " µm");
    }
    ++row;
  }
  return chart;
}

/// Of neighbouring heights that are solved.
std::vector<std::vector<Vec2>> pieces_of(const DepthByHeight& by_height) {
  std::vector<std::vector<Vec2>> pieces(1);
  for (const auto& [height, depth] : by_height)
    if (depth)
      pieces.back().push_back({height, *depth});
    else if (!pieces.back().empty())
      pieces.emplace_back();
  if (pieces.back().empty()) pieces.pop_back();
  return pieces;
}

charts::Chart curves_chart(const Setting& setting, const Depths& depths, const std::vector<Optimum>& optima,
                           std::size_t read_at) {
  std::vector<double> heights;
  for (const auto& [height, depth] : depths.begin()->second) heights.push_back(height);
  charts::Chart chart("Depth over the height, by E gel / E cell",
                      charts::axis_over("height of the cell (µm)", heights, charts::Scale::linear),
                      {.label = "depth (µm)", .low = 0, .high = 1.1 * largest_of(depths)});
  std::size_t k = 0;
  for (const auto& [ratio, by_height] : depths) {
    const std::string colour = charts::kColours[k++ % std::size(charts::kColours)];
    for (const std::vector<Vec2>& points : pieces_of(by_height)) {
      chart.curve(points, "stroke:" + colour + ";stroke-width:1.6;fill:none", "ratio " + charts::readable(ratio));
      for (const Vec2 point : points) chart.dot(point, 2, "fill:" + colour);
    }
    for (const Optimum& best : optima)
      if (best.modulus_ratio == ratio && best.read_at_um == setting.depths_um[read_at])
        chart.diamond({best.height_um, best.depth_um}, 5, "fill:" + colour + ";stroke:#ffffff;stroke-width:1");
    chart.key(charts::readable(ratio), colour);
  }
  return chart;
}

}  // namespace

std::string picture_of(const Setting& setting, const std::vector<Indentation>& solved,
                       const std::vector<Optimum>& optima) {
  std::vector<charts::Chart> charts;
  for (std::size_t read_at = 0; read_at < setting.depths_um.size(); ++read_at) {
    const Depths depths = depths_of(solved, read_at);
    charts.push_back(map_chart(setting, depths, optima, read_at));
    charts.push_back(curves_chart(setting, depths, optima, read_at));
  }
  double error = 0;
  bool has_holes = false;
  for (const Indentation& one : solved) {
    error = std::max(error, one.error_um);
    has_holes = has_holes || one.failure;
  }
  std::vector<std::string> lines = {
      "Cells of " + charts::readable(setting.volume_um3) + " µm³ that contract with " +
          charts::readable(setting.cell.contraction_kPa) + " kPa, Poisson's ratio " +
          significant(setting.cell.poisson_ratio, 6) + ". Depth: the largest displacement into the gel.",
      "Diamonds: the height that presses deepest, with its error. On a coarser mesh depths differ by at most " +
          charts::readable(error) + " µm."};
  if (has_holes) lines.emplace_back("Grey: beside a case without an equilibrium.");
  return charts::svg_file(charts, 2, lines);
}

}  // namespace mbtfm::solids
