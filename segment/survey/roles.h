/// Which image of a folder shows what, by its name.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace mbtfm::survey {

struct Roles {
  std::map<std::string, std::string> files;  ///< by key of [images]: adhesion, actin, beads_stressed, beads_relaxed
  std::vector<std::string> unknown;          ///< names that tell nothing, or that several files share
};

/// A name tells by the words that laboratories use in it ("cell3_paxillin.tif", "beads_after_trypsin.tif"). Where two
/// files fit a key, it stays open, and both are unknown.
Roles roles_of(const std::vector<std::string>& names);

}  // namespace mbtfm::survey
