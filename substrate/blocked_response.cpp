/// blocked_response(): see response.h.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <type_traits>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/response.h"

namespace mbtfm::substrate {
namespace {

using Eigen::MatrixXf;

constexpr int kNodes = 6;         // along each axis of a square
constexpr double kFarFrom = 3.0;  // half sides from its centre

/// A square of the plane.
struct Tile {
  Vec2 centre_um;
  double half_um = 0;
};

double chebyshev_node(int k) { return std::cos(std::numbers::pi * (k + 0.5) / kNodes); }

std::vector<Vec2> nodes_um(const Tile& square) {
  std::vector<Vec2> nodes;
  for (int j = 0; j < kNodes; ++j)
    for (int i = 0; i < kNodes; ++i)
      nodes.push_back(square.centre_um + square.half_um * Vec2{chebyshev_node(i), chebyshev_node(j)});
  return nodes;
}

/// Lagrange's polynomials of the nodes at t in [-1, 1]: 1/n + 2/n Σ T_m(t) T_m(node), the discrete transform.
std::array<double, kNodes> polynomials(double t) {
  const double angle = std::acos(std::clamp(t, -1.0, 1.0));
  std::array<double, kNodes> values{};
  for (int k = 0; k < kNodes; ++k) {
    double sum = 0.5;
    for (int m = 1; m < kNodes; ++m) sum += std::cos(m * angle) * std::cos(m * std::numbers::pi * (k + 0.5) / kNodes);
    values[k] = 2 * sum / kNodes;
  }
  return values;
}

/// Points × nodes: what the value at each node counts at a point.
MatrixXd interpolation(const Tile& square, const std::vector<Vec2>& points_um) {
  MatrixXd weights(points_um.size(), kNodes * kNodes);
  for (std::size_t p = 0; p < points_um.size(); ++p) {
    const Vec2 at = points_um[p] - square.centre_um;
    const double scale = square.half_um > 0 ? 1 / square.half_um : 0;
    const auto along_x = polynomials(scale * at.x), along_y = polynomials(scale * at.y);
    for (std::size_t j = 0; j < kNodes; ++j)
      for (std::size_t i = 0; i < kNodes; ++i)
        weights(static_cast<Index>(p), static_cast<Index>(kNodes * j + i)) = along_x[i] * along_y[j];
  }
  return weights;
}

bool is_far(const Tile& square, const Ellipse& ellipse) {
  const Vec2 d = ellipse.centre_um - square.centre_um;
  return std::max(std::abs(d.x), std::abs(d.y)) - ellipse.semi_major_um >= kFarFrom * square.half_um;
}

/// The points of a square and what acts on them. Single precision: 6e-8 of numbers that are right to 1e-5.
struct Block {
  std::vector<Index> points;            ///< of all
  MatrixXf modes;                       ///< 2·points × modes: the fields that far ellipses have in common …
  std::shared_ptr<const MatrixXf> far;  ///< modes × 2·ellipses: … and how much of each; zero for those near
  std::shared_ptr<const std::vector<Index>> near_columns;
  MatrixXf near;  ///< 2·points × near columns
};

/// Every second row from `first` on.
template <class Matrix>
auto axis_of(Matrix& matrix, Index first) {
  using Plain =
      std::conditional_t<std::is_const_v<Matrix>, const typename Matrix::PlainObject, typename Matrix::PlainObject>;
  return Eigen::Map<Plain, 0, Eigen::Stride<Eigen::Dynamic, 2>>(matrix.data() + first, matrix.rows() / 2, matrix.cols(),
                                                                Eigen::Stride<Eigen::Dynamic, 2>(matrix.rows(), 2));
}

/// The fewest directions at the nodes that have all but a hundred thousandth of these fields: 2·nodes × some.
MatrixXd common_modes(const MatrixXd& at_nodes) {
  constexpr double kLeftOut = 1e-5;
  const auto [values, vectors] = numerics::symmetric_eigen(at_nodes * at_nodes.transpose());
  const VectorXd squares = values.cwiseMax(0.0);
  Index n_left_out = 0;
  for (double sum = 0; n_left_out < squares.size(); ++n_left_out) {
    sum += squares[n_left_out];  // they ascend
    if (sum > kLeftOut * kLeftOut * squares.sum()) break;
  }
  return vectors.rightCols(squares.size() - n_left_out);
}

class Blocked final : public KeptResponse {
 public:
  Blocked(Index n_points, Index n_columns, std::vector<Block> blocks, int threads)
      : n_points_(n_points), n_columns_(n_columns), blocks_(std::move(blocks)), threads_(threads) {}

