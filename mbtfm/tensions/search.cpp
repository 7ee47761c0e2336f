#include "mbtfm/tensions/search.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "mbtfm/tensions/ensemble.h"
#include "pipeline/contract/extent.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/triangle.h"
#include "substrate/greens/models.h"
#include "substrate/loads.h"

namespace mbtfm::tensions {

substrate::LazyResponse response_to(const std::vector<substrate::Ellipse>& ellipses, const std::vector<Vec3>& places_um,
                                    Index dimension, const substrate::Substrate& gel) {
  const substrate::Loads loads{ellipses, static_cast<int>(dimension)};
  if (dimension > 2) return gel.response(loads, {places_um, substrate::Components::all});
  std::vector<Vec2> along_um;
  for (const Vec3& place : places_um) along_um.push_back({place.x, place.y});
  return gel.response(loads, {along_um});
}

MatrixXd by_root_of_area(MatrixXd compliance_um_per_nN, const std::vector<substrate::Ellipse>& places) {
  const Index each = compliance_um_per_nN.cols() / std::max<Index>(1, std::ssize(places));
  for (Index i = 0; i < std::ssize(places); ++i)
    compliance_um_per_nN.middleCols(each * i, each) *= std::sqrt(std::numbers::pi) * places[i].semi_major_um;
  return compliance_um_per_nN;
}

Scores at(const Scores& s, const std::vector<Index>& columns) {
  return {s.information(columns, columns), s.scores(columns)};
}

Scores beside(const Scores& s, const std::vector<Index>& columns, double kappa) {
  MatrixXd inner = s.information(columns, columns);
  inner.diagonal().array() += 1 / kappa;
  const MatrixXd across = s.information(Eigen::all, columns);
  const MatrixXd gain = numerics::solve_symmetric(inner, across.transpose()).transpose();
  return {.information = numerics::minus_product(s.information, gain, across.transpose()),
          .scores = numerics::minus_matvec(s.scores, gain, s.scores(columns))};
}

Spectrum spectrum_of(const Scores& s) {
  const auto [values, vectors] = numerics::symmetric_eigen(s.information);
  const double rounding = 1e-10 * std::max(values.maxCoeff(), 1e-300);
  const auto stands_out = (values.array() > rounding).cast<double>();
  return {.information = values.array() * stands_out,
          .found = numerics::transposed_matvec(vectors, s.scores).array().square() * stands_out};
}

double log_bayes_factor(const Spectrum& s, double kappa) {
  double sum = 0;
  for (Index i = 0; i < s.information.size(); ++i) {
    const double total = 1 + kappa * s.information[i];
    sum += kappa * s.found[i] / total - std::log(total);
  }
  return 0.5 * sum;
}

double likeliest_kappa(const Spectrum& s) {
  constexpr double kStep = 1.25, kLeast = 1e-6, kMost = 1e12;  // relative to what just exceeds the noise
  const double unit = 1 / std::max(s.information.maxCoeff(), 1e-300);
  double best = 0, most = 0;
  for (double kappa = kLeast; kappa < kMost; kappa *= kStep) {
    const double here = log_bayes_factor(s, kappa * unit);
    if (here <= most) continue;
    most = here;
    best = kappa * unit;
  }
  return best;
}

std::vector<std::size_t> causes_among(Scores scores, const std::vector<std::vector<Index>>& columns,
                                      const std::vector<double>& log_odds_against, std::optional<double> kappa) {
  std::vector<std::size_t> causes;
  while (causes.size() < columns.size()) {
    std::size_t best = 0;
    double most = 0, its_kappa = 0;
    for (std::size_t k = 0; k < columns.size(); ++k) {
      if (std::ranges::find(causes, k) != causes.end()) continue;
      const Spectrum spectrum = spectrum_of(at(scores, columns[k]));
      const double here_kappa = kappa ? *kappa : likeliest_kappa(spectrum),
                   here = log_bayes_factor(spectrum, here_kappa) - log_odds_against[k];
      if (here > most) best = k, most = here, its_kappa = here_kappa;
    }
    if (most <= 0) break;
    causes.push_back(best);
    scores = beside(scores, columns[best], its_kappa);
  }
  return causes;
}

Pattern pattern_of(const LinearData& data, const MatrixXd& columns_um) {
  const VectorXd weight = squared_weights(data);
  const MatrixXd weighted = weight.asDiagonal() * less_motion(data, columns_um);
  const MatrixXd pulled = data.response->pull_back(weighted);  // Gᵀ W² P X
  MatrixXd forces_nN = solve_normal(data.reduced, pulled);
  const MatrixXd left =
      numerics::transposed_product(columns_um, weighted) - numerics::transposed_product(pulled, forces_nN);
  const VectorXd residual = residual_um(data, free_forces_nN(data.reduced));
  return {.forces_nN = std::move(forces_nN),
          .beyond = {.information = 0.5 * (left + left.transpose()),
                     .scores = numerics::transposed_matvec(columns_um, weight.cwiseProduct(residual))}};
}

double variance_beside(const LinearData& data, const Scores& beyond) {
  const Spectrum s = spectrum_of(beyond);
  double explained = 0;
  auto n_left = static_cast<double>(data.n_used - data.reduced.n_felt);
  for (Index i = 0; i < s.information.size(); ++i) {
    if (s.information[i] <= 0) continue;
    explained += s.found[i] / s.information[i];
    n_left -= 1;
  }
  return std::max((data.reduced.floor_squared - explained) / std::max(1.0, n_left), data.has_errors ? 1.0 : 1e-300);
}

Left::Left(const EnsembleFit& fit)
    : Left(fit, fit.model_error ? fit.model_error->stated_variance_nN2 : VectorXd(), fit.misfit.variance,
           fit.data.threads) {}

Left::Left(const EnsembleFit& fit, const VectorXd& force_variance_nN2, double variance, int threads)
    : data_(force_variance_nN2.size() > 0 ? whitened(fit.data.reduced, force_variance_nN2 / variance, threads)
                                          : fit.data.reduced),
      variance_(variance),
      threads_(threads) {
  const VectorXd residual = data_.target - displace(data_, fit.forces.nN);
  const MatrixXd CJ = displace(data_, fit.meshes.front().force_derivatives, threads);
  const MatrixXd cross_terms = numerics::transposed_product(CJ, *data_.compliance, threads);
  MatrixXd H = numerics::small_transposed_product(CJ, CJ);
  H.diagonal() += 1e-9 * H.diagonal() + VectorXd::Constant(H.rows(), 1e-300);
  const numerics::SmallCholesky solver(H);
  followed_ = solver.solve_lower(cross_terms);
  scores_ = numerics::transposed_matvec(*data_.compliance, residual) -
            numerics::transposed_matvec(cross_terms, solver.solve(numerics::transposed_matvec(CJ, residual)));
}

Scores Left::over_s(const MatrixXd& compliance, const MatrixXd& followed, const VectorXd& scores) const {
  return {.information = numerics::small_transposed_product(compliance, compliance) -
                         numerics::small_transposed_product(followed, followed),
          .scores = scores / std::sqrt(variance_)};
}

Scores Left::scores_of(const Pattern& pattern) const {
  const MatrixXd& X = pattern.forces_nN;
  Scores scores = over_s(displace(data_, X, threads_), numerics::product(followed_, X, threads_),
                         numerics::transposed_matvec(X, scores_) + pattern.beyond.scores);
  scores.information += pattern.beyond.information;
  return scores;
}

Scores Left::scores_of(const std::vector<Index>& components) const {
  return over_s((*data_.compliance)(Eigen::all, components), followed_(Eigen::all, components), scores_(components));
}

void Left::for_each_block(const std::function<void(Index, const MatrixXd&)>& body) const {
  numerics::for_each_gram_block(*data_.compliance, threads_, [&](Index first, const MatrixXd& gram) {
    body(first, gram - numerics::transposed_product(followed_.leftCols(gram.rows()),
                                                    followed_.middleCols(first, gram.cols()), threads_));
  });
}

namespace {

constexpr double kDepth_um = 60;    // of a spread cell
constexpr double kPiece_um = 30;    // half of its breadth
constexpr double kMostPieces = 10;  // of a side: a field that is wider has room for rest

struct Piece {
  Vec2 low_um, high_um;
  Polygon ring() const { return {low_um, {high_um.x, low_um.y}, high_um, {low_um.x, high_um.y}}; }
};

/// Once around the field, from its upper left corner.
std::vector<Piece> pieces_around(const Extent& field) {
  const auto& [low, high] = field;
  const Vec2 size = high - low, deep{kDepth_um, kDepth_um};
  const auto n_along = [](double um) {
    return static_cast<int>(std::clamp(std::round(um / kPiece_um), 1.0, kMostPieces));
  };
  const int n_across = n_along(size.x), n_down = n_along(size.y);
  const Vec2 step{size.x / n_across, size.y / n_down};
  std::vector<Piece> pieces{{low - deep, low}};
  for (int i = 0; i < n_across; ++i)
    pieces.push_back({{low.x + i * step.x, low.y - kDepth_um}, {low.x + (i + 1) * step.x, low.y}});
  pieces.push_back({{high.x, low.y - kDepth_um}, {high.x + kDepth_um, low.y}});
  for (int i = 0; i < n_down; ++i)
    pieces.push_back({{high.x, low.y + i * step.y}, {high.x + kDepth_um, low.y + (i + 1) * step.y}});
  pieces.push_back({high, high + deep});
  for (int i = n_across; i-- > 0;)
    pieces.push_back({{low.x + i * step.x, high.y}, {low.x + (i + 1) * step.x, high.y + kDepth_um}});
  pieces.push_back({{low.x - kDepth_um, high.y}, {low.x, high.y + kDepth_um}});
  for (int i = n_down; i-- > 0;)
    pieces.push_back({{low.x - kDepth_um, low.y + i * step.y}, {low.x, low.y + (i + 1) * step.y}});
  return pieces;
}

/// Discs on a piece, as large as it is wide: what a cell out there does in the field is smooth.
std::vector<substrate::Ellipse> discs_on(const Piece& piece) {
  const Vec2 size = piece.high_um - piece.low_um;
  const double width_um = std::clamp(std::min(size.x, size.y), kPiece_um / 2, kDepth_um);
  const int nx = std::max(1, static_cast<int>(std::lround(size.x / width_um)));
  const int ny = std::max(1, static_cast<int>(std::lround(size.y / width_um)));
  const Vec2 step{size.x / nx, size.y / ny};
  const double radius_um = std::sqrt(step.x * step.y / std::numbers::pi);
  std::vector<substrate::Ellipse> discs;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i)
      discs.push_back({.centre_um = piece.low_um + Vec2{(i + 0.5) * step.x, (j + 0.5) * step.y},
                       .semi_major_um = radius_um,
                       .semi_minor_um = radius_um,
                       .angle_rad = 0});
  return discs;
}

}  // namespace

