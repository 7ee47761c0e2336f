/// The models of finite elements.
#pragma once

#include <memory>

#include "substrate/compliance.h"

namespace mbtfm::boxes {

std::unique_ptr<substrate::Substrate> make_split(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                 int threads);
std::unique_ptr<substrate::Substrate> make_refined(const Gel& gel, const substrate::SubstrateParameters& parameters,
                                                   int threads);

}  // namespace mbtfm::boxes
