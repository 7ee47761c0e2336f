#include "segment/stacks/spots.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "pipeline/numerics/near.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/numerics/parallel.h"
#include "segment/beads/plane.h"
#include "segment/beads/scene.h"
#include "segment/beads/track.h"

namespace mbtfm::stacks {
namespace {

/// Where a coordinate lies that is mirrored in the first and last of two voxels or more.
int mirrored(int at, int n) {
  const int period = 2 * (n - 1), m = ((at % period) + period) % period;
  return m < n ? m : period - m;
}

/// Weights of a Gaussian average at 0, 1, … voxels from the middle.
std::vector<float> weights_of(double sigma) {
  const int reach = std::max(1, static_cast<int>(std::ceil(3.5 * sigma)));  // beyond lies 5e-4 of the weight
  std::vector<double> w;
  double sum = 0;
  for (int k = 0; k <= reach; ++k) {
    w.push_back(std::exp(-0.5 * k * k / (sigma * sigma)));
    sum += (k == 0 ? 1 : 2) * w.back();
  }
  std::vector<float> result;
  for (const double value : w) result.push_back(static_cast<float>(value / sum));
  return result;
}

/// Sum of products of two such averages, moved against each other by nothing.
double overlap(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) sum += (k == 0 ? 1 : 2) * 1.0 * a[k] * b[k];
  return sum;
}

/// A Gaussian average of 0.8 or 1.6 widths.
struct Average {
  Widths widths;
  std::vector<float> xy, z;
  Average(Widths spot, double by)
      : widths{by * spot.xy, by * spot.z}, xy(weights_of(widths.xy)), z(weights_of(widths.z)) {}
  /// Height of its answer to a spot of height 1.
  double answer(Widths spot) const {
    const double s = spot.xy * spot.xy, sz = spot.z * spot.z;
    return s / (s + widths.xy * widths.xy) * std::sqrt(sz / (sz + widths.z * widths.z));
  }
  /// Of one slice; beyond the first and the last one they are mirrored.
  beads::Plane of(const Volume& volume, int slice) const {
    beads::Plane mean{volume.width, volume.height, {}};
    mean.values.resize(static_cast<std::size_t>(volume.width) * volume.height);
    const auto reach = static_cast<int>(z.size()) - 1;
    for (int l = -reach; l <= reach; ++l) {
      const float *from = volume.row(0, mirrored(slice + l, volume.depth)), weight = z[std::abs(l)];
      for (std::size_t v = 0; v < mean.values.size(); ++v) mean.values[v] += weight * from[v];
    }
    return beads::blurred(mean, widths.xy);
  }
};

double product(const Average& a, const Average& b) {
  const double across = overlap(a.xy, b.xy);
  return across * across * overlap(a.z, b.z);
}

/// A slice: its average, and what that has beyond the wider one.
struct Band {
  beads::Plane light, answer;
};

/// In a slice and the two beside it. Of equal voxels the first counts.
bool is_peak(const Band* slice, int i, int j) {
  const float value = slice->answer.at(i, j);
  for (int dk = -1; dk <= 1; ++dk) {
    for (int dj = -1; dj <= 1; ++dj) {
      const float* row = slice[dk].answer.row(j + dj) + i;
      for (int di = -1; di <= 1; ++di) {
        if (di == 0 && dj == 0 && dk == 0) continue;
        const bool is_before = dk < 0 || (dk == 0 && (dj < 0 || (dj == 0 && di < 0)));
        if (is_before ? row[di] >= value : row[di] > value) return false;
      }
    }
  }
  return true;
}

/// Maxima, between voxels, of the difference of two Gaussian averages, of 0.8 and 1.6 widths along each axis, if they
/// stand out of the noise, that of the light there included, by `detection_snr`: the first average keeps touching beads
/// apart, the second takes away what is wider than a bead. Some slices at a time, so that little memory is taken.
std::vector<Spot> peaks_of(const Volume& volume, Widths w, const Noise& noise, double detection_snr, int threads) {
  if (volume.depth < 3) return {};
  const Average narrow(w, 0.8), wide(w, 1.6);
  const double gain = std::sqrt(product(narrow, narrow) - 2 * product(narrow, wide) + product(wide, wide));
  const double height_by_answer = 1 / (narrow.answer(w) - wide.answer(w));
  constexpr int kSlices = 8;
  std::vector<std::vector<Spot>> found(static_cast<std::size_t>((volume.depth - 2 + kSlices - 1) / kSlices));
  numerics::parallel_for(static_cast<int>(found.size()), threads, [&](int part) {
    const int first = 1 + part * kSlices, end = std::min(volume.depth - 1, first + kSlices);
    std::vector<Band> bands;
    for (int k = first - 1; k <= end; ++k) {
      bands.push_back({narrow.of(volume, k), wide.of(volume, k)});
      auto& [light, answer] = bands.back();
      for (std::size_t v = 0; v < answer.values.size(); ++v) answer.values[v] = light.values[v] - answer.values[v];
    }
    for (int k = first; k < end; ++k) {
      const Band* slice = &bands[k - first + 1];
      const auto least = [&](double light) { return detection_snr * gain * std::sqrt(noise.variance(k, light)); };
      const auto least_in_dark = static_cast<float>(least(0));
      for (int y = 1; y + 1 < volume.height; ++y) {
        const float* row = slice->answer.row(y);
        for (int x = 1; x + 1 < volume.width; ++x) {
          const float here = row[x];
          if (!(here > least_in_dark) || !is_peak(slice, x, y) || here < least(slice->light.at(x, y))) continue;
          const auto vertex = [&](float before, float after) { return beads::parabola_vertex(before, here, after); };
          found[part].push_back({.place = {x + vertex(row[x - 1], row[x + 1]),
                                           y + vertex(slice->answer.at(x, y - 1), slice->answer.at(x, y + 1)),
                                           k + vertex(slice[-1].answer.at(x, y), slice[1].answer.at(x, y))},
                                 .height = here * height_by_answer});
        }
      }
    }
  });
  std::vector<Spot> peaks;
  for (const std::vector<Spot>& of_part : found) peaks.insert(peaks.end(), of_part.begin(), of_part.end());
  return peaks;
}

images::Image slice_of(const Volume& volume, int k) {
  images::Image image{.width = volume.width, .height = volume.height, .pixels = {}, .pixel_size_um = {}};
  image.pixels.assign(volume.row(0, k), volume.row(0, k) + static_cast<std::size_t>(volume.width) * volume.height);
  return image;
}

/// Some slices, evenly through the stack.
std::vector<int> some_slices(int depth) {
  constexpr int kSome = 15;
  std::vector<int> slices;
  const int n = std::min(kSome, depth);
  for (int s = 0; s < n; ++s) slices.push_back(static_cast<int>((s + 0.5) * depth / n));
  return slices;
}

/// The width across, from slices where there is something to see.
double width_across(const Volume& volume) {
  constexpr double kBackground = 12;  // px: six widths of an ordinary bead
  std::vector<double> widths;
  for (const int k : some_slices(volume.depth)) {
    const double width = beads::bead_sigma_of(beads::without_background(slice_of(volume, k), kBackground));
    if (width > 0) widths.push_back(width);
  }
  return numerics::quantile(widths, 0.5);
}

/// Take the slowly varying light off each slice; the noise of each.
Noise flatten(Volume& volume, double width, int threads) {
  Noise noise;
  noise.dark.resize(static_cast<std::size_t>(volume.depth));
  numerics::parallel_for(volume.depth, threads, [&](int k) {
    const beads::Plane plane = beads::without_background(slice_of(volume, k), beads::background_sigma(width));
    noise.dark[k] = beads::noise_of(plane);
    std::copy(plane.values.begin(), plane.values.end(), volume.row(0, k));
  });
  // whole numbers are at least rounded
  const double least = volume.full_scale > 0 ? 1 / std::sqrt(12.0) : 1e-6;
  const std::vector<double> raw = noise.dark;
  for (int k = 0; k < volume.depth; ++k) {
    const int from = std::max(0, k - 2), to = std::min(volume.depth, k + 3);
    noise.dark[k] = std::max(least, numerics::median(std::vector<double>(raw.begin() + from, raw.begin() + to)));
  }
  return noise;
}

/// The variance in proportion to light, roughly: what Immerkaer's mask answers where there is some light. It answers to
/// the curvature of a bead's picture, too, but as the square of the light, so that the dim voxels decide.
double light_variance_of(const Volume& volume, const Noise& noise) {
  constexpr int kBins = 12;
  std::vector<std::vector<float>> answers(kBins), lights(kBins);
  for (const int k : some_slices(volume.depth)) {
    const double dark = noise.dark[k];
    for (int j = 1; j + 1 < volume.height; ++j) {
      const float *above = volume.row(j - 1, k), *here = volume.row(j, k), *below = volume.row(j + 1, k);
      for (int i = 1; i + 1 < volume.width; ++i) {
        const float corners = above[i - 1] + above[i + 1] + below[i - 1] + below[i + 1];
        const float sides = above[i] + below[i] + here[i - 1] + here[i + 1];
        const float mean = (corners + sides + here[i]) / 9;
        if (!(mean > dark)) continue;
        const auto bin = static_cast<std::size_t>(std::min(kBins - 1.0, std::floor(2 * std::log2(mean / dark))));
        answers[bin].push_back(std::abs(corners - 2 * sides + 4 * here[i]) / 6);
        lights[bin].push_back(mean);
      }
    }
  }
  std::vector<double> variances;
  const double dark = numerics::median(noise.dark);
  constexpr std::size_t kFewest = 300, kDimmest = 3;  // of a bin; bins
  for (int bin = 0; bin < kBins && variances.size() < kDimmest; ++bin) {
    auto& of_bin = answers[bin];
    if (of_bin.size() < kFewest) continue;
    const double sd = numerics::median_in(of_bin) / 0.6745;
    variances.push_back((sd * sd - dark * dark) / numerics::median_in(lights[bin]));
  }
  return variances.empty() ? 0 : std::max(0.0, numerics::median(variances));
}

/// For Gaussian pictures of width s along z the autocorrelation is exp(-l²/4s²): s² = 3 / (4 ln(C1/C2)), lags in
/// slices.
double width_along_z(const Volume& volume) {
  double near = 0, far = 0;
  const std::size_t in_slice = static_cast<std::size_t>(volume.width) * volume.height;
  for (int k = 0; k + 2 < volume.depth; ++k) {
    const float* here = volume.row(0, k);
    for (std::size_t v = 0; v < in_slice; v += 3) {
      near += here[v] * here[v + in_slice];
      far += here[v] * here[v + 2 * in_slice];
    }
  }
  constexpr double kNarrowest = 0.5, kWidest = 20;
  if (!(near > 0) || !(far > 0.02 * near)) return kNarrowest;
  if (far >= near) return kWidest;
  return std::clamp(std::sqrt(3 / (4 * std::log(near / far))), kNarrowest, kWidest);
}

constexpr int kLayers = 8;

std::size_t layer_of(double z, int depth) {
  return static_cast<std::size_t>(std::clamp(static_cast<int>(kLayers * z / depth), 0, kLayers - 1));
}

/// The height up to which four fifths of the light are. Maxima of noise, however many, carry little of it.
double bright_height(std::vector<double> heights) {
  constexpr double kShare = 0.8;
  std::ranges::sort(heights);
  const double all = std::accumulate(heights.begin(), heights.end(), 0.0);
  double sum = 0;
  for (const double height : heights) {
    sum += height;
    if (sum >= kShare * all) return height;
  }
  return 0;
}

/// By layer, a tenth of a bright bead's height: dimmer ones are spurious more often than not: halos, bleed-through,
/// dust, and in stacks whose dark is cut off at zero grains of light by the hundred thousand.
std::vector<double> least_heights(const std::vector<Spot>& spots, int depth) {
  std::vector<std::vector<double>> heights(kLayers);
  for (const Spot& spot : spots) heights[layer_of(spot.place.z, depth)].push_back(spot.height);
  std::vector<double> least;
  for (std::vector<double>& of_layer : heights) least.push_back(0.1 * bright_height(std::move(of_layer)));
  return least;
}

void drop_dimmest(std::vector<Spot>& spots, const std::vector<double>& least, int depth) {
  std::erase_if(spots, [&](const Spot& spot) { return spot.height < least[layer_of(spot.place.z, depth)]; });
}

/// No more than can be resolved: one in a ball of three widths.
void keep_highest(std::vector<Spot>& spots, const Volume& volume, Widths w) {
  constexpr double kBall = 4.0 / 3 * std::numbers::pi * 27;
  const double room = static_cast<double>(volume.values.size()) / (kBall * w.xy * w.xy * w.z);
  const auto most = static_cast<std::size_t>(std::max(100.0, room));
  if (spots.size() <= most) return;
  std::ranges::stable_sort(spots, [](const Spot& a, const Spot& b) { return a.height > b.height; });
  spots.resize(most);
}

/// What stands out of the rest: a bead that another hid, unless it is what the other's picture has beyond a Gaussian.
std::vector<Spot> hidden(const SpotFit& fit, double detection_snr, int threads) {
  const Volume& rest = fit.rest();
  const Widths w = fit.shape().at({0.5 * rest.width, 0.5 * rest.height, 0.5 * rest.depth});
  std::vector<Spot> found = peaks_of(rest, w, fit.noise(), detection_snr, threads);
  drop_dimmest(found, least_heights(fit.spots(), rest.depth), rest.depth);
  std::vector<Vec3> places;
  const double stretch = w.xy / w.z;
  for (const Spot& spot : fit.spots()) places.push_back({spot.place.x, spot.place.y, stretch * spot.place.z});
  constexpr double kNear = 4, kOwnLight = 0.3;  // widths; of the neighbour's height
  const numerics::Near near(places, kNear * w.xy);
  std::erase_if(found, [&](const Spot& spot) {
    const Vec3 at{spot.place.x, spot.place.y, stretch * spot.place.z};
    return std::ranges::any_of(near.within(at, kNear * w.xy, 100),
                               [&](int s) { return spot.height < kOwnLight * fit.spots()[s].height; });
  });
  return found;
}

}  // namespace

