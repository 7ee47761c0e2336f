#include "substrate/effects.h"
#include "substrate/greens_model.h"
#include "substrate/layer.h"
#include "substrate/layer_vertical.h"
#include "substrate/models.h"
#include "substrate/response.h"

namespace mbtfm::substrate {
namespace {

class LayerModel final : public Substrate {
 public:
  LayerModel(const Gel& gel, const SubstrateParameters& parameters, int threads)
      : parameters_(parameters), threads_(threads), layer_(gel) {}

  Eigen::MatrixXd compliance_um_per_nN(const std::vector<Vec2>& points_um,
                                       const std::vector<Ellipse>& ellipses) const override {
    return compliance_by_columns(points_um, ellipses, threads_,
                                 [this](const Ellipse& ellipse) { return LayerEllipse(layer_, ellipse); });
  }
  SharedResponse response(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses) const override {
    return pointwise_response(*this, points_um, ellipses, threads_);
  }
  std::vector<double> vertical_um(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses,
                                  const std::vector<Vec2>& forces_nN) const override {
    check_points(points_um);
    check(ellipses);
    check_forces(ellipses, forces_nN);
    return LayerVertical(layer_.gel()).vertical_um(points_um, ellipses, forces_nN, threads_);
  }
  bool has_vertical() const override { return asks_for_vertical(parameters_); }
  std::vector<Effect> effects() const override { return effects_of_model(parameters_).list(); }
  Figures figures() const override {
    return {{"substrate_model", "layer"}, {"substrate_thickness_um", layer_.gel().thickness_um}};
  }

 private:
  SubstrateParameters parameters_;
  int threads_;
  Layer layer_;
};

}  // namespace

std::unique_ptr<Substrate> make_layer(const Gel& gel, const SubstrateParameters& parameters, int threads) {
  return std::make_unique<LayerModel>(gel, parameters, threads);
}

}  // namespace mbtfm::substrate
