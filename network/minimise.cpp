#include "network/minimise.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace mbtfm::network {
namespace {

using Block = BlockCholesky::Block;

// The minimisation begins with lengths rounded off over this part of an edge and sharpens by this factor in each round.
constexpr double kFirstSmoothing = 0.1;
constexpr double kSharpening = 0.03;
// A round with a smoothing that is not the last ends at this part of the largest tension.
constexpr double kRoughly = 1e-3;
// A line search ends where the slope has fallen to this part of the first: finer costs more than it saves.
constexpr double kSlopeReduction = 0.5;

Vec2 unit_or_less(Vec2 v) {
  const double length = norm(v);
  return length > 1 ? (1 / length) * v : v;
}

/// One minimisation. Unknowns are the free vertices' displacements; `direction` follows span / length.
class Minimiser {
 public:
  Minimiser(const FreeVertices& free, const std::vector<Cable>& cables, std::vector<Vec2> start)
      : x_(std::move(start)), free_(free), cables_(cables), matrix_(free.matrix) {
    for (const Cable& cable : cables_) span_.push_back(x_[cable.vertex_b] - x_[cable.vertex_a]);
    change_.resize(cables_.size());
    gradient_.resize(x_.size());
  }

  void set_smoothing(double smoothing_um) {
    smoothing_um_ = smoothing_um;
    if (direction_.empty())
      for (const Vec2 span : span_) direction_.push_back((1 / smoothed_um(span, smoothing_um_)) * span);
  }

  /// Largest net force on a free vertex; the gradient is kept for the step.
  double residual() {
    std::fill(gradient_.begin(), gradient_.end(), Vec2{});
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      const Pull p = pull(cables_[k], span_[k], smoothing_um_);
      const Vec2 force = (p.force_nN / p.length_um) * span_[k];
      gradient_[cables_[k].vertex_b] += force;
      gradient_[cables_[k].vertex_a] += -1.0 * force;
    }
    double largest = 0;
    for (std::size_t v = 0; v < x_.size(); ++v)
      if (free_.unknown[v] >= 0) largest = std::max(largest, norm(gradient_[v]));
    return largest;
  }

  void newton_step() {
    assemble();
    matrix_.factorise();
    const BlockCholesky::Columns step = solve();
    for (std::size_t k = 0; k < cables_.size(); ++k)
      change_[k] = step_of(step, cables_[k].vertex_b) - step_of(step, cables_[k].vertex_a);
    const double length = line_search();
    move(step, length);
  }

  std::vector<Vec2> x_, span_;

 private:
  void assemble() {
    matrix_.set_zero();
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      const Block block = stiffness(pull(cables_[k], span_[k], smoothing_um_), span_[k], direction_[k]);
      free_.add(matrix_, k, cables_[k], block);
    }
  }

  BlockCholesky::Columns solve() const {
    BlockCholesky::Columns step(2 * matrix_.n_blocks(), 1);
    for (std::size_t v = 0; v < x_.size(); ++v)
      if (free_.unknown[v] >= 0) step.middleRows<2>(2 * free_.unknown[v]) << -gradient_[v].x, -gradient_[v].y;
    matrix_.solve(step);
    return step;
  }

  Vec2 step_of(const BlockCholesky::Columns& step, int vertex) const {
    const int i = free_.unknown[vertex];
    return i < 0 ? Vec2{} : Vec2{step(2 * i, 0), step(2 * i + 1, 0)};
  }

  struct OnLine {
    double energy = 0, slope = 0;
  };
  OnLine on_line(double length) const {
    OnLine result;
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      const Cable& cable = cables_[k];
      const Vec2 span = span_[k] + length * change_[k];
      const Pull p = pull(cable, span, smoothing_um_);
      result.energy += energy_fJ(cable, p.length_um, smoothing_um_);
      result.slope += p.force_nN * dot(span, change_[k]) / p.length_um;
    }
    return result;
  }

  /// The energy is convex along the line, so its slope has one zero: bracket it and close in (regula falsi, Illinois).
  double line_search() const {
    const OnLine start = on_line(0);
    const double enough = -kSlopeReduction * start.slope;
    double low = 0, high = 1, slope_low = start.slope;
    OnLine at = on_line(high);
    while (at.slope < -enough && high < 16) {
      low = high;
      slope_low = at.slope;
      high *= 2;
      at = on_line(high);
    }
    double slope_high = at.slope, length = high;
    for (int i = 0;
         i < 40 && (std::abs(at.slope) > enough || at.energy > start.energy + 1e-13 * std::abs(start.energy)); ++i) {
      length = slope_high > 0 ? low - slope_low * (high - low) / (slope_high - slope_low) : high;
      if (slope_high <= 0) break;
      length = std::clamp(length, low + 0.05 * (high - low), high - 0.05 * (high - low));
      at = on_line(length);
      if (at.slope > 0) {
        high = length;
        slope_high = at.slope;
        slope_low /= 2;
      } else {
        low = length;
        slope_low = at.slope;
        slope_high /= 2;
      }
    }
    return length;
  }

  void move(const BlockCholesky::Columns& step, double length) {
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      const double l = smoothed_um(span_[k], smoothing_um_);
      const Vec2 n = (1 / l) * span_[k];
      const Vec2 turn = n - direction_[k] + (1 / l) * (change_[k] - dot(n, change_[k]) * direction_[k]);
      direction_[k] = unit_or_less(direction_[k] + length * turn);
      span_[k] += length * change_[k];
    }
    for (std::size_t v = 0; v < x_.size(); ++v) x_[v] += length * step_of(step, static_cast<int>(v));
  }

  const FreeVertices& free_;
  const std::vector<Cable>& cables_;
  BlockCholesky matrix_;
  std::vector<Vec2> direction_, change_, gradient_;
  double smoothing_um_ = 0;
};

}  // namespace

Minimum minimise(const FreeVertices& free, const std::vector<Cable>& cables, std::vector<Vec2> start,
                 const MinimiseOptions& options) {
  Minimiser minimiser(free, cables, std::move(start));
  Report report;
  double smoothing = options.first_smoothing_um;
  minimiser.set_smoothing(smoothing);
  report.last_change = minimiser.residual();
  while (true) {
    const bool is_last = smoothing <= options.smoothing_um;
    if (report.last_change <= (is_last ? options.force_tolerance_nN : kRoughly * options.largest_tension_nN)) {
      if (is_last) break;
      smoothing = std::max(kSharpening * smoothing, options.smoothing_um);
      minimiser.set_smoothing(smoothing);
      report.last_change = minimiser.residual();
      continue;
    }
    if (report.iterations == options.max_iterations) break;
    minimiser.newton_step();
    ++report.iterations;
    report.last_change = minimiser.residual();
  }
  report.converged = smoothing <= options.smoothing_um && report.last_change <= options.force_tolerance_nN;
  return {std::move(minimiser.x_), std::move(minimiser.span_), std::move(report)};
}

}  // namespace mbtfm::network
