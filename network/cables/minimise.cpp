#include "network/cables/minimise.h"

#include <optional>
#include <sstream>
#include <utility>

namespace mbtfm::cables {
namespace {

// The path of a cold start. Lengths are rounded off over a fifth of an edge at first, the stretch by mu = a hundredth
// of force times edge: a network at rest, all of whose cables are at the kink, is smooth then. Each stage sharpens
// twofold, for on fine meshes wider strides leave too many cables on the wrong side of the kink; where one step did for
// a stage the path is straight, and mu falls twentyfold. At the last mu so few cables are still undecided that the
// exact energy settles them as fast: where some pull by far less than others, it must be small beside the least pull.
constexpr double kFirstEps = 0.2;
constexpr double kFirstMu = 1e-2;
constexpr double kLastMu = 1e-8;
constexpr double kSharpening = 0.5;
constexpr double kBoldSharpening = 0.05;
// A stage is left once a step went (nearly) its full length, its slope was below mu for each cable, and no net force
// exceeds the force scale. More accuracy is lost again when the energy sharpens; with less, slack cables far from
// the path throw the next steps far off, and the finer the mesh the more such cables share one step length.
constexpr double kFullStep = 0.9;
// A warm start that has not converged by then is far away: the path is shorter.
constexpr int kWarmSteps = 25;
// A line search ends where the slope has fallen to this part of the first: finer costs more than it saves.
constexpr double kNewtonReduction = 0.5;
// Conjugate gradients are conjugate only where the lines are searched well.
constexpr double kConjugateReduction = 0.1;
constexpr double kLongestStep = 16;
constexpr int kLineTrials = 40;
// Convergence is quadratic at the end: one more step takes any residual above this part of the force scale to rounding.
constexpr double kPolished = 1e-13;

Vec2 unit_or_less(Vec2 v) {
  const double squared = dot(v, v);
  return squared > 1 ? (1 / std::sqrt(squared)) * v : v;
}

/// What a cable's force follows from, kept as unknowns of their own besides the positions and updated by the linearised
/// relations. Near the kinks they turn over far less within a step than the force as a function of position does, so
/// that Newton's method takes full steps however sharp the kinks.
struct Dual {
  Vec2 direction;               ///< of l · direction = span: Chan, Golub & Mulet, SIAM J. Sci. Comput. 20 (1999) 1964
  double stretch_force_nN = 0;  ///< q of q (q/k − e) = mu: as in primal-dual interior-point methods
};

/// Derivative of q along the curve through the present q, which need not lie on the one of mu.
double stiffness_along(const Cable& cable, const Dual& dual, double stretch_um) {
  if (cable.stiffness_nN_per_um == 0) return 0;
  const double rise = dual.stretch_force_nN / cable.stiffness_nN_per_um;
  const double gap = std::max(0.0, rise - stretch_um);
  return rise + gap > 0 ? dual.stretch_force_nN / (rise + gap) : cable.stiffness_nN_per_um;
}

/// The dual after a step that changes the span by `change`, to first order.
Dual advanced(const Cable& cable, const Dual& dual, const Pull& pull, Vec2 span, Vec2 change, double mu) {
  const Vec2 n = (1 / pull.length_um) * span;
  const Vec2 turn = n - dual.direction + (1 / pull.length_um) * (change - dot(n, change) * dual.direction);
  if (cable.stiffness_nN_per_um == 0) return {unit_or_less(dual.direction + turn), 0};
  const double q = dual.stretch_force_nN, rise = q / cable.stiffness_nN_per_um;
  const double denominator = 2 * rise - pull.stretch_um;
  const double growth = q * dot(n, change) - (q * (rise - pull.stretch_um) - mu);
  return {unit_or_less(dual.direction + turn), denominator > 0 ? q + growth / denominator : q};
}

/// q of the exact energy, k max(0, e): the curves of all mu are above it.
double least_stretch_force_nN(const Cable& cable, const Pull& pull) {
  return cable.stiffness_nN_per_um * std::max(0.0, pull.stretch_um);
}

/// Keep q above its least, by a tenth at least of what the curve of mu is above it.
double inside(double q, const Cable& cable, const Pull& pull) {
  const double least = least_stretch_force_nN(cable, pull);
  return std::max(q, least + 0.1 * (pull.stretch_force_nN - least));
}

/// q nearer to its least, where a step of the exact energy left `excess_before` down to what is now above it. Near the
/// kink both roots of q (q/k − e) = 0 are close, and Newton's method only halves the excess; with the part that is left
/// cubed it falls by eight. Away from the kink it falls to nothing anyway.
double settled(double q, double excess_before, const Cable& cable, const Pull& pull) {
  const double least = least_stretch_force_nN(cable, pull);
  const double left = excess_before > 0 ? std::min(1.0, (q - least) / excess_before) : 1;
  return least + left * left * (q - least);
}

/// Where the vertices are, and how the energy changes along a line from there.
class Descent {
 public:
  Descent(const FreeVertices& free, const std::vector<Cable>& cables, std::vector<Vec2> start, Rounding rounding)
      : free_(free),
        cables_(cables),
        rounding_(rounding),
        x_(std::move(start)),
        change_(cables.size()),
        pull_(cables.size()),
        trial_(cables.size()),
        gradient_(x_.size()),
        step_(x_.size()) {
    for (const Cable& cable : cables_) span_.push_back(x_[cable.vertex_b] - x_[cable.vertex_a]);
    find_pulls();
  }

