/// Files of a sheet's fit.
#pragma once

#include <string>

#include "mbtfm/sheets/sheet_fit.h"
#include "pipeline/contract/path.h"

namespace mbtfm::sheets {

struct ContractionAt;

void write_estimates(const Path& file, const SheetFit& fit);
void write_contractions(const Path& file, const std::vector<ContractionAt>& rows);
void write_models(const Path& file, const SheetFit& fit);
/// Their part of docs/columns.md.
std::string pages_of_tables();

}  // namespace mbtfm::sheets
