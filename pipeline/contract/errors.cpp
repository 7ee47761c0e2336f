#include "pipeline/contract/errors.h"

#include <cstdio>
#include <filesystem>
#include <new>
#include <string_view>
#include <system_error>

#include "pipeline/contract/report.h"

namespace mbtfm {

namespace {

int print_error(const std::string& program, int code, const std::string& message, const std::string& hint = {}) {
  const char* kind = code == exit_code::kBug ? "internal error" : "error";
  std::fprintf(stderr, "%s: %s: %s\n", program.c_str(), kind, message.c_str());
  if (!hint.empty()) std::fprintf(stderr, "  hint: %s\n", hint.c_str());
  return code;
}

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

int report_current_exception(const std::string& program) {
  using namespace exit_code;
  try {
    throw;
  } catch (const UsageError& error) {
    return print_error(program, kUsage, error.what());
  } catch (const InputError& error) {
    return print_error(program, kInput, error.what(), error.hint);
  } catch (const InvalidData& error) {
    return print_error(program, kInput, error.what());
  } catch (const OutOfMemory& error) {
    return print_error(program, kResources, error.report->reason);
  } catch (const NotSolved& error) {
    return print_error(program, kNoAnswer, "not solved: " + error.report->reason);
  } catch (const OutputError& error) {
    return print_error(program, kOutput, error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    return print_error(program, kOutput, error.what());
  } catch (const Interrupted& error) {
    return print_error(program, kInterrupted, error.what());
  } catch (const std::exception& error) {
    if (is_want_of_memory(error)) return print_error(program, kResources, "out of memory", kNeedLess);
    return print_error(program, kBug, error.what(), "please report this with the command and its inputs");
  }
}

}  // namespace mbtfm
