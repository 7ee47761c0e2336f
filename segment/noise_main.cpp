/// mbtfm-noise: from two pictures of an unloaded place, how exactly beads are measured, and how many there are.
#include <opencv2/core/utility.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/stage/console.h"
#include "pipeline/stage/effects.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "segment/beads/report.h"
#include "segment/beads/unloaded.h"
#include "segment/images/stage_images.h"

namespace mbtfm::beads {
namespace {

struct NoiseParameters {
  TrackParameters track;
  stage::EffectSwitches effects;
};

void declare(stage::ParameterList& list, NoiseParameters& p) {
  declare(list, p.track);
  declare(list, p.effects, {"drift_affine", "effect_tolerance"});
}

std::string text_of(const UnloadedPlace& p) {
  return "noise of a displacement component  " + brief(p.noise_um) + " um (+- " + brief(100 * p.noise_error) +
         " %; the tracker states " + brief(p.stated_um) + " um)\n" + "beads followed                     " +
         brief(p.beads_per_um2) + " per um2 of " + brief(p.found_per_um2) + " found\n" +
         "share lost                         " + brief(100 * p.share_lost) + " %\n" +
         "drift                              " + brief(p.drift_um.x) + ", " + brief(p.drift_um.y) + " um\n" +
         "what regions do alike beside it    " + brief(p.shared_um) + " um\n" + "to plan with: mbtfm plan --noise_um " +
         brief(p.noise_um) + " --beads_per_um2 " + brief(p.beads_per_um2) + "\n";
}

StageReport report_of(const UnloadedPlace& p) {
  StageReport report;
  report.figures = {
      {"noise_um", p.noise_um},           {"noise_error", p.noise_error},     {"stated_sigma_um", p.stated_um},
      {"beads_per_um2", p.beads_per_um2}, {"found_per_um2", p.found_per_um2}, {"share_lost", p.share_lost},
      {"drift_x_um", p.drift_um.x},       {"drift_y_um", p.drift_um.y},       {"shared_um", p.shared_um}};
  report.summary = "noise " + brief(p.noise_um) + " um, " + brief(p.beads_per_um2) + " beads per um2, " +
                   brief(100 * p.share_lost) + " % lost";
  if (is_moving(p))
    report.summary += "; WARNING: whole regions move by " + brief(p.shared_um) +
                      " um: does a cell pull here, or is the dish turned or swollen (--drift_affine on)?";
  return report;
}

StageReport run(const NoiseParameters& given, stage::StageContext& context) {
  TrackParameters parameters = given.track;
  parameters.drift_affine = given.effects.drift_affine;
  parameters.effect_tolerance = given.effects.effect_tolerance;
  parameters.may_push = true;  // nothing pulls, so nothing shows which picture is which
  cv::setNumThreads(context.threads);
  const auto picture = [&](const char* name, const images::PlaneChoice& plane) {
    const std::filesystem::path file = context.input(name);
    const images::Channel channel = images::read_channel(file.string(), file, plane, 1, context);
    for (const std::optional<Finding>& found : images::noticed_in(channel)) context.notice(found);
    return channel;
  };
  const images::Channel first = picture("first", parameters.relaxed_plane);
  const images::Channel second = picture("second", parameters.stressed_plane);
  images::require_equal_sizes(first, second);
  if (first.image.pixels == second.image.pixels)
    throw InputError(first.name + ", " + second.name, "two pictures of one place", "the same pixels in both",
                     "take two pictures one after the other: their difference is the noise");
  const double pixel_um = images::common_pixel_size_um(first, second, parameters.pixel_size_um);
  return with_names(
      first.name + ", " + second.name, "are these two pictures of the beads of one place, in focus?", [&] {
        const Tracking tracking =
            track_beads(first.image, second.image, pixel_um, parameters, Work(context.threads, context.progress));
        const UnloadedPlace place =
            unloaded_place(tracking, pixel_um * first.image.width, pixel_um * first.image.height);
        context.progress(1, "done");
        stage::print(text_of(place));
        return report_of(place);
      });
}

}  // namespace
}  // namespace mbtfm::beads

int main(int argc, char** argv) {
  using mbtfm::stage::FileArgument;
  using Kind = FileArgument::Kind;
  return mbtfm::stage::run_stage<mbtfm::beads::NoiseParameters>(
      {.name = "noise", .files = {{"first", Kind::input}, {"second", Kind::input}}}, argc, argv, mbtfm::beads::run);
}
