#include "mbtfm/fit/strained_gel.h"

#include <algorithm>
#include <utility>

#include "mbtfm/fit/ready_cell.h"
#include "mbtfm/tensions/fit_results.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "substrate/choice/large_strain.h"
#include "substrate/loads.h"

namespace mbtfm::fit {

using namespace tensions;

namespace {

/// The scene while no force acts.
struct AtRest {
  std::vector<substrate::Ellipse> ellipses;
  std::vector<Vec2> beads_um;
};

AtRest as_seen(const StrainedScene& scene) {
  return {substrate::ellipses_of(scene.on.cell.adhesions), points_of(scene.beads)};
}

/// @param by_um  of the adhesions' centres, 2·adhesions
AtRest led_back(AtRest scene, const DisplacementField& beads, const VectorXd& by_um) {
  for (std::size_t j = 0; j < scene.ellipses.size(); ++j) {
    const auto row = 2 * static_cast<Index>(j);
    scene.ellipses[j].centre_um += Vec2{-by_um[row], -by_um[row + 1]};
  }
  for (std::size_t i = 0; i < beads.size(); ++i) scene.beads_um[i] += -1 * beads[i].displacement_um;
  return scene;
}

/// Of the ellipses' centres by these forces on them, 2·ellipses.
VectorXd displaced_um(const substrate::Substrate& gel, const std::vector<substrate::Ellipse>& ellipses,
                      const VectorXd& forces_nN) {
  std::vector<Vec2> centres;
  for (const substrate::Ellipse& e : ellipses) centres.push_back(e.centre_um);
  return gel.response({ellipses}, {centres})->displace(forces_nN);
}

/// Both models of a gel at rest: the linear one, and what large strains add to it.
class GelAtRest {
 public:
  /// @param near_nN  forces like those to come
  GelAtRest(const StrainedScene& scene, const AtRest& rest, substrate::SharedResponse linear, const VectorXd& near_nN)
      : linear_(std::move(linear)),
        large_(scene.on.parameters.gel, rest.ellipses, rest.beads_um, near_nN, scene.on.threads) {}

  substrate::Tangent about(const VectorXd& forces_nN) const {
    const substrate::Tangent change = large_.about(forces_nN);
    MatrixXd response = linear_->matrix();
    response += change.response->matrix();
    return {.displacement_um = linear_->displace(forces_nN) + change.displacement_um,
            .response = substrate::dense_response(std::move(response))};
  }

 private:
  substrate::SharedResponse linear_;
  choice::LargeStrain large_;
};

}  // namespace

Effect decide_strain(const GelUnderCell& on, const EnsembleFit& fit, bool is_series) {
  const Parameters& p = on.parameters;
  substrate::SubstrateParameters asked;  // whatever the linear model is: the change is added to it
  asked.material = p.substrate.material;
  asked.effects.large_strain = p.effects.large_strain;
  asked.effects.effect_tolerance = p.effects.effect_tolerance;
  const double traction_kPa =
      choice::mean_traction_kPa(substrate::ellipses_of(on.cell.adhesions), adhesion_forces_nN(fit));
  Effect effect = choice::decide_large_strain(asked, choice::left_out_at_beads(p.gel, traction_kPa));
  if (!effect.is_on) return effect;
  const std::vector<Effect> of_gel = on.gel.effects();
  const auto graded = std::ranges::find(of_gel, EffectKind::depth_graded_gel, &Effect::kind);
  std::string obstacle;
  if (is_series) obstacle = "a time series has one linear response for all of its frames";
  if (p.fit.substrate == TrialDisplacement::per_evaluation) obstacle = "fit.substrate = per-evaluation is linear";
  if (graded != of_gel.end() && graded->is_on) obstacle = "large strains are computed of a gel with one modulus alone";
  if (obstacle.empty()) return effect;
  if (effect.setting == Switch::on) throw UsageError("effects.large_strain = on: " + obstacle);
  effect.is_on = false;
  effect.why += "; but " + obstacle;
  return effect;
}

EnsembleFit fit_on_strained_gel(const StrainedScene& scene, EnsembleFit fit, const Refit& refit, const Work& work) {
  constexpr int kMostFits = 6;
  constexpr double kSettled = 0.01;  // of what matters at all
  const Parameters& p = scene.on.parameters;
  const VectorXd measured = fit.data.displacement_um;
  const std::vector<substrate::Ellipse> ellipses = substrate::ellipses_of(scene.on.cell.adhesions);
  const auto left_out = [&](const VectorXd& forces) {
    return choice::left_out_at_beads(p.gel, choice::mean_traction_kPa(ellipses, forces));
  };
  VectorXd forces = adhesion_forces_nN(fit);
  AtRest rest = as_seen(scene);
  substrate::SharedResponse linear = fit.data.response;
  if (scene.is_under_load) {
    rest = led_back(std::move(rest), scene.beads, displaced_um(scene.on.gel, ellipses, forces));
    linear = scene.on.gel.response({rest.ellipses}, {rest.beads_um})->kept();
  }
  const GelAtRest gel(scene, rest, std::move(linear), forces);
  for (int step = 0; step < kMostFits; ++step) {
    work.tell(static_cast<double>(step) / kMostFits, "large strains of the gel");
    const substrate::Tangent tangent = gel.about(forces);
    const auto response = std::static_pointer_cast<const substrate::KeptResponse>(tangent.response);
    // forces other than the network's stay linear: they are among the motions
    VectorXd offset = tangent.displacement_um - response->displace(forces);
    fit = refit(about_forces(std::move(fit.data), response, measured, std::move(offset)), next_start(fit));
    const VectorXd before = std::exchange(forces, adhesion_forces_nN(fit));
    // a tangent is off by what linear theory is, times the square of how far it is followed
    const double followed = (forces - before).norm() / std::max(forces.norm(), 1e-300);
    if (left_out(forces) * followed * followed < kSettled * p.effects.effect_tolerance) return fit;
  }
  throw NotSolved(Report{.reason = "the forces did not settle on the strained gel in " + std::to_string(kMostFits) +
                                   " fits: switch effects.large_strain off"});
}

}  // namespace mbtfm::fit
