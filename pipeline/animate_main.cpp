/// mbtfm-animate: a time series as one picture that moves.
#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/report/report.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "pipeline/statistics/picture.h"

int main(int argc, char** argv) {
  using namespace mbtfm;
  using Kind = stage::FileArgument::Kind;
  return stage::run_stage(
      {.name = "animate", .files = {{"cell", Kind::input, true}, {"out", Kind::output}}}, argc, argv,
      [](stage::ParameterList&) {},
      [](stage::StageContext& context) {
        const fs::path cell = context.input("cell", {"4_fit/frames.csv", "4_fit/tracks.csv"});
        const std::vector<std::string> frames = report::drawings_of_series(cell);
        if (frames.empty()) throw InputError(cell.string(), "a time series that was fitted", "none");
        statistics::write_animation(context.output("out"), frames);
        StageReport report;
        report.summary = counted(std::ssize(frames), "frames");
        return report;
      });
}
