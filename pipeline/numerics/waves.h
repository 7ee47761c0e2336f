/// Vector fields on a periodic lattice and the waves they are made of.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>

#include "pipeline/contract/geometry.h"

namespace mbtfm::numerics {

/// Nodes in rows and columns, one spacing both ways; node (column i, row j) at i + n_columns·j.
struct Lattice {
  Vec2 origin_um;  ///< of node (0, 0)
  double spacing_um = 0;
  int n_columns = 0, n_rows = 0;
  Eigen::Index n_nodes() const { return static_cast<Eigen::Index>(n_columns) * n_rows; }
  Vec2 position_um(int column, int row) const { return origin_um + spacing_um * Vec2{double(column), double(row)}; }
};

/// A vector at each node.
struct NodeField {
  Eigen::ArrayXd x, y;
};

/// Its Fourier transform, for wave numbers kx >= 0: the others are the conjugates. Wave (i, j) at i + n_half·j.
struct WaveField {
  Eigen::ArrayXcd x, y;
};

/// The discrete Fourier transform of one size. Planned without measuring, so the same bits on every call. Of threads
/// two serve: one for each component.
class WaveTransform {
 public:
  WaveTransform(int n_columns, int n_rows);
  ~WaveTransform();
  WaveTransform(const WaveTransform&) = delete;
  WaveTransform& operator=(const WaveTransform&) = delete;

  int n_half() const { return n_columns_ / 2 + 1; }
  Eigen::Index n_waves() const { return static_cast<Eigen::Index>(n_half()) * n_rows_; }
  /// How often wave column i occurs in the whole spectrum, over the number of nodes: a sum over the stored waves with
  /// these weights is the sum over the nodes (Parseval).
  const Eigen::ArrayXd& weights() const { return weights_; }

  WaveField forward(const NodeField& field, int threads = 1) const;
  NodeField backward(WaveField waves, int threads = 1) const;
  /// The same into arrays of the right sizes: fresh memory costs more than the transform. `backward` spoils its input.
  void forward(const NodeField& field, WaveField& waves, int threads) const;
  void backward(WaveField& waves, NodeField& field, int threads) const;
  WaveField no_waves() const;
  NodeField no_field() const;
  double dot(const WaveField& a, const WaveField& b) const;

 private:
  struct Plans;
  int n_columns_, n_rows_;
  Eigen::ArrayXd weights_;  ///< by wave
  std::unique_ptr<Plans> plans_;
};

/// Both sums that `body` returns for part of the waves, over all of them. The parts do not depend on the threads.
Eigen::Array2d sum_over_parts(Eigen::Index n_waves, int threads,
                              const std::function<Eigen::Array2d(Eigen::Index begin, Eigen::Index end)>& body);

/// The smallest size from `at_least` on that transforms quickly: factors 2, 3 and 5 only, and no multiple of 64, whose
/// columns fall on the same lines of the cache (measured: 512 takes five times as long as 540).
int quick_size(int at_least);

}  // namespace mbtfm::numerics
