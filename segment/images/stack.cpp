#include "segment/images/stack.h"

#include <algorithm>
#include <cstdlib>
#include <map>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/parsed.h"
#include "pipeline/files/names.h"
#include "segment/images/image_file.h"

namespace mbtfm::images {
namespace {

constexpr long long kMostPlanes = 1 << 22;  // beyond any file's; keeps a damaged count from taking memory

/// The planes' numbers in the order in which a file stores them.
std::vector<int> stored_order(const Stack& s, const std::string& order) {
  // the dimensions from the fastest: their sizes, and how far a step of them moves in the plane's number
  std::vector<int> sizes, steps;
  for (const char axis : order.substr(2)) {
    sizes.push_back(axis == 'C' ? s.n_channels : axis == 'Z' ? s.n_slices : s.n_frames);
    steps.push_back(axis == 'C' ? 1 : axis == 'Z' ? s.n_channels : s.n_channels * s.n_slices);
  }
  std::vector<int> planes;
  for (int k = 0; k < sizes[2]; ++k)
    for (int j = 0; j < sizes[1]; ++j)
      for (int i = 0; i < sizes[0]; ++i) planes.push_back(i * steps[0] + j * steps[1] + k * steps[2]);
  return planes;
}

void require_plausible_dimensions(const Stack& s) {
  const long long n = static_cast<long long>(s.n_channels) * s.n_slices;
  if (n <= kMostPlanes && n * s.n_frames <= kMostPlanes) return;
  throw InvalidData("the image's dimensions", "at most " + std::to_string(kMostPlanes) + " planes",
                    std::to_string(s.n_channels) + " channels, " + std::to_string(s.n_slices) + " slices, " +
                        std::to_string(s.n_frames) + " frames");
}

bool is_of_this_file(const OmePages& p, const OmeImage& ome, const std::string& file_name) {
  return (p.uuid.empty() && p.file_name.empty()) || (!p.uuid.empty() && p.uuid == ome.uuid) || p.file_name == file_name;
}

/// The TiffData of the planes in this file; nothing: its pages are the planes in the order stored.
std::vector<OmePages> pages_here(const OmeImage& ome, int n_planes, const FileOfPages& file) {
  std::vector<OmePages> here;
  std::map<std::string, std::vector<OmePages>> by_file;
  for (const OmePages& p : ome.pages) {
    if (is_of_this_file(p, ome, file.name)) here.push_back(p);
    by_file[p.file_name.empty() ? p.uuid : p.file_name].push_back(p);
  }
  if (!here.empty() || ome.pages.empty()) return here;
  if (by_file.size() == 1) return by_file.begin()->second;
  if (file.n_pages >= n_planes) return {};
  const auto has_as_many = [&](const auto& of_file) {
    int n = 0;
    for (const OmePages& p : of_file.second) n += p.n_planes.value_or(n_planes);
    return n == file.n_pages;
  };
  if (std::ranges::count_if(by_file, has_as_many) == 1) return std::ranges::find_if(by_file, has_as_many)->second;
  std::string names;
  for (const auto& [name, pages] : by_file)
    if (names.size() < 100) names += (names.empty() ? "" : ", ") + name;
  throw InvalidData("OME-XML", "planes of this file", "those of " + names + ", with other names");
}

Stack stack_of_ome(const OmeImage& ome, const FileOfPages& file) {
  Stack s{.n_channels = ome.n_channels,
          .n_slices = ome.n_slices,
          .n_frames = ome.n_frames,
          .channel_names = ome.channel_names,
          .pages = {}};
  s.channel_names.resize(static_cast<std::size_t>(s.n_channels));
  require_plausible_dimensions(s);
  std::string axes = ome.order;
  std::sort(axes.begin(), axes.end());
  if (axes != "CTXYZ" || !ome.order.starts_with("XY"))
    throw InvalidData("OME-XML", "DimensionOrder of X, Y and C, Z, T", "'" + ome.order + "'");
  const std::vector<int> planes = stored_order(s, ome.order);
  s.pages.assign(planes.size(), std::nullopt);
  const auto put = [&](int plane, int page) {
    if (page < file.n_pages) s.pages[plane] = page;
  };
  const std::vector<OmePages> here = pages_here(ome, static_cast<int>(planes.size()), file);
  if (here.empty()) {
    for (std::size_t i = 0; i < planes.size(); ++i) put(planes[i], static_cast<int>(i));
    return s;
  }
  std::vector<std::size_t> place_of(planes.size());  // of a plane in the order stored
  for (std::size_t i = 0; i < planes.size(); ++i) place_of[planes[i]] = i;
  std::size_t n_assigned = 0;
  for (const OmePages& p : here) {
    if (p.first_channel >= s.n_channels || p.first_slice >= s.n_slices || p.first_frame >= s.n_frames)
      throw InvalidData("OME-XML", "TiffData of a plane that is there", "one beyond the dimensions");
    const int first = (p.first_frame * s.n_slices + p.first_slice) * s.n_channels + p.first_channel;
    int page = p.first_page;
    std::size_t at = place_of[first];
    for (int n = 0; at < planes.size() && (!p.n_planes || n < *p.n_planes); ++n) {
      // a plane may be listed twice; a damaged file lists all of them over and over
      if (++n_assigned > 2 * planes.size())
        throw InvalidData("OME-XML", "TiffData that tell of each plane once", "the same planes over and over");
      put(planes[at++], page++);
    }
  }
  return s;
}

bool positive(const std::optional<std::string_view>& number) {
  return number && !number->empty() && std::atof(std::string(*number).c_str()) > 0;
}

/// Channels run fastest, then slices (ij.io.FileSaver). Without dimensions a stack's images are slices, as ImageJ takes
/// them.
std::optional<Stack> stack_of_imagej(const std::string& description) {
  const auto count = [&](const char* key) {
    const auto text = line_value(description, key);
    const auto n = text ? parsed<int>(*text) : std::optional(1);
    if (!n || *n < 1)
      throw InvalidData("ImageJ's description", "a number >= 1 of " + std::string(key), "'" + std::string(*text) + "'");
    return *n;
  };
  Stack s{.n_channels = count("channels"),
          .n_slices = count("slices"),
          .n_frames = count("frames"),
          .channel_names = {},
          .pages = {}};
  const int n_images = count("images");
  require_plausible_dimensions(s);
  int n = s.n_channels * s.n_slices * s.n_frames;
  const bool has_times = positive(line_value(description, "finterval")) && !line_value(description, "spacing");
  if (n == 1) n = (has_times ? s.n_frames : s.n_slices) = n_images;
  if (n > 1 && has_times && s.n_frames == 1) std::swap(s.n_frames, s.n_slices);
  require_plausible_dimensions(s);
  if (n != n_images) {
    throw InvalidData("ImageJ's description", "images to be channels x slices x frames = " + std::to_string(n),
                      std::to_string(n_images));
  }
  if (n == 1) return std::nullopt;
  s.channel_names.resize(static_cast<std::size_t>(s.n_channels));
  s.pages.resize(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) s.pages[i] = i;
  return s;
}

std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kMostListed = 40;  // a damaged file claims millions
  std::string list = std::to_string(names.size()) + " channel" + (names.size() == 1 ? "" : "s");
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i == kMostListed) return list + ", …";
    list += (i == 0 ? ": " : ", ") + std::to_string(i + 1);
    if (!names[i].empty()) list += " '" + names[i] + "'";
  }
  return list;
}

