/// A fuzz target: one family of readers. Its body, LLVMFuzzerTestOneInput, takes the bytes of a file and gives them to
/// each reader of the family. A reader may throw an InputError; whatever else it throws, a crash, a hang and memory
/// beyond all bounds are faults. The same body runs in the suite's own loop (loop.cpp) and under libFuzzer
/// (corpus.cpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/contract/errors.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t n);

namespace mbtfm::fuzz {

// of each target

/// The folder of its inputs in regression/.
extern const char* const kFamily;
/// How many changed samples the suite reads: a fixed number, so that each run is the same; some seconds of work.
extern const int kInputs;
/// Whole files of the family, as the project's own writers and other programs make them.
std::vector<std::string> samples();

// for the targets

/// A folder in memory that lives as long as the program.
const std::filesystem::path& folder();
/// Write a file in that folder, with the folders that it lies in. @returns its path
std::filesystem::path put(const std::string& name, std::string_view bytes);
std::string bytes_of(const std::filesystem::path& file);
inline std::string_view text_of(const std::uint8_t* bytes, std::size_t n) {
  return {reinterpret_cast<const char*>(bytes), n};
}

/// Read; an InputError is an answer.
template <class Read>
void answer(Read&& read) {
  try {
    read();
  } catch (const InputError&) {
  }
}

}  // namespace mbtfm::fuzz
