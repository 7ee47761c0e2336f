/// Beads in a stack of slices, found to a fraction of a voxel: grey values in space, the picture of a bead, and its
/// place by a fit.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "segment/images/image.h"

namespace mbtfm::stacks {

/// Grey values, slice by slice, row by row. Coordinates are voxels, 0 at the centre of the first.
struct Volume {
  int width = 0, height = 0, depth = 0;
  std::vector<float> values;
  std::vector<bool> is_saturated;  ///< by voxel; empty: none
  double full_scale = 0;           ///< at which the detector saturates; 0: none

  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * height + j) * width + static_cast<std::size_t>(i);
  }
  const float* row(int j, int k) const { return values.data() + index(0, j, k); }
  float* row(int j, int k) { return values.data() + index(0, j, k); }
  float at(int i, int j, int k) const { return values[index(i, j, k)]; }
};

/// The slices in this order; they are let go of one by one, so that the stack is in memory once. Voxels at the
/// detector's limit are marked: that of its numbers, or one below them that many voxels share.
Volume volume_of(std::vector<images::Image> slices);

/// Of a bead's picture, which is near to a Gaussian: its standard deviations, in pixels across and in slices along z.
struct Widths {
  double xy = 0, z = 0;
};

/// Widths that change smoothly with the place: spherical aberration makes deep beads long, a lens those in the corners
/// wide. The logarithm of each is a polynomial in x, y (second order about the middle) and z (second order).
class SpotShape {
 public:
  SpotShape() = default;
  explicit SpotShape(Widths everywhere);
  Widths at(Vec3 place) const;

  struct Sample {
    Vec3 place;
    Widths widths;
  };
  /// By robust least squares; of few samples, less of the polynomial.
  static SpotShape through(const std::vector<Sample>& samples, const Volume& volume);

 private:
  static constexpr int kTerms = 6;
  std::array<double, kTerms> terms(Vec3 place) const;
  Vec3 middle_{0, 0, 0}, half_{1, 1, 1};
  std::array<double, kTerms> log_xy_{}, log_z_{};
  /// Of the logarithms: what samples bear out. Beyond them, where no sample is, the polynomial may go anywhere.
  struct Bounds {
    double low = -1e9, high = 1e9;
  };
  Bounds bounds_xy_, bounds_z_;
};

/// Variance of a voxel: of the dark by slice, and in proportion to a bead's own light.
struct Noise {
  std::vector<double> dark;   ///< standard deviation by slice
  double light_variance = 0;  ///< by grey value above the surroundings
  double variance(int slice, double light) const {
    const double d = dark[slice];
    return d * d + light_variance * std::max(0.0, light);
  }
};

/// A bead in one stack: voxels, 0 at the centre of the first.
struct Spot {
  Vec3 place;
  double height = 0;              ///< of its picture above its surroundings
  double sigma = 0, sigma_z = 0;  ///< standard errors (px, slices)
  double share_saturated = 0;     ///< of its picture's light
};

/// What is left of a volume where the spots' pictures are taken away, and which spots touch which.
class SpotFit {
 public:
  /// @param volume  without its background; it must outlive this
  SpotFit(Volume& volume, SpotShape shape, Noise noise, int threads);

  /// Add spots to those fitted: their pictures are taken away.
  void add(const std::vector<Spot>& spots);
  /// Gauss–Newton steps of height, place and level of every spot, jointly with its touching neighbours; settled ones
  /// rest.
  void improve(int rounds);
  /// Drop the spots for which this is so: their pictures come back.
  void drop_where(const std::function<bool(const Spot&)>& is_bad);
  /// Of two spots nearer than this share of a width the dimmer goes.
  void drop_doubles(double share);
  /// Widths from bright lonely spots, each fitted by itself; the pictures follow.
  void measure_shape();
  /// The variance in proportion to light from what the fit leaves.
  void measure_noise();
  /// Standard errors.
  void measure_errors();

  const std::vector<Spot>& spots() const { return spots_; }
  const SpotShape& shape() const { return shape_; }
  const Noise& noise() const { return noise_; }
  const Volume& rest() const { return volume_; }

 private:
  struct Step;
  void drop(const std::vector<bool>& is_bad);
  void paint(const Spot& spot, double share);
  void find_neighbours();
  Step step_of(int spot, bool with_errors) const;
  Widths fitted_widths(const Spot& spot) const;

  Volume& volume_;
  SpotShape shape_;
  Noise noise_;
  int threads_;
  std::vector<Spot> spots_;
  std::vector<std::vector<int>> touching_;  ///< by spot, the nearest first
};

/// The beads of a stack.
struct Detection {
  int width = 0, height = 0, depth = 0;
  std::vector<Spot> spots;
  SpotShape shape;
  double share_saturated = 0;  ///< of the voxels

  Widths widths_in_the_middle() const { return shape.at({0.5 * width, 0.5 * height, 0.5 * depth}); }
};

/// Find the beads.
///
/// 1. Light that varies slowly is taken off each slice; the noise of each is measured (Immerkaer, CVIU 64:300, 1996).
/// 2. The widths of the beads' pictures follow from the autocorrelation, whose lag zero alone carries the noise.
/// 3. Candidates are the maxima of a band-pass of these widths.
/// 4. A Gaussian is fitted to each together with those that touch it, weighed by the noise of each voxel. Its widths
/// are
///    those of the bright, lonely beads near it in place and depth, fitted one by one.
/// 5. Candidates of what the fit leaves are those that others hid.
///
/// Standard errors are those of the weighted least squares, with what the joint fit costs.
/// @throws beads::NotFollowed where the stack shows no beads
/// @param which  "relaxed" or "stressed", for errors
Detection detect(std::vector<images::Image> slices, double detection_snr, const char* which, int threads);

}  // namespace mbtfm::stacks
