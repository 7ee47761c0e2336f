#include "continuum/sheet/parameters.h"

#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/stage/effects.h"
#include "pipeline/stage/parameters.h"
#include "substrate/material.h"

namespace mbtfm::sheet {

void declare(stage::ParameterList& list, SheetParameters& p) {
  list.table("sheet");
  list.add("youngs_modulus_kPa", p.youngs_modulus_kPa, Range::modulus_kPa());
  list.add("poisson_ratio", p.poisson_ratio, Range::between(0, 0.5));
  list.add("thickness_um", p.thickness_um, Range::size_um());
  list.add("contraction_nN_per_um", p.contraction_nN_per_um, Range::between(0, 1e4));
  list.add("contraction_kPa", p.contraction_kPa, Range::between(0, 1e4));
  list.add("edge_band_um", p.edge_band_um, Range::size_um());
  list.add("line_tension_nN", p.line_tension_nN, Range::between(0, 1e4));
  list.add("adhesion_stiffness_nN_per_um3", p.adhesion_stiffness_nN_per_um3, Range::between(1e-9, 1e9));
  list.add("ground", p.ground);
  list.add("strain", p.strain);
  list.add("contraction_measure", p.contraction_measure);
  list.add("mesh_um", p.mesh_um, Range::mesh_um());
}

Material material_of(const SheetParameters& p) {
  if (!p.youngs_modulus_kPa)
    throw UsageError("[sheet] youngs_modulus_kPa is missing: give it in cell.toml, or fit it by --displacement");
  if (!p.thickness_um) throw UsageError("[sheet] thickness_um is missing: give it in cell.toml");
  return {*p.youngs_modulus_kPa, p.poisson_ratio, *p.thickness_um};
}

double contraction_of(const SheetParameters& p) {
  if (p.contraction_nN_per_um && p.contraction_kPa)
    throw UsageError("[sheet] contraction_nN_per_um and contraction_kPa are both given");
  if (p.contraction_nN_per_um) return *p.contraction_nN_per_um;
  if (!p.contraction_kPa)
    throw UsageError(
        "[sheet] contraction_nN_per_um (or contraction_kPa) is missing: give it, or fit it by --displacement");
  if (!p.thickness_um) throw UsageError("[sheet] thickness_um is missing: contraction_kPa needs it");
  return *p.contraction_kPa * *p.thickness_um;
}

double gel_over_adhesions(const Material& material, double adhesion_nN_per_um3, const Gel& gel) {
  const double mu = substrate::shear_modulus_kPa(gel);
  const double l_um = std::sqrt(material.stiffness_nN_per_um() / adhesion_nN_per_um3);
  return adhesion_nN_per_um3 * (1 - gel.poisson_ratio) * l_um / mu;
}

double free_contraction(const Material& material, double contraction_nN_per_um) {
  return contraction_nN_per_um * (1 - material.poisson_ratio) / material.youngs_tension_nN_per_um();
}

GroundChoice decide_ground(std::optional<Ground> asked, const Material& material,
                           std::optional<double> adhesion_nN_per_um3, const std::optional<Gel>& gel) {
  const bool has_springs = adhesion_nN_per_um3.has_value();
  if (asked == Ground::springs && !has_springs)
    throw UsageError("[sheet] adhesion_stiffness_nN_per_um3 is missing: ground = springs needs it");
  if (asked == Ground::gel && !gel) throw UsageError("[gel] youngs_modulus_kPa is missing: ground = gel needs it");
  if (!asked && !gel && !has_springs)
    throw UsageError(
        "the sheet has no ground: give [gel] youngs_modulus_kPa, or [sheet] adhesion_stiffness_nN_per_um3 for springs");
  if (asked)
    return {*asked, stage::decided(EffectKind::gel_response, switched(*asked == Ground::gel), *asked == Ground::gel,
                                   std::string("ground = ") + name_of(*asked))};
  if (!gel)
    return {Ground::springs, stage::decided(EffectKind::gel_response, Switch::automatic, false, "no gel is given")};
  if (!has_springs)
    return {Ground::gel,
            stage::decided(EffectKind::gel_response, Switch::automatic, true, "the sheet is bonded to it")};
  const double beta = gel_over_adhesions(material, *adhesion_nN_per_um3, *gel);
  const Effect effect = stage::decided(EffectKind::gel_response, Switch::automatic, beta, kLargestBeta,
                                       "over its adhesions the gel gives way by");
  return {effect.is_on ? Ground::gel : Ground::springs, effect};
}

Effect decide_strain(std::optional<Strain> asked, double contraction, Ground ground) {
  const Switch setting = asked ? switched(*asked == Strain::large) : Switch::automatic;
  if (ground == Ground::springs || asked == Strain::large)
    return stage::decided(EffectKind::large_strain, setting, contraction, kLargestStrain,
                          "a sheet that nothing holds would contract by");
  return stage::decided(EffectKind::large_strain, switched(false), false,
                        "small strains, unless strain = large: a free sheet would contract by " + brief(contraction));
}

}  // namespace mbtfm::sheet
