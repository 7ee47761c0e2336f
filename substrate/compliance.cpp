#include "substrate/compliance.h"

#include <algorithm>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/stage/parameters.h"
#include "substrate/effects.h"
#include "substrate/loads.h"
#include "substrate/models.h"
#include "substrate/response.h"

namespace mbtfm::substrate {

Ellipse ellipse_of(const Adhesion& adhesion) {
  return {.centre_um = adhesion.position_um,
          .semi_major_um = 0.5 * adhesion.major_axis_um,
          .semi_minor_um = 0.5 * adhesion.minor_axis_um,
          .angle_rad = adhesion.angle_rad};
}

std::vector<Ellipse> ellipses_of(const std::vector<Adhesion>& adhesions) {
  std::vector<Ellipse> ellipses;
  for (const Adhesion& a : adhesions) ellipses.push_back(ellipse_of(a));
  return ellipses;
}

void declare(stage::ParameterList& list, SubstrateParameters& p) {
  list.table("substrate");
  list.add("model", p.model);
  list.add("material", p.material);
  list.add("displacement_tolerance", p.displacement_tolerance, Range::between(0, 1));
  list.add("modulus_profile", p.modulus_profile);
  list.add("margin_thicknesses", p.margin_thicknesses, Range::between(0.5, 100));
  list.add("cells_per_thickness", p.cells_per_thickness, Range::between(1, 20));
  list.add("elements_across_adhesion", p.elements_across_adhesion, Range::between(0.25, 100));
  list.add("precision", p.precision);
  list.add("growth", p.growth, Range::between(0.1, 10));
  list.add("side_distance_um", p.side_distance_um, Range::between(1e-3, 1e5));
  list.add("surface_tilt_deg", p.surface_tilt_deg, Range{.low = 0, .high = 90, .excludes_high = true});
  list.add("surface_roughness_um", p.surface_roughness_um, Range::zero_or_size_um());
  list.add("cache_folder", p.cache_folder);
  list.add("stress", p.stress);
  list.add("memory_limit_GB", p.memory_limit_GB, Range::between(0, 1e6));
}

void check_forces(const std::vector<Ellipse>& ellipses, const std::vector<Vec2>& forces_nN) {
  if (forces_nN.size() != ellipses.size()) {
    throw InvalidData("forces", "one for each of " + std::to_string(ellipses.size()) + " ellipses",
                      std::to_string(forces_nN.size()));
  }
  for (std::size_t j = 0; j < forces_nN.size(); ++j) {
    if (!is_finite(forces_nN[j])) throw InvalidData("force " + std::to_string(j), "finite numbers", "others");
  }
}

std::vector<Effect> Substrate::effects() const { return effects_of_model(parameters_, capabilities_).list(); }

MatrixXd Substrate::compliance_um_per_nN(const std::vector<Vec2>& points_um,
                                         const std::vector<Ellipse>& ellipses) const {
  return response({ellipses}, {points_um})->matrix();
}

VectorXd column_of(const std::vector<Vec2>& vectors) {
  VectorXd column(2 * static_cast<Index>(vectors.size()));
  for (std::size_t i = 0; i < vectors.size(); ++i)
    column.segment<2>(2 * static_cast<Index>(i)) << vectors[i].x, vectors[i].y;
  return column;
}

std::vector<Vec2> vectors_of(const VectorXd& column) {
  std::vector<Vec2> vectors;
  vectors.reserve(static_cast<std::size_t>(column.size() / 2));
  for (Index row = 0; row < column.size(); row += 2) vectors.push_back({column[row], column[row + 1]});
  return vectors;
}

std::vector<Vec2> Substrate::displacements_um(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses,
                                              const std::vector<Vec2>& forces_nN) const {
  check_forces(ellipses, forces_nN);
  return vectors_of(response({ellipses}, {points_um})->displace(column_of(forces_nN)));
}

std::vector<double> Substrate::vertical_um(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses,
                                           const std::vector<Vec2>& forces_nN) const {
  check_forces(ellipses, forces_nN);
  const VectorXd u = response({ellipses}, {points_um, Components::normal})->displace(column_of(forces_nN));
  return {u.begin(), u.end()};
}

bool Substrate::has_vertical() const { return asks_for_vertical(parameters_); }

std::unique_ptr<Substrate> make_from(const std::vector<Model>& table, const Gel& gel,
                                     const SubstrateParameters& parameters, int threads) {
  check(gel);
  const auto model = std::ranges::find(table, parameters.model, &Model::kind);
  if (model == table.end()) {
    std::vector<std::string> names;
    for (const Model& known : table) names.emplace_back(name_of(known.kind));
    throw UsageError("substrate.model: expected one of " + listed(names) + ", found '" + name_of(parameters.model) +
                     "'");
  }
  if (gel.poisson_ratio == 0.5 && !model->can.incompressible) {
    throw UsageError(
        "gel.poisson_ratio = 0.5: the model " + std::string(name_of(model->kind)) +
        " computes with the bulk modulus, which is infinite there: set 0.499, or take the model layer or half-space");
  }
  if (gel.surface && !model->can.surface) {
    throw UsageError("substrate.model = " + std::string(name_of(model->kind)) +
                     ": the surface given is not flat, which that model takes it for: take the model curved or auto");
  }
  return model->make(gel, without_what_is_off(parameters, effects_of_model(parameters, model->can)), threads);
}

VolumeField Substrate::volume(const std::vector<Ellipse>&, const std::vector<Vec2>&) const {
  throw UsageError("the model knows the gel's surface alone: take the model refined");
}

bool asks_for_vertical(const SubstrateParameters& parameters) {
  return parameters.effects.vertical_displacement == Switch::on;
}

double margin_um(const Gel& gel, const SubstrateParameters& parameters) {
  return parameters.side_distance_um.value_or(parameters.margin_thicknesses * gel.thickness_um);
}

}  // namespace mbtfm::substrate
