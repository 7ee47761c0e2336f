#include "segment/beads/far_field.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::beads {
namespace {

/// Patches of forces: 16 a side of what moves, so about the size of an adhesion, and half of it what the force is
/// spread over. With 8 a side a cell's tail is missed by so much that growth by 0.03 % seems to be there.
constexpr int kMostSources = 250;
constexpr double kSoftening = 0.5;
/// By this share of its displacement patches miss a square that is pulled.
constexpr double kCoarse = 0.3;
/// Of a layer of cells, which moves everywhere, some eighth goes with any one affine motion by chance.
constexpr double kLeastAtRest = 0.15;
constexpr Index kGlobal = 6;

struct Sources {
  std::vector<Vec2> at;
  double softening = 1;
  double decay = 0;  ///< 1/length: over a gel as thin as this length a tail falls faster; 0: a thick one
};

/// Patches over the squares that are not at rest.
Sources sources_of(const RestingField& rest) {
  const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(1.0 * rest.n_moving / kMostSources))));
  const int nx = (rest.nx + step - 1) / step, ny = (rest.ny + step - 1) / step;
  const double side_x = step * rest.width / rest.nx, side_y = step * rest.height / rest.ny;
  const auto moves = [&](int a, int b) {
    for (int j = b * step; j < std::min(rest.ny, (b + 1) * step); ++j) {
      for (int i = a * step; i < std::min(rest.nx, (a + 1) * step); ++i) {
        if (!rest.at(i, j).rests) return true;
      }
    }
    return false;
  };
  Sources sources{.at = {}, .softening = kSoftening * std::min(side_x, side_y)};
  for (int b = 0; b < ny; ++b) {
    for (int a = 0; a < nx; ++a) {
      if (moves(a, b)) sources.at.push_back(rest.corner + Vec2{(a + 0.5) * side_x, (b + 0.5) * side_y});
    }
  }
  return sources;
}

/// What each force does at a place, less what the forces do on the average, so that they balance: 2 rows, 2 columns a
/// force.
MatrixXd kernels(Vec2 place, const Sources& sources) {
  const Index n = std::ssize(sources.at);
  MatrixXd rows(2, 2 * n);
  Eigen::Matrix2d mean = Eigen::Matrix2d::Zero();
  for (Index k = 0; k < n; ++k) {
    const Vec2 d = place - sources.at[static_cast<std::size_t>(k)];
    const double r = std::sqrt(dot(d, d) + sources.softening * sources.softening),
                 scale = 0.5 * sources.softening / r * std::exp(-sources.decay * r);
    const double xx = d.x * d.x / (r * r), yy = d.y * d.y / (r * r), xy = d.x * d.y / (r * r);
    rows.middleCols<2>(2 * k) << scale * (1 + xx), scale * xy, scale * xy, scale * (1 + yy);
    mean += (1.0 / static_cast<double>(n)) * rows.middleCols<2>(2 * k);
  }
  for (Index k = 0; k < n; ++k) rows.middleCols<2>(2 * k) -= mean;
  return rows;
}

/// The squares that are fitted, their weights and their columns.
struct Design {
  std::vector<const FieldCell*> cells;
  MatrixXd forces, global;  ///< two rows a square
  VectorXd u, weight;
};

/// In beads: what patches of forces are too coarse for counts as noise of a square.
double weight_of(const FieldCell& cell, const RestingField& rest) {
  const double n = cell.n_beads;
  if (cell.rests || rest.share_at_rest < kLeastAtRest || !(rest.bead_noise > 0)) return n;
  const double coarse = kCoarse * norm(cell.u - rest.motion.at(cell.place)) / rest.bead_noise;
  return n / (1 + n * coarse * coarse);
}

