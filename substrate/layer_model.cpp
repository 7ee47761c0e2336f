#include "substrate/greens_model.h"
#include "substrate/layer.h"
#include "substrate/models.h"

namespace mbtfm::substrate {
namespace {

class LayerModel final : public Substrate {
 public:
  LayerModel(const Gel& gel, int threads) : threads_(threads), layer_(gel) {}

  Eigen::MatrixXd compliance_um_per_nN(const std::vector<Vec2>& points_um,
                                       const std::vector<Ellipse>& ellipses) const override {
    return compliance_by_columns(points_um, ellipses, threads_,
                                 [this](const Ellipse& ellipse) { return LayerEllipse(layer_, ellipse); });
  }
  std::vector<Effect> effects() const override {
    return {{.name = "finite thickness", .is_on = true, .why = "layer on a rigid base, to 1e-6 of the field"},
            {.name = "finite sides", .is_on = false, .why = "layer: a gel is centimetres wide, a cell 0.1 mm"},
            vertical_displacement_off()};
  }
  Figures figures() const override {
    return {{"substrate_model", "layer"}, {"substrate_thickness_um", layer_.gel().thickness_um}};
  }

 private:
  int threads_;
  Layer layer_;
};

}  // namespace

std::unique_ptr<Substrate> make_layer(const Gel& gel, const SubstrateParameters&, int threads) {
  return std::make_unique<LayerModel>(gel, threads);
}

}  // namespace mbtfm::substrate
