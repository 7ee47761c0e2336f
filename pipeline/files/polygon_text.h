/// What the readers of meshes share. Inside of this folder only.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/contract/surface.h"

namespace mbtfm::files {

/// The rest of a text, taken word by word or line by line.
class TextRest {
 public:
  TextRest(std::string_view text, std::string name) : rest_(text), name_(std::move(name)) {}

  bool is_empty() const { return rest_.empty(); }
  std::string_view rest() const { return rest_; }
  /// The words of the next line.
  std::vector<std::string_view> line();
  /// The next word; empty: none is left.
  std::string_view word();
  /// So many bytes. @throws InputError where fewer are left
  std::string_view bytes(std::size_t n);
  /// file:line, of what was taken last
  std::string where() const { return name_ + ":" + std::to_string(line_); }

 private:
  std::string_view rest_;
  std::string name_;
  int line_ = 0;             ///< of lines taken
  bool is_new_line_ = true;  ///< the next word begins one
};

/// @throws InputError
double number_of(std::string_view word, const std::string& where);
/// A count or the number of a point. @throws InputError where it is no whole number from 0 to what int holds
int index_of(double value, const std::string& where);
/// Cut into triangles. @throws InputError where there are fewer than three corners
void add_polygon(const std::vector<int>& corners, const std::string& where, TriangleMesh& mesh);

}  // namespace mbtfm::files
