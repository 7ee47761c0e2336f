#include "mbtfm/tractions/lattice_problem.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "mbtfm/inverse/rows.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/report.h"
#include "pipeline/numerics/memory.h"
#include "substrate/greens/wave.h"

namespace mbtfm::tractions {

std::array<double, 4> keys_weights(double s) {
  const double s2 = s * s, s3 = s2 * s;
  return {0.5 * (-s3 + 2 * s2 - s), 0.5 * (3 * s3 - 5 * s2 + 2), 0.5 * (-3 * s3 + 4 * s2 + s), 0.5 * (s3 - s2)};
}

namespace {

constexpr double kOnNode = 1e-6;  // of a spacing: files hold six digits at least

void check_beads(const DisplacementField& beads) {
  check(beads);
  // Four unknown numbers, position and strength of the least that can pull, take two vectors; three span an area.
  if (beads.size() < 3) throw InvalidData("displacement", "three beads at least", std::to_string(beads.size()));
  struct Place {
    double x, y;
    std::size_t bead;
    auto operator<=>(const Place&) const = default;
  };
  std::vector<Place> places;
  for (std::size_t i = 0; i < beads.size(); ++i) places.push_back({beads[i].position_um.x, beads[i].position_um.y, i});
  std::sort(places.begin(), places.end());
  for (std::size_t i = 1; i < places.size(); ++i) {
    if (places[i].x != places[i - 1].x || places[i].y != places[i - 1].y) continue;
    throw InvalidData("position of bead " + std::to_string(places[i].bead), "a place of its own",
                      "that of bead " + std::to_string(places[i - 1].bead));
  }
}

/// The step of the beads' coordinates where they lie on rows and columns: of the smallest distinct step, all others are
/// multiples.
std::optional<double> common_step(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const double range = values.back() - values.front();
  double step = range;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double gap = values[i] - values[i - 1];
    if (gap > kOnNode * range) step = std::min(step, gap);
  }
  if (!(step > 0)) return std::nullopt;
  step = range / std::round(range / step);
  for (const double v : values) {
    const double at = (v - values.front()) / step;
    if (std::abs(at - std::round(at)) > 1e-3) return std::nullopt;
  }
  return step;
}

/// The spacing of beads that fill a square lattice, for the most part.
std::optional<double> lattice_spacing_um(const DisplacementField& beads, const Extent& e) {
  std::vector<double> x, y;
  for (const Bead& b : beads) {
    x.push_back(b.position_um.x);
    y.push_back(b.position_um.y);
  }
  const auto step_x = common_step(std::move(x)), step_y = common_step(std::move(y));
  if (!step_x || !step_y || std::abs(*step_x - *step_y) > 1e-3 * *step_x) return std::nullopt;
  const double step = 0.5 * (*step_x + *step_y);
  const double n_nodes = (1 + (e.high_um.x - e.low_um.x) / step) * (1 + (e.high_um.y - e.low_um.y) / step);
  // coordinates rounded to some digits have a common step too, but then hardly a node has a bead
  return static_cast<double>(beads.size()) > 0.5 * n_nodes ? std::optional(step) : std::nullopt;
}

Lattice field_of(const DisplacementField& beads, const LatticeOptions& options) {
  const Extent e = extent_of(beads, &Bead::position_um);
  const Vec2 size = e.high_um - e.low_um;
  if (!(size.x > 0 && size.y > 0)) {
    throw InvalidData("displacement", "beads spread over an area", "all on one line");
  }
  const auto of_beads = lattice_spacing_um(beads, e);
  // Scattered beads lie, some of them, far closer than on average: on a lattice as coarse as that the criteria take
  // what lies between its nodes for signal (measured at 10 000 beads: lambda settles at half of it).
  const double mean_distance = std::sqrt(size.x * size.y / static_cast<double>(beads.size()));
  const double spacing = options.spacing_um.value_or(of_beads.value_or(0.5 * mean_distance));
  const auto n_along = [&](double length) { return static_cast<double>(std::floor(length / spacing + 0.5)) + 1; };
  constexpr double kBytes = 300;  // of a node: fields, their transforms, the solver's vectors (measured: 330)
  numerics::expect_room_for({.what = "the lattice of tractions (spacing " + brief(spacing) + " um)",
                             .count = n_along(size.x) * n_along(size.y) * options.padding * options.padding,
                             .parts = "nodes",
                             .bytes_each = kBytes,
                             .remedy = "choose a larger spacing_um"});
  Lattice field{.origin_um = {},
                .spacing_um = spacing,
                .n_columns = static_cast<int>(n_along(size.x)),
                .n_rows = static_cast<int>(n_along(size.y))};
  // centred on the beads, so that a mirrored or turned scene has a mirrored or turned lattice
  const Vec2 middle = e.middle_um();
  field.origin_um = middle - 0.5 * spacing * Vec2{field.n_columns - 1.0, field.n_rows - 1.0};
  return field;
}

Lattice box_of(const Lattice& field, double padding) {
  Lattice box = field;
  if (padding <= 1) return box;
  box.n_columns = numerics::quick_size(static_cast<int>(std::ceil(padding * field.n_columns)));
  box.n_rows = numerics::quick_size(static_cast<int>(std::ceil(padding * field.n_rows)));
  return box;
}

struct Stencil {
  int node = 0;
  std::array<double, 4> weights{};
};

Stencil stencil_of(double at) {
  const double nearest = std::round(at);
  if (std::abs(at - nearest) < 1e-3) return {static_cast<int>(nearest), {0, 1, 0, 0}};  // as common_step allows
  const double below = std::floor(at);
  return {static_cast<int>(below), keys_weights(at - below)};
}

int wrapped(int i, int n) { return ((i % n) + n) % n; }

}  // namespace

