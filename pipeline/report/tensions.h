/// Every fibre's tension with its interval, beside the truth where it is known: plots, the table, what one reads where
/// the mouse rests.
#pragma once

#include <optional>
#include <string>

#include "pipeline/charts/chart.h"
#include "pipeline/contract/cell.h"
#include "pipeline/report/page.h"

namespace mbtfm::report {

struct CellResults;

/// One row a fibre, by type, the strongest first.
charts::Chart tension_plot(const CellResults& results);
/// One column a type, a mark a fibre, with the mean of each type; none where no type has two fibres.
std::optional<charts::Chart> tensions_by_type(const CellResults& results);
/// Its marks explained, as HTML.
std::string tension_plot_legend(const CellResults& results);

/// A row for the actin network, then one a fibre in the order of the plot.
Table tension_table(const CellResults& results);
/// How to read the table, and what it lacks, as paragraphs.
std::string tension_notes(const CellResults& results);

/// Of the fibres with an interval and a known truth, how many intervals hold the truth.
struct Coverage {
  int n_inside = 0, n = 0;
};
Coverage coverage_of(const CellResults& results);

/// Id, type, tension with its 95 % interval, length, adhesions.
std::string hover_of(const Fibre& fibre, const CellResults& results);
/// Id, force with its standard error, traction, area, fibres that end on it.
std::string hover_of(const Adhesion& adhesion, const CellResults& results);

using charts::colour_of;
/// Colour of a fibre type, lighter for the dark ground of an image.
const char* bright_colour_of(FibreType type);
/// Dashes of its line in maps, as CSS: they distinguish edge fibres from the others without colours.
const char* dashes_of(FibreType type);
/// Its mark in legends and tables, as HTML.
std::string swatch_of(FibreType type, const std::string& colour);
/// "dorsal", "transverse arc", "ventral", "edge", "unclassified"
const char* full_name_of(FibreType type);

}  // namespace mbtfm::report