  Index rows() const override { return 2 * n_points_; }
  Index cols() const override { return n_columns_; }

  MatrixXd displace(const MatrixXd& forces_nN) const override {
    MBTFM_ASSERT(forces_nN.rows() == n_columns_);
    MatrixXd u = MatrixXd::Zero(rows(), forces_nN.cols());
    numerics::parallel_for(static_cast<int>(blocks_.size()), threads_, [&](int b) {
      const Block& block = blocks_[b];
      const MatrixXd own =
          numerics::product(block.modes.cast<double>(), numerics::product(block.far->cast<double>(), forces_nN)) +
          numerics::product(block.near.cast<double>(), forces_nN(*block.near_columns, Eigen::all));
      u(rows_of(block), Eigen::all) = own;
    });
    return u;
  }

  MatrixXd pull_back(const MatrixXd& displacements) const override {
    MBTFM_ASSERT(displacements.rows() == rows());
    constexpr std::size_t kPieces = 8;  // that sums are made of, whatever the threads
    std::vector<MatrixXd> parts(kPieces, MatrixXd::Zero(n_columns_, displacements.cols()));
    numerics::parallel_for(kPieces, threads_, [&](int piece) {
      MatrixXd& sum = parts[piece];
      for (std::size_t b = static_cast<std::size_t>(piece); b < blocks_.size(); b += kPieces) {
        const Block& block = blocks_[b];
        const MatrixXd own = displacements(rows_of(block), Eigen::all);
        sum += numerics::transposed_product(block.far->cast<double>(),
                                            numerics::transposed_product(block.modes.cast<double>(), own));
        sum(*block.near_columns, Eigen::all) += numerics::transposed_product(block.near.cast<double>(), own);
      }
    });
    for (std::size_t piece = 1; piece < kPieces; ++piece) parts.front() += parts[piece];
    return parts.front();
  }

  /// With M the modes, F and N the far and the near part: Fᵀ (Mᵀ W M) F + Fᵀ (Mᵀ W N) + … + Nᵀ W N. The first takes
  /// nearly all the time: as squares of (Mᵀ W M)^½ F, some blocks at once.
  MatrixXd upper_gram(const VectorXd& weight) const override {
    struct Part {
      MatrixXd root_far;  ///< (Mᵀ W M)^½ F
      MatrixXd mixed;     ///< Fᵀ (Mᵀ W N)
      MatrixXd own;       ///< Nᵀ W N
    };
    MatrixXd square = MatrixXd::Zero(n_columns_, n_columns_);
    constexpr std::size_t kAtOnce = 8;
    for (std::size_t begin = 0; begin < blocks_.size(); begin += kAtOnce) {
      std::vector<Part> parts(std::min(kAtOnce, blocks_.size() - begin));
      numerics::parallel_for(static_cast<int>(parts.size()), threads_, [&](int i) {
        const Block& block = blocks_[begin + static_cast<std::size_t>(i)];
        const VectorXd root = weight(rows_of(block)).cwiseSqrt();
        const MatrixXd modes = root.asDiagonal() * block.modes.cast<double>();
        const MatrixXd near = root.asDiagonal() * block.near.cast<double>();
        const MatrixXd far = block.far->cast<double>();
        parts[i] = {numerics::product(square_root(numerics::gram(modes)), far),
                    numerics::transposed_product(far, numerics::transposed_product(modes, near)), numerics::gram(near)};
      });
      Index n_rows = 0;
      for (const Part& part : parts) n_rows += part.root_far.rows();
      MatrixXd roots(n_rows, n_columns_);
      n_rows = 0;
      for (Part& part : parts) {
        roots.middleRows(n_rows, part.root_far.rows()) = part.root_far;
        n_rows += part.root_far.rows();
        part.root_far.resize(0, 0);
      }
      numerics::add_upper_gram(roots, square, threads_);
      for (std::size_t i = 0; i < parts.size(); ++i)
        add_near(*blocks_[begin + i].near_columns, parts[i].mixed, parts[i].own, square);
    }
    fold_up(square);
    return square;
  }