LatticeProblem::LatticeProblem(const DisplacementField& beads, const Gel& gel, const LatticeOptions& options)
    : threads_(options.threads) {
  check_beads(beads);
  check(gel);
  field_ = field_of(beads, options);
  box_ = box_of(field_, options.padding);
  transform_ = std::make_unique<WaveTransform>(box_.n_columns, box_.n_rows);
  spectrum_ = std::make_unique<SurfaceSpectrum>(gel, options.model, box_,
                                                options.padding > 1 ? Surroundings::open : Surroundings::periodic);
  const double longest_um = field_.spacing_um * std::max(field_.n_columns, field_.n_rows);
  longest_wave_um_per_kPa_ =
      greens::wave_compliance(gel, options.model, 2 * std::numbers::pi / longest_um).across_um_per_kPa;
  n_beads_ = beads.size();

  inverse::WeightedBeads weighted = inverse::weighted(beads, static_cast<double>(field_.n_nodes()));
  stated_variance_ = weighted.stated_variance;
  roots_ = std::move(weighted.roots);
  data_ = std::move(weighted.data);
  for (std::size_t i = 0; i < beads.size(); ++i) {
    const Vec2 at = 1 / field_.spacing_um * (beads[i].position_um - field_.origin_um);
    const Stencil column = stencil_of(at.x), row = stencil_of(at.y);
    first_tap_.push_back(taps_.size());
    for (int q = 0; q < 4; ++q) {
      for (int p = 0; p < 4; ++p) {
        const double share = column.weights[p] * row.weights[q];
        if (share == 0) continue;
        const int node =
            wrapped(column.node + p - 1, box_.n_columns) + box_.n_columns * wrapped(row.node + q - 1, box_.n_rows);
        taps_.push_back({node, roots_[2 * static_cast<Index>(i)] * share});
      }
    }
  }
  first_tap_.push_back(taps_.size());
  const bool is_even = (roots_.array().square() - 1).abs().maxCoeff() < 1e-9;
  is_complete_ = taps_.size() == beads.size() && is_even && std::ssize(beads) == field_.n_nodes();
  spread_ = spread(data_);
}

NodeField LatticeProblem::spread(const VectorXd& components, NodeField nodes) const {
  for (auto* part : {&nodes.x, &nodes.y}) part->setZero(box_.n_nodes());
  for (std::size_t i = 0; i < n_beads_; ++i) {
    const auto row = 2 * static_cast<Index>(i);
    for (std::size_t k = first_tap_[i]; k < first_tap_[i + 1]; ++k) {
      nodes.x[taps_[k].node] += taps_[k].weight * components[row];
      nodes.y[taps_[k].node] += taps_[k].weight * components[row + 1];
    }
  }
  return nodes;
}

