#include "pipeline/contract/toml_depth.h"

#include <algorithm>

#include "pipeline/contract/errors.h"

namespace mbtfm {

void expect_shallow_keys(std::string_view text, const std::string& name) {
  constexpr std::ptrdiff_t kMostDots = 1000;  // on a line of ours: some; of tables in a stack of 8 MB: ten thousands
  int number = 1;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    if (std::ranges::count(line, '.') > kMostDots) {
      throw InputError(name + ":" + std::to_string(number),
                       "TOML with at most " + std::to_string(kMostDots) + " dots on a line", "more",
                       "the file may be damaged");
    }
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    ++number;
  }
}

}  // namespace mbtfm
