#include "segment/cells/trace.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <type_traits>
#include <utility>

#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/grid.h"
#include "segment/cells/trace_join.h"
#include "segment/cells/ways.h"

namespace mbtfm::cells {
namespace {

using std::numbers::pi;

cv::Point2d unit(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad)}; }
cv::Point2d left_of(cv::Point2d e) { return {-e.y, e.x}; }
double length(cv::Point2d d) { return std::hypot(d.x, d.y); }

/// Offset of the maximum of a parabola through three equidistant values, within ±1; where it has none, on a far flank
/// of a peak, a whole step uphill.
double peak_offset(double before, double at, double after) {
  const double curvature = before - 2 * at + after;
  if (curvature < 0) return std::clamp((before - after) / (2 * curvature), -1.0, 1.0);
  return after > before ? 1 : after < before ? -1 : 0;
}

struct Step {
  cv::Point2d point;
  double angle;
  double height;
  bool is_shared = false;
};

struct Seed {
  Step step;
  Way way;  ///< through it
};

/// How far a step may be set right.
struct Correction {
  double turn_rad, aside_px;
};

/// Best direction within one filter direction of the present one, then the ridge's centre across it.
Step settled(const Ridges& ridges, Step s, const Correction& most) {
  const double turn = pi / ridges.n_directions();
  const double before = ridges.at(s.point, s.angle - turn), at = ridges.at(s.point, s.angle),
               after = ridges.at(s.point, s.angle + turn);
  // a third of the way a step, so that noise in the direction averages out
  s.angle += std::clamp(turn / 3 * peak_offset(before, at, after), -most.turn_rad, most.turn_rad);
  const cv::Point2d across = left_of(unit(s.angle));
  const double offset = peak_offset(ridges.at(s.point - across, s.angle), ridges.at(s.point, s.angle),
                                    ridges.at(s.point + across, s.angle));
  s.point += std::clamp(0.5 * offset, -most.aside_px, most.aside_px) * across;
  s.height = ridges.at(s.point, s.angle);
  return s;
}

Step settle(const Ridges& ridges, const TraceRule& rule, const Step& s) {
  constexpr double kAside_px = 0.5;
  return settled(ridges, s, {1 / rule.smallest_radius_px, kAside_px});
}

bool is_on(const cv::Mat& image, cv::Point2d p) {
  return p.x >= 0 && p.y >= 0 && p.x <= image.cols - 1 && p.y <= image.rows - 1;
}

double over_noise(const Ridges& ridges, const Step& s) {
  return s.height / std::max<double>(sample(ridges.noise, s.point), 1e-30);
}

/// Turned to the ridge and moved to its centre, both gently: where lines cross, the other one draws.
Step led(const Ridges& ridges, const TraceRule& rule, Step s) {
  constexpr double kTurn = 0.25, kAside_px = 0.15;
  return settled(ridges, s, {kTurn / rule.smallest_radius_px, kAside_px});
}

/// One way from a seed.
struct Track {
  std::vector<Step> steps;
  double curvature = 0;
  double over_noise = 0;  ///< mean of what was seen
  std::size_t n_to_seen = 0, n_to_free = 0;
};

/// A step of a pixel. @returns whether it is in the image
bool go(Track& track, Step& now, const Ridges& ridges, const Ways& ways, const Claims& claims, const TraceRule& rule) {
  now.point += unit(now.angle + track.curvature / 2);
  now.angle += track.curvature;
  if (!is_on(ridges.noise, now.point)) return false;
  now.height = ridges.at(now.point, now.angle);
  now.is_shared = claims.has(now.point, now.angle);
  if (!now.is_shared && !ways.is_hidden(now.point, now.angle)) now = led(ridges, rule, now);
  track.steps.push_back(now);
  const std::size_t n = track.steps.size();
  const double height = over_noise(ridges, now);
  const bool is_seen = height >= std::max(rule.follow_noise, rule.follow_share * track.over_noise);
  if (is_seen) track.n_to_seen = n;
  if (!now.is_shared) track.n_to_free = n;
  if (is_seen && !now.is_shared) track.over_noise += (height - track.over_noise) / static_cast<double>(n + 1);
  return true;
}

/// Steps from `start` (excluded) along the best way on until none gains, or the line is hidden for longer than it may.
Track follow(const Ridges& ridges, const Ways& ways, const Claims& claims, const TraceRule& rule, const Step& start,
             double curvature) {
  Track track{{}, curvature, over_noise(ridges, start)};
  Step now = start;
  bool is_in = true;
  while (is_in && std::abs(now.angle - start.angle) < 2 * pi) {  // a ring ends
    const Way way = ways.best({now.point, now.angle, track.curvature}, track.over_noise, claims);
    if (way.gain_px <= 0) break;
    track.curvature = way.curvature;
    for (int i = 0; is_in && i < std::max(1, cvRound(rule.step_px)); ++i)
      is_in = go(track, now, ridges, ways, claims, rule);
    const std::size_t n_sure = std::min(track.n_to_seen, track.n_to_free);
    if (static_cast<double>(track.steps.size() - n_sure) > rule.through_px) break;
  }
  track.steps.resize(std::min(track.n_to_seen, track.n_to_free));
  return track;
}

