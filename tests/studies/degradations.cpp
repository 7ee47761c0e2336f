/// degradations FOLDER FIRST_SEED [cells] [names], or degradations page TABLE.csv > notes/degradations.md: what a
/// cell's images go through in a laboratory, and what the program says of it. Each cell is simulated with images,
/// degraded in one way, run whole (`mbtfm run`) and compared with its truth. A table (CSV) on stdout; `names` are
/// separated by commas, "sound" is the undegraded one.
///
/// A degraded cell's error bars hold if at least 90 % of the tensions' 95 % intervals hold the truth, and the total
/// force lies within three of its standard errors. The truth is that of the adhesions in view. Where they do not, the
/// program must name the cause: by one of the findings of Degradation::named_by, or where it refuses the cell, by one
/// of its words.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>
#include <sstream>

#include "pipeline/contract/results.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/json_record.h"
#include "pipeline/report/compare.h"
#include "segment/cells/cell_rois.h"
#include "segment/images/image.h"
#include "segment/images/png.h"
#include "segment/rois/roi.h"
#include "tests/support/program.h"

namespace {

using namespace mbtfm;
using images::Image;
namespace fs = std::filesystem;

constexpr double kTruePixel_um = 0.1;  // whatever cell.toml says

/// A cell's images and settings; what a degradation changes.
struct Set {
  Image adhesion, actin, relaxed, stressed;
  fs::path truth;             ///< folder
  std::string settings = {};  ///< further tables of cell.toml
  std::string pixel_size_um = "0.1", youngs_modulus_kPa = "8.4", thickness_um = "60";
  bool as_jpeg = false;
  bool is_calibrated = true;                    ///< the files state their pixel size
  std::map<std::string, Image> more = {};       ///< further images, by name
  std::optional<DisplacementField> field = {};  ///< of another program, in the place of the bead images
  std::vector<Fibre> fibres = {};               ///< drawn by hand
  std::vector<Image*> all() { return {&adhesion, &actin, &relaxed, &stressed}; }
};

cv::Mat mat(const Image& image) {
  return cv::Mat(image.height, image.width, CV_32F, const_cast<float*>(image.pixels.data())).clone();
}

void put(Image& image, const cv::Mat& pixels) {
  image.width = pixels.cols;
  image.height = pixels.rows;
  image.pixels.assign(reinterpret_cast<const float*>(pixels.data),
                      reinterpret_cast<const float*>(pixels.data) + pixels.total());
}

Image image_of(const cv::Mat& pixels) {
  Image image{.width = 0, .height = 0, .pixels = {}, .pixel_size_um = {}};
  put(image, pixels);
  return image;
}

/// image(x) becomes image(from(x)); px, 0 at the centre of the first one.
void warp(Image& image, const std::function<Vec2(Vec2)>& from) {
  cv::Mat x(image.height, image.width, CV_32F), y = x.clone(), warped;
  for (int j = 0; j < image.height; ++j) {
    for (int i = 0; i < image.width; ++i) {
      const Vec2 p = from({double(i), double(j)});
      x.at<float>(j, i) = float(p.x);
      y.at<float>(j, i) = float(p.y);
    }
  }
  cv::remap(mat(image), warped, x, y, cv::INTER_LANCZOS4, cv::BORDER_REFLECT_101);
  put(image, cv::max(warped, 0));
}

Vec2 middle(const Image& image) { return {0.5 * (image.width - 1), 0.5 * (image.height - 1)}; }

/// What the image shows moves by this linear map about its middle, and a shift (px).
void move(Image& image, Vec2 shift, double growth = 0, double turn_deg = 0, double shear = 0) {
  const Vec2 c = middle(image);
  const double t = turn_deg * std::numbers::pi / 180;
  warp(image, [=](Vec2 p) {
    const Vec2 d = p - c - shift;  // small: inverse to second order
    return c + Vec2{d.x * (1 - growth - shear) + t * d.y, d.y * (1 - growth + shear) - t * d.x};
  });
}

void blur(Image& image, double sigma_px) {
  cv::Mat blurred;
  cv::GaussianBlur(mat(image), blurred, {}, sigma_px);
  put(image, blurred);
}

/// Sharp in the middle, at the left and the right border blurred by this: a tilt against the focal plane.
void blur_to_borders(Image& image, double sigma_px) {
  constexpr int kSteps = 8;
  const cv::Mat sharp = mat(image);
  cv::Mat result = sharp.clone();
  for (int k = 1; k <= kSteps; ++k) {
    cv::Mat blurred;
    cv::GaussianBlur(sharp, blurred, {}, sigma_px * k / kSteps);
    for (int i = 0; i < sharp.cols; ++i) {
      const double off = std::abs(2.0 * i / (sharp.cols - 1) - 1);
      if (std::lround(off * kSteps) == k) blurred.col(i).copyTo(result.col(i));
    }
  }
  put(image, result);
}

/// What this share of the values is below.
float quantile(std::vector<float> values, double share) {
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size()));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

