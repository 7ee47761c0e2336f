/// A graph of nodes that include each other: its levels, and its picture.
#pragma once

#include "tests/support/test.h"

namespace mbtfm::test {

/// By node: what it includes.
using Graph = std::map<std::string, std::set<std::string>>;

/// By node: the length of the longest way down from it. Nodes that lie on a cycle, or above one, have none.
inline std::map<std::string, int> levels_of(const Graph& graph) {
  std::map<std::string, int> level;
  for (bool is_new = true; is_new;) {
    is_new = false;
    for (const auto& [node, to] : graph) {
      if (level.contains(node)) continue;
      if (!std::all_of(to.begin(), to.end(), [&](const std::string& t) { return level.contains(t); })) continue;
      int height = 0;
      for (const std::string& t : to) height = std::max(height, level[t] + 1);
      level[node] = height;
      is_new = true;
    }
  }
  return level;
}

inline bool reaches(const Graph& graph, const std::string& from, const std::string& to) {
  if (from == to) return true;
  const auto at = graph.find(from);
  return at != graph.end() && std::any_of(at->second.begin(), at->second.end(),
                                          [&](const std::string& next) { return reaches(graph, next, to); });
}

/// Edges that no longer way stands for.
inline Graph without_short_cuts(const Graph& graph) {
  Graph least = graph;
  for (auto& [node, to] : least) {
    const std::set<std::string> all = to;
    std::erase_if(to, [&](const std::string& t) {
      return std::any_of(all.begin(), all.end(),
                         [&](const std::string& by) { return by != t && reaches(graph, by, t); });
    });
  }
  return least;
}

/// A node in the picture, or a place where a line passes a row.
struct Place {
  int row = 0;
  double x = 0;
  bool is_node = false;
};

/// Nodes by row, and by edge the places that it passes, those of its ends included.
struct Layout {
  std::vector<Place> places;
  std::map<std::string, int> node;
  std::vector<std::vector<int>> lines;
  int n_rows = 0;
};

constexpr double kNodeWidth = 130, kLineWidth = 6, kGap = 16, kPage = 1240;

inline void spread(Layout& layout, std::vector<int>& row) {
  const auto width = [&](int place) { return layout.places[place].is_node ? kNodeWidth : kLineWidth; };
  double sum = -kGap;
  for (const int place : row) sum += width(place) + kGap;
  double at = 0.5 * (kPage - sum);
  for (const int place : row) {
    layout.places[place].x = at + 0.5 * width(place);
    at += width(place) + kGap;
  }
}

inline Layout layout_of(const Graph& graph) {
  Layout layout;
  const auto level = levels_of(graph);
  for (const auto& [node, height] : level) layout.n_rows = std::max(layout.n_rows, height + 1);
  std::vector<std::vector<int>> rows(layout.n_rows);
  const auto add = [&](int row, bool is_node) {
    layout.places.push_back({.row = row, .is_node = is_node});
    rows[row].push_back(static_cast<int>(layout.places.size()) - 1);
    return rows[row].back();
  };
  for (const auto& [node, height] : level) layout.node[node] = add(layout.n_rows - 1 - height, true);
  for (const auto& [from, to] : without_short_cuts(graph))
    for (const std::string& t : to) {
      std::vector<int> line = {layout.node.at(from)};
      const int last = layout.places[layout.node.at(t)].row;
      for (int row = layout.places[line[0]].row + 1; row < last; ++row) line.push_back(add(row, false));
      line.push_back(layout.node.at(t));
      layout.lines.push_back(line);
    }
  for (auto& row : rows) spread(layout, row);
  std::map<int, std::vector<int>> beside;
  for (const auto& line : layout.lines)
    for (std::size_t i = 1; i < line.size(); ++i) {
      beside[line[i]].push_back(line[i - 1]);
      beside[line[i - 1]].push_back(line[i]);
    }
  for (int sweep = 0; sweep < 24; ++sweep) {  // each row in the order of the middle of its neighbours
    for (auto& row : rows) {
      std::map<int, double> middle;
      for (const int place : row) {
        double sum = 0;
        for (const int other : beside[place]) sum += layout.places[other].x;
        middle[place] =
            beside[place].empty() ? layout.places[place].x : sum / static_cast<double>(beside[place].size());
      }
      std::stable_sort(row.begin(), row.end(), [&](int a, int b) { return middle[a] < middle[b]; });
      spread(layout, row);
    }
  }
  return layout;
}

/// As SVG: what includes others lies above them; ways of several steps stand for the direct edges along them.
inline std::string drawn(const Graph& graph, const std::string& title) {
  constexpr double kHeight = 26, kRise = 84, kTop = 64;
  const Layout layout = layout_of(graph);
  const std::map<std::string, std::string> colours = {
      {"pipeline", "#dfe7f2"}, {"segment", "#e2f0d9"},   {"network", "#fff2cc"}, {"substrate", "#f8dfcf"},
      {"mbtfm", "#ead9ee"},    {"continuum", "#f6dde3"}, {"samples", "#d9eeee"}, {"programs", "#eeeeee"}};
  std::ostringstream svg;
  const double height = kTop + (layout.n_rows - 1) * kRise + kHeight + 20;
  svg << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << kPage << "\" height=\"" << height
      << "\" viewBox=\"0 0 " << kPage << " " << height << "\" font-family=\"sans-serif\" font-size=\"12\">\n"
      << "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
      << "<text x=\"20\" y=\"26\" font-size=\"16\">" << title << "</text>\n"
      << "<text x=\"20\" y=\"44\" fill=\"#555\">" << graph.size()
      << " nodes; a line goes down to what is included; one that a longer way stands for is left out</text>\n";
  const auto y = [&](const Place& place) { return kTop + place.row * kRise; };
  for (const auto& line : layout.lines) {
    svg << "<path d=\"M" << layout.places[line[0]].x << " " << y(layout.places[line[0]]) + kHeight;
    for (std::size_t i = 1; i < line.size(); ++i) {
      const Place &above = layout.places[line[i - 1]], &below = layout.places[line[i]];
      const double y1 = y(above) + kHeight, y2 = y(below), half = 0.5 * (y2 - y1);
      svg << " C" << above.x << " " << y1 + half << " " << below.x << " " << y2 - half << " " << below.x << " " << y2;
      if (i + 1 < line.size()) svg << " L" << below.x << " " << y2 + kHeight;
    }
    svg << "\" fill=\"none\" stroke=\"#667\" stroke-width=\"1.1\"/>\n";
  }
  for (const auto& [node, place] : layout.node) {
    const double x = layout.places[place].x, top = y(layout.places[place]);
    svg << "<rect x=\"" << x - 0.5 * kNodeWidth << "\" y=\"" << top << "\" width=\"" << kNodeWidth << "\" height=\""
        << kHeight << "\" rx=\"4\" fill=\"" << colours.at(node.substr(0, node.find('/'))) << "\" stroke=\"#667\"/>\n"
        << "<text x=\"" << x << "\" y=\"" << top + 17 << "\" text-anchor=\"middle\">" << node << "</text>\n";
  }
  svg << "</svg>\n";
  return svg.str();
}

}  // namespace mbtfm::test
