#include "segment/stacks/spots.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/near.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::stacks {
namespace {

constexpr double kReach = 2.5;      // widths: the window in which a spot is fitted
constexpr double kWindow = 1.5;     // widths: its Gaussian weight, so that neighbours and tails count less
constexpr double kPaint = 4;        // widths: 3e-4 of a picture is beyond
constexpr double kTouching = 4;     // widths: nearer spots are fitted jointly
constexpr int kMostNeighbours = 3;  // fitted with a spot; further ones are where they were
constexpr double kStep = 0.5;       // widths, of one step
constexpr double kSettled = 2e-3;   // widths, and of the height: well below the noise of the brightest

/// Voxels around a place, both ends included.
struct Box {
  int low[3], high[3];
  bool is_empty() const { return low[0] > high[0] || low[1] > high[1] || low[2] > high[2]; }
};

Box box_around(const Volume& volume, Vec3 place, Widths w, double reach) {
  const double centre[] = {place.x, place.y, place.z}, width[] = {w.xy, w.xy, w.z};
  const int size[] = {volume.width, volume.height, volume.depth};
  Box box;
  for (int a = 0; a < 3; ++a) {
    const int half = std::max(1, static_cast<int>(std::ceil(reach * width[a])));
    const int middle = static_cast<int>(std::lround(centre[a]));
    box.low[a] = std::max(0, middle - half), box.high[a] = std::min(size[a] - 1, middle + half);
  }
  return box;
}

/// exp(-d²/2s²) on the voxels of a side of a box, and d in units of s.
struct Profile {
  std::vector<float> value, offset;
  Profile(double centre, int low, int high, double sigma) {
    for (int at = low; at <= high; ++at) {
      const auto d = static_cast<float>((at - centre) / sigma);
      offset.push_back(d);
      value.push_back(std::exp(-0.5f * d * d));
    }
  }
};

/// A voxel of a volume, and the same in a box.
struct Voxel {
  int i, j, k, di, dj, dk;
};

template <class Use>
void for_each_voxel(const Box& box, const Use& use) {
  for (int k = box.low[2]; k <= box.high[2]; ++k)
    for (int j = box.low[1]; j <= box.high[1]; ++j)
      for (int i = box.low[0]; i <= box.high[0]; ++i)
        use(Voxel{i, j, k, i - box.low[0], j - box.low[1], k - box.low[2]});
}

struct Profiles {
  Profile x, y, z;
  Profiles(Vec3 place, const Box& box, Widths w)
      : x(place.x, box.low[0], box.high[0], w.xy),
        y(place.y, box.low[1], box.high[1], w.xy),
        z(place.z, box.low[2], box.high[2], w.z) {}
  float at(const Voxel& v) const { return x.value[v.di] * y.value[v.dj] * z.value[v.dk]; }
};

double distance_in_widths(Vec3 a, Vec3 b, Widths w) {
  return std::hypot((a.x - b.x) / w.xy, (a.y - b.y) / w.xy, (a.z - b.z) / w.z);
}

}  // namespace

SpotFit::SpotFit(Volume& volume, SpotShape shape, Noise noise, int threads)
    : volume_(volume), shape_(shape), noise_(std::move(noise)), threads_(threads) {}

void SpotFit::paint(const Spot& spot, double share) {
  const Widths w = shape_.at(spot.place);
  const Box box = box_around(volume_, spot.place, w, kPaint);
  if (box.is_empty()) return;
  const Profiles p(spot.place, box, w);
  const int n = box.high[0] - box.low[0] + 1;
  for (int k = box.low[2]; k <= box.high[2]; ++k)
    for (int j = box.low[1]; j <= box.high[1]; ++j) {
      const auto height =
          static_cast<float>(share * spot.height) * p.z.value[k - box.low[2]] * p.y.value[j - box.low[1]];
      float* row = volume_.row(j, k) + box.low[0];
      for (int i = 0; i < n; ++i) row[i] += height * p.x.value[i];
    }
}

void SpotFit::add(const std::vector<Spot>& spots) {
  for (const Spot& spot : spots) {
    paint(spot, -1);
    spots_.push_back(spot);
  }
  find_neighbours();
}

/// In space stretched by the widths in the middle; they vary little over a few of them.
void SpotFit::find_neighbours() {
  touching_.assign(spots_.size(), {});
  if (spots_.empty()) return;
  std::vector<Vec3> places;
  for (const Spot& spot : spots_) {
    const Widths w = shape_.at(spot.place);
    places.push_back({spot.place.x, spot.place.y, spot.place.z * w.xy / w.z});
  }
  const numerics::Near near(places, kTouching * shape_.at(spots_[0].place).xy);
  numerics::parallel_for_each(spots_.size(), threads_, [&](std::size_t s) {
    const double reach = kTouching * shape_.at(spots_[s].place).xy;
    for (const int other : near.within(places[s], reach, kMostNeighbours + 1))
      if (static_cast<std::size_t>(other) != s) touching_[s].push_back(other);
    if (touching_[s].size() > kMostNeighbours) touching_[s].resize(kMostNeighbours);
  });
}

