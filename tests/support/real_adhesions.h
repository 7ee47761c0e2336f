/// Real cells whose adhesions or outline others have marked, where the shared data are present: a published fibroblast
/// with its labels (Berginski et al. 2011), noisy live cells with masks drawn by hand, a doublet with its outline.
#pragma once

#include "pipeline/contract/cell.h"
#include "segment/cells/adhesions.h"
#include "segment/cells/outline.h"
#include "segment/cells/segment_cell.h"
#include "tests/support/folders.h"
#include "tests/support/segmentation_score.h"

namespace mbtfm::test {

inline const std::filesystem::path kSharedData = test::source_folder().parent_path() / "shared/data";

inline const std::filesystem::path kFibroblast = kSharedData / "fa/faas_fibro100_wt02";
/// The authors' images of this series have about 0.215 um a pixel; it makes this cell 35 x 90 um.
constexpr double kFibroblastPixel_um = 0.215;

/// Two each of six live cells, turned and with added speckle.
inline const std::filesystem::path kHandMasks = kSharedData / "fa/hand_masks";
constexpr double kHandMasksPixel_um = 0.1527;
constexpr int kHandMasked[] = {0, 2, 60, 62, 4, 10, 64, 70, 6, 8, 66, 68};

/// Two MDCK cells on a pattern, in the haze of their own height.
inline const std::filesystem::path kDoublet = kSharedData / "real/doublet_on_h";
constexpr double kDoubletPixel_um = 0.108;

/// Rows of a table of numbers without a header.
inline std::vector<std::vector<double>> numbers_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(in, line);) {
    std::istringstream fields(line);
    rows.emplace_back();
    for (std::string field; std::getline(fields, field, ',');) rows.back().push_back(std::stod(field));
  }
  return rows;
}

/// Pixels by label.
using Labels = std::map<int, std::vector<cells::CoveredPixel>>;

inline Labels labels_of(const images::Image& image) {
  Labels labels;
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column)
      if (const int label = static_cast<int>(image.at(column, row))) labels[label].push_back({column, row, 1, 0});
  return labels;
}

/// The connected pixels of a mask (4 neighbours), by label.
inline Labels components_of(const images::Image& mask) {
  Labels labels;
  std::vector<bool> is_done(mask.pixels.size(), false);
  const auto take = [&](std::vector<cells::CoveredPixel>& part, int column, int row) {
    if (column < 0 || row < 0 || column >= mask.width || row >= mask.height || mask.at(column, row) == 0) return;
    if (const std::size_t i = static_cast<std::size_t>(row) * mask.width + column; !is_done[i]) {
      is_done[i] = true;
      part.push_back({column, row, 1, 0});
    }
  };
  for (int row = 0; row < mask.height; ++row)
    for (int column = 0; column < mask.width; ++column) {
      std::vector<cells::CoveredPixel> part;
      take(part, column, row);
      for (std::size_t k = 0; k < part.size(); ++k)
        for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}})
          take(part, part[k].column + dx, part[k].row + dy);
      if (!part.empty()) labels[static_cast<int>(labels.size()) + 1] = std::move(part);
    }
  return labels;
}

/// What is found in an image, by its pixels and by the ellipses that stand for them.
struct FoundLabels {
  Labels pixels, ellipses;
};

inline FoundLabels found_labels(const std::vector<cells::AdhesionRegion>& regions, const images::Image& image,
                                double pixel_um) {
  FoundLabels found;
  for (const cells::AdhesionRegion& region : regions) {
    const Adhesion& a = region.adhesion;
    for (const cells::CoveredPixel& p : region.pixels)
      if (p.share >= 0.5) found.pixels[a.adhesion_id].push_back(p);
    const auto range = [&](double centre_um, int n) {
      return std::pair(std::max(0, static_cast<int>((centre_um - a.major_axis_um) / pixel_um)),
                       std::min(n, static_cast<int>((centre_um + a.major_axis_um) / pixel_um) + 2));
    };
    const auto [top, bottom] = range(a.position_um.y, image.height);
    const auto [left, right] = range(a.position_um.x, image.width);
    for (int row = top; row < bottom; ++row)
      for (int column = left; column < right; ++column)
        if (const Vec2 at{(column + 0.5) * pixel_um, (row + 0.5) * pixel_um};
            norm(at - a.position_um) <= a.major_axis_um && cells::distance_to_ellipse_um(a, at) < 0)
          found.ellipses[a.adhesion_id].push_back({column, row, 1, 0});
  }
  return found;
}

