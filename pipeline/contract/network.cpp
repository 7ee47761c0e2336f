#include "pipeline/contract/network.h"

namespace mbtfm {

bool is_held(const Network& network, std::size_t vertex) {
  return network.adhesion_id[vertex] != 0 || (!network.held_by_cut.empty() && network.held_by_cut[vertex]);
}

}  // namespace mbtfm
