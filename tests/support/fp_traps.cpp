/// Preloaded into a program (LD_PRELOAD), stops it with SIGFPE where it makes a NaN or an infinity: none may come about
/// unseen. Threads inherit the setting from the one that starts them (pthread_create(3)).
#include <cfenv>

namespace {
[[gnu::constructor]] void trap_what_makes_no_number() { feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW); }
}  // namespace
