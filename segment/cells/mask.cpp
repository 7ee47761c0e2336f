#include "segment/cells/mask.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/ellipse.h"

namespace mbtfm::cells {
namespace {

std::string size_of(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height) + " pixels";
}

/// Where four sides meet on the mask's grid of corners.
struct Corner {
  int x = 0, y = 0;
  auto operator<=>(const Corner&) const = default;
};

constexpr std::array<Corner, 4> kSteps = {{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};  // each turns from +x towards +y

/// Sides of a label's pixels against others, by the corner they begin at: bit d, a step along kSteps[d], the label to
/// its right hand (y is down).
std::map<Corner, unsigned> sides_of(const LabelMask& mask, int label) {
  std::map<Corner, unsigned> sides;
  const auto is_in = [&](int i, int j) { return mask.at_or_zero(i, j) == label; };
  for (int j = 0; j < mask.height; ++j) {
    for (int i = 0; i < mask.width; ++i) {
      if (!is_in(i, j)) continue;
      if (!is_in(i, j - 1)) sides[{i, j}] |= 1u;
      if (!is_in(i + 1, j)) sides[{i + 1, j}] |= 2u;
      if (!is_in(i, j + 1)) sides[{i + 1, j + 1}] |= 4u;
      if (!is_in(i - 1, j)) sides[{i, j + 1}] |= 8u;
    }
  }
  return sides;
}

/// Follow the sides from one to the next. Where two pixels touch by a corner alone, the ring stays with its own pixel:
/// it turns right.
Polygon follow(std::map<Corner, unsigned>& sides) {
  Polygon ring;
  const Corner start = sides.begin()->first;
  int first = 0;
  while (!(sides.begin()->second >> first & 1u)) ++first;
  Corner at = start;
  int direction = first;
  while (true) {
    const auto here = sides.find(at);
    here->second &= ~(1u << direction);
    if (here->second == 0) sides.erase(here);
    const Corner step = kSteps[direction];
    ring.push_back({at.x + 0.5 * step.x, at.y + 0.5 * step.y});
    at = {at.x + step.x, at.y + step.y};
    const auto next = sides.find(at);
    const unsigned left = next == sides.end() ? 0u : next->second;
    for (const int turn : {1, 0, 3}) {  // right, straight on, left
      const int ahead = (direction + turn) % 4;
      if (at == start && ahead == first) return ring;  // round
      if (!(left >> ahead & 1u)) continue;
      direction = ahead;
      break;
    }
  }
}

/// As many points as the outline's spacing asks for; where the outline meets the image's border, and its corners, stay.
CutRing thinned(const CutRing& ring, int every, Vec2 field_um) {
  CutRing result;
  const std::size_t n = ring.points_um.size();
  const bool has_cut = !ring.is_cut.empty();
  const auto is_corner = [&](Vec2 p) { return (p.x <= 0 || p.x >= field_um.x) && (p.y <= 0 || p.y >= field_um.y); };
  int since = every;
  for (std::size_t i = 0; i < n; ++i) {
    const bool is_turn = has_cut && (ring.is_cut[i] != ring.is_cut[(i + n - 1) % n] || is_corner(ring.points_um[i]));
    if (!is_turn && ++since < every) continue;
    since = 0;
    result.points_um.push_back(ring.points_um[i]);
    if (has_cut) result.is_cut.push_back(ring.is_cut[i]);
  }
  return result;
}

Polygon in_um(const Polygon& ring_px, double pixel_um) {
  Polygon ring;
  for (const Vec2 p : ring_px) ring.push_back(pixel_um * p);
  return ring;
}

double pixel_of(const LabelMask& mask, const Field& field) { return field.pixel_um / mask.binning; }

int every_nth(std::size_t n_points, double pixel_um, double spacing_um) {
  constexpr double kStep = 0.85;    // of a pixel: a ring's points lie 0.7 to 1 apart
  constexpr int kFewestPoints = 8;  // of a small ring
  return std::clamp(static_cast<int>(spacing_um / (kStep * pixel_um)), 1,
                    std::max(1, static_cast<int>(n_points) / kFewestPoints));
}

/// The largest part of a label's pixels, with the holes that lie in it.
CellOutline outline_of(const LabelMask& mask, int label, const Field& field, const OutlineParameters& p) {
  const double pixel_um = pixel_of(mask, field);
  const Vec2 field_um{field.width_px * field.pixel_um, field.height_px * field.pixel_um};
  std::vector<Polygon> rings = rings_px(mask, label);
  const auto largest = std::max_element(rings.begin(), rings.end(), [](const Polygon& a, const Polygon& b) {
    return signed_area_um2(a) < signed_area_um2(b);
  });
  const Polygon outer = std::move(*largest);
  rings.erase(largest);
  CellOutline cell;
  cell.area_um2 = (signed_area_um2(outer) + 0.5) * pixel_um * pixel_um;
  const int every = every_nth(outer.size(), pixel_um, kOutlineSpacing_um);
  CutRing ring = thinned(cut_by_border(in_um(outer, pixel_um), field_um, pixel_um), every, field_um);
  cell.outer_um = std::move(ring.points_um);
  cell.is_cut = std::move(ring.is_cut);
  for (const Polygon& hole_px : rings) {
    const double area_um2 = (0.5 - signed_area_um2(hole_px)) * pixel_um * pixel_um;
    if (signed_area_um2(hole_px) > 0 || area_um2 < p.outline_smallest_hole_um2) continue;
    if (!contains(outer, hole_px.front())) continue;
    const double outer_px2 = signed_area_um2(outer), ring_px2 = outer_px2 + signed_area_um2(hole_px);
    if (2 * ring_px2 < std::min(outer_px2, kWidestLine_px * (length_um(outer) + length_um(hole_px))))
      throw InputError(mask.name, "a mask that covers the cell", "a ring, as of a drawn outline",
                       "fill it: in ImageJ, Process > Binary > Fill Holes");
    cell.area_um2 -= area_um2;
    cell.holes_um.push_back(
        thinned({in_um(hole_px, pixel_um), {}}, every_nth(hole_px.size(), pixel_um, kOutlineSpacing_um), field_um)
            .points_um);
  }
  return cell;
}

std::map<int, std::vector<CoveredPixel>> pixels_by_label(const LabelMask& mask) {
  std::map<int, std::vector<CoveredPixel>> pixels;
  for (int j = 0; j < mask.height; ++j)
    for (int i = 0; i < mask.width; ++i)
      if (const int label = mask.at(i, j); label != 0) pixels[label].push_back({i, j, 1, 0});
  return pixels;
}

/// Labels of the parts that are large enough for a cell, the largest first; of a label image those that are there.
std::vector<int> cells_in(const LabelMask& parts, const Field& field, const OutlineParameters& p) {
  std::map<int, int> n_pixels;
  for (const int label : parts.labels)
    if (label != 0) ++n_pixels[label];
  const double pixel_um2 = std::pow(pixel_of(parts, field), 2);
  std::vector<int> labels;
  for (const auto& [label, n] : n_pixels)
    if (n * pixel_um2 >= p.outline_smallest_um2) labels.push_back(label);
  std::stable_sort(labels.begin(), labels.end(), [&](int a, int b) { return n_pixels[a] > n_pixels[b]; });
  return labels;
}

void require_size_of_adhesion(const LabelMask& mask, const Adhesion& a) {
  constexpr double kLargest_um2 = 100;  // a small cell; the largest adhesions have 10
  if (a.area_um2 <= kLargest_um2) return;
  throw InputError(mask.name + ": part at (" + brief(a.position_um.x) + ", " + brief(a.position_um.y) + ") um",
                   "an adhesion, of at most " + shortest(kLargest_um2) + " um²", brief(a.area_um2) + " um²",
                   "a mask of the adhesive pattern goes with segment.adhesions = pattern, one of the cell is an "
                   "outline_mask; of adhesions, check pixel_size_um and that they do not touch each other");
}

std::string listed(std::vector<int> labels) {
  constexpr std::size_t kMost = 12;
  std::sort(labels.begin(), labels.end());
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, labels.size()); ++i)
    text += (i > 0 ? ", " : "") + std::to_string(labels[i]);
  return text + (labels.size() > kMost ? ", ..." : "");
}

}  // namespace