Trace trace_from(const Ridges& ridges, const Ways& ways, const Claims& claims, const TraceRule& rule,
                 const Seed& from) {
  const Step seed = settle(ridges, rule, settle(ridges, rule, from.step));
  Step back = seed;
  back.angle += pi;
  const auto ahead = follow(ridges, ways, claims, rule, seed, from.way.curvature).steps,
             behind = follow(ridges, ways, claims, rule, back, -from.way.curvature).steps;
  Trace trace;
  const auto add = [&](const Step& s) {
    trace.points.push_back(s.point);
    trace.height.push_back(s.height);
    trace.is_shared.push_back(s.is_shared);
  };
  for (auto s = behind.rbegin(); s != behind.rend(); ++s) add(*s);
  add(seed);
  for (const Step& s : ahead) add(s);
  return trace;
}

double course_at(const Trace& trace, std::size_t i) {
  const cv::Point2d d = trace.points[std::min(i + 2, trace.size() - 1)] - trace.points[i > 1 ? i - 2 : 0];
  return std::atan2(d.y, d.x);
}

void claim(Claims& claims, const Trace& trace, double radius_px) {
  for (std::size_t i = 0; i < trace.size(); ++i) claims.add(trace.points[i], course_at(trace, i), radius_px);
}

/// Of lines most of which lie on others, of two that are one the higher or longer.
std::vector<Trace> without_doubles(std::vector<Trace> traces, const Ridges& ridges, const TraceRule& rule) {
  constexpr double kMost = 0.5;
  std::ranges::stable_sort(traces, std::greater(), [](const Trace& t) {
    const std::vector<double> own = t.own_height();
    return std::accumulate(own.begin(), own.end(), 0.0);
  });
  Claims claims(ridges.noise.size(), ridges.n_directions());
  std::erase_if(traces, [&](const Trace& t) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < t.size(); ++i) n += claims.has(t.points[i], course_at(t, i));
    if (static_cast<double>(n) > kMost * static_cast<double>(t.size())) return true;
    claim(claims, t, rule.line_radius_px);
    return false;
  });
  return traces;
}

/// Is a response greatest across its direction, and over the directions?
bool is_crest(const Ridges& ridges, int k, cv::Point at) {
  const int n = ridges.n_directions();
  const auto of = [&](int i) -> const cv::Mat& { return ridges.response[(i + n) % n]; };
  const float height = of(k).at<float>(at);
  if (of(k - 1).at<float>(at) > height || of(k + 1).at<float>(at) >= height) return false;
  const cv::Point2d across = left_of(unit(pi * k / n)), here(at);
  return sample(of(k), here - across) <= height && sample(of(k), here + across) < height;
}

std::vector<Seed> seeds_along(int k, const Ridges& ridges, const Ways& ways, const cv::Mat& is_inside,
                              const TraceRule& rule) {
  const cv::Mat& response = ridges.response[k];
  const double angle = pi * k / ridges.n_directions();
  std::vector<Seed> seeds;
  for (int y = 1; y + 1 < response.rows; ++y)
    for (int x = 1; x + 1 < response.cols; ++x) {
      const float height = response.at<float>(y, x);
      if (height <= 0 || height < rule.start_noise * ridges.noise.at<float>(y, x)) continue;
      if (is_inside.at<std::uint8_t>(y, x) == 0 || ways.is_hidden(cv::Point2d(x, y), angle)) continue;
      if (!is_crest(ridges, k, {x, y})) continue;
      const Way way = ways.through({cv::Point2d(x, y), angle, 0});
      if (way.gain_px >= rule.start_gain_px) seeds.push_back({{cv::Point2d(x, y), angle, height}, way});
    }
  return seeds;
}

/// Places that lines start from: crests through which an arc gains enough, both ways together. The best first.
std::vector<Seed> seeds_of(const Ridges& ridges, const Ways& ways, const cv::Mat& is_inside, const TraceRule& rule) {
  std::vector<std::vector<Seed>> by_direction(ridges.response.size());
  cv::parallel_for_(cv::Range(0, ridges.n_directions()), [&](const cv::Range& range) {
    for (int k = range.start; k < range.end; ++k) by_direction[k] = seeds_along(k, ridges, ways, is_inside, rule);
  });
  std::vector<Seed> seeds;
  for (const auto& some : by_direction) seeds.insert(seeds.end(), some.begin(), some.end());
  std::ranges::stable_sort(seeds, std::greater(),
                           [](const Seed& s) { return std::pair(s.way.gain_px, s.step.height); });
  return seeds;
}

