#include "mbtfm/plan/cell_numbers.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "pipeline/numerics/distributions.h"

namespace mbtfm::plan {

namespace {

/// Of a list; the scatter of one fibre tells nothing.
struct Moments {
  double mean = 0, sd = 0;
};
Moments moments_of(const std::vector<double>& values) {
  Moments m;
  const auto n = static_cast<double>(values.size());
  for (const double v : values) m.mean += v / n;
  for (const double v : values) m.sd += (v - m.mean) * (v - m.mean);
  m.sd = values.size() > 1 ? std::sqrt(m.sd / (n - 1)) : m.mean;
  return m;
}

}  // namespace

std::vector<Scatter> scatter_of(const Scene& scene, const Computed& c, const Point& point, double between_cells) {
  std::vector<Scatter> all;
  const std::pair<FibreType, Quantity> types[] = {{FibreType::dorsal, Quantity::dorsal},
                                                  {FibreType::arc, Quantity::arc},
                                                  {FibreType::ventral, Quantity::ventral},
                                                  {FibreType::edge, Quantity::edge}};
  for (const auto& [type, quantity] : types) {
    std::vector<double> tensions_nN;
    double squares = 0;
    for (std::size_t i = 1; i < c.cell.fibre_ids.size(); ++i) {
      const auto fibre = std::ranges::find(scene.cell.cell.fibres, c.cell.fibre_ids[i], &Fibre::fibre_id);
      if (fibre->type != type) continue;
      tensions_nN.push_back(c.cell.tensions_nN[static_cast<Eigen::Index>(i)]);
      squares += std::pow(standard_error_nN(c, i, point), 2);
    }
    if (tensions_nN.empty()) continue;
    const Moments m = moments_of(tensions_nN);
    const auto n = static_cast<double>(tensions_nN.size());
    all.push_back({.type = quantity,
                   .mean_nN = m.mean,
                   .between_cells_nN = between_cells * m.mean,
                   .within_nN = m.sd,
                   .error_nN = std::sqrt(squares / n),
                   .fibres_per_cell = n,
                   .source = "this cell's fibres; between cells as given"});
  }
  return all;
}

double power_of(const Scatter& s, double difference_nN, double fibres_per_cell, int cells) {
  const double of_cell =
      s.between_cells_nN * s.between_cells_nN + (s.within_nN * s.within_nN + s.error_nN * s.error_nN) / fibres_per_cell;
  const double degrees = 2.0 * (cells - 1);
  const double shift = difference_nN / std::sqrt(2 * of_cell / cells);
  constexpr double kSure = 30;  // beyond, the distribution is one to all digits
  if (shift > kSure) return 1;
  const double limit = numerics::student_quantile(degrees, 0.975);
  return numerics::student_power(degrees, shift, limit);
}

std::optional<int> cells_for(const Scatter& s, double difference_nN, double fibres_per_cell, double power) {
  constexpr int kMost = 10000;
  int low = 1, high = 2;
  while (high <= kMost && power_of(s, difference_nN, fibres_per_cell, high) < power) {
    low = high;
    high *= 2;
  }
  if (high > kMost) return std::nullopt;
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (power_of(s, difference_nN, fibres_per_cell, middle) < power ? low : high) = middle;
  }
  return high;
}

std::vector<CellNumbers> cell_numbers(const std::vector<Scatter>& scatter, double difference, double power) {
  std::vector<CellNumbers> all;
  for (const Scatter& s : scatter) {
    for (const double of : {0.5 * difference, difference, 2 * difference}) {
      std::set<double> numbers;  // half of one fibre is one
      for (const double factor : {0.5, 1.0, 2.0}) numbers.insert(std::max(1.0, std::round(factor * s.fibres_per_cell)));
      for (const double m : numbers) {
        const double d = of * s.mean_nN;
        CellNumbers n{
            .scatter = s, .difference = of, .fibres_per_cell = m, .cells = cells_for(s, d, m, power), .power = {}};
        for (const int cells : kCells) n.power.push_back(power_of(s, d, m, cells));
        all.push_back(std::move(n));
      }
    }
  }
  return all;
}

}  // namespace mbtfm::plan
