#include "samples/colonies/colony.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "continuum/sheet/mesh_size.h"
#include "continuum/sheet/parameters.h"
#include "pipeline/contract/errors.h"
#include "samples/drawing/geometry.h"
#include "samples/drawing/random.h"
#include "samples/experiment/experiment.h"
#include "substrate/compliance.h"
#include "substrate/greens/models.h"
#include "substrate/models.h"

namespace mbtfm::colonies {
namespace {

using drawing::Random;
using drawing::Stream;
using std::numbers::pi;

// streams of Stream::specimen that a cell's drawing does not use
constexpr std::uint64_t kPoses = 71, kDipoles = 72;

sheet::Scene scene_of(const Outline& outline, const sheet::SheetParameters& p) {
  sheet::Scene scene;
  scene.region.rims.emplace_back(outline.rim_um);
  for (const Polygon& border : outline.adhesive_um) scene.region.lines.emplace_back(border);
  scene.adhesive_um = outline.adhesive_um;
  scene.material = sheet::material_of(p);
  scene.contraction = {sheet::contraction_of(p), p.edge_band_um, {}};
  scene.line_tension_nN = p.line_tension_nN;
  scene.adhesion_nN_per_um3 = p.adhesion_stiffness_nN_per_um3;
  scene.measure = p.contraction_measure;
  return scene;
}

/// Contains the disc around a place.
bool has_room(const Polygon& rim, Vec2 place, double radius_um) {
  return contains(rim, place) && distance_to_boundary_um(rim, place) > radius_um;
}

std::vector<Dipole> dipoles_in(const Polygon& rim, const ColonyParameters& p, std::uint64_t seed) {
  constexpr int kMostTries = 10000;
  Random random(seed, Stream::specimen, kDipoles);
  double reach = 0;
  for (const Vec2 v : rim) reach = std::max(reach, norm(v));
  std::vector<Dipole> dipoles;
  for (int tries = 0; static_cast<int>(dipoles.size()) < p.n_dipoles; ++tries) {
    if (tries > kMostTries * p.n_dipoles)
      throw UsageError("[colony] dipole_um: there is no room for such dipoles in the colony; take smaller ones");
    const double x = random.uniform(-reach, reach), y = random.uniform(-reach, reach);
    const Vec2 arm = 0.5 * p.dipole_um * drawing::direction(random.uniform(0, pi));
    const double force = p.dipole_nN * random.normal();
    const Vec2 middle{x, y};
    if (has_room(rim, middle - arm, p.dipole_radius_um) && has_room(rim, middle + arm, p.dipole_radius_um))
      dipoles.push_back({middle, arm, force});
  }
  return dipoles;
}

Pose pose_of(const ColonyParameters& p, double field_um, std::uint64_t seed) {
  Pose pose{{0.5 * field_um, 0.5 * field_um}};
  if (p.scatter_um == 0) return pose;
  Random random(seed, Stream::specimen, kPoses);
  const double x = random.normal(), y = random.normal();
  pose.place_um += p.scatter_um * Vec2{x, y};
  pose.angle_rad = random.uniform(0, 2 * pi);
  return pose;
}

void expect_in_field(const Polygon& rim, double field_um) {
  for (const Vec2 p : rim)
    if (std::min({p.x, p.y, field_um - p.x, field_um - p.y}) < 0)
      throw UsageError("the colony reaches beyond the field of " + std::to_string(field_um) +
                       " um: ask for a smaller one, less scatter_um or a larger image_size_px");
}

}  // namespace

Vec2 Pose::vector(Vec2 v) const {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  return {c * v.x - s * v.y, s * v.x + c * v.y};
}
Vec2 Pose::back(Vec2 p) const { return Pose{{}, -angle_rad}.vector(p - place_um); }

Polygon posed(const Polygon& polygon, const Pose& pose) {
  Polygon moved;
  for (const Vec2 p : polygon) moved.push_back(pose.at(p));
  return moved;
}

std::uint64_t seed_of(const drawing::ScenarioParameters& scenario, int number) {
  return scenario.seed + static_cast<std::uint64_t>(number);
}

Contracting::Contracting(const ColonyParameters& colony, const sheet::SheetParameters& p,
                         const drawing::ScenarioParameters& scenario, const Work& work)
    : parameters_(colony), scenario_(scenario), outline_(outline_of(colony)) {
  sheet::Scene scene = scene_of(outline_, p);
  if (sheet::free_contraction(scene.material, scene.contraction.nN_per_um) > sheet::kMostContraction)
    throw UsageError("[sheet] contraction: a sheet that nothing holds would contract by more than 0.4");
  const sheet::Ground ground =
      sheet::decide_ground(p.ground, scene.material, scene.adhesion_nN_per_um3, scenario.gel).ground;
  work.tell(0.1, "contracting the sheet");
  if (ground == sheet::Ground::springs) {
    if (colony.n_dipoles > 0)
      throw UsageError("[colony] n_dipoles: expected 0 on springs, which carry none to the beads");
    scene.size = sheet::size_on_springs(scene.region,
                                        std::sqrt(scene.material.stiffness_nN_per_um() / *scene.adhesion_nN_per_um3));
    if (p.mesh_um) scene.size = sheet::with_edge(scene.size, *p.mesh_um);
    solution_ = sheet::solve_on_springs(scene, work.threads);
    return;
  }
  substrate::SubstrateParameters model;
  model.model = substrate::ModelKind::layer;
  gel_ = greens::make_greens(scenario.gel, model, work.threads);
  scene.size = sheet::size_on_gel(scene.region, scene.material, scenario.gel, scene.adhesion_nN_per_um3);
  if (p.mesh_um) scene.size = sheet::with_edge(scene.size, *p.mesh_um);
  solution_ = sheet::solve_on_gel(scene, *gel_, work.threads);
}

/// In the frame of the sheet. On springs what lies under the sheet moves with it, and nothing else does.
std::vector<Vec2> Contracting::displaced_um(const std::vector<Vec2>& points_um,
                                            const std::vector<Dipole>& dipoles) const {
  const sheet::Elements& elements = *solution_.elements;
  if (!gel_) {
    const sheet::Locator locator(elements);
    std::vector<Vec2> u;
    for (const Vec2 point : points_um) {
      const auto place = locator.find(point, 0);
      u.push_back(place ? sheet::value_of(solution_.u, elements.nodes(place->triangle),
                                          elements.shape(place->triangle, place->r, place->s))
                        : Vec2{});
    }
    return u;
  }
  std::vector<substrate::Ellipse> patches;
  std::vector<Vec2> forces;
  for (int t = 0; t < elements.n_triangles(); ++t) {
    const GroundPatch& patch = solution_.patches[t];
    if (norm(patch.traction_kPa) == 0) continue;  // where it does not adhere
    patches.push_back(sheet::patch_of(elements, t));
    forces.push_back(patch.area_um2 * patch.traction_kPa);
  }
  for (const Dipole& d : dipoles)
    for (const double side : {-1.0, 1.0}) {
      patches.push_back({d.middle_um + side * d.arm_um, parameters_.dipole_radius_um, parameters_.dipole_radius_um, 0});
      forces.push_back((-side * d.force_nN / norm(d.arm_um)) * d.arm_um);
    }
  return gel_->displacements_um(points_um, patches, forces);
}

Colony Contracting::colony(int number) const {
  drawing::ScenarioParameters own = scenario_;
  own.seed = seed_of(scenario_, number);
  const double field = drawing::field_um(own.microscope);
  Colony colony{.pose = pose_of(parameters_, field, own.seed),
                .outline_um = {},
                .adhesive_um = {},
                .dipoles = dipoles_in(outline_.rim_um, parameters_, own.seed),
                .displacement = {},
                .measured = {}};
  colony.outline_um = posed(outline_.rim_um, colony.pose);
  expect_in_field(colony.outline_um, field);
  for (const Polygon& border : outline_.adhesive_um) colony.adhesive_um.push_back(posed(border, colony.pose));
  const std::vector<Vec2> beads = experiment::place_beads(own);
  std::vector<Vec2> there;
  for (const Vec2 bead : beads) there.push_back(colony.pose.back(bead));
  const std::vector<Vec2> u = displaced_um(there, colony.dipoles);
  for (Dipole& d : colony.dipoles) {
    d.middle_um = colony.pose.at(d.middle_um);
    d.arm_um = colony.pose.vector(d.arm_um);
  }
  for (std::size_t i = 0; i < beads.size(); ++i) {
    colony.displacement.push_back(
        {.position_um = beads[i], .displacement_um = colony.pose.vector(u[i]), .sigma_um = 0, .flag = {}});
    colony.largest_displacement_um = std::max(colony.largest_displacement_um, norm(u[i]));
  }
  colony.noise_um = own.noise_um.value_or(own.noise * colony.largest_displacement_um);
  colony.measured = experiment::with_noise(colony.displacement, colony.noise_um, own.seed);
  return colony;
}

}  // namespace mbtfm::colonies
