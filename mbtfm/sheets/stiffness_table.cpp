#include "mbtfm/sheets/stiffness_table.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/material.h"

namespace mbtfm::sheets {
namespace {

constexpr double kSoftest = 0.03, kStiffest = 300;   // M / (mu R)
constexpr double kWeakest = 0.03, kStrongest = 500;  // kappa R / mu
constexpr int kSheets = 12;                          // solved for, where the bond is known
constexpr int kManyLoads = 12, kSheetsOfMany = 6;    // solutions of one load serve the others, too
constexpr int kSheetsOfEach = 8, kAdhesions = 6;     // where it is fitted

/// Chebyshev's nodes of the logarithm.
std::vector<double> nodes_of(const StiffnessRange& range, int n) {
  std::vector<double> nodes;
  const double low = std::log(range.low), high = std::log(range.high);
  for (int k = 0; k < n; ++k)
    nodes.push_back(std::exp(0.5 * (low + high) - 0.5 * (high - low) * std::cos((k + 0.5) * std::numbers::pi / n)));
  return nodes;
}

/// By part, then of the line and the bundles.
MatrixXd loads_of(const SheetShape& shape) {
  sheet::Sheet unit;
  unit.n_rims = shape.n_rims;
  MatrixXd loads(2 * shape.elements->n_nodes(),
                 std::ssize(shape.contractions) + (shape.has_line ? 1 : 0) + std::ssize(shape.bundles));
  Index load = 0;
  for (const std::vector<double>& contraction : shape.contractions) {
    unit.contraction_nN_per_um = contraction;
    loads.col(load++) = sheet::forces_of_contraction_nN(*shape.elements, unit);
  }
  if (shape.has_line) {
    unit.contraction_nN_per_um = sheet::even(*shape.elements, 0);
    unit.line_tension_nN = 1;
    loads.col(load++) = sheet::forces_of_contraction_nN(*shape.elements, unit);
  }
  for (const sheet::Bundle& bundle : shape.bundles)
    loads.col(load++) = sheet::forces_of_bundle_nN(*shape.elements, bundle);
  return loads;
}

/// Orthogonal columns that span the others, all taken for equally long, to the tolerance of their solution.
MatrixXd basis_of(MatrixXd columns) {
  constexpr double kLeast = 1e-7;
  columns.colwise().normalize();
  return numerics::principal_directions(std::move(columns), kLeast);
}

}  // namespace

std::vector<Stiffnesses> StiffnessTable::examples(Index n_loads) const {
  std::vector<Stiffnesses> examples;
  if (!adhesion_) {
    for (const double M : nodes_of(sheet_, n_loads > kManyLoads ? kSheetsOfMany : kSheets))
      examples.push_back({M, known_adhesion_});
    return examples;
  }
  for (const double kappa : nodes_of(*adhesion_, kAdhesions))
    for (const double M : nodes_of(sheet_, kSheetsOfEach)) examples.push_back({M, kappa});
  return examples;
}

StiffnessTable::StiffnessTable(const SheetShape& shape, const sheet::OnGel& ground, const Gel& gel, double size_um,
                               int threads)
    : n_contractions_(static_cast<int>(shape.contractions.size())),
      has_line_(shape.has_line),
      bundles_(shape.bundles),
      known_adhesion_(shape.adhesion_nN_per_um3) {
  const double mu = substrate::shear_modulus_kPa(gel);
  sheet_ = {kSoftest * mu * size_um, kStiffest * mu * size_um};
  if (shape.bond == Bond::fitted) adhesion_ = {kWeakest * mu / size_um, kStrongest * mu / size_um};
  const MatrixXd loads = loads_of(shape);
  const std::vector<Stiffnesses> at = examples(loads.cols());
  const auto n_examples = static_cast<int>(at.size());
  MatrixXd solved(2 * std::ssize(ground.patches()), n_examples * loads.cols());
  numerics::parallel_for(n_examples, threads, [&](int j) {
    const Stiffnesses& of = at[j];
    const double nu = shape.poisson_ratio;
    const sheet::Material material{of.sheet_nN_per_um * (1 - nu * nu), nu, 1};  // only its product with the thickness
    solved.middleCols(j * loads.cols(), loads.cols()) =
        ground.solve_all(material, of.adhesion_nN_per_um3, loads).forces_nN;
  });
  forces_nN_ = basis_of(std::move(solved));
  equations_ = ground.reduced(forces_nN_, shape.poisson_ratio, loads);
}

MatrixXd StiffnessTable::shares(const Stiffnesses& at) const {
  MatrixXd matrix = equations_.gel + equations_.sheet / at.sheet_nN_per_um;
  if (at.adhesion_nN_per_um3) matrix += equations_.slip / *at.adhesion_nN_per_um3;
  return numerics::solve_symmetric(matrix, equations_.pull / at.sheet_nN_per_um);
}

}  // namespace mbtfm::sheets
