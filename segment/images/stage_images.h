/// Images as a stage reads them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "pipeline/stage/stage.h"
#include "segment/images/channels.h"

namespace mbtfm::images {

/// An image of a stage: its scan phase is taken off, and noticed, before it is binned.
/// @param binning  side of the blocks of pixels that are averaged; 1: none
Channel read_channel(const std::string& name, const std::filesystem::path& file, const PlaneChoice& plane, int binning,
                     stage::StageContext& context);
/// Notice what noticed_in() finds, and doubt the pixel size that was given for it.
void notice_image(const Channel& channel, std::optional<double> given_um, stage::StageContext& context);

}  // namespace mbtfm::images
