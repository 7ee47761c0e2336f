#include "substrate/loads.h"

#include "pipeline/contract/errors.h"
#include "substrate/ellipse.h"

namespace mbtfm::substrate {

Eigen::Index Loads::size() const {
  const auto* surface = std::get_if<SurfaceMesh>(&shapes);
  if (surface) return static_cast<Eigen::Index>(surface->points_um.size());
  const auto n = [](const auto& list) -> std::size_t {
    if constexpr (requires { list.size(); })
      return list.size();
    else
      return 0;
  };
  return static_cast<Eigen::Index>(std::visit(n, shapes));
}

Eigen::Index Observations::size() const {
  return static_cast<Eigen::Index>(std::visit([](const auto& points) { return points.size(); }, points_um));
}

bool are_in_space(const Loads& loads, const Observations& observations) {
  return loads.n_components > 2 || !std::holds_alternative<std::vector<Vec2>>(observations.points_um);
}

const std::vector<Ellipse>& ellipses_of(const Loads& loads, int most_components) {
  const auto* ellipses = std::get_if<std::vector<Ellipse>>(&loads.shapes);
  if (!ellipses || loads.n_components > most_components)
    throw UsageError(
        "this model of the gel takes forces along its flat surface, on ellipses: forces into the gel need "
        "substrate.model = half-space, layer or curved");
  check(*ellipses);
  return *ellipses;
}

const std::vector<Vec2>& surface_points_of(const Observations& observations) {
  const auto* points = std::get_if<std::vector<Vec2>>(&observations.points_um);
  if (!points)
    throw UsageError(
        "this model knows the gel's flat surface alone: points below it need substrate.model = half-space, layer or "
        "curved");
  check_points(*points);
  return *points;
}

std::vector<Vec3> points_in_space(const Observations& observations) {
  std::vector<Vec3> points;
  if (const auto* surface = std::get_if<std::vector<Vec2>>(&observations.points_um)) {
    for (const Vec2 p : *surface) points.push_back({p.x, p.y, 0});
  } else {
    points = std::get<std::vector<Vec3>>(observations.points_um);
  }
  check_points(points);
  return points;
}

}  // namespace mbtfm::substrate
