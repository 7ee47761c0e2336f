#include "substrate/surface/band.h"

#include <cmath>

namespace mbtfm::surface {

using Eigen::VectorXd;

VectorXd Band::times(const VectorXd& x) const {
  VectorXd y = VectorXd::Zero(n);
  for (int j = 0; j < n; ++j) {
    const int m = below(j);
    y.segment(j, m + 1) += x[j] * column(j);
    y[j] += column(j).tail(m).dot(x.segment(j + 1, m));
  }
  return y;
}

bool factorise(Band& a) {
  for (int j = 0; j < a.n; ++j) {
    if (!(a.at(j, j) > 0)) return false;
    const int m = a.below(j);
    a.at(j, j) = std::sqrt(a.at(j, j));
    for (int k = 1; k <= m; ++k) a.at(j + k, j) /= a.at(j, j);
    for (int k = 1; k <= m; ++k) {
      const double share = a.at(j + k, j);
      if (share == 0) continue;
      Eigen::Map<VectorXd>(&a.at(j + k, j + k), m - k + 1) -= share * a.column(j).tail(m - k + 1);
    }
  }
  return true;
}

VectorXd solve(const Band& l, VectorXd x) {
  for (int j = 0; j < l.n; ++j) {
    const int m = l.below(j);
    x[j] /= l.at(j, j);
    x.segment(j + 1, m) -= x[j] * l.column(j).tail(m);
  }
  for (int j = l.n - 1; j >= 0; --j) {
    const int m = l.below(j);
    x[j] = (x[j] - l.column(j).tail(m).dot(x.segment(j + 1, m))) / l.at(j, j);
  }
  return x;
}

Band inverse_within(const Band& l) {
  Band inverse(l.n, l.width);
  for (int j = l.n - 1; j >= 0; --j) {
    const int m = l.below(j);
    const auto column = l.column(j);
    VectorXd sum = VectorXd::Zero(m);  // the inverse's rows and columns j + 1 .. j + m times the column
    for (int k = 0; k < m; ++k) {
      const int rest = m - k - 1;
      const auto part = inverse.column(j + 1 + k);
      sum.segment(k, rest + 1) += column[k + 1] * part.head(rest + 1);
      sum[k] += part.segment(1, rest).dot(column.segment(k + 2, rest));
    }
    double diagonal = 1 / column[0];
    for (int k = 0; k < m; ++k) {
      inverse.at(j + 1 + k, j) = -sum[k] / column[0];
      diagonal -= column[k + 1] * inverse.at(j + 1 + k, j);
    }
    inverse.at(j, j) = diagonal / column[0];
  }
  return inverse;
}

}  // namespace mbtfm::surface
