#include "mbtfm/plan/grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mbtfm/tensions/linear_data.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/order_statistics.h"
#include "substrate/choice/large_strain.h"

namespace mbtfm::plan {

using namespace tensions;

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

std::vector<std::size_t> labels_of(const Scene& scene, const KnownCell& cell, std::optional<FibreType> type) {
  std::vector<std::size_t> labels;
  for (std::size_t i = 1; i < cell.fibre_ids.size(); ++i) {
    const auto fibre = std::ranges::find(scene.cell.cell.fibres, cell.fibre_ids[i], &Fibre::fibre_id);
    if (!type || fibre->type == *type) labels.push_back(i);
  }
  return labels;
}

Quantity quantity_of(FibreType type) {
  switch (type) {
    case FibreType::dorsal:
      return Quantity::dorsal;
    case FibreType::arc:
      return Quantity::arc;
    case FibreType::ventral:
      return Quantity::ventral;
    case FibreType::edge:
      break;
  }
  return Quantity::edge;
}

template <class Of>
double median_of(const std::vector<Errors>& errors, const Of& of) {
  std::vector<double> values;
  for (const Errors& e : errors) values.push_back(of(e));
  return numerics::median_in(values);
}

Expected expected_of(const Point& point, Quantity quantity, const std::vector<Errors>& errors, double target_nN) {
  const auto is_within = [&](const Errors& e) { return e.total_nN() <= target_nN; };
  return {.point = point,
          .quantity = quantity,
          .n = static_cast<int>(errors.size()),
          .standard_error_nN = median_of(errors, [](const Errors& e) { return e.total_nN(); }),
          .from_beads_nN = median_of(errors, [](const Errors& e) { return e.beads_nN; }),
          .from_mesh_nN = median_of(errors, [](const Errors& e) { return e.other.mesh_nN; }),
          .from_segmentation_nN = median_of(errors, [](const Errors& e) { return e.other.segmentation_nN; }),
          .from_other_nN = median_of(errors, [](const Errors& e) { return e.other.other_nN; }),
          .target_nN = target_nN,
          .share_within =
              static_cast<double>(std::ranges::count_if(errors, is_within)) / static_cast<double>(errors.size()),
          .smallest_seen_nN = Grid::kSeen * median_of(errors, [](const Errors& e) { return e.total_nN(); }),
          .least_distance_um = {}};
}

double median_area_um2(const Scene& scene) {
  std::vector<double> areas;
  for (const Adhesion& a : scene.cell.cell.adhesions) areas.push_back(a.area_um2);
  return numerics::median_in(areas);
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

Gel of_modulus(Gel gel, double youngs_modulus_kPa) {
  gel.youngs_modulus_kPa = youngs_modulus_kPa;
  return gel;
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
  for (const FibreType type : kFibreTypes) add_fibres(quantity_of(type), type);
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

/// Standard errors of all fibres at the densest, by the noise of 1 um on 1 kPa, and what is left without noise.
struct FibreErrors {
  std::vector<double> unit, other_nN;
};
FibreErrors fibre_errors(const Computed& c) {
  FibreErrors e;
  for (std::size_t i = 1; i < c.cell.fibre_ids.size(); ++i) {
    e.unit.push_back(c.densities.precision.back().tensions[static_cast<Eigen::Index>(i)]);
    e.other_nN.push_back(c.model.tensions[i].total_nN());
  }
  return e;
}

/// Density at which this share of the fibres has a standard error of the target, as the covariance falls with it.
double needed_beads_per_um2(const Computed& c, double share, double target_nN, double scale) {
  const FibreErrors e = fibre_errors(c);
  std::vector<double> needed;
  for (std::size_t i = 0; i < e.unit.size(); ++i) {
    const double room = target_nN * target_nN - e.other_nN[i] * e.other_nN[i];
    needed.push_back(room > 0 ? c.densities.beads_per_um2.back() * std::pow(scale * e.unit[i], 2) / room
                              : std::numeric_limits<double>::infinity());
  }
  const auto rank = std::min(needed.size() - 1, static_cast<std::size_t>(share * static_cast<double>(needed.size())));
  return numerics::of_rank_in(needed, rank);
}

std::vector<std::string> warnings_of(const Asked& asked, const Computed& c, const Scene& scene) {
  constexpr double kOfNoise = 3;          // less is not told from noise bead by bead
  constexpr double kBeyondLinear = 0.05;  // the caution strain-beyond-linear of the fit
  const OnOwnGel own = on_own_gel(c);
  std::vector<std::string> warnings;
  for (const double E : asked.youngs_modulus_kPa) {
    const double largest_um = own.largest_displacement_um * c.densest.modulus_kPa / E;
    for (const double noise_um : asked.noise_um)
      if (largest_um < kOfNoise * noise_um)
        warnings.push_back("On " + brief(E) + " kPa no bead moves by more than " + brief(largest_um) +
                           " um, less than three times the noise of " + brief(noise_um) +
                           " um: the cell is hardly seen. Take a softer gel.");
    const double left_out = choice::left_out_at_beads(of_modulus(scene.fit.gel, E), own.traction_kPa);
    if (left_out > kBeyondLinear)
      warnings.push_back("On " + brief(E) + " kPa linear elasticity leaves out some " + brief(100 * left_out) +
                         " % of the displacement, which is strained beyond its range: evaluate with "
                         "substrate.material = neo-hooke, or take a stiffer gel.");
  }
  return warnings;
}

}  // namespace

double most_beads_per_um2(const Scene& scene) {
  // of discs at random that keep this distance: they jam at 0.547 of the area (Feder, J. Theor. Biol. 87, 237 (1980))
  constexpr double kJammed = 0.547;
  const double distance_um = scene.experiment.bead_distance_um;
  return kJammed * 4 / (3.141592653589793 * distance_um * distance_um);
}

double standard_error_nN(const Computed& c, std::size_t label, const Point& point) {
  const double thinner = std::sqrt(c.densest_per_um2 / point.beads_per_um2);
  const double beads_nN =
      scale_of(point) * thinner * c.densities.precision.back().tensions[static_cast<Eigen::Index>(label)];
  return std::hypot(beads_nN, c.model.tensions[label].total_nN());
}

Computed compute(const Scene& scene, const Asked& asked, const Work& work) {
  Computed c{.cell = known_cell(scene, work), .densest = {}, .densities = {}, .model = {}};
  work.tell(0.2, "the gel's answer at the beads");
  c.densest_per_um2 = asked.beads_per_um2.back();
  c.densest = beads_on_gel(scene, c.cell, c.densest_per_um2, 0, work.threads);
  c.densities.beads_per_um2 = asked.beads_per_um2;
  for (std::size_t k = 0; k < asked.beads_per_um2.size(); ++k) {
    work.tell(0.3 + 0.2 * double(k) / double(asked.beads_per_um2.size()), "what beads tell");
    c.densities.precision.push_back(
        precision_at_share(scene, c.cell, c.densest, asked.beads_per_um2[k] / c.densest_per_um2, work.threads));
  }
  work.tell(0.5, "the model's own error");
  c.model = model_errors(
      scene, c.cell, exact_beads(c.densest.places_um, *c.densest.response, c.cell.forces_nN, asked.noise_um.front()),
      c.densest.response, work);
  return c;
}

Grid grid_of(const Scene& scene, const Asked& asked, const Computed& c) {
  Grid grid;
  const OnOwnGel own = on_own_gel(c);
  const PairResolution pairs(scene.fit.gel, median_area_um2(scene), 1);
  const double force_nN = asked.target_nN / asked.within;
  for (const double E : asked.youngs_modulus_kPa) {
    for (std::size_t k = 0; k < asked.beads_per_um2.size(); ++k) {
      for (const double noise_um : asked.noise_um) {
        const Point point{E, asked.beads_per_um2[k], noise_um};
        for (Expected e : at_point(scene, asked, c, c.densities.precision[k], point)) {
          e.largest_displacement_um = own.largest_displacement_um * c.densest.modulus_kPa / E;
          e.left_out = choice::left_out_at_beads(of_modulus(scene.fit.gel, E), own.traction_kPa);
          if (e.quantity == Quantity::free_force)
            e.least_distance_um = pairs.least_distance_um(force_nN, E, point.beads_per_um2, noise_um);
          grid.expected.push_back(e);
        }
      }
    }
  }
  if (c.cell.fibre_ids.size() > 1) {
    for (const double E : asked.youngs_modulus_kPa) {
      for (const double noise_um : asked.noise_um) {
        constexpr double kMost = 0.9;
        const double middle = needed_beads_per_um2(c, 0.5, asked.target_nN, noise_um * E);
        grid.needed.push_back({.youngs_modulus_kPa = E,
                               .noise_um = noise_um,
                               .beads_per_um2 = std::isfinite(middle) ? std::optional(middle) : std::nullopt,
                               .of_most = needed_beads_per_um2(c, kMost, asked.target_nN, noise_um * E)});
      }
    }
    std::vector<double> other = fibre_errors(c).other_nN;
    grid.model_error_nN = numerics::median_in(other);
  }
  grid.warnings = warnings_of(asked, c, scene);
  return grid;
}

}  // namespace mbtfm::plan