void add_noise(Image& image, double times, unsigned seed) {
  cv::Mat pixels = mat(image), high;
  cv::Laplacian(pixels, high, CV_32F);  // of noise of sd s: s sqrt(20)
  std::vector<float> sizes;
  for (int j = 0; j < high.rows; ++j)
    for (int i = 0; i < high.cols; ++i) sizes.push_back(std::abs(high.at<float>(j, i)));
  const double sigma = 1.4826 * quantile(sizes, 0.5) / std::sqrt(20.0);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, times * sigma);
  for (float& p : image.pixels) p = float(std::max(0.0, p + normal(random)));
}

void blur_left_half(Image& image, double sigma_px) {
  cv::Mat blurred, result = mat(image);
  cv::GaussianBlur(result, blurred, {}, sigma_px);
  blurred.colRange(0, image.width / 2).copyTo(result.colRange(0, image.width / 2));
  put(image, result);
  add_noise(image, 1, 11);  // as the camera does, which blur takes off
}

void saturate(Image& image, double share) {
  const float most = quantile(image.pixels, 1 - share);
  for (float& p : image.pixels) p = std::min(p, most) / most * 65535;
}

void crop(Set& set, double left, double right, double top, double bottom) {
  for (Image* image : set.all()) {
    const cv::Rect box(int(left * image->width), int(top * image->height), int((right - left) * image->width),
                       int((bottom - top) * image->height));
    put(*image, mat(*image)(box).clone());
  }
}

/// What the cameras of one set do to all of its images.
void to_all(Set& set, const std::function<void(Image&)>& change) {
  for (Image* image : set.all()) change(*image);
}
void to_beads(Set& set, const std::function<void(Image&)>& change) {
  change(set.relaxed);
  change(set.stressed);
}

void flip(Image& image, int axis) {
  cv::Mat flipped;
  cv::flip(mat(image), flipped, axis);
  put(image, flipped);
}
void flip_rows(Image& image) { flip(image, 0); }
void mirror(Image& image) { flip(image, 1); }
void transpose(Image& image) { put(image, mat(image).t()); }

/// Of the camera, or of a copy: nobody corrects the pixel size.
void bin(Image& image, int binning) { image = images::binned(image, binning); }

void resize(Image& image, double across, double down) {
  cv::Mat resized;
  cv::resize(mat(image), resized, {}, across, down, cv::INTER_CUBIC);
  put(image, cv::max(resized, 0));
}

void invert(Image& image) {
  const float most = *std::ranges::max_element(image.pixels);
  for (float& p : image.pixels) p = most - p;
}

/// As a copy of 8 bits has it, from the darkest to the brightest pixel.
void to_8_bits(Image& image) {
  const auto [least, most] = std::ranges::minmax(image.pixels);
  for (float& p : image.pixels) p = std::round(255 * (p - least) / (most - least));
}

/// Pixels that shine by themselves, the same in each image of a camera.
void add_hot_pixels(Image& image, int n) {
  std::mt19937_64 random(7);
  const float bright = *std::ranges::max_element(image.pixels);
  std::uniform_int_distribution<std::size_t> any(0, image.pixels.size() - 1);
  for (int k = 0; k < n; ++k) image.pixels[any(random)] = bright;
}

void sharpen(Image& image) {
  cv::Mat blurred;
  cv::GaussianBlur(mat(image), blurred, {}, 1.5);
  const cv::Mat sharp = 2.5 * mat(image) - 1.5 * blurred;
  put(image, cv::max(sharp, 0));
}

/// The background taken off, and what is below zero then cut off.
void take_ground_off(Image& image) {
  const float ground = quantile(image.pixels, 0.5);
  for (float& p : image.pixels) p = std::max(0.f, p - ground);
}

Image mask_of_outline(const fs::path& truth, int width, int height) {
  const files::CsvTable table(truth / "outline.csv");
  std::vector<cv::Point> corners;
  for (int row = 0; row < table.n_rows(); ++row) {
    if (table.integer(row, "ring", 0) != 0) continue;
    corners.emplace_back(int(10 * table.number(row, "x_um")), int(10 * table.number(row, "y_um")));
  }
  cv::Mat mask = cv::Mat::zeros(height, width, CV_32F);
  cv::fillPoly(mask, std::vector<std::vector<cv::Point>>{corners}, 255);
  return image_of(mask);
}

Image mask_of_adhesions(const fs::path& truth, int width, int height) {
  cv::Mat mask = cv::Mat::zeros(height, width, CV_32F);
  for (const Adhesion& a : files::read_adhesions(truth / "adhesions.csv")) {
    cv::ellipse(mask,
                cv::RotatedRect({float(10 * a.position_um.x), float(10 * a.position_um.y)},
                                {float(10 * a.major_axis_um), float(10 * a.minor_axis_um)},
                                float(a.angle_rad * 180 / std::numbers::pi)),
                255, cv::FILLED);
  }
  return image_of(mask);
}

/// As another program would have found it, with 20 nm of noise.
DisplacementField true_field(const fs::path& truth, const std::function<void(Bead&)>& change) {
  DisplacementField field = files::read_displacement(truth / "displacement.csv");
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0, 0.02);
  for (Bead& bead : field) {
    bead.displacement_um += Vec2{normal(random), normal(random)};
    bead.sigma_um = 0.02;
    change(bead);
  }
  return field;
}

void scale(Bead& bead, double factor) {
  bead.position_um = factor * bead.position_um;
  bead.displacement_um = factor * bead.displacement_um;
  bead.sigma_um *= factor;
}

