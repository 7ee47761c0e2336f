#include <sys/resource.h>
#include <unistd.h>
#include <thread>

#include "pipeline/numerics/parallel.h"
#include "tests/support/test.h"

namespace mbtfm {
namespace {

TEST(ParallelFor, every_index_is_visited_once_for_any_number_of_threads) {
  for (const int threads : {1, 2, 4, 50}) {
    std::vector<int> visits(37, 0);
    numerics::parallel_for(37, threads, [&](int i) { ++visits[i]; });
    EXPECT_EQ(std::accumulate(visits.begin(), visits.end(), 0), 37);
    EXPECT_EQ(*std::min_element(visits.begin(), visits.end()), 1);
  }
  numerics::parallel_for(0, 4, [](int) { FAIL() << "there is no index"; });
}

TEST(ParallelFor, the_exception_of_the_lowest_index_is_rethrown) {
  for (const int threads : {1, 2, 4}) {
    const std::runtime_error error = test::thrown<std::runtime_error>([&] {
      numerics::parallel_for(20, threads, [](int i) {
        if (i == 3 || i == 17) throw std::runtime_error(std::to_string(i));
      });
    });
    EXPECT_STREQ(error.what(), "3");
  }
}

/// In a process of its own: as many threads as asked for need more address space than there is.
[[noreturn]] void run_where_threads_are_few() {
  const rlimit limit{.rlim_cur = 400'000'000, .rlim_max = 400'000'000};  // a thread's stack takes 8 MB
  setrlimit(RLIMIT_AS, &limit);
  std::vector<int> visits(2000, 0);
  numerics::parallel_for(2000, 1000, [&](int i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));  // so that they are there together
    ++visits[i];
  });
  _exit(std::count(visits.begin(), visits.end(), 1) == 2000 ? 0 : 1);
}

TEST(ParallelFor, the_work_is_done_by_those_threads_that_there_are) {
  EXPECT_EXIT(run_where_threads_are_few(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace mbtfm
