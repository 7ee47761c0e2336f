#include "continuum/sheet/forward.h"

#include <algorithm>
#include <limits>
#include <map>

#include "continuum/sheet/mesh_size.h"
#include "continuum/sheet/patches.h"
#include "continuum/sheet/recovery.h"
#include "continuum/sheet/stiffness.h"
#include "pipeline/contract/errors.h"

namespace mbtfm::sheet {

namespace {

Solution prepared(std::shared_ptr<const Elements> elements, const Scene& scene) {
  Solution solution;
  solution.elements = std::move(elements);
  Sheet& sheet = solution.sheet;
  sheet.material = scene.material;
  sheet.contraction_nN_per_um = contraction_at_points(*solution.elements, scene.region, scene.contraction);
  sheet.line_tension_nN = scene.line_tension_nN;
  sheet.n_rims = static_cast<int>(scene.region.rims.size());
  return solution;
}

/// Length of the rims, and what the line's pull adds to Σ x · F.
double rim_length_um(const Elements& elements, int n_rims) {
  double length = 0;
  const std::vector<Vec2>& x = elements.triangles().nodes_um;
  for (const Triangles::Side& side : elements.triangles().sides) {
    if (side.curve >= n_rims) continue;
    for (const double q : {-0.7745966692414834, 0.0, 0.7745966692414834}) {
      const Vec2 along = (q - 0.5) * x[side.nodes[0]] + (q + 0.5) * x[side.nodes[1]] + (-2 * q) * x[side.nodes[2]];
      length += (q == 0 ? 8.0 : 5.0) / 9 * norm(along);
    }
  }
  return length;
}

NodeVectors load_of(const Solution& solution) {
  NodeVectors load = forces_of_contraction_nN(*solution.elements, solution.sheet);
  for (const TautBundle& taut : solution.bundles)
    load += taut.tension_nN * forces_of_bundle_nN(*solution.elements, taut.bundle);
  return load;
}

/// @param solution  prepared
Solution solved_on(const OnGel& ground, Solution solution, const Scene& scene) {
  const Elements& elements = *solution.elements;
  for (const TautBundle& taut : scene.bundles)  // each mesh ends a little elsewhere
    solution.bundles.push_back({within(elements, {taut.bundle}).front(), taut.tension_nN});
  solution.strain = scene.strain;
  const bool is_large = scene.strain == Strain::large;
  MBTFM_ASSERT(!is_large || scene.bundles.empty());
  OnGel::Solution found = is_large ? ground.solve_large(solution.sheet, scene.measure, scene.adhesion_nN_per_um3)
                                   : ground.solve(scene.material, scene.adhesion_nN_per_um3, load_of(solution));
  solution.u = std::move(found.u);
  solution.report = found.report;
  solution.gel_held = ground.held();
  solution.at_points = is_large ? large_tension_at_points(elements, solution.sheet, scene.measure, solution.u)
                                : tension_at_points(elements, solution.sheet, solution.u);
  solution.at_nodes = recovered(elements, solution.at_points);
  for (int t = 0; t < elements.n_triangles(); ++t)
    solution.patches.push_back({patch_of(elements, t).centre_um, elements.area_um2(t), {}, {}});
  const VectorXd gel_um = ground.gel_um(found.forces_nN);
  for (std::size_t k = 0; k < ground.triangles().size(); ++k) {
    GroundPatch& patch = solution.patches[ground.triangles()[k]];
    patch.traction_kPa = 1 / patch.area_um2 * at_node(found.forces_nN, static_cast<int>(k));
    patch.displacement_um = at_node(gel_um, static_cast<int>(k));
  }
  return solution;
}

}  // namespace

std::shared_ptr<const Elements> elements_of(const Scene& scene) {
  constexpr std::size_t kMostTriangles = 200000;  // 2 GB of a factor
  return std::make_shared<const Elements>(triangulated(scene.region, scene.size, kMostTriangles));
}

std::vector<double> contraction_at_points(const Elements& elements, const Region& region,
                                          const Contraction& contraction) {
  std::vector<double> s = even(elements, contraction.nN_per_um);
  if (contraction.at)
    elements.for_each_point(
        [&](int t, int p, const Shape& shape) { s[Elements::kPoints * t + p] = contraction.at(shape.place_um); });
  if (!contraction.edge_band_um) return s;
  elements.for_each_point([&](int t, int p, const Shape& shape) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Curve& rim : region.rims)
      nearest = std::min(nearest, distance_to_boundary_um(rim.points_um(), shape.place_um));
    if (nearest > *contraction.edge_band_um) s[Elements::kPoints * t + p] = 0;
  });
  return s;
}

