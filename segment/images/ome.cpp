#include "segment/images/stack.h"

#include <expat.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <memory>
#include <type_traits>

#include "pipeline/contract/errors.h"

namespace mbtfm::images {
namespace {

using Attributes = std::map<std::string, std::string>;

/// Without a prefix: ome:Pixels is Pixels.
std::string local_name(const char* name) {
  const std::string_view whole = name;
  return std::string(whole.substr(whole.find(':') == std::string_view::npos ? 0 : whole.find(':') + 1));
}

struct OmeReader {
  OmeImage image;
  bool is_in_pixels = false;  // of the first image
  bool has_pixels = false;    // the first image's are read: what follows are other images
  bool is_in_uuid = false;    // of a TiffData
  int n_samples = 0;          // of all channels: an RGB channel has three
  std::string error;

  int number(const Attributes& attributes, const char* name, int otherwise, int lowest) {
    const auto found = attributes.find(name);
    if (found == attributes.end()) return otherwise;
    const std::string& text = found->second;
    int value = 0;
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
    constexpr int kLargest = 1 << 22;  // planes: beyond any file's
    if (code == std::errc() && end == text.data() + text.size() && value >= lowest && value <= kLargest) return value;
    if (error.empty()) error = std::string(name) + "=\"" + text + "\"";
    return otherwise;
  }
  static std::string text(const Attributes& attributes, const char* name) {
    const auto found = attributes.find(name);
    return found == attributes.end() ? "" : found->second;
  }

  void begin_pixels(const Attributes& a) {
    is_in_pixels = true;
    image.width = number(a, "SizeX", 0, 1);
    image.height = number(a, "SizeY", 0, 1);
    image.n_channels = number(a, "SizeC", 1, 1);
    image.n_slices = number(a, "SizeZ", 1, 1);
    image.n_frames = number(a, "SizeT", 1, 1);
    if (const std::string order = text(a, "DimensionOrder"); !order.empty()) image.order = order;
    image.size_x = text(a, "PhysicalSizeX");
    image.unit_x = text(a, "PhysicalSizeXUnit");
    image.size_y = text(a, "PhysicalSizeY");
    image.unit_y = text(a, "PhysicalSizeYUnit");
    image.size_z = text(a, "PhysicalSizeZ");
    image.unit_z = text(a, "PhysicalSizeZUnit");
  }

  void begin_pages(const Attributes& a) {
    OmePages pages;
    pages.first_page = number(a, "IFD", 0, 0);
    pages.first_channel = number(a, "FirstC", 0, 0);
    pages.first_slice = number(a, "FirstZ", 0, 0);
    pages.first_frame = number(a, "FirstT", 0, 0);
    if (a.contains("PlaneCount")) pages.n_planes = number(a, "PlaneCount", 1, 0);
    if (!a.contains("PlaneCount") && a.contains("IFD")) pages.n_planes = 1;
    image.pages.push_back(pages);
  }

  void begin(const std::string& element, const Attributes& a) {
    if (element == "OME") image.uuid = text(a, "UUID");
    if (element == "BinaryOnly") image.companion = text(a, "MetadataFile");
    image.n_images += element == "Image";
    if (has_pixels) return;
    if (element == "Pixels") begin_pixels(a);
    if (!is_in_pixels) return;
    if (element == "Channel") {
      image.channel_names.push_back(text(a, "Name"));
      n_samples += number(a, "SamplesPerPixel", 1, 1);
    }
    if (element == "TiffData") begin_pages(a);
    if (element == "UUID" && !image.pages.empty()) {
      image.pages.back().file_name = text(a, "FileName");
      is_in_uuid = true;
    }
  }

  void end(const std::string& element) {
    if (element == "UUID") is_in_uuid = false;
    if (element != "Pixels" || !is_in_pixels) return;
    is_in_pixels = false;
    has_pixels = true;
    // SizeC counts samples: channels of several share a page
    const auto n_named = static_cast<int>(image.channel_names.size());
    if (n_named > 0 && n_samples == image.n_channels) image.n_channels = n_named;
    image.channel_names.resize(static_cast<std::size_t>(image.n_channels));
  }
};

void on_begin(void* reader, const char* element, const char** attributes) {
  Attributes named;
  for (; *attributes; attributes += 2) named[local_name(attributes[0])] = attributes[1];
  static_cast<OmeReader*>(reader)->begin(local_name(element), named);
}
void on_end(void* reader, const char* element) { static_cast<OmeReader*>(reader)->end(local_name(element)); }
void on_text(void* reader, const char* text, int length) {
  auto* r = static_cast<OmeReader*>(reader);
  if (r->is_in_uuid) r->image.pages.back().uuid.append(text, static_cast<std::size_t>(length));
}

/// What is wrong with the XML; XML_ERROR_NONE: nothing.
XML_Error parse(const std::string& xml, const char* encoding, OmeReader& reader) {
  const std::unique_ptr<std::remove_pointer_t<XML_Parser>, decltype(&XML_ParserFree)> parser(XML_ParserCreate(encoding),
                                                                                             &XML_ParserFree);
  XML_SetUserData(parser.get(), &reader);
  XML_SetElementHandler(parser.get(), on_begin, on_end);
  XML_SetCharacterDataHandler(parser.get(), on_text);
  if (xml.size() > 1u << 30) return XML_ERROR_NO_MEMORY;
  const auto status = XML_Parse(parser.get(), xml.data(), static_cast<int>(xml.size()), XML_TRUE);
  return status == XML_STATUS_OK ? XML_ERROR_NONE : XML_GetErrorCode(parser.get());
}

}  // namespace

bool is_ome(std::string_view description) {
  return description.find("<OME") != std::string_view::npos || description.find(":OME ") != std::string_view::npos;
}

OmeImage parse_ome(const std::string& xml) {
  OmeReader reader;
  XML_Error error = parse(xml, nullptr, reader);
  if (error == XML_ERROR_INVALID_TOKEN) {
    reader = OmeReader{};
    error = parse(xml, "ISO-8859-1", reader);
  }
  if (error != XML_ERROR_NONE) throw InvalidData("OME-XML", "well-formed XML", XML_ErrorString(error));
  if (!reader.error.empty()) throw InvalidData("OME-XML", "a whole number in its range", reader.error);
  return reader.image;
}

}  // namespace mbtfm::images
