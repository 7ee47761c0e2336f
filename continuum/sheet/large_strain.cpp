#include "continuum/sheet/large_strain.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "continuum/sheet/stiffness.h"
#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::sheet {
namespace {

using Eigen::Matrix2d;

/// Of a triangle; none where there are none.
const double* springs_of(const Sheet& sheet, int triangle) {
  return sheet.spring_nN_per_um3.empty() ? nullptr : sheet.spring_nN_per_um3.data() + Elements::kPoints * triangle;
}
double spring_at(const double* springs, int point) { return springs ? springs[point] : 0; }

/// First Piola–Kirchhoff stress, and its derivative along a change of the gradient.
struct PointLaw {
  Matrix2d F, S;
  double s, M, nu;
  ContractionMeasure measure;

  PointLaw(const Material& material, double contraction, ContractionMeasure how, const Matrix2d& gradient)
      : F(Matrix2d::Identity() + gradient),
        s(contraction),
        M(material.stiffness_nN_per_um()),
        nu(material.poisson_ratio),
        measure(how) {
    S = law(0.5 * (F.transpose() * F - Matrix2d::Identity()));
    if (measure == ContractionMeasure::second_piola) S += s * Matrix2d::Identity();
  }
  Matrix2d law(const Matrix2d& E) const { return M * ((1 - nu) * E + nu * E.trace() * Matrix2d::Identity()); }
  static Matrix2d cofactor(const Matrix2d& A) {
    return (Matrix2d() << A(1, 1), -A(1, 0), -A(0, 1), A(0, 0)).finished();
  }
  Matrix2d stress() const {
    Matrix2d P = F * S;
    if (measure == ContractionMeasure::surface_tension) P += s * cofactor(F);
    return P;
  }
  Matrix2d change(const Matrix2d& dF) const {
    const Matrix2d dE = 0.5 * (F.transpose() * dF + dF.transpose() * F);
    Matrix2d dP = dF * S + F * law(dE);
    if (measure == ContractionMeasure::surface_tension) dP += s * cofactor(dF);
    return dP;
  }
  double energy() const {
    const Matrix2d E = 0.5 * (F.transpose() * F - Matrix2d::Identity());
    const double elastic = 0.5 * M * ((1 - nu) * E.squaredNorm() + nu * E.trace() * E.trace());
    return elastic + s * (measure == ContractionMeasure::surface_tension ? F.determinant() - 1 : E.trace());
  }
};

PointLaw law_at(const Sheet& sheet, ContractionMeasure measure, int triangle, int point, double share,
                const Matrix2d& gradient) {
  const double s = sheet.contraction_nN_per_um[Elements::kPoints * triangle + point];
  return {sheet.material, share * s, measure, gradient};
}

constexpr double kForceTolerance = 1e-9;  // of the contraction's: the targets ask for 1e-3 of u

/// Newton's method at one load. @returns the steps taken; none where they lead nowhere
std::optional<int> newton(const LoadedSheet& sheet, double share, NodeVectors& u) {
  constexpr int kMostSteps = 30;
  double energy = sheet.energy_fJ(u, share);
  for (int step = 0; step < kMostSteps; ++step) {
    const NodeVectors left = sheet.left_nN(u, share);
    if (left.norm() <= kForceTolerance * sheet.force_scale_nN) return step;
    const std::optional<NodeVectors> move = sheet.move(u, share, left);
    if (!move) return std::nullopt;
    const double slope = left.dot(*move);
    double length = 1, next = sheet.energy_fJ(u + *move, share);
    const double rounding = 1e-13 * std::abs(energy);
    while (!(next <= energy - 1e-4 * length * slope + rounding)) {
      length *= 0.5;
      if (length < 1e-6) return std::nullopt;
      next = sheet.energy_fJ(u + length * *move, share);
    }
    u += length * *move;
    energy = next;
  }
  return std::nullopt;
}

}  // namespace

LargeSheet::LargeSheet(const Elements& elements, const Sheet& sheet, ContractionMeasure measure)
    : elements_(elements), sheet_(sheet), measure_(measure) {
  if (sheet.line_tension_nN != 0)
    throw UsageError(
        "expected no line_tension_nN at large strain: the line's own turn is not followed; strain = small takes it");
}

double LargeSheet::energy_fJ(const NodeVectors& u, double share) const {
  double energy = 0;
  for (int t = 0; t < elements_.n_triangles(); ++t)
    for (int p = 0; p < Elements::kPoints; ++p) {
      const Shape& shape = elements_.at(t, p);
      const Matrix2d gradient = gradient_of(u, elements_.nodes(t), shape);
      if ((Matrix2d::Identity() + gradient).determinant() <= 0) return std::numeric_limits<double>::infinity();
      const Vec2 at = value_of(u, elements_.nodes(t), shape);
      energy += shape.weight_um2 * (law_at(sheet_, measure_, t, p, share, gradient).energy() +
                                    0.5 * spring_at(springs_of(sheet_, t), p) * dot(at, at));
    }
  return energy;
}