std::vector<int> adhering_triangles(const Elements& elements, const std::vector<Polygon>& adhesive_um) {
  std::vector<int> adhering;
  for (int t = 0; t < elements.n_triangles(); ++t) {
    const Vec2 centre = patch_of(elements, t).centre_um;
    const auto n_around = std::ranges::count_if(adhesive_um, [&](const Polygon& p) { return contains(p, centre); });
    if (adhesive_um.empty() || n_around % 2 == 1) adhering.push_back(t);
  }
  return adhering;
}

Solution solve_on_springs(const Scene& scene, int threads) {
  Solution solution = prepared(elements_of(scene), scene);
  solution.strain = scene.strain;
  const Elements& elements = *solution.elements;
  solution.sheet.spring_nN_per_um3 = even(elements, 0);
  for (const int t : adhering_triangles(elements, scene.adhesive_um))
    std::fill_n(solution.sheet.spring_nN_per_um3.begin() + Elements::kPoints * t, Elements::kPoints,
                scene.adhesion_nN_per_um3.value_or(0));
  if (scene.strain == Strain::large) {
    LargeStrain large = on_springs_large(elements, solution.sheet, scene.measure, threads);
    solution.u = std::move(large.u);
    solution.report = large.report;
    solution.at_points = large_tension_at_points(elements, solution.sheet, scene.measure, solution.u);
  } else {
    solution.u = on_springs(elements, solution.sheet, threads);
    solution.report = {.converged = true, .iterations = 1, .last_change = 0, .reason = "one linear solve"};
    solution.at_points = tension_at_points(elements, solution.sheet, solution.u);
  }
  solution.at_nodes = scene.strain == Strain::large ? recovered(elements, solution.at_points)
                                                    : recovered(elements, solution.at_points,
                                                                known_on_springs(elements, solution.sheet, solution.u));
  for (int t = 0; t < elements.n_triangles(); ++t) {
    GroundPatch patch;
    for (int p = 0; p < Elements::kPoints; ++p) {
      const Shape& shape = elements.at(t, p);
      patch.area_um2 += shape.weight_um2;
      patch.position_um += shape.weight_um2 * shape.place_um;
      patch.displacement_um += shape.weight_um2 * value_of(solution.u, elements.nodes(t), shape);
    }
    patch.position_um = 1 / patch.area_um2 * patch.position_um;
    patch.displacement_um = 1 / patch.area_um2 * patch.displacement_um;
    patch.traction_kPa = solution.sheet.spring_nN_per_um3[Elements::kPoints * t] * patch.displacement_um;
    solution.patches.push_back(patch);
  }
  return solution;
}

Solution solve_on(const OnGel& ground, std::shared_ptr<const Elements> triangles, const Scene& scene) {
  return solved_on(ground, prepared(std::move(triangles), scene), scene);
}

Solution solve_on_gel(const Scene& scene, const substrate::Substrate& gel, int threads) {
  const std::shared_ptr<const Elements> elements = elements_of(scene);
  const std::optional<Held> held = scene.strain == Strain::large ? std::optional(Held::dense) : std::nullopt;
  return solve_on(OnGel(*elements, gel, adhering_triangles(*elements, scene.adhesive_um), threads, held), elements,
                  scene);
}

std::vector<Vec2> displacements_um(const substrate::Substrate& gel, const Solution& solution,
                                   const std::vector<Vec2>& points_um) {
  std::vector<substrate::Ellipse> patches;
  std::vector<Vec2> forces;
  for (int t = 0; t < solution.elements->n_triangles(); ++t) {
    patches.push_back(patch_of(*solution.elements, t));
    const GroundPatch& patch = solution.patches[t];
    forces.push_back(patch.area_um2 * patch.traction_kPa);
  }
  return gel.displacements_um(points_um, patches, forces);
}

VectorXd as_vector(const std::vector<Vec2>& u) {
  VectorXd all(2 * std::ssize(u));
  for (std::size_t i = 0; i < u.size(); ++i) all.segment<2>(2 * static_cast<Index>(i)) << u[i].x, u[i].y;
  return all;
}

