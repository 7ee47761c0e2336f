/// The cheapest model that computes the effects which the switches and the scene call for.
///
/// - `half-space` has neither base nor sides, `layer` has the base.
/// - `split` takes even gels whose sides are no nearer than two elements of its grid, which is what quadratic elements
///   need to follow the half-space field there; its grid leaves 0.1 % with 2 elements over the thickness, falling as
///   their cube.
/// - `refined` takes all.
#include <algorithm>
#include <cmath>
#include <mutex>

#include "pipeline/stage/effects.h"
#include "substrate/choice/decide.h"
#include "substrate/choice/factory.h"
#include "substrate/effects.h"
#include "substrate/models.h"
#include "substrate/response.h"
#include "substrate/scene.h"
#include "substrate/stated_error.h"

namespace mbtfm::choice {
namespace {

/// Cells of the grid of `split` over the thickness that leave no more than the tolerance.
int cells_for(double tolerance) {
  return std::max(2, static_cast<int>(std::ceil(2 * std::cbrt(substrate::kSplitErrorOfTwoCells / tolerance))));
}

SceneSize size_of(const std::vector<Vec2>& points_um, const std::vector<substrate::Ellipse>& ellipses) {
  if (points_um.empty() && ellipses.empty()) return {};
  const substrate::Extent extent = substrate::extent_of(points_um, ellipses);
  SceneSize size{.width_um = norm(extent.high_um - extent.low_um)};
  const auto n = static_cast<double>(ellipses.size());
  for (const substrate::Ellipse& e : ellipses)
    size.adhesion_radius_um += std::sqrt(e.semi_major_um * e.semi_minor_um) / n;
  return size;
}

substrate::ModelKind model_for(const Gel& gel, const substrate::SubstrateParameters& p,
                               const substrate::GelEffects& effects) {
  using enum substrate::ModelKind;
  if (effects.grading.is_on) return refined;
  if (effects.sides.is_on) {
    const double elements = *p.side_distance_um / gel.thickness_um * p.cells_per_thickness;
    return elements >= 2 ? split : refined;
  }
  return effects.thickness.is_on ? layer : half_space;
}

class Automatic final : public substrate::Substrate {
  template <class Ask>
  auto timed(const std::vector<Vec2>& points_um, const std::vector<substrate::Ellipse>& ellipses,
             const Ask& ask) const {
    const stage::Stopwatch watch;
    auto answer = ask(model_of(points_um, ellipses));
    const std::lock_guard lock(mutex_);
    seconds_ += watch.seconds();
    return answer;
  }

 public:
  Automatic(const Gel& gel, const substrate::SubstrateParameters& parameters, int threads)
      : gel_(gel), parameters_(parameters), threads_(threads) {
    parameters_.cells_per_thickness =
        std::max(parameters_.cells_per_thickness, cells_for(parameters_.effects.effect_tolerance));
    decide(gel_, parameters_, {});  // refuses what the switches get wrong before any file is read
  }

  Eigen::MatrixXd compliance_um_per_nN(const std::vector<Vec2>& points_um,
                                       const std::vector<substrate::Ellipse>& ellipses) const override {
    return timed(points_um, ellipses,
                 [&](const substrate::Substrate& m) { return m.compliance_um_per_nN(points_um, ellipses); });
  }
  substrate::SharedResponse response(const std::vector<Vec2>& points_um,
                                     const std::vector<substrate::Ellipse>& ellipses) const override {
    return timed(points_um, ellipses, [&](const substrate::Substrate& m) { return m.response(points_um, ellipses); });
  }
  std::vector<Vec2> displacements_um(const std::vector<Vec2>& points_um,
                                     const std::vector<substrate::Ellipse>& ellipses,
                                     const std::vector<Vec2>& forces_nN) const override {
    return timed(points_um, ellipses,
                 [&](const substrate::Substrate& m) { return m.displacements_um(points_um, ellipses, forces_nN); });
  }
  std::vector<double> vertical_um(const std::vector<Vec2>& points_um, const std::vector<substrate::Ellipse>& ellipses,
                                  const std::vector<Vec2>& forces_nN) const override {
    return timed(points_um, ellipses,
                 [&](const substrate::Substrate& m) { return m.vertical_um(points_um, ellipses, forces_nN); });
  }
  bool has_vertical() const override { return substrate::asks_for_vertical(parameters_); }
  substrate::VolumeField volume(const std::vector<substrate::Ellipse>& ellipses,
                                const std::vector<Vec2>& forces_nN) const override {
    substrate::SubstrateParameters parameters = parameters_;
    parameters.model = substrate::ModelKind::refined;  // the one that has an inside
    return make_substrate(gel_, parameters, threads_)->volume(ellipses, forces_nN);
  }
  std::vector<Effect> effects() const override {
    const std::lock_guard lock(mutex_);
    substrate::GelEffects effects = model_ ? effects_ : decide(gel_, parameters_, {});
    // the model's time stands at the effect that called for it
    for (Effect* e : {&effects.grading, &effects.sides, &effects.vertical, &effects.thickness}) {
      if (!e->is_on) continue;
      e->seconds = seconds_;
      break;
    }
    return effects.list();
  }
  Figures figures() const override {
    const std::lock_guard lock(mutex_);
    return model_ ? model_->figures() : Figures{{"substrate_model", "auto"}};
  }

 private:
  /// The first scene decides: later ones of the same gel are answered by the same model.
  const substrate::Substrate& model_of(const std::vector<Vec2>& points_um,
                                       const std::vector<substrate::Ellipse>& ellipses) const {
    const std::lock_guard lock(mutex_);
    if (model_) return *model_;
    substrate::check_points(points_um);
    check(ellipses);
    effects_ = decide(gel_, parameters_, size_of(points_um, ellipses));
    substrate::SubstrateParameters parameters = substrate::without_what_is_off(parameters_, effects_);
    parameters.model = model_for(gel_, parameters, effects_);
    stage::EffectSwitches decided;  // as the model has them: the switches are obeyed by now
    decided.vertical_displacement = switched(effects_.vertical.is_on);
    parameters.effects = decided;
    model_ = make_substrate(gel_, parameters, threads_);
    return *model_;
  }

  Gel gel_;
  substrate::SubstrateParameters parameters_;
  int threads_;
  mutable std::mutex mutex_;  // guards the choice
  mutable substrate::GelEffects effects_;
  mutable std::unique_ptr<substrate::Substrate> model_;
  mutable double seconds_ = 0;
};

}  // namespace

std::unique_ptr<substrate::Substrate> make_automatic(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                     int threads) {
  return std::make_unique<Automatic>(gel, parameters, threads);
}

}  // namespace mbtfm::choice
