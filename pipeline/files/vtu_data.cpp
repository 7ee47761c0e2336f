#include "pipeline/files/vtu_data.h"

#include <vtkDataCompressor.h>
#include <vtkLZ4DataCompressor.h>
#include <vtkSmartPointer.h>
#include <vtkZLibDataCompressor.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/parsed.h"
#include "pipeline/files/names.h"

namespace mbtfm::files {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr const char* kSpace = " \t\r\n";

[[noreturn]] void refuse(const std::string& element, const std::string& expected, const std::string& found) {
  throw InvalidData(element, expected, found);
}

/// The bytes behind raw or base64 data, taken from the front; never more than there are.
class Bytes {
 public:
  Bytes(const VtuData& data, const std::string& element)
      : rest_(data.bytes), is_base64_(data.storage == VtuStorage::base64), element_(element) {}

  std::string take(std::uint64_t n) {
    if (n > rest_.size() + decoded_.size()) refuse_early_end(n);
    if (!is_base64_) {
      const std::string taken(rest_.substr(0, n));
      rest_.remove_prefix(n);
      return taken;
    }
    while (decoded_.size() < n) decode_next();
    const std::string taken = decoded_.substr(0, n);
    decoded_.erase(0, n);
    return taken;
  }

 private:
  [[noreturn]] void refuse_early_end(std::uint64_t n) const {
    refuse(element_, std::to_string(n) + " more bytes of data", "the end of the data");
  }

  /// Some more groups of four characters. Padded ones may be in the middle: sizes and data are encoded apart.
  void decode_next() {
    constexpr int kGroups = 1024;
    const std::size_t before = decoded_.size();
    for (int i = 0; i < kGroups; ++i) {
      int n_padding = 0;
      std::uint32_t bits = 0;
      for (int k = 0; k < 4; ++k) {
        while (!rest_.empty() && std::strchr(kSpace, rest_.front()) && rest_.front() != '\0') rest_.remove_prefix(1);
        if (rest_.empty() || rest_.front() == '<') {
          if (k > 0 || decoded_.size() == before) refuse_early_end(1);
          return;
        }
        const int value = value_of(rest_.front());
        rest_.remove_prefix(1);
        n_padding += value < 0;
        if (value >= 0 && n_padding > 0) refuse(element_, "base64", "a '=' in the middle of four characters");
        bits = bits << 6 | static_cast<std::uint32_t>(std::max(value, 0));
      }
      if (n_padding > 2) refuse(element_, "base64", "more than two '=' together");
      for (int k = 0; k < 3 - n_padding; ++k) decoded_ += static_cast<char>(bits >> (16 - 8 * k) & 0xFF);
    }
  }

  /// -1: padding
  int value_of(char c) const {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    if (c == '=') return -1;
    const std::size_t value = kDigits.find(c);
    if (value == kDigits.npos) refuse(element_, "base64", "a character that it does not have");
    return static_cast<int>(value);
  }

  std::string_view rest_;
  bool is_base64_;
  const std::string& element_;
  std::string decoded_;  ///< of base64: not yet taken
};

/// Sizes before the data.
std::vector<std::uint64_t> take_sizes(Bytes& bytes, std::uint64_t n, const VtuEncoding& encoding,
                                      const std::string& element) {
  if (n > std::numeric_limits<std::uint32_t>::max()) refuse(element, "a number of blocks", std::to_string(n));
  const std::string taken = bytes.take(n * encoding.header_bytes);
  std::vector<std::uint64_t> sizes(n);
  for (std::uint64_t i = 0; i < n; ++i) {
    for (int k = 0; k < encoding.header_bytes; ++k) {
      const int shift = 8 * (encoding.is_big_endian ? encoding.header_bytes - 1 - k : k);
      const auto byte = static_cast<unsigned char>(taken[i * encoding.header_bytes + k]);
      sizes[i] |= static_cast<std::uint64_t>(byte) << shift;
    }
  }
  return sizes;
}

vtkSmartPointer<vtkDataCompressor> compressor_of(const VtuEncoding& encoding, const std::string& element) {
  if (encoding.compressor == "vtkZLibDataCompressor") return vtkSmartPointer<vtkZLibDataCompressor>::New();
  if (encoding.compressor == "vtkLZ4DataCompressor") return vtkSmartPointer<vtkLZ4DataCompressor>::New();
  refuse(element, "data that are not compressed, or with ZLib or LZ4",
         "'" + encoding.compressor + "': save the file again with one of those");
}

/// VTK would print what it finds wrong with a block; the caller throws it.
class SilentVtk {
 public:
  SilentVtk() { vtkObject::SetGlobalWarningDisplay(0); }
  ~SilentVtk() { vtkObject::SetGlobalWarningDisplay(before_); }
  SilentVtk(const SilentVtk&) = delete;

