#include <algorithm>
#include <cmath>

#include "mbtfm/plan/cell_numbers.h"
#include "pipeline/contract/errors.h"
#include "pipeline/files/csv.h"

namespace mbtfm::plan {

namespace {

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

constexpr const char* kOfStudy = "the study's mixed model";

}  // namespace

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

}  // namespace mbtfm::plan
