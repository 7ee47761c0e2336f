#include "segment/cells/trace_join.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <tuple>

#include "segment/cells/fibre_probability.h"
#include "segment/cells/grid.h"
#include "segment/cells/squares.h"

namespace mbtfm::cells {

std::vector<cv::Point2d> last_part(const Trace& trace, LineEnd end, double length_px) {
  const auto n = static_cast<std::ptrdiff_t>(std::min(static_cast<double>(trace.size()), length_px));
  if (end == LineEnd::first) return {trace.points.begin(), trace.points.begin() + n};
  return {trace.points.rbegin(), trace.points.rbegin() + n};
}

Parabola parabola_through(const std::vector<cv::Point2d>& a, const std::vector<cv::Point2d>& b) {
  Parabola fit;
  const cv::Point2d way = b.back() - a.back();
  fit.origin = (a.front() + b.front()) / 2;
  fit.along = way / std::max(1e-9, std::hypot(way.x, way.y));
  cv::Matx33d normal = cv::Matx33d::zeros();
  cv::Vec3d right(0, 0, 0);
  const auto each = [&](auto use) {
    for (const auto* part : {&a, &b})
      for (const cv::Point2d& p : *part) {
        const cv::Point2d d = p - fit.origin;
        use(d.dot(fit.along), fit.along.cross(d), 0.5 / static_cast<double>(part->size()));
      }
  };
  each([&](double s, double t, double weight) {
    const cv::Vec3d powers(1, s, s * s);
    normal += weight * powers * powers.t();
    right += weight * t * powers;
  });
  fit.coefficients = normal.solve(right, cv::DECOMP_SVD);
  double squares = 0;
  each([&](double s, double t, double weight) { squares += weight * (t - fit.offset(s)) * (t - fit.offset(s)); });
  fit.misfit_px = std::sqrt(squares);
  fit.from = fit.along.dot(a.front() - fit.origin);
  fit.to = fit.along.dot(b.front() - fit.origin);
  return fit;
}

Trace bridge_of(const Parabola& way, const Ridges& ridges) {
  Trace bridge;
  for (double s = way.from + 1; s < way.to; ++s) {
    bridge.points.push_back(way.at(s));
    bridge.height.push_back(ridges.at(way.at(s), way.angle_rad(s)));
    bridge.is_shared.push_back(false);
  }
  return bridge;
}

namespace {

/// An end of a piece: 2 · piece for its first point, 2 · piece + 1 for its last.
using End = std::size_t;
End opposite(End end) { return end ^ 1; }

struct EndPoint {
  cv::Point2d point, outward;
  double height = 0;              ///< mean of the last part
  std::vector<cv::Point2d> part;  ///< from the end inwards
};

std::vector<EndPoint> ends_of(const std::vector<Trace>& traces, const TraceRule& rule) {
  std::vector<EndPoint> ends;
  for (const Trace& t : traces) {
    const auto n = std::min(static_cast<std::ptrdiff_t>(t.size()), static_cast<std::ptrdiff_t>(4 * rule.course_px));
    const auto add = [&](LineEnd end, cv::Point2d point, auto height) {
      ends.push_back({point, outward(t.points, end, rule.course_px),
                      std::accumulate(height, height + n, 0.0) / static_cast<double>(n),
                      last_part(t, end, rule.bridge_course_px)});
    };
    add(LineEnd::first, t.points.front(), t.height.begin());
    add(LineEnd::last, t.points.back(), t.height.rbegin());
  }
  return ends;
}

double angle_between(cv::Point2d a, cv::Point2d b) { return std::atan2(std::abs(a.cross(b)), a.dot(b)); }

/// Is the way from end to end brighter than texture?
bool is_bright_between(cv::Point2d a, cv::Point2d b, const Ridges& ridges, const TraceRule& rule) {
  const cv::Point2d way = b - a;
  const double angle = std::atan2(way.y, way.x), n = std::ceil(std::hypot(way.x, way.y));
  double over_noise = 0;
  for (double i = 0; i < n; ++i) {
    const cv::Point2d p = a + ((i + 0.5) / n) * way;
    over_noise += ridges.at(p, angle) / std::max<double>(sample(ridges.noise, p), 1e-30) / n;
  }
  return over_noise >= rule.follow_noise;
}

/// How badly two ends fit to one line, the sum of the squares of what separates them in its usual size; nothing where
/// they do not.
std::optional<double> mismatch(const EndPoint& a, const EndPoint& b, const Ridges& ridges, const TraceRule& rule) {
  constexpr double kTurn = 0.14;   // 8°: by as much a fibre turns from the one to the other
  constexpr double kHeight = 0.5;  // logarithm
  constexpr double kLowest = 0.2;  // of the other end's height: over the nucleus a fibre falls by a factor of 2 to 5
  constexpr double kWorst = 9;
  const cv::Point2d gap = b.point - a.point;
  const cv::Point2d course = a.outward - b.outward, along = course / std::max(1e-9, std::hypot(course.x, course.y));
  const double distance = std::hypot(gap.x, gap.y), overlap = -gap.dot(along);
  if (distance > rule.join_gap_px || overlap > rule.overlap_px) return std::nullopt;
  if (std::min(a.height, b.height) < kLowest * std::max(a.height, b.height)) return std::nullopt;
  const double turn = angle_between(a.outward, -b.outward) / kTurn;
  const double sideways = std::abs(gap.cross(along)) / (rule.line_radius_px / 2 + (overlap > 0 ? 0 : 0.1 * distance));
  const double far = 2 * distance / rule.join_gap_px;
  const double height = std::log(a.height / b.height) / kHeight;
  const double sum = turn * turn + sideways * sideways + far * far + height * height;
  if (!(sum <= kWorst)) return std::nullopt;
  if (overlap < -2 * rule.line_radius_px && !is_bright_between(a.point, b.point, ridges, rule)) return std::nullopt;
  return sum;
}

/// By how much the way over a gap is brighter than texture, in standard deviations.
double over_noise_between(const Parabola& way, const Ridges& ridges) {
  double sum = 0;
  int n = 0;
  for (double s = way.from; s <= way.to; ++s, ++n)
    sum += ridges.at(way.at(s), way.angle_rad(s)) / std::max<double>(sample(ridges.noise, way.at(s)), 1e-30);
  return sum / std::max(1, n);
}

/// How probable it is that two ends that face each other are of one fibre: that they lie on one parabola to a fraction
/// of their width, and the way between them is brighter than texture. Logistic regression (notes/dense_fibres.md).
double chance_of_one_fibre(const EndPoint& a, const EndPoint& b, const Ridges& ridges, const TraceRule& rule) {
  constexpr double kTurn = 0.5;              // rad: parabolas of that radius turn less
  constexpr double kDark = -1, kBright = 4;  // what lies beyond says no more
  constexpr std::array kCoefficients{4.89, -1.48, -2.27, -3.16, -2.53, 1.39};
  if (angle_between(a.outward, -b.outward) > kTurn) return 0;
  const Parabola way = parabola_through(a.part, b.part);
  const double gap = (way.to - way.from) / rule.bridge_px, height = std::abs(std::log(a.height / b.height));
  if (gap < 0 || gap > 1 || way.along.dot(a.outward) < 0 || !std::isfinite(height)) return 0;
  return logistic({1, way.misfit_px / rule.bridge_misfit_px, way.curvature() * rule.bridge_radius_px, gap, height,
                   std::clamp(over_noise_between(way, ridges), kDark, kBright)},
                  kCoefficients);
}

struct Fit {
  double mismatch;
  End a, b;
  bool operator<(const Fit& other) const {
    return std::tie(mismatch, a, b) < std::tie(other.mismatch, other.a, other.b);
  }
};

/// All pairs of ends nearer than `within_px` that fit, the best first.
template <class Mismatch>
std::vector<Fit> fits_of(const std::vector<EndPoint>& ends, double within_px, Mismatch mismatch_of) {
  Squares<End> squares(std::max(1.0, within_px));
  for (End e = 0; e < ends.size(); ++e) squares.add(ends[e].point, e);
  std::vector<Fit> fits;
  for (End a = 0; a < ends.size(); ++a)
    squares.each_near(ends[a].point, [&](End b) {
      if (a >= b || b == opposite(a)) return;
      if (const auto m = mismatch_of(a, b)) fits.push_back({*m, a, b});
    });
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

/// Add the next piece of the line. Ends that lie beside each other, of one line traced twice, each give half of what
/// both have.
void append(Trace& line, Trace piece) {
  if (line.size() == 0) {
    line = std::move(piece);
    return;
  }
  constexpr double kCourse_px = 10;
  const cv::Point2d beyond = line.points.back() - piece.points.front();
  const double half = beyond.dot(outward(line.points, LineEnd::last, kCourse_px)) / 2;
  const double most = static_cast<double>(std::min(line.size(), piece.size())) / 2;
  const auto n = static_cast<std::size_t>(std::clamp(half, 0.0, most));
  line = line.part(0, line.size() - n);
  line.append(piece.part(n, piece.size()));
}

/// Chains of linked pieces from end to end, as the ends at which one enters each piece.
std::vector<std::vector<End>> chains_of(const std::vector<std::optional<End>>& link) {
  std::vector<bool> is_used(link.size() / 2);
  std::vector<std::vector<End>> chains;
  for (End start = 0; start < link.size(); ++start) {
    if (link[start] || is_used[start / 2]) continue;  // begin at a free end
    chains.emplace_back();
    for (std::optional<End> entry = start; entry; entry = link[opposite(*entry)]) {
      is_used[*entry / 2] = true;
      chains.back().push_back(*entry);
    }
  }
  return chains;
}

Trace entered(Trace piece, End entry) {
  if (entry % 2 == 1) piece.reverse();
  return piece;
}

}  // namespace

std::vector<Trace> joined(std::vector<Trace> traces, const Ridges& ridges, const TraceRule& rule) {
  const auto ends = ends_of(traces, rule);
  const auto fits =
      fits_of(ends, rule.join_gap_px, [&](End a, End b) { return mismatch(ends[a], ends[b], ridges, rule); });
  std::vector<Trace> result;
  for (const std::vector<End>& chain : chains_of(links_of(fits, traces.size()))) {
    Trace line;
    for (const End entry : chain) append(line, entered(std::move(traces[entry / 2]), entry));
    result.push_back(std::move(line));
  }
  return result;
}

std::vector<double> chances_of_going_on(const std::vector<Trace>& fibres, const Ridges& ridges, const TraceRule& rule) {
  const auto ends = ends_of(fibres, rule);
  std::vector<double> chances(ends.size());
  const auto chance = [&](End a, End b) { return std::optional(chance_of_one_fibre(ends[a], ends[b], ridges, rule)); };
  for (const Fit& fit : fits_of(ends, rule.bridge_px, chance))  // the best come last
    chances[fit.a] = chances[fit.b] = fit.mismatch;
  return chances;
}

std::vector<BridgedLine> bridged(const std::vector<Trace>& fibres, const Ridges& ridges, const TraceRule& rule) {
  const auto ends = ends_of(fibres, rule);
  const auto fits = fits_of(ends, rule.bridge_px, [&](End a, End b) {
    constexpr double kBrighter = 0.4;  // in a dark gap one pair of four is of two fibres
    const double chance = chance_of_one_fibre(ends[a], ends[b], ridges, rule);
    if (chance <= 0.5 || over_noise_between(parabola_through(ends[a].part, ends[b].part), ridges) < kBrighter)
      return std::optional<double>();
    return std::optional(1 - chance);
  });
  std::vector<BridgedLine> result;
  for (const std::vector<End>& chain : chains_of(links_of(fits, fibres.size()))) {
    BridgedLine line;
    std::optional<End> left;  // of the piece before
    for (const End entry : chain) {
      if (left) line.trace.append(bridge_of(parabola_through(ends[*left].part, ends[entry].part), ridges));
      left = opposite(entry);
      line.trace.append(entered(fibres[entry / 2], entry));
      line.pieces.push_back(entry / 2);
    }
    result.push_back(std::move(line));
  }
  return result;
}

}  // namespace mbtfm::cells
