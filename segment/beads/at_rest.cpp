#include "segment/beads/far_field.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "pipeline/numerics/order_statistics.h"
#include "segment/beads/plane.h"

namespace mbtfm::beads {
namespace {

/// Half a dozen beads know their mean to under half of a bead's noise, and outliers among them show. Three are enough
/// where squares would be so large that they hide the tail of a cell's field; fewer than ten a side show none.
constexpr double kBeadsOfSquare = 6, kFewestOfSquare = 3, kFewSquares = 10, kFineSquares = 16;  // the last two a side
constexpr int kMostSquares = 24;  // a side: an ordinary cell's tail is smooth over a 24th of the picture
/// What moves by less than this share of the largest displacement may be the cell's tail; where that leaves less than a
/// quarter of the picture at rest, by less than twice as much: the tail of a cell that the border cuts is long.
constexpr double kTail = 0.1;
constexpr double kEnough = 0.25;
/// What moves by more is pulled by adhesions nearby: the field of one falls to a quarter within two of its widths.
constexpr double kPulled = 0.25;
/// Of the picture's side: what is as near to what is pulled may be, too. Gaps in a ring of adhesions are closed so,
/// since inside of it the gel is quiet, but not far away.
constexpr double kGap = 1.0 / 12;
/// A gel grows, and a dish put back is turned, by a few per cent at most.
constexpr double kLargestLinear = 0.03;

FieldCell cell_of(const std::vector<int>& beads, const std::vector<Vec2>& positions, const std::vector<Vec2>& u) {
  FieldCell cell;
  if (beads.empty()) return cell;
  std::vector<double> x, y, off;
  for (const int k : beads) x.push_back(u[k].x), y.push_back(u[k].y);
  const Vec2 median{numerics::quantile(std::move(x), 0.5), numerics::quantile(std::move(y), 0.5)};
  for (const int k : beads) off.push_back(norm(u[k] - median));
  cell.spread = numerics::quantile(off, 0.5) / 1.18;  // the median length of a two-dimensional normal is 1.18 sd
  for (std::size_t at = 0; at < beads.size(); ++at) {
    if (beads.size() >= 4 && off[at] > 3 * 1.18 * cell.spread) continue;
    cell.place += positions[beads[at]];
    cell.u += u[beads[at]];
    ++cell.n_beads;
  }
  cell.place = (1.0 / cell.n_beads) * cell.place;
  cell.u = (1.0 / cell.n_beads) * cell.u;
  return cell;
}

RestingField in_squares(const std::vector<Vec2>& positions, const std::vector<Vec2>& u, Vec2 corner, double width,
                        double height) {
  RestingField field{.corner = corner, .width = width, .height = height, .cells = {}, .motion = {}};
  const auto n = static_cast<double>(positions.size());
  const double most = std::min(std::sqrt(n / kFewestOfSquare), kFineSquares),
               wanted = std::max(std::sqrt(n / kBeadsOfSquare), most < kFewSquares ? 0.0 : most);
  field.side = std::sqrt(width * height) / std::clamp(std::floor(wanted), 2.0, 1.0 * kMostSquares);
  field.nx = std::max(1, static_cast<int>(std::lround(width / field.side)));
  field.ny = std::max(1, static_cast<int>(std::lround(height / field.side)));
  std::vector<std::vector<int>> beads(static_cast<std::size_t>(field.nx) * field.ny);
  for (std::size_t k = 0; k < positions.size(); ++k)
    beads[field.square_of(positions[k])].push_back(static_cast<int>(k));
  std::vector<double> spreads;
  for (const auto& own : beads) {
    field.cells.push_back(cell_of(own, positions, u));
    if (own.size() >= 4) spreads.push_back(field.cells.back().spread);
  }
  field.bead_noise = numerics::quantile(std::move(spreads), 0.5);
  return field;
}

/// Call use(i, j, k) for each square, k its index.
template <class Use>
void for_each_square(const RestingField& field, const Use& use) {
  for (int j = 0; j < field.ny; ++j) {
    for (int i = 0; i < field.nx; ++i) use(i, j, static_cast<std::size_t>(j) * field.nx + i);
  }
}

/// The same of the squares within `reach` of one, itself among them, inside of the picture.
template <class Use>
void for_each_within(const RestingField& field, int i, int j, int reach, const Use& use) {
  for (int b = std::max(0, j - reach); b <= std::min(field.ny - 1, j + reach); ++b) {
    for (int a = std::max(0, i - reach); a <= std::min(field.nx - 1, i + reach); ++a)
      use(a, b, static_cast<std::size_t>(b) * field.nx + a);
  }
}

bool is_border(const RestingField& field, int i, int j) {
  return i == 0 || j == 0 || i == field.nx - 1 || j == field.ny - 1;
}

/// Weighted least squares over the squares; the linear part is held to what pictures do.
AffineMotion fitted(const RestingField& field, const std::vector<double>& weights, Vec2 centre, double scale,
                    double width) {
  cv::Matx<double, 6, 6> normal;
  cv::Vec<double, 6> right;
  for (std::size_t k = 0; k < field.cells.size(); ++k) {
    if (!(weights[k] > 0)) continue;
    const FieldCell& cell = field.cells[k];
    const GlobalColumns c = global_columns((1 / scale) * (cell.place - centre));
    for (int a = 0; a < 6; ++a) {
      for (int b = 0; b < 6; ++b) normal(a, b) += weights[k] * (c.x[a] * c.x[b] + c.y[a] * c.y[b]);
      right[a] += weights[k] * (c.x[a] * cell.u.x + c.y[a] * cell.u.y);
    }
  }
  const double per_variance = width * width / std::pow(kLargestLinear * scale, 2);
  for (int a = 0; a < 6; ++a) normal(a, a) += a < 2 ? 1e-12 : per_variance;
  const cv::Vec<double, 6> p = normal.solve(right, cv::DECOMP_SVD);
  return {{p[0], p[1]}, p[2] / scale, p[3] / scale, p[4] / scale, p[5] / scale, centre};
}

double misfit(const FieldCell& cell, const AffineMotion& motion) { return norm(cell.u - motion.at(cell.place)); }

struct Standing {
  AffineMotion motion;
  double score = -1;
};

/// The picture as it is divided for the search.
struct Search {
  const RestingField& field;
  Vec2 centre;
  double scale;                  ///< half the picture
  std::vector<double> width_of;  ///< by square: what a square at rest may be off by

