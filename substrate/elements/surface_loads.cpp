#include "substrate/elements/surface_loads.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/numerics/quadrature.h"
#include "substrate/elements/ellipse_load.h"
#include "substrate/ellipse.h"

namespace mbtfm::elements {
namespace {

Extent rectangle_of(const substrate::Square& square) {
  const Vec2 half = {0.5 * square.side_um, 0.5 * square.side_um};
  return {square.centre_um - half, square.centre_um + half};
}

/// @throws InvalidData where it is no rectangle along the axes
Extent rectangle_of(const substrate::SurfaceMesh& mesh, const std::array<int, 4>& face) {
  const Extent r = extent_of(face, [&](int corner) { return mesh.points_um.at(corner); });
  const double size = std::max(r.high_um.x - r.low_um.x, r.high_um.y - r.low_um.y);
  const auto is_end = [size](double low, double high, double x) {
    return std::min(std::abs(x - low), std::abs(x - high)) <= 1e-9 * size;
  };
  int corners = 0;  // each met once
  for (const int corner : face) {
    const Vec2 p = mesh.points_um[corner];
    if (!is_end(r.low_um.x, r.high_um.x, p.x) || !is_end(r.low_um.y, r.high_um.y, p.y)) continue;
    corners |= 1 << ((p.x - r.low_um.x > 0.5 * (r.high_um.x - r.low_um.x)) +
                     2 * (p.y - r.low_um.y > 0.5 * (r.high_um.y - r.low_um.y)));
  }
  if (corners == 0b1111) return r;
  throw InvalidData("a quad of the surface at (" + brief(r.low_um.x) + ", " + brief(r.low_um.y) + ") um",
                    "a rectangle along x and y, seen from above", "another shape");
}

/// Sums forces on nodes, by cell of the surface that a rectangle overlaps.
class Sum {
 public:
  Sum(const Block& block, const Space& space) : block_(block), space_(space) {}

  /// At a place within a cell of the surface: so much of a unit force.
  void add(int cell, Vec2 unit, double force) {
    const Shapes shapes = shapes_at({unit.x, unit.y, 0});
    for (int k = 0; k < kNodes; ++k) {
      if (shapes[k] != 0) at_nodes_.push_back({block_.mesh().nodes_of(cell)[k], force * shapes[k]});
    }
    total_ += force;
  }

  /// The integral of a function over a rectangle of the surface. @return its area, seen from above
  template <class Function>
  double integrate(const Extent& over, const Function& function) {
    constexpr int kPoints = 4;
    const numerics::GaussRule gauss = numerics::gauss_legendre(kPoints);
    double covered = 0;
    for (const int cell : block_.mesh().surface_cells) {
      const Box& box = block_.boxes().cells[cell];
      const Vec2 low = {std::max(over.low_um.x, box.low_um[0]), std::max(over.low_um.y, box.low_um[1])};
      const Vec2 high = {std::min(over.high_um.x, box.low_um[0] + box.size_um[0]),
                         std::min(over.high_um.y, box.low_um[1] + box.size_um[1])};
      if (low.x >= high.x || low.y >= high.y) continue;
      covered += (high.x - low.x) * (high.y - low.y);
      const NodePositions nodes = block_.mesh().positions_of(cell);
      const double share = (high.x - low.x) * (high.y - low.y) / (box.size_um[0] * box.size_um[1]);
      for (int k = 0; k < kPoints * kPoints; ++k) {
        const int i = k % kPoints, j = k / kPoints;
        const Vec2 at = {low.x + 0.5 * (1 + gauss.nodes[i]) * (high.x - low.x),
                         low.y + 0.5 * (1 + gauss.nodes[j]) * (high.y - low.y)};
        const Vec2 unit = {(at.x - box.low_um[0]) / box.size_um[0], (at.y - box.low_um[1]) / box.size_um[1]};
        const double area =
            0.25 * gauss.weights[i] * gauss.weights[j] * share * face_point(nodes, unit.x, unit.y).area_um2.norm();
        add(cell, unit, area * function(at));
      }
    }
    return covered;
  }

  double total() const { return total_; }
  /// Each times a factor.
  std::vector<NodeWeight> on_free_nodes(double factor) const {
    std::vector<NodeWeight> weights = space_.nodes().on_free_nodes(at_nodes_);
    for (NodeWeight& w : weights) w.weight *= factor;
    return weights;
  }

