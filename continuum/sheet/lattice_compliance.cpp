#include "continuum/sheet/lattice_compliance.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <ranges>

#include "pipeline/contract/extent.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::sheet {
namespace {

constexpr int kOrder = 6;              // nodes along each axis of a polynomial: of degree 5
constexpr double kApart = 6;           // spacings between patches that the lattice alone answers for
constexpr double kHalfWidth = 0.9;     // of a patch, in roots of its area: what is subtracted from a distance
constexpr double kMostNodes = 250000;  // 1 000 × 1 000 with the padding: 30 ms a transform

/// Lagrange's polynomials through the nodes 0 … kOrder − 1.
std::array<double, kOrder> weights_at(double x) {
  std::array<double, kOrder> weights;
  for (int i = 0; i < kOrder; ++i) {
    weights[i] = 1;
    for (int k = 0; k < kOrder; ++k)
      if (k != i) weights[i] *= (x - k) / (i - k);
  }
  return weights;
}

/// Around all patches, with room for the polynomials; as fine as the middle patch.
numerics::Lattice lattice_around(const Patches& patches) {
  const auto place_um = [&](int k) { return patches.at(k / Elements::kPoints, k % Elements::kPoints).place_um; };
  const auto [low, high] = extent_of(std::views::iota(0, patches.n() * Elements::kPoints), place_um);
  const Vec2 size = high - low;
  const double spacing =
      std::max(std::sqrt(numerics::median(patches.areas_um2)), std::sqrt(size.x * size.y / kMostNodes));
  const double margin = 0.5 * kOrder * spacing;
  return {.origin_um = low - Vec2{margin, margin},
          .spacing_um = spacing,
          .n_columns = static_cast<int>(std::ceil(size.x / spacing)) + kOrder + 1,
          .n_rows = static_cast<int>(std::ceil(size.y / spacing)) + kOrder + 1};
}

}  // namespace

LatticeCompliance::LatticeCompliance(const Patches& patches, const substrate::Substrate& gel, int threads)
    : lattice_(lattice_around(patches)),
      padded_columns_(numerics::quick_size(2 * lattice_.n_columns)),
      padded_rows_(numerics::quick_size(2 * lattice_.n_rows)),
      transform_(padded_columns_, padded_rows_) {
  const Kernel kernel = kernel_of(gel);
  std::vector<Stencil> stencils(static_cast<std::size_t>(patches.n()));
  numerics::parallel_for_each(stencils.size(), threads,
                              [&](std::size_t i) { stencils[i] = stencil_of(patches, static_cast<int>(i)); });
  set_means(stencils);
  set_waves(kernel);
  set_near(patches, gel, stencils, kernel, threads);
}

LatticeCompliance::Kernel LatticeCompliance::kernel_of(const substrate::Substrate& gel) const {
  constexpr double kPoint = 0.05;  // spacings: at the nearest nodes 3e-4 off a point force, where N has the pair anyway
  std::vector<Vec2> offsets;
  for (int row = 0; row < lattice_.n_rows; ++row)
    for (int column = 0; column < lattice_.n_columns; ++column)
      offsets.push_back(lattice_.spacing_um * Vec2{double(column), double(row)});
  const double radius = kPoint * lattice_.spacing_um;
  const MatrixXd field = gel.compliance_um_per_nN(
      offsets, {{.centre_um = {}, .semi_major_um = radius, .semi_minor_um = radius, .angle_rad = 0}});
  Kernel kernel{.most_columns = lattice_.n_columns - 1, .most_rows = lattice_.n_rows - 1, .components = {}};
  for (std::vector<double>& component : kernel.components)
    component.resize(kernel.at(kernel.most_columns, kernel.most_rows) + 1);
  for (int row = -kernel.most_rows; row <= kernel.most_rows; ++row)
    for (int column = -kernel.most_columns; column <= kernel.most_columns; ++column) {
      const Index i = 2 * (static_cast<Index>(std::abs(row)) * lattice_.n_columns + std::abs(column));
      const double sign = (column < 0) != (row < 0) ? -1 : 1;
      const std::array<double, 3> value = {field(i, 0), sign * field(i, 1), field(i + 1, 1)};
      for (std::size_t c = 0; c < 3; ++c) kernel.components[c][kernel.at(column, row)] = value[c];
    }
  return kernel;
}

