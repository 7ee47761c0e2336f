/// The plan as pictures and as a page that stands alone.
#pragma once

#include <string>

namespace mbtfm::plan {

template <class Quantity>
struct PlanOf;

/// A chart for each noise: standard error of the middle fibre or patch over density, a curve for each gel, the target
/// as a line.
template <class Quantity>
std::string svg_of(const PlanOf<Quantity>& plan);
template <class Quantity>
std::string html_of(const PlanOf<Quantity>& plan);

}  // namespace mbtfm::plan
