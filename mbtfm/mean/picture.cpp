#include <algorithm>
#include <cmath>
#include <numbers>

#include "mbtfm/mean/outputs.h"
#include "pipeline/charts/chart.h"
#include "pipeline/charts/colour_map.h"
#include "pipeline/contract/counted.h"
#include "pipeline/contract/extent.h"

namespace mbtfm::mean {
namespace {

constexpr charts::ColourMap kTractions = charts::ColourMap::plasma;

struct Frame {
  charts::Axis x, y;
};
Frame frame_of(const Scene& scene) {
  const auto [low, high] = extent_of(scene.nodes, &NodeMean::position_um);
  return {{.label = "x (µm)", .low = low.x, .high = high.x}, {.label = "y (µm)", .low = high.y, .high = low.y}};
}

Polygon closed(Polygon polygon) {
  polygon.push_back(polygon.front());
  return polygon;
}

charts::Chart traction_chart(const Scene& scene) {
  const Frame frame = frame_of(scene);
  charts::Chart chart("Mean traction", frame.x, frame.y);
  chart.same_scales();
  double largest = 0;
  for (const NodeMean& node : scene.nodes) largest = std::max(largest, norm(node.mean.traction_kPa));
  const Vec2 half = 0.5 * scene.spacing_um * Vec2{1, 1};
  for (const NodeMean& node : scene.nodes) {
    const double size = norm(node.mean.traction_kPa);
    const std::string colour = charts::hex(charts::colour_at(kTractions, largest > 0 ? size / largest : 0));
    chart.bar(node.position_um - half, node.position_um + half, "fill:" + colour + ";stroke:" + colour);
  }
  chart.curve(closed(scene.reference_um), "stroke:#ffffff;stroke-width:1.2;fill:none");
  constexpr double kArrows = 18;  // along the longer side: so many can be distinguished
  constexpr double kLongest_px = 20;
  const double width = std::max(frame.x.high - frame.x.low, std::abs(frame.y.high - frame.y.low));
  const int every = std::max(1, static_cast<int>(std::lround(width / scene.spacing_um / kArrows)));
  const Vec2 first = scene.nodes.front().position_um;
  for (const NodeMean& node : scene.nodes) {
    const Vec2 at = (1 / scene.spacing_um) * (node.position_um - first);
    if (std::lround(at.x) % every != 0 || std::lround(at.y) % every != 0 || !(largest > 0)) continue;
    chart.arrow(node.position_um, (kLongest_px / largest) * node.mean.traction_kPa,
                "stroke:#ffffff;stroke-width:1;fill:none");
  }
  chart.put_key(charts::Chart::KeySide::above);
  chart.key("0 Pa", charts::hex(charts::colour_at(kTractions, 0)));
  chart.key("largest " + charts::readable(1000 * largest) + " Pa", charts::hex(charts::colour_at(kTractions, 1)));
  return chart;
}

charts::Chart outlines_chart(const Scene& scene) {
  const Frame frame = frame_of(scene);
  charts::Chart chart("Outlines laid onto the reference", frame.x, frame.y);
  chart.same_scales();
  for (const Polygon& outline : scene.outlines_um)
    chart.curve(closed(outline), "stroke:#4A9CC9;stroke-width:0.7;fill:none");
  chart.curve(closed(scene.reference_um), "stroke:#D55E00;stroke-width:1.6;fill:none");
  chart.put_key(charts::Chart::KeySide::above);
  chart.key("reference", "#D55E00");
  return chart;
}

/// Traction towards the centroid in the band along the edge, by the angle around it.
charts::Chart edge_chart(const Scene& scene) {
  constexpr int kSectors = 72;
  const Vec2 centre = centroid_um(scene.reference_um);
  std::vector<double> sum(kSectors, 0), error2(kSectors, 0);
  std::vector<int> n(kSectors, 0);
  for (const NodeMean& node : scene.nodes) {
    if (!node.is_inside || distance_to_boundary_um(scene.reference_um, node.position_um) > scene.band_um) continue;
    const Vec2 arm = node.position_um - centre, inward = (-1 / norm(arm)) * arm;
    const double turn = (std::atan2(arm.y, arm.x) + std::numbers::pi) / (2 * std::numbers::pi);
    const int sector = std::min(kSectors - 1, static_cast<int>(turn * kSectors));
    sum[sector] += 1000 * dot(node.mean.traction_kPa, inward);
    const Vec2 sigma = node.sigma.value_or(Sample{}).traction_kPa;
    error2[sector] += 1e6 * (std::pow(sigma.x * inward.x, 2) + std::pow(sigma.y * inward.y, 2));
    n[sector] += 1;
  }
  std::vector<Vec2> points;
  std::vector<double> values = {0};
  std::vector<std::pair<Vec2, Vec2>> bars;
  for (int k = 0; k < kSectors; ++k) {
    if (n[k] == 0) continue;
    const double angle = -180 + 360.0 * (k + 0.5) / kSectors, mean = sum[k] / n[k];
    const double error = std::sqrt(error2[k] / n[k]);  // neighbouring nodes of a mean err together
    points.push_back({angle, mean});
    bars.emplace_back(Vec2{angle, mean - error}, Vec2{angle, mean + error});
    values.insert(values.end(), {mean - error, mean + error});
  }
  charts::Chart chart("Traction towards the middle, along the edge", {.label = "angle (°)", .low = -180, .high = 180},
                      charts::axis_over("traction (Pa)", values, charts::Scale::linear));
  chart.level(0, "stroke:#999999;stroke-width:0.8");
  for (const auto& [low, high] : bars) chart.error(low, high, "stroke:#4A9CC9;stroke-width:1");
  chart.curve(points, "stroke:#0072B2;stroke-width:1.5;fill:none");
  return chart;
}

}  // namespace

std::string picture_of(const Scene& scene) {
  return charts::svg_file(
      {traction_chart(scene), outlines_chart(scene), edge_chart(scene)}, 2,
      {counted(std::ssize(scene.outlines_um), "cells") + ". Bars: the standard error, from the scatter of the cells.",
       "Edge: the part of the reference within " + charts::readable(scene.band_um) + " µm of its outline."});
}

}  // namespace mbtfm::mean
