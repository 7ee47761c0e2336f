#include "substrate/models.h"

namespace mbtfm::substrate {

std::unique_ptr<Substrate> make_substrate(const Gel& gel, const SubstrateParameters& parameters, int threads) {
  return make_from({{"half-space", make_half_space, true},
                    {"layer", make_layer, true},
                    {"split", make_split, false},
                    {"refined", make_refined, false},
                    {"auto", make_automatic, true}},
                   gel, parameters, threads);
}

}  // namespace mbtfm::substrate
