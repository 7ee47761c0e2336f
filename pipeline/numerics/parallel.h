/// Loops over threads that give the same result for any number of them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>

namespace mbtfm::numerics {

/// Call body(i) for i = 0 … n−1 on `threads` threads. The body writes to slot i only. Returns when all are done; the
/// exception of the lowest index is rethrown.
void parallel_for(int n, int threads, const std::function<void(int i)>& body);

/// The same for many short bodies: 64 neighbours at a time, so that handing them out costs nothing.
template <class Body>
void parallel_for_each(std::size_t n, int threads, const Body& body) {
  constexpr int kRun = 64;
  const auto count = static_cast<int>(n);
  parallel_for((count + kRun - 1) / kRun, threads, [&](int run) {
    for (int i = run * kRun; i < std::min(count, (run + 1) * kRun); ++i) body(static_cast<std::size_t>(i));
  });
}

/// The number of processors this process may use.
int available_threads();

}  // namespace mbtfm::numerics
