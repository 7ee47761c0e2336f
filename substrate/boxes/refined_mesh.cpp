#include "substrate/boxes/refined_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "substrate/boxes/ellipse_load.h"
#include "substrate/ellipse.h"
#include "substrate/scene.h"

namespace mbtfm::boxes {
namespace {

using std::numbers::pi;

// of an element's sides: stiffness and ordering take it, and steps of the modulus near the surface ask for it
constexpr double kMostFlat = 4;

/// From the surface to the base, with a line at each step of the modulus.
std::vector<double> depths_of(const substrate::Material& material, double side_um) {
  std::vector<double> ends = substrate::steps_um(material);
  ends.push_back(material.gel.thickness_um);
  std::vector<double> depths = {0};
  for (const double end : ends) {
    const double begin = depths.back();
    const int n = std::max(1, static_cast<int>(std::lround((end - begin) / side_um)));
    for (int k = 1; k <= n; ++k) depths.push_back(k == n ? end : begin + (end - begin) * k / n);
  }
  return depths;
}

/// Sides of the coarsest elements along the surface: the gel's thickness, or less over thin layers.
double coarsest_side_um(const substrate::Material& material) {
  double side = material.gel.thickness_um;
  double before = 0;
  for (const double step : substrate::steps_um(material)) {
    side = std::min(side, kMostFlat * (step - before));
    before = step;
  }
  return std::min(side, kMostFlat * (material.gel.thickness_um - before));
}

/// Boxes over the scene and its margin, nearly cubes; flatter over thin layers.
GridLines boxes_around(const substrate::Extent& scene, const substrate::Material& material, double margin_um) {
  const double side = coarsest_side_um(material);
  return {even_lines(scene.low_um.x, scene.high_um.x, margin_um, side),
          even_lines(scene.low_um.y, scene.high_um.y, margin_um, side), depths_of(material, side)};
}

/// Elements of a uniform grid that an ellipse touches.
int n_touched(const substrate::Ellipse& ellipse, Vec2 origin, double side) {
  const Vec2 half = substrate::half_extent_um(ellipse);
  const auto index = [side](double x) { return std::floor(x / side); };
  const Vec2 low = ellipse.centre_um - half - origin;
  const Vec2 high = ellipse.centre_um + half - origin;
  int n = 0;
  for (double j = index(low.y); j <= index(high.y); ++j) {
    for (double i = index(low.x); i <= index(high.x); ++i) {
      const Vec2 corner = origin + Vec2{i * side, j * side};
      if (!clipped_ellipse_rule(ellipse, {corner, corner + Vec2{side, side}}).empty()) ++n;
    }
  }
  return n;
}

/// An ellipse with the side of element it asks for, covered by discs of its semi-minor axis along its major one.
struct Target {
  double side_um, radius_um;
  std::vector<Vec2> centres_um;
};

Target target_of(const substrate::Ellipse& ellipse, const GridLines& lines, const Fineness& fineness, int halvings) {
  const double wanted = std::sqrt(pi * ellipse.semi_major_um * ellipse.semi_minor_um) / fineness.across;
  double side = std::max(lines.x_um[1] - lines.x_um[0], lines.y_um[1] - lines.y_um[0]);
  const Vec2 origin = {lines.x_um.front(), lines.y_um.front()};
  while (side > wanted || n_touched(ellipse, origin, side) < fineness.fewest_elements) side /= 2;
  side = std::ldexp(side, -halvings);

  const double b = ellipse.semi_minor_um;
  const double reach = std::max(0.0, ellipse.semi_major_um - b);
  const int n = static_cast<int>(std::ceil(reach / b));
  const Vec2 along = {std::cos(ellipse.angle_rad), std::sin(ellipse.angle_rad)};
  Target target{.side_um = side, .radius_um = b, .centres_um = {}};
  for (int k = -n; k <= n; ++k) target.centres_um.push_back(ellipse.centre_um + (n == 0 ? 0 : reach * k / n) * along);
  return target;
}

double distance(const Box& box, Vec2 point) {
  const auto outside = [](double low, double size, double x) { return std::max({0.0, low - x, x - low - size}); };
  const double dx = outside(box.low_um[0], box.size_um[0], point.x);
  const double dy = outside(box.low_um[1], box.size_um[1], point.y);
  return std::sqrt(dx * dx + dy * dy + box.low_um[2] * box.low_um[2]);
}

}  // namespace

BlockMesh refined_mesh(const substrate::Material& material, const substrate::Extent& scene,
                       const std::vector<substrate::Ellipse>& ellipses, const Fineness& fineness, double margin_um,
                       int order, std::int64_t most_cells, int threads) {
  substrate::check_size(scene, coarsest_side_um(material), most_cells);
  const GridLines lines = boxes_around(scene, material, margin_um);
  std::vector<Target> targets;
  for (std::size_t j = 0; j < ellipses.size(); ++j) {
    targets.push_back(target_of(ellipses[j], lines, fineness, fineness.halvings[j]));
  }
  const auto is_too_large = [&](const Box& box) {
    const double side = std::max(box.size_um[0], box.size_um[1]);
    for (const Target& target : targets) {
      // the side grows with the distance: the field's own scale
      if (side <= target.side_um * (1 + 1e-9)) continue;
      for (const Vec2 centre : target.centres_um) {
        if (side > fineness.growth * (distance(box, centre) - target.radius_um)) return true;
      }
    }
    return false;
  };
  return make_block_mesh(lines, order, is_too_large, most_cells, threads);
}

}  // namespace mbtfm::boxes
