#include "segment/cells/ridge.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/grid.h"

namespace mbtfm::cells {
namespace {

using std::numbers::pi;

/// The filter's transfer function at angular frequencies (wx, wy) per pixel for lines along `e`.
///
/// K(n, t) = −∂²/∂n² of a Gaussian of widths (w, l). A line of profile exp(−n²/2w²) through it has the height
/// √(2π) w / (√(2π) √2 w) / (2 w²) = 1 / (2√2 w²), hence the factor in front.
double transfer(double wx, double wy, cv::Point2d e, double w, double l) {
  const double along = wx * e.x + wy * e.y, across = wy * e.x - wx * e.y;
  const double exponent = (w * w * across * across + l * l * along * along) / 2;
  constexpr double kNothing = 80;  // exp(−80) = 2e-35 is lost beside the image's rounding: most frequencies are there
  return exponent > kNothing ? 0 : 2 * std::numbers::sqrt2 * w * w * across * across * std::exp(-exponent);
}

/// The filters of two directions as H₁ + i H₂ on a tile's frequencies: both kernels are real and even, so their
/// responses are real, and the spectrum times this goes back to response 1 + i response 2 in one transform.
cv::Mat pair_of_filters(int side, cv::Point2d e1, cv::Point2d e2, double w, double l) {
  cv::Mat filters(side, side, CV_32FC2);
  const auto frequency = [&](int i) { return 2 * pi * (i <= side / 2 ? i : i - side) / side; };
  // of the kernel sampled at the pixels, whose spectrum repeats: cut off at the grid's highest frequency it would ring
  const auto sampled = [&](int x, int y, cv::Point2d e) {
    double sum = 0;
    for (const int i : {-1, 0, 1})
      for (const int j : {-1, 0, 1}) sum += transfer(frequency(x) + 2 * pi * i, frequency(y) + 2 * pi * j, e, w, l);
    return static_cast<float>(sum);
  };
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) filters.at<std::complex<float>>(y, x) = {sampled(x, y, e1), sampled(x, y, e2)};
  return filters;
}

/// What white noise of deviation 1 becomes through the first filter of a pair (Parseval).
double noise_gain_of(const cv::Mat& filters) {
  double sum = 0;
  for (int y = 0; y < filters.rows; ++y)
    for (int x = 0; x < filters.cols; ++x) {
      const double h = filters.at<std::complex<float>>(y, x).real();
      sum += h * h;
    }
  return std::sqrt(sum / static_cast<double>(filters.total()));
}

struct FilterBank {
  int margin = 0, side = 0;      ///< of a tile, in pixels; the margin is inside the side
  std::vector<cv::Mat> filters;  ///< by pair of directions
  double noise_gain = 0;
};

cv::Point2d along(int k, int n) { return {std::cos(pi * k / n), std::sin(pi * k / n)}; }

FilterBank bank_of(const RidgeScales& scales, int n_directions) {
  FilterBank bank;
  const double l = scales.length_sigma_px;
  // beyond 3.5 standard deviations lies 5e-4 of the weight
  bank.margin = static_cast<int>(std::ceil(3.5 * std::max(l, scales.width_sigma_px)));
  bank.side = 128;  // a transform of this side stays in a processor's cache
  while (bank.side < 6 * bank.margin) bank.side *= 2;
  bank.filters.resize(static_cast<std::size_t>(n_directions / 2));
  cv::parallel_for_(cv::Range(0, n_directions / 2), [&](const cv::Range& pairs) {
    for (int i = pairs.start; i < pairs.end; ++i)
      bank.filters[i] = pair_of_filters(bank.side, along(2 * i, n_directions), along(2 * i + 1, n_directions),
                                        scales.width_sigma_px, l);
  });
  // along the pixels and across their diagonal: the grid cuts the narrow filter's spectrum differently
  for (const std::size_t pair : {std::size_t{0}, bank.filters.size() / 2})
    bank.noise_gain = std::max(bank.noise_gain, noise_gain_of(bank.filters[pair]));
  return bank;
}

/// The responses of one tile of the padded image into `ridges`, whose pixel `at` is the tile's first beyond its margin.
void filter_tile(const cv::Mat& padded, const FilterBank& bank, cv::Point at, Ridges& ridges) {
  cv::Mat spectrum, product, both, parts[2];
  cv::dft(padded(cv::Rect(at, cv::Size(bank.side, bank.side))), spectrum, cv::DFT_COMPLEX_OUTPUT);
  const int step = bank.side - 2 * bank.margin;
  const cv::Size size = ridges.strongest.size();
  const cv::Rect there(at, cv::Size(std::min(step, size.width - at.x), std::min(step, size.height - at.y)));
  const cv::Rect here(cv::Point(bank.margin, bank.margin), there.size());
  for (std::size_t pair = 0; pair < bank.filters.size(); ++pair) {
    cv::mulSpectrums(spectrum, bank.filters[pair], product, 0);
    cv::dft(product, both, cv::DFT_INVERSE | cv::DFT_SCALE);
    cv::split(both(here), parts);
    for (std::size_t i = 0; i < 2; ++i) parts[i].copyTo(ridges.response[2 * pair + i](there));
  }
  cv::Mat strongest = ridges.strongest(there), direction = ridges.direction(there);
  ridges.response[0](there).copyTo(strongest);
  direction.setTo(0);
  for (std::size_t k = 1; k < ridges.response.size(); ++k) {
    const cv::Mat response = ridges.response[k](there);
    direction.setTo(static_cast<double>(k), response > strongest);
    cv::max(response, strongest, strongest);
  }
}

}  // namespace