/// The displacement as another program has it.
auto as_field(const std::function<void(Bead&)>& change) {
  return [=](Set& s, const auto&) { s.field = true_field(s.truth, change); };
}

struct Degradation {
  std::string name, what;
  std::string named_by;  ///< findings, or words of a refusal: whoever reads them knows what to mend; with semicolons
  std::function<void(Set&, const Set& other)> apply;
};

std::vector<Degradation> degradations() {
  const auto moved = [](Image Set::*which, auto... motion) {
    return [=](Set& s, const Set&) { move(s.*which, motion...); };
  };
  const auto stressed = [=](auto... motion) { return moved(&Set::stressed, motion...); };
  return {
      {"sound", "nothing", "", [](Set&, const Set&) {}},
      {"growth-0.05", "the stressed bead image is 0.05 % larger", "", stressed(Vec2{}, .0005)},
      {"growth-0.1", "the stressed bead image is 0.1 % larger", "", stressed(Vec2{}, .001)},
      {"growth-0.3", "the stressed bead image is 0.3 % larger", "", stressed(Vec2{}, .003)},
      {"growth-minus-0.05", "the stressed bead image is 0.05 % smaller", "", stressed(Vec2{}, -.0005)},
      {"growth-minus-0.1", "the stressed bead image is 0.1 % smaller", "", stressed(Vec2{}, -.001)},
      {"growth-minus-0.3", "the stressed bead image is 0.3 % smaller", "", stressed(Vec2{}, -.003)},
      {"growth-2", "the stressed bead image is 2 % larger: another objective", "", stressed(Vec2{}, .02)},
      {"shear-0.1", "the stressed bead image is sheared by 0.1 %", "", stressed(Vec2{}, 0., 0., .001)},
      {"turn-0.3", "the stressed bead image is turned by 0.3 degrees", "", stressed(Vec2{}, 0., .3)},
      {"turn-5", "the stressed bead image is turned by 5 degrees", "", stressed(Vec2{}, 0., 5.)},
      {"drift", "the stage drifted by (3.4, -1.7) px between the bead images", "", stressed(Vec2{3.4, -1.7})},
      {"all-motions", "growth, shear, turn and drift together", "", stressed(Vec2{3.4, -1.7}, .001, .3, .001)},
      {"tiles", "the right half of the stressed bead image was stitched 1 px off", "common-motion",
       [](Set& s, const Set&) {
         const double half = 0.55 * s.stressed.width;
         warp(s.stressed, [=](Vec2 p) { return p.x > half ? p - Vec2{1, 0} : p; });
       }},
      {"rolling-drift", "the stage swung by 0.5 px while the stressed bead image was scanned", "common-motion",
       [](Set& s, const Set&) {
         const double period = s.stressed.height;
         warp(s.stressed, [=](Vec2 p) { return p - Vec2{0.5 * std::sin(2 * std::numbers::pi * p.y / period), 0}; });
       }},
      {"lens", "the stressed bead image was taken through a lens that distorts by 0.1 % at the border", "common-motion",
       [](Set& s, const Set&) {
         const Vec2 c = middle(s.stressed);
         warp(s.stressed, [=](Vec2 p) {
           const Vec2 d = p - c;
           return p - .001 * dot(d, d) / dot(c, c) * 2 * d;
         });
       }},
      {"tilted-stage", "the stage was tilted by 3 degrees: one direction is shorter, the borders are out of focus",
       "defocused; misfit-in-a-region",
       [](Set& s, const Set&) {
         const Vec2 c = middle(s.stressed);
         warp(s.stressed, [=](Vec2 p) { return Vec2{c.x + (p.x - c.x) / std::cos(3 * std::numbers::pi / 180), p.y}; });
         blur_to_borders(s.stressed, 2);
       }},
      {"half-defocused", "the left half of both bead images is far out of focus (blurred by 4 px)",
       "field-smoothed; defocused", [](Set& s, const Set&) { to_beads(s, [](Image& i) { blur_left_half(i, 4); }); }},
      {"adhesions-3px", "the adhesion channel is shifted by 3 px against the others", "",
       moved(&Set::adhesion, Vec2{2.5, -1.7})},
      {"adhesions-5px", "the adhesion channel is shifted by 5 px against the others", "",
       moved(&Set::adhesion, Vec2{-4, 3})},
      {"actin-4px", "the actin channel is shifted by 4 px against the others", "", moved(&Set::actin, Vec2{3, 2.6})},
      {"beads-5px", "both bead images are shifted by 5 px against the cell", "",
       [](Set& s, const Set&) { to_beads(s, [](Image& i) {
                                  move(i, Vec2{4, 3});
                                }); }},
      {"beads-turned", "both bead images are turned by 0.5 degrees against the cell", "",
       [](Set& s, const Set&) { to_beads(s, [](Image& i) { move(i, {}, 0, .5); }); }},
      {"beads-mirrored", "both bead images are mirrored", "wrong-orientation",
       [](Set& s, const Set&) { to_beads(s, mirror); }},
      {"beads-transposed", "rows and columns of both bead images are exchanged", "wrong-orientation",
       [](Set& s, const Set&) { to_beads(s, transpose); }},
      {"beads-exchanged", "the stressed and the relaxed bead image are exchanged", "exchanged",
       [](Set& s, const Set&) { std::swap(s.relaxed, s.stressed); }},
      {"beads-of-another-cell", "both bead images are those of another cell", "misfit; nothing-moves",
       [](Set& s, const Set& o) { s.relaxed = o.relaxed, s.stressed = o.stressed; }},
      {"stressed-of-another-cell", "the stressed bead image is that of another cell", "one place",
       [](Set& s, const Set& o) { s.stressed = o.stressed; }},
      {"channels-exchanged", "the adhesion and the actin image are exchanged", "bleed-through",
       [](Set& s, const Set&) { std::swap(s.adhesion, s.actin); }},
      {"bleed-through", "a third of the actin signal is seen in the adhesion channel", "bleed-through",
       [](Set& s, const Set&) {
         for (std::size_t k = 0; k < s.adhesion.pixels.size(); ++k) s.adhesion.pixels[k] += .33f * s.actin.pixels[k];
       }},
      {"defocus", "the stressed bead image is out of focus (blurred by 1.5 px)", "defocused",
       [](Set& s, const Set&) { blur(s.stressed, 1.5); }},
      {"both-defocused", "both bead images are out of focus (blurred by 2 px)", "defocused",
       [](Set& s, const Set&) { to_beads(s, [](Image& i) { blur(i, 2); }); }},
      {"noisy-beads", "three times more noise in both bead images", "",
       [](Set& s, const Set&) {
         add_noise(s.relaxed, 3, 1);
         add_noise(s.stressed, 3, 2);
       }},
      {"mixed", "the relaxed bead image shows a third of the stressed one's light, too", "pictures-mixed",
       [](Set& s, const Set&) { put(s.relaxed, (2 * mat(s.relaxed) + mat(s.stressed)) / 3); }},
      {"adhesions-saturated", "the brightest 1 % of the adhesion image are saturated", "saturated",
       [](Set& s, const Set&) { saturate(s.adhesion, .01); }},
      {"actin-saturated", "the brightest 2 % of the actin image are saturated", "saturated",
       [](Set& s, const Set&) { saturate(s.actin, .02); }},
      {"beads-saturated", "the brightest 2 % of both bead images are saturated", "saturated",
       [](Set& s, const Set&) { to_beads(s, [](Image& i) { saturate(i, .02); }); }},
      {"jpeg", "all images are JPEG files", "lossy-image", [](Set& s, const Set&) { s.as_jpeg = true; }},
      {"cut-one-side", "the border cuts a third of the cell off", "cell-cut",
       [](Set& s, const Set&) { crop(s, 0, .6, 0, 1); }},
      {"cut-two-sides", "the border cuts the cell on two sides", "cell-cut",
       [](Set& s, const Set&) { crop(s, 0, .62, 0, .62); }},
      {"uneven-light", "the light of adhesion and actin image falls to a third at the border", "",
       [](Set& s, const Set&) {
         for (Image* image : {&s.adhesion, &s.actin}) {
           const Vec2 c = middle(*image);
           for (int j = 0; j < image->height; ++j) {
             for (int i = 0; i < image->width; ++i) {
               const Vec2 d = Vec2{double(i), double(j)} - c;
               image->at(i, j) *= float(1 - .67 * dot(d, d) / dot(c, c));
             }
           }
         }
       }},
      {"blurred-cell", "adhesion and actin image are out of focus (blurred by 3 px)", "",
       [](Set& s, const Set&) {
         for (Image* i : {&s.adhesion, &s.actin}) blur(*i, 3);
       }},
      {"fibres-missed", "weak fibres are not found (fibre_start_noise = 60)", "missing-fibre",
       [](Set& s, const Set&) { s.settings += "[segment]\nfibre_start_noise = 60\n"; }},
      {"adhesions-missed", "small and dim adhesions are not found (adhesion_smallest_um2 = 0.8)", "missing-adhesion",
       [](Set& s, const Set&) { s.settings += "[segment]\nadhesion_smallest_um2 = 0.8\n"; }},
      {"second-cell", "another cell pulls at the beads in the corner, unseen in the other channels",
       "misfit-in-a-region",
       [](Set& s, const Set&) {
         const Vec2 c{.12 * s.stressed.width, .12 * s.stressed.height};
         warp(s.stressed, [=](Vec2 p) {
           const Vec2 d = p - c;
           return p - Vec2{5 * std::exp(-dot(d, d) / (2 * 30 * 30)), 0};
         });
       }},
      {"pixel-size", "the pixel size of cell.toml is 30 % too large", "pixel",
       [](Set& s, const Set&) { s.pixel_size_um = "0.13"; }},
      {"modulus-in-pascal", "the modulus is given in Pa", "kPa",
       [](Set& s, const Set&) { s.youngs_modulus_kPa = "8400"; }},
      {"binned", "all images were binned 2 x 2, the pixel size is that of before; the files do not state it",
       "pixel-size-unchecked",
       [](Set& s, const Set&) {
         to_all(s, [](Image& i) { bin(i, 2); });
         s.is_calibrated = false;
       }},
      {"pixel-size-double", "the pixel size is twice too large; the files do not state it", "pixel-size-unchecked",
       [](Set& s, const Set&) {
         s.pixel_size_um = "0.2";
         s.is_calibrated = false;
       }},
      {"beads-binned", "the bead images were binned 2 x 2, the others were not; the files do not state it",
       "track.beads_pixel_size_um",
       [](Set& s, const Set&) {
         to_beads(s, [](Image& i) { bin(i, 2); });
         s.is_calibrated = false;
       }},
      {"resized", "all images were enlarged to twice as many pixels a side, with the right pixel size", "",
       [](Set& s, const Set&) {
         to_all(s, [](Image& i) { resize(i, 2, 2); });
         s.pixel_size_um = "0.05";
         s.is_calibrated = false;
       }},
      {"stretched", "all images are 10 % less high than they should be: pixels that are not square", "beads-not-round",
       [](Set& s, const Set&) { to_all(s, [](Image& i) { resize(i, 1, 0.9); }); }},
      {"8-bit", "each image was scaled to 8 bits by itself", "", [](Set& s, const Set&) { to_all(s, to_8_bits); }},
      {"square-root", "of each image the square root was taken (gamma 0.5)", "",
       [](Set& s, const Set&) {
         to_all(s, [](Image& i) {
           for (float& p : i.pixels) p = 100 * std::sqrt(p);
         });
       }},
      {"beads-inverted", "both bead images are dark on bright", "dark",
       [](Set& s, const Set&) { to_beads(s, invert); }},
      {"actin-inverted", "the actin image is dark on bright", "dark", [](Set& s, const Set&) { invert(s.actin); }},
      {"adhesions-inverted", "the adhesion image is dark on bright", "dark",
       [](Set& s, const Set&) { invert(s.adhesion); }},
      {"hot-pixels", "300 pixels of the camera shine in both bead images", "",
       [](Set& s, const Set&) { to_beads(s, [](Image& i) { add_hot_pixels(i, 300); }); }},
      {"beads-sharpened", "both bead images were sharpened (unsharp mask)", "",
       [](Set& s, const Set&) { to_beads(s, sharpen); }},
      {"beads-cut-off", "of both bead images the background was taken off, and what is negative", "",
       [](Set& s, const Set&) { to_beads(s, take_ground_off); }},
      {"beads-20px", "the stressed bead image shows the place 20 px beside", "", stressed(Vec2{16, -12})},
      {"relaxed-twice", "the stressed bead image shows the relaxed gel", "nothing-moves",
       [](Set& s, const Set&) {
         s.stressed = s.relaxed;
         add_noise(s.stressed, 1, 5);
       }},
      {"actin-flipped", "the rows of the actin image run upwards", "images-mismatch",
       [](Set& s, const Set&) { flip_rows(s.actin); }},
      {"adhesions-flipped", "the rows of the adhesion image run upwards", "images-mismatch",
       [](Set& s, const Set&) { flip_rows(s.adhesion); }},
      {"cell-flipped", "the rows of adhesion and actin image run upwards", "wrong-orientation",
       [](Set& s, const Set&) {
         flip_rows(s.adhesion);
         flip_rows(s.actin);
       }},
      {"actin-of-another-cell", "the actin image is that of another cell", "images-mismatch",
       [](Set& s, const Set& o) { s.actin = o.actin; }},
      {"adhesions-of-another-cell", "the adhesion image is that of another cell", "images-mismatch",
       [](Set& s, const Set& o) { s.adhesion = o.adhesion; }},
      {"outline-of-another-cell", "the outline is a mask of another cell", "images-mismatch",
       [](Set& s, const Set& o) { s.more["outline_mask"] = mask_of_outline(o.truth, s.actin.width, s.actin.height); }},
      {"beads-as-actin", "the relaxed bead image is given as actin", "right channel; right file",
       [](Set& s, const Set&) { s.actin = s.relaxed; }},
      {"beads-as-adhesions", "the relaxed bead image is given as adhesions", "images-mismatch",
       [](Set& s, const Set&) { s.adhesion = s.relaxed; }},
      {"adhesions-as-actin", "the adhesion image is given as actin, too", "same pixels",
       [](Set& s, const Set&) { s.actin = s.adhesion; }},
      {"actin-as-adhesions", "the actin image is given as adhesions, too", "same pixels",
       [](Set& s, const Set&) { s.adhesion = s.actin; }},
      {"adhesions-as-pattern", "a mask of the adhesions is given as the adhesive pattern", "pattern-unsuitable",
       [](Set& s, const Set&) {
         s.more["adhesion_mask"] = mask_of_adhesions(s.truth, s.actin.width, s.actin.height);
         s.settings += "[segment]\nadhesions = \"pattern\"\n";
       }},
      {"cell-as-pattern", "a mask of the cell is given as the adhesive pattern", "pattern-unsuitable",
       [](Set& s, const Set&) {
         s.more["adhesion_mask"] = mask_of_outline(s.truth, s.actin.width, s.actin.height);
         s.settings += "[segment]\nadhesions = \"pattern\"\n";
       }},
      {"fibres-twice", "each fibre was drawn twice", "not-identifiable",
       [](Set& s, const Set&) {
         s.fibres = files::read_fibres(s.truth / "fibres.csv", s.truth / "fibre_points.csv");
         const std::vector<Fibre> once = s.fibres;
         for (Fibre f : once) {
           f.fibre_id += int(once.size());
           s.fibres.push_back(f);
         }
       }},
      {"thickness-6", "the thickness is given as 6 um; it is 60", "unusual-value",
       [](Set& s, const Set&) { s.thickness_um = "6"; }},
      {"thickness-600", "the thickness is given as 600 um; it is 60", "unusual-value",
       [](Set& s, const Set&) { s.thickness_um = "600"; }},
      {"field", "the displacement is of another program", "", as_field([](Bead&) {})},
      {"field-in-pixels", "the displacement is of another program, in px", "wrong-orientation",
       as_field([](Bead& b) { scale(b, 10); })},
      {"field-half-in-pixels", "the displacement is of another program, in px, its places in um", "unusual-value",
       as_field([](Bead& b) {
         b.displacement_um = 10 * b.displacement_um;
         b.sigma_um *= 10;
       })},
      {"field-places-in-pixels", "the displacement is of another program, in um, its places in px", "wrong-orientation",
       as_field([](Bead& b) { b.position_um = 10 * b.position_um; })},
      {"field-in-metres", "the displacement is of another program, in m", "um",
       as_field([](Bead& b) { scale(b, 1e-6); })},
      {"field-y-up", "the displacement is of another program, with y upwards", "wrong-orientation",
       [](Set& s, const Set&) {
         const double height_um = 0.1 * s.actin.height;
         s.field = true_field(s.truth, [=](Bead& b) {
           b.position_um.y = height_um - b.position_um.y;
           b.displacement_um.y = -b.displacement_um.y;
         });
       }},
      {"field-uy-up", "the displacement is of another program, uy upwards and y downwards", "wrong-orientation",
       as_field([](Bead& b) { b.displacement_um.y = -b.displacement_um.y; })},
      {"field-exchanged", "the displacement is of another program, from the stressed to the relaxed state", "exchange",
       as_field([](Bead& b) { b.displacement_um = -1 * b.displacement_um; })},
      {"field-columns", "the displacement is of another program, ux and uy exchanged", "wrong-orientation",
       as_field([](Bead& b) { std::swap(b.displacement_um.x, b.displacement_um.y); })},
      {"field-astray", "a fifth of the beads within 1 um of an adhesion are off by five standard errors",
       "misfit-near-adhesions",
       [](Set& s, const Set&) {
         const std::vector<Adhesion> adhesions = files::read_adhesions(s.truth / "adhesions.csv");
         std::mt19937_64 random(4);
         std::uniform_real_distribution<double> chance(0, 1), turn(0, 2 * std::numbers::pi);
         s.field = true_field(s.truth, [&](Bead& b) {
           const auto is_beside = [&](const Adhesion& a) { return norm(a.position_um - b.position_um) < 1; };
           if (std::ranges::none_of(adhesions, is_beside) || chance(random) > 0.2) return;
           const double angle = turn(random);
           b.displacement_um += 5 * b.sigma_um * Vec2{std::cos(angle), std::sin(angle)};
         });
       }},
      {"field-smoothed", "the displacement is of another program that smoothed it over 4 um", "field-smoothed",
       [](Set& s, const Set&) {
         const DisplacementField all = true_field(s.truth, [](Bead&) {});
         s.field = true_field(s.truth, [&](Bead& b) {
           Vec2 sum;
           double weight = 0;
           for (const Bead& other : all) {
             const Vec2 d = other.position_um - b.position_um;
             const double w = std::exp(-dot(d, d) / (2 * 2 * 2));
             sum += w * other.displacement_um;
             weight += w;
           }
           b.displacement_um = (1 / weight) * sum;
         });
       }},
  };
}