/// How many frames are in the file, from the first on: less than it states where the recording was aborted.
int n_recorded(const Stack& s) {
  const int n_of_frame = s.n_slices * s.n_channels;
  const auto last = std::find_if(s.pages.rbegin(), s.pages.rend(), [](const auto& page) { return page.has_value(); });
  return std::max(1, (static_cast<int>(s.pages.rend() - last) + n_of_frame - 1) / n_of_frame);
}

int chosen_frame(const Stack& s, const PlaneChoice& choice, const std::string& file) {
  const int n = n_recorded(s);
  const std::string hint = "set " + choice.prefix + "_time to a number from 1 to " + std::to_string(n);
  const std::string found =
      counted(n, "frames") + (n < s.n_frames ? " of the " + std::to_string(s.n_frames) + " that it states" : "");
  if (!choice.time && n > 1) throw InputError(file, "the frame to be chosen", found, hint);
  const int frame = choice.time.value_or(1);
  if (frame > n) throw InputError(file, "frame " + std::to_string(frame), found, hint);
  return frame - 1;
}

}  // namespace

std::optional<Stack> stack_of(const std::string& description, const FileOfPages& file) {
  if (is_ome(description)) {
    const OmeImage ome = parse_ome(description);
    if (ome.companion.empty()) return stack_of_ome(ome, file);
    throw InvalidData("OME-XML", "the dimensions in the file itself", "a reference to " + ome.companion);
  }
  if (description.starts_with("ImageJ=")) return stack_of_imagej(description);
  return std::nullopt;
}