double Ridges::at(cv::Point2d point, double angle_rad) const {
  const int n = n_directions();
  double place = angle_rad / pi * n;
  place -= n * std::floor(place / n);
  const int k = static_cast<int>(place) % n;
  const double u = place - std::floor(place);
  return (1 - u) * sample(response[k], point) + u * sample(response[(k + 1) % n], point);
}

double Ridges::angle_rad(int x, int y) const { return pi * direction.at<std::uint8_t>(y, x) / n_directions(); }

bool Ridges::is_crest(int x, int y) const {
  const double angle = angle_rad(x, y), height = strongest.at<float>(y, x);
  const cv::Point2d across(-std::sin(angle), std::cos(angle)), here(x, y);
  return at(here - across, angle) <= height && at(here + across, angle) < height;
}

namespace {

Ridges filtered(const cv::Mat& image, const FilterBank& bank, int n_directions) {
  const int step = bank.side - 2 * bank.margin;
  const int columns = (image.cols + step - 1) / step, rows = (image.rows + step - 1) / step;
  cv::Mat padded;
  cv::copyMakeBorder(image, padded, bank.margin, bank.margin + rows * step - image.rows, bank.margin,
                     bank.margin + columns * step - image.cols, cv::BORDER_REFLECT_101);
  Ridges ridges;
  for (int k = 0; k < n_directions; ++k) ridges.response.emplace_back(image.size(), CV_32F);
  ridges.strongest.create(image.size(), CV_32F);
  ridges.direction.create(image.size(), CV_8U);
  cv::parallel_for_(cv::Range(0, rows * columns), [&](const cv::Range& tiles) {
    for (int i = tiles.start; i < tiles.end; ++i)
      filter_tile(padded, bank, {i % columns * step, i / columns * step}, ridges);
  });
  return ridges;
}

}  // namespace

Ridges find_ridges(const cv::Mat& image, const RidgeScales& scales, int n_directions) {
  return filtered(image, bank_of(scales, n_directions), n_directions);
}

Ridges find_ridges(const cv::Mat& image, const cv::Mat& is_inside, const RidgeScales& scales, int n_directions) {
  const FilterBank bank = bank_of(scales, n_directions);
  Ridges ridges = filtered(image, bank, n_directions);
  ridges.camera_noise = texture_of({noise_magnitude(image)}, is_inside, scales.noise_radius_px) * bank.noise_gain;
  set_noise(ridges, is_inside, scales.noise_radius_px);
  return ridges;
}

void set_noise(Ridges& ridges, const cv::Mat& is_free, double radius_px) {
  ridges.noise = cv::max(ridges.camera_noise, texture_of(ridges.response, is_free, radius_px));
}

