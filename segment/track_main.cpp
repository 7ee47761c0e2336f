/// mbtfm-track: the gel's displacement from images of its beads.
#include <memory>
#include <opencv2/core/utility.hpp>

#include "mbtfm/tractions/field_of_adhesions.h"
#include "pipeline/contract/errors.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/own_files.h"
#include "pipeline/stage/stage.h"
#include "segment/beads/report.h"
#include "segment/images/channels.h"
#include "segment/stacks/run.h"
#include "segment/survey/roles.h"

namespace mbtfm::beads {
namespace {

/// The images of a folder in the order of their names, numbers as numbers, or those of a file.
std::vector<Frame> frames_of(stage::StageContext& context, const TrackParameters& parameters) {
  const fs::path& given = context.inputs_.at("stressed");
  if (!files::is_folder(given)) return frames_of_file(context.input("stressed"), parameters);
  const std::vector<std::string> names = survey::frames_in(given);
  context.input("stressed", names);
  std::vector<Frame> frames;
  for (const std::string& name : names) frames.push_back({given / name, parameters.stressed_plane});
  return frames;
}

/// Of a gel that the adhesions pull, where they are given.
FieldModel model_of_gel(stage::StageContext& context) {
  if (!context.has_input("adhesions")) return {};
  const auto field =
      std::make_shared<tractions::FieldOfAdhesions>(files::read_adhesions(context.input("adhesions")), context.threads);
  return [field](const DisplacementField& beads) { return field->um(beads); };
}

/// What is wrong with the images at first sight.
void look(const stacks::TrackStageParameters& given, stage::StageContext& context) {
  if (!context.has_input("cell_image") || !context.has_input("relaxed")) return;
  const auto field = [&](const char* name, std::optional<double> pixel_size_um) {
    const fs::path file = context.input(name);
    images::NamedField result{.name = file.string(), .field = images::read_field(file)};
    if (pixel_size_um) result.field.pixel_size_um = pixel_size_um;
    return result;
  };
  images::require_same_field(field("cell_image", given.track.pixel_size_um),
                             field("relaxed", stacks::switched(given).pixel_size_um));
}

StageReport run(const stacks::TrackStageParameters& given, stage::StageContext& context) {
  TrackParameters parameters = stacks::switched(given);
  look(given, context);
  cv::setNumThreads(context.threads);
  if (context.has_input("displacement")) {
    if (context.has_input("stressed") || context.has_input("relaxed"))
      throw UsageError("--displacement and bead images exclude each other");
    return run_given(parameters, context);
  }
  for (const char* name : {"stressed", "relaxed"})
    if (!context.has_input(name))
      throw UsageError("--" + std::string(name) + " is missing: the two bead images, or --displacement");
  if (stacks::are_in_space(given)) return stacks::run(given, context);
  return run_images(parameters, given.binning, frames_of(context, parameters), model_of_gel(context), context);
}

}  // namespace
}  // namespace mbtfm::beads

int main(int argc, char** argv) {
  using mbtfm::stage::FileArgument;
  using Kind = FileArgument::Kind;
  return mbtfm::stage::run_stage<mbtfm::stacks::TrackStageParameters>(
      {.name = "track",
       .files = {{"stressed", Kind::optional_input, false, "beads_stressed"},
                 {"relaxed", Kind::optional_input, false, "beads_relaxed"},
                 {"surface_beads", Kind::optional_input},
                 {"adhesions", Kind::optional_input},
                 {"displacement", Kind::optional_input, false, "displacement"},
                 {"cell_image", Kind::optional_input},
                 {"kept", Kind::optional_input},
                 {"out", Kind::output_folder}}},
      argc, argv, mbtfm::beads::run, mbtfm::beads::look);
}
