/// Focal adhesions of a fluorescence image, or why it shows none.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/stage/parameters_fwd.h"
#include "segment/cells/ellipse.h"
#include "segment/images/channels.h"

namespace mbtfm::cells {

struct AdhesionParameters {
  double adhesion_background_um = 2.0;  ///< larger than half of the widest adhesion, smaller than illumination changes
  std::optional<double> adhesion_smoothing_um;  ///< unset: as the image's noise asks for
  double adhesion_seed_noise = 5;               ///< five standard deviations: less than one false seed in 10^6 pixels
  double adhesion_rim_noise = 2.5;              ///< the rim may be fainter than the seed, but still out of the noise
  double adhesion_rim_level =
      0.45;  ///< a blurred edge passes half of the height at the true edge; less, as adhesions fade to their rim
  double adhesion_split_depth = 0.25;   ///< the dip between two points that the optics just resolve (Rayleigh: 26 %)
  double adhesion_smallest_um2 = 0.08;  ///< about one resolution element
  double adhesion_largest_um2 = 25;     ///< beyond any focal adhesion; larger is a bright cell body
  double adhesion_faintest = 0.25;      ///< relative to the bright ones: what is fainter is texture of the cytosol
};

void declare(stage::ParameterList& list, AdhesionParameters& parameters);

/// An adhesion and the pixels above its rim.
struct AdhesionRegion {
  Adhesion adhesion;
  std::vector<CoveredPixel> pixels;
  std::array<double, 4> terms{};  ///< of its probability, where that is known
};

/// Terms of the log-odds that a bright spot is an adhesion and no vesicle, haze or streak, which are fainter as a rule:
/// powers of ln(height / bright), 0 to 3.
/// @param height  of its highest pixel
/// @param bright  mean height of what is bright in the picture, > 0
std::array<double, 4> adhesion_terms(double height, double bright);
/// The probability, 0 to 1. Logistic regression on simulated cells with such clutter:
/// tests/studies/fibre_probability.py prints the coefficients, docs/theory/segmentation.md, (22d), has the equation.
double adhesion_probability(const std::array<double, 4>& terms);

/// Find adhesions: subtract the local median (background), threshold at the local noise with hysteresis (and above
/// what the edge of a bright cell leaves), split at
/// intensity dips (watershed), put the rim of each at a share of its own height; then fit each as an elliptical disc
/// behind the microscope's blur, which gives centre, axes and angle without what the blur adds to them. Where the disc
/// leaves more than a tenth of the variance unexplained or departs from the region by 30 %, the adhesion is no ellipse,
/// and the ellipse of its pixels' second moments stands.
///
/// The result does not depend on gain or offset of the camera: every level is relative to noise or height.
/// `mean_intensity` is the mean grey value above the local background. No adhesion has a `probability` in a picture
/// with nothing bright, in which it has no scale. Sorted from left-to-right in rows of the image top to bottom, ids
/// from 1.
/// @param pixel_size_um  > 0
/// @returns none where the image is constant or noise alone
/// @throws InvalidData where a pixel is not finite
/// Sources: Zamir et al., J Cell Sci 112:1655 (1999) for high-pass and watershed; Berginski et al., PLoS ONE 6:e22025
/// (2011) for hysteresis and splitting.
std::vector<AdhesionRegion> find_adhesion_regions(const images::Image& image, double pixel_size_um,
                                                  const AdhesionParameters& parameters);
/// The same without the pixels.
std::vector<Adhesion> find_adhesions(const images::Image& image, double pixel_size_um,
                                     const AdhesionParameters& parameters);

/// Length over width, mean weighed by area; 0 of none.
double aspect_ratio(const std::vector<Adhesion>& adhesions);

/// @throws InputError where the image shows nothing: see emptiness_of()
void require_content(const images::Channel& channel);

inline const std::string kInvert = "the image seems inverted: in ImageJ, Edit > Invert; fluorescence is bright on dark";

/// @throws InputError where the image shows none, with why
std::vector<Adhesion> require_adhesions(const images::Channel& channel, double pixel_um,
                                        const AdhesionParameters& parameters);

/// Why there is no adhesion in an image in which none is found: what stands out of the noise least short of one.
std::string why_no_adhesions(const images::Image& image, double pixel_size_um, const AdhesionParameters& parameters);

/// Why nothing in the image can be measured: "every pixel is 100", "42 % of the pixels at 255, the brightest value: the
/// detector was saturated". Empty where there may be something.
///
/// More than a tenth at one brightest value is no structure: adhesions cover a few per cent of a field, and an image
/// that is not cut off has few pixels at its very maximum.
std::string emptiness_of(const images::Image& image);

/// The negative of an image that looks like one: its darkest pixels differ more from the middle one than its brightest.
/// Beads, adhesions, fibres and a cell of less than half of the field are bright on dark.
std::optional<images::Image> negative_of_dark_on_bright(images::Image image);

}  // namespace mbtfm::cells
