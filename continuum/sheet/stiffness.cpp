#include "continuum/sheet/stiffness.h"

#include <algorithm>
#include <cmath>

#include "pipeline/numerics/dense_panel.h"
#include "pipeline/numerics/spring_matrix.h"

namespace mbtfm::sheet {
namespace {

numerics::BlockMatrix<2> pattern_of(const Elements& elements) {
  std::vector<std::array<int, 2>> pairs;
  for (int t = 0; t < elements.n_triangles(); ++t)
    for (const int i : elements.nodes(t))
      for (const int j : elements.nodes(t))
        if (i > j) pairs.push_back({i, j});
  return numerics::matrix_of_pairs(elements.n_nodes(), pairs);
}

}  // namespace

Stiffness::Stiffness(const Elements& elements, std::vector<std::array<bool, 2>> held)
    : elements_(elements),
      held_(std::move(held)),
      matrix_(pattern_of(elements)),
      factor_(std::make_shared<const numerics::Elimination>(matrix_, numerics::Search::quick)) {
  if (held_.empty()) held_.assign(static_cast<std::size_t>(elements.n_nodes()), {false, false});
  for (int t = 0; t < elements.n_triangles(); ++t) {
    std::array<int, 21>& slots = slots_.emplace_back();
    int k = 0;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j <= i; ++j) {
        const auto [low, high] = std::minmax(elements.nodes(t)[i], elements.nodes(t)[j]);
        slots[k++] = matrix_.slot(high, low);
      }
  }
  set_zero();
}

void Stiffness::set_zero() { std::fill(matrix_.value.begin(), matrix_.value.end(), 0.0); }

void Stiffness::add(int triangle, const OfElement& stiffness) {
  const std::array<int, 6>& nodes = elements_.nodes(triangle);
  int k = 0;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) {
      double* block = matrix_.value.data() + 4 * slots_[triangle][k++];
      const int high = nodes[i] >= nodes[j] ? i : j, low = nodes[i] >= nodes[j] ? j : i;
      for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b) {
          if (held_[nodes[high]][a] || held_[nodes[low]][b]) continue;
          block[2 * a + b] += stiffness(2 * high + a, 2 * low + b);
        }
    }
}

double Stiffness::mean_diagonal() const {
  double sum = 0;
  for (int i = 0; i < matrix_.n; ++i) {
    const double* block = matrix_.value.data() + 4 * matrix_.start[i];
    sum += block[0] + block[3];
  }
  return sum / (2 * matrix_.n);
}

bool Stiffness::factorise(double shift, int threads) {
  const double diagonal = mean_diagonal();
  for (int i = 0; i < matrix_.n; ++i) {
    double* block = matrix_.value.data() + 4 * matrix_.start[i];
    for (int a = 0; a < 2; ++a)
      if (held_[i][a]) block[3 * a] = diagonal;
  }
  return factor_.factorise(matrix_, {.shift = shift * diagonal, .threads = threads});
}

MatrixXd Stiffness::solve(const MatrixXd& forces_nN) const {
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  constexpr Index kAtATime = numerics::kRightHandSides<double>;
  const Index n_given = forces_nN.cols();
  const Index n = n_given == 1 ? 1 : (n_given + kAtATime - 1) / kAtATime * kAtATime;
  Columns in_order = Columns::Zero(forces_nN.rows(), n);
  const std::vector<int>& place = factor_.elimination().place;
  const auto row_of = [&](int node, int axis) { return 2 * place[node] + axis; };
  for (int i = 0; i < matrix_.n; ++i)
    for (int a = 0; a < 2; ++a)
      if (!held_[i][a]) in_order.row(row_of(i, a)).leftCols(n_given) = forces_nN.row(2 * i + a);
  factor_.solve(in_order.data(), static_cast<std::size_t>(n));
  MatrixXd u(forces_nN.rows(), n_given);
  for (int i = 0; i < matrix_.n; ++i)
    for (int a = 0; a < 2; ++a) u.row(2 * i + a) = in_order.row(row_of(i, a)).leftCols(n_given);
  return u;
}

Stiffness::OfElement elastic_stiffness(const Elements& elements, int triangle, const Material& material) {
  const double M = material.stiffness_nN_per_um(), nu = material.poisson_ratio;
  Stiffness::OfElement K = Stiffness::OfElement::Zero();
  for (int p = 0; p < Elements::kPoints; ++p) {
    const Shape& shape = elements.at(triangle, p);
    const double shear = 0.5 * (1 - nu) * M * shape.weight_um2, direct = M * shape.weight_um2;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) {
        const Vec2 a = shape.gradient_per_um[i], b = shape.gradient_per_um[j];
        K(2 * i, 2 * j) += direct * a.x * b.x + shear * a.y * b.y;
        K(2 * i, 2 * j + 1) += nu * direct * a.x * b.y + shear * a.y * b.x;
        K(2 * i + 1, 2 * j) += nu * direct * a.y * b.x + shear * a.x * b.y;
        K(2 * i + 1, 2 * j + 1) += direct * a.y * b.y + shear * a.x * b.x;
      }
  }
  return K;
}

Stiffness::OfElement spring_stiffness(const Elements& elements, int triangle, const double* by_point) {
  Stiffness::OfElement K = Stiffness::OfElement::Zero();
  for (int p = 0; p < Elements::kPoints; ++p) {
    const Shape& shape = elements.at(triangle, p);
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) {
        const double k = by_point[p] * shape.weight_um2 * shape.value[i] * shape.value[j];
        K(2 * i, 2 * j) += k;
        K(2 * i + 1, 2 * j + 1) += k;
      }
  }
  return K;
}

std::vector<std::array<bool, 2>> pins(const Elements& elements) {
  std::vector<std::array<bool, 2>> held(static_cast<std::size_t>(elements.n_nodes()), {false, false});
  const std::vector<Vec2>& nodes = elements.triangles().nodes_um;
  std::size_t furthest = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (norm(nodes[i] - nodes[0]) > norm(nodes[furthest] - nodes[0])) furthest = i;
  const Vec2 along = nodes[furthest] - nodes[0];
  held[0] = {true, true};
  held[furthest][std::abs(along.x) > std::abs(along.y) ? 1 : 0] = true;
  return held;
}

}  // namespace mbtfm::sheet
