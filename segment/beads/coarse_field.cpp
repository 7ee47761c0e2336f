#include "segment/beads/coarse_field.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "pipeline/numerics/order_statistics.h"
#include "pipeline/numerics/parallel.h"
#include "segment/beads/local_motion.h"
#include "segment/beads/plane.h"

namespace mbtfm::beads {
namespace {

cv::Mat matrix_of(const Plane& p) { return {p.height, p.width, CV_32F, const_cast<float*>(p.values.data())}; }

/// `n` x `n` px of the plane in the corner of a square of `side`, less their mean; all else is zero.
cv::Mat cut(const Plane& plane, int left, int top, int n, int side) {
  cv::Mat result = cv::Mat::zeros(side, side, CV_32F);
  const int i0 = std::max(0, -left), i1 = std::min(n, plane.width - left);
  const int j0 = std::max(0, -top), j1 = std::min(n, plane.height - top);
  if (i0 >= i1 || j0 >= j1) return result;
  cv::Mat inside = result(cv::Range(j0, j1), cv::Range(i0, i1));
  const cv::Mat source = matrix_of(plane)(cv::Range(top + j0, top + j1), cv::Range(left + i0, left + i1));
  cv::subtract(source, cv::mean(source), inside);
  return result;
}

/// Place of the highest value of a periodic map, to a fraction of a pixel; nothing where it is not within the first
/// `n` x `n` px, or the next peak, anywhere, is nearly as high.
std::optional<Vec2> peak_of(const cv::Mat& map, int n, double least_ratio) {
  cv::Point best;
  double highest = 0;
  cv::minMaxLoc(map, nullptr, &highest, nullptr, &best);
  if (!(highest > 0) || best.x < 1 || best.y < 1 || best.x + 1 >= n || best.y + 1 >= n) return std::nullopt;
  const float nearly = static_cast<float>(highest / least_ratio);
  constexpr int kOwn = 4;  // px around the peak that belong to it
  const auto is_own = [](int k, int at, int size) {
    return std::min(std::abs(k - at), size - std::abs(k - at)) <= kOwn;
  };
  for (int j = 0; j < map.rows; ++j) {
    const float* row = map.ptr<float>(j);
    for (int i = 0; i < map.cols; ++i) {
      if (row[i] < nearly) continue;
      if (!is_own(j, best.y, map.rows) || !is_own(i, best.x, map.cols)) return std::nullopt;
    }
  }
  const auto value = [&](int i, int j) { return map.at<float>(best.y + j, best.x + i); };
  return Vec2{best.x + parabola_vertex(value(-1, 0), value(0, 0), value(1, 0)),
              best.y + parabola_vertex(value(0, -1), value(0, 0), value(0, 1))};
}

/// Shift, of up to `most` px, between a window of the reference and the place in the target where it is expected.
std::optional<Vec2> window_shift(const Plane& reference, const Plane& target, Vec2 centre, Vec2 expected, int window,
                                 int most) {
  const int side = cv::getOptimalDFTSize(window + 2 * most);
  const int left = static_cast<int>(std::lround(centre.x)) - window / 2;
  const int top = static_cast<int>(std::lround(centre.y)) - window / 2;
  const int dx = static_cast<int>(std::lround(expected.x)), dy = static_cast<int>(std::lround(expected.y));
  cv::Mat a, b, product;
  cv::dft(cut(reference, left, top, window, side), a, 0, window);
  cv::dft(cut(target, left + dx - most, top + dy - most, side, side), b);
  cv::mulSpectrums(b, a, product, 0, true);
  cv::idft(product, product, cv::DFT_REAL_OUTPUT | cv::DFT_SCALE);
  constexpr double kLeastRatio = 1.15;
  const auto shift = peak_of(product, 2 * most + 1, kLeastRatio);  // these shifts do not wrap
  if (!shift) return std::nullopt;
  return Vec2{shift->x - most + dx, shift->y - most + dy};
}

/// What search(place) finds, by point of a grid.
template <class Search>
std::vector<std::optional<Vec2>> found_on(const GridField& grid, int threads, const Search& search) {
  std::vector<std::optional<Vec2>> found(grid.u.size());
  numerics::parallel_for(grid.ny, threads, [&](int j) {
    for (int i = 0; i < grid.nx; ++i) {
      const std::size_t k = static_cast<std::size_t>(j) * grid.nx + i;
      found[k] = search(grid.place(k));
    }
  });
  return found;
}

Vec2 median_of(const std::vector<Vec2>& values) {
  std::vector<double> x, y;
  for (const Vec2 v : values) x.push_back(v.x), y.push_back(v.y);
  return {numerics::quantile(x, 0.5), numerics::quantile(y, 0.5)};
}

std::vector<Vec2> around(const GridField& field, const std::vector<std::optional<Vec2>>& known, int i, int j,
                         int reach) {
  std::vector<Vec2> result;
  for (int b = std::max(0, j - reach); b <= std::min(field.ny - 1, j + reach); ++b) {
    for (int a = std::max(0, i - reach); a <= std::min(field.nx - 1, i + reach); ++a) {
      const auto& value = known[static_cast<std::size_t>(b) * field.nx + a];
      if (value && !(a == i && b == j)) result.push_back(*value);
    }
  }
  return result;
}

/// Normalised median test (Westerweel & Scarano 2005).
void reject_outliers(const GridField& field, std::vector<std::optional<Vec2>>& found) {
  const std::vector<std::optional<Vec2>> before = found;
  for (int j = 0; j < field.ny; ++j) {
    for (int i = 0; i < field.nx; ++i) {
      const std::size_t k = static_cast<std::size_t>(j) * field.nx + i;
      const std::vector<Vec2> others = around(field, before, i, j, 1);
      if (!before[k] || others.size() < 3) continue;
      const Vec2 median = median_of(others);
      std::vector<double> spread;
      for (const Vec2 other : others) spread.push_back(norm(other - median));
      // their threshold of 2, with a floor of 0.5 px: a steep peak is no outlier
      if (norm(*before[k] - median) > 2 * (numerics::quantile(spread, 0.5) + 0.5)) found[k].reset();
    }
  }
}

/// Holes take the median of what is known around them.
void clean(GridField& field, std::vector<std::optional<Vec2>> found, Vec2 otherwise) {
  reject_outliers(field, found);
  for (int j = 0; j < field.ny; ++j) {
    for (int i = 0; i < field.nx; ++i) {
      const std::size_t k = static_cast<std::size_t>(j) * field.nx + i;
      Vec2 value = otherwise;
      for (int reach = 1; !found[k] && reach < std::max(field.nx, field.ny); ++reach) {
        const std::vector<Vec2> others = around(field, found, i, j, reach);
        if (others.size() < 3) continue;
        value = median_of(others);
        break;
      }
      field.u[k] = found[k].value_or(value);
    }
  }
}

/// Every `scale` pixels a side made one.
Plane reduced(const Plane& plane, int scale) {
  if (scale == 1) return plane;
  Plane result{plane.width / scale, plane.height / scale, {}};
  result.values.resize(static_cast<std::size_t>(result.width) * result.height);
  cv::Mat small(result.height, result.width, CV_32F, result.values.data());
  cv::resize(matrix_of(plane)({0, 0, scale * result.width, scale * result.height}), small, small.size(), 0, 0,
             cv::INTER_AREA);
  return result;
}

/// Spectrum of a plane that fades towards its borders.
cv::Mat spectrum_of(const Plane& plane, const cv::Mat& window) {
  const cv::Mat values = matrix_of(plane);
  cv::Mat faded = (values - cv::mean(values)[0]).mul(window), padded, result;
  const int width = cv::getOptimalDFTSize(plane.width), height = cv::getOptimalDFTSize(plane.height);
  cv::copyMakeBorder(faded, padded, 0, height - plane.height, 0, width - plane.width, cv::BORDER_CONSTANT, 0);
  cv::dft(padded, result);
  return result;
}

/// Shifts at which the cross-correlation has local maxima of at least this share of its largest value, the least first.
std::vector<Vec2> likely_shifts(const cv::Mat& from, const cv::Mat& to, double share) {
  cv::Mat map;
  cv::mulSpectrums(to, from, map, 0, true);
  cv::idft(map, map, cv::DFT_REAL_OUTPUT);
  double highest = 0;
  cv::minMaxLoc(map, nullptr, &highest);
  const auto value = [&](int i, int j) { return map.at<float>((j + map.rows) % map.rows, (i + map.cols) % map.cols); };
  std::vector<Vec2> shifts;
  for (int j = 0; j < map.rows; ++j) {
    for (int i = 0; i < map.cols; ++i) {
      const float here = map.at<float>(j, i);
      if (!(here >= share * highest)) continue;
      bool is_peak = true;
      for (int k = 0; k < 9 && is_peak; ++k) is_peak = k == 4 || value(i + k % 3 - 1, j + k / 3 - 1) < here;
      if (!is_peak) continue;
      shifts.push_back(
          {(2 * i < map.cols ? i : i - map.cols) + parabola_vertex(value(i - 1, j), here, value(i + 1, j)),
           (2 * j < map.rows ? j : j - map.rows) + parabola_vertex(value(i, j - 1), here, value(i, j + 1))});
    }
  }
  std::ranges::sort(shifts, {}, [](Vec2 shift) { return norm(shift); });
  return shifts;
}

struct WholeShift {
  Vec2 shift;
  double period = 0;  ///< of a pattern that repeats itself; 0: it does not
};

/// Shift of the target as a whole: phase correlation. Of a pattern that repeats itself any of its periods fits: the
/// least one that fits half as well as the best counts, which is at the same time the one that most of it shares.
WholeShift drift_of(const Plane& reference, const Plane& target) {
  cv::Mat window;
  cv::createHanningWindow(window, {reference.width, reference.height}, CV_32F);
  // Spots at random are alike elsewhere as the inverse root of their number: half is never met by eight and more.
  constexpr double kAlike = 0.5;
  const cv::Mat from = spectrum_of(reference, window);
  const std::vector<Vec2> same = likely_shifts(from, from, kAlike);
  if (same.size() > 1) {
    const std::vector<Vec2> shifts = likely_shifts(from, spectrum_of(target, window), kAlike);
    if (!shifts.empty()) return {shifts.front(), norm(same[1])};
  }
  const cv::Point2d shift = cv::phaseCorrelate(matrix_of(reference), matrix_of(target), window);
  return {{shift.x, shift.y}};
}

}  // namespace

GridField grid_over(const Plane& plane, double spacing) {
  GridField field;
  field.spacing = spacing;
  field.nx = std::max(1, static_cast<int>(plane.width / spacing));
  field.ny = std::max(1, static_cast<int>(plane.height / spacing));
  field.first = {0.5 * (plane.width - 1 - (field.nx - 1) * spacing),
                 0.5 * (plane.height - 1 - (field.ny - 1) * spacing)};
  field.u.resize(static_cast<std::size_t>(field.nx) * field.ny);
  return field;
}

Plane compressed(const Plane& plane) {
  std::vector<double> sample;
  for (std::size_t k = 0; k < plane.values.size(); k += 7) sample.push_back(std::abs(plane.values[k]));
  const float level = static_cast<float>(std::max(numerics::quantile(std::move(sample), 0.9), 1e-6));
  Plane result = plane;
  for (float& value : result.values) value = value / (std::abs(value) + level);
  return result;
}

Motion GridField::at(Vec2 place) const {
  const auto split = [&](double offset, int n) {
    const double at = std::clamp(offset / spacing, 0.0, std::max(0.0, n - 1.0));
    const int k = std::clamp(static_cast<int>(at), 0, std::max(0, n - 2));
    return std::pair(k, at - k);
  };
  const auto [i, s] = split(place.x - first.x, nx);
  const auto [j, t] = split(place.y - first.y, ny);
  const auto point = [&](int a, int b) {
    return u[static_cast<std::size_t>(std::min(b, ny - 1)) * nx + std::min(a, nx - 1)];
  };
  const Vec2 above = (1 - s) * point(i, j) + s * point(i + 1, j);
  const Vec2 below = (1 - s) * point(i, j + 1) + s * point(i + 1, j + 1);
  const Vec2 along_x =
      (1 / spacing) * ((1 - t) * (point(i + 1, j) - point(i, j)) + t * (point(i + 1, j + 1) - point(i, j + 1)));
  const Vec2 along_y = (1 / spacing) * (below - above);
  return {(1 - t) * above + t * below, along_x.x, along_y.x, along_x.y, along_y.y};
}

GridField coarse_field(const Plane& reference, const Plane& target, int window, int threads) {
  const Plane a = compressed(reference), b = compressed(target);
  Vec2 drift;
  double period = 0;
  GridField field;
  for (const int scale : {2, 1}) {
    const Plane from = reduced(a, scale), to = reduced(b, scale);
    if (scale == 2) {
      const WholeShift found = drift_of(from, to);
      drift = 2.0 * found.shift;
      period = 2 * found.period;
      field.u = {drift};
      field.nx = field.ny = 1;
    }
    // the second pass, at half the size, looks around what the first has found
    const double spacing = scale == 2 ? 0.75 * window : 0.375 * window;
    GridField finer = grid_over(a, spacing);
    auto found = found_on(finer, threads, [&](Vec2 centre) {
      auto shift =
          window_shift(from, to, (1.0 / scale) * centre, (1.0 / scale) * field.at(centre).u, window / 2, window / 4);
      if (shift) shift = 1.0 * scale * *shift;
      return shift;
    });
    clean(finer, std::move(found), drift);
    field = std::move(finer);
  }
  field.period = period;
  return field;
}

namespace {

/// target(x + u(x)): the reference, as far as the field is right.
Plane deformed_back(const Plane& target, const GridField& field, int scale, int threads) {
  Plane result = target;
  const cv::Mat from = matrix_of(target);
  numerics::parallel_for(target.height, threads, [&](int j) {
    cv::Mat places(1, target.width, CV_32FC2);
    for (int i = 0; i < target.width; ++i) {
      const Vec2 place{1.0 * i, 1.0 * j};
      const Vec2 there = place + (1.0 / scale) * field.at(1.0 * scale * place).u;
      places.at<cv::Vec2f>(0, i) = {static_cast<float>(there.x), static_cast<float>(there.y)};
    }
    cv::Mat row(1, target.width, CV_32F, result.values.data() + static_cast<std::size_t>(j) * target.width);
    cv::remap(from, row, places, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT, 0);
  });
  return result;
}

/// Holes take what the nearest known points go on to there: a peak's flanks lead to its top.
void extrapolate(GridField& field, std::vector<std::optional<Vec2>> found, int threads) {
  reject_outliers(field, found);
  std::vector<Vec2> places;
  std::vector<Motion> motions;
  for (std::size_t k = 0; k < found.size(); ++k) {
    if (!found[k]) continue;
    places.push_back(field.place(k));
    motions.push_back({.u = *found[k]});
  }
  const GridField through = field_through(places, motions, field, threads);
  for (std::size_t k = 0; k < found.size(); ++k) field.u[k] = found[k].value_or(through.u[k]);
}

/// Weighed 1 : 2 : 1 with the neighbours along both axes.
GridField smoothed(const GridField& field) {
  GridField result = field;
  const cv::Mat1d weights = (cv::Mat1d(1, 3) << 0.25, 0.5, 0.25);
  const cv::Mat from(field.ny, field.nx, CV_64FC2, const_cast<Vec2*>(field.u.data()));
  cv::Mat to(field.ny, field.nx, CV_64FC2, result.u.data());
  cv::sepFilter2D(from, to, CV_64F, weights, weights, {-1, -1}, 0, cv::BORDER_REPLICATE);
  return result;
}

}  // namespace

GridField field_through(const std::vector<Vec2>& places, const std::vector<Motion>& motions, GridField lattice,
                        int threads) {
  if (places.empty()) return lattice;
  const Neighbours known(places, lattice.spacing);
  const auto u = found_on(lattice, threads, [&](Vec2 place) -> std::optional<Vec2> {
    constexpr int kNearest = 12;
    return local_motion(place, known.nearest(place, kNearest), places, motions)->motion.u;
  });
  for (std::size_t k = 0; k < u.size(); ++k) lattice.u[k] = *u[k];
  return lattice;
}

GridField coarse_to_fine_field(const Plane& reference, const Plane& target, int window, int threads) {
  const Plane a = compressed(reference), b = compressed(target);
  struct Pass {
    int scale = 1, window = 64, reach = 32;
  };
  const int third = std::min(reference.width, reference.height) / 3;
  const Pass passes[] = {{4, 2 * window, third},
                         {4, 2 * window, window},
                         {2, window, window / 2},
                         {2, window, window / 2},
                         {1, window / 2, window / 4}};
  GridField field;
  field.u = {2.0 * drift_of(reduced(a, 2), reduced(b, 2)).shift};
  field.nx = field.ny = 1;
  for (const Pass& pass : passes) {
    const Plane from = reduced(a, pass.scale);
    const Plane to = deformed_back(reduced(b, pass.scale), field, pass.scale, threads);
    GridField finer = grid_over(a, 0.25 * pass.window);
    auto found = found_on(finer, threads, [&](Vec2 centre) {
      auto shift =
          window_shift(from, to, (1.0 / pass.scale) * centre, {}, pass.window / pass.scale, pass.reach / pass.scale);
      if (!shift) return shift;
      const Vec2 moved = 1.0 * pass.scale * *shift;
      shift = moved + field.at(centre + moved).u;
      return shift;
    });
    extrapolate(finer, std::move(found), threads);
    field = smoothed(finer);
  }
  return field;
}

}  // namespace mbtfm::beads