Design design_of(const std::vector<const FieldCell*>& cells, const Sources& sources, const RestingField& rest,
                 double scale) {
  const Index n = std::ssize(cells), n_forces = 2 * std::ssize(sources.at);
  Design design{cells, MatrixXd(2 * n, n_forces), MatrixXd(2 * n, kGlobal), VectorXd(2 * n), VectorXd(2 * n)};
  for (Index k = 0; k < n; ++k) {
    const FieldCell& cell = *cells[static_cast<std::size_t>(k)];
    if (n_forces > 0) design.forces.middleRows<2>(2 * k) = kernels(cell.place, sources);
    const GlobalColumns c = global_columns((1 / scale) * (cell.place - rest.motion.centre));
    for (Index a = 0; a < kGlobal; ++a) design.global(2 * k, a) = c.x[a], design.global(2 * k + 1, a) = c.y[a];
    design.u.segment<2>(2 * k) << cell.u.x, cell.u.y;
    design.weight.segment<2>(2 * k).setConstant(weight_of(cell, rest));
  }
  return design;
}

/// Normal equations [A B; Bᵀ C] of forces and global motion, with their right sides f, g.
struct Normal {
  MatrixXd A{}, B{}, C{};
  VectorXd f{}, g{};
  double yy = 0;
  Index n_rows = 0;
};

Normal normal_of(const Design& design) {
  const VectorXd root = design.weight.cwiseSqrt(), y = root.cwiseProduct(design.u);
  const MatrixXd F = root.asDiagonal() * design.forces, G = root.asDiagonal() * design.global;
  Normal normal{
      .C = numerics::gram(G), .g = numerics::transposed_matvec(G, y), .yy = y.squaredNorm(), .n_rows = y.size()};
  if (F.cols() == 0) return normal;
  normal.A = numerics::gram(F);
  normal.B = numerics::small_transposed_product(F, G);
  normal.f = numerics::transposed_matvec(F, y);
  return normal;
}

/// The solution for `n` of the global numbers and one width of the prior.
struct Solved {
  VectorXd global, forces;
  MatrixXd covariance;
  double variance = 0;      ///< of a row of weight 1
  double log_evidence = 0;  ///< but for what does not depend on the prior
};

/// The forces are integrated out: p = S⁻¹ (g − Bᵀ A⁻¹ f) with S = C − Bᵀ A⁻¹ B, A with the prior's ridge.
Solved solved(const Normal& normal, Index n, double ridge) {
  MatrixXd S = normal.C.topLeftCorner(n, n);
  VectorXd right = normal.g.head(n);
  double yy = normal.yy, log_forces = 0;
  const Index n_forces = normal.A.rows();
  std::optional<numerics::SmallCholesky> factor;
  if (n_forces > 0) {
    MatrixXd A = normal.A;
    A.diagonal().array() += ridge;
    factor.emplace(A);
    log_forces = factor->log_determinant() - static_cast<double>(n_forces) * std::log(ridge);
    const MatrixXd Z = factor->solve_lower(normal.B.leftCols(n));
    const VectorXd z = factor->solve_lower(normal.f);
    S = numerics::minus_product(S, Z.transpose(), Z);
    right -= numerics::transposed_matvec(Z, z);
    yy -= z.squaredNorm();
  }
  Solved result;
  const MatrixXd inverse = numerics::pseudo_inverse(S);
  result.global = numerics::matvec(inverse, right);
  const double squares = std::max(1e-300, yy - right.dot(result.global));
  const auto n_free = static_cast<double>(std::max<Index>(1, normal.n_rows - n));
  result.variance = squares / n_free;
  result.covariance = result.variance * inverse;
  result.log_evidence = -0.5 * (n_free * std::log(squares) + log_forces + numerics::SmallCholesky(S).log_determinant());
  if (factor) result.forces = factor->solve(numerics::minus_matvec(normal.f, normal.B.leftCols(n), result.global));
  return result;
}

/// A width of the forces' prior, in parts of the normal matrix's mean diagonal.
double ridge_of(const Normal& normal, double share) {
  return normal.A.size() == 0 ? 1 : share * normal.A.diagonal().mean();
}