LatticeCompliance::Stencil LatticeCompliance::stencil_of(const Patches& patches, int patch) const {
  std::map<std::array<int, 2>, double> weights;
  for (int p = 0; p < Elements::kPoints; ++p) {
    const Vec2 at = 1 / lattice_.spacing_um * (patches.at(patch, p).place_um - lattice_.origin_um);
    const int column = static_cast<int>(std::floor(at.x)) - kOrder / 2 + 1,
              row = static_cast<int>(std::floor(at.y)) - kOrder / 2 + 1;
    const auto along_x = weights_at(at.x - column), along_y = weights_at(at.y - row);
    for (int i = 0; i < kOrder; ++i)
      for (int j = 0; j < kOrder; ++j)
        weights[{column + i, row + j}] += patches.share(patch, p) * along_x[i] * along_y[j];
  }
  Stencil stencil;
  for (const auto& [node, weight] : weights) {
    stencil.node.push_back(node);
    stencil.weight.push_back(weight);
  }
  return stencil;
}

MatrixXd LatticeCompliance::by_lattice(const std::vector<Stencil>& stencils, const std::vector<int>& of, int j,
                                       const Kernel& kernel) {
  const Stencil& source = stencils[j];
  std::array<int, 2> low = source.node.front(), high = low;  // of a box around all of them
  for (const int i : of)
    for (const std::array<int, 2>& node : stencils[i].node)
      for (std::size_t axis = 0; axis < 2; ++axis) {
        low[axis] = std::min(low[axis], node[axis]);
        high[axis] = std::max(high[axis], node[axis]);
      }
  const int n_columns = high[0] - low[0] + 1, n_rows = high[1] - low[1] + 1;
  const auto at = [&](const std::array<int, 2>& node) { return (node[1] - low[1]) * n_columns + node[0] - low[0]; };
  std::vector<char> is_asked(static_cast<std::size_t>(n_columns * n_rows));
  for (const int i : of)
    for (const std::array<int, 2>& node : stencils[i].node) is_asked[at(node)] = 1;
  Eigen::ArrayXXd field = Eigen::ArrayXXd::Zero(n_columns * n_rows, 3);
  for (int row = 0; row < n_rows; ++row) {
    const auto first = is_asked.begin() + row * n_columns, end = first + n_columns;
    for (auto from = std::find(first, end, 1); from != end;) {  // a run of nodes side by side
      const auto to = std::find(from, end, 0);
      const auto column = static_cast<int>(from - first), n = static_cast<int>(to - from);
      for (std::size_t k = 0; k < source.node.size(); ++k) {
        const std::size_t there = kernel.at(low[0] + column - source.node[k][0], low[1] + row - source.node[k][1]);
        for (std::size_t c = 0; c < 3; ++c)
          field.col(static_cast<Index>(c)).segment(row * n_columns + column, n) +=
              source.weight[k] * Eigen::Map<const Eigen::ArrayXd>(kernel.components[c].data() + there, n);
      }
      from = std::find(to, end, 1);
    }
  }
  MatrixXd blocks(2 * std::ssize(of), 2);
  Index to = 0;
  for (const int i : of) {
    const Stencil& stencil = stencils[i];
    std::array<double, 3> sum{};
    for (std::size_t k = 0; k < stencil.node.size(); ++k)
      for (std::size_t c = 0; c < 3; ++c)
        sum[c] += stencil.weight[k] * field(at(stencil.node[k]), static_cast<Index>(c));
    blocks.middleRows<2>(to) << sum[0], sum[1], sum[1], sum[2];
    to += 2;
  }
  return blocks;
}

void LatticeCompliance::set_means(const std::vector<Stencil>& stencils) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t i = 0; i < stencils.size(); ++i)
    for (std::size_t k = 0; k < stencils[i].node.size(); ++k)
      entries.emplace_back(static_cast<int>(i), stencils[i].node[k][0] + padded_columns_ * stencils[i].node[k][1],
                           stencils[i].weight[k]);
  means_.resize(std::ssize(stencils), static_cast<Index>(padded_columns_) * padded_rows_);
  means_.setFromTriplets(entries.begin(), entries.end());
}