 private:
  int before_ = vtkObject::GetGlobalWarningDisplay();
};

/// The blocks, each unpacked to the size that it must have: all but the last to the same one.
std::string take_blocks(Bytes& bytes, std::uint64_t n_bytes, const VtuEncoding& encoding, const std::string& element) {
  const auto head = take_sizes(bytes, 3, encoding, element);
  const std::uint64_t n_blocks = head[0], block_size = head[1], last_size = head[2] > 0 ? head[2] : head[1];
  constexpr std::uint64_t kLargest = 1u << 30;  // a compressor counts with int
  const bool is_whole = block_size > 0 && block_size <= kLargest && last_size <= block_size && n_blocks > 0 &&
                        n_blocks <= n_bytes && (n_blocks - 1) * block_size + last_size == n_bytes;
  if (!is_whole) {
    refuse(element, "blocks of " + std::to_string(n_bytes) + " bytes together",
           std::to_string(n_blocks) + " of " + std::to_string(block_size) + " bytes, the last of " +
               std::to_string(last_size));
  }
  const auto packed_sizes = take_sizes(bytes, n_blocks, encoding, element);
  const auto compressor = compressor_of(encoding, element);
  const SilentVtk silent;
  std::string values(n_bytes, '\0');
  for (std::uint64_t i = 0; i < n_blocks; ++i) {
    const std::string packed = bytes.take(packed_sizes[i]);
    const std::uint64_t size = i + 1 < n_blocks ? block_size : last_size;
    if (packed.size() > kLargest) refuse(element, "a block that can be unpacked", "a damaged one");
    const std::size_t got =
        compressor->Uncompress(reinterpret_cast<const unsigned char*>(packed.data()), packed.size(),
                               reinterpret_cast<unsigned char*>(values.data() + i * block_size), size);
    if (got != size) refuse(element, "a block that can be unpacked", "a damaged one");
  }
  return values;
}

template <class T>
double number_at(const char* bytes, bool is_swapped) {
  char own[sizeof(T)];
  std::memcpy(own, bytes, sizeof(T));
  if (is_swapped) std::reverse(own, own + sizeof(T));
  T value;
  std::memcpy(&value, own, sizeof(T));
  return static_cast<double>(value);
}

constexpr NumberType kNumberTypes[] = {{"int8", 1, number_at<std::int8_t>},   {"uint8", 1, number_at<std::uint8_t>},
                                       {"int16", 2, number_at<std::int16_t>}, {"uint16", 2, number_at<std::uint16_t>},
                                       {"int32", 4, number_at<std::int32_t>}, {"uint32", 4, number_at<std::uint32_t>},
                                       {"int64", 8, number_at<std::int64_t>}, {"uint64", 8, number_at<std::uint64_t>},
                                       {"float32", 4, number_at<float>},      {"float64", 8, number_at<double>}};

std::vector<double> decode_binary(const VtuData& data, const VtuEncoding& encoding, const NumberType& type,
                                  const std::string& element) {
  if (data.n_values == 0) return {};  // of which VTK writes a size, several, or none
  const std::uint64_t n_bytes = data.n_values * type.n_bytes;
  Bytes bytes(data, element);
  std::string values;
  if (encoding.compressor.empty()) {
    const std::uint64_t stated = take_sizes(bytes, 1, encoding, element).front();
    if (stated != n_bytes) refuse(element, std::to_string(n_bytes) + " bytes of data", std::to_string(stated));
    values = bytes.take(n_bytes);
  } else {
    values = take_blocks(bytes, n_bytes, encoding, element);
  }
  std::vector<double> numbers(data.n_values);
  for (std::size_t i = 0; i < numbers.size(); ++i)
    numbers[i] = type.number_at(values.data() + i * type.n_bytes, encoding.is_big_endian);
  return numbers;
}

std::vector<double> decode_text(const VtuData& data, const std::string& element) {
  std::vector<double> numbers;
  for (std::size_t at = data.bytes.find_first_not_of(kSpace); at != data.bytes.npos;
       at = data.bytes.find_first_not_of(kSpace, at)) {
    const std::size_t end = std::min(data.bytes.find_first_of(kSpace, at), data.bytes.size());
    const auto value = parsed<double>(data.bytes.substr(at, end - at));
    if (!value) refuse(element, "numbers", "other text after " + std::to_string(numbers.size()) + " numbers");
    if (numbers.size() == data.n_values) refuse(element, std::to_string(data.n_values) + " numbers", "more");
    numbers.push_back(*value);
    at = end;
  }
  if (numbers.size() != data.n_values)
    refuse(element, std::to_string(data.n_values) + " numbers", std::to_string(numbers.size()));
  return numbers;
}

}  // namespace

const NumberType* number_type(std::string_view name) {
  const auto found = std::ranges::find(kNumberTypes, lower_case(std::string(name)), &NumberType::name);
  return found == std::end(kNumberTypes) ? nullptr : found;
}

std::vector<double> decode_vtu(const VtuData& data, const VtuEncoding& encoding, const std::string& element) {
  const NumberType* type = number_type(data.type);
  if (type == nullptr) refuse(element, "numbers of a type of VTK", "'" + data.type + "'");
  return data.storage == VtuStorage::ascii ? decode_text(data, element) : decode_binary(data, encoding, *type, element);
}

}  // namespace mbtfm::files
