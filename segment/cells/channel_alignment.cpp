#include "segment/cells/channel_alignment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <vector>

#include "pipeline/contract/polyline.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/grid.h"

namespace mbtfm::cells {
namespace {

constexpr double kStrays = 0.5;     // share of ends that belong to no adhesion
constexpr double kAlong_um = 2;     // of an end from its adhesion: the line fades before it, or runs on over it
constexpr double kStraight_um = 2;  // of a fibre's end, taken as straight
constexpr int kUnknowns = 4;        // shift x, y, turn, growth

/// The straight end of a fibre, and the adhesions that may hold it.
struct End {
  Vec2 place_um, ahead;
  std::vector<Vec2> adhesions_um;
  Vec2 normal() const { return {-ahead.y, ahead.x}; }
};

/// Of the last micrometres of the line, from its end backwards.
End end_of(Polyline line, bool at_front) {
  if (at_front) std::ranges::reverse(line);
  const double length = length_um(line), part = std::min(kStraight_um, length);
  constexpr int kPoints = 21;
  std::array<Vec2, kPoints> points;
  Vec2 mean;
  for (int i = 0; i < kPoints; ++i) {
    points[i] = point_along_um(line, 1 - part / length * i / (kPoints - 1));
    mean += 1.0 / kPoints * points[i];
  }
  double xx = 0, xy = 0, yy = 0;
  for (const Vec2 p : points) {
    const Vec2 d = p - mean;
    xx += d.x * d.x, xy += d.x * d.y, yy += d.y * d.y;
  }
  const double angle = 0.5 * std::atan2(2 * xy, xx - yy);
  Vec2 ahead{std::cos(angle), std::sin(angle)};
  if (dot(ahead, points.front() - points.back()) < 0) ahead = -1 * ahead;
  return {.place_um = mean + dot(points.front() - mean, ahead) * ahead, .ahead = ahead, .adhesions_um = {}};
}

std::vector<End> ends_of(const std::vector<Fibre>& fibres, const std::vector<Adhesion>& adhesions, double reach_um) {
  std::vector<End> ends;
  for (const Fibre& fibre : fibres) {
    for (const bool at_front : {true, false}) {
      End end = end_of(fibre.points_um, at_front);
      for (const Adhesion& a : adhesions) {
        const Vec2 d = a.position_um - end.place_um;
        const double along = std::abs(dot(d, end.ahead)), aside = std::abs(dot(d, end.normal()));
        if (along < kAlong_um && aside < reach_um) end.adhesions_um.push_back(a.position_um);
      }
      if (!end.adhesions_um.empty()) ends.push_back(std::move(end));
    }
  }
  return ends;
}

using Unknowns = cv::Vec<double, kUnknowns>;

/// What an end's offset from an adhesion is as the unknowns have it, and how it answers to them.
struct Model {
  Vec2 centre_um;
  double width_um, range_um;

