#include "substrate/choice/factory.h"

#include "pipeline/contract/errors.h"
#include "substrate/elements/models.h"
#include "substrate/greens/models.h"

namespace mbtfm::choice {

#ifdef MBTFM_FINITE_ELEMENTS
const std::vector<substrate::Model>& models() {
  static const std::vector<substrate::Model> table = {greens::half_space(), greens::layer(), elements::split(),
                                                      elements::refined(), elements::curved_gel()};
  return table;
}
#else
namespace {
std::unique_ptr<substrate::Substrate> not_built(const Gel&, const substrate::SubstrateParameters& parameters, int) {
  throw UsageError(
      "this build has no finite elements, and substrate.model = " + std::string(name_of(parameters.model)) +
      " needs them: build all programs with ./samples/demo.sh --all, or take the model 'half-space' or 'layer'");
}
}  // namespace

/// The same table: what a scene needs does not depend on what was built.
const std::vector<substrate::Model>& models() {
  using enum substrate::ModelKind;
  static const std::vector<substrate::Model> table = {
      greens::half_space(),
      greens::layer(),
      {.kind = split, .can = elements::kSplitCan, .make = not_built},
      {.kind = refined, .can = elements::kRefinedCan, .make = not_built},
      {.kind = curved, .can = elements::kCurvedCan, .make = not_built}};
  return table;
}
#endif

std::unique_ptr<substrate::Substrate> make_substrate(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                     int threads) {
  if (parameters.model == substrate::ModelKind::automatic) return make_automatic(gel, parameters, threads);
  return substrate::make_from(models(), gel, parameters, threads);
}

}  // namespace mbtfm::choice
