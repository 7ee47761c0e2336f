/// A cell.toml from what the files of a folder say, with notes on what is to be completed.
#pragma once

#include <filesystem>
#include <string>

namespace mbtfm::survey {

struct Written {
  std::string text, open;  ///< of cell.toml; what is to be completed
};
Written cell_toml(const std::filesystem::path& folder);

}  // namespace mbtfm::survey
