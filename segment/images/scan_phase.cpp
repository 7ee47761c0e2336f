#include "segment/images/channels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/with_error.h"

namespace mbtfm::images {
namespace {

constexpr int kFarthest = 8;  // px; a microscope that is further off shows each thing twice to the eye

/// Differences along each row, compressed to −1 … 1, so that neither bright clumps nor the edges of a padding decide.
Image slopes_of(const Image& image) {
  Image slopes{.width = image.width - 1, .height = image.height, .pixels = {}, .pixel_size_um = {}};
  slopes.pixels.resize(static_cast<std::size_t>(slopes.width) * slopes.height);
  double sum = 0;
  for (int j = 0; j < slopes.height; ++j) {
    for (int i = 0; i < slopes.width; ++i) {
      slopes.at(i, j) = image.at(i + 1, j) - image.at(i, j);
      sum += std::abs(slopes.at(i, j));
    }
  }
  const float level = static_cast<float>(std::max(3 * sum / static_cast<double>(slopes.pixels.size()), 1e-12));
  for (float& slope : slopes.pixels) slope /= std::abs(slope) + level;
  return slopes;
}

/// By lag from -reach to reach: Σ even(x + lag) odd(x) over the pairs of a block.
using Sums = std::vector<double>;

/// Of the pairs of rows that are `apart` (an odd number) in blocks, which are nearly independent: of each `step`th.
std::vector<Sums> correlations(const Image& slopes, int apart, int reach, int step = 1) {
  constexpr int kPairs = 8;  // of a block: a spot is seen in no more
  std::vector<Sums> blocks;
  for (int j = 0; j + apart < slopes.height; ++j) {
    if (j / kPairs % step != 0) continue;
    if (j % kPairs == 0) blocks.emplace_back(2 * reach + 1, 0.0);
    const float* even = &slopes.pixels[static_cast<std::size_t>(j) * slopes.width];
    const float* odd = even + static_cast<std::size_t>(apart) * slopes.width;
    if (j % 2 != 0) std::swap(even, odd);
    for (int lag = -reach; lag <= reach; ++lag) {
      const float *a = even + std::max(lag, 0), *b = odd + std::max(-lag, 0);
      constexpr int kLanes = 8;  // sums side by side: the same order whatever the processor
      std::array<float, kLanes> sum{};
      for (int i = 0; i + kLanes <= slopes.width - std::abs(lag); i += kLanes)
        for (int k = 0; k < kLanes; ++k) sum[k] += a[i + k] * b[i + k];
      for (const float part : sum) blocks.back()[lag + reach] += part;
    }
  }
  return blocks;
}

struct Peak {
  double px = 0, sigma_px = 0;
  bool is_sure = false;  ///< five standard errors: of its place, and of its height over that without a shift
};

/// Vertex of the parabola through the highest sum and those beside it.
Peak peak_of(const std::vector<Sums>& blocks) {
  if (blocks.empty()) return {};
  const int n = static_cast<int>(blocks.front().size()), reach = n / 2;
  Sums all(n, 0.0);
  for (const Sums& block : blocks)
    for (int k = 0; k < n; ++k) all[k] += block[k];
  const int at = static_cast<int>(std::max_element(all.begin() + 1, all.end() - 1) - all.begin());
  const auto slope = [&](const Sums& s) { return 0.5 * (s[at + 1] - s[at - 1]); };
  const auto curvature = [&](const Sums& s) { return s[at + 1] - 2 * s[at] + s[at - 1]; };
  if (!(curvature(all) < 0)) return {};
  const double beside = std::clamp(-slope(all) / curvature(all), -1.0, 1.0);
  double squares = 0, higher = 0, higher_squares = 0;
  for (const Sums& block : blocks) {
    squares += std::pow(slope(block) + beside * curvature(block), 2);
    higher += block[at] - block[reach];
    higher_squares += std::pow(block[at] - block[reach], 2);
  }
  Peak peak{at - reach + beside, std::sqrt(squares) / -curvature(all)};
  constexpr double kSure = 5;
  peak.is_sure =
      std::abs(peak.px) > kSure * peak.sigma_px && (at == reach || higher > kSure * std::sqrt(higher_squares));
  return peak;
}

/// Weights of the eight pixels around a place between the fourth and the fifth, `t` from the fourth on.
std::array<float, 8> lanczos(double t) {
  std::array<float, 8> weights{};
  double sum = 0;
  const auto sinc = [](double x) { return std::abs(x) < 1e-9 ? 1 : std::sin(x) / x; };
  for (int k = 0; k < 8; ++k) {
    const double d = std::numbers::pi * (t + 3 - k);
    weights[k] = static_cast<float>(std::abs(t + 3 - k) < 4 ? sinc(d) * sinc(d / 4) : 0);
    sum += weights[k];
  }
  for (float& weight : weights) weight /= static_cast<float>(sum);
  return weights;
}

}  // namespace

Image without_scan_phase(const Image& image, double phase_px) {
  Image result = image;
  for (int j = 0; j < image.height; ++j) {
    const double shift = (j % 2 == 0 ? 0.5 : -0.5) * phase_px, whole = std::floor(shift);
    const std::array<float, 8> weights = lanczos(shift - whole);
    for (int i = 0; i < image.width; ++i) {
      const int first = i + static_cast<int>(whole) - 3;
      float sum = 0;
      for (int k = 0; k < 8; ++k) sum += weights[k] * image.at(std::clamp(first + k, 0, image.width - 1), j);
      result.at(i, j) = sum;
    }
  }
  return result;
}

std::optional<ScanPhase> scan_phase(const Image& image) {
  if (image.width < 8 * kFarthest || image.height < 8 * kFarthest) return std::nullopt;
  const Image slopes = slopes_of(image);
  // of most pictures a quarter of the rows says that there is none
  constexpr int kQuarter = 4;
  constexpr double kFine = 0.02, kNone = 0.1;  // px: what is below matters to nobody, five standard errors away
  const Peak quick = peak_of(correlations(slopes, 1, kFarthest + 1, kQuarter));
  if (quick.sigma_px > 0 && quick.sigma_px < kFine && std::abs(quick.px) < kNone) return std::nullopt;
  const Peak near = peak_of(correlations(slopes, 1, kFarthest + 1));
  if (!near.is_sure) return std::nullopt;
  const Peak apart = peak_of(correlations(slopes, 3, kFarthest + 1));
  constexpr double kSame = 0.25;  // px: between pixels a parabola is off by some hundredths
  if (!apart.is_sure || std::abs(apart.px - near.px) > kSame + 4 * apart.sigma_px) return std::nullopt;
  ScanPhase phase{near.px, near.sigma_px};
  constexpr int kRounds = 2;  // what is left is found where the parabola is symmetric, and so exact
  for (int round = 0; round < kRounds; ++round) {
    const Peak left = peak_of(correlations(slopes_of(without_scan_phase(image, phase.px)), 1, 2));
    phase = {phase.px + left.px, left.sigma_px};
  }
  return phase;
}

std::optional<Finding> take_scan_phase_off(Channel& channel) {
  const std::optional<ScanPhase> phase = scan_phase(channel.image);
  if (!phase) return std::nullopt;
  auto finding = noticed(Symptom::scan_phase, std::abs(phase->px),
                         {.value = with_error(std::abs(phase->px), phase->sigma_px), .at = channel.name});
  if (finding) channel.image = without_scan_phase(channel.image, phase->px);
  return finding;
}

}  // namespace mbtfm::images
