#include "segment/cells/trace.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/grid.h"
#include "segment/cells/trace_join.h"

namespace mbtfm::cells {

namespace {

using std::numbers::pi;

cv::Point2d unit(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad)}; }
cv::Point2d left_of(cv::Point2d e) { return {-e.y, e.x}; }
double length(cv::Point2d d) { return std::hypot(d.x, d.y); }

/// Which directions of lines already pass through each pixel, a bit each.
class Claims {
 public:
  Claims(cv::Size size, int n_directions) : bits_(size, CV_32S, cv::Scalar(0)), n_(n_directions) {}

  bool has(cv::Point2d point, double angle_rad) const {
    const int x = cvRound(point.x), y = cvRound(point.y);
    if (x < 0 || y < 0 || x >= bits_.cols || y >= bits_.rows) return false;
    return (bits_.at<int>(y, x) >> index(angle_rad)) & 1;
  }
  /// Lines within two of the filter's directions.
  void add(cv::Point2d point, double angle_rad, double radius_px) {
    int mask = 0;
    for (int k = -2; k <= 2; ++k) mask |= 1 << ((index(angle_rad) + k + n_) % n_);
    add(point, mask, radius_px);
  }
  void add_all_directions(cv::Point2d point, double radius_px) { add(point, (1 << n_) - 1, radius_px); }

 private:
  void add(cv::Point2d point, int mask, double radius_px) {
    const int r = static_cast<int>(std::ceil(radius_px));
    for (int dy = -r; dy <= r; ++dy)
      for (int dx = -r; dx <= r; ++dx) {
        const int x = cvRound(point.x) + dx, y = cvRound(point.y) + dy;
        if (dx * dx + dy * dy > radius_px * radius_px || x < 0 || y < 0 || x >= bits_.cols || y >= bits_.rows) continue;
        bits_.at<int>(y, x) |= mask;
      }
  }

  int index(double angle_rad) const {
    const int k = static_cast<int>(std::lround(angle_rad / pi * n_)) % n_;
    return k < 0 ? k + n_ : k;
  }
  cv::Mat bits_;
  int n_;
};

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

/// Best direction within one filter direction of the present one, then the ridge's centre across it.
Step settle(const Ridges& ridges, const TraceRule& rule, Step s) {
  const double turn = pi / ridges.n_directions();
  const double before = ridges.at(s.point, s.angle - turn), at = ridges.at(s.point, s.angle),
               after = ridges.at(s.point, s.angle + turn);
  // a third of the way a step, so that noise in the direction averages out
  const double limit = 1 / rule.smallest_radius_px;
  s.angle += std::clamp(turn / 3 * peak_offset(before, at, after), -limit, limit);
  const cv::Point2d across = left_of(unit(s.angle));
  const double offset = peak_offset(ridges.at(s.point - across, s.angle), ridges.at(s.point, s.angle),
                                    ridges.at(s.point + across, s.angle));
  s.point += 0.5 * offset * across;
  s.height = ridges.at(s.point, s.angle);
  return s;
}

bool is_on(const cv::Mat& image, cv::Point2d p) {
  return p.x >= 0 && p.y >= 0 && p.x <= image.cols - 1 && p.y <= image.rows - 1;
}

/// The direction of the last steps, from before the newest ones: where lines touch, the other one has bent those.
double course_of(const std::vector<Step>& steps, double window_px) {
  const std::size_t n = steps.size(), window = static_cast<std::size_t>(window_px),
                    newest = std::min(n / 3, window / 4);
  const std::size_t last = n - 1 - newest, first = last - std::min(last, window);
  const cv::Point2d way = steps[last].point - steps[first].point;
  return length(way) > 0 ? std::atan2(way.y, way.x) : steps.back().angle;
}

