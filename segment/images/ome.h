/// The OME-XML in a TIFF's ImageDescription: which page shows which channel, slice and frame, and the pixel size.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mbtfm::images {

/// A TiffData element: `n_planes` pages from `first_page` on show the planes from this channel, slice and frame on.
struct OmePages {
  int first_page = 0;
  int first_channel = 0, first_slice = 0, first_frame = 0;
  std::optional<int> n_planes;  ///< none: all that follow
  std::string uuid, file_name;  ///< of the file that holds them; empty: this one
};

/// The first image of an OME-XML, as far as it says.
struct OmeImage {
  std::string uuid;             ///< of this file
  std::string order = "XYCZT";  ///< which dimension runs fastest
  int width = 0, height = 0;    ///< pixels; 0: not given
  int n_channels = 1, n_slices = 1, n_frames = 1;
  std::vector<std::string> channel_names;                      ///< empty where one has none
  std::vector<OmePages> pages;                                 ///< none: all pages in order
  std::string size_x, unit_x, size_y, unit_y, size_z, unit_z;  ///< PhysicalSizeX, …; empty: not given
  std::string companion;  ///< the file that holds the metadata in this one's stead; empty: none
};

bool is_ome(std::string_view description);

/// Source: OME-TIFF specification, docs.openmicroscopy.org/ome-model/6.3. Text that claims to be UTF-8 and is not is
/// read as Latin-1, as old programs wrote µ.
/// @throws InvalidData where it is no well-formed XML or a number in it is none
OmeImage parse_ome(const std::string& xml);

}  // namespace mbtfm::images