  double residual_nN() const {
    double largest = 0;
    for (const Vec2 force : gradient_) largest = std::max(largest, dot(force, force));
    return std::sqrt(largest);
  }

  Minimum result(Report report) && { return {std::move(x_), std::move(span_), std::move(report)}; }

 protected:
  void find_pulls() {
    for (std::size_t k = 0; k < cables_.size(); ++k) pull_[k] = pull(cables_[k], span_[k], rounding_);
    find_gradient();
  }

  void find_gradient() {
    std::fill(gradient_.begin(), gradient_.end(), Vec2{});
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      const Vec2 force = (pull_[k].force_nN / pull_[k].length_um) * span_[k];
      gradient_[cables_[k].vertex_b] += force;
      gradient_[cables_[k].vertex_a] += -1.0 * force;
    }
    for (std::size_t v = 0; v < x_.size(); ++v)
      if (free_.unknown[v] < 0) gradient_[v] = {};
  }

  /// What step_ changes of each span. @returns the slope of the energy along it (fJ per full step)
  double face_step() {
    for (std::size_t k = 0; k < cables_.size(); ++k)
      change_[k] = step_[cables_[k].vertex_b] - step_[cables_[k].vertex_a];
    double slope = 0;
    for (std::size_t v = 0; v < x_.size(); ++v) slope += dot(gradient_[v], step_[v]);
    return slope;
  }

  /// d²U along step_.
  double curvature() const {
    double sum = 0;
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      const Pull& p = pull_[k];
      const double longer = dot(span_[k], change_[k]) / p.length_um;  // dl / d length
      sum += p.stiffness_nN_per_um * longer * longer +
             p.force_nN / p.length_um * (dot(change_[k], change_[k]) - longer * longer);
    }
    return sum;
  }

  /// Convex along the line: the slope rises through one zero. Bracket it, close in by secants and bisection, until
  /// it has fallen to `reduction` of what it was. The pulls there are in trial_.
  double line_search(double slope, double first_length, double reduction) {
    const double flat = -reduction * slope;
    double low = 0, slope_low = slope, slope_high = 0, length = first_length;
    std::optional<double> high;
    for (int i = 0; i < kLineTrials; ++i) {
      const double slope_there = try_at(length);
      if (std::abs(slope_there) <= flat && (slope_there <= 0 || !has_risen())) return length;
      if (slope_there < 0) {
        low = length;
        slope_low = slope_there;
      } else {
        high = length;
        slope_high = slope_there;
      }
      if (!high && length >= kLongestStep * first_length) return length;
      const double part = !high || i % 3 == 2 ? 0.5 : std::clamp(slope_low / (slope_low - slope_high), 0.05, 0.95);
      length = high ? low + part * (*high - low) : 2 * length;
    }
    try_at(low);
    return low;
  }

  /// To where trial_ was made.
  void move(double length) {
    for (std::size_t k = 0; k < cables_.size(); ++k) span_[k] += length * change_[k];
    for (std::size_t v = 0; v < x_.size(); ++v) x_[v] += length * step_[v];
    pull_.swap(trial_);
    find_gradient();
  }

  const FreeVertices& free_;
  const std::vector<Cable>& cables_;
  Rounding rounding_;
  // Spans are state besides the positions: a collapsed cable is a millionth of an edge long, and its force depends on
  // its direction, which the difference of two rounded positions does not give.
  std::vector<Vec2> x_, span_, change_;
  std::vector<Pull> pull_, trial_;     // by cable, here and where the line search last tried
  std::vector<Vec2> gradient_, step_;  // by vertex, zero where it is held

