#include "segment/cells/trace_join.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <tuple>

#include "segment/cells/grid.h"

namespace mbtfm::cells {

namespace {

/// An end of a piece: 2 · piece for its first point, 2 · piece + 1 for its last.
using End = std::size_t;
End opposite(End end) { return end ^ 1; }

struct EndPoint {
  cv::Point2d point, outward;
  double height = 0;              ///< mean of the last part
  std::vector<cv::Point2d> part;  ///< the last part of the line, the end first
};

std::vector<EndPoint> ends_of(const std::vector<Trace>& traces, double reach_px) {
  const auto first_of = [](const auto& all, double n, auto from) {
    return std::pair(from, from + static_cast<std::ptrdiff_t>(std::min(n, static_cast<double>(all.size()))));
  };
  std::vector<EndPoint> ends;
  const auto add = [&](const Trace& t, LineEnd end, auto points, auto heights) {
    const auto part = first_of(t.points, 2 * reach_px, points);
    const auto last = first_of(t.height, 4 * reach_px, heights);
    const double sum = std::accumulate(last.first, last.second, 0.0);
    ends.push_back({*points,
                    outward(t.points, end, reach_px),
                    sum / static_cast<double>(last.second - last.first),
                    {part.first, part.second}});
  };
  for (const Trace& t : traces) {
    add(t, LineEnd::first, t.points.begin(), t.height.begin());
    add(t, LineEnd::last, t.points.rbegin(), t.height.rbegin());
  }
  return ends;
}

double angle_between(cv::Point2d a, cv::Point2d b) { return std::atan2(std::abs(a.cross(b)), a.dot(b)); }

/// y = offset + slope x + bend x²/2, in a frame along the course of two ends that point at each other.
struct Parabola {
  cv::Point2d origin, along;
  double offset = 0, slope = 0, bend = 0;
  double misfit_px = 0;  ///< root mean square distance of the points it was laid through