  SharedResponse at_points(const std::vector<Index>& points) const override {
    std::vector<Index> block_of(static_cast<std::size_t>(n_points_)), place_of(block_of.size());
    for (std::size_t b = 0; b < blocks_.size(); ++b)
      for (std::size_t p = 0; p < blocks_[b].points.size(); ++p) {
        block_of[blocks_[b].points[p]] = static_cast<Index>(b);
        place_of[blocks_[b].points[p]] = static_cast<Index>(p);
      }
    std::vector<std::vector<Index>> kept(blocks_.size()), named(blocks_.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto p = static_cast<std::size_t>(points[i]);
      kept[block_of[p]].push_back(place_of[p]);
      named[block_of[p]].push_back(static_cast<Index>(i));
    }
    std::vector<Block> some;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      if (kept[b].empty()) continue;
      std::vector<Index> rows;
      for (const Index p : kept[b]) rows.insert(rows.end(), {2 * p, 2 * p + 1});
      some.push_back({.points = named[b],
                      .modes = blocks_[b].modes(rows, Eigen::all),
                      .far = blocks_[b].far,
                      .near_columns = blocks_[b].near_columns,
                      .near = blocks_[b].near(rows, Eigen::all)});
    }
    return std::make_shared<Blocked>(static_cast<Index>(points.size()), n_columns_, std::move(some), threads_);
  }

 private:
  static std::vector<Index> rows_of(const Block& block) {
    std::vector<Index> rows;
    for (const Index p : block.points) rows.insert(rows.end(), {2 * p, 2 * p + 1});
    return rows;
  }

  /// R with Rᵀ R = A, which may be singular: fewer points than modes.
  static MatrixXd square_root(const MatrixXd& A) {
    const auto [values, vectors] = numerics::symmetric_eigen(A);
    return values.cwiseMax(0.0).cwiseSqrt().asDiagonal() * vectors.transpose();
  }

  /// square += M Eᵀ + E Mᵀ + E O Eᵀ, E picking the near columns. Column by column, as memory lies: what belongs above
  /// the diagonal of another column waits below that of its own, until fold_up().
  static void add_near(const std::vector<Index>& near, const MatrixXd& mixed, const MatrixXd& own, MatrixXd& square) {
    for (std::size_t c = 0; c < near.size(); ++c) {
      const Index column = near[c], at = static_cast<Index>(c);
      square.col(column) += mixed.col(at);
      square(column, column) += mixed(column, at);
      for (std::size_t r = 0; r <= c; ++r)  // the near columns ascend
        square(near[r], column) += own(static_cast<Index>(r), at);
    }
  }
  static void fold_up(MatrixXd& square) {
    for (Index column = 0; column < square.cols(); ++column)
      for (Index row = 0; row < column; ++row) square(row, column) += square(column, row);
  }