namespace {

Scene on_finer_triangles(Scene scene, double share) {
  scene.size = with_edge(scene.size, share * scene.size.at_curves_um);
  return scene;
}

}  // namespace

FinerMesh::FinerMesh(const Scene& scene, double share, const substrate::Substrate& gel, int threads)
    : gel_(gel),
      elements_(elements_of(on_finer_triangles(scene, share))),
      ground_(*elements_, gel, adhering_triangles(*elements_, scene.adhesive_um), threads) {}

VectorXd FinerMesh::displacements_um(const Scene& scene, const std::vector<Vec2>& points_um) const {
  MBTFM_ASSERT(scene.strain == Strain::small);
  return as_vector(sheet::displacements_um(gel_, solve_on(ground_, elements_, scene), points_um));
}

MatrixXd changes_by_outline_um(const Scene& scene, const Solution& solution, const substrate::Substrate& gel,
                               const std::vector<Vec2>& points_um, double error_um, int threads) {
  Solution larger;
  larger.elements =
      std::make_shared<const Elements>(with_rims_further_out(*solution.elements, solution.sheet.n_rims, error_um));
  larger.sheet = solution.sheet;
  const OnGel ground(*larger.elements, gel, adhering_triangles(*solution.elements, scene.adhesive_um), threads);
  larger = solved_on(ground, std::move(larger), scene);
  const auto seen_from = [&](Vec2 shift_um) {
    std::vector<Vec2> places = points_um;
    for (Vec2& place : places) place = place - shift_um;
    return as_vector(displacements_um(gel, solution, places));
  };
  const VectorXd here = seen_from({});
  MatrixXd changes(here.size(), 3);
  changes << as_vector(displacements_um(gel, larger, points_um)) - here, seen_from({error_um, 0}) - here,
      seen_from({0, error_um}) - here;
  return changes;
}

Balance balance_of(const Solution& solution) {
  Balance balance;
  const Elements& elements = *solution.elements;
  Vec2 centre;
  for (const GroundPatch& patch : solution.patches) {
    balance.area_um2 += patch.area_um2;
    centre += patch.area_um2 * patch.position_um;
  }
  centre = 1 / balance.area_um2 * centre;
  double virial = 0;
  for (const GroundPatch& patch : solution.patches) {
    const Vec2 force = patch.area_um2 * patch.traction_kPa, arm = patch.position_um - centre;
    // of large strains the sheet is in balance where it has moved to; springs lengthen along their forces
    const Vec2 moved = solution.strain == Strain::large ? patch.displacement_um : Vec2{};
    balance.total_force_nN += norm(force);
    balance.net_force_nN += force;
    balance.net_torque_nN_um += cross(arm + moved, force);
    balance.largest_torque_nN_um += norm(arm) * norm(force);
    virial += dot(arm, force);
    balance.ground_energy_fJ += 0.5 * dot(force, patch.displacement_um);
  }
  balance.mean_tension_nN_per_um = mean_of(mean_over(elements, solution.at_points));
  virial += solution.sheet.line_tension_nN * rim_length_um(elements, solution.sheet.n_rims);
  for (const TautBundle& taut : solution.bundles) virial += taut.tension_nN * length_um(taut.bundle.points_um);
  balance.virial_tension_nN_per_um = -virial / (2 * balance.area_um2);
  balance.elastic_energy_fJ = 0.5 * solution.u.dot(load_of(solution));
  return balance;
}

NodeVectors on_springs(const Elements& elements, const Sheet& sheet, int threads) {
  Stiffness stiffness(elements, sheet.held);
  for (int t = 0; t < elements.n_triangles(); ++t)
    stiffness.add(t, elastic_stiffness(elements, t, sheet.material) +
                         spring_stiffness(elements, t, sheet.spring_nN_per_um3.data() + Elements::kPoints * t));
  if (!stiffness.factorise(0, threads))
    throw NotSolved({.reason = "nothing holds the sheet: its springs have no stiffness"});
  return stiffness.solve(forces_of_contraction_nN(elements, sheet));
}

