#include "substrate/choice/factory.h"

#include "substrate/boxes/models.h"
#include "substrate/greens/models.h"
#include "substrate/models.h"

namespace mbtfm::choice {

std::unique_ptr<substrate::Substrate> make_substrate(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                     int threads) {
  using enum substrate::ModelKind;
  return substrate::make_from({{half_space, greens::make_half_space, true},
                               {layer, greens::make_layer, true},
                               {split, boxes::make_split, false},
                               {refined, boxes::make_refined, false},
                               {automatic, make_automatic, true}},
                              gel, parameters, threads);
}

}  // namespace mbtfm::choice
