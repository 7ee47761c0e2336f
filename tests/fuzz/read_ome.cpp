/// What a TIFF says of its dimensions and its pixel size.
#include "segment/images/image_file.h"
#include "segment/images/stack.h"
#include "tests/fuzz/target.h"

namespace mbtfm::fuzz::ome_readers {
namespace {

std::vector<std::string> samples() {
  return {"ImageJ=1.53t\nimages=6\nchannels=2\nslices=3\nunit=micron\nhyperstack=true\n",
          "<?xml version=\"1.0\"?><OME UUID='urn:uuid:a'><Image><Pixels DimensionOrder='XYZCT' SizeC='2' SizeZ='3' "
          "SizeT='1' PhysicalSizeX='0.1' PhysicalSizeXUnit='\xC2\xB5m' PhysicalSizeY='0.1'><Channel Name='a'/><Channel "
          "Name='b &amp; c' SamplesPerPixel='1'/><TiffData IFD='0' FirstC='1' PlaneCount='3'><UUID "
          "FileName='a.tif'>urn:uuid:a</UUID></TiffData><TiffData IFD='3'/></Pixels></Image></OME>",
          "<!DOCTYPE OME [<!ENTITY e 'eeee'>]><ome:OME xmlns:ome='u'><ome:BinaryOnly "
          "MetadataFile='m.ome'/><ome:Image><ome:Pixels SizeT='40' SizeC='1'><ome:Channel Name='&e;&e;'/><ome:TiffData "
          "FirstT='3'/></ome:Pixels></ome:Image></ome:OME>",
          "Volocity\rXCalibrationMicrons=0.1625\rYCalibrationMicrons=0.1625\r"};
}

void read(std::string_view bytes) {
  const std::string description(bytes);
  try {
    if (const auto stack = images::stack_of(description, {"a.tif", 100}))
      for (const char* const channel : {"", "1"})
        fuzz::answer([&] { images::chosen_pages(*stack, {.channel = channel, .time = 1}, "a.tif"); });
  } catch (const InvalidData&) {  // its reader makes it an InputError with the file's name
  }
  images::n_imagej_images(description);
  images::pixel_size_um({.description = description, .x_resolution_per_unit = 10, .y_resolution_per_unit = 1e-300});
}

const bool is_added = add({"ome", 40000, samples, read});

}  // namespace
}  // namespace mbtfm::fuzz::ome_readers
