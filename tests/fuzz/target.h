/// A fuzz target: one family of readers. Its `read` takes the bytes of a file and gives them to each reader of the
/// family. A reader may throw an InputError; whatever else it throws, a crash, a hang and memory beyond all bounds are
/// faults. The same body runs in the suite's own loop (loop.cpp) and under libFuzzer (corpus.cpp).
#pragma once

#include "pipeline/contract/errors.h"
#include "tests/support/test.h"

namespace mbtfm::fuzz {

struct Target {
  const char* family;  ///< the folder of its inputs in regression/
  int n_inputs;        ///< changed samples that the suite reads: each run is the same; some seconds of work
  std::vector<std::string> (*samples)();  ///< whole files, as the project's own writers and other programs make them
  void (*read)(std::string_view bytes);
};
std::vector<Target>& targets();
inline bool add(const Target& target) {
  targets().push_back(target);
  return true;
}

// for the targets

/// A folder in memory that lives as long as the program.
const std::filesystem::path& folder();
/// Write a file in that folder, with the folders that it lies in. @returns its path
std::filesystem::path put(const std::string& name, std::string_view bytes);
std::string bytes_of(const std::filesystem::path& file);

/// Read; an InputError is an answer.
template <class Read>
void answer(Read&& read) {
  try {
    read();
  } catch (const InputError&) {
  }
}

}  // namespace mbtfm::fuzz
