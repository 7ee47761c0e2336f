#include "continuum/sheet/from_traction.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "continuum/sheet/recovery.h"
#include "continuum/sheet/stiffness.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::sheet {

namespace {

/// Along which axis a cut holds the sheet if it is held across.
std::size_t axis_across(const std::pair<Vec2, Vec2>& cut) {
  constexpr double kAslant = 1e-3;  // of its length: coordinates are written with some digits
  const Vec2 along = cut.second - cut.first;
  if (std::min(std::abs(along.x), std::abs(along.y)) > kAslant * norm(along))
    throw InvalidData("the outline's cut from (" + brief(cut.first.x) + ", " + brief(cut.first.y) + ") um",
                      "a piece along x or y, as the image's border runs",
                      "one to (" + brief(cut.second.x) + ", " + brief(cut.second.y) + ") um");
  return std::abs(along.x) > std::abs(along.y) ? 1 : 0;
}

/// The sheet's hold at its cuts.
struct CutHold {
  std::vector<std::array<bool, 2>> held;  ///< by node, along x and y; empty: nowhere
  std::array<bool, 2> holds{};            ///< the sheet as a whole, along x and y
  double length_um = 0;                   ///< of all cuts
  bool is_anywhere() const { return holds[0] || holds[1]; }
};

/// @param region  whose cuts run along x or along y, as an image's border does. @throws InvalidData where one does not
CutHold hold_at_cuts(const Elements& elements, const Region& region, CutEdge edge) {
  CutHold hold;
  if (region.cuts.empty() || edge == CutEdge::free) return hold;
  constexpr double kOnCut = 0.05;  // of a side: curves through the outline's points are rounded where it turns a little
  const std::vector<Vec2>& x = elements.triangles().nodes_um;
  hold.held.assign(x.size(), {false, false});
  for (const Triangles::Side& side : elements.triangles().sides) {
    if (side.curve >= std::ssize(region.rims)) continue;
    const double length = norm(x[side.nodes[1]] - x[side.nodes[0]]);
    const auto nearest = [&](int node) {
      return std::ranges::min_element(
          region.cuts, {}, [&](const auto& cut) { return distance_to_segment_um(x[node], cut.first, cut.second); });
    };
    const bool is_cut = std::ranges::all_of(side.nodes, [&](int node) {
      const auto cut = nearest(node);
      return distance_to_segment_um(x[node], cut->first, cut->second) < kOnCut * length;
    });
    if (!is_cut) continue;
    hold.length_um += length;
    const std::size_t across = axis_across(*nearest(side.nodes[2]));
    for (std::size_t axis = 0; axis < 2; ++axis) {
      if (axis != across && edge == CutEdge::held) continue;
      hold.holds[axis] = true;
      for (const int node : side.nodes) hold.held[node][axis] = true;
    }
  }
  return hold;
}

/// A part of a patch, where the sheet takes it.
struct Part {
  int triangle = 0;
  Shape shape;
  double area_um2 = 0;
  Vec2 force_nN;
};

struct Parts {
  std::vector<Part> inside;
  double all_nN = 0, outside_nN = 0;  ///< sums of magnitudes
};

/// A patch whose centre lies in the area belongs to it as a whole: a square, cut so finely that no part is larger than
/// a triangle. What of the square lies beyond the edge acts at the centre.
Parts parts_of(const std::vector<GroundPatch>& tractions, const Elements& elements) {
  constexpr int kMostCuts = 12;
  const Locator locator(elements);
  Parts parts;
  for (const GroundPatch& patch : tractions) {
    const double side = std::sqrt(patch.area_um2), force = patch.area_um2 * norm(patch.traction_kPa);
    parts.all_nN += force;
    if (force == 0) continue;
    const auto centre = locator.find(patch.position_um, 0);
    if (!centre) {
      parts.outside_nN += force;
      continue;
    }
    const double triangle = std::sqrt(elements.area_um2(centre->triangle));
    const int n = std::clamp(static_cast<int>(std::ceil(2 * side / triangle)), 1, kMostCuts);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const Vec2 at = patch.position_um + side * Vec2{(i + 0.5) / n - 0.5, (j + 0.5) / n - 0.5};
        const Locator::Place place = locator.find(at, 0).value_or(*centre);
        const double area = patch.area_um2 / (n * n);
        parts.inside.push_back(
            {place.triangle, elements.shape(place.triangle, place.r, place.s), area, area * patch.traction_kPa});
      }
  }
  return parts;
}

