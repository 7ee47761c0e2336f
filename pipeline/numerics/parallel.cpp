#include "pipeline/numerics/parallel.h"

#include <sched.h>

#include <algorithm>
#include <atomic>
#include <boost/thread.hpp>
#include <exception>
#include <vector>

namespace mbtfm::numerics {

void parallel_for(int n, int threads, const std::function<void(int)>& body) {
  if (threads <= 1 || n <= 1) {
    for (int i = 0; i < n; ++i) body(i);
    return;
  }
  std::vector<std::exception_ptr> failures(n);
  std::atomic<int> next = 0;
  const auto work = [&] {
    for (int i = next++; i < n; i = next++) {
      try {
        body(i);
      } catch (...) {
        failures[i] = std::current_exception();
      }
    }
  };
  boost::thread_group workers;
  try {
    for (int t = 1; t < std::min(threads, n); ++t) workers.create_thread(work);
  } catch (const boost::thread_resource_error&) {
    // no more to be had: those there are do all of the work
  }
  work();
  workers.join_all();
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
}

int available_threads() {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) == 0) return std::max(1, CPU_COUNT(&allowed));
  return static_cast<int>(std::max(1u, boost::thread::hardware_concurrency()));
}

}  // namespace mbtfm::numerics
