/// Bead tracks in a MATLAB 5 file (MathWorks, MAT-File Format, R2023b): as much of the format as one struct array of
/// matrices needs.
#pragma once

#include <zlib.h>

#include "pipeline/contract/geometry.h"
#include "tests/support/test.h"

namespace mbtfm::test {

/// The data elements of `text`: type (1: 8-bit, 5: 32-bit, 9: double, 14: matrix, 15: compressed) and bytes.
struct MatElement {
  std::uint32_t type = 0;
  std::string bytes;
};

inline std::uint32_t number_at(const std::string& text, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, text.data() + at, sizeof value);
  return value;
}

inline std::string inflated(const std::string& bytes) {
  std::string result(64 * bytes.size(), '\0');  // doubles shrink by less
  uLongf size = result.size();
  const auto* from = reinterpret_cast<const Bytef*>(bytes.data());
  if (uncompress(reinterpret_cast<Bytef*>(result.data()), &size, from, bytes.size()) != Z_OK) return {};
  result.resize(size);
  return result;
}

inline std::vector<MatElement> elements_of(const std::string& text, std::size_t at = 0) {
  std::vector<MatElement> result;
  while (at + 8 <= text.size()) {
    const std::uint32_t type = number_at(text, at), size = number_at(text, at + 4);
    if (type >> 16 != 0) {  // of up to four bytes: size and type in one word
      result.push_back({type & 0xffff, text.substr(at + 4, type >> 16)});
      at += 8;
      continue;
    }
    result.push_back({type, text.substr(at + 8, size)});
    at += 8 + (type == 15 ? size : (size + 7) / 8 * 8);
  }
  return result;
}

/// The columns x, y of every matrix of doubles in the file, in its order.
inline std::vector<std::vector<Vec2>> matrices_of(const std::string& text, std::size_t at = 128) {
  std::vector<std::vector<Vec2>> result;
  for (const MatElement& element : elements_of(text, at))
    if (element.type == 9) {
      std::vector<double> values(element.bytes.size() / sizeof(double));
      std::memcpy(values.data(), element.bytes.data(), element.bytes.size());
      std::vector<Vec2> rows;
      for (std::size_t k = 0; k < values.size() / 2; ++k) rows.push_back({values[k], values[values.size() / 2 + k]});
      result.push_back(std::move(rows));
    } else if (element.type == 14 || element.type == 15) {
      for (auto& rows : matrices_of(element.type == 15 ? inflated(element.bytes) : element.bytes, 0))
        result.push_back(std::move(rows));
    }
  return result;
}

}  // namespace mbtfm::test
