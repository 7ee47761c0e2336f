#include "substrate/choice/decide.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/surface.h"
#include "substrate/choice/factory.h"
#include "substrate/greens/layer.h"
#include "substrate/material.h"

namespace mbtfm::choice {
namespace {

double thickness_number(const Gel& gel, double scene_um) {
  const double nu = gel.poisson_ratio;
  return 2 * std::abs(greens::layer_correction_at_force(nu).s) / std::hypot(2 - nu, nu) * scene_um / gel.thickness_um;
}

double grading_number(const Gel& gel, const substrate::SubstrateParameters& p) {
  const substrate::Material material{gel, substrate::profile_of(p.modulus_profile)};
  std::vector<double> depths = {0, gel.thickness_um};
  for (const substrate::ModulusAtDepth& m : material.profile) {
    if (m.depth_um > 0 && m.depth_um < gel.thickness_um) depths.push_back(m.depth_um);
  }
  double softest = 1, stiffest = 1;
  for (const double depth : depths) {
    for (const double towards : {0.0, gel.thickness_um}) {
      const double relative = substrate::relative_modulus(material, depth, towards);
      softest = std::min(softest, relative);
      stiffest = std::max(stiffest, relative);
    }
  }
  return std::max(1 / softest - 1, 1 - 1 / stiffest);
}

Effect decide_sides(const Gel& gel, const substrate::SubstrateParameters& p) {
  const Switch setting = p.effects.finite_sides;
  if (!p.side_distance_um)
    return stage::decided(EffectKind::finite_sides, setting, false, "no side_distance_um: they are far away");
  const double distance = *p.side_distance_um / gel.thickness_um;
  return stage::decided(EffectKind::finite_sides, setting, std::exp(-1.48 * distance), p.effects.effect_tolerance,
                        "at " + brief(distance) + " thicknesses they change the field by");
}

Effect decide_grading(const Gel& gel, const substrate::SubstrateParameters& p) {
  const Switch setting = p.effects.depth_graded_gel;
  if (p.modulus_profile.empty())
    return stage::decided(EffectKind::depth_graded_gel, setting, false, "no modulus_profile: one modulus throughout");
  return stage::decided(EffectKind::depth_graded_gel, setting, grading_number(gel, p), p.effects.effect_tolerance,
                        "the moduli change the field by at most");
}

Effect decide_thickness(const Gel& gel, const substrate::SubstrateParameters& p, double scene_um) {
  return stage::decided(
      EffectKind::finite_thickness, p.effects.finite_thickness, thickness_number(gel, scene_um),
      p.effects.effect_tolerance,
      "with a scene " + brief(scene_um / gel.thickness_um) + " thicknesses wide the base changes the field by");
}

Effect decide_vertical(const substrate::SubstrateParameters& p) {
  const Switch setting = p.effects.vertical_displacement;
  return stage::decided(
      EffectKind::vertical_displacement, setting, false,
      setting == Switch::on ? "asked for" : "not asked for, and nothing along the surface depends on it");
}

// Of the field of adhesions of 1 um, against that on a flat gel: 0.38 to 0.46 of the largest slope on waves and egg
// boxes of 10 to 40 um with slopes from 0.1 to 0.4, 0.33 on a cap of 100 um.
constexpr double kChangeBySlope = 0.4;

double surface_number(const substrate::SubstrateParameters& p, double adhesion_radius_um) {
  const double tilt = 1 - std::cos(p.surface_tilt_deg * std::numbers::pi / 180);
  const double height = adhesion_radius_um > 0 ? p.surface_roughness_um / adhesion_radius_um : 0;
  return std::max(tilt, height);
}

double steepest(const HeightMap& map) {
  double steepest = 0;
  for (int j = 0; j < map.n_y; ++j) {
    for (int i = 0; i < map.n_x; ++i) {
      const auto z = [&](int a, int b) { return map.z_um[static_cast<std::size_t>(b) * map.n_x + a]; };
      if (i > 0) steepest = std::max(steepest, std::abs(z(i, j) - z(i - 1, j)) / map.spacing_um.x);
      if (j > 0) steepest = std::max(steepest, std::abs(z(i, j) - z(i, j - 1)) / map.spacing_um.y);
    }
  }
  return steepest;
}

/// No model has a surface that is only stated to be uneven.
Effect decide_surface(const Gel& gel, const substrate::SubstrateParameters& p, const SceneSize& scene) {
  if (gel.surface) {
    return stage::decided(EffectKind::uneven_surface, Switch::automatic, kChangeBySlope * steepest(*gel.surface),
                          p.effects.effect_tolerance, "the slopes of the surface change the field by some");
  }
  if (p.surface_tilt_deg == 0 && p.surface_roughness_um == 0) {
    return stage::decided(EffectKind::uneven_surface, Switch::automatic, false,
                          "level and smooth: no surface_tilt_deg, no surface_roughness_um");
  }
  Effect effect =
      stage::decided(EffectKind::uneven_surface, Switch::automatic, surface_number(p, scene.adhesion_radius_um),
                     p.effects.effect_tolerance, "tilt and unevenness change the field by at most");
  if (effect.is_on) effect.why += "; but no model has it: results are off by as much";
  effect.is_on = false;
  return effect;
}

/// Of forces that are not known yet.
Effect decide_strain(const substrate::SubstrateParameters& p) {
  const Switch setting = p.effects.large_strain;
  return stage::decided(EffectKind::large_strain, setting, false,
                        setting == Switch::on ? "asked for" : "not asked for, and no force is known yet");
}

}  // namespace

substrate::GelEffects decide(const Gel& gel, const substrate::SubstrateParameters& p, const SceneSize& scene) {
  substrate::check_data(p);
  substrate::GelEffects effects{decide_thickness(gel, p, scene.width_um),
                                decide_sides(gel, p),
                                decide_grading(gel, p),
                                decide_vertical(p),
                                decide_surface(gel, p, scene),
                                decide_strain(p)};
  for (const Effect& needs_block : {effects.sides, effects.grading}) {
    if (!needs_block.is_on || effects.thickness.is_on) continue;
    const std::string name = name_of(needs_block.kind);
    substrate::require_of_effects(
        effects.thickness.setting != Switch::off,
        "finite_thickness = off, yet " + name + " is on, whose gel has a base: switch both off or neither");
    effects.thickness.is_on = true;
    effects.thickness.why += "; on for " + name + ", whose gel has a base";
  }
  return effects;
}

}  // namespace mbtfm::choice
