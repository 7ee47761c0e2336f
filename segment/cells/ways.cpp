#include "segment/cells/ways.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mbtfm::cells {

bool Claims::has(cv::Point2d point, double angle_rad) const {
  const int x = cvRound(point.x), y = cvRound(point.y);
  if (x < 0 || y < 0 || x >= bits_.cols || y >= bits_.rows) return false;
  return (bits_.at<int>(y, x) >> index(angle_rad)) & 1;
}

void Claims::add(cv::Point2d point, double angle_rad, double radius_px) {
  int mask = 0;
  for (int k = -1; k <= 1; ++k) mask |= 1 << ((index(angle_rad) + k + n_) % n_);
  mark(point, mask, radius_px);
}

void Claims::mark(cv::Point2d point, int mask, double radius_px) {
  const int r = static_cast<int>(std::ceil(radius_px));
  for (int dy = -r; dy <= r; ++dy)
    for (int dx = -r; dx <= r; ++dx) {
      const int x = cvRound(point.x) + dx, y = cvRound(point.y) + dy;
      if (dx * dx + dy * dy > radius_px * radius_px || x < 0 || y < 0 || x >= bits_.cols || y >= bits_.rows) continue;
      bits_.at<int>(y, x) |= mask;
    }
}

int Claims::index(double angle_rad) const {
  const int k = static_cast<int>(std::lround(angle_rad / std::numbers::pi * n_)) % n_;
  return k < 0 ? k + n_ : k;
}

namespace {

constexpr float kUnit = 4, kMost = 255;  // of a standard deviation: a byte holds 64 of them

/// Changes of curvature, as shares of that of the smallest radius.
constexpr double kChanges[] = {0, 0.25, -0.25, 0.5, -0.5, 1, -1};

/// Of responses in a row, by pixel a byte.
template <class Response>
cv::Mat in_units(const cv::Mat& noise, Response response) {
  cv::Mat bytes(noise.size(), CV_8U);
  for (int y = 0; y < noise.rows; ++y) {
    const float* deviation = noise.ptr<float>(y);
    std::uint8_t* to = bytes.ptr<std::uint8_t>(y);
    const auto at = response(y);
    for (int x = 0; x < noise.cols; ++x)
      to[x] = static_cast<std::uint8_t>(
          std::clamp(kUnit * at(x) / std::max(deviation[x], std::numeric_limits<float>::min()) + 0.5f, 0.0f, kMost));
  }
  return bytes;
}

cv::Mat in_units(const cv::Mat& noise, const cv::Mat& response) {
  return in_units(noise, [&](int y) { return [h = response.ptr<float>(y)](int x) { return h[x]; }; });
}

/// Half-way between two filters the cubic through four of them: a line there is seen by neither as high as it is.
cv::Mat between(const Ridges& ridges, std::size_t k) {
  const std::size_t n = ridges.response.size();
  const cv::Mat &a = ridges.response[(k + n - 1) % n], &b = ridges.response[k], &c = ridges.response[(k + 1) % n],
                &d = ridges.response[(k + 2) % n];
  return in_units(ridges.noise, [&](int y) {
    return [a = a.ptr<float>(y), b = b.ptr<float>(y), c = c.ptr<float>(y), d = d.ptr<float>(y)](int x) {
      return (9 * (b[x] + c[x]) - (a[x] + d[x])) / 16;
    };
  });
}

}  // namespace

Ways::Ways(const Ridges& ridges, const WayRule& rule)
    : rule_(rule),
      n_steps_(std::max(1, cvRound(rule.reach_px / rule.step_px))),
      over_noise_(2 * ridges.response.size()),
      strongest_(in_units(ridges.noise, ridges.strongest)) {
  cv::parallel_for_(cv::Range(0, ridges.n_directions()), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      const auto k = static_cast<std::size_t>(i);
      over_noise_[2 * k] = in_units(ridges.noise, ridges.response[k]);
      over_noise_[2 * k + 1] = between(ridges, k);
    }
  });
}

Ways::Turn Ways::turn_of(double curvature) const {
  const auto angle = static_cast<float>(curvature * rule_.step_px);
  return {angle, std::cos(angle / 2), std::sin(angle / 2)};
}

Ways::Walk Ways::walk_from(const Course& from) const {
  const auto step = static_cast<float>(rule_.step_px), angle = static_cast<float>(from.angle_rad);
  return {static_cast<float>(from.point.x), static_cast<float>(from.point.y), step * std::cos(angle),
          step * std::sin(angle), angle};
}

/// @returns whether that is still in the image
bool Ways::advance(Walk& w, const Turn& turn) const {
  const auto rotate = [&] {
    const float dx = turn.cosine * w.dx - turn.sine * w.dy;
    w.dy = turn.sine * w.dx + turn.cosine * w.dy;
    w.dx = dx;
  };
  rotate();
  w.x += w.dx;
  w.y += w.dy;
  rotate();
  w.angle += turn.angle;
  return w.x >= 0 && w.y >= 0 && w.x <= static_cast<float>(strongest_.cols - 1) &&
         w.y <= static_cast<float>(strongest_.rows - 1);
}

