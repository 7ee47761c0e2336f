/// The numbers of the arrays in a VTK XML file: text, base64 or raw bytes, whole or in compressed blocks. Inside of
/// vtu_file.cpp only.
///
/// What a file claims (numbers of values, blocks, bytes) is compared with what it holds before anything is made of that
/// size. Source: VTK's vtkXMLWriter and vtkXMLDataParser, version 9.1.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace mbtfm::files {

/// What the head of the file says of all its binary arrays.
struct VtuEncoding {
  bool is_big_endian = false;
  int header_bytes = 4;    ///< of each size before the data: 4 or 8
  std::string compressor;  ///< VTK's class; empty: none
};

enum class VtuStorage { ascii, base64, raw };

/// Where an array's numbers lie, and what they must be.
struct VtuData {
  std::string_view bytes;  ///< from the array's begin on; of base64 and raw data more may follow
  VtuStorage storage = VtuStorage::ascii;
  std::string type;  ///< VTK's word: "Int32"
  std::uint64_t n_values = 0;
};

/// A type of numbers in binary files.
struct NumberType {
  std::string_view name;  ///< in small letters
  std::size_t n_bytes;
  double (*number_at)(const char* bytes, bool is_swapped);
};
/// By VTK's name or PLY's newer one: "Int32", "int32"; null: none is called so.
const NumberType* number_type(std::string_view name);

/// The numbers of an array; integers above 2^53 are rounded.
/// @throws InvalidData that calls the array `element`, where it has not exactly `n_values` numbers
std::vector<double> decode_vtu(const VtuData& data, const VtuEncoding& encoding, const std::string& element);

}  // namespace mbtfm::files
