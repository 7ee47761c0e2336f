#include "pipeline/contract/errors.h"

#include <cstdio>
#include <filesystem>
#include <new>

namespace mbtfm {

namespace {

int tell(const std::string& program, int code, const std::string& message, const std::string& hint = {}) {
  const char* kind = code == exit_code::kBug ? "internal error" : "error";
  std::fprintf(stderr, "%s: %s: %s\n", program.c_str(), kind, message.c_str());
  if (!hint.empty()) std::fprintf(stderr, "  hint: %s\n", hint.c_str());
  return code;
}

}  // namespace

int report_current_exception(const std::string& program) {
  using namespace exit_code;
  try {
    throw;
  } catch (const UsageError& error) {
    return tell(program, kUsage, error.what());
  } catch (const InputError& error) {
    return tell(program, kInput, error.what(), error.hint);
  } catch (const InvalidData& error) {
    return tell(program, kInput, error.what());
  } catch (const NotSolved& error) {
    return tell(program, kNotSolved, std::string("not solved: ") + error.what());
  } catch (const OutputError& error) {
    return tell(program, kOutput, error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    return tell(program, kOutput, error.what());
  } catch (const Interrupted& error) {
    return tell(program, kInterrupted, error.what());
  } catch (const std::bad_alloc&) {
    return tell(program, kNotSolved, "out of memory", "fewer threads, a coarser mesh or fewer beads need less");
  } catch (const std::exception& error) {
    return tell(program, kBug, error.what(), "please report this with the command and its inputs");
  }
}

}  // namespace mbtfm
