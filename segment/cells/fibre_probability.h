/// How probable it is that a traced line is a fibre, and not the meshwork's or the cell's edge.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "pipeline/contract/geometry.h"

namespace mbtfm::cells {

/// 1 / (1 + exp(−Σ aᵢ xᵢ)): a probability by logistic regression.
template <std::size_t n>
double logistic(const std::array<double, n>& terms, const std::array<double, n>& coefficients) {
  return 1 / (1 + std::exp(-std::inner_product(terms.begin(), terms.end(), coefficients.begin(), 0.0)));
}

/// What the actin image shows of a line, without units where none is named.
struct FibreEvidence {
  double log_false = 0;        ///< logarithm of how many lines as significant the cell's texture makes
  double length_um = 0;        ///< as traced
  double relative_height = 1;  ///< over the median of the cell's fibres
  double share_beside = 0;     ///< of its length that has a fibre beside it
  double cortex = 0;           ///< see cortex_along()
  double n_fibres = 0;         ///< of moderate significance in the cell
  double significance = 0;     ///< grows with the root of the length
};

/// The probability, 0 to 1. Logistic regression on the lines of simulated cells: tests/studies/fibre_probability.py
/// prints the coefficients, docs/theory/segmentation.md, (25), has the equation.
double probability_of(const FibreEvidence& evidence);

/// Share of a line that runs along the outline within 30 degrees, times exp(−d/2 um), d the line's least distance to
/// it: 1 for a line on the cell's edge. 0 without an outline.
double cortex_along(const Polyline& line_um, const Polygon& outline_um);

/// The terms of the regression; the first one is constant.
std::array<double, 7> terms_of(const FibreEvidence& evidence);

}  // namespace mbtfm::cells