LargeStrain on_springs_large(const Elements& elements, const Sheet& sheet, ContractionMeasure measure, int threads) {
  const LargeSheet large(elements, sheet, measure);
  Stiffness stiffness(elements, sheet.held);
  const LoadedSheet loaded{
      .energy_fJ = [&](const NodeVectors& u, double share) { return large.energy_fJ(u, share); },
      .left_nN = [&](const NodeVectors& u, double share) { return large.left_nN(u, share); },
      .move = [&](const NodeVectors& u, double share, const NodeVectors& left) -> std::optional<NodeVectors> {
        stiffness.set_zero();
        large.add_to(stiffness, u, share);
        if (!factorise_shifted(stiffness, threads)) return std::nullopt;
        return stiffness.solve(left);
      },
      .force_scale_nN = forces_of_contraction_nN(elements, sheet).norm()};
  return in_load_steps(loaded, 2 * elements.n_nodes());
}

namespace {

/// Away from the sheet, of unit length, at the begin, the end and the middle of a side.
std::array<Vec2, 3> normals_of(const Elements& elements, const Triangles::Side& side) {
  const auto node = [&](int k) { return elements.triangles().nodes_um[side.nodes[k]]; };
  const Vec2 begin = node(0), end = node(1), between = node(2);
  // derivatives of the parabola through the three
  const std::array<Vec2, 3> along = {-1.5 * begin - 0.5 * end + 2 * between, 0.5 * begin + 1.5 * end - 2 * between,
                                     0.5 * (end - begin)};
  std::array<Vec2, 3> normals;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2 right{along[k].y,
                     -along[k].x};  // curves turn from +x towards +y: the outer one has the sheet on its left
    normals[k] = (side.curve == 0 ? 1.0 : -1.0) / norm(right) * right;
  }
  return normals;
}

/// By node of the rims. At a corner both sides move by this much, so it moves by more.
std::map<int, Vec2> moves_of_rims(const Elements& elements, int n_rims, double outward_um) {
  std::map<int, std::vector<Vec2>> normals;
  for (const Triangles::Side& side : elements.triangles().sides) {
    if (side.curve >= n_rims) continue;
    const std::array<Vec2, 3> of_side = normals_of(elements, side);
    for (std::size_t k = 0; k < 3; ++k) normals[side.nodes[k]].push_back(of_side[k]);
  }
  constexpr double kSharpest = 0.5;  // a spike's tip moves no further than four times as much
  std::map<int, Vec2> moves;
  for (const auto& [node, at] : normals) {
    const Vec2 first = at.front(), last = at.back();
    moves[node] = outward_um / std::max(kSharpest, 1 + dot(first, last)) * (first + last);
  }
  return moves;
}

}  // namespace

Elements with_rims_further_out(const Elements& elements, int n_rims, double outward_um) {
  const std::map<int, Vec2> moves = moves_of_rims(elements, n_rims, outward_um);
  std::vector<std::array<bool, 2>> held(static_cast<std::size_t>(elements.n_nodes()), {false, false});
  NodeVectors move = NodeVectors::Zero(2 * elements.n_nodes());
  for (const auto& [node, by_um] : moves) {
    held[node] = {true, true};
    move.segment<2>(2 * node) << by_um.x, by_um.y;
  }
  Stiffness stiffness(elements, std::move(held));
  NodeVectors pulled = NodeVectors::Zero(move.size());
  for (int t = 0; t < elements.n_triangles(); ++t) {
    const Stiffness::OfElement K =
        elastic_stiffness(elements, t, {.youngs_modulus_kPa = 1, .poisson_ratio = 0, .thickness_um = 1});
    stiffness.add(t, K);
    Eigen::Matrix<double, 12, 1> of_nodes;
    for (int i = 0; i < 6; ++i) of_nodes.segment<2>(2 * i) = move.segment<2>(2 * elements.nodes(t)[i]);
    const Eigen::Matrix<double, 12, 1> forces = K * of_nodes;
    for (int i = 0; i < 6; ++i) pulled.segment<2>(2 * elements.nodes(t)[i]) -= forces.segment<2>(2 * i);
  }
  const bool is_definite = stiffness.factorise();
  MBTFM_ASSERT(is_definite);
  move += stiffness.solve(pulled);
  Triangles moved = elements.triangles();
  for (int i = 0; i < elements.n_nodes(); ++i) moved.nodes_um[i] += at_node(move, i);
  return Elements(std::move(moved));
}

}  // namespace mbtfm::sheet
