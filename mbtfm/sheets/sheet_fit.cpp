#include "mbtfm/sheets/sheet_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "mbtfm/sheets/profile.h"
#include "mbtfm/tensions/intervals.h"
#include "mbtfm/tensions/robust.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::sheets {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using tensions::LinearData;

/// 0 of what is known.
MatrixXd covariance_of(const LinearData& data, const Directions& about, double variance) {
  const MatrixXd normal = about.normal(data);
  MatrixXd covariance = MatrixXd::Zero(about.forces.cols(), about.forces.cols());
  covariance(about.unknown, about.unknown) =
      variance * normal.ldlt().solve(MatrixXd::Identity(normal.rows(), normal.cols()));
  return covariance;
}

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
  Limits of_load(Eigen::Index load, Quantity quantity) const {
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

SheetEstimate estimate(Quantity quantity, const std::string& part, double value, double sigma, const Limits& limits) {
  SheetEstimate e{
      .quantity = quantity, .part = part, .value = value, .sigma = sigma, .low = limits.low, .high = limits.high};
  if (limits.is_open_below) e.low = std::nullopt;
  if (limits.is_open_above) e.high = std::nullopt;
  e.identifiable = e.low && e.high;
  if (!e.identifiable) e.sigma = std::nullopt;
  return e;
}

/// Those of the stiffnesses, the loads and what they make up.
std::vector<SheetEstimate> estimates_of(const StiffnessTable& table, const Profile& best, const MatrixXd& covariance,
                                        const Allowed& allowed, const std::vector<std::string>& parts) {
  const Eigen::Index at_M = table.n_loads(), at_kappa = at_M + 1;
  const auto sigma = [&](Eigen::Index k) { return std::sqrt(std::max(0.0, covariance(k, k))); };
  const double M = sheet_of(best);
  std::vector<SheetEstimate> estimates = {estimate(Quantity::stiffness, {}, M, M * sigma(at_M), allowed.of_sheet())};
  for (Eigen::Index k = 0; k < table.n_contractions(); ++k) {
    const double s = best.loads(k);
    const std::string part = parts.empty() ? "" : parts[static_cast<std::size_t>(k)];
    // of s / M, where log M and s are correlated
    const double of_share =
        std::sqrt(std::max(0.0, covariance(k, k) + s * s * covariance(at_M, at_M) - 2 * s * covariance(k, at_M))) / M;
    estimates.insert(estimates.end() - (k == 0 ? 1 : 0),
                     estimate(Quantity::contraction, part, s, sigma(k), allowed.of_load(k, Quantity::contraction)));
    estimates.push_back(estimate(Quantity::contraction_over_stiffness, part, s / M, of_share,
                                 allowed.of_load(k, Quantity::contraction_over_stiffness)));
  }
  Eigen::Index load = table.n_contractions();
  const auto tension = [&](Quantity quantity, const std::string& of) {
    estimates.push_back(estimate(quantity, of, best.loads(load), sigma(load), allowed.of_load(load, quantity)));
    ++load;
  };
  if (table.has_line()) tension(Quantity::line_tension, {});
  for (const sheet::Bundle& bundle : table.bundles()) {
    tension(Quantity::bundle_tension, "fibre " + std::to_string(bundle.fibre_id));
    SheetEstimate& e = estimates.back();
    if (e.value == 0 && e.high) e.sigma = *e.high / tensions::kNormal95;  // it is at its bound
  }
  if (!table.adhesion_nN_per_um3()) return estimates;
  const double kappa = adhesion_of(best), l = std::sqrt(M / kappa);
  estimates.push_back(
      estimate(Quantity::adhesion_stiffness, {}, kappa, kappa * sigma(at_kappa), allowed.of_adhesion()));
  const double of_l = 0.5 * std::sqrt(std::max(0.0, covariance(at_M, at_M) + covariance(at_kappa, at_kappa) -
                                                        2 * covariance(at_M, at_kappa)));
  estimates.push_back(estimate(Quantity::penetration, {}, l, l * of_l, allowed.of_penetration()));
  return estimates;
}

/// The estimates where loads and stiffnesses have moved.
std::vector<SheetEstimate> values_moved(std::vector<SheetEstimate> estimates, const StiffnessTable& table,
                                        const Profile& best, const VectorXd& moved) {
  const VectorXd loads = best.loads + moved.head(table.n_loads());
  const double M = sheet_of(best) * std::exp(moved(table.n_loads())),
               kappa = best.at.adhesion_nN_per_um3.value_or(1) * std::exp(moved(table.n_loads() + 1));
  Eigen::Index contraction = 0, share = 0, bundle = table.n_loads() - std::ssize(table.bundles());
  for (SheetEstimate& e : estimates) {
    switch (e.quantity) {
      case Quantity::contraction:
        e.value = loads(contraction++);
        break;
      case Quantity::stiffness:
        e.value = M;
        break;
      case Quantity::line_tension:
        e.value = loads(table.n_contractions());
        break;
      case Quantity::contraction_over_stiffness:
        e.value = loads(share++) / M;
        break;
      case Quantity::adhesion_stiffness:
        e.value = kappa;
        break;
      case Quantity::penetration:
        e.value = std::sqrt(M / kappa);
        break;
      case Quantity::bundle_tension:
        e.value = loads(bundle++);
        break;
    }
  }
  return estimates;
}

}  // namespace