namespace {

/// Magnitudes of responses on a coarse grid, one pixel picked from each block, and where there is no fibre.
struct Picked {
  std::vector<cv::Mat> magnitude;
  cv::Mat is_free;
};

Picked pick(const std::vector<cv::Mat>& responses, const cv::Mat& is_free, int factor) {
  const cv::Size size((is_free.cols + factor - 1) / factor, (is_free.rows + factor - 1) / factor);
  const auto place = [&](int i, int n) { return std::min(i * factor + factor / 2, n - 1); };
  Picked picked{{}, cv::Mat(size, CV_8U)};
  for (std::size_t k = 0; k < responses.size(); k += 2) picked.magnitude.emplace_back(size, CV_32F);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const cv::Point from(place(x, is_free.cols), place(y, is_free.rows));
      picked.is_free.at<std::uint8_t>(y, x) = is_free.at<std::uint8_t>(from);
      for (std::size_t k = 0; k < picked.magnitude.size(); ++k)
        picked.magnitude[k].at<float>(y, x) = std::abs(responses[2 * k].at<float>(from));
    }
  return picked;
}

/// Magnitudes at the free places of a disc.
void collect(const cv::Mat& magnitude, const cv::Mat& is_free, cv::Point2d centre, double radius,
             std::vector<float>& values) {
  values.clear();
  const int top = std::max(0, cvCeil(centre.y - radius)),
            bottom = std::min(magnitude.rows - 1, cvFloor(centre.y + radius));
  for (int y = top; y <= bottom; ++y) {
    const double half = std::sqrt(radius * radius - (y - centre.y) * (y - centre.y));
    const int left = std::max(0, cvCeil(centre.x - half)),
              right = std::min(magnitude.cols - 1, cvFloor(centre.x + half));
    for (int x = left; x <= right; ++x)
      if (is_free.at<std::uint8_t>(y, x) != 0) values.push_back(magnitude.at<float>(y, x));
  }
}

/// The spread around one place of the coarse grid; 0 where nothing free is around.
float spread_at(const Picked& picked, cv::Point2d centre, double radius, std::vector<float>& values,
                std::vector<float>& spreads) {
  constexpr std::size_t kEnough = 40;                 // the tenth largest of them is known to a tenth
  constexpr double kFarthest = 4;                     // radii
  constexpr double kTail = 0.9, kNormalTail = 1.645;  // 9 of 10 normal variates are smaller, in deviations
  double reach = radius;
  collect(picked.magnitude.front(), picked.is_free, centre, reach, values);
  while (values.size() < kEnough && reach < kFarthest * radius)
    collect(picked.magnitude.front(), picked.is_free, centre, reach *= std::numbers::sqrt2, values);
  if (values.empty()) return 0;
  spreads.clear();
  for (const cv::Mat& magnitude : picked.magnitude) {
    collect(magnitude, picked.is_free, centre, reach, values);
    spreads.push_back(
        numerics::of_rank_in(values, static_cast<std::size_t>(kTail * static_cast<double>(values.size()))) /
        static_cast<float>(kNormalTail));
  }
  return numerics::of_rank_in(spreads, spreads.size() / 4);
}

}  // namespace

cv::Mat texture_of(const std::vector<cv::Mat>& responses, const cv::Mat& is_free, double radius_px) {
  constexpr int kCellsInRadius = 12;  // about 450 values in a disc
  constexpr int kCellsApart = 4;      // a third of the radius from disc to disc
  const int factor = std::max(1, cvRound(radius_px / kCellsInRadius));
  const Picked picked = pick(responses, is_free, factor);
  cv::Mat fine, spread((picked.is_free.rows + kCellsApart - 1) / kCellsApart,
                       (picked.is_free.cols + kCellsApart - 1) / kCellsApart, CV_32F);
  cv::parallel_for_(cv::Range(0, spread.rows), [&](const cv::Range& rows) {
    std::vector<float> values, spreads;
    for (int y = rows.start; y < rows.end; ++y)
      for (int x = 0; x < spread.cols; ++x) {
        const cv::Point2d centre((x + 0.5) * kCellsApart - 0.5, (y + 0.5) * kCellsApart - 0.5);
        spread.at<float>(y, x) = spread_at(picked, centre, radius_px / factor, values, spreads);
      }
  });
  cv::resize(spread, fine, spread.size() * (factor * kCellsApart), 0, 0, cv::INTER_LINEAR);
  return fine(cv::Rect(cv::Point(0, 0), is_free.size())).clone();
}

}  // namespace mbtfm::cells
