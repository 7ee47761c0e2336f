/// The models of closed forms: they start quickly and know no finite elements.
#pragma once

#include <memory>

#include "substrate/compliance.h"

namespace mbtfm::greens {

std::unique_ptr<substrate::Substrate> make_half_space(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                      int threads);
std::unique_ptr<substrate::Substrate> make_layer(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                 int threads);
/// The one of these two that the parameters name. @throws UsageError, InvalidData
std::unique_ptr<substrate::Substrate> make_greens(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                  int threads);

}  // namespace mbtfm::greens
