/// For headers that declare a `declare(ParameterList&, …)`.
#pragma once

namespace mbtfm::stage {

class ParameterList;

}  // namespace mbtfm::stage
