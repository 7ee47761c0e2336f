#include "segment/segment_cell.h"

#include <cmath>

#include "pipeline/contract/errors.h"

namespace mbtfm::segment {

void declare(ParameterList& list, SegmentParameters& p) {
  list.table("");
  list.add("pixel_size_um", p.pixel_size_um, Range::positive(),
           "side of a pixel in the specimen (um); unset: from the image's own calibration");
  list.table("segment");
  declare(list, p.adhesion_plane, "adhesion", "the adhesion image");
  declare(list, p.actin_plane, "actin", "the actin image");
  list.add("contact_sheet", p.contact_sheet,
           "draw contact_sheet.png, overlays over the values of one or two of these parameters: name=a,b,c name=d,e");
  declare(list, p.adhesions);
  declare(list, p.fibres);
  declare(list, p.outline);
}

Segmentation segment_cell(const std::optional<Channel>& adhesion, const std::optional<Channel>& actin,
                          const SegmentParameters& p, const HandDrawn& drawn) {
  if (!adhesion && !actin) throw UsageError("an adhesion image or an actin image is needed, best both");
  Segmentation result;
  const Channel &first = adhesion ? *adhesion : *actin, &second = actin ? *actin : *adhesion;
  require_equal_sizes(first, second);
  result.pixel_size_um = common_pixel_size_um(first, second, p.pixel_size_um);
  const double pixel_um = result.pixel_size_um;
  const Field field{first.image.width, first.image.height, pixel_um};
  std::vector<Adhesion> found;
  if (drawn.adhesions) {
    found = hand_drawn_adhesions(*drawn.adhesions, adhesion, field);
  } else if (adhesion) {
    found = find_adhesions(adhesion->image, pixel_um, p.adhesions);
    if (found.empty())
      throw InputError(adhesion->name,
                       "bright spots of " + std::to_string(p.adhesions.adhesion_smallest_um2) +
                           " um² or more that stand out of the noise",
                       "no adhesion",
                       "is this the adhesion channel, in focus? Check pixel_size_um (" + in_um(pixel_um) +
                           "), adhesion_channel, and adhesion_seed_noise for a faint image");
  }
  const Channel& shape = actin ? *actin : *adhesion;
  result.cell.outline_um =
      drawn.outline ? hand_drawn_outline(*drawn.outline, field) : find_outline(shape.image, found, pixel_um, p.outline);
  if (result.cell.outline_um.empty())
    throw InputError(
        shape.name, "a cell brighter than its surroundings", "no cell",
        "is this the right channel and page? Check pixel_size_um (" + in_um(pixel_um) + ") and outline_smallest_um2");
  result.cell.adhesions = inside(result.cell.outline_um, found);
  result.n_adhesions_outside = static_cast<int>(found.size() - result.cell.adhesions.size());
  if (!found.empty() && result.cell.adhesions.empty())
    throw InputError(drawn.adhesions ? drawn.adhesions->name : adhesion->name, "adhesions inside the cell's outline",
                     std::to_string(found.size()) + " outside and none inside",
                     "do both channels show the same cell at the same place?");
  if (drawn.fibres)
    result.cell.fibres = hand_drawn_fibres(*drawn.fibres, result.cell.adhesions, actin, field, p.fibres);
  else if (actin)
    result.cell.fibres = find_fibres(actin->image, result.cell.outline_um, result.cell.adhesions, pixel_um, p.fibres);
  return result;
}

}  // namespace mbtfm::segment
