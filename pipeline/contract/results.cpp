#include "pipeline/contract/results.h"

#include <cmath>

#include "pipeline/contract/sheet_results.h"

namespace mbtfm {

double total(const ErrorParts& parts) {
  double sum = 0;
  for_each_part(parts,
                [&](const char*, const std::optional<double>& part) { sum += part.value_or(0) * part.value_or(0); });
  return std::sqrt(sum);
}

double sigma_nN(const MissingFibre& f) { return f.tension_nN / std::sqrt(f.chi_squared_gain); }

NameAndUnit for_people(SheetQuantity quantity) {
  static constexpr NameAndUnit kNames[] = {{"contraction", "nN/µm"},
                                           {"stiffness", "nN/µm"},
                                           {"line tension", "nN"},
                                           {"contraction over stiffness", ""},
                                           {"adhesion stiffness", "nN/µm³"},
                                           {"penetration length", "µm"},
                                           {"tension", "nN"}};
  return kNames[static_cast<int>(quantity)];
}

std::string kind_of_part(const SheetEstimate& estimate) {
  if (estimate.part.empty() || estimate.part == kMeanPart) return kWholeSheet;
  const auto last = estimate.part.find_last_not_of("0123456789");  // of the label, which differs from sheet to sheet
  return estimate.part.substr(0, last == estimate.part.npos ? 0 : estimate.part.find_last_not_of(' ', last) + 1);
}

}  // namespace mbtfm
