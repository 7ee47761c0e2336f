#include "network/minimise.h"

#include <limits>
#include <optional>
#include <sstream>

namespace mbtfm::network {
namespace {

// The path of a cold start. Lengths are rounded off over a tenth of an edge at first, the stretch by mu = a hundredth
// of force times edge: a network at rest, all of whose cables stand at the kink, is smooth then. Each stage sharpens
// tenfold. At the last mu what rounding adds to a force is below the effect of the tensions that stand for zero.
constexpr double kFirstEps = 0.1;
constexpr double kFirstMu = 1e-2;
constexpr double kLastMu = 1e-9;
constexpr double kSharpening = 0.1;
// A stage is left once a step went (nearly) its full length and no net force exceeds the force scale: more accuracy is
// lost again when the energy sharpens.
constexpr double kFullStep = 0.9;
// A warm start that has not converged by then is far away: the path is shorter.
constexpr int kWarmSteps = 25;
// A line search ends where the slope has fallen to this part of the first: finer costs more than it saves.
constexpr double kSlopeReduction = 0.5;
constexpr double kLongestStep = 16;
constexpr int kLineTrials = 40;
// Convergence is quadratic at the end: one more step takes any residual above this part of the force scale to rounding.
constexpr double kPolished = 1e-13;

Vec2 unit_or_less(Vec2 v) {
  const double length = norm(v);
  return length > 1 ? (1 / length) * v : v;
}

/// What a cable's force follows from, kept as unknowns of their own beside the positions and updated by the linearised
/// relations. Near the kinks they turn over far less within a step than the force as a function of position does, so
/// that Newton's method takes full steps however sharp the kinks.
struct Dual {
  Vec2 direction;               ///< of l · direction = span: Chan, Golub & Mulet, SIAM J. Sci. Comput. 20 (1999) 1964
  double stretch_force_nN = 0;  ///< q of q (q/k − e) = mu: as in primal-dual interior-point methods
};

/// Derivative of q along the curve through the present q, which need not lie on the one of mu.
double stiffness_along(const Cable& cable, const Dual& dual, double stretch_um) {
  const double rise = dual.stretch_force_nN / cable.stiffness_nN_per_um;
  const double gap = std::max(0.0, rise - stretch_um);
  return rise + gap > 0 ? dual.stretch_force_nN / (rise + gap) : cable.stiffness_nN_per_um;
}

/// The dual after a step that changes the span by length · change, to first order.
Dual advanced(const Cable& cable, const Dual& dual, const Pull& pull, Vec2 span, Vec2 change, double length,
              double mu) {
  const Vec2 n = (1 / pull.length_um) * span;
  const Vec2 turn = n - dual.direction + (1 / pull.length_um) * (change - dot(n, change) * dual.direction);
  const double q = dual.stretch_force_nN, rise = q / cable.stiffness_nN_per_um;
  const double denominator = 2 * rise - pull.stretch_um;
  const double growth = q * dot(n, change) - (q * (rise - pull.stretch_um) - mu);
  return {unit_or_less(dual.direction + length * turn), denominator > 0 ? q + length * growth / denominator : q};
}

/// Keep q above k max(0, e), by a tenth at least of what the curve of mu is above it.
double inside(double q, const Cable& cable, const Pull& pull) {
  const double bound = cable.stiffness_nN_per_um * std::max(0.0, pull.stretch_um);
  return std::max(q, bound + 0.1 * (pull.stretch_force_nN - bound));
}

class Minimiser {
 public:
  Minimiser(const FreeVertices& free, const std::vector<Cable>& cables, std::vector<Vec2> start, Rounding rounding)
      : free_(free),
        cables_(cables),
        matrix_(free.matrix),
        rounding_(rounding),
        x_(std::move(start)),
        change_(cables.size()),
        gradient_(x_.size()) {
    for (const Cable& cable : cables_) span_.push_back(x_[cable.vertex_b] - x_[cable.vertex_a]);
    reset_duals();
  }

