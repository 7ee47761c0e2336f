#include "substrate/choice/factory.h"

#include "substrate/boxes/models.h"
#include "substrate/greens/models.h"

namespace mbtfm::choice {

const std::vector<substrate::Model>& models() {
  static const std::vector<substrate::Model> table = {greens::half_space(), greens::layer(), boxes::split(),
                                                      boxes::refined()};
  return table;
}

std::unique_ptr<substrate::Substrate> make_substrate(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                     int threads) {
  if (parameters.model == "auto") return make_automatic(gel, parameters, threads);
  std::vector<substrate::Model> words = models();
  words.push_back({.name = "auto", .can = {}, .make = make_automatic});  // for the message that lists them
  return substrate::make_from(words, gel, parameters, threads);
}

}  // namespace mbtfm::choice