/// Takes off the net force and torque that nothing carries. @param hold  at cuts. @returns what was there
Unbalanced balance(Parts& parts, const CutHold& hold) {
  Vec2 centre, net;
  double area = 0, sum = 0;
  for (const Part& part : parts.inside) {
    centre += part.area_um2 * part.shape.place_um;
    area += part.area_um2;
    net += part.force_nN;
    sum += norm(part.force_nN);
  }
  centre = 1 / area * centre;
  double torque = 0, largest = 0, inertia = 0;
  for (const Part& part : parts.inside) {
    const Vec2 arm = part.shape.place_um - centre;
    torque += cross(arm, part.force_nN);
    largest += norm(arm) * norm(part.force_nN);
    inertia += part.area_um2 * dot(arm, arm);
  }
  if (hold.holds[0]) net.x = 0;
  if (hold.holds[1]) net.y = 0;
  if (hold.is_anywhere()) torque = 0;  // a line that may not move across carries a torque, too
  for (Part& part : parts.inside) {
    const Vec2 arm = part.shape.place_um - centre;
    part.force_nN = part.force_nN - part.area_um2 * (1 / area * net + torque / inertia * Vec2{-arm.y, arm.x});
  }
  return {norm(net) / sum, std::abs(torque) / largest, parts.outside_nN / parts.all_nN};
}

/// With what the cuts leave free of the sheet's motions as a whole held at one node or two, which takes no force.
std::vector<std::array<bool, 2>> held_nodes(const CutHold& hold, const Elements& elements) {
  if (!hold.is_anywhere()) return pins(elements);
  std::vector<std::array<bool, 2>> held = hold.held;
  for (std::size_t axis = 0; axis < 2; ++axis)
    if (!hold.holds[axis]) held.front()[axis] = true;
  return held;
}

std::vector<GroundPatch> patches_of(const Parts& parts, const Elements& elements) {
  std::vector<GroundPatch> patches(static_cast<std::size_t>(elements.n_triangles()));
  std::vector<Vec2> forces(patches.size()), places(patches.size());
  std::vector<int> counts(patches.size());
  for (const Part& part : parts.inside) {
    const auto t = static_cast<std::size_t>(part.triangle);
    forces[t] += part.force_nN;
    places[t] += part.shape.place_um;
    ++counts[t];
  }
  for (std::size_t t = 0; t < patches.size(); ++t) {
    patches[t].area_um2 = elements.area_um2(static_cast<int>(t));
    patches[t].position_um = counts[t] > 0 ? 1.0 / counts[t] * places[t] : elements.at(static_cast<int>(t), 0).place_um;
    patches[t].traction_kPa = 1 / patches[t].area_um2 * forces[t];
  }
  return patches;
}

/// What holds the sheet, on the nodes.
NodeVectors reactions_nN(const Solution& solution, const NodeVectors& load, const CutHold& hold) {
  NodeVectors reactions = NodeVectors::Zero(load.size());
  if (!hold.is_anywhere()) return reactions;
  const Elements& elements = *solution.elements;
  for (int t = 0; t < elements.n_triangles(); ++t) {
    Eigen::Matrix<double, 12, 1> u;
    for (int i = 0; i < 6; ++i) u.segment<2>(2 * i) = solution.u.segment<2>(2 * elements.nodes(t)[i]);
    const Eigen::Matrix<double, 12, 1> inside = elastic_stiffness(elements, t, solution.sheet.material) * u;
    for (int i = 0; i < 6; ++i) reactions.segment<2>(2 * elements.nodes(t)[i]) += inside.segment<2>(2 * i);
  }
  return reactions - load;
}

