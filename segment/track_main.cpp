#include <cmath>
#include <opencv2/core/utility.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/files.h"
#include "pipeline/contract/stage.h"
#include "segment/channels.h"
#include "segment/track.h"

namespace mbtfm::segment {
namespace {

void write_field(StageContext& context, const DisplacementField& field) {
  write_displacement(context.output("out", "displacement.csv"), field);
  std::vector<Vec2> points;
  PointArray displacement{.name = "displacement_um", .scalars = {}, .vectors = {}};
  PointArray sigma{.name = "sigma_um", .scalars = {}, .vectors = {}};
  PointArray is_good{.name = "is_good", .scalars = {}, .vectors = {}};
  for (const Bead& bead : field) {
    points.push_back(bead.position_um);
    displacement.vectors.push_back(bead.displacement_um);
    sigma.scalars.push_back(bead.sigma_um);
    is_good.scalars.push_back(bead.flag.empty() ? 1 : 0);
  }
  write_points_vtp(context.output("out", "displacement.vtp"), points, {displacement, sigma, is_good});
}

StageReport report_of(const Tracking& tracking, double pixel_size_um) {
  StageReport report;
  double largest_um = 0, squares = 0;
  for (const Bead& bead : tracking.field) {
    if (!bead.flag.empty()) continue;
    largest_um = std::max(largest_um, norm(bead.displacement_um));
    squares += bead.sigma_um * bead.sigma_um;
  }
  const auto n_beads = static_cast<std::int64_t>(tracking.field.size());
  report.figures = {{"pixel_size_um", pixel_size_um},
                    {"n_beads", n_beads},
                    {"n_beads_stressed", static_cast<std::int64_t>(tracking.n_beads_stressed)},
                    {"n_tracked", static_cast<std::int64_t>(tracking.n_good)},
                    {"bead_sigma_um", tracking.bead_sigma_um},
                    {"drift_x_um", tracking.drift_um.x},
                    {"drift_y_um", tracking.drift_um.y},
                    {"has_far_field", tracking.has_far_field},
                    {"far_field_residual_um", tracking.far_field_rms_um},
                    {"scatter_um", tracking.scatter_um},
                    {"largest_displacement_um", largest_um},
                    {"sigma_um", std::sqrt(squares / std::max(1, tracking.n_good))}};
  report.summary = std::to_string(tracking.n_good) + " of " + std::to_string(n_beads) + " beads tracked";
  if (n_beads > tracking.n_good) {
    report.summary += "; " + std::to_string(n_beads - tracking.n_good) + " flagged in displacement.csv";
  }
  return report;
}

StageReport run(const TrackParameters& parameters, StageContext& context) {
  cv::setNumThreads(context.threads);
  const auto stressed_file = context.input("stressed"), relaxed_file = context.input("relaxed");
  const Channel stressed{stressed_file.string(), read_image(stressed_file, parameters.stressed_page - 1)};
  const Channel relaxed{relaxed_file.string(), read_image(relaxed_file, parameters.relaxed_page - 1)};
  require_equal_sizes(relaxed, stressed);
  const double pixel_size_um = common_pixel_size_um(relaxed, stressed, parameters.pixel_size_um);
  try {
    const Tracking tracking =
        track_beads(relaxed.image, stressed.image, pixel_size_um, parameters, context.threads, context.progress);
    write_field(context, tracking.field);
    return report_of(tracking, pixel_size_um);
  } catch (const InvalidData& error) {
    throw InputError(relaxed.name + ", " + stressed.name + ": " + error.element, error.expected, error.found,
                     "are these the bead channels, in focus? Check the pages and detection_snr");
  }
}

}  // namespace
}  // namespace mbtfm::segment

int main(int argc, char** argv) {
  using mbtfm::FileArgument;
  return mbtfm::run_stage<mbtfm::segment::TrackParameters>(
      {.name = "track",
       .purpose = "measure the displacement of the substrate from images of its beads, stressed and relaxed",
       .files = {{"stressed", FileArgument::Kind::input, "beads while the cell pulls (TIFF or PNG)"},
                 {"relaxed", FileArgument::Kind::input, "beads after the cell is removed (TIFF or PNG)"},
                 {"out", FileArgument::Kind::output_folder, "folder for displacement.csv, displacement.vtp"}}},
      argc, argv, mbtfm::segment::run);
}