void require_size(const LabelMask& mask, const Field& field) {
  if (mask.width / mask.binning == field.width_px && mask.height / mask.binning == field.height_px) return;
  const std::string images = mask.binning == 1 ? size_of(field.width_px, field.height_px)
                                               : std::to_string(mask.binning) + " times " +
                                                     size_of(field.width_px, field.height_px) + ", before binning";
  throw InputError(mask.name, "a mask of the size of the images, " + images, size_of(mask.width, mask.height),
                   "was it made on a crop or a reduced copy of the image? Make it on the image itself");
}

void require_upright(const LabelMask& mask, const std::string& what) {
  const int right = mask.width - 1, bottom = mask.height - 1;
  for (const auto& [i, j] : {std::pair{0, 0}, {right, 0}, {0, bottom}, {right, bottom}})
    if (mask.at(i, j) == 0) return;
  throw InputError(
      mask.name, what + " on a background of 0", "values above 0 in all four corners of the image",
      "the mask seems inverted: in ImageJ, Edit > Invert; the background must look black, and transparency "
      "does not count");
}

void require_upright_pattern(const LabelMask& mask) {
  const int right = mask.width - 1, bottom = mask.height - 1;
  for (int i = 0; i <= right; ++i)
    if (mask.at(i, 0) == 0 || mask.at(i, bottom) == 0) return;
  for (int j = 0; j <= bottom; ++j)
    if (mask.at(0, j) == 0 || mask.at(right, j) == 0) return;
  throw InputError(mask.name, "a pattern on a background of 0", "values above 0 all along the border of the image",
                   "the mask seems inverted: in ImageJ, Edit > Invert; the background must look black. Where all of "
                   "the gel is adhesive, set segment.adhesions = cell");
}

