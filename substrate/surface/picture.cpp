#include "substrate/surface/picture.h"

#include <algorithm>
#include <cmath>

#include "pipeline/charts/chart.h"
#include "pipeline/charts/colour_map.h"

namespace mbtfm::surface {
namespace {

constexpr charts::ColourMap kHeights = charts::ColourMap::viridis;

struct HeightRange {
  double low, high;
  double share(double z) const { return high > low ? (z - low) / (high - low) : 0.5; }
};
HeightRange range_of(const HeightMap& map) {
  const auto [low, high] = std::ranges::minmax_element(map.z_um);
  return {*low, *high};
}

/// Lines of one height through the squares of the lattice (marching squares).
std::vector<std::pair<Vec2, Vec2>> contour(const HeightMap& map, double z_um) {
  std::vector<std::pair<Vec2, Vec2>> pieces;
  for (int j = 0; j + 1 < map.n_y; ++j) {
    for (int i = 0; i + 1 < map.n_x; ++i) {
      constexpr std::array<std::array<int, 2>, 4> kRound = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
      std::vector<Vec2> crossings;
      for (int k = 0; k < 4; ++k) {
        const auto [a, b] = kRound[k];
        const auto [c, d] = kRound[(k + 1) % 4];
        const double from = map.z_um[i + a + map.n_x * (j + b)] - z_um, to = map.z_um[i + c + map.n_x * (j + d)] - z_um;
        if ((from < 0) == (to < 0)) continue;
        const double share = from / (from - to);
        crossings.push_back(map.place_um(i + a + share * (c - a), j + b + share * (d - b)));
      }
      for (std::size_t k = 0; k + 1 < crossings.size(); k += 2) pieces.emplace_back(crossings[k], crossings[k + 1]);
    }
  }
  return pieces;
}

charts::Chart map_chart(const HeightMap& map, const std::string& image_address, const std::vector<Vec2>& off_um) {
  const Vec2 half = 0.5 * map.spacing_um, low = map.origin_um - half, high = map.high_um() + half;
  charts::Chart chart("Height of the gel's surface, z (µm)", {.label = "x (µm)", .low = low.x, .high = high.x},
                      {.label = "y (µm)", .low = high.y, .high = low.y});
  chart.same_scales();
  chart.picture(low, high, image_address);
  const HeightRange range = range_of(map);
  for (const double z : charts::ticks(range.low, range.high)) {
    if (z <= range.low || z >= range.high) continue;
    const auto line = contour(map, z);
    if (line.empty()) continue;
    chart.pieces(line, "stroke:#ffffff;stroke-width:0.8;fill:none", "z = " + charts::readable(z) + " µm");
    chart.label(line[line.size() / 2].first, charts::readable(z));
  }
  const double arm = 0.008 * norm(high - low);
  std::vector<std::pair<Vec2, Vec2>> crosses;
  for (const Vec2 p : off_um) {
    crosses.emplace_back(p - Vec2{arm, arm}, p + Vec2{arm, arm});
    crosses.emplace_back(p - Vec2{arm, -arm}, p + Vec2{arm, -arm});
  }
  if (!crosses.empty()) {
    chart.pieces(crosses, "stroke:#D55E00;stroke-width:1.2;fill:none", "off the surface");
    chart.key("off the surface", "#D55E00");
  }
  return chart;
}

charts::Chart sections_chart(const HeightMap& map) {
  struct Section {
    std::string name;
    std::vector<Vec2> line, band;
  };
  const auto section = [&](std::string name, int n, auto vertex, auto place) {
    Section s{std::move(name), {}, {}};
    std::vector<Vec2> back;
    for (int k = 0; k < n; ++k) {
      const std::size_t at = vertex(k);
      const double z = map.z_um[at], error = map.sigma_um.empty() ? 0 : map.sigma_um[at];
      s.line.push_back({place(k), z});
      s.band.push_back({place(k), z - error});
      back.push_back({place(k), z + error});
    }
    s.band.insert(s.band.end(), back.rbegin(), back.rend());
    return s;
  };
  const int i = map.n_x / 2, j = map.n_y / 2;
  const double x_um = map.origin_um.x + i * map.spacing_um.x, y_um = map.origin_um.y + j * map.spacing_um.y;
  const std::vector<Section> sections = {section(
                                             "along x, at y = " + charts::readable(y_um) + " µm", map.n_x,
                                             [&](int k) { return static_cast<std::size_t>(j) * map.n_x + k; },
                                             [&](int k) { return map.origin_um.x + k * map.spacing_um.x; }),
                                         section(
                                             "along y, at x = " + charts::readable(x_um) + " µm", map.n_y,
                                             [&](int k) { return static_cast<std::size_t>(k) * map.n_x + i; },
                                             [&](int k) { return map.origin_um.y + k * map.spacing_um.y; })};
  std::vector<double> places, heights;
  for (const Section& s : sections) {
    for (const Vec2 p : s.band) {
      places.push_back(p.x);
      heights.push_back(p.y);
    }
  }
  charts::Axis z = charts::axis_over("z, into the gel (µm)", heights, charts::Scale::linear);
  z.low -= 0.25 * (z.high - z.low);  // room for the key
  std::swap(z.low, z.high);
  charts::Chart chart("Sections through the middle", charts::axis_over("x or y (µm)", places, charts::Scale::linear),
                      z);
  for (std::size_t k = 0; k < sections.size(); ++k) {
    const std::string colour = charts::kColours[k];
    if (!map.sigma_um.empty()) chart.polygon(sections[k].band, "stroke:none;fill-opacity:0.25;fill:" + colour);
    chart.curve(sections[k].line, "fill:none;stroke-width:1.5;stroke:" + colour, sections[k].name);
    chart.key(sections[k].name, colour);
  }
  return chart;
}

}  // namespace

std::vector<std::uint8_t> colours_of(const HeightMap& map) {
  const HeightRange range = range_of(map);
  std::vector<std::uint8_t> rgb;
  for (const double z : map.z_um) {
    for (const double c : charts::colour_at(kHeights, range.share(z)))
      rgb.push_back(static_cast<std::uint8_t>(std::lround(c)));
  }
  return rgb;
}

std::string picture_of(const HeightMap& map, const std::string& image_address, const std::vector<Vec2>& off_um,
                       const std::string& from) {
  const std::vector<std::string> caption = {
      from, map.sigma_um.empty()
                ? "z points into the gel."
                : "z points into the gel; the bands in the sections are one standard error to each side."};
  return charts::svg_file({map_chart(map, image_address, off_um), sections_chart(map)}, 2, caption);
}

}  // namespace mbtfm::surface
