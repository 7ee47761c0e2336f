#include "network/partial_cholesky.h"

#include <limits>
#include <vector>

namespace mbtfm::network {
namespace {

// Columns of a tile of the product, which is summed up in registers; its rows are kLanes vectors of kWidth, eight of
// sixteen registers in all, or four of thirty-two.
constexpr std::size_t kColumns = 4;
// Columns eliminated one by one before all to the right of them are updated at once: these stay in the nearest cache.
constexpr std::size_t kChunk = 16;
// Columns of the factor multiplied at once: eight rows of them take a quarter of the nearest cache.
constexpr std::size_t kDepth = 128;
constexpr std::size_t kMostRows = 8;  // of a tile
constexpr double kInfinity = std::numeric_limits<double>::infinity();

namespace baseline {
constexpr std::size_t kWidth = 2, kLanes = 2;
#include "network/partial_cholesky.inc"
}  // namespace baseline

// (GCC's target_clones would not do: it takes vectors apart for the baseline before it makes the clones.)
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC target("avx2,fma")
namespace avx2 {
constexpr std::size_t kWidth = 4, kLanes = 2;
#include "network/partial_cholesky.inc"
}  // namespace avx2
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("avx512f,prefer-vector-width=512")
namespace avx512 {
constexpr std::size_t kWidth = 8, kLanes = 1;
#include "network/partial_cholesky.inc"
}  // namespace avx512
#pragma GCC pop_options

auto version_for_this_processor() {
  if (__builtin_cpu_supports("avx512f")) return avx512::partial_cholesky;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return avx2::partial_cholesky;
  return baseline::partial_cholesky;
}
#else
auto version_for_this_processor() { return baseline::partial_cholesky; }
#endif

}  // namespace

void partial_cholesky(const DenseColumns& columns, const double* least_pivot, double* change) {
  static const auto version = version_for_this_processor();
  thread_local std::vector<double> strips;
  strips.resize((columns.height + kMostRows) * kDepth);
  version(columns, least_pivot, change, strips.data());
}

}  // namespace mbtfm::network