NodeVectors LargeSheet::left_nN(const NodeVectors& u, double share) const {
  NodeVectors f = NodeVectors::Zero(u.size());
  elements_.for_each_point([&](int t, int p, const Shape& shape) {
    const Matrix2d P = law_at(sheet_, measure_, t, p, share, gradient_of(u, elements_.nodes(t), shape)).stress();
    const Vec2 at = value_of(u, elements_.nodes(t), shape);
    const double k = spring_at(springs_of(sheet_, t), p);
    for (int i = 0; i < 6; ++i) {
      const Eigen::Vector2d g(shape.gradient_per_um[i].x, shape.gradient_per_um[i].y);
      f.segment<2>(2 * elements_.nodes(t)[i]) -=
          shape.weight_um2 * (P * g + k * shape.value[i] * Eigen::Vector2d(at.x, at.y));
    }
  });
  for (std::size_t i = 0; i < sheet_.held.size(); ++i)
    for (int a = 0; a < 2; ++a)
      if (sheet_.held[i][a]) f(2 * static_cast<Index>(i) + a) = 0;
  return f;
}

void LargeSheet::add_to(Stiffness& stiffness, const NodeVectors& u, double share) const {
  for (int t = 0; t < elements_.n_triangles(); ++t) {
    Stiffness::OfElement K = Stiffness::OfElement::Zero();
    if (const double* springs = springs_of(sheet_, t)) K = spring_stiffness(elements_, t, springs);
    for (int p = 0; p < Elements::kPoints; ++p) {
      const Shape& shape = elements_.at(t, p);
      const PointLaw law = law_at(sheet_, measure_, t, p, share, gradient_of(u, elements_.nodes(t), shape));
      for (int j = 0; j < 6; ++j)
        for (int b = 0; b < 2; ++b) {
          Matrix2d dF = Matrix2d::Zero();
          dF.row(b) << shape.gradient_per_um[j].x, shape.gradient_per_um[j].y;
          const Matrix2d dP = shape.weight_um2 * law.change(dF);
          for (int i = 0; i < 6; ++i)
            K.block<2, 1>(2 * i, 2 * j + b) +=
                dP * Eigen::Vector2d(shape.gradient_per_um[i].x, shape.gradient_per_um[i].y);
        }
    }
    stiffness.add(t, K);
  }
}

NodeVectors LargeSheet::change_nN(const NodeVectors& u, double share, const NodeVectors& change) const {
  NodeVectors f = NodeVectors::Zero(u.size());
  elements_.for_each_point([&](int t, int p, const Shape& shape) {
    const Matrix2d dP = law_at(sheet_, measure_, t, p, share, gradient_of(u, elements_.nodes(t), shape))
                            .change(gradient_of(change, elements_.nodes(t), shape));
    const Vec2 at = value_of(change, elements_.nodes(t), shape);
    const double k = spring_at(springs_of(sheet_, t), p);
    for (std::size_t i = 0; i < 6; ++i)
      f.segment<2>(2 * elements_.nodes(t)[i]) +=
          shape.weight_um2 * (dP * Eigen::Vector2d(shape.gradient_per_um[i].x, shape.gradient_per_um[i].y) +
                              k * shape.value[i] * Eigen::Vector2d(at.x, at.y));
  });
  return f;
}

bool factorise_shifted(Stiffness& stiffness, int threads) {
  bool is_definite = stiffness.factorise(0, threads);
  for (double shift = 1e-4; !is_definite && shift < 10; shift *= 10) is_definite = stiffness.factorise(shift, threads);
  return is_definite;
}

LargeStrain in_load_steps(const LoadedSheet& sheet, Index n_unknowns) {
  constexpr double kSmallestStep = 1.0 / 256;
  LargeStrain result{NodeVectors::Zero(n_unknowns), {}};
  double share = 0, step = 1;
  while (share < 1) {
    NodeVectors u = result.u;
    const double next = std::min(1.0, share + step);
    const std::optional<int> steps = newton(sheet, next, u);
    if (steps) {
      result.report.iterations += *steps;
      result.u = std::move(u);
      share = next;
      continue;
    }
    step *= 0.5;
    if (step < kSmallestStep)
      throw NotSolved({.reason = "the sheet has no equilibrium beyond " + brief(100 * share) +
                                 " % of the contraction: it collapses; strain = small, or a smaller contraction"});
  }
  result.report.converged = true;
  result.report.last_change = sheet.left_nN(result.u, 1).norm() / sheet.force_scale_nN;
  result.report.reason = counted(result.report.iterations, "Newton steps");
  return result;
}

std::vector<Tensor> large_tension_at_points(const Elements& elements, const Sheet& sheet, ContractionMeasure measure,
                                            const NodeVectors& u) {
  std::vector<Tensor> tension;
  elements.for_each_point([&](int t, int p, const Shape& shape) {
    const double s = sheet.contraction_nN_per_um[Elements::kPoints * t + p];
    const PointLaw law(sheet.material, s, measure, gradient_of(u, elements.nodes(t), shape));
    const Matrix2d cauchy = law.stress() * law.F.transpose() / law.F.determinant();
    tension.push_back({cauchy(0, 0), cauchy(1, 1), 0.5 * (cauchy(0, 1) + cauchy(1, 0))});
  });
  return tension;
}

}  // namespace mbtfm::sheet
