#include "continuum/sheet/patches.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "continuum/sheet/lattice_compliance.h"
#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/neighbour_bins.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/response.h"

namespace mbtfm::sheet {

substrate::Ellipse ellipse_of(Vec2 a, Vec2 b, Vec2 c) {
  const Vec2 centre = 1.0 / 3 * (a + b + c);
  Eigen::Matrix2d inertia = Eigen::Matrix2d::Zero();
  for (const Vec2 p : {a, b, c}) {
    const Eigen::Vector2d d(p.x - centre.x, p.y - centre.y);
    inertia += d * d.transpose() / 12;
  }
  const auto [squares, axes] = numerics::symmetric_eigen(inertia);
  const double ratio = std::sqrt(squares[1] / squares[0]);
  const double product = 0.5 * std::abs(cross(b - a, c - a)) / std::numbers::pi;
  const Eigen::Vector2d major = axes.col(1);
  const double semi_major = std::sqrt(product * ratio);
  return {centre, semi_major, std::min(semi_major, product / semi_major), std::atan2(major.y(), major.x())};
}

substrate::Ellipse patch_of(const Elements& elements, int triangle) {
  const auto corner = [&](std::size_t i) { return elements.triangles().nodes_um[elements.nodes(triangle)[i]]; };
  substrate::Ellipse ellipse = ellipse_of(corner(0), corner(1), corner(2));
  const double area = elements.area_um2(triangle);  // of the curved triangle
  const double scale = std::sqrt(area / (std::numbers::pi * ellipse.semi_major_um * ellipse.semi_minor_um));
  ellipse.semi_major_um *= scale;
  ellipse.semi_minor_um *= scale;
  ellipse.centre_um = {};
  for (int p = 0; p < Elements::kPoints; ++p)
    ellipse.centre_um += elements.at(triangle, p).weight_um2 / area * elements.at(triangle, p).place_um;
  return ellipse;
}

std::vector<Vec2> Patches::centres_um() const {
  std::vector<Vec2> centres;
  for (const substrate::Ellipse& ellipse : ellipses) centres.push_back(ellipse.centre_um);
  return centres;
}

double Patches::size_um(int patch) const { return std::sqrt(areas_um2[patch]); }

Patches patches_of(const Elements& elements, std::vector<int> triangles) {
  if (triangles.size() < 2)
    throw InvalidData("where the sheet adheres", "two of its triangles or more", std::to_string(triangles.size()));
  Patches patches{.elements = &elements, .triangles = std::move(triangles), .ellipses = {}, .areas_um2 = {}};
  for (const int t : patches.triangles) {
    patches.ellipses.push_back(patch_of(elements, t));
    patches.areas_um2.push_back(elements.area_um2(t));
  }
  return patches;
}

std::vector<std::vector<int>> neighbours_of(const Patches& patches, const std::function<double(double)>& reach_um) {
  const std::vector<Vec2> centres = patches.centres_um();
  numerics::Grid grid(centres, std::sqrt(numerics::median(patches.areas_um2)));
  for (int i = 0; i < patches.n(); ++i) grid.add(i, patches.centre_um(i), patches.centre_um(i));
  std::vector<std::vector<int>> near(centres.size());
  // the larger patch of a pair looks for the smaller one: small ones need not look far
  for (int j = 0; j < patches.n(); ++j) {
    const Vec2 at = patches.centre_um(j);
    const double size = patches.size_um(j);
    grid.for_each_near(at, at, reach_um(2 * size), [&](int i) {
      const double other = patches.size_um(i);
      if (other > size || (other == size && i > j)) return;
      if (norm(patches.centre_um(i) - at) >= reach_um(size + other)) return;
      near[j].push_back(i);
      if (i != j) near[i].push_back(j);
    });
  }
  for (std::vector<int>& list : near) std::ranges::sort(list);
  return near;
}

namespace {

class DenseCompliance final : public PatchCompliance {
 public:
  DenseCompliance(const Patches& patches, const substrate::Substrate& gel, int threads)
      : compliance_(gel.compliance_um_per_nN(patches.centres_um(), patches.ellipses)) {
    const auto near = neighbours_of(patches, [](double sizes) { return kMeanReach * sizes; });
    const std::vector<MatrixXd> columns = near_columns(patches, gel, near, threads);
    for (std::size_t j = 0; j < near.size(); ++j)
      for (std::size_t k = 0; k < near[j].size(); ++k)
        compliance_.block<2, 2>(2 * near[j][k], 2 * static_cast<Index>(j)) =
            columns[j].middleRows<2>(2 * static_cast<Index>(k));
    for (Index j = 0; j < compliance_.cols(); ++j)
      for (Index i = j; i < compliance_.rows(); ++i)
        compliance_(i, j) = compliance_(j, i) = 0.5 * (compliance_(i, j) + compliance_(j, i));
  }
  MatrixXd displace(const MatrixXd& forces_nN) const override {
    if (forces_nN.cols() == 1)  // half the memory read
      return compliance_.selfadjointView<Eigen::Lower>() * forces_nN.col(0);
    return numerics::product(compliance_, forces_nN, 1);
  }
  VectorXd diagonal_um_per_nN() const override { return compliance_.diagonal(); }
  MatrixXd matrix_um_per_nN() const override { return compliance_; }

 private:
  MatrixXd compliance_;
};

}  // namespace

MatrixXd PatchCompliance::matrix_um_per_nN() const {
  const Index n = diagonal_um_per_nN().size();
  return displace(MatrixXd::Identity(n, n));
}

Held held_for(int n_patches, const substrate::Capabilities& gel) {
  constexpr int kMostDense = 2000;
  return n_patches > kMostDense && substrate::is_alike_everywhere(gel) ? Held::lattice : Held::dense;
}

std::unique_ptr<PatchCompliance> compliance_of(const Patches& patches, const substrate::Substrate& gel, Held held,
                                               int threads) {
  if (held == Held::lattice) return std::make_unique<LatticeCompliance>(patches, gel, threads);
  return std::make_unique<DenseCompliance>(patches, gel, threads);
}

std::vector<MatrixXd> near_columns(const Patches& patches, const substrate::Substrate& gel,
                                   const std::vector<std::vector<int>>& near, int threads) {
  std::vector<MatrixXd> columns(near.size());
  numerics::parallel_for(patches.n(), threads, [&](int j) {
    const std::vector<int>& of = near[j];
    const auto n_points = [&](int i) {
      const double sizes = patches.size_um(i) + patches.size_um(j);
      return norm(patches.centre_um(i) - patches.centre_um(j)) < kMeanReach * sizes ? Elements::kPoints : 1;
    };
    std::vector<Vec2> points;
    for (const int i : of) {
      if (n_points(i) == 1) points.push_back(patches.centre_um(i));
      for (int p = 0; p < n_points(i) && n_points(i) > 1; ++p) points.push_back(patches.at(i, p).place_um);
    }
    const MatrixXd field = gel.compliance_um_per_nN(points, {patches.ellipses[j]});
    MatrixXd& column = columns[j];
    column.resize(2 * std::ssize(of), 2);
    Index row = 0, to = 0;
    for (const int i : of) {
      Eigen::Matrix2d mean = Eigen::Matrix2d::Zero();
      const int n = n_points(i);
      for (int p = 0; p < n; ++p, row += 2) mean += (n == 1 ? 1 : patches.share(i, p)) * field.middleRows<2>(row);
      column.middleRows<2>(to) = mean;
      to += 2;
    }
  });
  return columns;
}

}  // namespace mbtfm::sheet