PatternAtCell pattern_at(const LabelMask& pattern, const CellOutline& cell, const Field& field) {
  constexpr double kStep_um = 0.25;  // of the points that are looked at: a pattern's bars are some um wide
  const LabelMask parts = with_parts_labelled(pattern);
  const double pixel_um = pixel_of(parts, field);
  const int step = std::max(1, static_cast<int>(kStep_um / pixel_um));
  struct Part {
    double area_um2 = 0, beneath_um2 = 0;
    bool is_cut = false;
  };
  std::map<int, Part> by_label;
  for (int j = 0; j < parts.height; j += step)
    for (int i = 0; i < parts.width; i += step) {
      const int label = parts.at(i, j);
      if (label == 0) continue;
      const double area_um2 = std::pow(step * pixel_um, 2);
      Part& part = by_label[label];
      part.area_um2 += area_um2;
      if (is_in_cell(cell, {(i + 0.5) * pixel_um, (j + 0.5) * pixel_um})) part.beneath_um2 += area_um2;
      part.is_cut = part.is_cut || i < step || j < step || i + step >= parts.width || j + step >= parts.height;
    }
  double area_um2 = 0, beneath_um2 = 0, on_um2 = 0;
  std::vector<double> parts_um2;
  for (const auto& [label, part] : by_label) {
    if (part.beneath_um2 == 0) continue;
    on_um2 += part.beneath_um2;
    parts_um2.push_back(part.area_um2);
    if (part.is_cut || part.area_um2 > 2 * cell.area_um2) continue;
    area_um2 += part.area_um2;
    beneath_um2 += part.beneath_um2;
  }
  return {.beneath = area_um2 > 0 ? std::optional(beneath_um2 / area_um2) : std::nullopt,
          .of_cell = cell.area_um2 > 0 ? on_um2 / cell.area_um2 : 0,
          .part_area_um2 = parts_um2.empty() ? 0 : numerics::median_in(parts_um2)};
}

