#include "mbtfm/sheets/sheet_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "mbtfm/sheets/profile.h"
#include "mbtfm/tensions/intervals.h"
#include "mbtfm/tensions/robust.h"
#include "pipeline/numerics/dense.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::sheets {
namespace {

using tensions::LinearData;

/// The range of a quantity over all stiffnesses that the beads do not exclude.
struct Limits {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  bool is_open_below = false, is_open_above = false;  ///< the table ends before the beads set a limit
  /// @param open_below, open_above  where the quantity goes on beyond the table
  void take(double a, double b, bool open_below = false, bool open_above = false) {
    if (a < low) is_open_below = open_below;
    if (b > high) is_open_above = open_above;
    low = std::min(low, a);
    high = std::max(high, b);
  }
};

/// Whether stiffnesses are ends of the table.
struct Ends {
  bool is_softest = false, is_stiffest = false, is_weakest = false, is_strongest = false;
};
Ends ends_of(const StiffnessTable& table, const Stiffnesses& at, bool is_sheet_known) {
  constexpr double kRounding = 1e-6;
  const auto is_at = [](double value, double end) { return std::abs(std::log(value / end)) < kRounding; };
  Ends ends;
  if (!is_sheet_known) {
    ends.is_softest = is_at(at.sheet_nN_per_um, table.sheet_nN_per_um().low);
    ends.is_stiffest = is_at(at.sheet_nN_per_um, table.sheet_nN_per_um().high);
  }
  if (!table.adhesion_nN_per_um3()) return ends;
  ends.is_weakest = is_at(*at.adhesion_nN_per_um3, table.adhesion_nN_per_um3()->low);
  ends.is_strongest = is_at(*at.adhesion_nN_per_um3, table.adhesion_nN_per_um3()->high);
  return ends;
}

using Number = double (*)(const Profile&);

/// All that the beads allow, of what was tried.
class Allowed {
 public:
  Allowed(const StiffnessTable& table, const Search& search, const Profile& best, double variance, bool is_sheet_known)
      : table_(table),
        best_(best),
        room_(tensions::kNormal95 * tensions::kNormal95 * variance),
        is_sheet_known_(is_sheet_known) {
    if (!table.adhesion_nN_per_um3()) {
      tried_ = search.over_sheet(table.known_adhesion_nN_per_um3()).scan;
      of_sheet_ = limits_along(tried_, sheet_of, is_sheet_known);
      return;
    }
    tried_ = search.over_adhesion().scan;
    of_adhesion_ = limits_along(tried_, adhesion_of, false);
    std::vector<Profile> by_sheet;
    if (!is_sheet_known) by_sheet = search.over_sheet_with_best_adhesion().scan;
    of_sheet_ = limits_along(by_sheet, sheet_of, is_sheet_known);
    tried_.insert(tried_.end(), by_sheet.begin(), by_sheet.end());
    try_between(search);
  }

  const Limits& of_sheet() const { return of_sheet_; }
  const Limits& of_adhesion() const { return of_adhesion_; }
  /// At each pair of stiffnesses a load may lie so far from its best as the misfit has room left.
  Limits of_load(Index load, Quantity quantity) const {
    Limits limits;
    for_each([&](const Profile& p, double room) {
      const bool is_share = quantity == Quantity::contraction_over_stiffness;
      const double scale = is_share ? 1 / sheet_of(p) : 1;
      const tensions::Sides reach = p.reach(load, room);
      const Ends ends = ends_of(table_, p.at, is_sheet_known_);
      // a stiff sheet pulls as its strain, s over M, has it, a soft one as its contraction; weak springs hold either
      const bool is_open = ends.is_weakest || (is_share ? ends.is_softest : ends.is_stiffest);
      limits.take(scale * (p.loads(load) - reach.below), scale * (p.loads(load) + reach.above),
                  is_open && p.loads(load) < 0, is_open && p.loads(load) > 0);
    });
    return limits;
  }
  Limits of_penetration() const {
    Limits limits;
    for_each([&](const Profile& p, double) {
      const double l = std::sqrt(sheet_of(p) / adhesion_of(p));
      const Ends ends = ends_of(table_, p.at, is_sheet_known_);
      limits.take(l, l, ends.is_softest || ends.is_strongest, ends.is_stiffest || ends.is_weakest);
    });
    return limits;
  }