/// How many points to cut from the front: up to where the height first reaches a share of the plateau behind it, and
/// the share of the whole line's that it may fall to.
std::size_t faded_points(const std::vector<double>& height, const TraceRule& rule) {
  if (height.empty()) return 0;
  const std::size_t window = std::min(height.size(), static_cast<std::size_t>(rule.end_window_px));
  const double whole = rule.follow_share * numerics::quantile(height, 0.5);
  std::size_t n = 0;
  while (n < height.size() && height[n] < whole) ++n;
  const std::size_t first = n, last = std::min(height.size(), first + window);
  if (first == last) return n;
  const auto from = height.begin() + static_cast<std::ptrdiff_t>(first);
  const double plateau = numerics::quantile(std::vector(from, from + static_cast<std::ptrdiff_t>(last - first)), 0.75);
  while (n < last && height[n] < rule.end_level * plateau) ++n;
  return n;
}

void cut_faded_ends(Trace& trace, const TraceRule& rule) {
  const std::size_t first = faded_points(trace.height, rule);
  const std::size_t last = trace.size() - faded_points({trace.height.rbegin(), trace.height.rend()}, rule);
  trace = first < last ? trace.part(first, last) : Trace{};
}

}  // namespace

Trace Trace::part(std::size_t from, std::size_t to) const {
  const auto cut = [&](const auto& all) {
    return std::decay_t<decltype(all)>(all.begin() + static_cast<std::ptrdiff_t>(from),
                                       all.begin() + static_cast<std::ptrdiff_t>(to));
  };
  return {cut(points), cut(height), cut(is_shared)};
}

void Trace::reverse() {
  std::reverse(points.begin(), points.end());
  std::reverse(height.begin(), height.end());
  std::reverse(is_shared.begin(), is_shared.end());
}

void Trace::append(const Trace& other) {
  points.insert(points.end(), other.points.begin(), other.points.end());
  height.insert(height.end(), other.height.begin(), other.height.end());
  is_shared.insert(is_shared.end(), other.is_shared.begin(), other.is_shared.end());
}

std::vector<double> Trace::own_height() const {
  std::vector<double> own = height;
  for (std::size_t i = 0; i < own.size(); ++i)
    if (is_shared[i]) own[i] = 0;
  return own;
}

cv::Point2d outward(const std::vector<cv::Point2d>& points, LineEnd end, double reach) {
  const std::size_t n = points.size(), back = std::min(n - 1, static_cast<std::size_t>(std::max(1.0, reach)));
  const cv::Point2d d = end == LineEnd::first ? points[0] - points[back] : points[n - 1] - points[n - 1 - back];
  const double l = length(d);
  return l > 0 ? d / l : cv::Point2d(1, 0);
}

FaintEnd faint_end(const Ridges& ridges, const TraceRule& rule, const Trace& trace, LineEnd end) {
  const cv::Point2d along = outward(trace.points, end, rule.end_window_px / 2);
  Step now{end == LineEnd::first ? trace.points.front() : trace.points.back(), std::atan2(along.y, along.x), 0};
  FaintEnd faint;
  while (static_cast<double>(faint.points.size()) < rule.faint_px) {
    now.point += unit(now.angle);
    if (!is_on(ridges.noise, now.point)) break;
    now = settle(ridges, rule, now);
    faint.points.push_back(now.point);
    faint.over_noise.push_back(now.height / std::max<double>(sample(ridges.noise, now.point), 1e-30));
  }
  return faint;
}

std::vector<Trace> trace_lines(const Ridges& ridges, const cv::Mat& is_inside, const TraceRule& rule,
                               const std::vector<Trace>& known) {
  const Ways ways(ridges, {rule.reach_px, rule.step_px, rule.smallest_radius_px, rule.follow_noise});
  Claims claims(ridges.noise.size(), ridges.n_directions());
  const double beside_px = 1.33 * rule.line_radius_px;
  for (const Trace& trace : known) claim(claims, trace, beside_px);
  std::vector<Trace> traces;
  for (const Seed& seed : seeds_of(ridges, ways, is_inside, rule)) {
    if (claims.has(seed.step.point, seed.step.angle)) continue;
    Trace trace = trace_from(ridges, ways, claims, rule, seed);
    claim(claims, trace, beside_px);
    cut_faded_ends(trace, rule);
    if (trace.points.size() < 3) continue;
    // where it ends a line answers in every direction
    for (const cv::Point2d& end : {trace.points.front(), trace.points.back()})
      claims.add_all_directions(end, beside_px);
    traces.push_back(std::move(trace));
  }
  traces = without_doubles(joined(std::move(traces), ridges, rule), ridges, rule);
  for (Trace& trace : traces) cut_faded_ends(trace, rule);
  std::erase_if(traces, [&](const Trace& t) { return static_cast<double>(t.points.size()) < rule.shortest_px; });
  return traces;
}

}  // namespace mbtfm::cells
