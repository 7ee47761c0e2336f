#include "pipeline/numerics/dense_panel.h"

#include <limits>
#include <vector>

namespace mbtfm::numerics {
namespace {

struct Routines {
  void (*partial_cholesky)(const DenseColumns& l, const double* least_pivot, double* change, double* strips);
  void (*solve_lower)(const DenseFactor& l, double* rows, std::size_t n_right_hand_sides);
  void (*solve_upper)(const DenseFactor& l, double* rows, std::size_t n_right_hand_sides);
};

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
#include "pipeline/numerics/dense_panel.inc"
}  // namespace baseline

// (GCC's target_clones would not do: it takes vectors apart for the baseline before it makes the clones.)
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC target("avx2,fma")
namespace avx2 {
constexpr std::size_t kWidth = 4, kLanes = 2;
#include "pipeline/numerics/dense_panel.inc"
}  // namespace avx2
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("avx512f,prefer-vector-width=512")
namespace avx512 {
constexpr std::size_t kWidth = 8, kLanes = 1;
#include "pipeline/numerics/dense_panel.inc"
}  // namespace avx512
#pragma GCC pop_options

Routines choose() {
  if (__builtin_cpu_supports("avx512f")) return avx512::kRoutines;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return avx2::kRoutines;
  return baseline::kRoutines;
}
#else
Routines choose() { return baseline::kRoutines; }
#endif

const Routines& for_this_processor() {
  static const Routines chosen = choose();
  return chosen;
}

}  // namespace

void partial_cholesky(const DenseColumns& columns, const double* least_pivot, double* change) {
  struct alignas(64) CacheLine {
    double values[8];
  };
  thread_local std::vector<CacheLine> strips;
  strips.resize((columns.height + kMostRows) * kDepth / 8);
  for_this_processor().partial_cholesky(columns, least_pivot, change, strips.data()->values);
}

void solve_lower(const DenseFactor& factor, double* rows, std::size_t n_right_hand_sides) {
  for_this_processor().solve_lower(factor, rows, n_right_hand_sides);
}

void solve_upper(const DenseFactor& factor, double* rows, std::size_t n_right_hand_sides) {
  for_this_processor().solve_upper(factor, rows, n_right_hand_sides);
}

}  // namespace mbtfm::numerics