 private:
  template <class Body>
  void for_each(const Body& body) const {
    body(best_, room_);
    for (const Profile& p : tried_)
      if (p.misfit - best_.misfit < room_) body(p, room_ - std::max(0.0, p.misfit - best_.misfit));
  }

  /// Where the misfit crosses its limit to both sides, between two steps of the scan.
  Limits limits_along(const std::vector<Profile>& scan, Number number, bool is_known) const {
    const double limit = best_.misfit + room_;
    Limits limits;
    limits.take(number(best_), number(best_));
    for (std::size_t k = 0; k + 1 < scan.size(); ++k) {
      const Profile &a = scan[k], &b = scan[k + 1];
      if (a.misfit <= limit) limits.take(number(a), number(a));
      if (b.misfit <= limit) limits.take(number(b), number(b));
      if ((a.misfit <= limit) == (b.misfit <= limit)) continue;
      const double share = (limit - a.misfit) / (b.misfit - a.misfit);
      const double edge = std::exp(std::log(number(a)) + share * std::log(number(b) / number(a)));
      limits.take(edge, edge);
    }
    if (is_known) return limits;
    limits.is_open_below = scan.front().misfit <= limit;
    limits.is_open_above = scan.back().misfit <= limit;
    return limits;
  }

  /// A lattice over both intervals.
  void try_between(const Search& search) {
    constexpr int kSteps = 40;
    const auto between = [&](const Limits& limits, int k) {
      return limits.low * std::pow(limits.high / limits.low, static_cast<double>(k) / kSteps);
    };
    for (int i = 0; i <= (is_sheet_known_ ? 0 : kSteps); ++i)
      for (int j = 0; j <= kSteps; ++j) tried_.push_back(search.at({between(of_sheet_, i), between(of_adhesion_, j)}));
  }

  const StiffnessTable& table_;
  const Profile& best_;
  double room_;
  bool is_sheet_known_;
  std::vector<Profile> tried_;
  Limits of_sheet_, of_adhesion_;
};

/// Those of the stiffnesses, the loads and what they make up.
class Estimates {
 public:
  Estimates(const StiffnessTable& table, const Profile& best, const MatrixXd& covariance, const Allowed& allowed)
      : table_(table), best_(best), covariance_(covariance), allowed_(allowed) {}

  std::vector<FittedEstimate> of(const std::vector<std::string>& parts) const {
    const Index at_M = table_.n_loads(), at_kappa = at_M + 1;
    const double M = sheet_of(best_);
    std::vector<FittedEstimate> all;
    const auto add = [&](Quantity quantity, const std::string& part, double value, const VectorXd& by_unknown,
                         const Limits& limits) { all.push_back(one(quantity, part, value, by_unknown, limits)); };
    const auto part_of = [&](Index k) { return parts.empty() ? "" : parts[k]; };
    for (Index k = 0; k < table_.n_contractions(); ++k)
      add(Quantity::contraction, part_of(k), best_.loads(k), by(k, 1), allowed_.of_load(k, Quantity::contraction));
    add(Quantity::stiffness, {}, M, by(at_M, M), allowed_.of_sheet());
    for (Index k = 0; k < table_.n_contractions(); ++k)
      add(Quantity::contraction_over_stiffness, part_of(k), best_.loads(k) / M,
          by(k, 1 / M) - by(at_M, best_.loads(k) / M), allowed_.of_load(k, Quantity::contraction_over_stiffness));
    Index load = table_.n_contractions();
    const auto tension = [&](Quantity quantity, const std::string& of_what) {
      add(quantity, of_what, best_.loads(load), by(load, 1), allowed_.of_load(load, quantity));
      ++load;
    };
    if (table_.has_line()) tension(Quantity::line_tension, {});
    for (const sheet::Bundle& bundle : table_.bundles()) {
      tension(Quantity::bundle_tension, "fibre " + std::to_string(bundle.fibre_id));
      FittedEstimate& e = all.back();
      if (e.value == 0 && e.high) e.sigma = *e.high / tensions::kNormal95;  // it is at its bound
    }
    if (!table_.adhesion_nN_per_um3()) return all;
    const double kappa = adhesion_of(best_), l = std::sqrt(M / kappa);
    add(Quantity::adhesion_stiffness, {}, kappa, by(at_kappa, kappa), allowed_.of_adhesion());
    add(Quantity::penetration, {}, l, by(at_M, l / 2) - by(at_kappa, l / 2), allowed_.of_penetration());
    return all;
  }

