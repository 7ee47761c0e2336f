#include "segment/stacks/band.h"

#include <algorithm>
#include <cmath>

#include "pipeline/numerics/parallel.h"
#include "segment/beads/plane.h"

namespace mbtfm::stacks {
namespace {

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

struct Average {
  std::vector<float> xy, z;
  explicit Average(Widths w) : xy(weights_of(w.xy)), z(weights_of(w.z)) {}
  /// Height of its answer to a spot of height 1.
  static double answer(Widths spot, Widths w) {
    const double s = spot.xy * spot.xy, sz = spot.z * spot.z;
    return s / (s + w.xy * w.xy) * std::sqrt(sz / (sz + w.z * w.z));
  }
};

double product(const Average& a, const Average& b) {
  const double across = overlap(a.xy, b.xy);
  return across * across * overlap(a.z, b.z);
}

/// A block of the volume, of all slices.
struct Block {
  int nx, ny, nz;
  std::vector<float> values;
  float* row(int j, int k) { return values.data() + (static_cast<std::size_t>(k) * ny + j) * nx; }
  const float* row(int j, int k) const { return values.data() + (static_cast<std::size_t>(k) * ny + j) * nx; }
};

void add_row(float* to, const float* from, float weight, int n) {
  for (int i = 0; i < n; ++i) to[i] += weight * from[i];
}

/// Averaged along x, y and z. In x and y the margin of the kernel's reach is left unfinished; z is mirrored.
Block averaged(const Block& block, const Average& by) {
  const int nx = block.nx, ny = block.ny, nz = block.nz;
  const auto reach = static_cast<int>(by.xy.size()) - 1, reach_z = static_cast<int>(by.z.size()) - 1;
  Block result{nx, ny, nz, std::vector<float>(block.values.size())};
  Block slice{nx, ny, 1, std::vector<float>(static_cast<std::size_t>(nx) * ny)};
  for (int k = 0; k < nz; ++k) {
    std::ranges::fill(slice.values, 0.0f);
    for (int l = -reach_z; l <= reach_z; ++l) {
      const float* from = block.row(0, mirrored(k + l, nz));
      add_row(slice.row(0, 0), from, by.z[std::abs(l)], nx * ny);
    }
    std::vector<float> along_x(static_cast<std::size_t>(nx) * ny);
    for (int j = 0; j < ny; ++j) {
      float* to = along_x.data() + static_cast<std::size_t>(j) * nx + reach;
      for (int l = -reach; l <= reach; ++l)
        add_row(to, slice.row(j, 0) + reach + l, by.xy[std::abs(l)], nx - 2 * reach);
    }
    for (int j = reach; j < ny - reach; ++j) {
      for (int l = -reach; l <= reach; ++l) {
        const float* from = along_x.data() + static_cast<std::size_t>(j + l) * nx;
        add_row(result.row(j, k), from, by.xy[std::abs(l)], nx);
      }
    }
  }
  return result;
}

/// Of equal voxels the first counts.
bool is_peak(const Block& block, int i, int j, int k) {
  const float value = block.row(j, k)[i];
  for (int dk = -1; dk <= 1; ++dk) {
    for (int dj = -1; dj <= 1; ++dj) {
      const float* row = block.row(j + dj, k + dk) + i;
      for (int di = -1; di <= 1; ++di) {
        if (di == 0 && dj == 0 && dk == 0) continue;
        const bool is_before = dk < 0 || (dk == 0 && (dj < 0 || (dj == 0 && di < 0)));
        if (is_before ? row[di] >= value : row[di] > value) return false;
      }
    }
  }
  return true;
}

}  // namespace

std::vector<Peak> peaks_of(const Volume& volume, Widths w, const Noise& noise, double detection_snr, int threads) {
  if (volume.depth < 3) return {};
  const Widths narrow_widths{0.8 * w.xy, 0.8 * w.z}, wide_widths{1.6 * w.xy, 1.6 * w.z};
  const Average narrow(narrow_widths), wide(wide_widths);
  const double gain = std::sqrt(product(narrow, narrow) - 2 * product(narrow, wide) + product(wide, wide));
  const double answer = Average::answer(w, narrow_widths) - Average::answer(w, wide_widths);
  const int margin = static_cast<int>(wide.xy.size());  // its reach, and one for the peaks
  constexpr int kSide = 128;
  const int columns = (volume.width + kSide - 1) / kSide, rows = (volume.height + kSide - 1) / kSide;
  std::vector<std::vector<Peak>> found(static_cast<std::size_t>(columns) * rows);
  numerics::parallel_for(columns * rows, threads, [&](int number) {
    const int left = number % columns * kSide, top = number / columns * kSide;
    const int right = std::min(volume.width, left + kSide), bottom = std::min(volume.height, top + kSide);
    Block block{right - left + 2 * margin, bottom - top + 2 * margin, volume.depth, {}};
    block.values.resize(static_cast<std::size_t>(block.nx) * block.ny * block.nz);
    for (int k = 0; k < block.nz; ++k) {
      for (int j = 0; j < block.ny; ++j) {
        const float* from = volume.row(mirrored(top - margin + j, volume.height), k);
        float* to = block.row(j, k);
        for (int i = 0; i < block.nx; ++i) to[i] = from[mirrored(left - margin + i, volume.width)];
      }
    }
    const Block light = averaged(block, narrow);
    Block answers = averaged(block, wide);
    for (std::size_t v = 0; v < answers.values.size(); ++v) answers.values[v] = light.values[v] - answers.values[v];
    for (int k = 1; k + 1 < volume.depth; ++k) {
      const auto least = static_cast<float>(detection_snr * gain * std::sqrt(noise.variance(k, 0)));
      for (int y = std::max(1, top); y < std::min(bottom, volume.height - 1); ++y) {
        const int j = y - top + margin;
        const float* row = answers.row(j, k);
        for (int x = std::max(1, left); x < std::min(right, volume.width - 1); ++x) {
          const int i = x - left + margin;
          if (!(row[i] > least) || !is_peak(answers, i, j, k)) continue;
          const float here = row[i];
          if (here < detection_snr * gain * std::sqrt(noise.variance(k, light.row(j, k)[i]))) continue;
          found[number].push_back(
              {{x + beads::parabola_vertex(row[i - 1], here, row[i + 1]),
                y + beads::parabola_vertex(answers.row(j - 1, k)[i], here, answers.row(j + 1, k)[i]),
                k + beads::parabola_vertex(answers.row(j, k - 1)[i], here, answers.row(j, k + 1)[i])},
               here / answer});
        }
      }
    }
  });
  std::vector<Peak> peaks;
  for (const std::vector<Peak>& of_block : found) peaks.insert(peaks.end(), of_block.begin(), of_block.end());
  return peaks;
}

}  // namespace mbtfm::stacks
