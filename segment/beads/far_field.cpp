#include "segment/beads/far_field.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "pipeline/numerics/order_statistics.h"
#include "segment/beads/plane.h"

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
constexpr int kGlobal = 6;

int n_of(Drift kind) { return kind == Drift::translation ? 2 : kGlobal; }

struct Sources {
  std::vector<Vec2> at;
  double softening = 1;
  double decay = 0;  ///< 1/length: over a gel as thin as this length a tail falls faster; 0: a thick one
};

/// Patches over the squares that are not at rest.
Sources sources_of(const RestingField& rest, Vec2 corner, double width, double height) {
  const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(1.0 * rest.n_moving / kMostSources))));
  const int nx = (rest.nx + step - 1) / step, ny = (rest.ny + step - 1) / step;
  const double side_x = step * width / rest.nx, side_y = step * height / rest.ny;
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
      if (moves(a, b)) sources.at.push_back(corner + Vec2{(a + 0.5) * side_x, (b + 0.5) * side_y});
    }
  }
  return sources;
}

/// The two rows of a place: what each force does there, less what the forces do on the average, so that they balance.
void fill_kernels(cv::Mat rows, Vec2 place, const Sources& sources) {
  const int n = static_cast<int>(sources.at.size());
  cv::Matx22d mean;
  for (int k = 0; k < n; ++k) {
    const Vec2 d = place - sources.at[k];
    const double r = std::sqrt(dot(d, d) + sources.softening * sources.softening),
                 scale = 0.5 * sources.softening / r * std::exp(-sources.decay * r);
    const double xx = d.x * d.x / (r * r), yy = d.y * d.y / (r * r), xy = d.x * d.y / (r * r);
    const cv::Matx22d kernel(scale * (1 + xx), scale * xy, scale * xy, scale * (1 + yy));
    mean += (1.0 / n) * kernel;
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) rows.at<double>(a, 2 * k + b) = kernel(a, b);
    }
  }
  for (int k = 0; k < n; ++k) {
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) rows.at<double>(a, 2 * k + b) -= mean(a, b);
    }
  }
}

/// A = L Lᵀ in place; the logarithm of A's determinant.
double cholesky(cv::Mat& A) {
  double log_determinant = 0;
  for (int j = 0; j < A.rows; ++j) {
    double* row = A.ptr<double>(j);
    for (int i = 0; i <= j; ++i) {
      const double* other = A.ptr<double>(i);
      double sum = row[i];
      for (int k = 0; k < i; ++k) sum -= row[k] * other[k];
      row[i] = i < j ? sum / other[i] : std::sqrt(std::max(sum, 1e-300));
    }
    log_determinant += 2 * std::log(row[j]);
  }
  return log_determinant;
}

void subtract_row(cv::Mat& B, int from, int what, double factor) {
  double* row = B.ptr<double>(from);
  const double* other = B.ptr<double>(what);
  for (int c = 0; c < B.cols; ++c) row[c] -= factor * other[c];
}

/// B := L⁻¹ B, or L⁻ᵀ B.
void solve_lower(const cv::Mat& L, cv::Mat& B) {
  for (int i = 0; i < L.rows; ++i) {
    for (int k = 0; k < i; ++k) subtract_row(B, i, k, L.at<double>(i, k));
    B.row(i) /= L.at<double>(i, i);
  }
}
void solve_lower_transposed(const cv::Mat& L, cv::Mat& B) {
  for (int i = L.rows - 1; i >= 0; --i) {
    B.row(i) /= L.at<double>(i, i);
    for (int k = 0; k < i; ++k) subtract_row(B, k, i, L.at<double>(i, k));
  }
}

/// The squares that are fitted, their weights and their columns.
struct Design {
  std::vector<const FieldCell*> cells;
  cv::Mat forces, global, u;   ///< two rows a square
  std::vector<double> weight;  ///< by row
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
  const Vec2 centre = rest.motion.centre;
  const int n = static_cast<int>(cells.size()), n_forces = 2 * static_cast<int>(sources.at.size());
  Design design{
      cells, cv::Mat(2 * n, n_forces, CV_64F), cv::Mat(2 * n, kGlobal, CV_64F), cv::Mat(2 * n, 1, CV_64F), {}};
  for (int k = 0; k < n; ++k) {
    const FieldCell& cell = *cells[k];
    if (n_forces > 0) fill_kernels(design.forces.rowRange(2 * k, 2 * k + 2), cell.place, sources);
    const GlobalColumns c = global_columns((1 / scale) * (cell.place - centre));
    for (int a = 0; a < kGlobal; ++a) {
      design.global.at<double>(2 * k, a) = c.x[a];
      design.global.at<double>(2 * k + 1, a) = c.y[a];
    }
    design.u.at<double>(2 * k) = cell.u.x;
    design.u.at<double>(2 * k + 1) = cell.u.y;
    design.weight.insert(design.weight.end(), 2, weight_of(cell, rest));
  }
  return design;
}