LabelMask with_parts_labelled(LabelMask mask) {
  if (!mask.is_binary) return mask;
  std::vector<int>& labels = mask.labels;
  for (int& label : labels) label = label == 0 ? 0 : -1;
  int n_parts = 0;
  std::vector<std::size_t> open;
  const auto width = static_cast<std::size_t>(mask.width);
  for (std::size_t first = 0; first < labels.size(); ++first) {
    if (labels[first] != -1) continue;
    labels[first] = ++n_parts;
    open.push_back(first);
    while (!open.empty()) {
      const std::size_t k = open.back();
      open.pop_back();
      const auto visit = [&](std::size_t other) {
        if (labels[other] != -1) return;
        labels[other] = n_parts;
        open.push_back(other);
      };
      if (k % width > 0) visit(k - 1);
      if (k % width + 1 < width) visit(k + 1);
      if (k >= width) visit(k - width);
      if (k + width < labels.size()) visit(k + width);
    }
  }
  mask.is_binary = n_parts == 1;
  return mask;
}

bool covers(const LabelMask& mask, Vec2 point_um, const Field& field) {
  const double pixel_um = pixel_of(mask, field);
  return mask.at_or_zero(static_cast<int>(std::floor(point_um.x / pixel_um)),
                         static_cast<int>(std::floor(point_um.y / pixel_um))) != 0;
}

std::vector<Polygon> rings_px(const LabelMask& mask, int label) {
  std::map<Corner, unsigned> sides = sides_of(mask, label);
  std::vector<Polygon> rings;
  while (!sides.empty()) rings.push_back(follow(sides));
  return rings;
}

std::vector<CellOutline> mask_outlines(const LabelMask& mask, int cell, const Field& field,
                                       const OutlineParameters& p) {
  require_size(mask, field);
  require_upright(mask, "a cell");
  const LabelMask parts = with_parts_labelled(mask);
  const std::vector<int> labels = cells_in(parts, field, p);
  if (labels.empty())
    throw InputError(mask.name, "a cell of " + shortest(p.outline_smallest_um2) + " um² or more", "smaller parts only",
                     "check pixel_size_um and outline_smallest_um2");
  std::vector<CellOutline> outlines;
  if (cell == 0) {
    for (const int label : labels) outlines.push_back(outline_of(parts, label, field, p));
    return outlines;
  }
  if (mask.is_binary && cell > static_cast<int>(labels.size()))
    throw InputError(mask.name, "cell " + std::to_string(cell), std::to_string(labels.size()) + " in all",
                     "cells that touch count as one: a label image separates them");
  const int label = mask.is_binary ? labels[cell - 1] : cell;
  if (std::ranges::find(labels, label) == labels.end())
    throw InputError(mask.name, "a cell with label " + std::to_string(label), "labels " + listed(labels),
                     "choose the cell by its label: segment.cell = " + std::to_string(labels.front()));
  return {outline_of(parts, label, field, p)};
}

int n_cells_in(const LabelMask& mask, const Field& field, const OutlineParameters& p) {
  return static_cast<int>(cells_in(with_parts_labelled(mask), field, p).size());
}

std::vector<Adhesion> mask_adhesions(const LabelMask& mask, const std::optional<images::Channel>& adhesion,
                                     const Field& field) {
  require_size(mask, field);
  require_upright(mask, "adhesions");
  const LabelMask parts = with_parts_labelled(mask);
  std::vector<Adhesion> adhesions;
  for (auto& [label, pixels] : pixels_by_label(parts)) {
    for (CoveredPixel& pixel : pixels) {
      const int i = pixel.column / mask.binning, j = pixel.row / mask.binning;
      const bool is_seen = adhesion && i < adhesion->image.width && j < adhesion->image.height;
      pixel.intensity = is_seen ? adhesion->image.at(i, j) : 0;
    }
    Adhesion a = measure_ellipse(pixels, pixel_of(mask, field));
    require_size_of_adhesion(mask, a);
    a.adhesion_id = static_cast<int>(adhesions.size()) + 1;
    const auto is_free = [&](int i, int j, Vec2) {
      const int middle = mask.binning / 2;
      return parts.at_or_zero(i * mask.binning + middle, j * mask.binning + middle) == 0;
    };
    if (adhesion) a.mean_intensity -= level_around(a, adhesion->image, field.pixel_um, is_free).value_or(0);
    adhesions.push_back(a);
  }
  return adhesions;
}

}  // namespace mbtfm::cells
