/// The models of finite elements.
#pragma once

#include "substrate/models.h"

namespace mbtfm::boxes {

substrate::Model split();
substrate::Model refined();

}  // namespace mbtfm::boxes
