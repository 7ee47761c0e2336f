/// Masks and label images, as Cellpose, StarDist, ilastik, napari and ImageJ write them: what belongs to the cell,
/// where its adhesions are, or where they may be.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "segment/cells/hand_drawn.h"
#include "segment/cells/outline.h"
#include "segment/images/channels.h"

namespace mbtfm::cells {

/// Whole numbers by pixel, row by row from the top; 0 is the background. It lies on the images as they are, not binned.
struct LabelMask {
  std::string name;
  int width = 0, height = 0;
  std::vector<int> labels;
  bool is_binary = false;  ///< one value beside 0: parts are separated by their place
  int binning = 1;         ///< pixels of the mask a side of one of the images'
  std::string taken = {};  ///< which plane, if the file has several
  int at(int column, int row) const { return labels[static_cast<std::size_t>(row) * width + column]; }
  int at_or_zero(int column, int row) const {
    return column < 0 || row < 0 || column >= width || row >= height ? 0 : at(column, row);
  }
};

inline constexpr int kWidestLine_px = 15;  ///< that a hand draws around a cell

/// TIFF (8, 16 or 32 bit, integers or floats that are whole) or PNG; white-is-zero as in images: what looks dark is 0.
/// In a file without 0 the value of all four corners is the background's.
/// @throws InputError where a value is no whole number >= 0, nothing is above 0, or the file is lossy
LabelMask read_mask(const std::filesystem::path& file);
LabelMask mask_of(const images::Image& image, const std::string& name);

/// @throws InputError with both sizes where it does not lie on an image of this size
void require_size(const LabelMask& mask, const Field& field);
/// @throws InputError where all four corners belong to it: the mask is inverted
void require_upright(const LabelMask& mask, const std::string& what);

/// A pattern may reach the corners, as lines do. @throws InputError where none of the background reaches the image's
/// border: the mask is inverted
void require_upright_pattern(const LabelMask& mask);

/// The parts of a binary mask whose pixels hang together by their sides, as labels in the order of their first pixel;
/// a label image as it is.
LabelMask with_parts_labelled(LabelMask mask);

/// Does the mask have a label there?
bool covers(const LabelMask& mask, Vec2 point_um, const Field& field);

/// A pattern and the cell on it.
struct PatternAtCell {
  /// Share of the pattern that lies beneath the cell, of the parts that it touches. Parts that the image cuts or that
  /// are larger than two cells are made for more than this cell. None without others.
  std::optional<double> beneath;
  double of_cell = 0;        ///< share of the cell's area that lies on it
  double part_area_um2 = 0;  ///< median of the parts that the cell touches; 0: none
};
PatternAtCell pattern_at(const LabelMask& pattern, const CellOutline& cell, const Field& field);

/// Rings around a label's pixels, in pixels: through the middles of the pixels' sides, so that a ring around n pixels
/// has an area of n - 1/2, whatever its direction. Outer rings turn from +x towards +y, holes back.
std::vector<Polygon> rings_px(const LabelMask& mask, int label);

/// The cells of a mask: of a binary one its parts, the largest first, or the part that `cell` names; of a label image
/// the label that `cell` names; of 0 all. Specks and holes smaller than the parameters say are left out: a mask is made
/// by a program, and single pixels mean nothing.
/// @throws InputError where none is left, or the label is not there
std::vector<CellOutline> mask_outlines(const LabelMask& mask, int cell, const Field& field,
                                       const OutlineParameters& parameters);
int n_cells_in(const LabelMask& mask, const Field& field, const OutlineParameters& parameters);

/// Each label, or part of a binary mask, as the ellipse of its pixels' second moments; `mean_intensity` as of adhesions
/// drawn by hand. Ids from 1, in the order of the labels, or of the parts' first pixels.
/// @throws InputError where a part is as large as a cell: it shows the cell, or the pattern beneath it
std::vector<Adhesion> mask_adhesions(const LabelMask& mask, const std::optional<images::Channel>& adhesion,
                                     const Field& field);

}  // namespace mbtfm::cells