struct SpotFit::Step {
  Spot spot;
  bool is_sound = false;
  bool is_settled = false;
};

SpotFit::Step SpotFit::step_of(int number, bool with_errors) const {
  constexpr int kOwn = 5;  // height, three of the place, level; four more for each neighbour
  constexpr int kMost = kOwn + 4 * kMostNeighbours;
  const Spot& spot = spots_[number];
  Step result{.spot = spot};
  const Widths w = shape_.at(spot.place);
  const Box box = box_around(volume_, spot.place, w, kReach);
  if (box.is_empty() || !(spot.height > 0)) return result;
  std::vector<Profiles> profiles{{spot.place, box, w}};
  std::vector<double> heights{spot.height};
  for (const int other : touching_[number]) {
    profiles.emplace_back(spots_[other].place, box, shape_.at(spots_[other].place));
    heights.push_back(spots_[other].height);
  }
  const Profiles weight(spot.place, box, {kWindow * w.xy, kWindow * w.z});
  const auto n_spots = static_cast<int>(profiles.size());
  const int n = 1 + 4 * n_spots;
  std::array<double, kMost * kMost> normal{}, spread{};
  std::array<double, kMost> right{}, row{};
  double light = 0, light_saturated = 0;
  for_each_voxel(box, [&](const Voxel& at) {
    row[0] = 1;
    double all_light = 0;
    for (int s = 0; s < n_spots; ++s) {
      const Profiles& p = profiles[s];
      const double g = p.at(at);
      double* r = &row[1 + 4 * s];
      r[0] = g, r[1] = g * p.x.offset[at.di], r[2] = g * p.y.offset[at.dj], r[3] = g * p.z.offset[at.dk];
      all_light += heights[s] * g;
    }
    const double own = spot.height * row[1];
    light += own;
    if (!volume_.is_saturated.empty() && volume_.is_saturated[volume_.index(at.i, at.j, at.k)]) {
      light_saturated += own;
      return;
    }
    const double variance = noise_.variance(at.k, all_light), value = volume_.at(at.i, at.j, at.k);
    const double in_window = weight.at(at);
    const double v = in_window / variance;
    for (int a = 0; a < n; ++a) {
      const double va = v * row[a];
      right[a] += va * value;
      for (int b = 0; b <= a; ++b) normal[a * kMost + b] += va * row[b];
    }
    if (!with_errors) return;
    for (int a = 0; a < n; ++a) {
      const double va = v * v * variance * row[a];
      for (int b = 0; b <= a; ++b) spread[a * kMost + b] += va * row[b];
    }
  });
  result.spot.share_saturated = light > 0 ? light_saturated / light : 0;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMost, kMost>;
  Matrix a(n, n), m(n, n);
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMost, 1> b(n);
  for (int p = 0; p < n; ++p) {
    b[p] = right[p];
    for (int q = 0; q <= p; ++q) {
      a(p, q) = a(q, p) = normal[p * kMost + q];
      m(p, q) = m(q, p) = spread[p * kMost + q];
    }
    a(p, p) *= 1 + 1e-9;
  }
  const Eigen::LLT<Matrix> factor(a);
  if (factor.info() != Eigen::Success) return result;
  result.is_sound = true;
  const auto change = factor.solve(b).eval();
  const double to_widths = 1 / spot.height;
  if (with_errors) {
    const Matrix half = factor.solve(m), covariance = factor.solve(half.transpose());
    result.spot.sigma = to_widths * w.xy * std::sqrt(0.5 * std::max(0.0, covariance(2, 2) + covariance(3, 3)));
    result.spot.sigma_z = to_widths * w.z * std::sqrt(std::max(0.0, covariance(4, 4)));
    return result;
  }
  const auto held = [&](double by) { return std::clamp(by * to_widths, -kStep, kStep); };
  const Vec3 by{held(change[2]), held(change[3]), held(change[4])};
  result.spot.place += Vec3{w.xy * by.x, w.xy * by.y, w.z * by.z};
  result.spot.height = std::clamp(spot.height + change[1], 0.5 * spot.height, 2 * spot.height);
  result.is_settled = norm(by) < kSettled && std::abs(result.spot.height - spot.height) < kSettled * spot.height;
  return result;
}