  double weight(std::size_t k, const AffineMotion& motion, double widened) const {
    if (field.cells[k].n_beads == 0) return 0;
    const double r = misfit(field.cells[k], motion) / (widened * width_of[k]), s = 1 / (1 + r * r);
    return s * s;
  }

  Standing from(const std::function<bool(int, int)>& is_in) const {
    std::vector<double> weights(field.cells.size(), 0), misfits;
    const double typical = numerics::quantile(width_of, 0.5);
    for_each_square(field,
                    [&](int i, int j, std::size_t k) { weights[k] = field.cells[k].n_beads > 0 && is_in(i, j); });
    Standing result{fitted(field, weights, centre, scale, typical)};
    for (std::size_t k = 0; k < weights.size(); ++k) {
      if (weights[k] > 0) misfits.push_back(misfit(field.cells[k], result.motion));
    }
    if (misfits.empty()) return result;
    double widened = std::max(1.0, numerics::quantile(std::move(misfits), 0.7) / typical);
    for (int round = 0; round < 20; ++round, widened = std::max(1.0, 0.7 * widened)) {
      for (std::size_t k = 0; k < weights.size(); ++k) weights[k] = weight(k, result.motion, widened);
      result.motion = fitted(field, weights, centre, scale, typical);
    }
    result.score = 0;
    for (std::size_t k = 0; k < weights.size(); ++k) result.score += weight(k, result.motion, 1);
    return result;
  }
};

AffineMotion mode_of(const Search& search) {
  const int nx = search.field.nx, ny = search.field.ny;
  struct Place {
    double left, top, right, bottom;  ///< distances from the sides, as shares of the picture
  };
  const auto place = [&](int i, int j) {
    const double x = (i + 0.5) / nx, y = (j + 0.5) / ny;
    return Place{x, y, 1 - x, 1 - y};
  };
  using Part = std::function<bool(const Place&)>;
  std::vector<Part> parts = {[](const Place&) { return true; },
                             [](const Place& p) {
                               return std::min({p.left, p.top, p.right, p.bottom}) < 0.15;
                             }};
  for (const double share : {0.2, 0.4}) {
    for (const auto side : {&Place::left, &Place::top, &Place::right, &Place::bottom}) {
      parts.emplace_back([=](const Place& p) { return p.*side < share; });
    }
    for (const auto side : {&Place::left, &Place::right}) {
      for (const auto other : {&Place::top, &Place::bottom}) {
        parts.emplace_back([=](const Place& p) { return std::max(p.*side, p.*other) < 1.5 * share; });
      }
    }
  }
  Standing best;
  for (const Part& part : parts) {
    const Standing next = search.from([&](int i, int j) { return part(place(i, j)); });
    if (next.score > best.score * (1 + 1e-9)) best = next;
  }
  return best.motion;
}

/// 1 for squares for which something holds, else 0.
using Squares = cv::Mat1b;

/// How many of the eight around each square, inside of the picture.
cv::Mat1d n_around(const Squares& is) {
  cv::Mat1b ring(3, 3, uchar{1});
  ring(1, 1) = 0;
  cv::Mat1d n;
  cv::filter2D(is, n, CV_64F, ring, {-1, -1}, 0, cv::BORDER_CONSTANT);
  return n;
}

/// A square goes with most of those around it: noise makes single ones of either kind.
Squares smoothed(const RestingField& field, const Squares& is) {
  const cv::Mat1d share = n_around(is) / n_around(Squares(is.size(), 1));
  Squares result = is.clone();
  for_each_square(field, [&](int i, int j, std::size_t k) {
    if (share(j, i) < 0.3) result(j, i) = 0;
    if (share(j, i) > 0.7 || (field.cells[k].n_beads == 0 && share(j, i) > 0.5)) result(j, i) = 1;
  });
  return result;
}

/// Only what is connected with the border: inside of a ring of adhesions the gel is quiet, but not far away.
Squares from_border(const Squares& is) {
  Squares framed;
  cv::copyMakeBorder(is, framed, 1, 1, 1, 1, cv::BORDER_CONSTANT, 1);
  cv::floodFill(framed, {0, 0}, 2);
  return (framed(cv::Rect(1, 1, is.cols, is.rows)) == 2) & 1;
}

/// All squares within `reach` of one for which `is` holds.
Squares grown(const Squares& is, int reach) {
  Squares result;
  cv::dilate(is, result, Squares(2 * reach + 1, 2 * reach + 1, 1));
  return result;
}

/// Mean of a square and the eight around it, beside a motion; nothing where there are no beads. Where squares are as
/// large as can show a tail, nine would hide what an adhesion pulls: there a square is alone.
struct Around {
  Vec2 u;
  int n_beads = 0;
};
Around around(const RestingField& field, const AffineMotion& motion, int i, int j) {
  Around result;
  const int n = std::min(field.nx, field.ny);
  for_each_within(field, i, j, n >= kFewSquares && n < kFineSquares ? 0 : 1, [&](int, int, std::size_t k) {
    const FieldCell& cell = field.cells[k];
    if (cell.n_beads == 0) return;
    result.u += cell.n_beads * (cell.u - motion.at(cell.place));
    result.n_beads += cell.n_beads;
  });
  if (result.n_beads > 0) result.u = (1.0 / result.n_beads) * result.u;
  return result;
}

/// Squares that move by more than a share of the largest displacement.
Squares pulled(const RestingField& field, double share) {
  Squares result(field.ny, field.nx);
  for_each_square(field, [&](int i, int j, std::size_t) {
    const Around here = around(field, field.motion, i, j);
    const double error = field.bead_noise / std::sqrt(std::max(1, here.n_beads));
    result(j, i) = here.n_beads == 0 || norm(here.u) > std::max(3 * error, share * field.largest);
  });
  return smoothed(field, result);
}

double share_of_border(const RestingField& field, const Squares& is) {
  int n = 0, n_is = 0;
  for_each_square(field, [&](int i, int j, std::size_t) {
    if (is_border(field, i, j)) ++n, n_is += is(j, i);
  });
  return 1.0 * n_is / std::max(1, n);
}

/// Largest motion along the border, as a mean of nine squares, over the largest displacement.
double pull_of_border(const RestingField& field) {
  double border = 0;
  for_each_square(field, [&](int i, int j, std::size_t) {
    if (is_border(field, i, j)) border = std::max(border, norm(around(field, field.motion, i, j).u));
  });
  return field.largest > 0 ? border / field.largest : 0;
}

/// What rests by the field's motion and largest displacement.
void divide(RestingField& field, double tail) {
  const int gap = std::max(1, static_cast<int>(std::lround(kGap * std::min(field.nx, field.ny))));
  const Squares closed = grown(pulled(field, tail), gap);
  const Squares rests = grown(from_border(1 - closed), gap - 1);
  int n = 0, n_rests = 0;
  field.n_moving = 0;
  for_each_square(field, [&](int i, int j, std::size_t k) {
    field.cells[k].rests = rests(j, i);
    field.n_moving += !rests(j, i);
    if (field.cells[k].n_beads > 0) ++n, n_rests += rests(j, i);
  });
  field.share_at_rest = n == 0 ? 0 : 1.0 * n_rests / n;
  field.share_of_border_moving = share_of_border(field, 1 - rests);
  field.share_of_border_pulled = share_of_border(field, pulled(field, kPulled));
  field.pull_of_border = pull_of_border(field);
}

}  // namespace

std::size_t RestingField::square_of(Vec2 place) const {
  const int i = std::clamp(static_cast<int>((place.x - corner.x) / width * nx), 0, nx - 1);
  const int j = std::clamp(static_cast<int>((place.y - corner.y) / height * ny), 0, ny - 1);
  return static_cast<std::size_t>(j) * nx + i;
}

double largest_about(const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements,
                     const AffineMotion& motion) {
  std::vector<double> lengths;
  for (std::size_t k = 0; k < positions.size(); ++k)
    lengths.push_back(norm(displacements[k] - motion.at(positions[k])));
  return numerics::quantile(std::move(lengths), 0.99);
}

RestingField resting_field(const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements, Vec2 corner,
                           double width, double height) {
  RestingField field = in_squares(positions, displacements, corner, width, height);
  field.motion.centre = corner + Vec2{0.5 * width, 0.5 * height};
  if (positions.empty()) return field;
  Search search{field, field.motion.centre, 0.5 * std::min(width, height), std::vector<double>(field.cells.size(), 1)};
  std::vector<double> all;
  for (const FieldCell& cell : field.cells) all.push_back(cell.n_beads);
  AffineMotion motion = fitted(field, all, search.centre, search.scale, 1e-9);
  for (int round = 0; round < 2; ++round) {  // the second with the largest displacement about what rests
    field.largest = largest_about(positions, displacements, motion);
    for (std::size_t k = 0; k < field.cells.size(); ++k) {
      const double error = field.bead_noise / std::sqrt(std::max(1, field.cells[k].n_beads));
      search.width_of[k] = std::max({3 * error, kTail * field.largest, 1e-12});
    }
    motion = mode_of(search);
  }
  field.motion = motion;
  field.largest = largest_about(positions, displacements, motion);
  divide(field, kTail);
  if (field.share_at_rest < kEnough) divide(field, 2 * kTail);
  return field;
}

}  // namespace mbtfm::beads
