#include "substrate/choice/factory.h"

#include "substrate/boxes/models.h"
#include "substrate/curved/models.h"
#include "substrate/greens/models.h"

namespace mbtfm::choice {

const std::vector<substrate::Model>& models() {
  static const std::vector<substrate::Model> table = {greens::half_space(), greens::layer(), boxes::split(),
                                                      boxes::refined(), curved::curved_gel()};
  return table;
}

std::unique_ptr<substrate::Substrate> make_substrate(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                     int threads) {
  if (parameters.model == substrate::ModelKind::automatic) return make_automatic(gel, parameters, threads);
  return substrate::make_from(models(), gel, parameters, threads);
}

}  // namespace mbtfm::choice
