#include "segment/cells/adhesions.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/stage/parameters.h"
#include "segment/cells/adhesion_parts.h"
#include "segment/cells/fibre_probability.h"
#include "segment/cells/grid.h"
#include "segment/cells/padding.h"

namespace mbtfm::cells {
namespace {

constexpr double kUsualDome = 0.2;  ///< adhesions fade towards their rim

BlurredEllipse in_pixels(const Adhesion& a, double pixel_um, CommonShape shape) {
  const cv::Point2d centre = to_pixels(a.position_um, pixel_um);
  return {.x = centre.x,
          .y = centre.y,
          .semi_major = a.major_axis_um / 2 / pixel_um,
          .semi_minor = a.minor_axis_um / 2 / pixel_um,
          .angle_rad = a.angle_rad,
          .brightness = a.mean_intensity,
          .dome = shape.dome,
          .blur = shape.blur};
}

Adhesion with_ellipse(Adhesion a, const BlurredEllipse& e, double pixel_um) {
  a.position_um = to_um({e.x, e.y}, pixel_um);
  a.major_axis_um = 2 * e.semi_major * pixel_um;
  a.minor_axis_um = 2 * e.semi_minor * pixel_um;
  a.area_um2 = CV_PI / 4 * a.major_axis_um * a.minor_axis_um;
  a.angle_rad = std::remainder(e.angle_rad, CV_PI);
  a.eccentricity = std::sqrt(std::max(0.0, 1 - std::pow(a.minor_axis_um / a.major_axis_um, 2)));
  return a;
}

/// The fit is of this region and not of one with its neighbourhood: axes and centre within 30 % of the moments' (a
/// narrow region's minor axis is too large by its blur, and may shrink).
bool agrees(const BlurredEllipse& fit, const BlurredEllipse& region) {
  constexpr double kWithin = 0.3;
  const double c = std::cos(region.angle_rad), s = std::sin(region.angle_rad);
  const double dx = fit.x - region.x, dy = fit.y - region.y;
  const double along = std::abs(dx * c + dy * s) / region.semi_major,
               across = std::abs(dy * c - dx * s) / region.semi_minor;
  const double major = fit.semi_major / region.semi_major, minor = fit.semi_minor / region.semi_minor;
  return std::max(along, across) < kWithin && std::max({major, 1 / major, minor}) < 1 + kWithin;
}

/// The model explains nine tenths of the variance in the window.
bool is_elliptical(const FittedEllipse& fit) { return fit.is_settled && fit.unexplained < 0.1; }

/// The region cut through its middle, across its length and along it.
std::vector<TwoEllipses> halves_of(const AdhesionRegion& region, double pixel_um, CommonShape shape) {
  std::vector<TwoEllipses> result;
  for (const double turn : {0.0, CV_PI / 2}) {
    const double angle = region.adhesion.angle_rad + turn;
    std::array<std::vector<CoveredPixel>, 2> halves;
    for (const CoveredPixel& p : region.pixels) {
      const Vec2 away = to_um({1.0 * p.column, 1.0 * p.row}, pixel_um) - region.adhesion.position_um;
      halves[dot(away, {std::cos(angle), std::sin(angle)}) > 0].push_back(p);
    }
    if (std::ranges::any_of(halves, [](const auto& half) { return half.empty(); })) continue;
    result.push_back({in_pixels(measure_ellipse(halves[0], pixel_um), pixel_um, shape),
                      in_pixels(measure_ellipse(halves[1], pixel_um), pixel_um, shape)});
  }
  return result;
}

std::vector<FittedEllipse> fitted_to(const Contrast& c, const std::vector<AdhesionRegion>& regions, double pixel_um,
                                     double smallest_um2) {
  const auto start = [&](CommonShape shape) {
    std::vector<BlurredEllipse> ellipses;
    for (const AdhesionRegion& r : regions) ellipses.push_back(in_pixels(r.adhesion, pixel_um, shape));
    return ellipses;
  };
  if (regions.empty()) return {};
  CommonShape shape = common_shape(c.sharp, start({kUsualBlur_um / pixel_um, kUsualDome}));
  shape.blur = std::min(shape.blur, kWidestBlur_um / pixel_um);
  shape.blur = std::max(shape.blur, 0.5);  // px: what sampling alone does
  std::vector<std::vector<TwoEllipses>> halves;
  for (const AdhesionRegion& r : regions) halves.push_back(halves_of(r, pixel_um, shape));
  return fit_ellipses(c.sharp, c.sharp_noise, start(shape), halves, smallest_um2 / (pixel_um * pixel_um));
}

double peak_of(const AdhesionRegion& region, const cv::Mat& height) {
  double peak = 0;
  for (const CoveredPixel& p : region.pixels)
    if (p.share > 0.5) peak = std::max<double>(peak, height.at<float>(p.row, p.column));
  return peak;
}

/// The region's pixels by which of two adhesions is the brighter one there.
std::vector<AdhesionRegion> divided(const AdhesionRegion& region, const TwoEllipses& two, double pixel_um) {
  const EllipseModel first(two[0]), second(two[1]);
  std::vector<AdhesionRegion> parts(2);
  for (const CoveredPixel& p : region.pixels)
    parts[second.value(p.column, p.row) > first.value(p.column, p.row)].pixels.push_back(p);
  for (int i = 0; i < 2; ++i) {
    if (parts[i].pixels.empty()) continue;
    parts[i].adhesion = measure_ellipse(parts[i].pixels, pixel_um);
    if (agrees(two[i], in_pixels(parts[i].adhesion, pixel_um, {})))
      parts[i].adhesion = with_ellipse(parts[i].adhesion, two[i], pixel_um);
  }
  std::erase_if(parts, [](const AdhesionRegion& part) { return part.pixels.empty(); });
  return parts;
}

}  // namespace

void declare(stage::ParameterList& list, AdhesionParameters& p) {
  list.table("segment");
  list.add("adhesion_background_um", p.adhesion_background_um, Range::size_um());
  list.add("adhesion_smoothing_um", p.adhesion_smoothing_um, Range::between(0, 100));
  list.add("adhesion_seed_noise", p.adhesion_seed_noise, Range::factor());
  list.add("adhesion_rim_noise", p.adhesion_rim_noise, Range::factor());
  list.add("adhesion_rim_level", p.adhesion_rim_level,
           {.low = 0, .high = 1, .excludes_low = true, .excludes_high = true});
  list.add("adhesion_split_depth", p.adhesion_split_depth, Range::between(0, 1));
  list.add("adhesion_smallest_um2", p.adhesion_smallest_um2, Range::area_um2());
  list.add("adhesion_largest_um2", p.adhesion_largest_um2, Range::area_um2());
  list.add("adhesion_faintest", p.adhesion_faintest, Range::between(0, 1));
}

std::array<double, 4> adhesion_terms(double height, double bright) {
  constexpr double kFaintest = 0.1;  // beyond what the regression has seen
  const double x = std::log(std::max(height / bright, kFaintest));
  return {1, x, x * x, x * x * x};
}

double adhesion_probability(const std::array<double, 4>& terms) {
  constexpr std::array kCoefficients{2.68, 2.61, 2.30, 3.08};
  return logistic(terms, kCoefficients);
}

std::vector<AdhesionRegion> find_adhesion_regions(const images::Image& image, double pixel_size_um,
                                                  const AdhesionParameters& p) {
  const Contrast c = contrast_of(without_padding(matrix_of(image)), pixel_size_um, p);
  std::vector<AdhesionRegion> regions;
  for (auto& pixels : adhesion_parts(c, pixel_size_um, p)) {
    const Adhesion adhesion = measure_ellipse(pixels, pixel_size_um);
    // with the blur on it an adhesion is larger, never smaller
    if (adhesion.area_um2 <= p.adhesion_largest_um2) regions.push_back({adhesion, std::move(pixels), {}});
  }
  const std::vector<FittedEllipse> fitted = fitted_to(c, regions, pixel_size_um, p.adhesion_smallest_um2);
  for (std::size_t i = 0; i < fitted.size(); ++i) {
    if (fitted[i].two) {
      auto parts = divided(regions[i], *fitted[i].two, pixel_size_um);
      regions[i] = std::move(parts[0]);
      regions.insert(regions.end(), parts.begin() + 1, parts.end());
      continue;
    }
    Adhesion& adhesion = regions[i].adhesion;
    if (is_elliptical(fitted[i]) && agrees(fitted[i].ellipse, in_pixels(adhesion, pixel_size_um, {})))
      adhesion = with_ellipse(adhesion, fitted[i].ellipse, pixel_size_um);
  }
  std::erase_if(regions, [&](const AdhesionRegion& r) {
    return r.adhesion.area_um2 < p.adhesion_smallest_um2 || r.adhesion.area_um2 > p.adhesion_largest_um2;
  });
  for (AdhesionRegion& r : regions) {
    if (c.bright <= 0) break;
    r.terms = adhesion_terms(peak_of(r, c.height), c.bright);
    r.adhesion.probability = adhesion_probability(r.terms);
  }
  std::sort(regions.begin(), regions.end(), [](const AdhesionRegion& a, const AdhesionRegion& b) {
    const Vec2 here = a.adhesion.position_um, there = b.adhesion.position_um;
    return std::pair(here.y, here.x) < std::pair(there.y, there.x);
  });
  for (std::size_t i = 0; i < regions.size(); ++i) regions[i].adhesion.adhesion_id = static_cast<int>(i) + 1;
  return regions;
}

std::vector<Adhesion> find_adhesions(const images::Image& image, double pixel_size_um, const AdhesionParameters& p) {
  std::vector<Adhesion> adhesions;
  for (const AdhesionRegion& region : find_adhesion_regions(image, pixel_size_um, p))
    adhesions.push_back(region.adhesion);
  return adhesions;
}

double aspect_ratio(const std::vector<Adhesion>& adhesions) {
  double sum = 0, area_um2 = 0;
  for (const Adhesion& a : adhesions) {
    sum += a.area_um2 * a.major_axis_um / a.minor_axis_um;
    area_um2 += a.area_um2;
  }
  return area_um2 > 0 ? sum / area_um2 : 0;
}

void require_content(const images::Channel& channel) {
  const std::string reason = emptiness_of(channel.image);
  if (!reason.empty())
    throw InputError(channel.name, "a picture of a cell", reason,
                     "is this the right file, channel and page? Was it overexposed?");
}

std::vector<Adhesion> require_adhesions(const images::Channel& channel, double pixel_um, const AdhesionParameters& p) {
  require_content(channel);
  const auto found = find_adhesions(channel.image, pixel_um, p);
  if (!found.empty()) return found;
  const std::string expected =
      "bright spots of " + shortest(p.adhesion_smallest_um2) + " um² or more that stand out of the noise";
  if (const auto negative = negative_of_dark_on_bright(channel.image)) {
    const auto dark = find_adhesions(*negative, pixel_um, p);
    constexpr std::size_t kSome = 5;  // fewer are gaps between bright things
    if (dark.size() >= kSome)
      throw InputError(channel.name, expected, counted(std::ssize(dark), "dark spots") + " on a brighter ground",
                       kInvert);
  }
  throw InputError(channel.name, expected, "no adhesion: " + why_no_adhesions(channel.image, pixel_um, p),
                   "is this the adhesion channel, in focus? Check pixel_size_um (" + images::in_um(pixel_um) +
                       "), adhesion_channel, and adhesion_seed_noise for a faint image");
}

std::string why_no_adhesions(const images::Image& image, double pixel_size_um, const AdhesionParameters& p) {
  if (std::string reason = emptiness_of(image); !reason.empty()) return reason;
  const Contrast c = contrast_of(without_padding(matrix_of(image)), pixel_size_um, p);
  const auto parts = adhesion_parts(c, pixel_size_um, p);
  if (!parts.empty())
    return "of " + std::to_string(parts.size()) +
           " spots none is larger than adhesion_smallest_um2 = " + shortest(p.adhesion_smallest_um2) +
           " and smaller than adhesion_largest_um2 = " + shortest(p.adhesion_largest_um2);
  double highest = 0;
  for (int y = 0; y < c.height.rows; ++y)
    for (int x = 0; x < c.height.cols; ++x)
      if (const double level = c.noise.at<float>(y, x); level > 0)
        highest = std::max(highest, c.height.at<float>(y, x) / level);
  if (highest > p.adhesion_seed_noise)
    return "bright areas and edges, but no spot higher than the steps of its background";
  return "nothing above the noise, the brightest spot " + brief(highest) +
         " of its standard deviations over the background, where adhesion_seed_noise asks for " +
         shortest(p.adhesion_seed_noise);
}

std::string emptiness_of(const images::Image& image) {
  if (image.pixels.empty()) return "no pixels";
  const auto [darkest, brightest] = std::minmax_element(image.pixels.begin(), image.pixels.end());
  if (*darkest == *brightest) return "every pixel is " + shortest(*darkest);
  const double share = images::share_at_brightest(image);
  constexpr double kMostAtOneValue = 0.1;
  if (share <= kMostAtOneValue) return {};
  return brief(100 * share) + " % of the pixels at " + shortest(*brightest) +
         ", the brightest value: the detector was saturated";
}

std::optional<images::Image> negative_of_dark_on_bright(images::Image image) {
  constexpr double kTail = 0.01;
  const auto value = [&](double share) { return numerics::quantile(image.pixels, share); };
  const float dark = value(kTail), middle = value(0.5), bright = value(1 - kTail);
  if (middle - dark <= bright - middle) return std::nullopt;
  const auto [least, most] = std::ranges::minmax(image.pixels);
  for (float& pixel : image.pixels) pixel = least + (most - pixel);
  return image;
}

}  // namespace mbtfm::cells