/// Normal equations [A B; Bᵀ C] of forces and global motion, with their right sides.
struct Normal {
  cv::Mat A{}, B{}, C{}, f{}, g{};
  double yy = 0;
  int n_rows = 0;
};

Normal normal_of(const Design& design) {
  cv::Mat F = design.forces.clone(), G = design.global.clone(), y = design.u.clone();
  for (int k = 0; k < y.rows; ++k) {
    const double root = std::sqrt(design.weight[k]);
    if (!F.empty()) F.row(k) *= root;
    G.row(k) *= root;
    y.row(k) *= root;
  }
  Normal normal{.n_rows = y.rows};
  if (!F.empty()) {
    cv::mulTransposed(F, normal.A, true);
    normal.B = F.t() * G;
    normal.f = F.t() * y;
  }
  normal.C = G.t() * G;
  normal.g = G.t() * y;
  normal.yy = y.dot(y);
  return normal;
}

/// The solution for `n` of the global numbers and one width of the prior.
struct Solved {
  cv::Mat global, covariance, forces;
  double variance = 0;      ///< of a row of weight 1
  double log_evidence = 0;  ///< but for what does not depend on the prior
};

/// The forces are integrated out: p = S⁻¹ (g − Bᵀ A⁻¹ f) with S = C − Bᵀ A⁻¹ B, A with the prior's ridge.
Solved solved(const Normal& normal, int n, double ridge) {
  cv::Mat S = normal.C(cv::Range(0, n), cv::Range(0, n)).clone(), right = normal.g.rowRange(0, n).clone(), L, both;
  double yy = normal.yy, log_forces = 0;
  const int n_forces = normal.A.rows;
  if (n_forces > 0) {
    L = normal.A.clone();
    for (int k = 0; k < n_forces; ++k) L.at<double>(k, k) += ridge;
    log_forces = cholesky(L) - n_forces * std::log(ridge);
    cv::hconcat(normal.B.colRange(0, n), normal.f, both);
    both = both.clone();
    solve_lower(L, both);
    const cv::Mat Z = both.colRange(0, n), z = both.col(n);
    S -= Z.t() * Z;
    right -= Z.t() * z;
    yy -= z.dot(z);
  }
  Solved result;
  const cv::Mat inverse = S.inv(cv::DECOMP_SVD);
  result.global = inverse * right;
  const double squares = std::max(1e-300, yy - right.dot(result.global));
  const int n_free = std::max(1, normal.n_rows - n);
  result.variance = squares / n_free;
  result.covariance = result.variance * inverse;
  cv::Mat factor = S.clone();
  result.log_evidence = -0.5 * (n_free * std::log(squares) + log_forces + cholesky(factor));
  if (n_forces > 0) {
    result.forces = both.col(n) - both.colRange(0, n) * result.global;
    solve_lower_transposed(L, result.forces);
  }
  return result;
}

/// A width of the forces' prior, in parts of the normal matrix's mean diagonal.
double ridge_of(const Normal& normal, double share) {
  return normal.A.empty() ? 1 : share * cv::trace(normal.A)[0] / normal.A.rows;
}

/// The width that makes the data likeliest.
double best_share(const Normal& normal) {
  double best = 1, highest = -1e300;
  for (double share = 1e-4; !normal.A.empty() && share < 100; share *= 30) {  // half a decade off changes little
    const double evidence = solved(normal, kGlobal, ridge_of(normal, share)).log_evidence;
    if (evidence > highest) highest = evidence, best = share;
  }
  return best;
}

/// What drift and tail leave of the squares' motion.
cv::Mat rest_of(const Design& design, const Solved& s) {
  cv::Mat rest = design.u - design.global.colRange(0, s.global.rows) * s.global;
  if (!s.forces.empty()) rest -= design.forces * s.forces;
  return rest;
}

/// Student's weights of four degrees of freedom, by the residual of a square: one that is pulled after all counts less.
void reweigh(Design& design, const Solved& s) {
  const cv::Mat rest = rest_of(design, s);
  for (int k = 0; k < rest.rows; k += 2) {
    const double n = design.weight[k];
    const double squared = n * (std::pow(rest.at<double>(k), 2) + std::pow(rest.at<double>(k + 1), 2)) / s.variance;
    design.weight[k] = design.weight[k + 1] = n * 6 / (4 + squared);
  }
}

AffineMotion motion_of(const Solved& s, Vec2 centre, double scale) {
  const auto value = [&](int k) { return k < s.global.rows ? s.global.at<double>(k) / (k < 2 ? 1 : scale) : 0.0; };
  return {{value(0), value(1)}, value(2), value(3), value(4), value(5), centre};
}

double linear_chi_squared(const Solved& s) {
  const cv::Mat linear = s.global.rowRange(2, kGlobal);
  const cv::Mat inverse = s.covariance(cv::Range(2, kGlobal), cv::Range(2, kGlobal)).inv(cv::DECOMP_SVD);
  return linear.dot(inverse * linear);
}

