#include "substrate/effects.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "substrate/layer.h"
#include "substrate/material.h"
#include "substrate/models.h"

namespace mbtfm::substrate {
namespace {

constexpr const char* kThickness = "finite thickness";
constexpr const char* kSides = "finite sides";
constexpr const char* kGrading = "depth-graded gel";
constexpr const char* kVertical = "vertical displacement";
constexpr const char* kSurface = "uneven surface";

void require(bool holds, const std::string& message) {
  if (!holds) throw UsageError("effects." + message);
}

/// A switch that is on needs its datum.
void check_data(const SubstrateParameters& p) {
  require(p.effects.finite_sides != "on" || p.side_distance_um,
          "finite_sides = on: expected substrate.side_distance_um, where the gel's sides are, found none");
  require(p.effects.depth_graded_gel != "on" || !p.modulus_profile.empty(),
          "depth_graded_gel = on: expected substrate.modulus_profile, found none");
}

double thickness_number(const Gel& gel, double scene_um) {
  const double nu = gel.poisson_ratio;
  return 2 * std::abs(layer_correction_at_force(nu).s) / std::hypot(2 - nu, nu) * scene_um / gel.thickness_um;
}

double grading_number(const Gel& gel, const SubstrateParameters& p) {
  const Material material{gel, profile_of(p.modulus_profile)};
  std::vector<double> depths = {0, gel.thickness_um};
  for (const ModulusAtDepth& m : material.profile) {
    if (m.depth_um > 0 && m.depth_um < gel.thickness_um) depths.push_back(m.depth_um);
  }
  double softest = 1, stiffest = 1;
  for (const double depth : depths) {
    for (const double towards : {0.0, gel.thickness_um}) {
      const double relative = relative_modulus(material, depth, towards);
      softest = std::min(softest, relative);
      stiffest = std::max(stiffest, relative);
    }
  }
  return std::max(1 / softest - 1, 1 - 1 / stiffest);
}

Effect decide_sides(const Gel& gel, const SubstrateParameters& p) {
  const std::string& setting = p.effects.finite_sides;
  if (!p.side_distance_um) return decided(kSides, setting, false, "no side_distance_um: they are far away");
  const double distance = *p.side_distance_um / gel.thickness_um;
  return decided(kSides, setting, std::exp(-1.48 * distance), p.effects.effect_tolerance,
                 "at " + brief(distance) + " thicknesses they change the field by");
}

Effect decide_grading(const Gel& gel, const SubstrateParameters& p) {
  const std::string& setting = p.effects.depth_graded_gel;
  if (p.modulus_profile.empty()) return decided(kGrading, setting, false, "no modulus_profile: one modulus throughout");
  return decided(kGrading, setting, grading_number(gel, p), p.effects.effect_tolerance,
                 "the moduli change the field by at most");
}

Effect decide_thickness(const Gel& gel, const SubstrateParameters& p, double scene_um) {
  return decided(
      kThickness, p.effects.finite_thickness, thickness_number(gel, scene_um), p.effects.effect_tolerance,
      "with a scene " + brief(scene_um / gel.thickness_um) + " thicknesses wide the base changes the field by");
}

Effect decide_vertical(const SubstrateParameters& p) {
  const std::string& setting = p.effects.vertical_displacement;
  return decided(kVertical, setting, false,
                 setting == "on" ? "asked for" : "not asked for, and nothing along the surface depends on it");
}

double surface_number(const SubstrateParameters& p, double adhesion_radius_um) {
  const double tilt = 1 - std::cos(p.surface_tilt_deg * std::numbers::pi / 180);
  const double height = adhesion_radius_um > 0 ? p.surface_roughness_um / adhesion_radius_um : 0;
  return std::max(tilt, height);
}

/// No model has it.
Effect decide_surface(const SubstrateParameters& p, const SceneSize& scene) {
  if (p.surface_tilt_deg == 0 && p.surface_roughness_um == 0) {
    return decided(kSurface, "auto", false, "level and smooth: no surface_tilt_deg, no surface_roughness_um");
  }
  Effect effect = decided(kSurface, "auto", surface_number(p, scene.adhesion_radius_um), p.effects.effect_tolerance,
                          "tilt and unevenness change the field by at most");
  if (effect.is_on) effect.why += "; but no model has it: results are off by as much";
  effect.is_on = false;
  return effect;
}

}  // namespace

GelEffects decide(const Gel& gel, const SubstrateParameters& p, const SceneSize& scene) {
  check_data(p);
  GelEffects effects{decide_thickness(gel, p, scene.width_um), decide_sides(gel, p), decide_grading(gel, p),
                     decide_vertical(p), decide_surface(p, scene)};
  for (const Effect& needs_block : {effects.sides, effects.grading}) {
    if (!needs_block.is_on || effects.thickness.is_on) continue;
    require(effects.thickness.setting != "off", "finite_thickness = off, yet " + needs_block.name +
                                                    " is on, whose gel has a base: switch both off or neither");
    effects.thickness.is_on = true;
    effects.thickness.why += "; on for " + needs_block.name + ", whose gel has a base";
  }
  return effects;
}

GelEffects effects_of_model(const SubstrateParameters& p) {
  check_data(p);
  const std::string as_model = "as the model " + p.model + " has it";
  const bool has_base = p.model != "half-space", has_sides = p.model == "split" || p.model == "refined";
  const auto row = [&](const char* name, const char* key, const std::string& setting, bool can_on, bool can_off,
                       bool is_on, const std::string& why) {
    require(setting != "on" || can_on,
            std::string(key) + " = on: the model '" + p.model + "' has none: take another, or auto");
    require(setting != "off" || can_off, std::string(key) + " = off: the model '" + p.model + "' cannot leave it out");
    return decided(name, setting, is_on, why);
  };
  const bool is_graded = !p.modulus_profile.empty() && p.effects.depth_graded_gel != "off";
  if (is_graded && p.model != "refined") {
    throw UsageError("substrate.modulus_profile: the model '" + p.model +
                     "' holds for one modulus at every depth: take the model refined or auto, or switch "
                     "effects.depth_graded_gel off");
  }
  return {
      row(kThickness, "finite_thickness", p.effects.finite_thickness, has_base, !has_base, has_base, as_model),
      row(kSides, "finite_sides", p.effects.finite_sides, has_sides, true, has_sides && p.side_distance_um, as_model),
      row(kGrading, "depth_graded_gel", p.effects.depth_graded_gel, true, true, is_graded, as_model),
      row(kVertical, "vertical_displacement", p.effects.vertical_displacement, true, true, asks_for_vertical(p),
          asks_for_vertical(p) ? "asked for" : "not asked for"),
      decided(kSurface, "auto", false, as_model + ": level and smooth")};
}

SubstrateParameters without_what_is_off(SubstrateParameters p, const GelEffects& effects) {
  if (!effects.sides.is_on) p.side_distance_um.reset();
  if (!effects.grading.is_on) p.modulus_profile.clear();
  return p;
}

}  // namespace mbtfm::substrate