 private:
  /// @returns the slope there
  double try_at(double length) {
    double slope = 0;
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      const Vec2 span = span_[k] + length * change_[k];
      trial_[k] = pull(cables_[k], span, rounding_);
      slope += trial_[k].force_nN / trial_[k].length_um * dot(span, change_[k]);
    }
    return slope;
  }

  bool has_risen() const {
    const double here = energy_of(pull_), there = energy_of(trial_);
    return there > here + 1e-13 * std::abs(here);  // rounding of a sum of ~1e4 terms
  }

  double energy_of(const std::vector<Pull>& pulls) const {
    double sum = 0;
    for (std::size_t k = 0; k < cables_.size(); ++k) sum += energy_fJ(cables_[k], pulls[k], rounding_);
    return sum;
  }
};

class Newton : public Descent {
 public:
  Newton(const FreeVertices& free, const std::vector<Cable>& cables, std::vector<Vec2> start, Rounding rounding)
      : Descent(free, cables, std::move(start), rounding), matrix_(free.matrix) {
    reset_duals();
  }

  void set_rounding(Rounding rounding) {
    rounding_ = rounding;
    find_pulls();
  }

  /// Put the duals where the positions imply them.
  void reset_duals() {
    dual_.clear();
    for (std::size_t k = 0; k < cables_.size(); ++k)
      dual_.push_back({(1 / pull_[k].length_um) * span_[k], pull_[k].stretch_force_nN});
  }

  struct Step {
    double length = 0;    ///< the part of it taken
    double slope_fJ = 0;  ///< of the energy at its start, per full step
  };
  /// One step of Newton's method for positions and duals, the duals eliminated.
  Step step() {
    find_stiffness();
    const double slope = find_direction();
    const double length = line_search(slope, 1, kNewtonReduction);
    advance_duals(length);
    move(length);
    return {length, slope};
  }

 private:
  void find_stiffness() {
    matrix_.set_zero();
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      const double along = stiffness_along(cables_[k], dual_[k], pull_[k].stretch_um);
      free_.add(matrix_, k, cables_[k], stiffness(pull_[k], span_[k], along, dual_[k].direction));
    }
  }

  /// Solve for a direction of descent; Levenberg's shift only where rounding spoils the unshifted one.
  /// @returns the slope along it
  double find_direction() {
    double slope = 0;
    for (double shift = 0; shift <= 1; shift = std::max(1e-10, 100 * shift)) {
      matrix_.factorise(shift);
      columns_.resize(2 * matrix_.n_blocks(), 1);
      for (std::size_t v = 0; v < x_.size(); ++v)
        if (const int i = free_.unknown[v]; i >= 0) columns_.middleRows<2>(2 * i) << -gradient_[v].x, -gradient_[v].y;
      matrix_.solve(columns_);
      for (std::size_t v = 0; v < x_.size(); ++v)
        if (const int i = free_.unknown[v]; i >= 0) step_[v] = {columns_(2 * i, 0), columns_(2 * i + 1, 0)};
      slope = face_step();
      if (slope < 0) break;  // false for NaN too
    }
    return slope;
  }

  /// The duals take the whole step, whatever part of it the positions take: a few cables shorten it for all, and the
  /// others' duals are nearer to the end of it all the same.
  void advance_duals(double length) {
    const bool settles = rounding_.mu_fJ == 0 && length >= kFullStep;
    for (std::size_t k = 0; k < cables_.size(); ++k) {
      const Pull &before = pull_[k], &after = trial_[k];
      const double excess_nN = dual_[k].stretch_force_nN - least_stretch_force_nN(cables_[k], before);
      dual_[k] = advanced(cables_[k], dual_[k], before, span_[k], change_[k], rounding_.mu_fJ);
      double& q = dual_[k].stretch_force_nN;
      q = inside(q, cables_[k], after);
      if (settles) q = settled(q, excess_nN, cables_[k], after);
    }
  }

  numerics::SpringMatrix matrix_;
  numerics::SpringMatrix::Columns columns_;
  std::vector<Dual> dual_;  // by cable
};

/// Non-linear conjugate gradients after Polak and Ribière (Nocedal & Wright, Numerical Optimization, 2006, 5.2).
class ConjugateGradients : public Descent {
 public:
  using Descent::Descent;

