/// mbtfm-stats: tables, tests and figures over all finished cells of a folder.
#include "pipeline/contract/counted.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/stage/console.h"
#include "pipeline/stage/stage.h"
#include "pipeline/statistics/analysis.h"
#include "pipeline/statistics/picture.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {

extern const std::string_view kStudyScript;  // study.R, made into C++ by the build

namespace {

/// The study read, its files entered into the record.
Study read_study(const StudyParameters& parameters, stage::StageContext& context) {
  const Path folder = context.input("cells");
  const std::optional<Path> table = context.has_input("table") ? std::optional(context.input("table")) : std::nullopt;
  Study study = read_study(folder, parameters, table, context.threads);
  if (files::is_own_file(folder / kReview)) context.input("cells", {kReview});
  for (const StudyCell& cell : study.cells) {
    for (const std::string& file : in_study(cell.kind()).files) context.input("cells", {cell.name + "/" + file});
    for (const std::string& file : in_study(cell.kind()).further_files) {
      const std::string name = cell.name + "/" + file;
      if (files::is_own_file(folder / name)) context.input("cells", {name});
    }
  }
  return study;
}

constexpr double kDotsPerInch = 600;  // what journals ask of drawings with text

/// One or two columns of a page, as most journals have them.
double width_mm(const Figure& figure) {
  constexpr double kColumn_mm = 85, kPage_mm = 178;
  return std::min<int>(figure.n_columns, static_cast<int>(figure.charts.size())) > 1 ? kPage_mm : kColumn_mm;
}

StageReport statistics(const StudyParameters& parameters, stage::StageContext& context) {
  const Study study = read_study(parameters, context);
  if (parameters.list) {
    stage::print(list_of_cells(study));
    StageReport report;
    report.summary = counted(std::ssize(study.left_out), "cells") + " left out";
    return report;
  }
  const Analysis analysis = analyse(study, parameters);
  for (const auto& [name, text] : tables_of(study, analysis)) files::write_text(context.output("out", name), text);
  const std::vector<Figure> figures = figures_of(study, analysis, parameters);
  for (const Figure& figure : figures) {
    if (figure.charts.empty()) continue;  // its caption in the report says why
    const std::string svg = svg_of(figure);
    const auto file = [&](const char* ending) { return context.output("out", "figures/" + figure.name + ending); };
    files::write_text(file(".svg"), svg);
    write_pdf(file(".pdf"), svg, width_mm(figure));
    write_png(file(".png"), svg, width_mm(figure), kDotsPerInch);
  }
  files::write_text(context.output("out", "report.html"),
                    study_html(study, analysis, figures, parameters, context.outputs_.at("out")));
  files::write_text(context.output("out", "review.html"), review_html(study, context.outputs_.at("out")));
  files::write_text(context.output("out", "study.R"), std::string(kStudyScript));
  StageReport report;
  for (const CellKind kind : kKindsOfCells) {
    const int n = n_of_kind(study, kind);
    if (n == 0) continue;
    report.summary += counted(n, traits_of(kind).one, traits_of(kind).many);
    if (has_fibres(kind)) report.summary += ", " + counted(std::ssize(analysis.tensions().sample.values), "tensions");
    report.summary += "; ";
  }
  report.summary += counted(std::ssize(study.left_out), "cells") + " left out, " +
                    counted(std::ssize(analysis.warnings), "warnings") + ": see report.html";
  return report;
}

}  // namespace
}  // namespace mbtfm::statistics

int main(int argc, char** argv) {
  using namespace mbtfm;
  using namespace mbtfm::statistics;
  return stage::run_stage<StudyParameters>({.name = "stats",
                                            .files = {{"cells", stage::FileArgument::Kind::input},
                                                      {"table", stage::FileArgument::Kind::optional_input},
                                                      {"out", stage::FileArgument::Kind::output_folder}}},
                                           argc, argv, statistics::statistics);
}