  Index n_points_, n_columns_;
  std::vector<Block> blocks_;
  int threads_;
};

/// Points in a part of the plane, halved across its longer side until they are few.
void split(const std::vector<Vec2>& points_um, std::vector<Index> points, std::size_t most,
           std::vector<std::vector<Index>>& parts) {
  const auto [low, high] = mbtfm::extent_of(points, [&](Index p) { return points_um[p]; });
  if (points.size() <= most || low == high) return parts.push_back(std::move(points));
  const bool is_wide = high.x - low.x >= high.y - low.y;
  const double middle = is_wide ? 0.5 * (low.x + high.x) : 0.5 * (low.y + high.y);
  const auto is_below = [&](Index p) {
    const Vec2 at = points_um[p];
    return (is_wide ? at.x : at.y) < middle;
  };
  const auto cut = std::stable_partition(points.begin(), points.end(), is_below);
  split(points_um, {points.begin(), cut}, most, parts);
  split(points_um, {cut, points.end()}, most, parts);
}

Tile tile_around(const std::vector<Vec2>& points_um) {
  const mbtfm::Extent e = mbtfm::extent_of(points_um);
  return {.centre_um = e.middle_um(), .half_um = 0.5 * std::max(e.high_um.x - e.low_um.x, e.high_um.y - e.low_um.y)};
}

Block block_of(const MatrixAt& matrix_at, const std::vector<Vec2>& points_um, std::vector<Index> points,
               const std::vector<Ellipse>& ellipses) {
  std::vector<Vec2> own_um;
  for (const Index p : points) own_um.push_back(points_um[p]);
  const Tile square = tile_around(own_um);
  std::vector<Ellipse> far, near;
  std::vector<Index> far_columns, near_columns;
  for (std::size_t e = 0; e < ellipses.size(); ++e) {
    const bool is_away = is_far(square, ellipses[e]);
    (is_away ? far : near).push_back(ellipses[e]);
    const auto column = 2 * static_cast<Index>(e);
    std::vector<Index>& columns = is_away ? far_columns : near_columns;
    columns.insert(columns.end(), {column, column + 1});
  }
  const MatrixXd at_nodes = matrix_at(nodes_um(square), far);
  const MatrixXd common = common_modes(at_nodes), weights = interpolation(square, own_um);
  MatrixXd modes(2 * static_cast<Index>(own_um.size()), common.cols());
  for (const Index axis : {0, 1}) axis_of(modes, axis) = weights * axis_of(common, axis);
  MatrixXf shares = MatrixXf::Zero(common.cols(), 2 * static_cast<Index>(ellipses.size()));
  shares(Eigen::all, far_columns) = numerics::transposed_product(common, at_nodes).cast<float>();
  return {.points = std::move(points),
          .modes = modes.cast<float>(),
          .far = std::make_shared<const MatrixXf>(std::move(shares)),
          .near_columns = std::make_shared<const std::vector<Index>>(std::move(near_columns)),
          .near = matrix_at(own_um, near).cast<float>()};
}

}  // namespace

SharedResponse blocked_response(const MatrixAt& matrix_at, const std::vector<Vec2>& points_um,
                                const std::vector<Ellipse>& ellipses, int threads) {
  std::vector<std::vector<Index>> parts;
  std::vector<Index> all(points_um.size());
  std::iota(all.begin(), all.end(), Index{0});
  // Far parts take some 30 numbers a block and column, near ones grow with a block's area: this makes both alike.
  const double most = 1.5 * std::sqrt(static_cast<double>(points_um.size()));
  if (!all.empty()) split(points_um, std::move(all), static_cast<std::size_t>(most), parts);
  std::vector<Block> blocks(parts.size());
  numerics::parallel_for(static_cast<int>(parts.size()), threads, [&](int b) {
    const auto i = static_cast<std::size_t>(b);
    blocks[i] = block_of(matrix_at, points_um, std::move(parts[i]), ellipses);
  });
  return std::make_shared<Blocked>(static_cast<Index>(points_um.size()), 2 * static_cast<Index>(ellipses.size()),
                                   std::move(blocks), threads);
}

}  // namespace mbtfm::substrate