void take_errors(FarField& far, const Solved& s, double scale) {
  const auto sigma = [&](int k) { return std::sqrt(std::max(0.0, s.covariance.at<double>(k, k))); };
  const auto mean = [](double a, double b) { return std::sqrt(0.5 * (a * a + b * b)); };
  far.errors.shift = mean(sigma(0), sigma(1));
  if (s.global.rows == 2) return;
  far.errors.turn_rad = sigma(2) / scale;
  far.errors.growth = sigma(3) / scale;
  far.errors.shear = mean(sigma(4), sigma(5)) / scale;
  far.linear_chi_squared = linear_chi_squared(s);
}

/// Beads in the squares at rest, about drift and tail. 1500 tell a standard deviation to a fiftieth.
void take_noise(FarField& far, const std::vector<Vec2>& positions, const std::vector<Vec2>& u,
                const std::vector<char>& is_used, const Sources& sources, const cv::Mat& forces) {
  constexpr int kMost = 1500;
  const auto n_used = std::count(is_used.begin(), is_used.end(), 1);
  const int stride = 1 + static_cast<int>(n_used) / kMost;
  cv::Mat rows(2, forces.rows, CV_64F);
  std::vector<double> sizes;
  double squares = 0;
  int n = 0;
  for (std::size_t k = 0; k < positions.size(); ++k) {
    if (!is_used[k] || n++ % stride != 0) continue;
    Vec2 rest = u[k] - far.drift.at(positions[k]);
    if (!forces.empty()) {
      fill_kernels(rows, positions[k], sources);
      const cv::Mat tail = rows * forces;
      rest = rest - Vec2{tail.at<double>(0), tail.at<double>(1)};
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
    design.weight[2 * k] *= share * share;
    design.weight[2 * k + 1] *= share * share;
  }
}

/// Forces and global motion of a divided field, ready to be solved.
struct Fit {
  bool is_at_rest = false;
  Sources sources;
  Normal normal;
  double ridge = 1;
  std::vector<cv::Mat> others;  ///< global motion with tails of other depths
};

/// With the error of the tail's law, which is not known: what gels of other depths differ by. Of so few any may be it.
void add_error_of_tail(Solved& s, const std::vector<cv::Mat>& others) {
  for (const cv::Mat& other : others) {
    const cv::Mat apart = other.rowRange(0, s.global.rows) - s.global;
    s.covariance += apart * apart.t();
  }
}

Fit fit_of(const RestingField& rest, Vec2 corner, double width, double height, double scale) {
  Fit fit{.is_at_rest = rest.share_at_rest >= kLeastAtRest, .sources = {}, .normal = {}, .others = {}};
  // the forces in view of a cell that is cut do not balance: a fit of them finds a tail that is not there
  const bool is_whole = !rest.is_cut();
  std::vector<const FieldCell*> used;
  for (const FieldCell& cell : rest.cells) {
    if (cell.n_beads > 0 && (cell.rests || is_whole || !fit.is_at_rest)) used.push_back(&cell);
  }
  if (fit.is_at_rest && is_whole && rest.n_moving > 0) fit.sources = sources_of(rest, corner, width, height);
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

/// Beads in squares at rest, or, where nothing is, all.
std::vector<char> beads_at_rest(const std::vector<Vec2>& positions, const RestingField& rest, bool is_at_rest,
                                Vec2 corner, double width, double height) {
  std::vector<char> result;
  for (const Vec2 place : positions) {
    const int i = std::clamp(static_cast<int>((place.x - corner.x) / width * rest.nx), 0, rest.nx - 1);
    const int j = std::clamp(static_cast<int>((place.y - corner.y) / height * rest.ny), 0, rest.ny - 1);
    result.push_back(!is_at_rest || rest.at(i, j).rests);
  }
  return result;
}

}  // namespace

WholeMotion whole_motion(const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements, Vec2 corner,
                         double width, double height, const std::vector<Drift>& kinds) {
  WholeMotion whole{resting_field(positions, displacements, corner, width, height), {}};
  whole.of.assign(kinds.size(), FarField{});
  for (FarField& result : whole.of) result.drift.centre = whole.rest.motion.centre;
  if (positions.empty()) return whole;
  const Vec2 centre = whole.rest.motion.centre;
  const double scale = 0.5 * std::min(width, height);
  const Fit fit = fit_of(whole.rest, corner, width, height, scale);
  const std::vector<char> is_used = beads_at_rest(positions, whole.rest, fit.is_at_rest, corner, width, height);
  for (std::size_t at = 0; at < kinds.size(); ++at) {
    FarField& result = whole.of[at];
    Solved s = solved(fit.normal, n_of(kinds[at]), fit.ridge);
    if (kinds[at] == Drift::affine) {
      result.over_noise = linear_chi_squared(s);
      add_error_of_tail(s, fit.others);
    }
    result.is_at_rest = fit.is_at_rest;
    result.drift = motion_of(s, centre, scale);
    take_errors(result, s, scale);
    take_noise(result, positions, displacements, is_used, fit.sources, s.forces);
  }
  return whole;
}

}  // namespace mbtfm::beads