LinearData data_of(const DisplacementField& beads, const StiffnessTable& table, const sheet::OnGel& ground,
                   const substrate::Substrate& gel, int threads, MatrixXd motions) {
  std::vector<Vec2> points;
  for (const Bead& bead : beads) points.push_back(bead.position_um);
  const auto response = gel.response({ground.patches(), 2}, {points});
  return tensions::reduce(beads, substrate::dense_response(response->displace(table.forces_nN()), threads), {}, threads,
                          std::move(motions));
}

void add_errors(std::vector<SheetEstimate>& estimates, double relative_error_of_modulus,
                const std::vector<std::vector<SheetEstimate>>& others) {
  for (std::size_t k = 0; k < estimates.size(); ++k) {
    SheetEstimate& e = estimates[k];
    const bool is_force = e.quantity != Quantity::contraction_over_stiffness && e.quantity != Quantity::penetration;
    double variance = is_force ? std::pow(relative_error_of_modulus * e.value, 2) : 0;
    for (const std::vector<SheetEstimate>& other : others) variance += std::pow(other[k].value - e.value, 2);
    const double more = tensions::kNormal95 * std::sqrt(variance);
    if (e.low) {
      const double wider = e.value - std::hypot(e.value - *e.low, more);
      e.low = *e.low >= 0 ? std::max(0.0, wider) : wider;  // what cannot be negative stays so
    }
    if (e.high) e.high = e.value + std::hypot(*e.high - e.value, more);
    if (e.sigma) e.sigma = std::hypot(*e.sigma, std::sqrt(variance));
  }
}

SheetFit fit_sheet(LinearData data, const StiffnessTable& table, tensions::Loss loss, std::optional<double> known,
                   const std::vector<std::string>& parts, const MeshError& mesh_error_um) {
  data = weighed(std::move(data), loss, [&](const LinearData& of) {
    const Search search(of, table, known);
    return search.amplitudes(search.best());
  });
  const Eigen::Index n_unknowns = table.n_loads() + (known ? 0 : 1) + (table.adhesion_nN_per_um3() ? 1 : 0);
  const Search search(data, table, known);
  const Profile best = search.best();
  SheetFit fit;
  fit.stiffnesses = best.at;
  constexpr double kAtBound = 1e-4;  // of log M; the search ends at 1e-7
  fit.is_at_bound = !known && std::min(std::log(sheet_of(best) / table.sheet_nN_per_um().low),
                                       std::log(table.sheet_nN_per_um().high / sheet_of(best))) < kAtBound;
  fit.loads = best.loads;
  add_misfit(fit, data, table.shares(best.at) * best.loads, static_cast<double>(n_unknowns));
  fit.variance = tensions::misfit_variance(data, fit.node_amplitudes, n_unknowns, loss);
  const Directions about = directions_about(table, best.at, best.loads, known.has_value());
  const MatrixXd covariance = covariance_of(data, about, fit.variance);
  const Eigen::Index at_M = table.n_loads();
  if (!known) fit.correlation = covariance(0, at_M) / std::sqrt(covariance(0, 0) * covariance(at_M, at_M));
  fit.estimates =
      estimates_of(table, best, covariance, Allowed(table, search, best, fit.variance, known.has_value()), parts);
  if (mesh_error_um) {
    Directions told = about;  // a stiffness that the beads do not tell within a factor of e follows no straight line
    std::erase_if(told.unknown, [&](Eigen::Index k) { return k >= table.n_loads() && covariance(k, k) > 1; });
    const VectorXd moved = moved_by_change(data, told, mesh_error_um(best.at, best.loads));
    add_errors(fit.estimates, 0, {values_moved(fit.estimates, table, best, moved)});
  }
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
  const auto simpler = [&](const Has& has, Eigen::Index n_fewer, const Search& its, const Profile& p) {
    models.add(name(has), static_cast<int>(n_unknowns - n_fewer), its.amplitudes(p));
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

std::vector<SheetEstimate> expanding(const SheetFit& fit) {
  std::vector<SheetEstimate> found;
  for (const SheetEstimate& e : fit.estimates) {
    if (e.quantity == Quantity::contraction && (e.value < 0 || (e.high && *e.high < 0))) found.push_back(e);
  }
  return found;
}

void compare_with_adhesions(SheetFit& fit, const LinearData& adhesions) {
  const double noise = tensions::noise_variance(adhesions), old_noise = fit.variance;
  const auto n_used = static_cast<double>(adhesions.n_used);
  fit.models.push_back({"adhesion-forces", static_cast<int>(adhesions.reduced.n_felt),
                        adhesions.reduced.floor_squared / old_noise,
                        tensions::relative_l2(adhesions, tensions::free_forces_nN(adhesions.reduced)), 0, 0});
  for (SheetModel& model : fit.models) {
    model.chi_squared *= old_noise / noise;
    model.aic = model.chi_squared + 2 * model.n_parameters;
    model.bic = model.chi_squared + model.n_parameters * std::log(n_used);
  }
}

}  // namespace mbtfm::sheets