  double y(double x) const { return offset + x * (slope + x * bend / 2); }
  cv::Point2d at(double x) const { return origin + x * along + y(x) * left_of(along); }
  double angle_at(double x) const { return std::atan2(along.y, along.x) + std::atan(slope + bend * x); }
  double place_of(cv::Point2d p) const { return (p - origin).dot(along); }
};

/// By least squares through the last parts of both.
Parabola parabola_through(const EndPoint& a, const EndPoint& b) {
  const cv::Point2d course = a.outward - b.outward;
  Parabola p{.origin = (a.point + b.point) / 2, .along = course / std::max(1e-9, std::hypot(course.x, course.y))};
  const auto for_each = [&](auto take) {
    for (const EndPoint* end : {&a, &b})
      for (const cv::Point2d& q : end->part) take(p.place_of(q), p.along.cross(q - p.origin));
  };
  cv::Matx33d normal = 1e-9 * cv::Matx33d::eye();  // two points each do not tell a bend
  cv::Vec3d right(0, 0, 0);
  for_each([&](double x, double y) {
    const cv::Vec3d row(1, x, x * x / 2);
    normal += row * row.t();
    right += y * row;
  });
  const cv::Vec3d c = normal.solve(right, cv::DECOMP_CHOLESKY);
  p.offset = c[0];
  p.slope = c[1];
  p.bend = c[2];
  double squares = 0;
  for_each([&](double x, double y) { squares += (y - p.y(x)) * (y - p.y(x)); });
  p.misfit_px = std::sqrt(squares / static_cast<double>(a.part.size() + b.part.size()));
  return p;
}

/// Is the way from end to end brighter than what lies beside it, by more than texture, and nowhere dark? The ridge may
/// lie a pixel off the parabola.
bool is_bright_between(const Parabola& way, double from, double to, const Ridges& ridges, const TraceRule& rule) {
  constexpr double kDark = 0.25;  // of what a line may fall to
  const double n = std::ceil(to - from);
  double mean = 0, least = std::numeric_limits<double>::infinity();
  for (double i = 0; i < n; ++i) {
    const double x = from + (i + 0.5) / n * (to - from), angle = way.angle_at(x);
    const cv::Point2d p = way.at(x), across(-std::sin(angle), std::cos(angle));
    const double height = std::max({ridges.at(p - across, angle), ridges.at(p, angle), ridges.at(p + across, angle)});
    const double over_noise = height / std::max<double>(sample(ridges.noise, p), 1e-30);
    mean += over_noise / n;
    least = std::min(least, over_noise);
  }
  return mean >= rule.follow_noise && least >= kDark * rule.follow_noise;
}

double sum_of_squares(std::initializer_list<double> parts) {
  return std::inner_product(parts.begin(), parts.end(), parts.begin(), 0.0);
}

/// By turn, offset, gap and height: pieces that are too short tell no parabola.
std::optional<double> mismatch_of_short(const EndPoint& a, const EndPoint& b, const Parabola& way,
                                        const TraceRule& rule) {
  constexpr double kTurn = 0.14;   // 8°: by as much a fibre turns from the one to the other
  constexpr double kHeight = 0.5;  // logarithm
  constexpr double kWorst = 9, kNearer = 0.64;
  const cv::Point2d gap = b.point - a.point;
  const double distance = std::hypot(gap.x, gap.y), nearest = kNearer * rule.join_gap_px;
  if (distance > nearest) return std::nullopt;
  if (std::min(a.height, b.height) < rule.follow_share * std::max(a.height, b.height)) return std::nullopt;
  const double open = gap.dot(way.along) < 0 ? 0 : 0.1 * distance;
  const double sum = sum_of_squares({angle_between(a.outward, -b.outward) / kTurn,
                                     gap.cross(way.along) / (rule.line_radius_px / 2 + open), 2 * distance / nearest,
                                     std::log(a.height / b.height) / kHeight});
  return sum <= kWorst ? std::optional(sum) : std::nullopt;
}

std::optional<double> mismatch_of_long(const EndPoint& a, const EndPoint& b, const Parabola& way,
                                       const TraceRule& rule) {
  constexpr double kTurn = 0.14;
  constexpr double kMisfit = 0.09;  // of the line's radius
  constexpr double kHeight = 1;     // over the nucleus a fibre dims by a factor of 2 to 5
  constexpr double kWorst = 7;
  constexpr double kFarther = 1.5;  // than what is known of the shorter one no parabola is drawn out
  const double ahead = way.place_of(b.point) - way.place_of(a.point);
  if (ahead > kFarther * static_cast<double>(std::min(a.part.size(), b.part.size()))) return std::nullopt;
  const cv::Point2d gap = b.point - a.point;
  const double sum =
      sum_of_squares({angle_between(a.outward, -b.outward) / kTurn, way.misfit_px / (kMisfit * rule.line_radius_px),
                      way.bend * rule.smallest_radius_px, 2 * std::hypot(gap.x, gap.y) / rule.join_gap_px,
                      std::log(a.height / b.height) / kHeight});
  return sum <= kWorst ? std::optional(sum) : std::nullopt;
}

/// How badly two ends fit to one line, the sum of the squares of what separates them in its usual size; nothing where
/// they do not. What is usual was counted among the ends of simulated cells (docs/developers/dense_fibres.md).
std::optional<double> mismatch(const EndPoint& a, const EndPoint& b, const Ridges& ridges, const TraceRule& rule) {
  constexpr double kMostTurn = 1;
  const cv::Point2d gap = b.point - a.point;
  if (std::hypot(gap.x, gap.y) > rule.join_gap_px) return std::nullopt;
  if (angle_between(a.outward, -b.outward) > kMostTurn) return std::nullopt;
  const Parabola way = parabola_through(a, b);
  const double from = way.place_of(a.point), to = way.place_of(b.point);
  if (from - to > rule.overlap_px) return std::nullopt;
  const bool is_short = static_cast<double>(std::min(a.part.size(), b.part.size())) < rule.course_px;
  const auto sum = is_short ? mismatch_of_short(a, b, way, rule) : mismatch_of_long(a, b, way, rule);
  if (!sum) return std::nullopt;
  if (to - from > 2 * rule.line_radius_px && !is_bright_between(way, from, to, ridges, rule)) return std::nullopt;
  return sum;
}

struct Fit {
  double mismatch;
  End a, b;
  bool operator<(const Fit& other) const {
    return std::tie(mismatch, a, b) < std::tie(other.mismatch, other.a, other.b);
  }
};

/// The ends by squares of the image.
class EndGrid {
 public:
  EndGrid(const std::vector<EndPoint>& ends, double side) : side_(side) {
    for (End e = 0; e < ends.size(); ++e) grid_[square(ends[e].point, 0, 0)].push_back(e);
  }
  /// Those in the square of a point and in its neighbours.
  void add_near(cv::Point2d point, std::vector<End>& near) const {
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const auto found = grid_.find(square(point, dx, dy));
        if (found != grid_.end()) near.insert(near.end(), found->second.begin(), found->second.end());
      }
  }

