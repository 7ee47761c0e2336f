#include "segment/cells/cell_mask.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/grid.h"

namespace mbtfm::cells {
namespace {

constexpr double kInward_um = 0.8;      ///< how far the edge may lie inside the ring: a blurred mask bulges
constexpr double kOutward_um = 0.4;     ///< … and outside
constexpr double kMargin_um = 0.7;      ///< of the profile beyond the furthest places
constexpr double kPlaceStep_um = 0.05;  ///< between places: a tenth of the ring's spacing
constexpr double kTurn_um = 0.1;        ///< neighbours' places differ by this
constexpr double kEdgeBlur_um = 0.15;   ///< standard deviation of the microscope's blur
constexpr std::array kLineWidths_um = {0.15, 0.22, 0.32};  ///< standard deviation of the line: blur and cortex
constexpr int kColumns = 4;                                ///< ground, slope, step, line

using Profile = std::vector<double>;

/// Orthonormal functions on the profile's samples; the last ones are what step and line add to those before.
struct EdgeModel {
  std::vector<Profile> basis;
};

double product(const Profile& a, const Profile& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// Gram–Schmidt.
void add_to(EdgeModel& model, Profile column) {
  for (const Profile& before : model.basis) {
    const double share = product(before, column);
    for (std::size_t i = 0; i < column.size(); ++i) column[i] -= share * before[i];
  }
  const double length = std::sqrt(product(column, column));
  for (double& value : column) value /= length;
  model.basis.push_back(std::move(column));
}

/// Offsets of the samples along the outward normal, um.
Profile offsets_of(double pixel_um) {
  const double step = std::max(pixel_um, kPlaceStep_um);
  Profile offsets;
  for (double d = -kInward_um - kMargin_um; d <= kOutward_um + kMargin_um; d += step) offsets.push_back(d);
  return offsets;
}

std::vector<double> places() {
  std::vector<double> result;
  for (int k = 0; k <= std::lround((kInward_um + kOutward_um) / kPlaceStep_um); ++k)
    result.push_back(-kInward_um + k * kPlaceStep_um);
  return result;
}

std::array<EdgeModel, kLineWidths_um.size()> models_at(double place, const Profile& offsets) {
  std::array<EdgeModel, kLineWidths_um.size()> models;
  for (std::size_t w = 0; w < models.size(); ++w) {
    std::array<Profile, kColumns> columns;
    for (const double d : offsets) {
      const double depth = place - d, width = kLineWidths_um[w];
      columns[0].push_back(1);
      columns[1].push_back(std::max(0.0, depth));
      columns[2].push_back(std::erfc(-depth / kEdgeBlur_um / std::sqrt(2.0)) / 2);
      columns[3].push_back(std::exp(-depth * depth / (2 * width * width)));
    }
    for (Profile& column : columns) add_to(models[w], std::move(column));
  }
  return models;
}

/// Squared residuals of models that get brighter inwards, without a line and with the best one.
struct Residuals {
  double step, line;
};

Residuals residuals_of(const Profile& profile, const std::array<EdgeModel, kLineWidths_um.size()>& models) {
  double rest = product(profile, profile), line = 0;
  for (int k = 0; k < 2; ++k) rest -= std::pow(product(profile, models[0].basis[k]), 2);
  const double step = product(profile, models[0].basis[2]);
  for (const EdgeModel& model : models) line = std::max(line, product(profile, model.basis[3]));
  return {rest - (step > 0 ? step * step : 0), rest - step * step - line * line};
}

std::vector<cv::Point2d> outward_normals(const std::vector<cv::Point2d>& ring) {
  const std::size_t n = ring.size();
  double doubled_area = 0;
  for (std::size_t i = 0; i < n; ++i) doubled_area += ring[i].cross(ring[(i + 1) % n]);
  const double turn = doubled_area > 0 ? 1 : -1;
  std::vector<cv::Point2d> normals;
  for (std::size_t i = 0; i < n; ++i) {
    const cv::Point2d along = ring[(i + 2) % n] - ring[(i + n - 2) % n];
    const double length = std::max(1e-9, std::hypot(along.x, along.y));
    normals.emplace_back(turn * along.y / length, -turn * along.x / length);
  }
  return normals;
}

/// Mean over five lines across a fifth of the ring's spacing each, so that noise averages out and corners stay.
Profile profile_at(const cv::Mat& image, cv::Point2d point, cv::Point2d normal, double spacing, const Profile& offsets,
                   double pixel_um) {
  const cv::Point2d along(-normal.y, normal.x);
  Profile profile;
  for (const double d : offsets) {
    double sum = 0;
    for (int k = -2; k <= 2; ++k) sum += sample(image, point + (d / pixel_um) * normal + (k * spacing / 5) * along);
    profile.push_back(sum / 5);
  }
  return profile;
}

/// Indices into `places` of least total cost round the ring.
std::vector<int> cheapest_round(const std::vector<std::vector<double>>& cost) {
  const int n = static_cast<int>(cost.size()), m = static_cast<int>(cost[0].size());
  constexpr int kLargestJump = 6;  // 0.3 um from point to point
  const double bend = std::pow(kPlaceStep_um / kTurn_um, 2) / 2;
  // twice round: the middle half does not feel where it began
  std::vector<std::vector<int>> from(2 * static_cast<std::size_t>(n), std::vector<int>(m));
  std::vector<double> total(m, 0), next(m);
  for (int i = 0; i < 2 * n; ++i) {
    for (int k = 0; k < m; ++k) {
      double least = std::numeric_limits<double>::infinity();
      for (int j = std::max(0, k - kLargestJump); j <= std::min(m - 1, k + kLargestJump); ++j) {
        const double sum = total[j] + bend * (k - j) * (k - j);
        if (sum < least) least = sum, from[i][k] = j;
      }
      next[k] = least + cost[i % n][k];
    }
    std::swap(total, next);
  }
  int k = static_cast<int>(std::min_element(total.begin(), total.end()) - total.begin());
  std::vector<int> path(static_cast<std::size_t>(n));
  for (int i = 2 * n - 1; i >= n / 2; --i) {
    if (i < n / 2 + n) path[i % n] = k;
    k = from[i][k];
  }
  return path;
}

/// Minus the log-likelihood of each place, but for a constant: squared residuals over twice their variance, which the
/// best places say. A line must earn its two parameters (Akaike 1974), or noise would find one inside of every step.
std::vector<std::vector<double>> costs_of(const std::vector<std::vector<Residuals>>& residuals, std::size_t n_samples) {
  std::vector<double> least;
  for (const auto& row : residuals) {
    least.push_back(std::numeric_limits<double>::infinity());
    for (const Residuals& r : row) least.back() = std::min({least.back(), r.step, r.line});
  }
  const double variance = std::max(numerics::median_in(least), 1e-30) / static_cast<double>(n_samples - kColumns);
  std::vector<std::vector<double>> costs;
  for (const auto& row : residuals) {
    costs.emplace_back();
    for (const Residuals& r : row)
      costs.back().push_back(std::min(r.step / (2 * variance), r.line / (2 * variance) + 2));
    const double lowest = *std::min_element(costs.back().begin(), costs.back().end());
    for (double& cost : costs.back()) cost -= lowest;
  }
  return costs;
}

}  // namespace

std::vector<cv::Point2d> on_edge(const cv::Mat& image, const std::vector<cv::Point2d>& ring,
                                 const std::vector<bool>& may_move, double pixel_um) {
  const Profile offsets = offsets_of(pixel_um);
  const std::vector<double> at = places();
  std::vector<std::array<EdgeModel, kLineWidths_um.size()>> models;
  for (const double place : at) models.push_back(models_at(place, offsets));
  const auto normals = outward_normals(ring);
  std::vector<std::vector<Residuals>> residuals(ring.size(), std::vector<Residuals>(at.size()));
  cv::parallel_for_(cv::Range(0, static_cast<int>(ring.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      const cv::Point2d step = ring[(i + 1) % ring.size()] - ring[i];
      const Profile profile = profile_at(image, ring[i], normals[i], std::hypot(step.x, step.y), offsets, pixel_um);
      for (std::size_t k = 0; k < at.size(); ++k) residuals[i][k] = residuals_of(profile, models[k]);
    }
  });
  std::vector<std::vector<double>> cost = costs_of(residuals, offsets.size());
  const int rest =
      static_cast<int>(std::lround(kInward_um / kPlaceStep_um));  // the place of a point that does not move
  constexpr double kHeld = 1e6;
  for (std::size_t i = 0; i < ring.size(); ++i)
    for (int k = 0; k < static_cast<int>(at.size()); ++k)
      if (!may_move[i]) cost[i][k] = k == rest ? 0 : kHeld;
  const std::vector<int> path = cheapest_round(cost);
  std::vector<cv::Point2d> moved;
  for (std::size_t i = 0; i < ring.size(); ++i) moved.push_back(ring[i] + (at[path[i]] / pixel_um) * normals[i]);
  return moved;
}

}  // namespace mbtfm::cells
