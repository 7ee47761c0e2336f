#include "substrate/loads.h"

#include "pipeline/contract/errors.h"
#include "substrate/ellipse.h"

namespace mbtfm::substrate {

Eigen::Index Loads::size() const {
  const auto* surface = std::get_if<SurfaceFaces>(&shapes);
  if (surface) return static_cast<Eigen::Index>(surface->faces.size());
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

const std::vector<Ellipse>& ellipses_of(const Loads& loads) {
  const auto* ellipses = std::get_if<std::vector<Ellipse>>(&loads.shapes);
  if (!ellipses || loads.n_components != 2)
    throw UsageError("the model of the gel takes forces along a flat surface, on ellipses: take another");
  check(*ellipses);
  return *ellipses;
}

const std::vector<Vec2>& surface_points_of(const Observations& observations) {
  const auto* points = std::get_if<std::vector<Vec2>>(&observations.points_um);
  if (!points) throw UsageError("the model knows the gel's flat surface alone: take another");
  check_points(*points);
  return *points;
}

}  // namespace mbtfm::substrate