NodeField LatticeProblem::spread_signs() const {
  std::mt19937_64 random(1);
  VectorXd signs(data_.size());
  for (const Index first : {0, 1})
    for (Index row = first; row < signs.size(); row += 2) signs[row] = random() % 2 == 0 ? 1 : -1;
  return spread(signs);
}

VectorXd LatticeProblem::at_beads(const NodeField& nodes) const {
  VectorXd components = VectorXd::Zero(2 * static_cast<Eigen::Index>(n_beads_));
  for (std::size_t i = 0; i < n_beads_; ++i) {
    for (std::size_t k = first_tap_[i]; k < first_tap_[i + 1]; ++k) {
      components[2 * static_cast<Index>(i)] += taps_[k].weight * nodes.x[taps_[k].node];
      components[2 * static_cast<Index>(i) + 1] += taps_[k].weight * nodes.y[taps_[k].node];
    }
  }
  return components;
}

void LatticeProblem::normal(const NodeField& nodes, NodeField& result) const {
  result.x.setZero();
  result.y.setZero();
  for (std::size_t i = 0; i < n_beads_; ++i) {
    double x = 0, y = 0;
    for (std::size_t k = first_tap_[i]; k < first_tap_[i + 1]; ++k) {
      x += taps_[k].weight * nodes.x[taps_[k].node];
      y += taps_[k].weight * nodes.y[taps_[k].node];
    }
    for (std::size_t k = first_tap_[i]; k < first_tap_[i + 1]; ++k) {
      result.x[taps_[k].node] += taps_[k].weight * x;
      result.y[taps_[k].node] += taps_[k].weight * y;
    }
  }
}

NodeField LatticeProblem::displaced(WaveField tractions) const {
  spectrum_->displace(tractions);
  return transform_->backward(std::move(tractions), threads_);
}

WaveField LatticeProblem::pulled_back(const NodeField& spread) const {
  WaveField waves = transform_->forward(spread, threads_);
  spectrum_->displace(waves);
  return waves;
}

TikhonovSolver::TikhonovSolver(const LatticeProblem& problem)
    : TikhonovSolver(problem, problem.pulled_back(problem.spread_data()), problem.threads()) {}

TikhonovSolver::TikhonovSolver(const LatticeProblem& problem, WaveField right_hand_side, int threads)
    : problem_(problem),
      threads_(threads),
      b_(std::move(right_hand_side)),
      t_(problem.transform().no_waves()),
      step_(t_),
      work_(t_),
      nodes_(problem.transform().no_field()),
      normal_(nodes_) {
  problem_.spectrum().turn(b_);
  residual_ = b_;
}

void TikhonovSolver::set_right_hand_side(WaveField b) {
  problem_.spectrum().turn(b);
  residual_.x += b.x - b_.x;
  residual_.y += b.y - b_.y;
  b_ = std::move(b);
}

WaveField TikhonovSolver::solution() const {
  WaveField waves = t_;
  problem_.spectrum().turn(waves);
  return waves;
}

double TikhonovSolver::solution_squared() const { return problem_.transform().dot(t_, t_); }
double TikhonovSolver::right_hand_side_times_solution() const { return problem_.transform().dot(b_, t_); }
double TikhonovSolver::displaced_squared() const {
  const WaveTransform& transform = problem_.transform();
  return transform.dot(b_, t_) - transform.dot(residual_, t_) - lambda2_ * transform.dot(t_, t_);
}

namespace {

double squared(const std::complex<double>& z) { return z.real() * z.real() + z.imag() * z.imag(); }
double product(const std::complex<double>& a, const std::complex<double>& b) {
  return a.real() * b.real() + a.imag() * b.imag();
}

}  // namespace

/// The sum of each wave's weight times both numbers that `body` returns.
template <class Body>
Eigen::Array2d TikhonovSolver::sum_over_waves(const Body& body) const {
  const Eigen::ArrayXd& weights = problem_.transform().weights();
  return numerics::sum_over_parts(weights.size(), threads_, [&](Eigen::Index begin, Eigen::Index end) {
    Eigen::Array2d sums = Eigen::Array2d::Zero();
    for (Eigen::Index k = begin; k < end; ++k) sums += weights[k] * body(k);
    return sums;
  });
}

