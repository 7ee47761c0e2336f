#include "pipeline/charts/colour_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

namespace mbtfm::charts {
namespace {

constexpr std::array<Colour, 8> kPlasma = {{{13, 8, 135},
                                            {70, 3, 159},
                                            {114, 1, 168},
                                            {156, 23, 158},
                                            {189, 55, 134},
                                            {216, 87, 107},
                                            {237, 121, 83},
                                            {251, 159, 58}}};
constexpr std::array<Colour, 9> kViridis = {{{68, 1, 84},
                                             {71, 44, 122},
                                             {59, 81, 139},
                                             {44, 113, 142},
                                             {33, 144, 141},
                                             {39, 173, 129},
                                             {92, 200, 99},
                                             {170, 220, 50},
                                             {253, 231, 37}}};

std::span<const Colour> steps_of(ColourMap map) {
  return map == ColourMap::plasma ? std::span<const Colour>(kPlasma) : std::span<const Colour>(kViridis);
}

}  // namespace

std::vector<double> stops_of(ColourMap map) {
  const std::size_t n = steps_of(map).size();
  std::vector<double> stops;
  for (std::size_t i = 0; i < n; ++i) stops.push_back(static_cast<double>(i) / static_cast<double>(n - 1));
  return stops;
}

Colour colour_at(ColourMap map, double share) {
  const std::span<const Colour> steps = steps_of(map);
  const double at = std::clamp(share, 0.0, 1.0) * static_cast<double>(steps.size() - 1);
  const std::size_t i = std::min(steps.size() - 2, static_cast<std::size_t>(at));
  Colour mixed;
  for (std::size_t c = 0; c < 3; ++c)
    mixed[c] = steps[i][c] + (at - static_cast<double>(i)) * (steps[i + 1][c] - steps[i][c]);
  return mixed;
}

std::string hex(const Colour& colour) {
  std::string text = "#";
  for (const double c : colour) text += fmt::format("{:02x}", static_cast<int>(c));
  return text;
}

}  // namespace mbtfm::charts
