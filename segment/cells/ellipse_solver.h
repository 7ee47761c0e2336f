/// Blurred ellipses of one blur and one dome on a level ground, fitted to pixels. Internal to segment/. Lengths are px.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "segment/cells/blurred_ellipse.h"

namespace mbtfm::cells {

struct Sample {
  int column, row;
  double value;
};

/// What is known of an unknown beforehand: its logarithm's (brightness, blur) or its own (dome) mean, and the weight of
/// the squared difference in the sum of squares: the mean square of the residuals over the variance.
struct Prior {
  double mean = 0, weight = 0;
};

struct Priors {
  Prior brightness, dome, blur;
};

enum class Shape { held, free };  ///< blur and dome

/// The least-squares problem of `kEllipses` ellipses. Unknowns: of each its centre, ln axes, angle, brightness and
/// slope; then dome, ln blur and ground, which they share.
template <int kEllipses>
class EllipseSolver {
 public:
  static constexpr int kBrightness = 5, kOwn = 7, kDome = kOwn * kEllipses, kBlur = kDome + 1, kGround = kBlur + 1,
                       kUnknowns = kGround + 1;
  using Vector = cv::Vec<double, kUnknowns>;
  using Matrix = cv::Matx<double, kUnknowns, kUnknowns>;

  struct State {
    std::array<BlurredEllipse, kEllipses> ellipses;
    double ground = 0;
  };
  /// Sum of squares and normal equations of the linearised problem.
  struct Normal {
    Matrix matrix = Matrix::zeros();
    Vector right;
    double squares = 0;        ///< of residuals and differences from what is known before
    double image_squares = 0;  ///< of residuals alone
  };
  struct Solution {
    State state;
    Normal normal;  ///< there
    bool is_settled = false;
    double scatter = 0;  ///< mean square of the residuals
  };

  /// Levenberg–Marquardt (Marquardt 1963).
  static Solution solve(const std::vector<Sample>& samples, const State& start, Shape shape, const Priors& priors) {
    // a dozen do but for the least determined; two that are not settled by then are mostly no two
    constexpr int kIterations = kEllipses == 1 ? 40 : 25;
    constexpr double kSettled = 0.01;  // of one pixel's mean square: a tenth of the standard error that the noise makes
    Solution s{start, normal_equations(samples, start, priors)};
    const double n_samples = static_cast<double>(samples.size());
    double damping = 1e-3;
    for (int k = 0; k < kIterations && !s.is_settled && damping < 1e6; ++k) {
      Normal n = s.normal;
      if (shape == Shape::held) hold(n, kBlur), hold(n, kDome);
      for (int i = 0; i < kUnknowns; ++i) n.matrix(i, i) *= 1 + damping;
      Vector step;
      if (!cv::solve(n.matrix, n.right, step, cv::DECOMP_CHOLESKY)) {
        damping *= 10;
        continue;
      }
      const State next = moved(s.state, step);
      if (!is_in_range(next, start)) {
        damping *= 10;
        continue;
      }
      const Normal there = normal_equations(samples, next, priors);
      s.is_settled = std::abs(n.squares - there.squares) < kSettled * n.squares / n_samples;
      if (there.squares <= n.squares) {
        s.state = next;
        s.normal = there;
        damping /= 10;
      } else {
        damping *= 10;
      }
    }
    s.scatter = s.normal.image_squares / n_samples;
    return s;
  }