 private:
  VectorXd by(Index unknown, double factor) const { return factor * VectorXd::Unit(table_.n_loads() + 2, unknown); }
  FittedEstimate one(Quantity quantity, const std::string& part, double value, const VectorXd& by_unknown,
                     const Limits& limits) const {
    return fitted_estimate({.quantity = quantity,
                            .part = part,
                            .value = value,
                            .low = limits.is_open_below ? std::nullopt : std::optional(limits.low),
                            .high = limits.is_open_above ? std::nullopt : std::optional(limits.high)},
                           numerics::quadratic_form(covariance_, by_unknown), by_unknown);
  }

  const StiffnessTable& table_;
  const Profile& best_;
  const MatrixXd& covariance_;
  const Allowed& allowed_;
};

/// Always positive: its error is a factor.
bool is_logarithmic(Quantity quantity) {
  return quantity == Quantity::stiffness || quantity == Quantity::adhesion_stiffness ||
         quantity == Quantity::penetration;
}

/// Both ends of an interval. A stiffness that changes much does so neither by a sum nor by a factor: each end is the
/// farther of both, which is the sum below and the factor above.
/// @param more  half the width of an interval of the error alone
void widen(FittedEstimate& e, double more) {
  if (e.low) {
    const double wider = e.value - std::hypot(e.value - *e.low, more);
    e.low = *e.low >= 0 ? std::max(0.0, wider) : wider;  // what cannot be negative stays so
  }
  if (!e.high) return;
  const bool is_factor = is_logarithmic(e.quantity) && e.value > 0;
  e.high = is_factor ? e.value * std::exp(std::hypot(std::log(*e.high / e.value), more / e.value))
                     : e.value + std::hypot(*e.high - e.value, more);
}

}  // namespace

LinearData data_of(const DisplacementField& beads, const StiffnessTable& table, const sheet::OnGel& ground,
                   const substrate::Substrate& gel, int threads, MatrixXd motions) {
  const auto response = gel.response({ground.patches(), 2}, {points_of(beads)});
  return tensions::reduce(beads, substrate::dense_response(response->displace(table.forces_nN()), threads), {}, threads,
                          std::move(motions));
}

void add_error(std::vector<FittedEstimate>& estimates, std::optional<double> SheetErrorParts::*part,
               const VectorXd& sizes) {
  for (std::size_t k = 0; k < estimates.size(); ++k) {
    FittedEstimate& e = estimates[k];
    const double size = sizes(static_cast<Index>(k));
    if (is_logarithmic(e.quantity) && size > e.value) {
      e.low = e.high = e.sigma = std::nullopt;
      e.identifiable = false;
      e.parts = {};
      continue;
    }
    widen(e, tensions::kNormal95 * size);
    if (!e.sigma) continue;
    e.sigma = std::hypot(*e.sigma, size);
    e.parts.*part = std::hypot((e.parts.*part).value_or(0), size);
  }
}

VectorXd add_error(SheetFit& fit, std::optional<double> SheetErrorParts::*part, const MatrixXd& changes_um) {
  const MatrixXd moved = numerics::small_product(fit.answers, changes_um);
  VectorXd sizes(std::ssize(fit.estimates));
  for (Index k = 0; k < sizes.size(); ++k) sizes(k) = (fit.estimates[k].by_unknown.transpose() * moved).norm();
  add_error(fit.estimates, part, sizes);
  return sizes;
}

VectorXd changes_by_modulus(const std::vector<FittedEstimate>& estimates, double share) {
  VectorXd changes(std::ssize(estimates));
  for (Index k = 0; k < changes.size(); ++k) {
    const FittedEstimate& e = estimates[k];
    const bool is_force = e.quantity != Quantity::contraction_over_stiffness && e.quantity != Quantity::penetration;
    changes(k) = is_force ? share * e.value : 0;
  }
  return changes;
}

