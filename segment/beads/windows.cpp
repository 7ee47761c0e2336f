#include "segment/beads/windows.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/order_statistics.h"
#include "segment/beads/scene.h"

namespace mbtfm::beads {
namespace {

constexpr double kSpacing = 3;  // in window sigmas; see Windows

Side windows_side(const Texture& texture, double spacing, std::vector<Vec2> places, int threads) {
  Side side;
  side.image = smooth_image(texture.plane, threads);
  side.noise = noise_of(texture.plane);
  side.bead_sigma = texture.spot_sigma_px;
  side.spacing = spacing;
  for (const Vec2 place : places) side.beads.push_back({place, 0});
  side.neighbours = Neighbours(places, spacing);
  side.positions = std::move(places);
  side.around = beads_around(side, threads);
  return side;
}

/// Rows and columns along the border that have one value throughout, as registering programs add them, take what the
/// nearest others show: an edge of the picture's own would hold the windows.
images::Image without_dead_border(const images::Image& image) {
  images::Image result = image;
  const auto is_dead = [&](int first, int step, int n) {
    for (int k = 1; k < n; ++k) {
      if (image.pixels[first + static_cast<std::size_t>(k) * step] != image.pixels[first]) return false;
    }
    return true;
  };
  const int w = image.width, h = image.height;
  int top = 0, bottom = h - 1, left = 0, right = w - 1;
  while (top < bottom && is_dead(top * w, 1, w)) ++top;
  while (top < bottom && is_dead(bottom * w, 1, w)) --bottom;
  while (left < right && is_dead(left, w, h)) ++left;
  while (left < right && is_dead(right, w, h)) --right;
  for (int j = 0; j < h; ++j) {
    for (int i = 0; i < w; ++i) result.at(i, j) = image.at(std::clamp(i, left, right), std::clamp(j, top, bottom));
  }
  return result;
}

/// The displacements of good windows on the lattice.
class Lattice {
 public:
  Lattice(const Windows& windows, const std::vector<Track>& tracks)
      : grid_(windows.lattice), tracks_(tracks), stride_(windows.stride) {}
  /// Nothing where the window is not good, or beyond the border.
  const Track* at(int i, int j) const {
    if (i < 0 || j < 0 || i >= grid_.nx || j >= grid_.ny) return nullptr;
    const Track& track = tracks_[static_cast<std::size_t>(j) * grid_.nx + i];
    return track.is_good() ? &track : nullptr;
  }
  /// A neighbour that does not overlap.
  const Track* beside(int i, int j, int di, int dj) const { return at(i + di * stride_, j + dj * stride_); }
  /// u(k − 1) − 2 u(k) + u(k + 1) along x or y.
  std::optional<Vec2> second_difference(int i, int j, int di, int dj) const {
    const Track *before = beside(i, j, -di, -dj), *here = at(i, j), *after = beside(i, j, di, dj);
    if (!before || !here || !after) return std::nullopt;
    return before->found.motion.u - 2 * here->found.motion.u + after->found.motion.u;
  }

