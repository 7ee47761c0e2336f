/// Texts for people, kept as data: files of
///
///   # a comment
///   [section] its own text, which has the key ""
///   key: text; an indented line
///     goes on with it
///
/// that the build embeds (cmake/embed.cmake). A run of digits in a key is looked for as `#`, too, and is that number in
/// the text: `depth_#_um: # um below the surface`.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace mbtfm::files {

class Texts {
 public:
  /// @throws std::logic_error if a line is none of those above, or a key comes twice
  explicit Texts(std::string_view file);
  /// None: there is no such text.
  std::optional<std::string> find(const std::string& section, const std::string& key) const;
  /// @throws std::logic_error if there is no such text
  std::string at(const std::string& section, const std::string& key) const;

 private:
  std::map<std::pair<std::string, std::string>, std::string> all_;
};

}  // namespace mbtfm::files