/// Steps from `start` (excluded) until the line is lost for longer than the gap, or runs upon one already traced for
/// longer than it may; there it goes straight on, for the other's ridge would lead it astray.
std::vector<Step> follow(const Ridges& ridges, const Claims& claims, const TraceRule& rule, Step start) {
  constexpr std::size_t kFirst = 3;  // steps before the line has a course of its own
  std::vector<Step> steps;
  std::size_t last_seen = 0, last_free = 0;
  Step now = start;
  double height_so_far = start.height;
  while (std::abs(now.angle - start.angle) < 2 * pi) {  // a ring ends
    const bool was_free = last_free == steps.size();
    now.point += unit(now.angle);
    if (!is_on(ridges.noise, now.point)) break;
    if (steps.size() >= kFirst && claims.has(now.point, now.angle)) {
      if (was_free) {
        now.angle = course_of(steps, rule.end_window_px);
        now.point = steps.back().point + unit(now.angle);
        if (!is_on(ridges.noise, now.point)) break;
      }
      now.height = ridges.at(now.point, now.angle);
      now.is_shared = true;
    } else {
      now = settle(ridges, rule, now);
      now.is_shared = false;
      last_free = steps.size() + 1;
    }
    steps.push_back(now);
    const double level =
        std::max(rule.follow_noise * sample(ridges.noise, now.point), rule.follow_share * height_so_far);
    if (now.height >= level) {
      last_seen = steps.size();
      height_so_far += (now.height - height_so_far) / static_cast<double>(steps.size() + 1);
    }
    if (static_cast<double>(steps.size() - last_seen) > rule.gap_px) break;
    if (static_cast<double>(steps.size() - last_free) > rule.through_px) break;
  }
  steps.resize(std::min(last_seen, last_free));
  return steps;
}

Trace trace_from(const Ridges& ridges, const Claims& claims, const TraceRule& rule, Step seed) {
  seed = settle(ridges, rule, settle(ridges, rule, seed));
  Step back = seed;
  back.angle += pi;
  const std::vector<Step> ahead = follow(ridges, claims, rule, seed), behind = follow(ridges, claims, rule, back);
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

/// Local maxima across their own direction that a line may start from, strongest first.
std::vector<Step> seeds_of(const Ridges& ridges, const cv::Mat& is_inside, const TraceRule& rule) {
  std::vector<Step> seeds;
  for (int y = 1; y + 1 < ridges.strongest.rows; ++y)
    for (int x = 1; x + 1 < ridges.strongest.cols; ++x) {
      const double height = ridges.strongest.at<float>(y, x);
      if (height < rule.start_noise * ridges.noise.at<float>(y, x) || height <= 0) continue;
      if (is_inside.at<std::uint8_t>(y, x) == 0) continue;
      if (ridges.is_crest(x, y)) seeds.push_back({cv::Point2d(x, y), ridges.angle_rad(x, y), height});
    }
  std::stable_sort(seeds.begin(), seeds.end(), [](const Step& a, const Step& b) { return a.height > b.height; });
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

std::vector<Trace> trace_lines(const Ridges& ridges, const cv::Mat& is_inside, const TraceRule& rule) {
  Claims claims(ridges.noise.size(), ridges.n_directions());
  std::vector<Trace> traces;
  for (const Step& seed : seeds_of(ridges, is_inside, rule)) {
    if (claims.has(seed.point, seed.angle)) continue;
    Trace trace = trace_from(ridges, claims, rule, seed);
    claim(claims, trace, 1.33 * rule.line_radius_px);
    // at its end a line answers in every direction
    for (const cv::Point2d& end : {trace.points.front(), trace.points.back()})
      claims.add_all_directions(end, 1.33 * rule.line_radius_px);
    cut_faded_ends(trace, rule);
    if (trace.points.size() >= 3) traces.push_back(std::move(trace));
  }
  traces = without_doubles(joined(std::move(traces), ridges, rule), ridges, rule);
  for (Trace& trace : traces) cut_faded_ends(trace, rule);
  std::erase_if(traces, [&](const Trace& t) { return static_cast<double>(t.points.size()) < rule.shortest_px; });
  return traces;
}

}  // namespace mbtfm::cells
