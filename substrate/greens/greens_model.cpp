#include "substrate/greens/greens_model.h"

#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "substrate/models.h"

namespace mbtfm::greens {

using Eigen::Index;
using Eigen::MatrixXd;
using substrate::Components;

substrate::LazyResponse GreensModel::response(const substrate::Loads& loads,
                                              const substrate::Observations& observations) const {
  if (are_in_space(loads, observations)) return in_space(loads, observations);
  const std::vector<Vec2>& points_um = surface_points_of(observations);
  const auto along = [&](auto matrix) {
    if (observations.components != Components::along || loads.n_components != 2)
      throw UsageError(
          "squares and waves load the gel along its surface and are answered there: ask for no other axis");
    return substrate::lazy_response({.rows = 2 * observations.size(), .cols = 2 * loads.size(), .matrix = matrix});
  };
  if (const auto* squares = std::get_if<std::vector<substrate::Square>>(&loads.shapes))
    return along([=, this, squares = *squares] { return by_squares(points_um, squares); });
  if (const auto* waves = std::get_if<std::vector<substrate::Wave>>(&loads.shapes))
    return along([=, this, waves = *waves] { return by_waves(points_um, waves); });

  const std::vector<substrate::Ellipse>& ellipses = ellipses_of(loads);
  const auto of_ellipses =
      substrate::pointwise_response([this](const auto& points, const auto& some) { return by_ellipses(points, some); },
                                    points_um, ellipses, threads_);
  if (observations.components == Components::along) return of_ellipses;
  const auto normal = substrate::lazy_response(
      {.rows = observations.size(), .cols = of_ellipses->cols(), .displace = [=, this](const MatrixXd& forces_nN) {
         return into_the_gel(points_um, ellipses, forces_nN);
       }});
  return observations.components == Components::normal ? normal : joined(of_ellipses, normal);
}

substrate::LazyResponse GreensModel::in_space(const substrate::Loads& loads,
                                              const substrate::Observations& observations) const {
  const std::vector<substrate::Ellipse>& ellipses = ellipses_of(loads, 3);
  const std::vector<Vec3> points_um = points_in_space(observations);
  for (const Vec3& p : points_um) {
    if (p.z >= 0 && p.z <= base_um().value_or(p.z)) continue;
    throw InvalidData("point (" + shortest(p.x) + ", " + shortest(p.y) + ", " + shortest(p.z) + ") um",
                      "a depth between 0, the surface, and the gel's thickness", shortest(p.z) + " um");
  }
  const Index n_columns = loads.n_components, n_rows = observations.n_components();
  const Index first_row = observations.components == Components::normal ? 2 : 0;
  const auto matrix = [=, this] {
    if (base_um()) std::call_once(inside_once_, [this] { inside_.emplace(gel_); });
    const LayerInside* layer = inside_ ? &*inside_ : nullptr;
    MatrixXd G(n_rows * static_cast<Index>(points_um.size()), n_columns * static_cast<Index>(ellipses.size()));
    numerics::parallel_for(static_cast<int>(ellipses.size()), threads_, [&](int j) {
      const EllipseInside field(gel_, layer, ellipses[j]);
      for (std::size_t i = 0; i < points_um.size(); ++i) {
        const auto& [x, y, z] = points_um[i];
        G.block(n_rows * static_cast<Index>(i), n_columns * j, n_rows, n_columns) =
            field.compliance_um_per_nN({x, y}, z).block(first_row, 0, n_rows, n_columns);
      }
    });
    return G;
  };
  return substrate::lazy_response(
      {.rows = n_rows * observations.size(), .cols = n_columns * loads.size(), .matrix = matrix});
}

MatrixXd GreensModel::by_squares(const std::vector<Vec2>& points_um,
                                 const std::vector<substrate::Square>& squares) const {
  struct Field {
    const GreensModel& model;
    const substrate::Square& square;
    Sym2 compliance_um_per_nN(Vec2 point_um) const {
      return model.by_square_um_per_kPa(square.side_um, point_um - square.centre_um);
    }
  };
  return compliance_by_columns(points_um, squares, threads_, [this](const substrate::Square& square) {
    return Field{*this, square};
  });
}

MatrixXd GreensModel::by_waves(const std::vector<Vec2>& points_um, const std::vector<substrate::Wave>& waves) const {
  struct Field {
    Sym2 amplitude;
    Vec2 wave_vector_per_um;
    Sym2 compliance_um_per_nN(Vec2 point_um) const { return std::cos(dot(wave_vector_per_um, point_um)) * amplitude; }
  };
  return compliance_by_columns(points_um, waves, threads_, [this](const substrate::Wave& wave) {
    const double k = norm(wave.wave_vector_per_um);
    const Vec2 e = 1 / k * wave.wave_vector_per_um;
    const auto [along, across] = by_wave(k);
    return Field{
        {along * e.x * e.x + across * e.y * e.y, (along - across) * e.x * e.y, along * e.y * e.y + across * e.x * e.x},
        wave.wave_vector_per_um};
  });
}

MatrixXd GreensModel::into_the_gel(const std::vector<Vec2>& points_um, const std::vector<substrate::Ellipse>& ellipses,
                                   const MatrixXd& forces_nN) const {
  MatrixXd columns(points_um.size(), forces_nN.cols());
  for (Index column = 0; column < forces_nN.cols(); ++column) {
    const std::vector<double> normal =
        into_the_gel_um(points_um, ellipses, substrate::vectors_of(forces_nN.col(column)));
    std::copy(normal.begin(), normal.end(), columns.col(column).data());
  }
  return columns;
}

}  // namespace mbtfm::greens