Set read(const fs::path& folder) {
  return {.adhesion = images::read_image(folder / "paxillin.tif"),
          .actin = images::read_image(folder / "actin.tif"),
          .relaxed = images::read_image(folder / "beads_relaxed.tif"),
          .stressed = images::read_image(folder / "beads_stressed.tif"),
          .truth = folder / "truth"};
}

void write(const fs::path& folder, const Set& set) {
  const auto image = [&](const std::string& name, Image i) {
    if (!set.is_calibrated) i.pixel_size_um.reset();
    if (!set.as_jpeg) return images::write_tiff(folder / (name + ".tif"), i);
    const float most = *std::ranges::max_element(i.pixels);
    images::Picture picture{.width = i.width, .height = i.height, .rgb = {}};
    for (const float p : i.pixels)
      for (int c = 0; c < 3; ++c) picture.rgb.push_back(static_cast<std::uint8_t>(255 * p / most));
    images::write_jpeg(folder / (name + ".jpg"), picture);
  };
  image("paxillin", set.adhesion);
  image("actin", set.actin);
  std::string images;  // lines of [images]
  if (set.field) {
    files::write_displacement(folder / "field.csv", *set.field);
    images += "displacement = \"field.csv\"\n";
  } else {
    image("beads_relaxed", set.relaxed);
    image("beads_stressed", set.stressed);
  }
  for (const auto& [name, further] : set.more) image(name, further);
  if (!set.fibres.empty()) {
    Cell drawn;
    drawn.fibres = set.fibres;
    std::vector<rois::Roi> lines = cells::rois_of(drawn, kTruePixel_um);
    std::erase_if(lines, [](const rois::Roi& r) { return r.name == "outline"; });
    rois::write_roi_set(folder / "fibres.zip", lines);
  }
  if (set.as_jpeg) {
    images +=
        "adhesion = \"paxillin.jpg\"\nactin = \"actin.jpg\"\nbeads_relaxed = \"beads_relaxed.jpg\"\n"
        "beads_stressed = \"beads_stressed.jpg\"\n";
  }
  files::write_text(folder / "cell.toml", "pixel_size_um = " + set.pixel_size_um +
                                              "\n[gel]\nyoungs_modulus_kPa = " + set.youngs_modulus_kPa +
                                              "\npoisson_ratio = 0.49\nthickness_um = " + set.thickness_um + "\n" +
                                              (images.empty() ? "" : "[images]\n" + images) + set.settings);
}

