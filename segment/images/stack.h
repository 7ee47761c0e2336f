/// Which page of a file shows which channel, slice and frame.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "segment/images/image.h"

namespace mbtfm::images {

/// The dimensions of a file and where its planes are. A plane's number is (frame * n_slices + slice) * n_channels +
/// channel, all from 0.
struct Stack {
  int n_channels = 1, n_slices = 1, n_frames = 1;
  std::vector<std::string> channel_names;  ///< one a channel; empty where it has none
  std::vector<std::optional<int>> pages;   ///< by plane; none: it is in another file, or was never recorded
};

/// A file as it lies on the disk.
struct FileOfPages {
  std::string name;  ///< without its folder, to tell it from the others of an OME set
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
