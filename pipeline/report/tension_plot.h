/// Every fibre's tension with its interval, beside the truth where it is known.
#pragma once

#include <optional>
#include <string>

#include "pipeline/charts/chart.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/results.h"

namespace mbtfm::report {

struct CellResults;

/// One row a fibre, by type, the strongest first.
charts::Chart tension_plot(const CellResults& results);
/// One column a type, a mark a fibre, with the mean of each type; none where no type has two fibres.
std::optional<charts::Chart> tensions_by_type(const CellResults& results);
/// Its marks explained, as HTML.
std::string tension_plot_legend(const CellResults& results);

/// Colour of a fibre type (Okabe & Ito: told apart by colour-blind eyes).
const char* colour_of(FibreType type);
/// The same, lighter for the dark ground of an image.
const char* bright_colour_of(FibreType type);
/// Dashes of its line in maps, as CSS: edge fibres are told by them from the others without colours.
const char* dashes_of(FibreType type);
/// Its mark in legends and tables, as HTML.
std::string swatch_of(FibreType type, const std::string& colour);
/// "dorsal", "transverse arc", "ventral", "edge"
const char* full_name_of(FibreType type);

/// A fibre with what is known of its tension.
struct FibreRow {
  const Fibre* fibre = nullptr;
  Tension tension;
  std::optional<double> true_tension_nN;
  std::optional<int> true_fibre_id;
  std::optional<FibreType> true_type;
};
/// The fitted fibres, by type, the strongest first.
std::vector<FibreRow> fibre_rows(const CellResults& results);

}  // namespace mbtfm::report
