/// The plan of a cell in space as pictures and as a page that stands alone.
#pragma once

#include <string>

namespace mbtfm::plan {

struct SpacePlan;

std::string svg_of(const SpacePlan& plan);
std::string html_of(const SpacePlan& plan);

}  // namespace mbtfm::plan
