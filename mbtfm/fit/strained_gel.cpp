#include "mbtfm/fit/strained_gel.h"

#include <algorithm>

#include "mbtfm/tensions/fit_results.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "substrate/choice/large_strain.h"

namespace mbtfm::fit {

using namespace tensions;

namespace {

/// The scene while no force acts.
struct AtRest {
  std::vector<substrate::Ellipse> ellipses;
  std::vector<Vec2> beads_um;
};

AtRest as_seen(const StrainedScene& scene) { return {ellipses_of(scene.on.cell), points_of(scene.beads)}; }

std::vector<Vec2> centres_of(const std::vector<substrate::Ellipse>& ellipses) {
  std::vector<Vec2> centres;
  for (const substrate::Ellipse& e : ellipses) centres.push_back(e.centre_um);
  return centres;
}

/// @param by_um  of the adhesions' centres, 2·adhesions
AtRest led_back(const StrainedScene& scene, const Eigen::VectorXd& by_um) {
  AtRest rest = as_seen(scene);
  for (std::size_t j = 0; j < rest.ellipses.size(); ++j) {
    const auto row = 2 * static_cast<Eigen::Index>(j);
    rest.ellipses[j].centre_um += Vec2{-by_um[row], -by_um[row + 1]};
  }
  for (std::size_t i = 0; i < rest.beads_um.size(); ++i) rest.beads_um[i] += -1 * scene.beads[i].displacement_um;
  return rest;
}

/// Both models of a gel at rest: the linear one, and what large strains add; of beads, then of adhesions' centres.
class GelAtRest {
 public:
  /// @param near_nN  forces like those to come
  GelAtRest(const StrainedScene& scene, const AtRest& rest, const Eigen::VectorXd& near_nN)
      : n_beads_(2 * std::ssize(rest.beads_um)),
        linear_(response_of(scene.on.gel, rest)),
        large_(scene.on.parameters.gel, rest.ellipses, asked_of(rest), near_nN, scene.on.threads) {}

  /// u = response (F − F₀) + displacement_um, of beads and centres
  substrate::Tangent about(const Eigen::VectorXd& forces_nN) const {
    substrate::Tangent change = large_.about(forces_nN);
    Eigen::MatrixXd response = linear_->matrix() + change.response->matrix();
    return {.displacement_um = linear_->displace(forces_nN) + change.displacement_um,
            .response = substrate::dense_response(std::move(response))};
  }
  Eigen::Index n_beads() const { return n_beads_; }  ///< components

 private:
  static std::vector<Vec2> asked_of(const AtRest& rest) {
    std::vector<Vec2> points = rest.beads_um;
    const std::vector<Vec2> centres = centres_of(rest.ellipses);
    points.insert(points.end(), centres.begin(), centres.end());
    return points;
  }
  static substrate::SharedResponse response_of(const substrate::Substrate& gel, const AtRest& rest) {
    return gel.response({rest.ellipses}, {asked_of(rest)})->kept();
  }

  Eigen::Index n_beads_;
  substrate::SharedResponse linear_;
  choice::LargeStrain large_;
};

std::vector<Eigen::Index> first_of(Eigen::Index n) {
  std::vector<Eigen::Index> indices(static_cast<std::size_t>(n));
  for (Eigen::Index i = 0; i < n; ++i) indices[static_cast<std::size_t>(i)] = i;
  return indices;
}

Eigen::VectorXd measured_um(const LinearData& data) {
  return data.offset_um.size() > 0 ? data.displacement_um + data.offset_um : data.displacement_um;
}

}  // namespace

Effect decide_strain(const GelUnderCell& on, const EnsembleFit& fit, bool is_series) {
  const Parameters& p = on.parameters;
  substrate::SubstrateParameters asked;  // whatever the linear model is: the change is added to it
  asked.material = p.substrate.material;
  asked.effects = p.effects;
  const double traction_kPa = choice::mean_traction_kPa(ellipses_of(on.cell), adhesion_forces_nN(fit));
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
  constexpr int kMostFits = 8, kFitsThatPlace = 2;  // adhesions are led back by these, then stay
  constexpr double kSettled = 1e-3;                 // of the forces: far below their errors
  const Eigen::VectorXd measured = measured_um(fit.data);
  std::optional<GelAtRest> gel;
  Eigen::VectorXd of_centres_um;
  for (int step = 0; step < kMostFits; ++step) {
    work.tell(static_cast<double>(step) / kMostFits, "large strains of the gel");
    const Eigen::VectorXd forces = adhesion_forces_nN(fit);
    if (scene.is_under_load && step < kFitsThatPlace) {
      if (step == 0) {
        const auto ellipses = ellipses_of(scene.on.cell);
        of_centres_um = scene.on.gel.response({ellipses}, {centres_of(ellipses)})->displace(forces);
      }
      gel.emplace(scene, led_back(scene, of_centres_um), forces);
    } else if (!gel) {
      gel.emplace(scene, as_seen(scene), forces);
    }
    const substrate::Tangent tangent = gel->about(forces);
    const Eigen::Index n = gel->n_beads();
    of_centres_um = tangent.displacement_um.tail(tangent.displacement_um.size() - n);
    const auto response =
        std::static_pointer_cast<const substrate::KeptResponse>(tangent.response)->at_points(first_of(n / 2));
    // forces of their own stay linear: they are among the motions
    Eigen::VectorXd offset = tangent.displacement_um.head(n) - response->displace(fit.forces_nN);
    if (fit.own) offset -= response->displace(forces - fit.forces_nN);
    fit = refit(about_forces(std::move(fit.data), response, measured, std::move(offset)), next_start(fit));
    const Eigen::VectorXd now = adhesion_forces_nN(fit);
    if (step + 1 >= (scene.is_under_load ? kFitsThatPlace : 1) && (now - forces).norm() < kSettled * now.norm())
      return fit;
  }
  throw NotSolved(Report{.reason = "the forces did not settle on the strained gel in " + std::to_string(kMostFits) +
                                   " fits: switch effects.large_strain off"});
}

}  // namespace mbtfm::fit