 private:
  static State moved(const State& s, const Vector& step) {
    State next = s;
    for (int k = 0; k < kEllipses; ++k) {
      BlurredEllipse& e = next.ellipses[k];
      const double* own = &step.val[kOwn * k];
      // no step leaves the ellipse: half a semi-axis at most, axes by at most a factor of 1.6
      const double reach = 0.5 * std::min(e.semi_major, e.semi_minor) + 0.5;
      e.x += std::clamp(own[0], -reach, reach);
      e.y += std::clamp(own[1], -reach, reach);
      e.semi_major *= std::exp(std::clamp(own[2], -0.5, 0.5));
      e.semi_minor *= std::exp(std::clamp(own[3], -0.5, 0.5));
      e.angle_rad += std::clamp(own[4], -0.5, 0.5);
      e.brightness += own[kBrightness];
      e.slope += own[6];
      e.dome += std::clamp(step[kDome], -0.2, 0.2);
      e.blur *= std::exp(std::clamp(step[kBlur], -0.3, 0.3));
    }
    next.ground += step[kGround];
    return next;
  }

  struct Difference {
    int unknown;
    double value, slope, weight;  ///< slope: derivative by the unknown
  };
  static std::vector<Difference> differences(const State& s, const Priors& p) {
    const BlurredEllipse& first = s.ellipses[0];
    std::vector<Difference> all = {{kDome, first.dome - p.dome.mean, 1, p.dome.weight},
                                   {kBlur, std::log(first.blur) - p.blur.mean, 1, p.blur.weight}};
    for (int k = 0; k < kEllipses; ++k) {
      const double brightness = std::max(s.ellipses[k].brightness, 1e-100);  // far off, and its square a number still
      all.push_back(
          {kOwn * k + kBrightness, std::log(brightness) - p.brightness.mean, 1 / brightness, p.brightness.weight});
    }
    return all;
  }

  static Normal normal_equations(const std::vector<Sample>& samples, const State& s, const Priors& priors) {
    std::vector<EllipseModel> models;
    for (const BlurredEllipse& e : s.ellipses) models.emplace_back(e);
    Normal n;
    for (const Sample& p : samples) {
      Vector d;
      double residual = p.value - s.ground;
      for (int k = 0; k < kEllipses; ++k) {
        const EllipseValue f = models[k].with_derivatives(p.column, p.row);
        residual -= f.value;
        std::copy_n(f.derivative.begin(), kOwn, &d[kOwn * k]);
        d[kDome] += f.derivative[kOwn];
        d[kBlur] += f.derivative[kOwn + 1];
      }
      d[kGround] = 1;
      n.image_squares += residual * residual;
      for (int i = 0; i < kUnknowns; ++i) {
        n.right[i] += d[i] * residual;
        for (int j = 0; j <= i; ++j) n.matrix(i, j) += d[i] * d[j];
      }
    }
    for (int i = 0; i < kUnknowns; ++i)
      for (int j = 0; j < i; ++j) n.matrix(j, i) = n.matrix(i, j);
    n.squares = n.image_squares;
    for (const Difference& d : differences(s, priors))
      if (d.weight > 0) {
        n.squares += d.weight * d.value * d.value;
        n.matrix(d.unknown, d.unknown) += d.weight * d.slope * d.slope;
        n.right[d.unknown] -= d.weight * d.value * d.slope;
      }
    return n;
  }

  static void hold(Normal& n, int unknown) {
    for (int i = 0; i < kUnknowns; ++i) n.matrix(i, unknown) = n.matrix(unknown, i) = 0;
    n.matrix(unknown, unknown) = 1;
    n.right[unknown] = 0;
  }

  /// Axes and blur stay within a factor of four of where they began: beyond, the window shows no such ellipse.
  static bool is_in_range(const State& state, const State& start) {
    constexpr double kFactor = 4;
    for (int k = 0; k < kEllipses; ++k) {
      const BlurredEllipse &e = state.ellipses[k], &from = start.ellipses[k];
      const double widest = kFactor * std::max(from.semi_major, from.blur);
      if (std::max(e.semi_major, e.semi_minor) >= widest || std::min(e.semi_major, e.semi_minor) <= from.blur / 20 ||
          e.blur >= kFactor * from.blur || e.blur <= from.blur / kFactor)
        return false;
    }
    return true;
  }
};

}  // namespace mbtfm::cells
