#include "samples/plan/grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/report/texts.h"
#include "samples/plan/adhesion_pair.h"
#include "substrate/choice/large_strain.h"

namespace mbtfm::plan {

namespace {

/// Of estimates of one quantity: as a whole, by the beads, and by the rest.
struct Errors {
  std::vector<double> all_nN = {}, beads_nN = {}, mesh_nN = {}, segmentation_nN = {}, other_nN = {};
  void add(double by_beads_nN, const OtherParts& other) {
    all_nN.push_back(std::hypot(by_beads_nN, other.total_nN()));
    beads_nN.push_back(by_beads_nN);
    mesh_nN.push_back(other.mesh_nN);
    segmentation_nN.push_back(other.segmentation_nN);
    other_nN.push_back(other.other_nN);
  }
};

double scale_of(const Point& p) { return p.noise_um * p.youngs_modulus_kPa; }

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
  const auto add = [&](Quantity quantity, Errors errors, double target_nN) {
    Expected& e = all.emplace_back(expected_by(point, quantity, errors.all_nN, errors.beads_nN, target_nN));
    e.from_mesh_nN = numerics::median_in(errors.mesh_nN);
    e.from_segmentation_nN = numerics::median_in(errors.segmentation_nN);
    e.from_other_nN = numerics::median_in(errors.other_nN);
  };
  const auto add_fibres = [&](Quantity quantity, std::optional<FibreType> type) {
    Errors errors;
    for (const std::size_t i : labels_of(scene, c.cell, type))
      errors.add(scale * unit.tensions[static_cast<Eigen::Index>(i)], c.model.tensions[i]);
    if (!errors.all_nN.empty()) add(quantity, errors, asked.target_nN);
  };
  add_fibres(Quantity::fibres, {});
  for (std::size_t k = 0; k < std::size(kFibreTypes); ++k) add_fibres(kOfTypes[k], kFibreTypes[k]);
  Errors network, total, with_network, alone;
  network.add(scale * unit.tensions[0] * c.model.network_force_nN / c.cell.tensions_nN[0], c.model.network_force);
  total.add(scale * unit.total_force, c.model.total_force);
  for (Eigen::Index a = 0; a < unit.adhesion_forces.size(); ++a) {
    with_network.add(scale * unit.adhesion_forces[a], {.other_nN = c.model.adhesion_forces_nN[a]});
    alone.add(scale * unit.free_forces[a], {});
  }
  add(Quantity::network_force, network, asked.within * c.model.network_force_nN);
  add(Quantity::total_force, total, asked.within * c.model.total_force_nN);
  add(Quantity::adhesion_force, with_network, asked.target_nN);
  add(Quantity::free_force, alone, asked.target_nN);
  return all;
}

/// Density at which a tension's standard error is the target; infinite where what is left without noise is more, or
/// beads would be closer than a nanometre.
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

void check_densities(const Scene& scene, const std::vector<double>& beads_per_um2) {
  const double area_um2 = scene.field.area_um2(), most = most_beads_per_um2(scene);
  constexpr double kFewest = 20;
  if (beads_per_um2.front() * area_um2 < kFewest)
    throw UsageError("beads_per_um2: " + brief(beads_per_um2.front()) + " are fewer than 20 beads in the " +
                     brief(area_um2) + " um² of the scene");
  if (beads_per_um2.back() > most)
    throw UsageError("beads_per_um2: " + brief(beads_per_um2.back()) + " are more than the " + brief(most) +
                     " that can be resolved: beads nearer than " + brief(scene.experiment.bead_distance_um) +
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

Needed needed_by(double youngs_modulus_kPa, double noise_um, std::vector<double> densities) {
  const auto of_share = [&](double share) {
    const auto n = static_cast<double>(densities.size());
    const double density =
        numerics::of_rank_in(densities, std::min(densities.size() - 1, static_cast<std::size_t>(share * n)));
    return std::isfinite(density) ? std::optional(density) : std::nullopt;
  };
  constexpr double kMost = 0.9;
  return {youngs_modulus_kPa, noise_um, of_share(0.5), of_share(kMost)};
}

template <class Quantity>
std::vector<std::string> warnings_of(const Asked& asked, const GridOf<Quantity>& grid, Quantity quantity) {
  constexpr double kOfNoise = 3;          // a largest displacement below so many times the noise is hardly seen
  constexpr double kBeyondLinear = 0.05;  // as the caution large-strain of the fit
  std::vector<std::string> warnings;
  for (const double E : asked.youngs_modulus_kPa) {
    const auto at = [&](double density, double noise_um) -> const ExpectedOf<Quantity>& {
      return expected_of(grid, {E, density, noise_um}, quantity);
    };
    for (const double noise_um : asked.noise_um)
      if (const double largest_um = at(asked.densities.front(), noise_um).largest_displacement_um;
          largest_um < kOfNoise * noise_um)
        warnings.push_back(report::sentence("plan.unseen", brief(E), brief(largest_um), brief(noise_um)));
    if (const double left_out = at(asked.densities.back(), asked.noise_um.back()).left_out; left_out > kBeyondLinear)
      warnings.push_back(report::sentence("plan.beyond-linear", brief(E), brief(100 * left_out)));
  }
  return warnings;
}
template std::vector<std::string> warnings_of(const Asked&, const Grid&, Quantity);
template std::vector<std::string> warnings_of(const Asked&, const SpaceGrid&, SpaceQuantity);

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
    Expected& usual = all.emplace_back(expected_by(point, Quantity::fttc_force, of_fttc[i], {}, asked.target_nN));
    usual.standard_error_nN = robust_error(of_fttc[i]);
    usual.smallest_seen_nN = kSeen * usual.standard_error_nN;
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
        std::vector<double> needed;
        for (std::size_t i = 1; i < c.cell.fibre_ids.size(); ++i)
          needed.push_back(
              std::max(asked.densities.front(), needed_beads_per_um2(c, i, asked.target_nN, noise_um * E)));
        grid.needed.push_back(needed_by(E, noise_um, std::move(needed)));
      }
    }
    std::vector<double> other_nN;
    for (std::size_t i = 1; i < c.model.tensions.size(); ++i) other_nN.push_back(c.model.tensions[i].total_nN());
    grid.model_error_nN = numerics::median_in(other_nN);
  }
  grid.warnings = warnings_of(asked, grid, Quantity::total_force);
  return grid;
}

}  // namespace mbtfm::plan
