#include "substrate/models.h"

namespace mbtfm::substrate {

std::unique_ptr<Substrate> make_substrate(const Gel& gel, const SubstrateParameters& parameters, int threads) {
  return make_from({{"half-space", make_half_space},
                    {"layer", make_layer},
                    {"split", make_split},
                    {"refined", make_refined},
                    {"auto", make_automatic}},
                   gel, parameters, threads);
}

}  // namespace mbtfm::substrate
