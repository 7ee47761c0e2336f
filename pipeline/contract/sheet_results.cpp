#include "pipeline/contract/sheet_results.h"

namespace mbtfm {

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