SheetFit fit_sheet(LinearData data, const StiffnessTable& table, tensions::Loss loss, std::optional<double> known,
                   const std::vector<std::string>& parts) {
  data = weighed(std::move(data), loss, [&](const LinearData& of) {
    const Search search(of, table, known);
    return search.amplitudes(search.best());
  });
  const Index n_unknowns = table.n_loads() + (known ? 0 : 1) + (table.adhesion_nN_per_um3() ? 1 : 0);
  const Search search(data, table, known);
  const Profile best = search.best();
  SheetFit fit;
  fit.stiffnesses = best.at;
  constexpr double kAtBound = 1e-4;  // of log M; the search ends at 1e-7
  fit.is_at_bound = !known && std::min(std::log(sheet_of(best) / table.sheet_nN_per_um().low),
                                       std::log(table.sheet_nN_per_um().high / sheet_of(best))) < kAtBound;
  fit.loads = best.loads;
  add_misfit(fit, data, numerics::matvec(table.shares(best.at), best.loads), static_cast<double>(n_unknowns));
  fit.variance = tensions::misfit_variance(data, fit.node_amplitudes, n_unknowns, loss);
  const Directions directions = directions_about(table, best.at, best.loads, known.has_value());
  fit.residuals = residuals_of(data, fit.node_amplitudes, directions);
  Linearised about = linearised(data, directions, fit.variance);
  const MatrixXd& covariance = about.covariance;
  const Index at_M = table.n_loads();
  if (!known) fit.correlation = covariance(0, at_M) / std::sqrt(covariance(0, 0) * covariance(at_M, at_M));
  const Allowed allowed(table, search, best, fit.variance, known.has_value());
  fit.estimates = Estimates(table, best, covariance, allowed).of(parts);
  split_by_noise(fit.estimates, about, fit.variance, data);
  fit.answers = std::move(about.answers);
  Models models(data, fit.variance);
  const bool has_parts = table.n_contractions() > 1, has_springs = table.adhesion_nN_per_um3().has_value(),
             has_bundles = !table.bundles().empty();
  struct Has {
    bool bundles, springs, parts;
  };
  const auto name = [&](const Has& has) {
    return std::string("sheet") + (table.has_line() ? "-with-line" : "") + (has.bundles ? "-with-bundles" : "") +
           (has.springs ? "-on-springs" : "") + (has.parts ? "-in-parts" : "");
  };
  const auto simpler = [&](const Has& has, Index n_fewer, const Search& its, const Profile& p) {
    models.add(name(has), n_unknowns - n_fewer, its.amplitudes(p));
  };
  if (has_bundles) {
    const Search its(data, table, known, without_bundles(table));
    simpler({false, has_springs, has_parts}, std::ssize(table.bundles()), its, its.best());
  }
  if (has_springs) simpler({has_bundles, false, has_parts}, 1, search, search.over_sheet(std::nullopt).best);
  if (has_parts) {
    const Search its(data, table, known, of_even_parts(table));
    simpler({has_bundles, has_springs, false}, table.n_contractions() - 1, its, its.best());
  }
  simpler({has_bundles, has_springs, has_parts}, 0, search, best);
  fit.models = models.all();
  fit.own_model = fit.models.size() - 1;
  fit.report = {.converged = true, .iterations = kScan, .last_change = 0, .reason = "scanned over the stiffness"};
  return fit;
}

std::vector<FittedEstimate> expanding(const SheetFit& fit) {
  std::vector<FittedEstimate> found;
  for (const FittedEstimate& e : fit.estimates)
    if (e.quantity == Quantity::contraction && (e.value < 0 || (e.high && *e.high < 0))) found.push_back(e);
  return found;
}

void compare_with_adhesions(SheetFit& fit, const LinearData& adhesions) {
  const double noise = tensions::noise_variance(adhesions), old_noise = fit.variance;
  fit.models.push_back({.name = "adhesion-forces",
                        .n_parameters = static_cast<int>(adhesions.reduced.n_felt),
                        .chi_squared = adhesions.reduced.floor_squared / old_noise,
                        .relative_l2 = tensions::relative_l2(adhesions, tensions::free_forces_nN(adhesions.reduced))});
  for (SheetModel& m : fit.models)
    m = tensions::score_of(m.name, m.n_parameters, m.chi_squared * (old_noise / noise), m.relative_l2, adhesions);
}

}  // namespace mbtfm::sheets
