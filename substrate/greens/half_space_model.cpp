#include "substrate/effects.h"
#include "substrate/greens/greens_model.h"
#include "substrate/greens/models.h"
#include "substrate/models.h"
#include "substrate/response.h"

namespace mbtfm::greens {
namespace {

class HalfSpace final : public substrate::Substrate {
 public:
  HalfSpace(const Gel& gel, const substrate::SubstrateParameters& parameters, int threads)
      : gel_(gel), parameters_(parameters), threads_(threads) {}

  Eigen::MatrixXd compliance_um_per_nN(const std::vector<Vec2>& points_um,
                                       const std::vector<substrate::Ellipse>& ellipses) const override {
    return compliance_by_columns(points_um, ellipses, threads_,
                                 [this](const substrate::Ellipse& ellipse) { return HalfSpaceEllipse(gel_, ellipse); });
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
    return half_space_vertical_um(gel_, points_um, ellipses, forces_nN, threads_);
  }
  bool has_vertical() const override { return substrate::asks_for_vertical(parameters_); }
  std::vector<Effect> effects() const override { return substrate::effects_of_model(parameters_).list(); }
  Figures figures() const override { return {{"substrate_model", "half-space"}}; }

 private:
  Gel gel_;
  substrate::SubstrateParameters parameters_;
  int threads_;
};

}  // namespace

std::unique_ptr<substrate::Substrate> make_half_space(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                      int threads) {
  return std::make_unique<HalfSpace>(gel, parameters, threads);
}

}  // namespace mbtfm::greens