/// Against the truth.
struct Score {
  int n_fibres = 0, n_held = 0;
  double error = 0, total_z = 0;
};

/// @param view_um  size of the image, whose corner stays where it was: of a cell that it cuts, the force found is that
///                 of the adhesions in view
Score score_of(const fs::path& cell, const fs::path& truth, Vec2 view_um) {
  const auto fibres = [](const fs::path& f) { return files::read_fibres(f / "fibres.csv", f / "fibre_points.csv"); };
  const std::vector<Fibre> found = fibres(cell / "1_segment"), wanted = fibres(truth);
  const auto tensions = files::read_tensions(cell / "4_fit/tensions.csv"),
             true_tensions = files::read_tensions(truth / "tensions.csv");
  const auto of = [](const std::vector<Tension>& all, int id) {
    return *std::ranges::find(all, id, &Tension::fibre_id);
  };
  Score score;
  double squares = 0, all = 0;
  for (const report::FibreMatch& match : report::match_fibres(found, wanted)) {
    const int id = found[std::size_t(match.found_index)].fibre_id;
    if (std::ranges::find(tensions, id, &Tension::fibre_id) == tensions.end()) continue;
    const Tension t = of(tensions, id);
    const double true_nN = of(true_tensions, wanted[std::size_t(match.true_index)].fibre_id).tension_nN;
    ++score.n_fibres;
    score.n_held += t.low_nN.value_or(0) <= true_nN && true_nN <= t.high_nN.value_or(1e300);
    squares += std::pow(t.tension_nN - true_nN, 2);
    all += true_nN * true_nN;
  }
  score.error = std::sqrt(squares / all);
  const std::vector<Adhesion> adhesions = files::read_adhesions(truth / "adhesions.csv");
  double total_nN = 0;
  for (const AdhesionForce& f : files::read_adhesion_forces(truth / "adhesion_forces.csv")) {
    const Vec2 place = std::ranges::find(adhesions, f.adhesion_id, &Adhesion::adhesion_id)->position_um;
    if (place.x < view_um.x && place.y < view_um.y) total_nN += norm(f.force_nN);
  }
  const files::JsonRecord fit(cell / "4_fit/fit.json", "a fit");
  score.total_z = (fit.at("total_force_nN").number() - total_nN) / fit.at("total_force_sigma_nN").number();
  return score;
}

