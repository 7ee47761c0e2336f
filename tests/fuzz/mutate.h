/// Samples, changed as damage and malice change files. The same seed gives the same inputs.
#pragma once

#include "tests/support/test.h"

namespace mbtfm::fuzz {

class Mutator {
 public:
  Mutator(std::vector<std::string> samples, std::uint64_t seed) : samples_(std::move(samples)), random_(seed) {}

  std::string next() {
    std::string text = samples_[below(samples_.size())];
    for (std::size_t n = 1 + below(4); n > 0; --n) change(text);
    if (text.size() > kLongest) text.resize(kLongest);
    return text;
  }

 private:
  static constexpr std::size_t kLongest = 1u << 17;

  void change(std::string& text) {
    if (text.empty()) text = "0";
    const std::size_t at = place(text);
    switch (below(13)) {
      case 0:
        text[at] = static_cast<char>(text[at] ^ 1 << below(8));
        break;
      case 1:
        text[at] = static_cast<char>(below(256));
        break;
      case 2:
        text.resize(at);
        break;
      case 3:
        text.erase(at, block(text, at));
        break;
      case 4:
        text.insert(at, text.substr(at, block(text, at)));
        break;
      case 5: {
        const std::size_t from = below(text.size());
        text.replace(at, block(text, at), text.substr(from, block(text, from)));
        break;
      }
      case 6: {  // the end of another sample
        const std::string& other = samples_[below(samples_.size())];
        text = text.substr(0, at) + other.substr(std::min(other.size(), other.empty() ? 0 : below(other.size())));
        break;
      }
      case 7:
        put_binary_number(text, at);
        break;
      case 8:
      case 9:
        put_number(text, at);
        break;
      case 10:
        change_digit(text, at);
        break;
      case 11:
        drop_between(text, at, "\n");
        break;
      default:
        drop_between(text, at, ",; \t\"<>{}[]");
    }
  }

  std::size_t below(std::size_t n) { return random_() % n; }
  /// Half of the time near the begin, where sizes and counts are.
  std::size_t place(const std::string& text) {
    return below(below(2) ? text.size() : std::min<std::size_t>(text.size(), 300));
  }
  std::size_t block(const std::string& text, std::size_t at) {
    return 1 + below(std::min<std::size_t>(text.size() - at, below(8) ? 16 : 4096));
  }

  void put_binary_number(std::string& text, std::size_t at) {
    constexpr std::array<std::uint64_t, 12> kNumbers = {
        0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x100000000, ~std::uint64_t{0}};
    const std::uint64_t number = kNumbers[below(kNumbers.size())] + (below(4) ? 0 : below(64));
    const std::size_t n = std::size_t{1} << below(4);
    const bool is_big_endian = below(2);
    for (std::size_t k = 0; k < n && at + k < text.size(); ++k)
      text[at + k] = static_cast<char>(number >> 8 * (is_big_endian ? n - 1 - k : k));
  }

  /// In place of a number in the text, if there is one further on.
  void put_number(std::string& text, std::size_t at) {
    static const std::vector<std::string> kNumbers = {"0",
                                                      "-1",
                                                      "1",
                                                      "2147483647",
                                                      "2147483648",
                                                      "4294967296",
                                                      "9223372036854775807",
                                                      "18446744073709551616",
                                                      "nan",
                                                      "inf",
                                                      "1e308",
                                                      "-1e300",
                                                      "1e-300",
                                                      "1e999",
                                                      "0.5",
                                                      "99999999999999999999",
                                                      "",
                                                      "-",
                                                      "007",
                                                      "1e",
                                                      "0x10",
                                                      "true",
                                                      "null",
                                                      "100000"};
    const std::size_t begin = text.find_first_of("0123456789", at);
    if (begin == text.npos) return;
    const std::size_t end = std::min(text.find_first_not_of("0123456789.eE+-", begin), text.size());
    text.replace(begin, end - begin, kNumbers[below(kNumbers.size())]);
  }

  void change_digit(std::string& text, std::size_t at) {
    const std::size_t digit = text.find_first_of("0123456789", at);
    if (digit != text.npos) text[digit] = static_cast<char>('0' + below(10));
  }

  void drop_between(std::string& text, std::size_t at, const char* separators) {
    const std::size_t begin = text.find_first_of(separators, at);
    if (begin == text.npos) return;
    const std::size_t end = std::min(text.find_first_of(separators, begin + 1), text.size());
    text.erase(begin, end - begin);
  }

  std::vector<std::string> samples_;
  std::mt19937_64 random_;
};

}  // namespace mbtfm::fuzz