/// As balance_of(), of the parts themselves and what holds the sheet: exact.
Balance balance_of_parts(const Parts& parts, const Solution& solution, const NodeVectors& reactions) {
  Balance result = balance_of(solution);
  result.net_force_nN = {};
  result.net_torque_nN_um = result.total_force_nN = result.largest_torque_nN_um = 0;
  double virial = 0;
  for (const Part& part : parts.inside) {
    result.total_force_nN += norm(part.force_nN);
    result.net_force_nN += part.force_nN;
    result.net_torque_nN_um += cross(part.shape.place_um, part.force_nN);
    result.largest_torque_nN_um += norm(part.shape.place_um) * norm(part.force_nN);
    virial += dot(part.shape.place_um, part.force_nN);
  }
  for (int i = 0; i < solution.elements->n_nodes(); ++i)
    virial -= dot(solution.elements->triangles().nodes_um[i], at_node(reactions, i));
  result.virial_tension_nN_per_um = -virial / (2 * result.area_um2);
  return result;
}

NodeVectors load_of(const Parts& parts, const Elements& elements) {
  NodeVectors load = NodeVectors::Zero(2 * elements.n_nodes());
  for (const Part& part : parts.inside)
    for (std::size_t i = 0; i < 6; ++i) {
      const int node = elements.nodes(part.triangle)[i];
      load(2 * node) -= part.shape.value[i] * part.force_nN.x;
      load(2 * node + 1) -= part.shape.value[i] * part.force_nN.y;
    }
  return load;
}

/// Squares of the correlation's side each draw an error; net force and torque are taken off as of the tractions.
TensionErrors errors_by(const TractionNoise& noise, Parts parts, const Solution& solution, const Stiffness& stiffness,
                        const CutHold& hold) {
  const Elements& elements = *solution.elements;
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0, noise.sigma_kPa);
  TensionErrors errors;
  std::vector<double> squares(static_cast<std::size_t>(elements.n_triangles()));
  MatrixXd loads(2 * elements.n_nodes(), TensionErrors::kDraws);
  for (int draw = 0; draw < TensionErrors::kDraws; ++draw) {
    std::map<std::pair<long, long>, Vec2> by_square;
    for (Part& part : parts.inside) {
      const Vec2 at = 1 / noise.correlation_um * part.shape.place_um;
      const auto [square, is_new] = by_square.try_emplace({std::lround(at.x), std::lround(at.y)});
      if (is_new) {
        square->second.x = normal(random);
        square->second.y = normal(random);
      }
      part.force_nN = part.area_um2 * square->second;
    }
    balance(parts, hold);
    loads.col(draw) = load_of(parts, elements);
  }
  const MatrixXd u = stiffness.solve(loads);
  for (int draw = 0; draw < TensionErrors::kDraws; ++draw) {
    const std::vector<Tensor> S = tension_at_points(elements, solution.sheet, u.col(draw));
    errors.mean_nN_per_um += std::pow(mean_of(mean_over(elements, S)), 2) / TensionErrors::kDraws;
    for (int t = 0; t < elements.n_triangles(); ++t) {
      double mean = 0;
      for (int p = 0; p < Elements::kPoints; ++p) mean += mean_of(S[Elements::kPoints * t + p]) / Elements::kPoints;
      squares[t] += mean * mean / TensionErrors::kDraws;
    }
  }
  errors.mean_nN_per_um = std::sqrt(errors.mean_nN_per_um);
  for (const double square : squares) errors.by_triangle.push_back(std::sqrt(square));
  return errors;
}

}  // namespace

