/// Preloaded under the thread sanitizer (tests/modes.sh): runs OpenCV's parallel loops in threads that it can follow.
/// It does not see how TBB, which Debian's OpenCV uses, waits for the end of a loop.
#include <algorithm>
#include <memory>
#include <opencv2/core/parallel/parallel_backend.hpp>
#include <thread>
#include <utility>
#include <vector>

namespace {

thread_local int thread_number = 0;

class FollowedThreads : public cv::parallel::ParallelForAPI {
 public:
  void parallel_for(int tasks, FN_parallel_for_body_cb_t body, void* data) override {
    const int n =
        thread_number > 0 ? 1 : std::clamp(tasks, 1, n_threads_);  // a loop inside of a loop stays in its thread
    const auto first_of = [&](int k) { return static_cast<int>(static_cast<long>(tasks) * k / n); };
    std::vector<std::thread> threads;
    for (int k = 1; k < n; ++k)
      threads.emplace_back([&, k] {
        thread_number = k;
        body(first_of(k), first_of(k + 1), data);
      });
    body(0, first_of(1), data);
    for (std::thread& thread : threads) thread.join();
  }
  int getThreadNum() const override { return thread_number; }
  int getNumThreads() const override { return n_threads_; }
  int setNumThreads(int n) override { return std::exchange(n_threads_, std::max(1, n)); }
  const char* getName() const override { return "followed"; }

 private:
  int n_threads_ = 2;
};

[[gnu::constructor]] void take_over_the_loops() {
  cv::parallel::setParallelForBackend(std::make_shared<FollowedThreads>(), false);
}

}  // namespace
