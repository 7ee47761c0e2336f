/// Which page of a file shows which channel, slice and frame, by the OME-XML in its ImageDescription or by ImageJ.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "segment/images/image.h"

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
  int n_images = 0;                                            ///< of which all else here is the first
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

/// The dimensions of a file and where its planes are. A plane's number is (frame * n_slices + slice) * n_channels +
/// channel, all from 0.
struct Stack {
  int n_channels = 1, n_slices = 1, n_frames = 1;
  std::vector<std::string> channel_names;  ///< one a channel; empty where it has none
  std::vector<std::optional<int>> pages;   ///< by plane; none: it is in another file, or was never recorded
};

/// A file as it lies on the disk.
struct FileOfPages {
  std::string name;  ///< without its folder, to distinguish it from the others of an OME set
  int n_pages = 1;
};

inline const std::vector<std::string> kRgbNames = {"red", "green", "blue"};

/// What the description says: OME-XML or ImageJ's list. None where it says nothing of dimensions.
///
/// Files are renamed, and their OME-XML keeps the old names: a file whose pages are as many as the planes, or as those
/// of one of the files named and of no other, is meant. Series are aborted: planes beyond the file's last page are not
/// there. A stack of ImageJ's with an interval between its images and no distance of slices is one of frames.
/// @throws InvalidData where it contradicts itself
std::optional<Stack> stack_of(const std::string& description, const FileOfPages& file);

/// The number of images that ImageJ says it wrote; 1 where it does not say. It writes more than 4 GB as one page with
/// the planes one after the other.
int n_imagej_images(const std::string& description);

/// The pages, from 0, that the choice means: one, or those of all slices to be projected.
/// @throws InputError where several channels or frames are there and none was chosen, or the one chosen is not there
std::vector<int> chosen_pages(const Stack& stack, const PlaneChoice& choice, const std::string& file);

/// The index of a channel by its number from 1 or its name, in full or but for capitals.
/// @throws InputError listing them where there is no such channel, or several and none was chosen
int chosen_channel(const std::vector<std::string>& names, const PlaneChoice& choice, const std::string& file);

}  // namespace mbtfm::images