 private:
  std::pair<int, int> square(cv::Point2d p, int dx, int dy) const {
    return {static_cast<int>(std::floor(p.x / side_)) + dx, static_cast<int>(std::floor(p.y / side_)) + dy};
  }
  double side_;
  std::map<std::pair<int, int>, std::vector<End>> grid_;
};

/// All pairs of ends that fit, the best first.
std::vector<Fit> fits_of(const std::vector<EndPoint>& ends, const Ridges& ridges, const TraceRule& rule) {
  const EndGrid grid(ends, std::max(1.0, rule.join_gap_px));
  std::vector<Fit> fits;
  for (End a = 0; a < ends.size(); ++a) {
    std::vector<End> near;
    grid.add_near(ends[a].point, near);
    for (const End b : near)
      if (a < b && b != opposite(a))
        if (const auto m = mismatch(ends[a], ends[b], ridges, rule)) fits.push_back({*m, a, b});
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

/// The way from the end of one line to the beginning of the next, a pixel apart: along the parabola through both, what
/// that misses the ends by being shared out.
Trace bridge(const Trace& line, const Trace& next, const Ridges& ridges, const TraceRule& rule) {
  const auto ends = ends_of({line, next}, rule.course_px);
  const Parabola way = parabola_through(ends[1], ends[2]);
  const double from = way.place_of(line.points.back()), to = way.place_of(next.points.front());
  const double missed = way.along.cross(line.points.back() - way.at(from)),
               missed_next = way.along.cross(next.points.front() - way.at(to));
  Trace trace;
  for (double x = from + 1; x < to - 0.5; ++x) {
    const double share = (x - from) / (to - from);
    trace.points.push_back(way.at(x) + ((1 - share) * missed + share * missed_next) * left_of(way.along));
    trace.height.push_back(ridges.at(trace.points.back(), way.angle_at(x)));
    trace.is_shared.push_back(true);  // chosen because it is bright: that says nothing about the line
  }
  return trace;
}

/// Add the next piece of the line. Ends that lie beside each other, of one line traced twice, each give half of what
/// both have.
void append(Trace& line, const Trace& piece, const Ridges& ridges, const TraceRule& rule) {
  if (line.size() == 0) {
    line = piece;
    return;
  }
  constexpr double kCourse_px = 10;
  const cv::Point2d beyond = line.points.back() - piece.points.front();
  const double half = beyond.dot(outward(line.points, LineEnd::last, kCourse_px)) / 2;
  const double most = static_cast<double>(std::min(line.size(), piece.size())) / 2;
  const auto n = static_cast<std::size_t>(std::clamp(half, 0.0, most));
  line = line.part(0, line.size() - n);
  const Trace next = piece.part(n, piece.size());
  line.append(bridge(line, next, ridges, rule));
  line.append(next);
}

/// Where the ends of others lie on a piece: the points to cut it at.
std::vector<std::size_t> cuts_of(const std::vector<Trace>& traces, std::size_t piece, const std::vector<EndPoint>& ends,
                                 const std::vector<End>& near, const TraceRule& rule) {
  constexpr double kAlong = 0.5;  // cosine of 60°: what ends at a steeper angle is no part of this line
  const Trace& trace = traces[piece];
  const auto margin = static_cast<std::size_t>(2 * rule.line_radius_px) + 2;
  std::vector<std::size_t> cuts;
  if (trace.points.size() <= 2 * margin) return cuts;
  for (const End end : near) {
    if (end / 2 == piece) continue;
    double least = 2 * rule.line_radius_px;
    std::size_t at = 0;
    for (std::size_t i = margin; i + margin < trace.points.size(); ++i) {
      const cv::Point2d d = trace.points[i] - ends[end].point;
      if (std::hypot(d.x, d.y) < least) least = std::hypot(d.x, d.y), at = i;
    }
    if (at == 0) continue;
    const cv::Point2d along = trace.points[at + 2] - trace.points[at - 2];
    if (std::abs(along.dot(ends[end].outward)) < kAlong * std::hypot(along.x, along.y)) continue;
    cuts.push_back(at);
  }
  std::sort(cuts.begin(), cuts.end());
  return cuts;
}

std::vector<Trace> cut_at_junctions(const std::vector<Trace>& traces, const TraceRule& rule) {
  constexpr std::size_t kShortest = 3;  // points
  const auto ends = ends_of(traces, rule.course_px);
  const EndGrid grid(ends, std::max(1.0, 2 * rule.line_radius_px));
  std::vector<Trace> pieces;
  for (std::size_t i = 0; i < traces.size(); ++i) {
    std::vector<End> near;
    for (const cv::Point2d& p : traces[i].points) grid.add_near(p, near);
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
    auto cuts = cuts_of(traces, i, ends, near, rule);
    cuts.push_back(traces[i].points.size());
    std::size_t from = 0;
    for (const std::size_t to : cuts) {
      if (to - from < kShortest) continue;
      pieces.push_back(traces[i].part(from, to));
      from = to;
    }
  }
  return pieces;
}

std::vector<Trace> joined_once(std::vector<Trace> traces, const Ridges& ridges, const TraceRule& rule) {
  const auto ends = ends_of(traces, rule.course_px);
  const auto link = links_of(fits_of(ends, ridges, rule), traces.size());
  std::vector<bool> is_used(traces.size());
  std::vector<Trace> result;
  for (End start = 0; start < link.size(); ++start) {
    if (link[start] || is_used[start / 2]) continue;  // begin at a free end
    Trace line;
    for (std::optional<End> entry = start; entry; entry = link[opposite(*entry)]) {
      is_used[*entry / 2] = true;
      Trace& piece = traces[*entry / 2];
      if (*entry % 2 == 1) piece.reverse();
      append(line, piece, ridges, rule);
    }
    result.push_back(std::move(line));
  }
  return result;
}

}  // namespace

std::vector<Trace> joined(std::vector<Trace> traces, const Ridges& ridges, const TraceRule& rule) {
  constexpr int kRounds = 3;  // longer pieces tell better where they point
  traces = cut_at_junctions(traces, rule);
  for (int round = 0; round < kRounds; ++round) {
    const std::size_t n = traces.size();
    traces = joined_once(std::move(traces), ridges, rule);
    if (traces.size() == n) break;
  }
  return traces;
}

}  // namespace mbtfm::cells