FromTraction tensions_from(const std::vector<GroundPatch>& tractions, const Region& region, const Material& material,
                           const TriangleSize& size, int threads, double most_unbalanced,
                           const std::optional<TractionNoise>& noise, CutEdge at_cuts) {
  constexpr std::size_t kMostTriangles = 200000;
  FromTraction result;
  Solution& solution = result.solution;
  solution.elements = std::make_shared<const Elements>(triangulated(region, size, kMostTriangles));
  const Elements& elements = *solution.elements;
  Parts parts = parts_of(tractions, elements);
  if (parts.inside.empty())
    throw InputError("the tractions", "some inside of the outline", "none",
                     "outline and tractions must have one origin");
  const CutHold hold = hold_at_cuts(elements, region, at_cuts);
  result.unbalanced = balance(parts, hold);
  const double worst = std::max(result.unbalanced.net_force_share, result.unbalanced.net_torque_share);
  if (worst > most_unbalanced)
    throw InputError("the tractions inside of the outline",
                     "a net force and torque below " + brief(most_unbalanced) + " of what the forces could add up to",
                     "a net force of " + brief(result.unbalanced.net_force_share) + " and a net torque of " +
                         brief(result.unbalanced.net_torque_share),
                     "give an --area that holds the whole colony and all of its forces; if the tractions do not lie on "
                     "another field, sheet.most_unbalanced lets more be taken off");
  solution.sheet.material = material;
  solution.sheet.contraction_nN_per_um = even(elements, 0);
  solution.sheet.n_rims = static_cast<int>(region.rims.size());
  Stiffness stiffness(elements, held_nodes(hold, elements));
  for (int t = 0; t < elements.n_triangles(); ++t) stiffness.add(t, elastic_stiffness(elements, t, material));
  const bool is_definite = stiffness.factorise(0, threads);
  MBTFM_ASSERT(is_definite);
  const NodeVectors load = load_of(parts, elements);
  solution.u = stiffness.solve(load);
  solution.report = {.converged = true, .iterations = 1, .last_change = 0, .reason = "one linear solve"};
  solution.at_points = tension_at_points(elements, solution.sheet, solution.u);
  solution.at_nodes = recovered(elements, solution.at_points);
  solution.patches = patches_of(parts, elements);
  const NodeVectors reactions = reactions_nN(solution, load, hold);
  result.balance = balance_of_parts(parts, solution, reactions);
  if (hold.is_anywhere()) {
    result.cut = {.force_nN = {}, .length_um = hold.length_um};
    for (int i = 0; i < elements.n_nodes(); ++i) result.cut->force_nN += at_node(reactions, i);
  }
  if (noise) result.errors = errors_by(*noise, parts, solution, stiffness, hold);
  return result;
}

TensionFigures figures_inside(const Solution& solution, const Polygon& outline_um) {
  TensionFigures figures;
  double sum = 0, squares = 0, shear = 0;
  solution.elements->for_each_point([&](int t, int p, const Shape& shape) {
    if (!contains(outline_um, shape.place_um)) return;
    const Tensor& S = solution.at_points[Elements::kPoints * t + p];
    figures.area_um2 += shape.weight_um2;
    sum += shape.weight_um2 * mean_of(S);
    squares += shape.weight_um2 * mean_of(S) * mean_of(S);
    shear += shape.weight_um2 * S.xy;
  });
  if (figures.area_um2 == 0) return figures;
  figures.mean_nN_per_um = sum / figures.area_um2;
  const double variance = squares / figures.area_um2 - figures.mean_nN_per_um * figures.mean_nN_per_um;
  figures.variation = std::sqrt(std::max(0.0, variance)) / std::abs(figures.mean_nN_per_um);
  figures.shear_nN_per_um = shear / figures.area_um2;
  return figures;
}

double reach_of_cuts_um(const Solution& a, const Solution& b, const Cuts& cuts, double difference_nN_per_um) {
  double reach = 0;
  a.elements->for_each_point([&](int t, int p, const Shape& shape) {
    const auto k = static_cast<std::size_t>(Elements::kPoints * t + p);
    if (std::abs(mean_of(a.at_points[k]) - mean_of(b.at_points[k])) <= difference_nN_per_um) return;
    double distance = std::numeric_limits<double>::infinity();
    for (const auto& [from, to] : cuts) distance = std::min(distance, distance_to_segment_um(shape.place_um, from, to));
    reach = std::max(reach, distance);
  });
  return reach;
}

}  // namespace mbtfm::sheet
