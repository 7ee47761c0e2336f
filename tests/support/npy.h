/// The arrays of doubles that NumPy writes.
#pragma once

#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "pipeline/contract/csv.h"

namespace mbtfm::test {

struct NpyArray {
  int n_rows = 0, n_columns = 0;
  std::vector<double> values;  ///< row by row
};

/// Version 1, two dimensions, '<f8', C order.
inline NpyArray read_npy(const std::filesystem::path& file) {
  const std::string text = read_text(file);
  if (text.compare(0, 6, "\x93NUMPY") != 0) throw std::runtime_error(file.string() + ": not an .npy file");
  const std::size_t header_size = static_cast<unsigned char>(text[8]) + 256u * static_cast<unsigned char>(text[9]);
  const std::string header = text.substr(10, header_size);
  if (header.find("'<f8'") == header.npos || header.find("'fortran_order': False") == header.npos) {
    throw std::runtime_error(file.string() + ": " + header);
  }
  NpyArray array;
  if (std::sscanf(header.c_str() + header.find("'shape'"), "'shape': (%d, %d)", &array.n_rows, &array.n_columns) != 2) {
    throw std::runtime_error(file.string() + ": " + header);
  }
  array.values.resize(static_cast<std::size_t>(array.n_rows) * static_cast<std::size_t>(array.n_columns));
  if (text.size() < 10 + header_size + 8 * array.values.size()) throw std::runtime_error(file.string() + ": too short");
  std::memcpy(array.values.data(), text.data() + 10 + header_size, 8 * array.values.size());
  return array;
}

}  // namespace mbtfm::test