void SpotFit::improve(int rounds) {
  std::vector<int> wanted(spots_.size());
  std::iota(wanted.begin(), wanted.end(), 0);
  const std::vector<Spot> first = spots_;
  for (int round = 0; round < rounds && !wanted.empty(); ++round) {
    std::vector<Step> steps(wanted.size());
    numerics::parallel_for_each(wanted.size(), threads_, [&](std::size_t k) { steps[k] = step_of(wanted[k], false); });
    std::vector<int> unsettled;
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      Spot& spot = spots_[wanted[k]];
      if (!steps[k].is_sound) continue;
      if (!steps[k].is_settled) unsettled.push_back(wanted[k]);
      // a fit that runs away from its maximum is not believed
      constexpr double kFarthest = 1.5;
      const Vec3 begin = first[wanted[k]].place;
      if (distance_in_widths(steps[k].spot.place, begin, shape_.at(begin)) > kFarthest) continue;
      paint(spot, 1);
      spot = steps[k].spot;
      paint(spot, -1);
    }
    wanted = std::move(unsettled);
  }
  find_neighbours();
}

void SpotFit::drop(const std::vector<bool>& is_bad) {
  std::vector<Spot> kept;
  for (std::size_t s = 0; s < spots_.size(); ++s) is_bad[s] ? paint(spots_[s], 1) : kept.push_back(spots_[s]);
  spots_ = std::move(kept);
  find_neighbours();
}

void SpotFit::drop_where(const std::function<bool(const Spot&)>& is_bad) {
  std::vector<bool> marks(spots_.size());
  for (std::size_t s = 0; s < spots_.size(); ++s) marks[s] = is_bad(spots_[s]);
  drop(marks);
}

void SpotFit::drop_doubles(double share) {
  std::vector<bool> is_double(spots_.size());
  for (std::size_t s = 0; s < spots_.size(); ++s)
    for (const int other : touching_[s]) {
      const Spot& o = spots_[other];
      const bool is_dimmer =
          o.height > spots_[s].height || (o.height == spots_[s].height && static_cast<std::size_t>(other) < s);
      const double apart = distance_in_widths(o.place, spots_[s].place, shape_.at(spots_[s].place));
      if (is_dimmer && apart < share) is_double[s] = true;
    }
  drop(is_double);
}

Widths SpotFit::fitted_widths(const Spot& spot) const {
  Spot now = spot;
  const Widths begin = shape_.at(spot.place);
  Widths w = begin;
  const Box box = box_around(volume_, spot.place, begin, 3.5);
  const Profiles first(spot.place, box, begin);
  constexpr int kSteps = 12;
  for (int step = 0; step < kSteps; ++step) {
    const Profiles p(now.place, box, w);
    Eigen::Matrix<double, 7, 7> normal = Eigen::Matrix<double, 7, 7>::Zero();
    Eigen::Matrix<double, 7, 1> right = Eigen::Matrix<double, 7, 1>::Zero();
    for_each_voxel(box, [&](const Voxel& at) {
      const double x = p.x.offset[at.di], y = p.y.offset[at.dj], z = p.z.offset[at.dk], g = p.at(at);
      const double taken = spot.height * first.x.value[at.di] * first.y.value[at.dj] * first.z.value[at.dk];
      Eigen::Matrix<double, 7, 1> row;
      row << 1, g, g * x, g * y, g * z, g * (x * x + y * y), g * z * z;
      const double left = volume_.at(at.i, at.j, at.k) + taken - now.height * g;
      const double weight = 1 / noise_.variance(at.k, now.height * g);
      normal += weight * row * row.transpose();
      right += weight * left * row;
    });
    const Eigen::Matrix<double, 7, 1> change = numerics::solve_symmetric(normal, right) / now.height;
    if (!change.allFinite()) return {};
    const auto held = [](double by) { return std::clamp(by, -0.3, 0.3); };
    now.place += Vec3{w.xy * held(change[2]), w.xy * held(change[3]), w.z * held(change[4])};
    now.height *= 1 + held(change[1]);
    w.xy *= std::exp(held(change[5])), w.z *= std::exp(held(change[6]));
    if (change.tail<6>().cwiseAbs().maxCoeff() < 1e-3) return w;
  }
  return {};
}

