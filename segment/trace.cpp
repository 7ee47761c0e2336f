#include "segment/trace.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "segment/grid.h"
#include "segment/trace_join.h"

namespace mbtfm::segment {

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
  void add(cv::Point2d point, double angle_rad, double radius_px) {
    int mask = 0;
    for (int k = -2; k <= 2; ++k) mask |= 1 << ((index(angle_rad) + k + n_) % n_);
    const int r = static_cast<int>(std::ceil(radius_px));
    for (int dy = -r; dy <= r; ++dy)
      for (int dx = -r; dx <= r; ++dx) {
        const int x = cvRound(point.x) + dx, y = cvRound(point.y) + dy;
        if (dx * dx + dy * dy > radius_px * radius_px || x < 0 || y < 0 || x >= bits_.cols || y >= bits_.rows) continue;
        bits_.at<int>(y, x) |= mask;
      }
  }

 private:
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
    } else {
      now = settle(ridges, rule, now);
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
  };
  for (auto s = behind.rbegin(); s != behind.rend(); ++s) add(*s);
  add(seed);
  for (const Step& s : ahead) add(s);
  return trace;
}

void claim(Claims& claims, const Trace& trace, double radius_px) {
  for (std::size_t i = 0; i < trace.points.size(); ++i) {
    const std::size_t a = i > 1 ? i - 2 : 0, b = std::min(i + 2, trace.points.size() - 1);
    const cv::Point2d d = trace.points[b] - trace.points[a];
    claims.add(trace.points[i], std::atan2(d.y, d.x), radius_px);
  }
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

double height_at(std::vector<double> values, double share) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// How many points to cut from the front: up to where the height first reaches a share of the plateau behind it, and
/// the share of the whole line's that it may fall to.
std::size_t faded_points(const std::vector<double>& height, const TraceRule& rule) {
  const std::size_t window = std::min(height.size(), static_cast<std::size_t>(rule.end_window_px));
  const double whole = rule.follow_share * height_at(height, 0.5);
  std::size_t n = 0;
  while (n < height.size() && height[n] < whole) ++n;
  const std::size_t first = n, last = std::min(height.size(), first + window);
  if (first == last) return n;
  const auto from = height.begin() + static_cast<std::ptrdiff_t>(first);
  const double plateau = height_at({from, from + static_cast<std::ptrdiff_t>(last - first)}, 0.75);
  while (n < last && height[n] < rule.end_level * plateau) ++n;
  return n;
}

void cut_faded_ends(Trace& trace, const TraceRule& rule) {
  for (int side = 0; side < 2; ++side) {
    const auto n = static_cast<std::ptrdiff_t>(faded_points(trace.height, rule));
    trace.height.erase(trace.height.begin(), trace.height.begin() + n);
    trace.points.erase(trace.points.begin(), trace.points.begin() + n);
    std::reverse(trace.height.begin(), trace.height.end());
    std::reverse(trace.points.begin(), trace.points.end());
  }
}

}  // namespace

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
    cut_faded_ends(trace, rule);
    if (trace.points.size() >= 3) traces.push_back(std::move(trace));
  }
  traces = joined(std::move(traces), ridges, rule);
  std::erase_if(traces, [&](const Trace& t) { return static_cast<double>(t.points.size()) < rule.shortest_px; });
  return traces;
}

}  // namespace mbtfm::segment