struct Overlap {
  double dice = 0;  ///< of the pixels of all objects
  double f1 = 0;    ///< of the objects of at least five pixels, hit where intersection over union is 0.3
  int n_true = 0, n_found = 0;
};

inline Overlap overlap_of(const Labels& truth, const Labels& found) {
  std::map<std::pair<int, int>, int> label_at;
  std::size_t n_truth = 0, n_found = 0, n_both = 0;
  for (const auto& [label, pixels] : found)
    for (const auto& p : pixels) label_at[{p.column, p.row}] = label;
  n_found = label_at.size();
  std::map<std::pair<int, int>, int> shared;
  for (const auto& [label, pixels] : truth)
    for (const auto& p : pixels) {
      ++n_truth;
      const auto there = label_at.find({p.column, p.row});
      if (there == label_at.end()) continue;
      ++n_both;
      ++shared[{label, there->second}];
    }
  Overlap o;
  o.dice = 2.0 * n_both / (n_truth + n_found);
  for (const auto& [label, pixels] : truth) o.n_true += pixels.size() >= 5;
  for (const auto& [label, pixels] : found) o.n_found += pixels.size() >= 5;
  int n_hits = 0;
  for (const auto& [pair, n] : shared) {
    const std::size_t t = truth.at(pair.first).size(), f = found.at(pair.second).size();
    n_hits += t >= 5 && f >= 5 && 1.0 * n / static_cast<double>(t + f - n) >= 0.3;
  }
  o.f1 = 2.0 * n_hits / (o.n_true + o.n_found);
  return o;
}

/// By pixels and by ellipses.
struct Overlaps {
  Overlap pixels, ellipses;
};

inline Overlaps overlaps_of(const Labels& truth, const images::Image& image, double pixel_um,
                            const cells::AdhesionParameters& p) {
  const FoundLabels found = found_labels(cells::find_adhesion_regions(image, pixel_um, p), image, pixel_um);
  return {overlap_of(truth, found.pixels), overlap_of(truth, found.ellipses)};
}

inline Overlaps hand_mask_overlaps(int image, const cells::AdhesionParameters& p = {}) {
  const std::string name = std::to_string(image) + ".tif";
  return overlaps_of(components_of(images::read_image(kHandMasks / "masks" / name)),
                     images::read_image(kHandMasks / "images" / name), kHandMasksPixel_um, p);
}

/// Of each found adhesion, its probability and whether a person has marked it.
inline std::vector<std::pair<double, bool>> hand_mask_existence(int image) {
  const std::string name = std::to_string(image) + ".tif";
  std::vector<Adhesion> marked;
  for (const auto& [label, pixels] : components_of(images::read_image(kHandMasks / "masks" / name)))
    if (pixels.size() >= 5) marked.push_back(cells::measure_ellipse(pixels, kHandMasksPixel_um));
  std::vector<std::pair<double, bool>> result;
  for (const Adhesion& a :
       cells::find_adhesions(images::read_image(kHandMasks / "images" / name), kHandMasksPixel_um, {}))
    result.emplace_back(a.probability.value(), is_true_adhesion(a, marked));
  return result;
}

inline Overlaps fibroblast_overlaps(const cells::AdhesionParameters& p = {}) {
  return overlaps_of(labels_of(images::read_image(kFibroblast / "adhesions.png")),
                     images::read_image(kFibroblast / "focal_image.png"), kFibroblastPixel_um, p);
}

/// Intersection over union of a mask's pixels and an outline.
inline double mask_overlap(const images::Image& mask, const Polygon& outline_um, double pixel_um) {
  int n_both = 0, n_either = 0;
  for (int row = 0; row < mask.height; ++row)
    for (int column = 0; column < mask.width; ++column) {
      const bool is_in = contains(outline_um, {(column + 0.5) * pixel_um, (row + 0.5) * pixel_um});
      n_both += is_in && mask.at(column, row) > 0;
      n_either += is_in || mask.at(column, row) > 0;
    }
  return 1.0 * n_both / std::max(1, n_either);
}

inline double doublet_overlap() {
  const Polygon outline =
      cells::find_cells(images::read_image(kDoublet / "actin.tif"), {}, kDoubletPixel_um, {}).cells.at(0).outer_um;
  return mask_overlap(images::read_image(kDoublet / "mask.tif"), outline, kDoubletPixel_um);
}

}  // namespace mbtfm::test