void SpotFit::measure_shape() {
  std::vector<int> lonely;
  for (std::size_t s = 0; s < spots_.size(); ++s) {
    const Spot& spot = spots_[s];
    const Widths w = shape_.at(spot.place);
    constexpr double kFromRim = 3;
    const bool is_inside = spot.place.x > kFromRim * w.xy && spot.place.x < volume_.width - 1 - kFromRim * w.xy &&
                           spot.place.y > kFromRim * w.xy && spot.place.y < volume_.height - 1 - kFromRim * w.xy &&
                           spot.place.z > kFromRim * w.z && spot.place.z < volume_.depth - 1 - kFromRim * w.z;
    if (touching_[s].empty() && is_inside && spot.share_saturated == 0) lonely.push_back(static_cast<int>(s));
  }
  // the brighter half of each depth, some thousand in all
  constexpr int kLayers = 8;
  std::vector<std::vector<int>> layers(kLayers);
  for (const int s : lonely)
    layers[std::clamp(static_cast<int>(kLayers * spots_[s].place.z / volume_.depth), 0, kLayers - 1)].push_back(s);
  std::vector<int> chosen;
  constexpr std::size_t kMostOfLayer = 200;
  for (std::vector<int>& layer : layers) {
    std::ranges::sort(layer, [&](int a, int b) {
      const double ha = spots_[a].height, hb = spots_[b].height;
      return ha != hb ? ha > hb : a < b;
    });
    layer.resize(std::min((layer.size() + 1) / 2, kMostOfLayer));
    chosen.insert(chosen.end(), layer.begin(), layer.end());
  }
  std::vector<Widths> widths(chosen.size());
  numerics::parallel_for_each(chosen.size(), threads_,
                              [&](std::size_t k) { widths[k] = fitted_widths(spots_[chosen[k]]); });
  std::vector<SpotShape::Sample> samples;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const Vec3 place = spots_[chosen[k]].place;
    const Widths was = shape_.at(place), is = widths[k];
    constexpr double kLikely = 3;  // a factor beyond which it is no bead, or two
    const bool is_likely =
        is.xy > was.xy / kLikely && is.xy < was.xy * kLikely && is.z > was.z / kLikely && is.z < was.z * kLikely;
    if (is_likely) samples.push_back({place, is});
  }
  constexpr std::size_t kFewest = 5;
  if (samples.size() < kFewest) return;
  for (const Spot& spot : spots_) paint(spot, 1);
  shape_ = SpotShape::through(samples, volume_);
  for (const Spot& spot : spots_) paint(spot, -1);
  find_neighbours();
}

/// Mean squares of what is left by a spot's own light in the cores of lonely spots, over that light: less the dark
/// noise, a line through zero whose quadratic part is the picture's misfit and not noise.
void SpotFit::measure_noise() {
  constexpr int kBins = 24;
  struct Bin {
    std::vector<float> squares;
    double light = 0;
  };
  std::vector<Bin> bins(kBins);
  const double darkest = numerics::median(noise_.dark);
  const auto bin_of = [&](double light) {  // by the square root of two from the dark noise on
    return static_cast<int>(std::floor(2 * std::log2(std::max(light / darkest, 1e-9))));
  };
  const std::size_t step = 1 + spots_.size() / 3000;
  for (std::size_t s = 0; s < spots_.size(); s += step) {
    const Spot& spot = spots_[s];
    if (!touching_[s].empty() || spot.share_saturated > 0) continue;
    const Widths w = shape_.at(spot.place);
    const Box box = box_around(volume_, spot.place, w, 1.5);
    const Profiles p(spot.place, box, w);
    for_each_voxel(box, [&](const Voxel& at) {
      const double light = spot.height * p.x.value[at.di] * p.y.value[at.dj] * p.z.value[at.dk];
      const int bin = bin_of(light);
      if (bin < 0 || bin >= kBins) return;
      const double left = volume_.at(at.i, at.j, at.k), dark = noise_.variance(at.k, 0);
      bins[bin].squares.push_back(static_cast<float>(left * left - dark));
      bins[bin].light += light;
    });
  }
  // y / x = b + c x: the errors of y are alike relative to x
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (Bin& bin : bins) {
    if (bin.squares.size() < 50) continue;
    const double x = bin.light / static_cast<double>(bin.squares.size());
    std::ranges::sort(bin.squares);
    bin.squares.resize(bin.squares.size() - bin.squares.size() / 50);  // what an unseen neighbour leaves
    const auto n = static_cast<double>(bin.squares.size());
    const double y = std::accumulate(bin.squares.begin(), bin.squares.end(), 0.0) / n;
    const Eigen::Vector2d row(1, x);
    normal += n * row * row.transpose();
    right += n * y / x * row;
  }
  if (!(normal(0, 0) * normal(1, 1) > normal(0, 1) * normal(1, 0))) return;
  const Eigen::Vector2d line = numerics::solve_symmetric(normal, right);
  noise_.light_variance = std::max(0.0, line[1] < 0 ? right[0] / normal(0, 0) : line[0]);  // below 0: no misfit
}

void SpotFit::measure_errors() {
  std::vector<Step> steps(spots_.size());
  numerics::parallel_for_each(spots_.size(), threads_,
                              [&](std::size_t s) { steps[s] = step_of(static_cast<int>(s), true); });
  for (std::size_t s = 0; s < spots_.size(); ++s)
    if (steps[s].is_sound) spots_[s] = steps[s].spot;
  drop_where([](const Spot& spot) { return !(spot.sigma > 0 && spot.sigma_z > 0); });
}

}  // namespace mbtfm::stacks
