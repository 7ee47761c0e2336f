/// One image laid onto another by what it shows: for cells whose outline says little, as colonies in phase contrast.
#pragma once

#include <vector>

#include "mbtfm/mean/registration.h"

namespace mbtfm::mean {

/// Square pixels, row by row.
struct Brightness {
  int width = 0, height = 0;
  double pixel_size_um = 0;
  std::vector<float> values;
};

/// The ways that fit best, the best first, without their outlines' misfit. The image is laid onto the reference at 120
/// angles, each where their correlation is largest; from the largest of these, shift and angle are refined so that the
/// difference of the images, up to gain and offset, is least. Source: Evangelidis, Psarakis, IEEE PAMI 30 (2008) 1858
/// (the measure).
std::vector<Way> ways_by_images(const Brightness& image, const Brightness& reference, Mirrors mirrors);

/// As fit_equally, of what the correlation leaves unexplained.
bool correlate_equally(const Way& a, const Way& b);

}  // namespace mbtfm::mean
