#include "substrate/greens/greens_model.h"
#include "substrate/greens/layer.h"
#include "substrate/greens/layer_vertical.h"
#include "substrate/greens/models.h"
#include "substrate/greens/square.h"

namespace mbtfm::greens {
namespace {

constexpr substrate::Capabilities kLayerCan{
    .base = true, .normal_displacement = true, .space = true, .incompressible = true};

class LayerModel final : public GreensModel {
 public:
  LayerModel(const Gel& gel, const substrate::SubstrateParameters& parameters, int threads)
      : GreensModel(gel, parameters, kLayerCan, threads), layer_(gel) {}
  Figures figures() const override {
    return {{"substrate_model", "layer"}, {"substrate_thickness_um", gel_.thickness_um}};
  }

 private:
  std::optional<double> base_um() const override { return gel_.thickness_um; }
  Eigen::MatrixXd by_ellipses(const std::vector<Vec2>& points_um,
                              const std::vector<substrate::Ellipse>& ellipses) const override {
    return compliance_by_columns(points_um, ellipses, threads_,
                                 [this](const substrate::Ellipse& ellipse) { return LayerEllipse(layer_, ellipse); });
  }
  Sym2 by_square_um_per_kPa(double side_um, Vec2 offset_um) const override {
    return square_compliance_um_per_kPa(layer_, side_um, offset_um);
  }
  WaveCompliance by_wave(double wave_number_per_um) const override {
    return wave_compliance(gel_, GelModel::layer, wave_number_per_um);
  }
  std::vector<double> into_the_gel_um(const std::vector<Vec2>& points_um,
                                      const std::vector<substrate::Ellipse>& ellipses,
                                      const std::vector<Vec2>& forces_nN) const override {
    return LayerVertical(gel_).vertical_um(points_um, ellipses, forces_nN, threads_);
  }

  Layer layer_;
};

}  // namespace

substrate::Model layer() {
  return {.kind = substrate::ModelKind::layer, .can = kLayerCan, .make = substrate::make_model<LayerModel>};
}

}  // namespace mbtfm::greens