std::size_t Ways::index_of(float angle_rad) const {
  const auto n = static_cast<long>(over_noise_.size());
  const long k = std::lround(angle_rad * static_cast<float>(static_cast<double>(n) / std::numbers::pi)) % n;
  return static_cast<std::size_t>(k < 0 ? k + n : k);
}

bool Ways::is_hidden(std::uint8_t over_noise, cv::Point pixel) const {
  constexpr float kSkirt = 0.5;  // of an ideal line 14 degrees off
  return over_noise < kSkirt * strongest_.at<std::uint8_t>(pixel);
}

bool Ways::is_hidden(cv::Point2d point, double angle_rad) const {
  const cv::Point pixel(point);
  return is_hidden(over_noise_[index_of(static_cast<float>(angle_rad))].at<std::uint8_t>(pixel), pixel);
}

/// By pixel of the way.
float Ways::gain(const Walk& w, const Line& line) const {
  constexpr float kUnseen = -0.25;  // another line may hide this one, but not for ever
  const cv::Point pixel(static_cast<int>(w.x + 0.5f), static_cast<int>(w.y + 0.5f));
  const std::uint8_t over_noise = over_noise_[index_of(w.angle)].at<std::uint8_t>(pixel);
  const float seen = 2 * std::min(over_noise / line.level, 1.0f) - 1;
  if (is_hidden(over_noise, pixel)) return std::clamp(seen, kUnseen, 0.0f);
  if (line.claims && line.claims->has({w.x, w.y}, w.angle)) return std::min(seen, 0.0f);
  return seen;
}

/// What an arc gains up to where it is best to end.
double Ways::arc(Walk w, double curvature, const Line& line) const { return after(w, curvature, n_steps_, line, 0); }

/// The same of an arc of some steps; it is given up where it can no longer gain more than `least`.
double Ways::after(Walk w, double curvature, int n_steps, const Line& line, double least) const {
  const Turn turn = turn_of(curvature);
  double sum = 0, most = 0;
  for (int i = 0; i < n_steps && advance(w, turn); ++i) {
    most = std::max(most, sum += rule_.step_px * gain(w, line));
    if (sum + rule_.step_px * (n_steps - 1 - i) <= std::max(least, most)) break;
  }
  return most;
}

/// The best way on that begins with a curvature. @param spent  what it costs to begin so
Way Ways::beginning(const Course& from, double curvature, const Line& line, double spent) const {
  Way best{0, curvature};
  Walk w = walk_from(from);
  const Turn turn = turn_of(curvature);
  double sum = -spent;
  for (int i = 0; i < n_steps_ && advance(w, turn); ++i) {
    best.gain_px = std::max(best.gain_px, sum += rule_.step_px * gain(w, line));
    for (const double change : kChanges) {
      const double then = curvature + change / rule_.smallest_radius_px, left = sum - rule_.reach_px * std::abs(change);
      if (change == 0 || std::abs(then) * rule_.smallest_radius_px > 1 + 1e-3) continue;
      best.gain_px = std::max(best.gain_px, left + after(w, then, n_steps_ - 1 - i, line, best.gain_px - left));
    }
  }
  return best;
}

Way Ways::best(const Course& from, double over_noise, const Claims& claims) const {
  constexpr double kOwn = 0.5;  // over the nucleus a fibre is as low as a quarter of its height
  const auto own = static_cast<float>(kUnit * std::max(2 * rule_.follow_noise, kOwn * over_noise));
  const Line line{std::min(own, kMost), &claims};
  Way best;
  for (const double change : kChanges) {
    const double curvature = from.curvature + change / rule_.smallest_radius_px;
    if (std::abs(curvature) * rule_.smallest_radius_px > 1 + 1e-3) continue;
    const Way way = beginning(from, curvature, line, rule_.reach_px * std::abs(change));
    if (way.gain_px > best.gain_px) best = way;
  }
  return best;
}

Way Ways::through(const Course& at) const {
  const Line line{static_cast<float>(kUnit * 2 * rule_.follow_noise), nullptr};
  const Walk ahead = walk_from(at), behind = walk_from({at.point, at.angle_rad + std::numbers::pi, 0});
  Way best;
  for (const double share : {0.0, 0.5, -0.5, 1.0, -1.0}) {
    const double curvature = share / rule_.smallest_radius_px;
    const double gain_px = arc(ahead, curvature, line) + arc(behind, -curvature, line);
    if (gain_px > best.gain_px) best = {gain_px, curvature};
  }
  return best;
}

}  // namespace mbtfm::cells
