/// toml++ bounds how deep values nest, but not how many parts a dotted key has: each is a table, and tables are taken
/// down one in the other. A key of some ten thousand parts overflows the stack.
#pragma once

#include <string>
#include <string_view>

namespace mbtfm {

/// To be called before the text is parsed. @throws InputError with name and line where a line has too many dots
void expect_shallow_keys(std::string_view text, const std::string& name);

}  // namespace mbtfm
