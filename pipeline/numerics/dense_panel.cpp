#include "pipeline/numerics/dense_panel.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "pipeline/numerics/parallel.h"

namespace mbtfm::numerics {
namespace {

/// Of rows or columns.
struct Span {
  std::size_t begin, end;
  std::size_t size() const { return end - begin; }
};

template <class Real>
struct Routines {
  void (*subtract_product)(const DensePanel<Real>& l, Span depth, Span b, Span a, Real* to, std::size_t stride,
                           bool is_there, Real* scratch);
  void (*eliminate)(const DensePanel<Real>& l, Span columns, Span rows, const Real* least_pivot, Real* scratch);
  void (*solve_lower)(const DensePanel<const Real>& l, Real* rows, std::size_t n_right_hand_sides);
  void (*solve_upper)(const DensePanel<const Real>& l, Real* rows, std::size_t n_right_hand_sides);
};

// Columns of a tile of the product, which is summed up in registers; its rows are kLanes vectors of kWidth, eight of
// sixteen registers in all, or four of thirty-two.
constexpr std::size_t kColumns = 4;
// Columns eliminated one by one before all to the right of them are updated at once: these stay in the nearest cache.
constexpr std::size_t kChunk = 16;
// Columns of the factor multiplied at once: eight rows of them take a quarter of the nearest cache.
constexpr std::size_t kDepth = 128;
// What threads share of a large panel, and what the second cache holds of it.
constexpr std::size_t kPanelColumns = 192, kTileRows = TriangleStrips::kColumns;
constexpr std::size_t kMostRows = 16;  // of a tile in registers
constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline __attribute__((always_inline)) double square_root(double x) { return __builtin_sqrt(x); }
inline __attribute__((always_inline)) float square_root(float x) { return __builtin_sqrtf(x); }

#define MBTFM_SCALARS(kBytes, kVectorsOfRows)                         \
  namespace of_double {                                               \
  using Real = double;                                                \
  constexpr std::size_t kWidth = kBytes / 8, kLanes = kVectorsOfRows; \
  }                                                                   \
  namespace of_float {                                                \
  using Real = float;                                                 \
  constexpr std::size_t kWidth = kBytes / 4, kLanes = kVectorsOfRows; \
  }

namespace baseline {
MBTFM_SCALARS(16, 2)
namespace of_double {
#include "pipeline/numerics/dense_panel.inc"
}  // namespace of_double
namespace of_float {
#include "pipeline/numerics/dense_panel.inc"
}  // namespace of_float
}  // namespace baseline

// (GCC's target_clones would not do: it takes vectors apart for the baseline before it makes the clones.)
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define MBTFM_HAS_SETS 1
#pragma GCC push_options
#pragma GCC target("avx2")
namespace avx2 {
MBTFM_SCALARS(32, 2)
namespace of_double {
#include "pipeline/numerics/dense_panel.inc"
}  // namespace of_double
namespace of_float {
#include "pipeline/numerics/dense_panel.inc"
}  // namespace of_float
}  // namespace avx2
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("avx512f,prefer-vector-width=512")
namespace avx512 {
MBTFM_SCALARS(64, 1)
namespace of_double {
#include "pipeline/numerics/dense_panel.inc"
}  // namespace of_double
namespace of_float {
#include "pipeline/numerics/dense_panel.inc"
}  // namespace of_float
}  // namespace avx512
#pragma GCC pop_options
#endif

template <class Real>
const Routines<Real>& routines(Instructions set) {
  constexpr bool is_double = sizeof(Real) == sizeof(double);
#define MBTFM_ROUTINES(set)           \
  if constexpr (is_double)            \
    return set::of_double::kRoutines; \
  else                                \
    return set::of_float::kRoutines;
#ifdef MBTFM_HAS_SETS
  if (set == Instructions::avx512) {
    MBTFM_ROUTINES(avx512)
  }
  if (set == Instructions::avx2) {
    MBTFM_ROUTINES(avx2)
  }
#endif
  MBTFM_ROUTINES(baseline)
}

/// Of this thread, for the strips of one product.
template <class Real>
Real* scratch() {
  struct alignas(64) CacheLine {
    Real values[64 / sizeof(Real)];
  };
  thread_local std::vector<CacheLine> lines((kPanelColumns + 2 * kTileRows + 2 * kMostRows) * kDepth * sizeof(Real) /
                                            64);
  return lines.data()->values;
}

std::size_t n_tiles(std::size_t n_rows) { return (n_rows + kTileRows - 1) / kTileRows; }
Span tile(Span rows, std::size_t t) {
  return {rows.begin + t * kTileRows, std::min(rows.begin + (t + 1) * kTileRows, rows.end)};
}

}  // namespace

std::vector<Instructions> known_instructions() {
  std::vector<Instructions> known{Instructions::baseline};
#ifdef MBTFM_HAS_SETS
  if (__builtin_cpu_supports("avx2")) known.push_back(Instructions::avx2);
  if (__builtin_cpu_supports("avx512f")) known.push_back(Instructions::avx512);
#endif
  return known;
}

Instructions fastest_instructions() {
  static const Instructions fastest = known_instructions().back();
  return fastest;
}

template <class Real>
void partial_cholesky(const DensePanel<Real>& l, const Real* least_pivot, Real* change, int threads,
                      Instructions instructions) {
  const Routines<Real>& use = routines<Real>(instructions);
  const auto take = [&](Span columns, Span rows) {
    if (columns.begin > 0)
      use.subtract_product(l, {0, columns.begin}, columns, rows, l.values + columns.begin * l.height + rows.begin,
                           l.height, true, scratch<Real>());
    use.eliminate(l, columns, rows, least_pivot, scratch<Real>());
  };
  for (std::size_t begin = 0; begin < l.width; begin += kPanelColumns) {
    const Span columns{begin, std::min(begin + kPanelColumns, l.width)}, below{columns.end, l.height};
    if (below.size() <= kTileRows) {
      take(columns, {begin, l.height});
      continue;
    }
    take(columns, columns);
    numerics::parallel_for(static_cast<int>(n_tiles(below.size())), threads,
                           [&](int t) { take(columns, tile(below, static_cast<std::size_t>(t))); });
  }
  const Span below{l.width, l.height};
  const std::size_t n = n_tiles(below.size());
  const TriangleStrips strips{below.size()};
  const auto square = [&](Span b, Span a) {
    const std::size_t column = b.begin - l.width;
    use.subtract_product(l, {0, l.width}, b, a, change + strips.at(a.begin - l.width, column), strips.stride(column),
                         false, scratch<Real>());
  };
  if (n == 1) return square(below, below);
  numerics::parallel_for(static_cast<int>(n * (n + 1) / 2), threads, [&](int which) {
    std::size_t i = static_cast<std::size_t>(which), j = 0;
    for (; i >= n - j; ++j) i -= n - j;  // tiles of the lower triangle, column by column
    square(tile(below, j), tile(below, i + j));
  });
}

template <class Real>
void solve_lower(const DensePanel<const Real>& factor, Real* rows, std::size_t n_right_hand_sides,
                 Instructions instructions) {
  routines<Real>(instructions).solve_lower(factor, rows, n_right_hand_sides);
}

template <class Real>
void solve_upper(const DensePanel<const Real>& factor, Real* rows, std::size_t n_right_hand_sides,
                 Instructions instructions) {
  routines<Real>(instructions).solve_upper(factor, rows, n_right_hand_sides);
}

#define MBTFM_FOR(Real)                                                                           \
  template void partial_cholesky(const DensePanel<Real>&, const Real*, Real*, int, Instructions); \
  template void solve_lower(const DensePanel<const Real>&, Real*, std::size_t, Instructions);     \
  template void solve_upper(const DensePanel<const Real>&, Real*, std::size_t, Instructions);
MBTFM_FOR(double)
MBTFM_FOR(float)
#undef MBTFM_FOR

}  // namespace mbtfm::numerics