  void set_rounding(Rounding rounding) {
    rounding_ = rounding;
    find_gradient();
  }

  /// Put the duals where the positions imply them.
  void reset_duals() {
    dual_.clear();
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      const Pull p = pull(cables_[k], span_[k], rounding_);
      dual_.push_back({(1 / p.length_um) * span_[k], p.stretch_force_nN});
    }
    find_gradient();
  }

  double residual_nN() const {
    double largest = 0;
    for (std::size_t v = 0; v < x_.size(); ++v)
      if (free_.unknown[v] >= 0) largest = std::max(largest, norm(gradient_[v]));
    return largest;
  }

  /// One step of Newton's method for positions and duals, the duals eliminated. @returns the part of it taken
  double step() {
    find_stiffness();
    find_change();
    const double length = line_search();
    move(length);
    find_gradient();
    return length;
  }

  Minimum result(Report report) && { return {std::move(x_), std::move(span_), std::move(report)}; }

 private:
  void find_gradient() {
    std::fill(gradient_.begin(), gradient_.end(), Vec2{});
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      const Pull p = pull(cables_[k], span_[k], rounding_);
      const Vec2 force = (p.force_nN / p.length_um) * span_[k];
      gradient_[cables_[k].vertex_b] += force;
      gradient_[cables_[k].vertex_a] += -1.0 * force;
    }
  }

  void find_stiffness() {
    matrix_.set_zero();
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      const Pull p = pull(cables_[k], span_[k], rounding_);
      const double along = stiffness_along(cables_[k], dual_[k], p.stretch_um);
      free_.add(matrix_, k, cables_[k], stiffness(p, span_[k], along, dual_[k].direction));
    }
  }

  /// Solve for a direction of descent; Levenberg's shift only where rounding spoils the unshifted one.
  void find_change() {
    for (double shift = 0; shift <= 1; shift = std::max(1e-10, 100 * shift)) {
      matrix_.factorise(shift);
      step_.resize(2 * matrix_.n_blocks(), 1);
      for (std::size_t v = 0; v < x_.size(); ++v)
        if (free_.unknown[v] >= 0) step_.middleRows<2>(2 * free_.unknown[v]) << -gradient_[v].x, -gradient_[v].y;
      matrix_.solve(step_);
      for (std::size_t k = 0; k < cables_.size(); ++k)
        change_[k] = step_of(cables_[k].vertex_b) - step_of(cables_[k].vertex_a);
      if (on_line(0).slope < 0) return;  // false for NaN too
    }
  }

  Vec2 step_of(int vertex) const {
    const int i = free_.unknown[vertex];
    return i < 0 ? Vec2{} : Vec2{step_(2 * i, 0), step_(2 * i + 1, 0)};
  }

  struct OnLine {
    double energy = 0, slope = 0;
  };
  OnLine on_line(double length) const {
    OnLine result;
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      const Vec2 span = span_[k] + length * change_[k];
      const Pull p = pull(cables_[k], span, rounding_);
      result.energy += energy_fJ(cables_[k], p, rounding_);
      result.slope += p.force_nN * dot(span, change_[k]) / p.length_um;
    }
    return result;
  }

  /// Convex along the line: the slope rises through one zero. Bracket it, close in by secants and bisection.
  double line_search() const {
    const OnLine start = on_line(0);
    const double flat = -kSlopeReduction * start.slope;
    const double no_more = start.energy + 1e-13 * std::abs(start.energy);  // rounding of a sum of ~1e4 terms
    double low = 0, slope_low = start.slope, slope_high = 0, length = 1;
    std::optional<double> high;
    for (int i = 0; i < kLineTrials; ++i) {
      const OnLine at = on_line(length);
      if (std::abs(at.slope) <= flat && at.energy <= no_more) return length;
      if (at.slope < 0) {
        low = length;
        slope_low = at.slope;
      } else {
        high = length;
        slope_high = at.slope;
      }
      if (!high && length >= kLongestStep) return length;
      const double part = !high || i % 3 == 2 ? 0.5 : std::clamp(slope_low / (slope_low - slope_high), 0.05, 0.95);
      length = high ? low + part * (*high - low) : 2 * length;
    }
    return low;
  }

  void move(double length) {
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      const Pull before = pull(cables_[k], span_[k], rounding_);
      dual_[k] = advanced(cables_[k], dual_[k], before, span_[k], change_[k], length, rounding_.mu_fJ);
      span_[k] += length * change_[k];
      dual_[k].stretch_force_nN = inside(dual_[k].stretch_force_nN, cables_[k], pull(cables_[k], span_[k], rounding_));
    }
    for (std::size_t v = 0; v < x_.size(); ++v) x_[v] += length * step_of(static_cast<int>(v));
  }

  const FreeVertices& free_;
  const std::vector<Cable>& cables_;
  BlockCholesky matrix_;
  Rounding rounding_;
  // Spans are state beside the positions: a collapsed cable is a millionth of an edge long, and its force depends on
  // its direction, which the difference of two rounded positions does not tell.
  std::vector<Vec2> x_, span_, change_, gradient_;
  std::vector<Dual> dual_;  // by cable
  BlockCholesky::Columns step_;
};