  Unknowns row(const End& end) const {
    const Vec2 n = end.normal(), d = end.place_um - centre_um;
    return {n.x, n.y, n.x * -d.y + n.y * d.x, dot(n, d)};
  }
  /// Of the adhesion that suits best, by aside of the end's line.
  double offset_um(const End& end, const Unknowns& x) const {
    double best = 1e300;
    const double moved = row(end).dot(x);
    for (const Vec2 a : end.adhesions_um) {
      const double offset = dot(a - end.place_um, end.normal()) - moved;
      if (std::abs(offset) < std::abs(best)) best = offset;
    }
    return best;
  }
  double density(double offset) const {
    const double u = offset / width_um;
    return (1 - kStrays) * std::exp(-0.5 * u * u) / (width_um * std::sqrt(2 * std::numbers::pi));
  }
  double log_likelihood(const std::vector<End>& ends, const Unknowns& x) const {
    double sum = 0;
    for (const End& end : ends) sum += std::log(density(offset_um(end, x)) + kStrays / (2 * range_um));
    return sum;
  }
  /// That the end belongs to the adhesion.
  double membership(double offset) const {
    const double own = density(offset);
    return own / (own + kStrays / (2 * range_um));
  }
};

Unknowns best_shift(const Model& model, const std::vector<End>& ends, double farthest_um) {
  const double step = 0.5 * model.width_um;
  const int n = static_cast<int>(farthest_um / step);
  Unknowns best{};
  double highest = -1e300;
  for (int j = -n; j <= n; ++j) {
    for (int i = -n; i <= n; ++i) {
      const Unknowns x{step * i, step * j, 0, 0};
      const double likelihood = model.log_likelihood(ends, x);
      if (likelihood > highest) highest = likelihood, best = x;
    }
  }
  return best;
}

struct Normal {
  cv::Matx<double, kUnknowns, kUnknowns> information, scores;
  Unknowns slope;
  double n = 0;  ///< members
};

/// By expectation–maximisation: squares weighed by membership.
Normal normal_equations(const Model& model, const std::vector<End>& ends, const Unknowns& x) {
  Normal sum{};
  for (const End& end : ends) {
    const double offset = model.offset_um(end, x), p = model.membership(offset);
    const Unknowns row = model.row(end);
    sum.information += p * (row * row.t());
    sum.scores += p * p * offset * offset * (row * row.t());
    sum.slope += p * offset * row;
    sum.n += p;
  }
  return sum;
}

double median_minor_axis_um(const std::vector<Adhesion>& adhesions) {
  std::vector<double> axes_um;
  for (const Adhesion& a : adhesions) axes_um.push_back(a.minor_axis_um);
  return numerics::median_in(axes_um);
}

}  // namespace

Vec2 ChannelAlignment::of(Vec2 actin_um) const {
  const Vec2 d = actin_um - centre_um;
  return actin_um + shift_um + growth * d + turn_rad * Vec2{-d.y, d.x};
}

bool ChannelAlignment::is_significant() const {
  // Chi squared of four numbers: one pair of images in 370. A shift found elsewhere than near none is the best of some
  // two hundred, which adds twice their logarithm.
  constexpr double kByChance = 16.25, kOfMany = 10.6;
  return gain > kByChance + (norm(shift_um) > 0.3 ? kOfMany : 0);
}

std::optional<ChannelAlignment> align_channels(const std::vector<Fibre>& fibres, const std::vector<Adhesion>& adhesions,
                                               double farthest_um) {
  if (adhesions.empty()) return {};
  Model model{.centre_um = {}, .width_um = 0.25 * median_minor_axis_um(adhesions), .range_um = farthest_um};
  const std::vector<End> ends = ends_of(fibres, adhesions, farthest_um + 2 * model.width_um);
  constexpr std::size_t kFewest = 10;
  if (ends.size() < kFewest) return {};
  for (const End& end : ends) model.centre_um += 1.0 / static_cast<double>(ends.size()) * end.place_um;
  Unknowns x = best_shift(model, ends, farthest_um);
  constexpr int kSteps = 30;  // the memberships settle in ten
  for (int step = 0; step < kSteps; ++step) {
    const Normal normal = normal_equations(model, ends, x);
    Unknowns change;
    if (!cv::solve(normal.information, normal.slope, change, cv::DECOMP_CHOLESKY)) return {};
    x += change;
    if (std::hypot(change[0], change[1]) < 1e-6) break;
  }
  const Normal normal = normal_equations(model, ends, x);
  if (normal.n < 0.5 * kFewest) return {};
  const auto inverse = normal.information.inv(cv::DECOMP_SVD);
  const auto covariance = normal.n / (normal.n - kUnknowns) * (inverse * normal.scores * inverse);
  const auto sigma = [&](int i) { return std::sqrt(std::max(0.0, covariance(i, i))); };
  return ChannelAlignment{.centre_um = model.centre_um,
                          .shift_um = {x[0], x[1]},
                          .turn_rad = x[2],
                          .growth = x[3],
                          .shift_sigma_um = {sigma(0), sigma(1)},
                          .turn_sigma_rad = sigma(2),
                          .growth_sigma = sigma(3),
                          .gain = 2 * (model.log_likelihood(ends, x) - model.log_likelihood(ends, Unknowns{}))};
}

std::string sentence_of(const ChannelAlignment& a) {
  constexpr double kDegree = 180 / std::numbers::pi;
  return with_error(a.shift_um, a.shift_sigma_um) + " um, turned by " +
         with_error(kDegree * a.turn_rad, kDegree * a.turn_sigma_rad) + " degrees and grown by " +
         with_error(100 * a.growth, 100 * a.growth_sigma) + " %";
}

namespace {

constexpr double kBeside_um = 0.5;  // beyond what the microscope blurs

double contrast(const cv::Mat& image, Vec2 at_um, Vec2 across, double half_width_um, double pixel_um) {
  const Vec2 aside = (half_width_um + kBeside_um) * across;
  const auto brightness = [&](Vec2 point) { return sample(image, to_pixels(point, pixel_um)); };
  return brightness(at_um) - 0.5 * (brightness(at_um + aside) + brightness(at_um - aside));
}

/// Of a fibre's points, away from its ends, which adhesions hold.
void add_contrasts(std::vector<double>& contrasts, const cv::Mat& image, const Fibre& fibre, double pixel_um,
                   double step_um) {
  constexpr double kEnd_um = 3;
  const double whole_um = length_um(fibre.points_um);
  double before_um = 0, next_um = kEnd_um;
  for (std::size_t i = 1; i < fibre.points_um.size(); ++i) {
    const Vec2 from = fibre.points_um[i - 1], chord = fibre.points_um[i] - from;
    const double length = norm(chord);
    const Vec2 along = (1 / length) * chord;
    for (; next_um < std::min(before_um + length, whole_um - kEnd_um); next_um += step_um) {
      const Vec2 at = from + (next_um - before_um) * along;
      contrasts.push_back(contrast(image, at, {-along.y, along.x}, 0.5 * fibre.width_um, pixel_um));
    }
    before_um += length;
  }
}

}  // namespace

std::optional<double> contrast_of_fibres(const images::Image& adhesion, const Cell& cell, double pixel_um) {
  constexpr double kStep_um = 0.2, kEnough_um = 10;
  const cv::Mat image = matrix_of(adhesion);
  std::vector<double> of_fibres, of_adhesions;
  for (const Fibre& fibre : cell.fibres) add_contrasts(of_fibres, image, fibre, pixel_um, kStep_um);
  for (const Adhesion& a : cell.adhesions) {
    if (is_assumed(a.origin)) continue;
    const Vec2 across{-std::sin(a.angle_rad), std::cos(a.angle_rad)};
    of_adhesions.push_back(contrast(image, a.position_um, across, 0.5 * a.minor_axis_um, pixel_um));
  }
  if (of_adhesions.empty() || static_cast<double>(of_fibres.size()) * kStep_um < kEnough_um) return std::nullopt;
  const double bright = numerics::median_in(of_adhesions);
  if (bright <= 0) return std::nullopt;
  return numerics::median_in(of_fibres) / bright;
}

}  // namespace mbtfm::cells
