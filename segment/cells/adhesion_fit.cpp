#include "segment/cells/adhesion_parts.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/ellipse_solver.h"

namespace mbtfm::cells {
namespace {

using One = EllipseSolver<1>;
using Two = EllipseSolver<2>;

/// Beyond the rim the window reaches this many deviations of the blur: where an ellipse's light has gone, and there is
/// ground to decide.
constexpr double kMargin = 3;
constexpr int kRounds = 2;  // of neighbours taking each other's light off

/// First order in the distance; exact enough to choose pixels by.
double distance_to_rim(const BlurredEllipse& e, double x, double y) {
  const double c = std::cos(e.angle_rad), s = std::sin(e.angle_rad), a = e.semi_major, b = e.semi_minor;
  const double u = (x - e.x) * c + (y - e.y) * s, v = -(x - e.x) * s + (y - e.y) * c;
  const double q = std::sqrt(u * u / (a * a) + v * v / (b * b));
  return q < 1e-9 ? -b : (q - 1) * q / std::sqrt(u * u / (a * a * a * a) + v * v / (b * b * b * b));
}

/// Pixels within `margin` of the ellipse's rim or inside.
cv::Rect box_of(const BlurredEllipse& e, double margin, cv::Size size) {
  const double c = std::cos(e.angle_rad), s = std::sin(e.angle_rad);
  const double half_x = std::hypot(e.semi_major * c, e.semi_minor * s) + margin;
  const double half_y = std::hypot(e.semi_major * s, e.semi_minor * c) + margin;
  const cv::Point low(cvFloor(e.x - half_x), cvFloor(e.y - half_y)), high(cvCeil(e.x + half_x), cvCeil(e.y + half_y));
  return cv::Rect(low, high + cv::Point(1, 1)) & cv::Rect(cv::Point(0, 0), size);
}

std::vector<Sample> samples_around(const cv::Mat& height, const BlurredEllipse& e,
                                   const std::vector<EllipseModel>& neighbours) {
  const double margin = kMargin * e.blur + 1;
  const cv::Rect box = box_of(e, margin, height.size());
  std::vector<Sample> samples;
  for (int y = box.y; y < box.br().y; ++y)
    for (int x = box.x; x < box.br().x; ++x) {
      if (distance_to_rim(e, x, y) > margin) continue;
      double value = height.at<float>(y, x);
      for (const EllipseModel& neighbour : neighbours) value -= neighbour.value(x, y);
      samples.push_back({x, y, value});
    }
  return samples;
}

/// The major axis is the longer one; the slope along it does not matter any more.
BlurredEllipse in_order(BlurredEllipse e) {
  if (e.semi_minor > e.semi_major) {
    std::swap(e.semi_minor, e.semi_major);
    e.angle_rad += CV_PI / 2;
    e.slope = 0;
  }
  return e;
}

bool is_plausible(const BlurredEllipse& e, const BlurredEllipse& start) {
  return distance_to_rim(start, e.x, e.y) < 0 && e.brightness > 0;
}

double mean_noise(const cv::Mat& noise, const std::vector<Sample>& samples) {
  double sum = 0;
  for (const Sample& p : samples) sum += noise.at<float>(p.row, p.column);
  return sum / static_cast<double>(samples.size());
}

/// @param window  the ellipse around which pixels are taken
/// @param from    where the iteration starts
FittedEllipse fit(const cv::Mat& height, const cv::Mat& noise, const BlurredEllipse& window, const One::State& from,
                  const std::vector<EllipseModel>& neighbours, const Priors& priors) {
  const auto samples = samples_around(height, window, neighbours);
  FittedEllipse result{.ellipse = window};
  if (samples.size() <= One::kUnknowns) return result;
  const auto s = One::solve(samples, from, Shape::held, priors);
  const double n = static_cast<double>(samples.size());
  double mean = 0, variance = 0;
  for (const Sample& p : samples) mean += p.value / n;
  for (const Sample& p : samples) variance += (p.value - mean) * (p.value - mean) / n;
  const double of_noise = std::pow(mean_noise(noise, samples), 2), signal = variance - of_noise;
  result.unexplained = signal > 0 ? std::max(0.0, s.scatter - of_noise) / signal : 1;
  result.scatter = s.scatter;
  result.noise = of_noise;
  result.is_settled = s.is_settled && is_plausible(s.state.ellipses[0], window);
  if (!is_plausible(s.state.ellipses[0], window)) return result;
  result.ellipse = in_order(s.state.ellipses[0]);
  result.ground = s.state.ground;
  return result;
}

/// Indices of the ellipses whose light reaches into another's window.
std::vector<std::vector<int>> neighbours_of(const std::vector<BlurredEllipse>& ellipses, cv::Size size) {
  const int n = static_cast<int>(ellipses.size());
  std::vector<cv::Rect> boxes;
  for (const BlurredEllipse& e : ellipses) boxes.push_back(box_of(e, kMargin * e.blur + 1, size));
  std::vector<int> by_left(ellipses.size());
  for (int i = 0; i < n; ++i) by_left[i] = i;
  std::stable_sort(by_left.begin(), by_left.end(), [&](int a, int b) { return boxes[a].x < boxes[b].x; });
  std::vector<std::vector<int>> result(ellipses.size());
  std::vector<int> open;  // boxes that the sweep from the left has not passed yet
  for (const int i : by_left) {
    std::erase_if(open, [&](int j) { return boxes[j].br().x <= boxes[i].x; });
    for (const int j : open) {
      if ((boxes[i] & boxes[j]).empty()) continue;
      result[i].push_back(j);
      result[j].push_back(i);
    }
    open.push_back(i);
  }
  for (auto& list : result) std::sort(list.begin(), list.end());
  return result;
}

/// Call `body` for each window with the models of the others whose light reaches into it, in parallel.
template <class Body>
void for_each_with_neighbours(const cv::Mat& height, const std::vector<BlurredEllipse>& windows,
                              const std::vector<BlurredEllipse>& others, const Body& body) {
  const auto neighbours = neighbours_of(windows, height.size());
  cv::parallel_for_(cv::Range(0, static_cast<int>(windows.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      std::vector<EllipseModel> near;
      for (const int j : neighbours[i]) near.emplace_back(others[j]);
      body(i, near);
    }
  });
}

/// An ellipse narrower than this many deviations of the blur fits as well with another blur.
constexpr double kWide = 1.5;
constexpr int kFewest = 8;  // of which to take a mean

/// Before the image is asked: the blur to a factor of about 1.6, the dome to 0.2.
constexpr double kBlurDeviation = 0.5, kDomeDeviation = 0.2;

/// What one adhesion says of ln blur and dome beyond what was known before: information (inverse covariance, the other
/// unknowns eliminated) and information times estimate.
struct ShapeEvidence {
  cv::Matx22d information = cv::Matx22d::zeros();
  cv::Vec2d weighted;
};

std::optional<ShapeEvidence> evidence_of_shape(const cv::Mat& height, const BlurredEllipse& start,
                                               const std::vector<EllipseModel>& neighbours) {
  const auto samples = samples_around(height, start, neighbours);
  if (samples.size() <= One::kUnknowns) return std::nullopt;
  auto s = One::solve(samples, {{start}, 0}, Shape::held, {});
  const double scatter = s.scatter;  // noise and misfit
  Priors before;
  before.blur = {std::log(start.blur), scatter / (kBlurDeviation * kBlurDeviation)};
  before.dome = {start.dome, scatter / (kDomeDeviation * kDomeDeviation)};
  s = One::solve(samples, s.state, Shape::free, before);
  const BlurredEllipse& e = s.state.ellipses[0];
  if (!s.is_settled || !is_plausible(e, start)) return std::nullopt;
  One::Matrix covariance;
  if (cv::invert(s.normal.matrix, covariance, cv::DECOMP_CHOLESKY) == 0) return std::nullopt;
  // of the inverse, these rows and columns are the inverse of the information that is left
  const cv::Matx22d part(covariance(One::kBlur, One::kBlur), covariance(One::kBlur, One::kDome),
                         covariance(One::kDome, One::kBlur), covariance(One::kDome, One::kDome));
  ShapeEvidence evidence{part.inv() * (1 / scatter), {}};
  evidence.weighted = evidence.information * cv::Vec2d(std::log(e.blur), e.dome);
  const cv::Vec2d known(1 / (kBlurDeviation * kBlurDeviation), 1 / (kDomeDeviation * kDomeDeviation));
  evidence.information -= cv::Matx22d::diag(known);
  evidence.weighted -= known.mul(cv::Vec2d(before.blur.mean, before.dome.mean));
  return evidence;
}

struct LogBrightness {
  double mean, deviation;
};

/// Of the adhesions that are wide enough to show their brightness. A narrower one shows the product of brightness and
/// area only; that it is about as bright as its neighbours is what separates the two.
std::optional<LogBrightness> common_brightness(const std::vector<FittedEllipse>& fitted) {
  std::vector<double> logarithms;
  for (const FittedEllipse& f : fitted)
    if (f.is_settled && f.ellipse.semi_minor > kWide * f.ellipse.blur)
      logarithms.push_back(std::log(f.ellipse.brightness));
  if (logarithms.size() < kFewest) return std::nullopt;
  const double middle = numerics::median(logarithms);
  for (double& value : logarithms) value = std::abs(value - middle);
  // never surer than a quarter: adhesions of one cell differ by that
  return LogBrightness{middle, std::max(0.25, 1.4826 * numerics::median(logarithms))};
}

/// What the model leaves of one adhesion besides noise, as a share of its brightness: root mean square.
double common_misfit(const std::vector<FittedEllipse>& fitted) {
  constexpr double kUsual = 0.02;  // of simulated cells, whose adhesions slope and have soft rims
  std::vector<double> squares;
  for (const FittedEllipse& f : fitted)
    if (f.is_settled) squares.push_back(std::max(0.0, f.scatter - f.noise) / std::pow(f.ellipse.brightness, 2));
  return squares.size() < kFewest ? kUsual : std::sqrt(numerics::median(squares));
}

/// From the centre to the rim in this direction.
double radius_towards(const BlurredEllipse& e, double dx, double dy) {
  const double c = std::cos(e.angle_rad), s = std::sin(e.angle_rad), length = std::hypot(dx, dy);
  return length / std::hypot((dx * c + dy * s) / e.semi_major, (dy * c - dx * s) / e.semi_minor);
}

struct PairRule {
  double misfit = 0, least_area = 0;
};

bool are_two(const TwoEllipses& two, const PairRule& rule) {
  constexpr double kApart = 0.9;  // of the sum of their radii: the fit's errors are a tenth of a radius
  const double dx = two[1].x - two[0].x, dy = two[1].y - two[0].y;
  const auto is_one = [&](const BlurredEllipse& e) {
    return e.brightness > 0 && CV_PI * e.semi_major * e.semi_minor >= rule.least_area;
  };
  return is_one(two[0]) && is_one(two[1]) &&
         std::hypot(dx, dy) > kApart * (radius_towards(two[0], dx, dy) + radius_towards(two[1], dx, dy));
}

std::optional<TwoEllipses> better_two(const std::vector<Sample>& samples, const FittedEllipse& one,
                                      const std::vector<TwoEllipses>& halves, const Priors& priors,
                                      const PairRule& rule) {
  const double n = static_cast<double>(samples.size());
  const double blur_px = 4 * CV_PI * one.ellipse.blur * one.ellipse.blur;
  const double variance = one.noise + blur_px * std::pow(rule.misfit * one.ellipse.brightness, 2);
  // Twice what Schwarz asks for, as most regions are one adhesion. Of 57 right and 19 wrong pairs in eight simulated
  // pictures that reach his level, 55 and 10 reach twice it.
  double least = 2 * One::kOwn / 2.0 * std::log(n);
  const auto gain = [&](double scatter) { return n * (one.scatter - scatter) / (2 * variance); };
  std::optional<TwoEllipses> best;
  if (n <= Two::kUnknowns || gain(one.noise) < least) return best;
  for (const TwoEllipses& start : halves) {
    const auto s = Two::solve(samples, {start, one.ground}, Shape::held, priors);
    if (!s.is_settled || gain(s.scatter) < least || !are_two(s.state.ellipses, rule)) continue;
    least = gain(s.scatter);
    best = {in_order(s.state.ellipses[0]), in_order(s.state.ellipses[1])};
  }
  return best;
}

}  // namespace

CommonShape common_shape(const cv::Mat& height, const std::vector<BlurredEllipse>& start) {
  // judged before the fit, lest those be chosen that come out with little blur
  std::vector<double> widths;
  for (const BlurredEllipse& e : start) widths.push_back(e.semi_minor / e.blur);
  std::sort(widths.begin(), widths.end(), std::greater<>());
  constexpr std::size_t kMost = 40;
  const double width = std::max(kWide, widths.size() > kMost ? widths[kMost] : 0.0);
  std::vector<std::optional<ShapeEvidence>> evidence(start.size());
  for_each_with_neighbours(height, start, start, [&](int i, const std::vector<EllipseModel>& near) {
    if (start[i].semi_minor >= width * start[i].blur) evidence[i] = evidence_of_shape(height, start[i], near);
  });
  const cv::Vec2d known(1 / (kBlurDeviation * kBlurDeviation), 1 / (kDomeDeviation * kDomeDeviation));
  ShapeEvidence all{cv::Matx22d::diag(known), known.mul(cv::Vec2d(std::log(start[0].blur), start[0].dome))};
  for (const auto& one : evidence) {
    if (!one) continue;
    all.information += one->information;
    all.weighted += one->weighted;
  }
  const cv::Vec2d mean = all.information.inv() * all.weighted;
  // beyond a half the rim, where the brightness ends, would lie below half of the height: no edge any more
  constexpr double kSteepestDome = 0.5;
  return {std::exp(mean[0]), std::clamp(mean[1], 0.0, kSteepestDome)};
}

std::vector<FittedEllipse> fit_ellipses(const cv::Mat& height, const cv::Mat& noise,
                                        const std::vector<BlurredEllipse>& start,
                                        const std::vector<std::vector<TwoEllipses>>& halves, double least_area) {
  std::vector<BlurredEllipse> current = start;
  std::vector<FittedEllipse> fitted(start.size());
  std::vector<Priors> priors(start.size());
  for (int round = 0; round < kRounds; ++round) {
    for_each_with_neighbours(height, start, current, [&](int i, const std::vector<EllipseModel>& near) {
      fitted[i] = fit(height, noise, start[i], {{current[i]}, fitted[i].ground}, near, priors[i]);
    });
    const auto common = common_brightness(fitted);
    for (std::size_t i = 0; i < current.size(); ++i) {
      current[i] = fitted[i].ellipse;
      if (common) priors[i].brightness = {common->mean, fitted[i].scatter / (common->deviation * common->deviation)};
    }
  }
  const double misfit = common_misfit(fitted);
  for_each_with_neighbours(height, start, current, [&](int i, const std::vector<EllipseModel>& near) {
    if (!halves[i].empty())
      fitted[i].two = better_two(samples_around(height, start[i], near), fitted[i], halves[i], priors[i],
                                 {.misfit = misfit, .least_area = least_area});
  });
  return fitted;
}

}  // namespace mbtfm::cells