std::string reason_of(const Report& report, const MinimiseOptions& options) {
  std::ostringstream text;
  text << "largest net force on a free vertex " << report.last_change << " nN after " << report.iterations
       << " Newton steps, wanted " << options.force_tolerance_nN << " nN";
  if (!report.converged)
    text << "; more steps may help, or an axial stiffness nearer to the tensions (force scale " << options.force_nN
         << " nN)";
  return text.str();
}

}  // namespace

Minimum minimise(const FreeVertices& free, const std::vector<Cable>& cables, std::vector<Vec2> positions_um,
                 Start start, const MinimiseOptions& options) {
  const Rounding sharp{.eps_um = options.eps_um, .mu_fJ = 0};
  Minimiser minimiser(free, cables, std::move(positions_um), sharp);
  Report report;
  const auto has_converged = [&] { return minimiser.residual_nN() <= options.force_tolerance_nN; };
  const auto may_step = [&](int limit) { return report.iterations < std::min(limit, options.max_iterations); };
  const auto step = [&] {
    ++report.iterations;
    return minimiser.step();
  };

  if (start == Start::warm)
    while (!has_converged() && may_step(kWarmSteps)) step();
  if (!has_converged()) {
    const double unit_mu_fJ = options.force_nN * options.edge_length_um;
    Rounding rounding{.eps_um = kFirstEps * options.edge_length_um, .mu_fJ = kFirstMu * unit_mu_fJ};
    minimiser.set_rounding(rounding);
    minimiser.reset_duals();
    for (; rounding.mu_fJ >= kLastMu * unit_mu_fJ; rounding.mu_fJ *= kSharpening) {
      minimiser.set_rounding(rounding);
      double taken = 0;
      while (may_step(options.max_iterations) && (taken < kFullStep || minimiser.residual_nN() > options.force_nN))
        taken = step();
      rounding.eps_um = std::max(kSharpening * rounding.eps_um, options.eps_um);
    }
    minimiser.set_rounding(sharp);
  }
  const auto converge = [&] {
    while (!has_converged() && may_step(options.max_iterations)) step();
  };
  converge();
  if (minimiser.residual_nN() > kPolished * options.force_nN && may_step(options.max_iterations)) {
    step();
    converge();  // where a cable was still to begin or to cease to stretch, that step showed it
  }

  report.last_change = minimiser.residual_nN();
  report.converged = has_converged();
  report.reason = reason_of(report, options);
  return std::move(minimiser).result(std::move(report));
}

}  // namespace mbtfm::network
