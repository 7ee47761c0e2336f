#include "substrate/greens/models.h"

namespace mbtfm::greens {

std::unique_ptr<substrate::Substrate> make_greens(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                  int threads) {
  return substrate::make_from({half_space(), layer()}, gel, parameters, threads);
}

}  // namespace mbtfm::greens
