#include "samples/plan/cell_numbers.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/files/csv.h"
#include "pipeline/numerics/distributions.h"

namespace mbtfm::plan {

namespace {

/// Of a list; one fibre shows no scatter.
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

std::optional<double> variance_named(const files::CsvTable& table, const std::string& component) {
  for (int row = 0; row < table.n_rows(); ++row) {
    if (table.text(row, "quantity") != "tension_nN" || table.text(row, "component") != component) continue;
    const auto sd = table.optional_number(row, "standard_deviation");
    return sd ? std::optional(*sd * *sd) : std::nullopt;
  }
  return std::nullopt;
}

constexpr const char* kOfStudy = "the study's mixed model";

}  // namespace

std::vector<Scatter> scatter_of(const Scene& scene, const Computed& c, const Point& point, double between_cells) {
  std::vector<Scatter> all;
  for (std::size_t k = 0; k < std::size(kFibreTypes); ++k) {
    std::vector<double> tensions_nN;
    double squares = 0;
    for (const std::size_t i : labels_of(scene, c.cell, kFibreTypes[k])) {
      tensions_nN.push_back(c.cell.tensions_nN[static_cast<Eigen::Index>(i)]);
      squares += std::pow(standard_error_nN(c, i, point), 2);
    }
    if (tensions_nN.empty()) continue;
    const Moments m = moments_of(tensions_nN);
    const auto n = static_cast<double>(tensions_nN.size());
    all.push_back({.type = kOfTypes[k],
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
    const std::string word = name_of(kFibreTypes[std::ranges::find(kOfTypes, s.type) - std::begin(kOfTypes)]);
    for (int row = 0; row < types.n_rows(); ++row) {
      if (types.text(row, "cell") != "all" || types.text(row, "type") != word) continue;
      const auto within = variance_named(variances, "within: " + word);
      if (!within) continue;
      s.mean_nN = types.number(row, "mean_nN");
      s.between_cells_nN = std::sqrt(cell + kind_in_cell);
      s.within_nN = std::sqrt(*within);
      s.fibres_per_cell = types.number(row, "n_fibres") / std::max(1.0, types.number(row, "n_cells"));
      s.source = kOfStudy;
      break;  // the first condition
    }
  }
  if (std::ranges::all_of(scatter, [](const Scatter& s) { return s.source != kOfStudy; }))
    throw InputError((statistics / "variances.csv").string(),
                     "the scatter of tension_nN within a cell (component 'within: TYPE') of a type of types.csv",
                     "none", "make the tables with mbtfm stats, of two cells or more");
  return scatter;
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
