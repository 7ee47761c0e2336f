#include "continuum/solids/parameters.h"

#include "continuum/solids/sweep.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/stage/help.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::solids {
namespace {

constexpr double kVolume_um3 = 5000;  ///< where it is not given: of the thesis' cell

}  // namespace

void declare(stage::ParameterList& list, Parameters& p) {
  declare(list, p.gel);
  list.add("radius_um", p.radius_um, Range::thickness_um());
  list.table("cell");
  list.add("volume_um3", p.volume_um3, Range::between(1, 1e7),
           stage::help_on("cell", "volume_um3", {brief(kVolume_um3)}));
  list.add("height_um", p.height_um, Range::zero_or_size_um());
  list.add("youngs_modulus_kPa", p.youngs_modulus_kPa, Range::modulus_kPa());
  list.add("poisson_ratio", p.poisson_ratio, Range{.low = 0, .high = 0.5, .excludes_high = true});
  list.add("contraction_kPa", p.contraction_kPa, Range::between(0, 1e6));
  list.table("indent");
  list.add("strain", p.strain);
  list.add("depths_um", p.depths_um);
  list.add("sweep", p.sweep);
  const auto unset = [](const char* key, int Fineness::*number) {
    return stage::help_on("indent", key,
                          {std::to_string(Fineness{}.*number), std::to_string(kRevolvedFineness.*number)});
  };
  list.add("order", p.order, Range::between(3, 8), unset("order", &Fineness::order));
  list.add("towards_rim", p.towards_rim, Range::between(2, 12), unset("towards_rim", &Fineness::towards_rim));
}

Setting setting_of(const Parameters& p, const Fineness& fineness) {
  return {.volume_um3 = p.volume_um3.value_or(kVolume_um3),
          .cell = {p.youngs_modulus_kPa, p.poisson_ratio, p.contraction_kPa},
          .slab = {p.gel.thickness_um, p.radius_um},
          .gel_poisson_ratio = p.gel.poisson_ratio,
          .depths_um = values_in(p.depths_um, "depths_um", Zero::is_allowed),
          .strain = p.strain,
          .fineness = {p.order.value_or(fineness.order), p.towards_rim.value_or(fineness.towards_rim)}};
}

Case case_of(const Parameters& p) { return {p.height_um, p.gel.youngs_modulus_kPa / p.youngs_modulus_kPa}; }

void expect_sense(const Parameters& p, const Setting& setting, const std::vector<Case>& cases) {
  constexpr double kIncompressible = 0.49999;  // 1 - 2 nu = 2e-5: of 16 digits rounding takes ten
  for (const auto& [who, ratio] : {std::pair{"cell", p.poisson_ratio}, std::pair{"gel", p.gel.poisson_ratio}}) {
    if (ratio > kIncompressible)
      throw UsageError(std::string("[") + who + "] poisson_ratio: expected at most 0.49999, found " +
                       significant(ratio, 9) + ". A cell of 1/2 keeps its volume and does not move at all");
  }
  constexpr double kMostContraction = 0.4;  // beyond it the law of St Venant and Kirchhoff softens in compression
  const double free = setting.cell.free_contraction();
  if (free > kMostContraction)
    throw UsageError(
        "[cell] contraction_kPa: expected a contraction without hindrance, (1 - 2 nu) stress / modulus, of at most "
        "0.4, found " +
        brief(free));
  for (const Case& one : cases)
    if (one.height_um == 0)
      throw UsageError("[cell] height_um is missing: give it in cell.toml, as --height_um or in the sweep");
}

void expect_outline_sense(const Parameters& p) {
  if (!p.sweep.empty())
    throw UsageError("--sweep: expected none with --outline, which is one case; found '" + p.sweep + "'");
  if (p.strain != Strain::small)
    throw UsageError("[indent] strain: expected small with --outline: large strains are for round cells only");
  if (p.volume_um3)
    throw UsageError("[cell] volume_um3: expected none with --outline, found " + brief(*p.volume_um3) +
                     ". The volume follows from the outline and height_um");
}

}  // namespace mbtfm::solids
