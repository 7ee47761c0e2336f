#include "mbtfm/plan/cell_numbers.h"

#include <algorithm>
#include <boost/math/distributions/non_central_t.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/files/csv.h"

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

std::string word_of(Quantity type) {
  std::string word = name_of(type);  // "ventral fibre"
  return word == name_of(Quantity::arc) ? name_of(FibreType::arc) : word.substr(0, word.find(' '));
}

std::optional<double> variance_named(const files::CsvTable& table, const std::string& component) {
  for (int row = 0; row < table.n_rows(); ++row) {
    if (table.text(row, "quantity") != "tension_nN" || table.text(row, "component") != component) continue;
    const auto sd = table.optional_number(row, "standard_deviation");
    return sd ? std::optional(*sd * *sd) : std::nullopt;
  }
  return std::nullopt;
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

std::vector<Scatter> scatter_of_study(const std::filesystem::path& statistics, std::vector<Scatter> scatter) {
  const files::CsvTable types(statistics / "types.csv"), variances(statistics / "variances.csv");
  types.require({"cell", "type", "mean_nN", "n_cells", "n_fibres"});
  variances.require({"quantity", "component", "standard_deviation"});
  const double cell = variance_named(variances, "cell").value_or(0),
               kind_in_cell = variance_named(variances, "kind in a cell").value_or(0);
  for (Scatter& s : scatter) {
    const std::string word = word_of(s.type);
    for (int row = 0; row < types.n_rows(); ++row) {
      if (types.text(row, "cell") != "all" || types.text(row, "type") != word) continue;
      const auto within = variance_named(variances, "within: " + word);
      if (!within) continue;
      s.mean_nN = types.number(row, "mean_nN");
      s.between_cells_nN = std::sqrt(cell + kind_in_cell);
      s.within_nN = std::sqrt(*within);
      s.fibres_per_cell = types.number(row, "n_fibres") / std::max(1.0, types.number(row, "n_cells"));
      s.source = "the study's mixed model";
      break;  // the first condition
    }
  }
  return scatter;
}

double power_of(const Scatter& s, double difference_nN, double fibres_per_cell, int cells) {
  const double of_cell =
      s.between_cells_nN * s.between_cells_nN + (s.within_nN * s.within_nN + s.error_nN * s.error_nN) / fibres_per_cell;
  const double degrees = 2.0 * (cells - 1);
  const double shift = difference_nN / std::sqrt(2 * of_cell / cells);
  constexpr double kSure = 30;  // beyond, the distribution is one to all digits
  if (shift > kSure) return 1;
  const double limit = boost::math::quantile(boost::math::students_t(degrees), 0.975);
  const boost::math::non_central_t t(degrees, shift);
  return boost::math::cdf(boost::math::complement(t, limit)) + boost::math::cdf(t, -limit);
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
      for (const double fibres : {0.5 * s.fibres_per_cell, s.fibres_per_cell, 2 * s.fibres_per_cell}) {
        const double m = std::max(1.0, std::round(fibres)), d = of * s.mean_nN;
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