bool names_cause(const Degradation& d, const std::string& said) {
  std::istringstream names(d.named_by);
  for (std::string name; std::getline(names >> std::ws, name, ';');)
    if (said.find(name) != said.npos) return true;
  return false;
}

struct Noticed {
  std::string open_ids, all_ids;  ///< of findings; notes are not open
};

Noticed findings_in(const fs::path& cell) {
  const files::JsonRecord run(cell / "run.json", "a run");
  Noticed noticed;
  const auto add = [](std::string& ids, const std::string& id) {
    if (ids.find(id) == ids.npos) ids += (ids.empty() ? "" : "; ") + id;
  };
  for (const files::JsonRecord& finding : run.at("findings").list()) {
    const std::string id = finding.at("id").text();
    add(noticed.all_ids, id);
    if (finding.at("severity").text() != "note") add(noticed.open_ids, id);
  }
  return noticed;
}

std::string error_line(const std::string& output) {
  const auto at = output.find("error:");
  if (at == output.npos) return {};
  std::string line = output.substr(at + 7, output.find('\n', at) - at - 7);
  std::ranges::replace(line, '"', '\'');
  return line;
}

void study(const Degradation& d, int seed, const fs::path& folder) {
  const auto simulated = [&](int s) {
    const fs::path cell = folder / ("cell_" + std::to_string(s));
    if (!fs::exists(cell / "cell.toml")) {
      const auto run =
          test::run_program("mbtfm-simulate --images --quiet --seed " + std::to_string(s) + " --out " + cell.string());
      if (run.code != 0) std::fprintf(stderr, "%s\n", run.output.c_str());
    }
    return cell;
  };
  const fs::path truth = simulated(seed) / "truth", cell = folder / (d.name + "_" + std::to_string(seed));
  Set set = read(simulated(seed));
  const Set other = read(simulated(seed + 1000));
  d.apply(set, other);
  fs::remove_all(cell);
  fs::create_directories(cell);
  write(cell, set);
  const auto run = test::run_program("mbtfm run " + cell.string() + " --threads 1 --quiet");
  std::printf("%s,%d,%d,", d.name.c_str(), seed, run.code);
  if (run.code == 0) {
    const Score s =
        score_of(cell, truth, kTruePixel_um * Vec2{double(set.adhesion.width), double(set.adhesion.height)});
    const auto [ids, all_ids] = findings_in(cell);
    const bool holds =
        s.n_fibres > 0 && s.n_held >= 0.9 * s.n_fibres - 1 && std::abs(s.total_z) < 3;  // of 20 fibres one by chance
    std::printf("%d,%d,%.3f,%.2f,%s,%s,%s,\"%s\",\"%s\",\n", s.n_fibres, s.n_held, s.error, s.total_z,
                holds ? "true" : "false", holds || !ids.empty() ? "true" : "false",
                names_cause(d, all_ids) ? "true" : "false", ids.c_str(), all_ids.c_str());
  } else {
    std::printf(",,,,,true,%s,,,\"%s\"\n", names_cause(d, run.output) ? "true" : "false",
                error_line(run.output).c_str());
  }
  std::fflush(stdout);
}