 private:
  const GridField& grid_;
  const std::vector<Track>& tracks_;
  int stride_;
};

/// What the lattice says of the errors around a window.
struct Check {
  double ratio = 0;   ///< mean square of a component of the mask over what the registrations' errors let expect
  double change = 0;  ///< of the displacement between the windows beside this one; even and odd, so the two do not know
                      ///< of each other
};

std::optional<Check> check_at(const Lattice& lattice, double apart, int i, int j) {
  Vec2 sum, across, along;
  double variance = 0;
  for (int b = -1; b <= 1; ++b) {
    for (int a = -1; a <= 1; ++a) {
      const Track* track = lattice.beside(i, j, a, b);
      if (!track) return std::nullopt;
      const double weight = (a == 0 ? -2.0 : 1.0) * (b == 0 ? -2.0 : 1.0);
      sum += weight * track->found.motion.u;
      along += 1.0 * a * track->found.motion.u;
      across += 1.0 * b * track->found.motion.u;
      variance += weight * weight * track->found.sigma_px * track->found.sigma_px;
    }
  }
  // Neighbours' errors are correlated by r: along each axis the mask has the variance 6 − 8 r + 2 r⁴, not 6.
  const double r = std::exp(-apart * apart / 4), less = 1 - (8 * r - 2 * std::pow(r, 4)) / 6;
  variance *= less * less;
  if (!(variance > 0)) return std::nullopt;
  return Check{0.5 * dot(sum, sum) / variance, dot(along, along) + dot(across, across)};
}

/// c of calibrated(), from the half of the lattice where the field changes least: elsewhere the mask sees the field.
std::optional<double> variance_scale(const Windows& windows, const Lattice& lattice) {
  const GridField& grid = windows.lattice;
  std::vector<Check> checks;
  for (int j = 0; j < grid.ny; ++j) {
    for (int i = 0; i < grid.nx; ++i) {
      if (const auto check = check_at(lattice, windows.apart, i, j)) checks.push_back(*check);
    }
  }
  constexpr std::size_t kFewest = 16;  // the median of half of them is then known to a half
  if (checks.size() < kFewest) return std::nullopt;
  std::ranges::sort(checks, {}, &Check::change);
  std::vector<double> ratios;
  for (std::size_t k = 0; k < checks.size() / 2; ++k) ratios.push_back(checks[k].ratio);
  return numerics::quantile(std::move(ratios), 0.5) /
         std::numbers::ln2;  // the median of a two-dimensional normal's mean square
}

}  // namespace

Texture texture_of(const images::Image& image, double spot_sigma_px, const char* which) {
  if (!(spot_sigma_px > 0)) throw NotFollowed(std::string("the ") + which + " image", "more than noise", "none");
  const images::Image whole = without_dead_border(image);
  return {spot_light({whole.width, whole.height, whole.pixels}, spot_sigma_px), spot_sigma_px};
}

std::vector<double> window_sigmas(const Texture& texture) {
  constexpr double kSmallest = 4;  // in spot sigmas: the weight 4 pi s² then holds ten touching spots
  constexpr int kFewest = 6;       // windows along the shorter side: fewer show neither noise nor neighbours
  const double largest = std::min(texture.plane.width, texture.plane.height) / (kFewest * kSpacing);
  std::vector<double> sigmas;
  for (double s = kSmallest * texture.spot_sigma_px; s <= largest; s *= std::numbers::sqrt2) sigmas.push_back(s);
  return sigmas;
}

double least_similarity(const Texture& texture, double window_sigma) {
  constexpr double kSignificant =
      4;  // standard deviations: a search in some ten places meets it once in 3000 by chance
  const double width = 1.3 * texture.spot_sigma_px;  // of a spot that was averaged over 0.8 of its sigma
  return std::min(1.0, kSignificant * width / (std::numbers::sqrt2 * window_sigma));
}

Windows windows_on(const Texture& relaxed, const Texture& stressed, double window_sigma, int threads,
                   double spacing_px) {
  const double spacing = spacing_px > 0 ? spacing_px : kSpacing * window_sigma;
  Windows windows{.lattice = grid_over(relaxed.plane, spacing), .scene = {}};
  windows.stride = std::max(1, static_cast<int>(std::lround(kSpacing * window_sigma / spacing)));
  windows.apart = windows.stride * spacing / window_sigma;
  const GridField& lattice = windows.lattice;
  std::vector<Vec2> places;
  for (int j = 0; j < lattice.ny; ++j) {
    for (int i = 0; i < lattice.nx; ++i) places.push_back(lattice.first + spacing * Vec2{1.0 * i, 1.0 * j});
  }
  Scene& scene = windows.scene;
  scene.relaxed = std::make_shared<const Side>(windows_side(relaxed, spacing, std::move(places), threads));
  scene.stressed = windows_side(stressed, spacing, {}, threads);
  scene.threads = threads;
  constexpr double kSpot = 6;  // spot sigmas: what a spot in one image only leaves is as wide as it is after averaging
  const int alike = static_cast<int>(std::ceil(kSpot * relaxed.spot_sigma_px));
  scene.narrow = {.sigma = window_sigma,
                  .gradient_sd = 0.15,
                  .noise = 2 * std::hypot(scene.relaxed->noise, scene.stressed.noise),
                  .max_steps = 15,
                  .settled_px = 2e-3,
                  .alike_px = alike};
  scene.wide = scene.narrow;
  return windows;
}

std::optional<Pooling> calibrated(const Windows& windows, const std::vector<Track>& tracks) {
  const Lattice lattice(windows, tracks);
  const std::optional<double> scale = variance_scale(windows, lattice);
  if (!scale) return std::nullopt;
  Pooling result;
  for (int j = 0; j < windows.lattice.ny; ++j) {
    for (int i = 0; i < windows.lattice.nx; ++i) {
      const Track* track = lattice.at(i, j);
      result.beads.push_back({});
      if (!track) continue;
      const Vec2 curved = lattice.second_difference(i, j, 1, 0).value_or(Vec2{}) +
                          lattice.second_difference(i, j, 0, 1).value_or(Vec2{});
      const double bias = norm(curved) / (2 * windows.apart * windows.apart) / std::numbers::sqrt2;  // of a component
      result.beads.back() = {track->found.motion.u, std::hypot(std::sqrt(*scale) * track->found.sigma_px, bias)};
    }
  }
  return result;
}

}  // namespace mbtfm::beads