void LatticeCompliance::set_waves(const Kernel& kernel) {
  numerics::NodeField direct = transform_.no_field(), mixed = transform_.no_field();
  for (int row = 1 - lattice_.n_rows; row < lattice_.n_rows; ++row)
    for (int column = 1 - lattice_.n_columns; column < lattice_.n_columns; ++column) {
      const Index to = (column + padded_columns_) % padded_columns_ +
                       static_cast<Index>(padded_columns_) * ((row + padded_rows_) % padded_rows_);
      const std::size_t from = kernel.at(column, row);
      direct.x[to] = kernel.components[0][from];
      direct.y[to] = kernel.components[2][from];
      mixed.x[to] = kernel.components[1][from];
    }
  const numerics::WaveField of_direct = transform_.forward(direct), of_mixed = transform_.forward(mixed);
  waves_ = {of_direct.x.real(), of_mixed.x.real(), of_direct.y.real()};
}

void LatticeCompliance::set_near(const Patches& patches, const substrate::Substrate& gel,
                                 const std::vector<Stencil>& stencils, const Kernel& kernel, int threads) {
  const double apart_um = kApart * lattice_.spacing_um;
  const auto near =
      neighbours_of(patches, [&](double sizes) { return std::max(kMeanReach * sizes, kHalfWidth * sizes + apart_um); });
  const std::vector<MatrixXd> columns = near_columns(patches, gel, near, threads);
  const auto exact = [&](int i, int j) -> Eigen::Matrix2d {  // of i by j
    const std::vector<int>& of = near[j];
    return columns[j].middleRows<2>(2 * (std::ranges::lower_bound(of, i) - of.begin()));
  };
  using Entries = std::vector<Eigen::Triplet<double>>;
  std::vector<Entries> by_patch(near.size());
  diagonal_.resize(2 * patches.n());
  numerics::parallel_for(patches.n(), threads, [&](int j) {
    Entries& entries = by_patch[j];
    std::vector<int> of = near[j];
    of.erase(of.begin(), std::ranges::lower_bound(of, j));
    const MatrixXd on_lattice = by_lattice(stencils, of, j, kernel);
    Index at = 0;
    for (const int i : of) {
      const Eigen::Matrix2d C = 0.5 * (exact(i, j) + exact(j, i).transpose());
      const Eigen::Matrix2d missing = C - on_lattice.middleRows<2>(at);
      at += 2;
      for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b)
          if (i > j || a >= b) entries.emplace_back(2 * i + a, 2 * j + b, missing(a, b));
      if (i == j) diagonal_.segment<2>(2 * j) = C.diagonal();
    }
  });
  Entries all;
  for (const Entries& entries : by_patch) all.insert(all.end(), entries.begin(), entries.end());
  near_.resize(2 * patches.n(), 2 * patches.n());
  near_.setFromTriplets(all.begin(), all.end());
}

MatrixXd LatticeCompliance::displace(const MatrixXd& forces_nN) const {
  using Component = Eigen::Map<VectorXd, 0, Eigen::InnerStride<2>>;
  using GivenComponent = Eigen::Map<const VectorXd, 0, Eigen::InnerStride<2>>;
  const Index n = means_.rows();
  MatrixXd u = near_.selfadjointView<Eigen::Lower>() * forces_nN;
  for (Index c = 0; c < forces_nN.cols(); ++c) {
    const double* forces = forces_nN.col(c).data();
    numerics::NodeField field;
    field.x = (means_.transpose() * GivenComponent(forces, n)).array();
    field.y = (means_.transpose() * GivenComponent(forces + 1, n)).array();
    numerics::WaveField waves = transform_.forward(field);
    const Eigen::ArrayXcd along_x = waves_[0] * waves.x + waves_[1] * waves.y;
    waves.y = waves_[1] * waves.x + waves_[2] * waves.y;
    waves.x = along_x;
    field = transform_.backward(std::move(waves));
    double* moved = u.col(c).data();
    Component(moved, n) += means_ * field.x.matrix();
    Component(moved + 1, n) += means_ * field.y.matrix();
  }
  return u;
}

}  // namespace mbtfm::sheet
