#pragma once
/// What nearly every test needs: GoogleTest, the standard library, which the build reads once (tests/CMakeLists.txt),
/// and what ends with an exception.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace mbtfm {

namespace fs = std::filesystem;

}  // namespace mbtfm

namespace mbtfm::test {

/// Whether a text has all of these words, whether its lines may break at a space or not; if not, the first that it
/// lacks, and the text.
template <class... Words>
testing::AssertionResult has_words(std::string text, const Words&... words) {
  for (std::size_t at = 0; (at = text.find("\u00a0", at)) != text.npos;) text.replace(at, 2, " ");
  for (const std::string& word : {std::string(words)...})
    if (text.find(word) == text.npos)
      return testing::AssertionFailure() << "'" << word << "' is not in: " << text << '\n';
  return testing::AssertionSuccess() << "all words are in: " << text << '\n';
}

/// Normal numbers of a seed, one after the other.
class Normal {
 public:
  explicit Normal(std::uint64_t seed, double sigma = 1) : random_(seed), normal_(0, sigma) {}
  double operator()() { return normal_(random_); }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

/// The exception of this type that the call ends with.
template <class Error>
std::optional<Error> caught(const auto& call) {
  try {
    call();
  } catch (const Error& error) {
    return error;
  }
  return std::nullopt;
}

/// The same of a call that must end with one.
template <class Error>
Error thrown(const auto& call) {
  if (const std::optional<Error> error = caught<Error>(call)) return *error;
  throw std::runtime_error("nothing was thrown");
}

}  // namespace mbtfm::test

namespace mbtfm {

using test::has_words;

}  // namespace mbtfm
