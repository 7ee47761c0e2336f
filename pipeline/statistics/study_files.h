/// The tables, figures and report of a study, as text.
#pragma once

#include <string>
#include <utility>

#include "pipeline/charts/chart.h"
#include "pipeline/contract/path.h"
#include "pipeline/statistics/study.h"

namespace mbtfm::statistics {

struct Analysis;

/// Every table with the name of its file.
std::vector<std::pair<std::string, std::string>> tables_of(const Study& study, const Analysis& analysis);

/// Which cells enter, and why others do not: the first columns of cells.csv.
std::string list_of_cells(const Study& study);

/// Their part of docs/columns.md.
std::string pages_of_tables();

/// Charts that belong together, with a caption; without charts the caption says why there are none.
struct Figure {
  std::string name;  ///< of its files, without the ending
  std::string title, caption;
  std::vector<charts::Chart> charts = {};
  int n_columns = 1;
};
/// The one that answers the study's question: it comes first in the report.
inline constexpr const char* kPrimaryFigure = "primary";
std::vector<Figure> figures_of(const Study& study, const Analysis& analysis, const StudyParameters& parameters);
/// As a file of its own.
std::string svg_of(const Figure& figure);

/// What was found, a sentence for each question, with interval, test and numbers of cells and fibres.
struct Findings {
  std::string title;
  std::vector<std::string> sentences;
  std::vector<std::string> unclear;  ///< pairs that do not demonstrably differ
};
std::vector<Findings> findings_of(const Analysis& analysis, const StudyParameters& parameters);

/// @param page_folder  where the page will lie: the cells' pages are linked from there
std::string study_html(const Study& study, const Analysis& analysis, const std::vector<Figure>& figures,
                       const StudyParameters& parameters, const Path& page_folder);

/// A page on which people look at one cell after the other and decide; it saves review.csv.
std::string review_html(const Study& study, const Path& page_folder);

}  // namespace mbtfm::statistics
