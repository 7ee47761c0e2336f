/// What mbtfm-track does in the plane: tracks one stressed image or a time series, or reads a table, and reports.
#pragma once

#include <algorithm>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "pipeline/contract/beads_in_space.h"
#include "pipeline/contract/findings.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/stage/stage.h"
#include "segment/beads/track.h"
#include "segment/images/png.h"

namespace mbtfm::beads {

inline constexpr double kRadian_deg = 180 / std::numbers::pi;

/// Of the good beads.
struct FieldFigures {
  std::int64_t n_good = 0, n_moving = 0, n_surely_moving = 0;  ///< by more than three and six standard errors
  double largest_um = 0;
};
inline double displacement_over_error(const Bead& b) { return norm(b.displacement_um) / std::max(1e-9, b.sigma_um); }
inline double displacement_over_error(const BeadInSpace& b) {
  const Vec3 u = b.displacement_um;
  return std::hypot(std::hypot(u.x, u.y) / std::max(1e-9, b.sigma_um), u.z / std::max(1e-9, b.sigma_z_um));
}
template <class AnyBead>
FieldFigures figures_of(const std::vector<AnyBead>& field) {
  FieldFigures figures;
  for (const AnyBead& bead : field) {
    if (!bead.flag.empty()) continue;
    ++figures.n_good;
    figures.n_moving += displacement_over_error(bead) > 3;
    figures.n_surely_moving += displacement_over_error(bead) > 6;
    figures.largest_um = std::max(figures.largest_um, norm(bead.displacement_um));
  }
  return figures;
}

/// A finding where few beads move.
std::optional<Finding> noticed_stillness(const FieldFigures& figures);

/// NAME.vtp in the folder --out.
template <class AnyBead>
void write_vtp(stage::StageContext& context, const std::vector<AnyBead>& field, const std::string& name) {
  std::vector<decltype(AnyBead::position_um)> points;
  for (const AnyBead& bead : field) points.push_back(bead.position_um);
  std::vector<files::NamedArray> arrays = {files::array_of("displacement_um", field, &AnyBead::displacement_um),
                                           files::array_of("sigma_um", field, &AnyBead::sigma_um)};
  if constexpr (requires(AnyBead bead) { bead.sigma_z_um; })
    arrays.push_back(files::array_of("sigma_z_um", field, &AnyBead::sigma_z_um));
  arrays.push_back(files::array_of("is_good", field, [](const AnyBead& bead) { return bead.flag.empty() ? 1 : 0; }));
  files::write_points_vtp(context.output("out", name + ".vtp"), points, arrays);
}
/// NAME.csv and NAME.vtp.
void write_field(stage::StageContext& context, const DisplacementField& field, const std::string& name);

/// What to do about images that cannot be tracked. @param otherwise  if the error does not know
std::string remedy_of(const InvalidData& error, const char* otherwise);
/// @throws InputError naming the images where body() throws InvalidData
template <class Body>
auto with_names(const std::string& names, const char* otherwise, const Body& body) {
  try {
    return body();
  } catch (const InvalidData& error) {
    throw InputError(names + ": " + error.element, error.expected, error.found, remedy_of(error, otherwise));
  }
}

struct TrackedFrame {
  Tracking tracking;
  double pixel_size_um = 0;
  Vec2 middle_px;           ///< of the images
  images::Picture picture;  ///< of both images
  /// Of the images' middle.
  Vec2 stage_shift_um() const { return pixel_size_um * (tracking.stressed.of(middle_px) - middle_px); }
};
StageReport report_of(const TrackedFrame& frame, CellWith cell_with, stage::StageContext& context);

/// Read the table --displacement in place of images, and write its field.
StageReport run_given(const TrackParameters& parameters, stage::StageContext& context);

/// A stressed image.
struct Frame {
  fs::path file;
  images::PlaneChoice plane;
  std::string name() const {
    const std::string image = file.filename().string();
    if (plane.page) return image + ", page " + std::to_string(*plane.page);
    return image + (plane.time ? ", time " + std::to_string(*plane.time) : "");
  }
};

/// The frames or pages of a file from the chosen one to the last.
/// @throws UsageError where the last is before the first
std::vector<Frame> frames_of_file(const fs::path& file, const TrackParameters& parameters);

/// Inputs `relaxed`, `adhesions` where they are given, `kept`; outputs displacement.csv and .vtp, beads.jpg, of a time
/// series a field a frame and frames.csv.
/// @param binning  side of the blocks of pixels that are averaged first
/// @throws InputError naming the images where they cannot be tracked; of a series, where none can
StageReport run_images(TrackParameters parameters, int binning, const std::vector<Frame>& frames,
                       const FieldModel& model, stage::StageContext& context);

}  // namespace mbtfm::beads
