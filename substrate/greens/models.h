/// The models of closed forms: they start quickly and know no finite elements.
#pragma once

#include "substrate/models.h"

namespace mbtfm::greens {

substrate::Model half_space();
substrate::Model layer();
/// The one of these two that the parameters name. @throws UsageError, InvalidData
std::unique_ptr<substrate::Substrate> make_greens(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                  int threads);

}  // namespace mbtfm::greens
