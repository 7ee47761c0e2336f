/// The cheapest model of the table that computes the effects which the switches and the scene call for.
#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/stopwatch.h"
#include "pipeline/stage/effects.h"
#include "substrate/choice/decide.h"
#include "substrate/choice/factory.h"
#include "substrate/effects.h"
#include "substrate/loads.h"
#include "substrate/response.h"
#include "substrate/scene.h"

namespace mbtfm::choice {
namespace {

SceneSize size_of(const substrate::Loads& loads, const substrate::Observations& observations) {
  std::vector<Vec2> points_um;
  for (const Vec3& p : points_in_space(observations)) points_um.push_back({p.x, p.y});
  static const std::vector<substrate::Ellipse> none;
  const auto* mesh = std::get_if<substrate::SurfaceMesh>(&loads.shapes);
  if (mesh) points_um.insert(points_um.end(), mesh->points_um.begin(), mesh->points_um.end());
  const std::vector<substrate::Ellipse>& ellipses = mesh ? none : ellipses_of(loads, 3);
  if (points_um.empty() && ellipses.empty()) return {};
  const substrate::Extent extent = substrate::extent_of(points_um, ellipses);
  SceneSize size{.width_um = norm(extent.high_um - extent.low_um)};
  const auto n = static_cast<double>(ellipses.size());
  for (const substrate::Ellipse& e : ellipses)
    size.adhesion_radius_um += std::sqrt(e.semi_major_um * e.semi_minor_um) / n;
  return size;
}

/// None of them: the end of the table.
auto cheapest(const std::function<bool(const substrate::Model&)>& can) {
  return std::find_if(models().begin(), models().end(), can);
}

/// @throws UsageError where forces into the gel or points below its surface meet an effect that no such model has
const substrate::Model& model_for(const Gel& gel, const substrate::SubstrateParameters& p,
                                  const substrate::GelEffects& effects, bool is_in_space) {
  const auto model = cheapest([&](const substrate::Model& m) {
    return (m.can.space || !is_in_space) && (m.can.base || !effects.thickness.is_on) &&
           (m.can.sides || !effects.sides.is_on) && (m.can.large_strain || !effects.strain.is_on) &&
           (m.can.surface || !effects.surface.is_on) && (m.can.grading || !effects.grading.is_on) &&
           (!m.follows || m.follows(gel, p));
  });
  if (model != models().end()) return *model;
  if (effects.surface.is_on) {
    throw UsageError(
        "a surface that is not flat is computed of a gel with one modulus alone: switch the effect depth_graded_gel "
        "off");
  }
  if (effects.strain.is_on) {
    throw UsageError(
        "large strains are computed of a gel with one modulus alone: switch the effect depth_graded_gel off");
  }
  MBTFM_ASSERT(is_in_space);
  throw UsageError(
      "forces into the gel and points below its surface are known of an even gel alone: switch the effect "
      "depth_graded_gel off");
}

class Automatic final : public substrate::Substrate {
  template <class Ask>
  auto timed(const Ask& ask) const {
    const Stopwatch watch;
    auto answer = ask();
    const std::lock_guard lock(mutex_);
    seconds_ += watch.seconds();
    return answer;
  }

 public:
  Automatic(const Gel& gel, const substrate::SubstrateParameters& parameters, int threads)
      : Substrate(parameters, {}), gel_(gel), threads_(threads) {
    check(gel);
    for (const substrate::Model& model : models())
      if (model.within) parameters_ = model.within(parameters_, parameters_.effects.effect_tolerance);
    decide(gel_, parameters_, {});  // refuses what the switches get wrong before any file is read
  }

  substrate::LazyResponse response(const substrate::Loads& loads,
                                   const substrate::Observations& observations) const override {
    const auto answer = timed([&] { return model_of(loads, observations).response(loads, observations); });
    return substrate::lazy_response(
        {.rows = answer->rows(),
         .cols = answer->cols(),
         .matrix = [=, this] { return timed([&] { return answer->matrix(); }); },
         .displace = [=, this](const MatrixXd& forces) { return timed([&] { return answer->displace(forces); }); },
         .kept = [=, this] { return timed([&] { return answer->kept(); }); },
         .about = [=, this](const VectorXd& forces) { return timed([&] { return answer->about(forces); }); }});
  }
  substrate::VolumeField volume(const std::vector<substrate::Ellipse>& ellipses,
                                const std::vector<Vec2>& forces_nN) const override {
    substrate::SubstrateParameters parameters = parameters_;
    parameters.model = cheapest([&](const substrate::Model& model) {
                         return model.can.inside && (model.can.surface || !gel_.surface) &&
                                (model.can.large_strain || parameters_.effects.large_strain != Switch::on);
                       })->kind;
    return make_substrate(gel_, parameters, threads_)->volume(ellipses, forces_nN);
  }
  substrate::Capabilities capabilities() const override {
    const std::lock_guard lock(mutex_);
    return model_ ? model_->capabilities() : substrate::Capabilities{};
  }
  double stated_error() const override {
    const std::lock_guard lock(mutex_);
    return model_ ? model_->stated_error() : 0;
  }
  std::vector<Effect> effects() const override {
    const std::lock_guard lock(mutex_);
    substrate::GelEffects effects = model_ ? effects_ : decide(gel_, parameters_, {});
    // the model's time is at the effect that called for it
    for (Effect* e :
         {&effects.surface, &effects.strain, &effects.grading, &effects.sides, &effects.vertical, &effects.thickness}) {
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
  const substrate::Substrate& model_of(const substrate::Loads& loads,
                                       const substrate::Observations& observations) const {
    const std::lock_guard lock(mutex_);
    if (model_) return *model_;
    effects_ = decide(gel_, parameters_, size_of(loads, observations));
    substrate::SubstrateParameters parameters = substrate::without_what_is_off(parameters_, effects_);
    parameters.model = model_for(gel_, parameters, effects_, are_in_space(loads, observations)).kind;
    stage::EffectSwitches decided;  // as the model has them: the switches are obeyed by now
    decided.vertical_displacement = switched(effects_.vertical.is_on);
    decided.large_strain = switched(effects_.strain.is_on);
    parameters.effects = decided;
    Gel gel = gel_;
    if (!effects_.surface.is_on) gel.surface = nullptr;
    model_ = make_substrate(gel, parameters, threads_);
    return *model_;
  }

  Gel gel_;
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
