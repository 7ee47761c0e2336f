/// Large things are counted before they are made.
#pragma once

#include <cstddef>
#include <string>

namespace mbtfm::numerics {

/// Bytes that a program may take in all: the machine's memory, or less where it was given less (ulimit -v).
double memory_bytes();

/// What is about to be made.
struct Demand {
  std::string what;       ///< "the mesh", "the lattice of tractions"
  double count = 0;       ///< of its parts
  std::string parts;      ///< "vertices"
  double bytes_each = 0;  ///< at the least
  std::string remedy;     ///< "choose a larger edge_length_um"
};
/// @throws OutOfMemory with the count and the memory, where it would take more than four fifths of memory_bytes()
void expect_room_for(const Demand& demand);

/// Ask the system for large pages where there is nothing yet: fewer of them have to be handed out. Less than such a
/// page, or a system without them: nothing happens.
void use_large_pages(void* begin, std::size_t bytes);

}  // namespace mbtfm::numerics
