#include "substrate/effects.h"
#include "substrate/greens/greens_model.h"
#include "substrate/greens/layer.h"
#include "substrate/greens/layer_vertical.h"
#include "substrate/greens/models.h"
#include "substrate/models.h"
#include "substrate/response.h"

namespace mbtfm::greens {
namespace {

class LayerModel final : public substrate::Substrate {
 public:
  LayerModel(const Gel& gel, const substrate::SubstrateParameters& parameters, int threads)
      : parameters_(parameters), threads_(threads), layer_(gel) {}

  Eigen::MatrixXd compliance_um_per_nN(const std::vector<Vec2>& points_um,
                                       const std::vector<substrate::Ellipse>& ellipses) const override {
    return compliance_by_columns(points_um, ellipses, threads_,
                                 [this](const substrate::Ellipse& ellipse) { return LayerEllipse(layer_, ellipse); });
  }
  substrate::SharedResponse response(const std::vector<Vec2>& points_um,
                                     const std::vector<substrate::Ellipse>& ellipses) const override {
    return substrate::pointwise_response(*this, points_um, ellipses, threads_);
  }
  std::vector<double> vertical_um(const std::vector<Vec2>& points_um, const std::vector<substrate::Ellipse>& ellipses,
                                  const std::vector<Vec2>& forces_nN) const override {
    substrate::check_points(points_um);
    check(ellipses);
    substrate::check_forces(ellipses, forces_nN);
    return LayerVertical(layer_.gel()).vertical_um(points_um, ellipses, forces_nN, threads_);
  }
  bool has_vertical() const override { return substrate::asks_for_vertical(parameters_); }
  std::vector<Effect> effects() const override { return substrate::effects_of_model(parameters_).list(); }
  Figures figures() const override {
    return {{"substrate_model", "layer"}, {"substrate_thickness_um", layer_.gel().thickness_um}};
  }

 private:
  substrate::SubstrateParameters parameters_;
  int threads_;
  Layer layer_;
};

}  // namespace

std::unique_ptr<substrate::Substrate> make_layer(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                 int threads) {
  return std::make_unique<LayerModel>(gel, parameters, threads);
}

}  // namespace mbtfm::greens