/// notes/degradations.md, of a table that this program wrote.
void print_page(const fs::path& file) {
  const files::CsvTable table(file);
  std::printf(
      "# Degraded images\n\n"
      "What images go through in a laboratory, and what the program says of it. Simulated cells (scenario `u2os`, "
      "images of\n"
      "ordinary quality) were degraded in one way each and run as they are (`mbtfm run`). Made by "
      "`notes/make_degradations.sh`.\n\n"
      "- **bars hold**: cells of which at least 90 %% of the tensions' 95 %% intervals hold the truth (one fibre more "
      "may miss,\n"
      "  as one of twenty does by chance) and the total force lies within three standard errors of the truth. Of a "
      "cell that\n"
      "  the border cuts, both are those of the adhesions in view.\n"
      "- **error**: of the tensions, relative; of two cells the larger, of more the median.\n"
      "- **open findings** ([list](../docs/findings.md)): those of at least half of the cells; of sound cells all of "
      "them, "
      "with the number of\n"
      "  cells. A cell with one has no green tick.\n"
      "- **named**: of the cells that were refused or whose bars do not hold, those of which a finding or the refusal "
      "names\n  the cause.\n"
      "- **not told**: the bars do not hold, no finding is open, and nothing was refused.\n\n"
      "| degradation | what was done | cells | refused | bars hold | named | error | open findings |\n"
      "|---|---|---|---|---|---|---|---|\n");
  for (const Degradation& d : degradations()) {
    int n = 0, n_refused = 0, n_held = 0, n_untold = 0, n_named = 0;
    std::vector<double> errors;
    std::map<std::string, int> findings;
    for (int row = 0; row < table.n_rows(); ++row) {
      if (table.text(row, "degradation") != d.name) continue;
      ++n;
      n_refused += table.integer(row, "exit_code", 0) != 0;
      n_held += table.text(row, "bars_hold") == "true";
      n_untold += table.text(row, "told") != "true";
      n_named += table.text(row, "bars_hold") != "true" && table.text(row, "named") == "true";
      const std::string error = table.text(row, "tension_error");
      if (!error.empty() && error.find("nan") == error.npos) errors.push_back(std::stod(error));
      std::istringstream ids(table.text(row, "findings"));
      for (std::string id; std::getline(ids >> std::ws, id, ';');) ++findings[id];
    }
    if (n == 0) continue;
    std::ranges::sort(errors);
    std::string names;
    for (const auto& [id, times] : findings) {
      if (2 * times < n && d.name != "sound") continue;
      names += (names.empty() ? "`" : ", `") + id + "`";
      if (d.name == "sound") names += " (" + std::to_string(times) + ")";
    }
    char error[16] = "–";
    if (!errors.empty()) std::snprintf(error, sizeof error, "%.2f", errors[errors.size() / 2]);
    const std::string named = n == n_held ? "–" : std::to_string(n_named) + " of " + std::to_string(n - n_held);
    std::printf("| `%s` | %s | %d | %d | %d | %s | %s | %s%s |\n", d.name.c_str(), d.what.c_str(), n, n_refused, n_held,
                named.c_str(), error, names.empty() ? "–" : names.c_str(),
                n_untold > 0 ? (" **" + std::to_string(n_untold) + " not told**").c_str() : "");
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    for (const Degradation& d : degradations()) std::printf("| `%s` | %s |\n", d.name.c_str(), d.what.c_str());
    return 0;
  }
  if (std::string(argv[1]) == "page") {
    print_page(argv[2]);
    return 0;
  }
  const int first = std::atoi(argv[2]), n = argc > 3 ? std::atoi(argv[3]) : 3;
  std::string names = argc > 4 ? "," + std::string(argv[4]) + "," : "";
  std::printf(
      "degradation,cell,exit_code,fibres,held,tension_error,total_z,bars_hold,told,named,findings,all_findings,"
      "refused\n");
  for (const Degradation& d : degradations()) {
    if (!names.empty() && names.find("," + d.name + ",") == names.npos) continue;
    for (int seed = first; seed < first + n; ++seed) study(d, seed, argv[1]);
  }
}
