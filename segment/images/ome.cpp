#include <pugixml.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/parsed.h"
#include "pipeline/files/names.h"
#include "segment/images/stack.h"

namespace mbtfm::images {
namespace {

using pugi::xml_node;

/// Whatever prefix it has: ome:Pixels is Pixels.
bool is_called(const xml_node& node, std::string_view name) {
  const std::string_view whole = node.name();
  return whole == name || whole.ends_with(":" + std::string(name));
}

/// The first of that name below it; none: it has no attributes and nothing below it.
xml_node first_below(const xml_node& parent, std::string_view name) {
  return parent.find_node([&](const xml_node& node) { return is_called(node, name); });
}

/// @throws InvalidData where it is none, or out of range
int number(const xml_node& element, const char* name, int otherwise, int lowest) {
  const pugi::xml_attribute attribute = element.attribute(name);
  if (!attribute) return otherwise;
  const std::string text = attribute.value();
  const auto value = parsed<int>(text);
  constexpr int kLargest = 1 << 22;  // planes: beyond any file's
  if (value && *value >= lowest && *value <= kLargest) return *value;
  throw InvalidData("OME-XML", "a whole number in its range", name + ("=\"" + text + "\""));
}

OmePages pages_of(const xml_node& tiff_data) {
  const bool has_count = tiff_data.attribute("PlaneCount"), has_page = tiff_data.attribute("IFD");
  const xml_node uuid = first_below(tiff_data, "UUID");
  return {.first_page = number(tiff_data, "IFD", 0, 0),
          .first_channel = number(tiff_data, "FirstC", 0, 0),
          .first_slice = number(tiff_data, "FirstZ", 0, 0),
          .first_frame = number(tiff_data, "FirstT", 0, 0),
          .n_planes = has_count || has_page ? std::optional(number(tiff_data, "PlaneCount", 1, 0)) : std::nullopt,
          .uuid = uuid.child_value(),
          .file_name = uuid.attribute("FileName").value()};
}

void read_pixels(const xml_node& pixels, OmeImage& image) {
  const auto text = [&](const char* name) { return std::string(pixels.attribute(name).value()); };
  image.width = number(pixels, "SizeX", 0, 1);
  image.height = number(pixels, "SizeY", 0, 1);
  image.n_channels = number(pixels, "SizeC", 1, 1);
  image.n_slices = number(pixels, "SizeZ", 1, 1);
  image.n_frames = number(pixels, "SizeT", 1, 1);
  if (const std::string order = text("DimensionOrder"); !order.empty()) image.order = order;
  image.size_x = text("PhysicalSizeX");
  image.unit_x = text("PhysicalSizeXUnit");
  image.size_y = text("PhysicalSizeY");
  image.unit_y = text("PhysicalSizeYUnit");
  image.size_z = text("PhysicalSizeZ");
  image.unit_z = text("PhysicalSizeZUnit");
  int n_samples = 0;  // of all channels: an RGB channel has three
  for (const xml_node& part : pixels) {
    if (is_called(part, "TiffData")) image.pages.push_back(pages_of(part));
    if (!is_called(part, "Channel")) continue;
    image.channel_names.push_back(part.attribute("Name").value());
    n_samples += number(part, "SamplesPerPixel", 1, 1);
  }
  // SizeC counts samples: channels of several share a page
  const auto n_named = static_cast<int>(image.channel_names.size());
  if (n_named > 0 && n_samples == image.n_channels) image.n_channels = n_named;
  image.channel_names.resize(static_cast<std::size_t>(image.n_channels));
}

}  // namespace

bool is_ome(std::string_view description) {
  return description.find("<OME") != std::string_view::npos || description.find(":OME ") != std::string_view::npos;
}

OmeImage parse_ome(const std::string& xml) {
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(
      xml.data(), xml.size(), pugi::parse_default, files::is_utf8(xml) ? pugi::encoding_auto : pugi::encoding_latin1);
  if (!parsed) throw InvalidData("OME-XML", "well-formed XML", parsed.description());
  OmeImage image;
  image.uuid = first_below(document, "OME").attribute("UUID").value();
  image.companion = first_below(document, "BinaryOnly").attribute("MetadataFile").value();
  for (const xml_node& node : first_below(document, "OME")) image.n_images += is_called(node, "Image");
  if (const xml_node pixels = first_below(document, "Pixels")) read_pixels(pixels, image);
  return image;
}

}  // namespace mbtfm::images
