#include "segment/trace_join.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <tuple>

namespace mbtfm::segment {

namespace {

/// An end of a piece: 2 · piece for its first point, 2 · piece + 1 for its last.
using End = std::size_t;
End opposite(End end) { return end ^ 1; }

struct EndPoint {
  cv::Point2d point, outward;
  double height = 0;  ///< mean of the piece
};

std::vector<EndPoint> ends_of(const std::vector<Trace>& traces, double reach_px) {
  std::vector<EndPoint> ends;
  for (const Trace& t : traces) {
    const double height = std::accumulate(t.height.begin(), t.height.end(), 0.0) / static_cast<double>(t.height.size());
    ends.push_back({t.points.front(), outward(t.points, LineEnd::first, reach_px), height});
    ends.push_back({t.points.back(), outward(t.points, LineEnd::last, reach_px), height});
  }
  return ends;
}

/// How badly two ends fit to one line; nothing where they do not.
std::optional<double> mismatch(const EndPoint& a, const EndPoint& b, const TraceRule& rule) {
  constexpr double kStraight = 0.94;  // cosine of 20°
  if (std::min(a.height, b.height) < rule.follow_share * std::max(a.height, b.height)) return std::nullopt;
  const cv::Point2d gap = b.point - a.point;
  const double distance = std::hypot(gap.x, gap.y);
  const double sideways = std::max(std::abs(gap.cross(a.outward)), std::abs(gap.cross(b.outward)));
  if (distance > rule.join_gap_px || a.outward.dot(b.outward) > -kStraight) return std::nullopt;
  if (gap.dot(a.outward) < -rule.line_radius_px) return std::nullopt;
  if (sideways > rule.line_radius_px / 2 + 0.15 * distance) return std::nullopt;
  return distance + 4 * sideways;
}

struct Fit {
  double mismatch;
  End a, b;
  bool operator<(const Fit& other) const {
    return std::tie(mismatch, a, b) < std::tie(other.mismatch, other.a, other.b);
  }
};

/// All pairs of ends that fit, the best first.
std::vector<Fit> fits_of(const std::vector<EndPoint>& ends, const TraceRule& rule) {
  const double side = std::max(1.0, rule.join_gap_px);
  const auto cell = [&](double v) { return static_cast<int>(std::floor(v / side)); };
  std::map<std::pair<int, int>, std::vector<End>> grid;
  for (End e = 0; e < ends.size(); ++e) grid[{cell(ends[e].point.x), cell(ends[e].point.y)}].push_back(e);
  std::vector<Fit> fits;
  for (End a = 0; a < ends.size(); ++a)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const auto found = grid.find({cell(ends[a].point.x) + dx, cell(ends[a].point.y) + dy});
        if (found == grid.end()) continue;
        for (const End b : found->second)
          if (a < b && b != opposite(a))
            if (const auto m = mismatch(ends[a], ends[b], rule)) fits.push_back({*m, a, b});
      }
  std::sort(fits.begin(), fits.end());
  return fits;
}

/// The end that each end is joined to.
std::vector<std::optional<End>> links_of(const std::vector<Fit>& fits, std::size_t n_traces) {
  std::vector<std::optional<End>> link(2 * n_traces);
  std::vector<std::size_t> line(n_traces);
  std::iota(line.begin(), line.end(), std::size_t{0});
  const auto line_of = [&](std::size_t piece) {
    while (line[piece] != piece) piece = line[piece] = line[line[piece]];
    return piece;
  };
  for (const Fit& fit : fits) {
    const std::size_t a = line_of(fit.a / 2), b = line_of(fit.b / 2);
    if (link[fit.a] || link[fit.b] || a == b) continue;
    link[fit.a] = fit.b;
    link[fit.b] = fit.a;
    line[std::max(a, b)] = std::min(a, b);
  }
  return link;
}

void append(Trace& to, Trace piece, bool is_reversed) {
  if (is_reversed) {
    std::reverse(piece.points.begin(), piece.points.end());
    std::reverse(piece.height.begin(), piece.height.end());
  }
  to.points.insert(to.points.end(), piece.points.begin(), piece.points.end());
  to.height.insert(to.height.end(), piece.height.begin(), piece.height.end());
}

}  // namespace

std::vector<Trace> joined(std::vector<Trace> traces, const TraceRule& rule) {
  const auto ends = ends_of(traces, rule.end_window_px / 2);
  const auto link = links_of(fits_of(ends, rule), traces.size());
  std::vector<bool> is_used(traces.size());
  std::vector<Trace> result;
  for (End start = 0; start < link.size(); ++start) {
    if (link[start] || is_used[start / 2]) continue;  // begin at a free end
    Trace line;
    for (std::optional<End> entry = start; entry; entry = link[opposite(*entry)]) {
      is_used[*entry / 2] = true;
      append(line, std::move(traces[*entry / 2]), *entry % 2 == 1);
    }
    result.push_back(std::move(line));
  }
  return result;
}

}  // namespace mbtfm::segment