int n_imagej_images(const std::string& description) {
  if (!description.starts_with("ImageJ=")) return 1;
  return std::max(1, parsed<int>(line_value(description, "images").value_or("1")).value_or(1));
}

int chosen_channel(const std::vector<std::string>& names, const PlaneChoice& choice, const std::string& file) {
  const std::string& wanted = choice.channel;
  const std::string hint = "set " + choice.prefix + "_channel to the number or name of one";
  if (wanted.empty()) {
    if (names.size() == 1) return 0;
    throw InputError(file, "the channel to be chosen", listed(names), hint);
  }
  for (const bool is_exact : {true, false}) {
    const auto is_it = [&](const std::string& name) {
      return !name.empty() && (is_exact ? name == wanted : files::lower_case(name) == files::lower_case(wanted));
    };
    if (std::count_if(names.begin(), names.end(), is_it) == 1)
      return static_cast<int>(std::find_if(names.begin(), names.end(), is_it) - names.begin());
  }
  const auto number = parsed<int>(wanted);
  if (number && *number >= 1 && *number <= static_cast<int>(names.size())) return *number - 1;
  throw InputError(file, "channel '" + wanted + "'", listed(names), hint);
}

std::vector<int> chosen_pages(const Stack& s, const PlaneChoice& choice, const std::string& file) {
  const int channel = chosen_channel(s.channel_names, choice, file), frame = chosen_frame(s, choice, file);
  int low = 0, high = s.n_slices;
  if (choice.z != kProjection) {
    const auto slice = parsed<int>(choice.z);
    if (!slice || *slice < 1 || *slice > s.n_slices) {
      throw InputError(file, "slice '" + choice.z + "'",
                       std::to_string(s.n_slices) + " slice" + (s.n_slices == 1 ? "" : "s"),
                       "set " + choice.prefix + "_z to a number from 1, or to max for the maximum projection");
    }
    low = *slice - 1;
    high = *slice;
  }
  std::vector<int> pages;
  for (int slice = low; slice < high; ++slice) {
    const auto page = s.pages[(frame * s.n_slices + slice) * s.n_channels + channel];
    if (!page) {
      throw InputError(file, "all planes of an OME-TIFF in one file", "this one in another file of the set, or nowhere",
                       "give the file that holds it, or export the image as one file; if the recording was aborted, "
                       "choose a plane that is there (" +
                           choice.prefix + "_z, " + choice.prefix + "_time)");
    }
    pages.push_back(*page);
  }
  std::vector<int> sorted = pages;
  std::ranges::sort(sorted);
  if (std::ranges::adjacent_find(sorted) != sorted.end())
    throw InputError(file, "a page of its own for each slice", "the same page for several");
  return pages;
}

}  // namespace mbtfm::images