Detection detect(std::vector<images::Image> slices, double detection_snr, const char* which, int threads) {
  Volume volume = volume_of(std::move(slices));
  const std::string name = std::string("the ") + which + " stack";
  const double across = width_across(volume);
  if (!(across > 0)) throw beads::NotFollowed(name, "bright beads", "nothing but noise");
  Noise noise = flatten(volume, across, threads);
  noise.light_variance = light_variance_of(volume, noise);
  const Widths first{across, width_along_z(volume)};
  std::vector<Spot> spots = peaks_of(volume, first, noise, detection_snr, threads);
  drop_dimmest(spots, least_heights(spots, volume.depth), volume.depth);
  keep_highest(spots, volume, first);
  SpotFit fit(volume, SpotShape(first), noise, threads);
  fit.add(spots);
  constexpr int kFirstRounds = 3, kRounds = 6;
  constexpr double kSame = 0.8;  // widths: two so near make one maximum, the second is a maximum of noise
  fit.improve(kFirstRounds);
  for (int pass = 0; pass < 2; ++pass) {
    fit.measure_shape();
    fit.improve(kFirstRounds);
    fit.measure_noise();
  }
  fit.drop_doubles(kSame);
  fit.add(hidden(fit, detection_snr, threads));
  fit.improve(kRounds);
  fit.drop_doubles(kSame);
  fit.improve(kFirstRounds);
  fit.measure_noise();
  fit.measure_errors();
  fit.drop_where([&](const Spot& s) {
    return s.place.x < 0 || s.place.y < 0 || s.place.z < 0 || s.place.x > volume.width - 1 ||
           s.place.y > volume.height - 1 || s.place.z > volume.depth - 1;
  });
  const auto n_saturated = std::count(volume.is_saturated.begin(), volume.is_saturated.end(), true);
  return {.width = volume.width,
          .height = volume.height,
          .depth = volume.depth,
          .spots = fit.spots(),
          .shape = fit.shape(),
          .share_saturated = static_cast<double>(n_saturated) / static_cast<double>(volume.values.size())};
}

}  // namespace mbtfm::stacks
