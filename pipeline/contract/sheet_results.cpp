#include "pipeline/contract/sheet_results.h"

#include "pipeline/contract/errors.h"

namespace mbtfm {

NameAndUnit for_people(SheetQuantity quantity) {
  switch (quantity) {
    case SheetQuantity::contraction:
      return {"contraction", "nN/µm"};
    case SheetQuantity::stiffness:
      return {"stiffness", "nN/µm"};
    case SheetQuantity::line_tension:
      return {"line tension", "nN"};
    case SheetQuantity::contraction_over_stiffness:
      return {"contraction over stiffness", ""};
    case SheetQuantity::adhesion_stiffness:
      return {"adhesion stiffness", "nN/µm³"};
    case SheetQuantity::penetration:
      return {"penetration length", "µm"};
    case SheetQuantity::bundle_tension:
      return {"tension", "nN"};
  }
  throw InternalError("unknown quantity of a sheet");
}

std::string kind_of_part(const SheetEstimate& estimate) {
  if (estimate.part.empty() || estimate.part == kMeanPart) return kWholeSheet;
  const auto last = estimate.part.find_last_not_of("0123456789");  // of the label, which differs from sheet to sheet
  return estimate.part.substr(0, last == estimate.part.npos ? 0 : estimate.part.find_last_not_of(' ', last) + 1);
}

}  // namespace mbtfm
