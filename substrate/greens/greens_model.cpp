#include <cmath>
#include <mutex>
#include <optional>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "substrate/greens/columns.h"
#include "substrate/greens/inside.h"
#include "substrate/greens/layer.h"
#include "substrate/greens/layer_vertical.h"
#include "substrate/greens/models.h"
#include "substrate/greens/wave.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::greens {
namespace {

using substrate::Components, substrate::Ellipse;

constexpr substrate::Capabilities can_of(GelModel model) {
  return {.base = model == GelModel::layer, .normal_displacement = true, .space = true, .incompressible = true};
}

/// A gel whose answers are closed forms: to ellipses, squares and waves, at the surface, and to ellipses within.
class GreensModel final : public substrate::Substrate {
 public:
  GreensModel(const Gel& gel, const substrate::SubstrateParameters& parameters, GelModel model, int threads)
      : Substrate(parameters, can_of(model)), gel_(gel), model_(model), threads_(threads) {
    if (model == GelModel::layer) layer_.emplace(gel);
  }
  Figures figures() const override {
    if (!layer_) return {{"substrate_model", "half-space"}};
    return {{"substrate_model", "layer"}, {"substrate_thickness_um", gel_.thickness_um}};
  }

  substrate::LazyResponse response(const substrate::Loads& loads,
                                   const substrate::Observations& observations) const override {
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

    const std::vector<Ellipse>& ellipses = ellipses_of(loads);
    const auto of_ellipses = substrate::pointwise_response(
        [this](const auto& points, const auto& some) { return by_ellipses(points, some); }, points_um, ellipses,
        threads_);
    if (observations.components == Components::along) return of_ellipses;
    const auto normal = substrate::lazy_response(
        {.rows = observations.size(), .cols = of_ellipses->cols(), .displace = [=, this](const MatrixXd& forces_nN) {
           return into_the_gel(points_um, ellipses, forces_nN);
         }});
    return observations.components == Components::normal ? normal : joined(of_ellipses, normal);
  }

 private:
  substrate::LazyResponse in_space(const substrate::Loads& loads, const substrate::Observations& observations) const {
    const std::vector<Ellipse>& ellipses = ellipses_of(loads, 3);
    const std::vector<Vec3> points_um = points_in_space(observations);
    for (const Vec3& p : points_um) {
      if (p.z >= 0 && (!layer_ || p.z <= gel_.thickness_um)) continue;
      throw InvalidData("point (" + shortest(p.x) + ", " + shortest(p.y) + ", " + shortest(p.z) + ") um",
                        "a depth between 0, the surface, and the gel's thickness", shortest(p.z) + " um");
    }
    const Index n_columns = loads.n_components, n_rows = observations.n_components();
    const Index first_row = observations.components == Components::normal ? 2 : 0;
    const auto matrix = [=, this] {
      if (layer_) std::call_once(inside_once_, [this] { inside_.emplace(gel_); });
      const LayerInside* layer = inside_ ? &*inside_ : nullptr;
      MatrixXd G(n_rows * std::ssize(points_um), n_columns * std::ssize(ellipses));
      numerics::parallel_for(static_cast<int>(ellipses.size()), threads_, [&](int j) {
        const EllipseInside field(gel_, layer, ellipses[j]);
        for (Index i = 0; i < std::ssize(points_um); ++i) {
          const auto& [x, y, z] = points_um[i];
          G.block(n_rows * i, n_columns * j, n_rows, n_columns) =
              field.compliance_um_per_nN({x, y}, z).block(first_row, 0, n_rows, n_columns);
        }
      });
      return G;
    };
    return substrate::lazy_response(
        {.rows = n_rows * observations.size(), .cols = n_columns * loads.size(), .matrix = matrix});
  }

  MatrixXd by_ellipses(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses) const {
    if (layer_)
      return compliance_by_columns(points_um, ellipses, threads_,
                                   [this](const Ellipse& ellipse) { return LayerEllipse(*layer_, ellipse); });
    return compliance_by_columns(points_um, ellipses, threads_,
                                 [this](const Ellipse& ellipse) { return HalfSpaceEllipse(gel_, ellipse); });
  }

  MatrixXd by_squares(const std::vector<Vec2>& points_um, const std::vector<substrate::Square>& squares) const {
    struct Field {
      const GreensModel& model;
      const substrate::Square& square;
      Sym2 compliance_um_per_nN(Vec2 point_um) const {
        const Vec2 offset_um = point_um - square.centre_um;
        return model.layer_ ? square_compliance_um_per_kPa(*model.layer_, square.side_um, offset_um)
                            : square_compliance_um_per_kPa(model.gel_, square.side_um, offset_um);
      }
    };
    return compliance_by_columns(points_um, squares, threads_, [this](const substrate::Square& square) {
      return Field{*this, square};
    });
  }

  MatrixXd by_waves(const std::vector<Vec2>& points_um, const std::vector<substrate::Wave>& waves) const {
    struct Field {
      Sym2 amplitude;
      Vec2 wave_vector_per_um;
      Sym2 compliance_um_per_nN(Vec2 point_um) const { return std::cos(dot(wave_vector_per_um, point_um)) * amplitude; }
    };
    return compliance_by_columns(points_um, waves, threads_, [this](const substrate::Wave& wave) {
      const double k = norm(wave.wave_vector_per_um);
      const Vec2 e = 1 / k * wave.wave_vector_per_um;
      const auto [along, across] = wave_compliance(gel_, model_, k);
      return Field{{along * e.x * e.x + across * e.y * e.y, (along - across) * e.x * e.y,
                    along * e.y * e.y + across * e.x * e.x},
                   wave.wave_vector_per_um};
    });
  }

  MatrixXd into_the_gel(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses,
                        const MatrixXd& forces_nN) const {
    MatrixXd columns(points_um.size(), forces_nN.cols());
    for (Index column = 0; column < forces_nN.cols(); ++column) {
      const std::vector<Vec2> forces = substrate::vectors_of(forces_nN.col(column));
      const std::vector<double> normal = layer_ ? LayerVertical(gel_).vertical_um(points_um, ellipses, forces, threads_)
                                                : half_space_vertical_um(gel_, points_um, ellipses, forces, threads_);
      std::copy(normal.begin(), normal.end(), columns.col(column).data());
    }
    return columns;
  }

  Gel gel_;
  GelModel model_;
  int threads_;
  std::optional<Layer> layer_;
  mutable std::once_flag inside_once_;
  mutable std::optional<LayerInside> inside_;  ///< its table takes a fraction of a second
};

template <GelModel model>
substrate::Model row_of() {
  return {.kind = substrate::kind_of(model),
          .can = can_of(model),
          .make = [](const Gel& gel, const substrate::SubstrateParameters& parameters,
                     int threads) -> std::unique_ptr<substrate::Substrate> {
            return std::make_unique<GreensModel>(gel, parameters, model, threads);
          }};
}

}  // namespace

substrate::Model half_space() { return row_of<GelModel::half_space>(); }
substrate::Model layer() { return row_of<GelModel::layer>(); }

std::unique_ptr<substrate::Substrate> make_greens(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                  int threads) {
  return substrate::make_from({half_space(), layer()}, gel, parameters, threads);
}

}  // namespace mbtfm::greens
