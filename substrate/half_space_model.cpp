#include "substrate/effects.h"
#include "substrate/greens_model.h"
#include "substrate/models.h"
#include "substrate/response.h"

namespace mbtfm::substrate {
namespace {

class HalfSpace final : public Substrate {
 public:
  HalfSpace(const Gel& gel, const SubstrateParameters& parameters, int threads)
      : gel_(gel), parameters_(parameters), threads_(threads) {}

  Eigen::MatrixXd compliance_um_per_nN(const std::vector<Vec2>& points_um,
                                       const std::vector<Ellipse>& ellipses) const override {
    return compliance_by_columns(points_um, ellipses, threads_,
                                 [this](const Ellipse& ellipse) { return HalfSpaceEllipse(gel_, ellipse); });
  }
  SharedResponse response(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses) const override {
    return pointwise_response(*this, points_um, ellipses, threads_);
  }
  std::vector<double> vertical_um(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses,
                                  const std::vector<Vec2>& forces_nN) const override {
    check_points(points_um);
    check(ellipses);
    check_forces(ellipses, forces_nN);
    return half_space_vertical_um(gel_, points_um, ellipses, forces_nN, threads_);
  }
  bool has_vertical() const override { return asks_for_vertical(parameters_); }
  std::vector<Effect> effects() const override { return effects_of_model(parameters_).list(); }
  Figures figures() const override { return {{"substrate_model", "half-space"}}; }

 private:
  Gel gel_;
  SubstrateParameters parameters_;
  int threads_;
};

}  // namespace

std::unique_ptr<Substrate> make_half_space(const Gel& gel, const SubstrateParameters& parameters, int threads) {
  return std::make_unique<HalfSpace>(gel, parameters, threads);
}

}  // namespace mbtfm::substrate
