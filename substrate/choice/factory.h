/// All models.
#pragma once

#include "substrate/models.h"

namespace mbtfm::choice {

/// The table of models, the cheapest first. A model is one row.
const std::vector<substrate::Model>& models();

/// The model named in the parameters. The same bits for any number of threads. @throws UsageError, InvalidData
std::unique_ptr<substrate::Substrate> make_substrate(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                     int threads);
/// `auto`: the model is chosen by the scene of each call.
std::unique_ptr<substrate::Substrate> make_automatic(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                     int threads);

}  // namespace mbtfm::choice
