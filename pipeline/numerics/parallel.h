/// Loops over threads that give the same result for any number of them.
#pragma once

#include <functional>

namespace mbtfm::numerics {

/// Call body(i) for i = 0 … n−1 on `threads` threads. The body writes to slot i only. Returns when all are done; the
/// exception of the lowest index is rethrown.
void parallel_for(int n, int threads, const std::function<void(int i)>& body);

/// The number of processors this process may use.
int available_threads();

}  // namespace mbtfm::numerics