  /// @returns whether the energy could still be lowered
  bool step() {
    double squares = 0, product = 0;
    for (std::size_t v = 0; v < x_.size(); ++v) {
      squares += dot(gradient_[v], gradient_[v]);
      if (last_squares_ > 0) product += dot(gradient_[v], gradient_[v] - last_gradient_[v]);
    }
    const double keep = last_squares_ > 0 ? std::max(0.0, product / last_squares_) : 0;
    double slope = turn(keep);
    if (!(slope < 0)) slope = turn(0);
    last_gradient_ = gradient_;
    const double length = line_search(slope, -slope / curvature(), kConjugateReduction);
    move(length);
    last_squares_ = length > 0 ? squares : 0;  // 0: restart along the gradient
    n_stuck_ = length > 0 ? 0 : n_stuck_ + 1;
    return n_stuck_ < 2;
  }

 private:
  double turn(double keep) {
    for (std::size_t v = 0; v < x_.size(); ++v) step_[v] = keep * step_[v] + -1.0 * gradient_[v];
    return face_step();
  }
  std::vector<Vec2> last_gradient_;
  double last_squares_ = 0;
  int n_stuck_ = 0;
};

Minimum finished(Descent&& found, Report report, const MinimiseOptions& options) {
  report.last_change = found.residual_nN();
  report.converged = report.last_change <= options.force_tolerance_nN;
  std::ostringstream text;
  text << "largest net force on a free vertex " << report.last_change << " nN after " << report.iterations
       << (options.method == Contraction::newton ? " Newton steps" : " steps of conjugate gradients") << ", wanted "
       << options.force_tolerance_nN << " nN";
  if (!report.converged)
    text << "; more steps may help, or an axial stiffness nearer to the tensions (force scale " << options.force_nN
         << " nN)";
  report.reason = text.str();
  return std::move(found).result(std::move(report));
}

Minimum minimise_by_conjugate_gradients(const FreeVertices& free, const std::vector<Cable>& cables,
                                        std::vector<Vec2> positions_um, const MinimiseOptions& options) {
  ConjugateGradients minimiser(free, cables, std::move(positions_um), {.eps_um = options.eps_um, .mu_fJ = 0});
  Report report;
  while (minimiser.residual_nN() > options.force_tolerance_nN && report.iterations < options.max_iterations) {
    ++report.iterations;
    if (!minimiser.step()) break;
  }
  return finished(std::move(minimiser), std::move(report), options);
}

}  // namespace

Minimum minimise(const FreeVertices& free, const std::vector<Cable>& cables, std::vector<Vec2> positions_um,
                 Start start, const MinimiseOptions& options) {
  if (options.method == Contraction::conjugate_gradient)
    return minimise_by_conjugate_gradients(free, cables, std::move(positions_um), options);
  const Rounding sharp{.eps_um = options.eps_um, .mu_fJ = 0};
  Newton minimiser(free, cables, std::move(positions_um), sharp);
  Report report;
  const auto has_converged = [&] { return minimiser.residual_nN() <= options.force_tolerance_nN; };
  const auto may_step = [&](int limit) { return report.iterations < std::min(limit, options.max_iterations); };
  const auto step = [&] {
    ++report.iterations;
    return minimiser.step();
  };
  const auto converge = [&](int limit) {
    while (!has_converged() && may_step(limit)) step();
  };

  if (start == Start::warm) converge(kWarmSteps);
  if (!has_converged()) {
    const double unit_mu_fJ = options.force_nN * options.edge_length_um;
    Rounding rounding{.eps_um = kFirstEps * options.edge_length_um, .mu_fJ = kFirstMu * unit_mu_fJ};
    const double last_mu_fJ = kLastMu * options.weakest * unit_mu_fJ;
    minimiser.set_rounding(rounding);
    minimiser.reset_duals();
    while (rounding.mu_fJ >= last_mu_fJ) {
      minimiser.set_rounding(rounding);
      const double flat_fJ = rounding.mu_fJ * static_cast<double>(cables.size());
      Newton::Step taken;
      const int n_before = report.iterations;
      while (may_step(options.max_iterations) &&
             (taken.length < kFullStep || -taken.slope_fJ > flat_fJ || minimiser.residual_nN() > options.force_nN))
        taken = step();
      rounding.mu_fJ *= report.iterations == n_before + 1 ? kBoldSharpening : kSharpening;
      rounding.eps_um = std::max(kSharpening * rounding.eps_um, options.eps_um);
    }
    minimiser.set_rounding(sharp);
  }
  converge(options.max_iterations);
  if (options.is_polished && minimiser.residual_nN() > kPolished * options.force_nN &&
      may_step(options.max_iterations)) {
    step();
    converge(options.max_iterations);  // where a cable was still to begin or to cease to stretch, that step showed it
  }
  return finished(std::move(minimiser), std::move(report), options);
}

}  // namespace mbtfm::cables