double TikhonovSolver::energy_of_residual(Eigen::Index k) const {
  return by_along_[k] * squared(residual_.x[k]) + by_across_[k] * squared(residual_.y[k]);
}

/// The residual and the preconditioner for another lambda.
TikhonovSolver::Start TikhonovSolver::restart(double lambda) {
  const double more = lambda * lambda - lambda2_;
  lambda2_ = lambda * lambda;
  by_along_ = 1 / (problem_.spectrum().along_um_per_kPa().square() + lambda2_);
  by_across_ = 1 / (problem_.spectrum().across_um_per_kPa().square() + lambda2_);
  const Eigen::Array2d sums = sum_over_waves([&](Eigen::Index k) {
    residual_.x[k] -= more * t_.x[k];
    residual_.y[k] -= more * t_.y[k];
    return Eigen::Array2d(energy_of_residual(k), product(b_.x[k], t_.x[k]) + product(b_.y[k], t_.y[k]));
  });
  return {.residual_energy = sums[0], .solution_energy = sums[1]};
}

/// The next step: down the preconditioned residual, conjugate to the last by `ratio`. Leaves G PᵀP G step in work_.
TikhonovSolver::StepSize TikhonovSolver::turn_step(double ratio) {
  const SurfaceSpectrum& spectrum = problem_.spectrum();
  const Eigen::ArrayXd &along = spectrum.along_um_per_kPa(), &across = spectrum.across_um_per_kPa();
  const double step_squared = sum_over_waves([&](Eigen::Index k) {
    std::complex<double>&x = step_.x[k], &y = step_.y[k];
    x = by_along_[k] * residual_.x[k] + ratio * x;
    y = by_across_[k] * residual_.y[k] + ratio * y;
    work_.x[k] = along[k] * x;
    work_.y[k] = across[k] * y;
    spectrum.turn(k, work_.x[k], work_.y[k]);
    return Eigen::Array2d(squared(x) + squared(y), 0);
  })[0];
  problem_.transform().backward(work_, nodes_, threads_);
  problem_.normal(nodes_, normal_);
  problem_.transform().forward(normal_, work_, threads_);
  const double displaced_squared = sum_over_waves([&](Eigen::Index k) {
    std::complex<double>&x = work_.x[k], &y = work_.y[k];
    spectrum.turn(k, x, y);
    x *= along[k];
    y *= across[k];
    return Eigen::Array2d(product(x, step_.x[k]) + product(y, step_.y[k]), 0);
  })[0];
  return {.squared = step_squared, .displaced_squared = displaced_squared};
}

/// Along the step. @returns the residual's energy there
double TikhonovSolver::go(double length) {
  return sum_over_waves([&](Eigen::Index k) {
    t_.x[k] += length * step_.x[k];
    t_.y[k] += length * step_.y[k];
    residual_.x[k] -= length * (work_.x[k] + lambda2_ * step_.x[k]);
    residual_.y[k] -= length * (work_.y[k] + lambda2_ * step_.y[k]);
    return Eigen::Array2d(energy_of_residual(k), 0);
  })[0];
}

int TikhonovSolver::solve(double lambda, double tolerance) {
  constexpr int kMost = 2000;  // an even field takes a few, a patchy one some tens
  const Start start = restart(lambda);
  double energy = start.residual_energy, ratio = 0;
  // b · t is the energy of the solution; what t lacks of it yet, the residual has
  const double enough = tolerance * tolerance * (std::abs(start.solution_energy) + energy);
  int n = 0;
  for (; energy > enough; ++n) {
    if (n == kMost) {
      throw NotSolved({.converged = false,
                       .iterations = n,
                       .last_change = std::sqrt(energy / enough) * tolerance,
                       .reason = "the tractions did not settle in " + std::to_string(n) +
                                 " steps: lambda is far too small for so uneven a field"});
    }
    const StepSize step = turn_step(ratio);
    const double next_energy = go(energy / (step.displaced_squared + lambda2_ * step.squared));
    ratio = next_energy / energy;
    energy = next_energy;
  }
  return n;
}

}  // namespace mbtfm::tractions
