#include "pipeline/numerics/memory.h"

#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::numerics {

double memory_bytes() {
  const double of_machine = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  rlimit given{};
  if (getrlimit(RLIMIT_AS, &given) != 0 || given.rlim_cur == RLIM_INFINITY) return of_machine;
  return std::min(of_machine, static_cast<double>(given.rlim_cur));
}

void expect_room_for(const Demand& demand) {
  constexpr double kShare = 0.8;  // the rest is the program's other things, and the machine's other programs
  const double needed = demand.count * demand.bytes_each, allowed = kShare * memory_bytes();
  if (needed <= allowed) return;
  const auto gigabytes = [](double bytes) { return brief(1e-9 * bytes) + " GB"; };
  throw OutOfMemory(demand.what + " would have " + brief(demand.count) + " " + demand.parts + ", which take " +
                    gigabytes(needed) + " of memory at the least; allowed are " + gigabytes(allowed) + ": " +
                    demand.remedy);
}

void use_large_pages(void* begin, std::size_t bytes) {
  constexpr std::uintptr_t kPage = std::uintptr_t{2} << 20;
  const auto first = reinterpret_cast<std::uintptr_t>(begin);
  const std::uintptr_t low = (first + kPage - 1) / kPage * kPage, high = (first + bytes) / kPage * kPage;
  if (low < high) madvise(reinterpret_cast<void*>(low), high - low, MADV_HUGEPAGE);
}

}  // namespace mbtfm::numerics
