/// mbtfm-stats: tables, tests and figures over all finished cells of a folder.
#include "pipeline/contract/csv.h"
#include "pipeline/contract/stage.h"
#include "pipeline/statistics/study_files.h"

int main(int argc, char** argv) {
  using namespace mbtfm;
  using namespace mbtfm::statistics;
  return run_stage<StudyParameters>(
      {.name = "stats",
       .purpose = "statistics of stress-fibre tensions by type, over all finished cells of a folder",
       .files = {{"cells", FileArgument::Kind::input, "folder with cell folders"},
                 {"out", FileArgument::Kind::output_folder,
                  "cells.csv, adhesions.csv, fibres.csv, types.csv, tests.csv, figures/, report.html"}}},
      argc, argv, [](const StudyParameters& parameters, StageContext& context) {
        const Path folder = context.input("cells");
        const Study study = read_study(folder);
        for (const StudyCell& cell : study.cells) {
          for (const std::string& file : files_of_a_cell()) context.input("cells", {cell.name + "/" + file});
        }
        write_text(context.output("out", "cells.csv"), cells_csv(study));
        write_text(context.output("out", "adhesions.csv"), adhesions_csv(study));
        write_text(context.output("out", "fibres.csv"), fibres_csv(study));
        write_text(context.output("out", "types.csv"), types_csv(study, parameters));
        write_text(context.output("out", "tests.csv"), tests_csv(study));
        write_text(context.output("out", "figures/tensions_by_type.svg"), tensions_by_type_svg(study));
        write_text(context.output("out", "figures/forces_by_cell.svg"), forces_by_cell_svg(study));
        write_text(context.output("out", "figures/adhesion_forces.svg"), adhesion_forces_svg(study));
        write_text(context.output("out", "report.html"), study_html(study, parameters));
        StageReport report;
        report.summary = std::to_string(study.cells.size()) + " cells, " +
                         std::to_string(measured_fibres(study).size()) + " tensions, " +
                         std::to_string(study.unfinished.size()) + " unfinished cells left out";
        return report;
      });
}
