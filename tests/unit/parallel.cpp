#include "pipeline/contract/parallel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

namespace mbtfm {
namespace {

TEST(ParallelFor, every_index_is_visited_once_for_any_number_of_threads) {
  for (const int threads : {1, 2, 4, 50}) {
    std::vector<int> visits(37, 0);
    parallel_for(37, threads, [&](int i) { ++visits[i]; });
    EXPECT_EQ(std::accumulate(visits.begin(), visits.end(), 0), 37);
    EXPECT_EQ(*std::min_element(visits.begin(), visits.end()), 1);
  }
  parallel_for(0, 4, [](int) { FAIL() << "there is no index"; });
}

TEST(ParallelFor, the_exception_of_the_lowest_index_is_rethrown) {
  for (const int threads : {1, 2, 4}) {
    try {
      parallel_for(20, threads, [](int i) {
        if (i == 3 || i == 17) throw std::runtime_error(std::to_string(i));
      });
      FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "3");
    }
  }
}

}  // namespace
}  // namespace mbtfm
