#include "segment/stacks/spots.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::stacks {
namespace {

/// The value at and above which voxels are cut off; infinity: none are.
float limit_of(const std::vector<images::Image>& slices, double full_scale) {
  float largest = 0;
  for (const images::Image& slice : slices) largest = std::max(largest, std::ranges::max(slice.pixels));
  if (full_scale > 0 && largest >= full_scale) return static_cast<float>(full_scale);
  // detectors of 12 bits in files of 16: voxels pile up at the limit, where others thin out towards their largest
  std::size_t at_limit = 0, just_below = 0;
  for (const images::Image& slice : slices) {
    for (const float v : slice.pixels) {
      at_limit += v == largest;
      just_below += v < largest && v > 0.99f * largest;
    }
  }
  constexpr std::size_t kMany = 50;
  return at_limit >= kMany && at_limit > 3 * just_below ? largest : std::numeric_limits<float>::infinity();
}

}  // namespace

Volume volume_of(std::vector<images::Image> slices) {
  Volume volume;
  if (slices.empty()) return volume;
  volume.width = slices.front().width, volume.height = slices.front().height;
  volume.depth = static_cast<int>(slices.size());
  volume.full_scale = slices.front().full_scale;
  const float limit = limit_of(slices, volume.full_scale);
  const std::size_t in_slice = slices.front().pixels.size();
  volume.values.reserve(in_slice * slices.size());
  if (std::isfinite(limit)) volume.is_saturated.resize(in_slice * slices.size());
  for (images::Image& slice : slices) {
    for (const float value : slice.pixels) {
      if (value >= limit) volume.is_saturated[volume.values.size()] = true;
      volume.values.push_back(value);
    }
    slice.pixels = {};
  }
  return volume;
}

SpotShape::SpotShape(Widths everywhere) { log_xy_[0] = std::log(everywhere.xy), log_z_[0] = std::log(everywhere.z); }

std::array<double, SpotShape::kTerms> SpotShape::terms(Vec3 place) const {
  const Vec3 d = place - middle_;
  const double x = d.x / half_.x, y = d.y / half_.y, z = d.z / half_.z;
  return {1, z, z * z, x, y, x * x + y * y};
}

Widths SpotShape::at(Vec3 place) const {
  const auto t = terms(place);
  double xy = 0, z = 0;
  for (int k = 0; k < kTerms; ++k) xy += t[k] * log_xy_[k], z += t[k] * log_z_[k];
  return {std::exp(std::clamp(xy, bounds_xy_.low, bounds_xy_.high)),
          std::exp(std::clamp(z, bounds_z_.low, bounds_z_.high))};
}

SpotShape SpotShape::through(const std::vector<Sample>& samples, const Volume& volume) {
  MBTFM_ASSERT(!samples.empty());
  SpotShape shape;
  const auto half = [](int n) { return std::max(1.0, 0.5 * (n - 1)); };
  shape.half_ = {half(volume.width), half(volume.height), half(volume.depth)};
  shape.middle_ = shape.half_;
  // twenty samples for each term and more: an unsure slope does more harm than none
  const auto n = static_cast<int>(samples.size());
  const int n_terms = n >= 240 ? kTerms : n >= 80 ? 2 : 1;
  const auto fitted = [&](std::array<double, kTerms>& into, Bounds& bounds, const auto& value) {
    VectorXd weight = VectorXd::Ones(n), y(n), solution;
    MatrixXd a(n, n_terms);
    for (int k = 0; k < n; ++k) {
      const auto t = shape.terms(samples[k].place);
      for (int m = 0; m < n_terms; ++m) a(k, m) = t[m];
      y[k] = std::log(value(samples[k].widths));
    }
    constexpr int kRounds = 10;
    for (int round = 0; round < kRounds; ++round) {
      MatrixXd normal = a.transpose() * weight.asDiagonal() * a;
      normal.diagonal().array() += 1e-9 * n;
      solution = numerics::solve_symmetric(normal, a.transpose() * (weight.array() * y.array()).matrix());
      const VectorXd left = (y - a * solution).cwiseAbs();
      const double scale = 1.4826 * numerics::median(std::vector<double>(left.data(), left.data() + n)) + 1e-6;
      for (int k = 0; k < n; ++k) {
        const double r = left[k] / (4.685 * scale);  // biweight: 95 % efficient
        weight[k] = r < 1 ? (1 - r * r) * (1 - r * r) : 0;
      }
    }
    for (int m = 0; m < n_terms; ++m) into[m] = solution[m];
    constexpr double kFew = 0.05, kBeyond = 0.3;  // share of samples at either end; a third wider than most of them
    const std::vector<double> logs(y.data(), y.data() + n);
    bounds = {numerics::quantile(logs, kFew) - kBeyond, numerics::quantile(logs, 1 - kFew) + kBeyond};
  };
  fitted(shape.log_xy_, shape.bounds_xy_, [](Widths w) { return w.xy; });
  fitted(shape.log_z_, shape.bounds_z_, [](Widths w) { return w.z; });
  return shape;
}

}  // namespace mbtfm::stacks
