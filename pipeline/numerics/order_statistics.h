/// Medians and quantiles: one of the values, never a mean of two, so that they hold for any kind of value.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace mbtfm::numerics {

/// The value of this rank, 0 … size − 1. Reorders the values.
template <class Values>
auto of_rank_in(Values& values, std::size_t rank) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// The middle value, the upper one of two. Reorders the values, at least one.
template <class Values>
auto median_in(Values& values) {
  return of_rank_in(values, values.size() / 2);
}
template <class T>
T median(std::vector<T> values) {
  return median_in(values);
}

/// The value of rank share · (size − 1), rounded down; 0 where there are no values.
/// @param share  0 … 1
template <class T>
T quantile(std::vector<T> values, double share) {
  if (values.empty()) return T{};
  return of_rank_in(values, static_cast<std::size_t>(share * static_cast<double>(values.size() - 1)));
}

}  // namespace mbtfm::numerics