/// The width that makes the data likeliest.
double best_share(const Normal& normal) {
  double best = 1, highest = -1e300;
  for (double share = 1e-4; normal.A.size() > 0 && share < 100; share *= 30) {  // half a decade off changes little
    const double evidence = solved(normal, kGlobal, ridge_of(normal, share)).log_evidence;
    if (evidence > highest) highest = evidence, best = share;
  }
  return best;
}

/// What drift and tail leave of the squares' motion.
VectorXd rest_of(const Design& design, const Solved& s) {
  const VectorXd rest = numerics::minus_matvec(design.u, design.global.leftCols(s.global.size()), s.global);
  return s.forces.size() == 0 ? rest : numerics::minus_matvec(rest, design.forces, s.forces);
}

/// Student's weights of four degrees of freedom, by the residual of a square: one that is pulled after all counts less.
void reweigh(Design& design, const Solved& s) {
  const VectorXd rest = rest_of(design, s);
  for (Index k = 0; k < rest.size(); k += 2) {
    const double n = design.weight[k], squared = n * rest.segment<2>(k).squaredNorm() / s.variance;
    design.weight.segment<2>(k).setConstant(n * 6 / (4 + squared));
  }
}

AffineMotion motion_of(const Solved& s, Vec2 centre, double scale) {
  const auto value = [&](Index k) { return k < s.global.size() ? s.global[k] / (k < 2 ? 1 : scale) : 0.0; };
  return {{value(0), value(1)}, value(2), value(3), value(4), value(5), centre};
}

double linear_chi_squared(const Solved& s) {
  constexpr Index kLinear = kGlobal - 2;
  const MatrixXd inverse = numerics::pseudo_inverse(s.covariance.bottomRightCorner<kLinear, kLinear>());
  return numerics::quadratic_form(inverse, s.global.tail<kLinear>());
}

void take_errors(FarField& far, const Solved& s, double scale) {
  const auto sigma = [&](Index k) { return std::sqrt(std::max(0.0, s.covariance(k, k))); };
  const auto mean = [](double a, double b) { return std::sqrt(0.5 * (a * a + b * b)); };
  far.errors.shift = mean(sigma(0), sigma(1));
  if (s.global.size() == 2) return;
  far.errors.turn_rad = sigma(2) / scale;
  far.errors.growth = sigma(3) / scale;
  far.errors.shear = mean(sigma(4), sigma(5)) / scale;
  far.linear_chi_squared = linear_chi_squared(s);
}

/// Beads in the squares at rest, about drift and tail. 1500 give a standard deviation to a fiftieth.
void take_noise(FarField& far, const std::vector<Vec2>& positions, const std::vector<Vec2>& u,
                const std::vector<char>& is_used, const Sources& sources, const VectorXd& forces) {
  constexpr int kMost = 1500;
  const auto n_used = std::count(is_used.begin(), is_used.end(), 1);
  const int stride = 1 + static_cast<int>(n_used) / kMost;
  std::vector<double> sizes;
  double squares = 0;
  int n = 0;
  for (std::size_t k = 0; k < positions.size(); ++k) {
    if (!is_used[k] || n++ % stride != 0) continue;
    Vec2 rest = u[k] - far.drift.at(positions[k]);
    if (forces.size() > 0) {
      const VectorXd tail = numerics::matvec(kernels(positions[k], sources), forces);
      rest = rest - Vec2{tail[0], tail[1]};
    }
    squares += dot(rest, rest);
    sizes.push_back(std::abs(rest.x));
    sizes.push_back(std::abs(rest.y));
  }
  if (sizes.empty()) return;
  far.rms = std::sqrt(squares / static_cast<double>(sizes.size()));
  far.noise = numerics::quantile(std::move(sizes), 0.5) / 0.6745;
}

