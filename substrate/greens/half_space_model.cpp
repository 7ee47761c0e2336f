#include "substrate/greens/greens_model.h"
#include "substrate/greens/models.h"
#include "substrate/greens/square.h"

namespace mbtfm::greens {
namespace {

constexpr substrate::Capabilities kHalfSpaceCan{.normal_displacement = true, .space = true, .incompressible = true};

class HalfSpace final : public GreensModel {
 public:
  HalfSpace(const Gel& gel, const substrate::SubstrateParameters& parameters, int threads)
      : GreensModel(gel, parameters, kHalfSpaceCan, threads) {}
  Figures figures() const override { return {{"substrate_model", "half-space"}}; }

 private:
  std::optional<double> base_um() const override { return std::nullopt; }
  Eigen::MatrixXd by_ellipses(const std::vector<Vec2>& points_um,
                              const std::vector<substrate::Ellipse>& ellipses) const override {
    return compliance_by_columns(points_um, ellipses, threads_,
                                 [this](const substrate::Ellipse& ellipse) { return HalfSpaceEllipse(gel_, ellipse); });
  }
  Sym2 by_square_um_per_kPa(double side_um, Vec2 offset_um) const override {
    return square_compliance_um_per_kPa(gel_, side_um, offset_um);
  }
  WaveCompliance by_wave(double wave_number_per_um) const override {
    return wave_compliance(gel_, GelModel::half_space, wave_number_per_um);
  }
  std::vector<double> into_the_gel_um(const std::vector<Vec2>& points_um,
                                      const std::vector<substrate::Ellipse>& ellipses,
                                      const std::vector<Vec2>& forces_nN) const override {
    return half_space_vertical_um(gel_, points_um, ellipses, forces_nN, threads_);
  }
};

}  // namespace

substrate::Model half_space() {
  return {.kind = substrate::ModelKind::half_space, .can = kHalfSpaceCan, .make = substrate::make_model<HalfSpace>};
}

}  // namespace mbtfm::greens
