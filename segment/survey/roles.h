/// Which image of a folder shows what, by its name.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace mbtfm::survey {

/// The names of a folder's visible TIFF, PNG and JPEG files, in capitals or not, in their order with numbers as
/// numbers.
std::vector<std::string> images_in(const std::filesystem::path& folder);
/// The same of the frames of a series. @throws InputError where there are none
std::vector<std::string> frames_in(const std::filesystem::path& folder);

struct Roles {
  std::map<std::string, std::string> files;  ///< by key of [images]: adhesion, actin, beads_stressed, beads_relaxed
  std::vector<std::string> unknown;          ///< names that show no role, or that several files share
};

/// A name shows its role by words that laboratories use ("cell3_paxillin.tif", "beads_after_trypsin.tif"). Where two
/// files fit a key, it stays open, and both are unknown. The only folder whose name speaks of beads or of times and
/// that has pictures has the stressed beads' frames.
Roles roles_of(const std::filesystem::path& folder);

}  // namespace mbtfm::survey
