/// What sets a bundle off the meshwork of the cortex, and the lengths by which it is looked for. Internal to segment/
/// (OpenCV types).
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "segment/cells/fibres.h"
#include "segment/cells/ridge.h"
#include "segment/cells/squares.h"
#include "segment/cells/trace.h"

namespace mbtfm::cells {

/// Signal to noise of a whole line: its mean height in standard deviations of the texture around, times the root of the
/// number of independent pieces in its length. Texture averages out along a line, a bundle persists. Spots brighter
/// than twice the line count as twice the line.
double significance(const Ridges& ridges, const std::vector<cv::Point2d>& points, const std::vector<double>& height,
                    double independent_px);

/// Texture hardly makes more significant lines.
constexpr double kHardlyTexture = 10;

/// The lines that a cell's texture makes: how many, and how significant they are as a rule.
struct TextureLines {
  double n = 0;
  double scale = 0;  ///< of their significance

  /// Logarithm of how many at least as significant one finds by chance: the number of false alarms (Desolneux, Moisan &
  /// Morel, From Gestalt Theory to Image Analysis, Springer 2008, ch. 3).
  double log_false(double significance) const;
  /// That number for a line that lies alone, and for one beside a fibre.
  double expected_false(double significance) const;
  double expected_beside(double significance) const;
};
/// From the lines of the cell itself, most of which are its texture's.
TextureLines texture_lines(std::vector<double> significances);

/// Lines that others may lie beside. Bundles lie in carpets; a line of texture is beside one by chance.
class Bundles {
 public:
  /// @param line_um  with points about a pixel apart
  void add(const Polyline& line_um);
  /// Share of a line that has one of these beside it: nearer than 3 um, at less than 15 degrees.
  /// @param own  the line itself, if it is one of them, by the order in which they were added
  double share_beside(const Polyline& line_um, std::optional<std::size_t> own = {}) const;

 private:
  struct Place {
    Vec2 position_um, along;
    std::optional<std::size_t> line;
  };
  bool has_beside(const Place& place) const;
  static constexpr double kBeside_um = 3;  ///< bundles of one carpet lie nearer
  Squares<Place> squares_{kBeside_um};
  std::size_t n_lines_ = 0;
};

/// Does the line wind to and fro, as a fold of the membrane does and a bundle under tension does not? Turning beyond
/// its net turning, by length.
bool winds(const Polyline& line_um);

/// How many pixels of the image become one of the grid: the narrow filter's deviation spans 1.2 of them, so that the
/// grid carries all but 1e-3 of its spectrum.
int grid_factor(const FibreParameters& parameters, double pixel_um);
/// The filter is narrower than a fibre: it separates neighbours of a bundle, and still answers at the crest of a wide
/// one.
RidgeScales scales_of(const FibreParameters& parameters, double pixel_um);
TraceRule rule_of(const FibreParameters& parameters, double pixel_um);
/// Over this length of a line its responses are one independent piece.
double independent_px(const FibreParameters& parameters, double pixel_um);

}  // namespace mbtfm::cells
