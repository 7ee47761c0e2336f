/// Inside of the tracker of beads in stacks: loops over beads on all threads.
#pragma once

#include <algorithm>
#include <cstddef>

#include "pipeline/numerics/parallel.h"

namespace mbtfm::stacks {

/// Call body(k) for k = 0 … n - 1, some at a time on each thread; it writes to slot k only.
template <class Body>
void for_each(std::size_t n, int threads, const Body& body) {
  constexpr int kChunk = 32;
  const auto count = static_cast<int>(n);
  numerics::parallel_for((count + kChunk - 1) / kChunk, threads, [&](int chunk) {
    for (int k = chunk * kChunk; k < std::min(count, (chunk + 1) * kChunk); ++k) body(static_cast<std::size_t>(k));
  });
}

}  // namespace mbtfm::stacks
