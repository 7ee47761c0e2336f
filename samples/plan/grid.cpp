#include "samples/plan/grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/report/texts.h"
#include "samples/plan/adhesion_pair.h"
#include "substrate/choice/large_strain.h"

namespace mbtfm::plan {

namespace {

/// Of one estimate: what the beads make, and what the rest makes.
struct Errors {
  double beads_nN = 0;
  OtherParts other;
  double total_nN() const { return std::hypot(beads_nN, other.total_nN()); }
};

double scale_of(const Point& p) { return p.noise_um * p.youngs_modulus_kPa; }

std::vector<Errors> errors_of_tensions(const Computed& c, const Precision& unit, double scale,
                                       const std::vector<std::size_t>& labels) {
  std::vector<Errors> errors;
  for (const std::size_t i : labels)
    errors.push_back({scale * unit.tensions[static_cast<Eigen::Index>(i)], c.model.tensions[i]});
  return errors;
}

std::vector<Errors> errors_of_forces(const Eigen::VectorXd& unit, double scale, const Eigen::VectorXd& model_nN) {
  std::vector<Errors> errors;
  for (Eigen::Index a = 0; a < unit.size(); ++a)
    errors.push_back({scale * unit[a], {.other_nN = model_nN.size() > 0 ? model_nN[a] : 0}});
  return errors;
}

template <class Of>
double median_of(const std::vector<Errors>& errors, const Of& of) {
  std::vector<double> values;
  for (const Errors& e : errors) values.push_back(of(e));
  return numerics::median_in(values);
}

Expected expected_of(const Point& point, Quantity quantity, const std::vector<Errors>& errors, double target_nN) {
  std::vector<double> totals_nN;
  for (const Errors& e : errors) totals_nN.push_back(e.total_nN());
  return {.point = point,
          .quantity = quantity,
          .n = static_cast<int>(errors.size()),
          .standard_error_nN = median_of(errors, [](const Errors& e) { return e.total_nN(); }),
          .from_beads_nN = median_of(errors, [](const Errors& e) { return e.beads_nN; }),
          .from_mesh_nN = median_of(errors, [](const Errors& e) { return e.other.mesh_nN; }),
          .from_segmentation_nN = median_of(errors, [](const Errors& e) { return e.other.segmentation_nN; }),
          .from_other_nN = median_of(errors, [](const Errors& e) { return e.other.other_nN; }),
          .target_nN = target_nN,
          .share_within = share_within(totals_nN, target_nN),
          .smallest_seen_nN = kSeen * median_of(errors, [](const Errors& e) { return e.total_nN(); })};
}

/// Of the cell on its own gel; it falls with the modulus.
struct OnOwnGel {
  double largest_displacement_um = 0, traction_kPa = 0;
};
OnOwnGel on_own_gel(const Computed& c) {
  const Eigen::VectorXd u_um = c.densest.response->displace(c.cell.forces_nN);
  OnOwnGel own{.traction_kPa = choice::mean_traction_kPa(c.cell.ellipses, c.cell.forces_nN)};
  for (Eigen::Index row = 0; row < u_um.size(); row += 2)
    own.largest_displacement_um = std::max(own.largest_displacement_um, u_um.segment<2>(row).norm());
  return own;
}

/// All quantities at a point.
std::vector<Expected> at_point(const Scene& scene, const Asked& asked, const Computed& c, const Precision& unit,
                               const Point& point) {
  const double scale = scale_of(point);
  std::vector<Expected> all;
  const auto add_fibres = [&](Quantity quantity, std::optional<FibreType> type) {
    const std::vector<std::size_t> labels = labels_of(scene, c.cell, type);
    if (!labels.empty())
      all.push_back(expected_of(point, quantity, errors_of_tensions(c, unit, scale, labels), asked.target_nN));
  };
  add_fibres(Quantity::fibres, {});
  for (std::size_t k = 0; k < std::size(kFibreTypes); ++k) add_fibres(kOfTypes[k], kFibreTypes[k]);
  const double network_nN = scale * unit.tensions[0] * c.model.network_force_nN / c.cell.tensions_nN[0];
  all.push_back(expected_of(point, Quantity::network_force, {{network_nN, c.model.network_force}},
                            asked.within * c.model.network_force_nN));
  all.push_back(expected_of(point, Quantity::total_force, {{scale * unit.total_force, c.model.total_force}},
                            asked.within * c.model.total_force_nN));
  all.push_back(expected_of(point, Quantity::adhesion_force,
                            errors_of_forces(unit.adhesion_forces, scale, c.model.adhesion_forces_nN),
                            asked.target_nN));
  all.push_back(
      expected_of(point, Quantity::free_force, errors_of_forces(unit.free_forces, scale, {}), asked.target_nN));
  return all;
}

Expected expected_of_fttc(const Point& point, const std::vector<double>& errors_nN, double target_nN) {
  const double error_nN = robust_error(errors_nN);
  return {.point = point,
          .quantity = Quantity::fttc_force,
          .n = static_cast<int>(errors_nN.size()),
          .standard_error_nN = error_nN,
          .target_nN = target_nN,
          .share_within = share_within(errors_nN, target_nN),
          .smallest_seen_nN = kSeen * error_nN};
}

/// Density at which a tension's standard error is the target; infinite where what is left without noise is more, or
/// beads would stand closer than a nanometre.
double needed_beads_per_um2(const Computed& c, std::size_t label, double target_nN, double scale) {
  const double other_nN = c.model.tensions[label].total_nN();
  if (other_nN >= target_nN) return std::numeric_limits<double>::infinity();
  const double wanted = std::sqrt(target_nN * target_nN - other_nN * other_nN) / scale;
  double low = 1e-6, high = 1e6;  // errors fall as the density rises
  if (unit_error(c.densities, label, high) > wanted) return std::numeric_limits<double>::infinity();
  while (high / low > 1 + 1e-6) {
    const double middle = std::sqrt(low * high);
    (unit_error(c.densities, label, middle) > wanted ? low : high) = middle;
  }
  return high;
}

/// At which this share of the fibres has it.
std::optional<double> needed_by_share(const Computed& c, double share, double target_nN, double scale) {
  std::vector<double> needed;
  for (std::size_t i = 1; i < c.cell.fibre_ids.size(); ++i)
    needed.push_back(needed_beads_per_um2(c, i, target_nN, scale));
  const std::optional<double> density = density_of_share(std::move(needed), share);
  return density ? std::optional(std::max(c.densities.beads_per_um2.front(), *density)) : std::nullopt;
}

std::vector<std::string> warnings_of(const Asked& asked, const Computed& c, const Scene& scene) {
  const OnOwnGel own = on_own_gel(c);
  std::vector<std::string> warnings;
  for (const double E : asked.youngs_modulus_kPa) {
    const double largest_um = own.largest_displacement_um * c.densest.modulus_kPa / E;
    for (const double noise_um : asked.noise_um)
      if (largest_um < kOfNoise * noise_um) warnings.push_back(sentence_of_noise(E, largest_um, noise_um));
    const double left_out = choice::left_out_at_beads(with_modulus(scene.fit.gel, E), own.traction_kPa);
    if (left_out > kBeyondLinear) warnings.push_back(sentence_of_strain(E, left_out));
  }
  return warnings;
}

void check_densities(const Scene& scene, const std::vector<double>& beads_per_um2) {
  const double area_um2 = scene.field.area_um2(), most = most_beads_per_um2(scene);
  constexpr double kFewest = 20;
  if (beads_per_um2.front() * area_um2 < kFewest)
    throw UsageError("beads_per_um2: " + brief(beads_per_um2.front()) + " are fewer than 20 beads in the " +
                     brief(area_um2) + " um² of the scene");
  if (beads_per_um2.back() > most)
    throw UsageError("beads_per_um2: " + brief(beads_per_um2.back()) + " are more than the " + brief(most) +
                     " that can be told apart: beads nearer than " + brief(scene.experiment.bead_distance_um) +
                     " um to each other melt together in an image");
}

}  // namespace

std::vector<Point> points_of(const Asked& asked) {
  std::vector<Point> points;
  for (const double E : asked.youngs_modulus_kPa)
    for (const double density : asked.densities)
      for (const double noise_um : asked.noise_um) points.push_back({E, density, noise_um});
  return points;
}

Gel with_modulus(Gel gel, double youngs_modulus_kPa) {
  gel.youngs_modulus_kPa = youngs_modulus_kPa;
  return gel;
}

double median_area_um2(const std::vector<Adhesion>& adhesions) {
  std::vector<double> areas;
  for (const Adhesion& a : adhesions) areas.push_back(a.area_um2);
  return numerics::median_in(areas);
}

std::vector<std::size_t> labels_of(const Scene& scene, const KnownCell& cell, std::optional<FibreType> type) {
  std::vector<std::size_t> labels;
  for (std::size_t i = 1; i < cell.fibre_ids.size(); ++i) {
    const auto fibre = std::ranges::find(scene.cell.cell.fibres, cell.fibre_ids[i], &Fibre::fibre_id);
    if (!type || fibre->type == *type) labels.push_back(i);
  }
  return labels;
}

double share_within(const std::vector<double>& errors_nN, double target_nN) {
  const auto n_within = std::ranges::count_if(errors_nN, [&](double e) { return e <= target_nN; });
  return static_cast<double>(n_within) / static_cast<double>(errors_nN.size());
}

std::optional<double> density_of_share(std::vector<double> needed, double share) {
  const auto rank = std::min(needed.size() - 1, static_cast<std::size_t>(share * static_cast<double>(needed.size())));
  const double density = numerics::of_rank_in(needed, rank);
  return std::isfinite(density) ? std::optional(density) : std::nullopt;
}

std::string sentence_of_noise(double youngs_modulus_kPa, double largest_um, double noise_um) {
  return report::sentence("plan.unseen", brief(youngs_modulus_kPa), brief(largest_um), brief(noise_um));
}

std::string sentence_of_strain(double youngs_modulus_kPa, double left_out) {
  return report::sentence("plan.beyond-linear", brief(youngs_modulus_kPa), brief(100 * left_out));
}

double most_beads_per_um2(const Scene& scene) {
  // of discs at random that keep this distance: they jam at 0.547 of the area (Feder, J. Theor. Biol. 87, 237 (1980)),
  // but the last of them are hard to place
  constexpr double kFilled = 0.5;
  const double distance_um = scene.experiment.bead_distance_um;
  return kFilled * 4 / (3.141592653589793 * distance_um * distance_um);
}

double unit_error(const Densities& d, std::size_t label, double beads_per_um2) {
  const auto error = [&](std::size_t k) { return d.precision[k].tensions[static_cast<Eigen::Index>(label)]; };
  const auto by_law = [&](std::size_t k) { return error(k) * std::sqrt(d.beads_per_um2[k] / beads_per_um2); };
  const auto above = std::ranges::lower_bound(d.beads_per_um2, beads_per_um2);
  if (above == d.beads_per_um2.begin()) return by_law(0);
  if (above == d.beads_per_um2.end()) return by_law(d.beads_per_um2.size() - 1);
  const auto k = static_cast<std::size_t>(above - d.beads_per_um2.begin());
  const double share =
      std::log(beads_per_um2 / d.beads_per_um2[k - 1]) / std::log(d.beads_per_um2[k] / d.beads_per_um2[k - 1]);
  return std::pow(error(k - 1), 1 - share) * std::pow(error(k), share);
}

double standard_error_nN(const Computed& c, std::size_t label, const Point& point) {
  return std::hypot(scale_of(point) * unit_error(c.densities, label, point.density),
                    c.model.tensions[label].total_nN());
}

Computed compute(const Scene& scene, const Asked& asked, const Work& work) {
  check_densities(scene, asked.densities);
  Computed c{.cell = known_cell(scene, work.part(0, 0.2)), .densest = {}, .densities = {}, .model = {}};
  c.densities = precision_at(scene, c.cell, asked.densities, work.part(0.2, 0.3));
  work.tell(0.5, "the model's own error");
  c.densest = beads_on_gel(scene, c.cell, asked.densities.back(), 0, work.threads);
  c.model = model_errors(
      scene, c.cell, exact_beads(c.densest.places_um, *c.densest.response, c.cell.forces_nN, asked.noise_um.front()),
      c.densest.response, work);
  return c;
}

Grid grid_of(const Scene& scene, const Asked& asked, const Computed& c, int threads) {
  Grid grid;
  const OnOwnGel own = on_own_gel(c);
  const PairResolution pairs(scene.fit.gel, median_area_um2(scene.cell.cell.adhesions), asked.densities, threads);
  grid.touching_um = pairs.touching_um();
  const double force_nN = asked.target_nN / asked.within;
  const std::vector<Point> points = points_of(asked);
  const std::vector<std::vector<double>> of_fttc = errors_of_fttc_nN(scene, asked, c, threads);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& point = points[i];
    const double E = point.youngs_modulus_kPa;
    const auto density =
        static_cast<std::size_t>(std::ranges::find(asked.densities, point.density) - asked.densities.begin());
    std::vector<Expected> all = at_point(scene, asked, c, c.densities.precision[density], point);
    all.push_back(expected_of_fttc(point, of_fttc[i], asked.target_nN));
    for (Expected& e : all) {
      e.largest_displacement_um = own.largest_displacement_um * c.densest.modulus_kPa / E;
      e.left_out = choice::left_out_at_beads(with_modulus(scene.fit.gel, E), own.traction_kPa);
      if (e.quantity == Quantity::free_force)
        e.least_distance_um = pairs.least_distance_um(force_nN, E, density, point.noise_um);
      grid.expected.push_back(e);
    }
  }
  if (c.cell.fibre_ids.size() > 1) {
    for (const double E : asked.youngs_modulus_kPa) {
      for (const double noise_um : asked.noise_um) {
        constexpr double kMost = 0.9;
        const auto needed = [&](double share) { return needed_by_share(c, share, asked.target_nN, noise_um * E); };
        grid.needed.push_back({E, noise_um, needed(0.5), needed(kMost)});
      }
    }
    std::vector<double> other_nN;
    for (std::size_t i = 1; i < c.model.tensions.size(); ++i) other_nN.push_back(c.model.tensions[i].total_nN());
    grid.model_error_nN = numerics::median_in(other_nN);
  }
  grid.warnings = warnings_of(asked, c, scene);
  return grid;
}

}  // namespace mbtfm::plan
