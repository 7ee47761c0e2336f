#include "pipeline/contract/errors.h"

#include <cstdio>
#include <filesystem>
#include <new>
#include <string_view>
#include <system_error>

#include "pipeline/contract/report.h"

namespace mbtfm {

namespace {

constexpr const char* kNeedLess = "fewer threads, a coarser mesh or fewer beads need less";

/// Containers, OpenCV and the threads' library have errors of their own for it.
bool is_want_of_memory(const std::exception& error) {
  const auto* system = dynamic_cast<const std::system_error*>(&error);
  if (system &&
      (system->code() == std::errc::not_enough_memory || system->code() == std::errc::resource_unavailable_try_again))
    return true;
  return dynamic_cast<const std::bad_alloc*>(&error) != nullptr ||
         dynamic_cast<const std::length_error*>(&error) != nullptr ||  // a vector larger than any memory
         std::string_view(error.what()).find("Insufficient memory") != std::string_view::npos;
}

}  // namespace

NotSolved::NotSolved(Report what)
    : std::runtime_error(what.reason), report(std::make_shared<Report>(std::move(what))) {}

OutOfMemory::OutOfMemory(std::string reason) : NotSolved(Report{.reason = std::move(reason)}) {}

int report_current_exception(const std::string& program, const std::function<std::string(const std::string&)>& worded) {
  using namespace exit_code;
  const auto tell = [&](int code, const std::string& message, const std::string& hint = {}) {
    const auto text = [&](const std::string& of) { return worded ? worded(of) : of; };
    const char* kind = code == kBug ? "internal error" : "error";
    std::fprintf(stderr, "%s: %s: %s\n", program.c_str(), kind, text(message).c_str());
    if (!hint.empty()) std::fprintf(stderr, "  hint: %s\n", text(hint).c_str());
    return code;
  };
  try {
    throw;
  } catch (const UsageError& error) {
    return tell(kUsage, error.what());
  } catch (const InputError& error) {
    return tell(kInput, error.what(), error.hint);
  } catch (const InvalidData& error) {
    return tell(kInput, error.what());
  } catch (const OutOfMemory& error) {
    return tell(kResources, error.report->reason);
  } catch (const NotSolved& error) {
    return tell(kNoAnswer, "not solved: " + error.report->reason);
  } catch (const OutputError& error) {
    return tell(kOutput, error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    return tell(kOutput, error.what());
  } catch (const Interrupted& error) {
    return tell(kInterrupted, error.what());
  } catch (const std::exception& error) {
    if (is_want_of_memory(error)) return tell(kResources, "out of memory", kNeedLess);
    return tell(kBug, error.what(), "please report this with the command and its inputs");
  }
}

}  // namespace mbtfm