std::vector<Polygon> neighbours_beyond_border(const LinearData& data, const Cell& cell, const Gel& gel) {
  const Extent field = extent_of(data.position_um);
  if (!(field.area_um2() > 0)) return {};
  std::vector<Piece> pieces = pieces_around(field);
  // what lies beyond a cut is allowed for
  std::erase_if(pieces, [&](const Piece& p) {
    return !cuts_of(cell).empty() && distance_to_cut_um(cell, 0.5 * (p.low_um + p.high_um)) < kDepth_um;
  });
  if (pieces.empty()) return {};
  std::vector<substrate::Ellipse> discs;
  std::vector<std::vector<Index>> columns;
  for (const Piece& piece : pieces) {
    const std::vector<substrate::Ellipse> own = discs_on(piece);
    std::vector<Index>& of_piece = columns.emplace_back();
    for (Index k = 0; k < data.dimension * std::ssize(own); ++k)
      of_piece.push_back(data.dimension * std::ssize(discs) + k);
    discs.insert(discs.end(), own.begin(), own.end());
  }
  // a layer's tables would take longer than all the rest, and the field of random forces is as smooth
  const auto half_space = greens::make_greens(gel, {.model = substrate::ModelKind::half_space}, data.threads);
  Scores scores =
      pattern_of(data, by_root_of_area(response_to(discs, places_of_beads(data), data.dimension, *half_space)->matrix(),
                                       discs))
          .beyond;
  const double variance = variance_beside(data, scores);
  // Simulated beads without noise: what is left is rounding, and has a shape.
  constexpr double kRounding = 1e-6;  // of the displacement: tables have nine digits, models five and more
  const double mean_square = squared_weights(data).dot(data.displacement_um.cwiseAbs2()) /
                             std::max<double>(1, static_cast<double>(data.n_used));
  if (variance < kRounding * kRounding * mean_square) return {};
  scores.scores /= std::sqrt(variance);
  // half of a likelihood ratio exceeds x by chance less often than exp(-x) (Self & Liang, JASA 82 (1987) 605)
  const std::vector<double> against(columns.size(), std::log(static_cast<double>(columns.size()) / 1e-4));
  std::set<std::size_t> with_next;
  for (const std::size_t k : causes_among(std::move(scores), columns, against))
    for (const std::size_t near : {k, (k + 1) % pieces.size(), (k + pieces.size() - 1) % pieces.size()})
      with_next.insert(near);
  std::vector<Polygon> found;
  for (const std::size_t k : with_next) found.push_back(pieces[k].ring());
  return found;
}

std::vector<std::string> borders_of(const std::vector<Polygon>& pieces_um, const std::vector<Vec2>& beads_um) {
  const auto [low, high] = extent_of(beads_um);
  std::vector<std::string> names;
  for (const Polygon& piece : pieces_um) {
    const Vec2 at = extent_of(piece).middle_um();
    const std::string down = at.y < low.y ? "upper" : at.y > high.y ? "lower" : "";
    const std::string across = at.x < low.x ? "left" : at.x > high.x ? "right" : "";
    const std::string name = down + (down.empty() || across.empty() ? "" : " ") + across;
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  return names;
}

}  // namespace mbtfm::tensions