/// Beside a cell that is cut the tail has no fit: squares count by the square of their distance from what does not
/// rest, as tails fall.
void weigh_by_distance(Design& design, const RestingField& rest) {
  std::vector<Vec2> pulled;
  for (const FieldCell& cell : rest.cells) {
    if (cell.n_beads > 0 && !cell.rests) pulled.push_back(cell.place);
  }
  for (std::size_t k = 0; k < design.cells.size(); ++k) {
    double nearest = 1e300;
    for (const Vec2 place : pulled) nearest = std::min(nearest, norm(place - design.cells[k]->place));
    const double share = pulled.empty() ? 1 : nearest / rest.side;
    design.weight.segment<2>(2 * static_cast<Index>(k)) *= share * share;
  }
}

/// Forces and global motion of a divided field, ready to be solved.
struct Fit {
  bool is_at_rest = false;
  Sources sources;
  Normal normal;
  double ridge = 1;
  std::vector<VectorXd> others;  ///< global motion with tails of other depths
};

/// With the error of the tail's law, which is not known: what gels of other depths differ by. Of so few any may be it.
void add_error_of_tail(Solved& s, const std::vector<VectorXd>& others) {
  for (const VectorXd& other : others) {
    const VectorXd apart = other.head(s.global.size()) - s.global;
    s.covariance += apart * apart.transpose();
  }
}

Fit fit_of(const RestingField& rest, double scale) {
  Fit fit{.is_at_rest = rest.share_at_rest >= kLeastAtRest, .sources = {}, .normal = {}, .others = {}};
  // the forces in view of a cell that is cut do not balance: a fit of them finds a tail that is not there
  const bool is_whole = !rest.is_cut();
  std::vector<const FieldCell*> used;
  for (const FieldCell& cell : rest.cells) {
    if (cell.n_beads > 0 && (cell.rests || is_whole || !fit.is_at_rest)) used.push_back(&cell);
  }
  if (fit.is_at_rest && is_whole && rest.n_moving > 0) fit.sources = sources_of(rest);
  Design design = design_of(used, fit.sources, rest, scale);
  if (fit.is_at_rest && !is_whole) weigh_by_distance(design, rest);
  fit.normal = normal_of(design);
  const double share = best_share(fit.normal);
  fit.ridge = ridge_of(fit.normal, share);
  // a tail that falls faster than the fitted one looks like growth, and how fast it falls depends on the gel's depth
  if (!fit.sources.at.empty()) {
    for (const double decay : {0.5, 1.0, 2.0}) {  // over half a side of the picture
      Sources sources = fit.sources;
      sources.decay = decay / scale;
      const Normal other = normal_of(design_of(used, sources, rest, scale));
      fit.others.push_back(solved(other, kGlobal, ridge_of(other, share)).global);
    }
  }
  if (!fit.is_at_rest) return fit;
  reweigh(design, solved(fit.normal, kGlobal, fit.ridge));
  fit.normal = normal_of(design);
  return fit;
}

}  // namespace

WholeMotion whole_motion(const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements, Vec2 corner,
                         double width, double height) {
  WholeMotion whole{resting_field(positions, displacements, corner, width, height), {}, {}};
  const Vec2 centre = whole.rest.motion.centre;
  whole.shifted.drift.centre = whole.affine.drift.centre = centre;
  if (positions.empty()) return whole;
  const double scale = 0.5 * std::min(width, height);
  const Fit fit = fit_of(whole.rest, scale);
  std::vector<char> is_used;  // in squares at rest; if nothing is, all
  for (const Vec2 place : positions)
    is_used.push_back(!fit.is_at_rest || whole.rest.cells[whole.rest.square_of(place)].rests);
  for (FarField* result : {&whole.shifted, &whole.affine}) {
    const bool is_affine = result == &whole.affine;
    Solved s = solved(fit.normal, is_affine ? kGlobal : 2, fit.ridge);
    if (is_affine) {
      result->over_noise = linear_chi_squared(s);
      add_error_of_tail(s, fit.others);
    }
    result->is_at_rest = fit.is_at_rest;
    result->drift = motion_of(s, centre, scale);
    take_errors(*result, s, scale);
    take_noise(*result, positions, displacements, is_used, fit.sources, s.forces);
  }
  return whole;
}

}  // namespace mbtfm::beads