 private:
  const Block& block_;
  const Space& space_;
  std::vector<NodeWeight> at_nodes_;
  double total_ = 0;
};

void require_inside(const Block& block, bool is_inside, Vec2 at) {
  if (is_inside) return;
  throw InvalidData("the load at (" + brief(at.x) + ", " + brief(at.y) + ") um",
                    "all of it on the gel's block, " + block.boxes().extent(), "a part of it outside");
}

Extent face_of(const Box& box) {
  const Vec2 low = {box.low_um[0], box.low_um[1]};
  return {low, low + Vec2{box.size_um[0], box.size_um[1]}};
}

/// Spread evenly over the area of the surface within the ellipse, seen from above.
std::vector<NodeWeight> ellipse_weights(const Block& block, const Space& space, const substrate::Ellipse& ellipse) {
  Sum sum(block, space);
  double share = 0;
  for (const int cell : touched_cells(block, ellipse)) {
    const Extent face = face_of(block.boxes().cells[cell]);
    const Vec2 size = face.high_um - face.low_um;
    const NodePositions nodes = block.mesh().positions_of(cell);
    for (const substrate::DiscPoint& p : clipped_ellipse_rule(ellipse, face)) {
      const Vec2 unit = {(p.position.x - face.low_um.x) / size.x, (p.position.y - face.low_um.y) / size.y};
      const double stretch = face_point(nodes, unit.x, unit.y).area_um2.norm() / (size.x * size.y);
      sum.add(cell, unit, p.weight * stretch);
      share += p.weight;
    }
  }
  require_inside(block, std::abs(share - 1) < 1e-9, ellipse.centre_um);  // the rules add up to rounding
  return sum.on_free_nodes(1 / sum.total());
}

std::vector<NodeWeight> square_weights(const Block& block, const Space& space, const substrate::Square& square) {
  Sum sum(block, space);
  const double covered = sum.integrate(rectangle_of(square), [](Vec2) { return 1.0; });
  require_inside(block, std::abs(covered / (square.side_um * square.side_um) - 1) < 1e-9, square.centre_um);
  return sum.on_free_nodes(1);
}

WeightedNodes vertex_weights(const Block& block, const Space& space, const substrate::SurfaceMesh& mesh) {
  std::vector<Sum> sums(mesh.points_um.size(), Sum(block, space));
  for (const std::array<int, 4>& face : mesh.faces) {
    const Extent r = rectangle_of(mesh, face);
    const Vec2 size = r.high_um - r.low_um;
    for (const int corner : face) {
      const Vec2 at = mesh.points_um[corner];
      const double covered = sums[corner].integrate(
          r, [&](Vec2 p) { return (1 - std::abs(p.x - at.x) / size.x) * (1 - std::abs(p.y - at.y) / size.y); });
      require_inside(block, std::abs(covered / (size.x * size.y) - 1) < 1e-9, at);
    }
  }
  WeightedNodes weights;
  for (const Sum& sum : sums) weights.push_back(sum.on_free_nodes(1));
  return weights;
}

}  // namespace

std::vector<Target> targets_of(const substrate::Loads& loads, double across) {
  std::vector<Target> targets;
  if (const auto* ellipses = std::get_if<std::vector<substrate::Ellipse>>(&loads.shapes)) {
    check(*ellipses);
    for (const substrate::Ellipse& e : *ellipses) {
      const Vec2 half = substrate::half_extent_um(e);
      const double size = std::sqrt(std::numbers::pi * e.semi_major_um * e.semi_minor_um);
      targets.push_back({e.centre_um - half, e.centre_um + half, size / across});
    }
  } else if (const auto* squares = std::get_if<std::vector<substrate::Square>>(&loads.shapes)) {
    for (const substrate::Square& s : *squares) {
      const Extent r = rectangle_of(s);
      targets.push_back({r.low_um, r.high_um, s.side_um / across});
    }
  } else if (const auto* mesh = std::get_if<substrate::SurfaceMesh>(&loads.shapes)) {
    for (const auto& face : mesh->faces) {
      const Extent r = rectangle_of(*mesh, face);
      const Vec2 size = r.high_um - r.low_um;
      constexpr double kFaces = 2;  // bilinear over each and without a rim, tractions are smooth over two
      targets.push_back({r.low_um, r.high_um, kFaces * std::min(size.x, size.y) / across});
    }
  } else {
    throw UsageError("waves of traction have no end: the model curved takes ellipses, squares and quads");
  }
  return targets;
}

std::vector<int> touched_cells(const Block& block, const substrate::Ellipse& ellipse) {
  const Vec2 half = substrate::half_extent_um(ellipse), low = ellipse.centre_um - half, high = ellipse.centre_um + half;
  std::vector<int> touched;
  for (const int cell : block.mesh().surface_cells) {
    const Extent face = face_of(block.boxes().cells[cell]);
    if (face.low_um.x > high.x || face.high_um.x < low.x || face.low_um.y > high.y || face.high_um.y < low.y) continue;
    if (!clipped_ellipse_rule(ellipse, face).empty()) touched.push_back(cell);
  }
  return touched;
}

WeightedNodes load_weights(const Block& block, const Space& space, const substrate::Loads& loads) {
  if (const auto* mesh = std::get_if<substrate::SurfaceMesh>(&loads.shapes)) return vertex_weights(block, space, *mesh);
  WeightedNodes weights;
  if (const auto* ellipses = std::get_if<std::vector<substrate::Ellipse>>(&loads.shapes)) {
    weights.resize(ellipses->size());
    numerics::parallel_for(static_cast<int>(weights.size()), space.threads(),
                           [&](int j) { weights[j] = ellipse_weights(block, space, (*ellipses)[j]); });
  } else {
    for (const auto& s : std::get<std::vector<substrate::Square>>(loads.shapes))
      weights.push_back(square_weights(block, space, s));
  }
  return weights;
}

System::System(Block made, const substrate::Loads& of, const substrate::Observations& at, int threads)
    : block(std::move(made)), space(block.mesh(), threads), loads(load_weights(block, space, of)), points(at.size()) {
  const auto* on_surface = std::get_if<std::vector<Vec2>>(&at.points_um);
  numerics::parallel_for(static_cast<int>(points.size()), threads, [&](int k) {
    points[k] = space.weights_at(on_surface ? block.on_surface((*on_surface)[k])
                                            : block.locate(std::get<std::vector<Vec3>>(at.points_um)[k]));
  });
}

}  // namespace mbtfm::elements
