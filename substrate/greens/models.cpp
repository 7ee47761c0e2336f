#include "substrate/greens/models.h"

#include "substrate/greens/models.h"
#include "substrate/models.h"

namespace mbtfm::greens {

std::unique_ptr<substrate::Substrate> make_greens(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                  int threads) {
  return substrate::make_from(
      {{substrate::ModelKind::half_space, make_half_space, true}, {substrate::ModelKind::layer, make_layer, true}}, gel,
      parameters, threads);
}

}  // namespace mbtfm::greens
