/// What can go wrong, one type for each kind, and how a program ends with it.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

namespace mbtfm {

struct Report;

/// How a program ends (docs/commands.md, "Exit codes").
namespace exit_code {
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;  ///< of a batch: some cells failed
inline constexpr int kUsage = 2;
inline constexpr int kInput = 3;
inline constexpr int kNotSolved = 4;  ///< the outputs are there, marked
inline constexpr int kOutput = 5;
inline constexpr int kResources = 6;      ///< out of memory or time; nothing was written
inline constexpr int kNoAnswer = 7;       ///< ill-posed or not converged; nothing was written
inline constexpr int kBug = 70;           ///< EX_SOFTWARE of sysexits.h
inline constexpr int kBusy = 75;          ///< EX_TEMPFAIL of sysexits.h: another run works on the cell
inline constexpr int kInterrupted = 130;  ///< as shells count: 128 + SIGINT
}  // namespace exit_code

/// A wrong flag, a parameter out of range, a violated relation between parameters. Exit code 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A file is missing, truncated, malformed or breaks an invariant. Exit code 3.
struct InputError : std::runtime_error {
  std::string where, expected, found, hint;
  InputError(std::string at, std::string wanted, std::string got, std::string advice = {})
      : std::runtime_error(at + ": expected " + wanted + ", found " + got),
        where(std::move(at)),
        expected(std::move(wanted)),
        found(std::move(got)),
        hint(std::move(advice)) {}
};

/// A value breaks its type's invariant: what `check` throws. Readers add the file and line and throw InputError.
struct InvalidData : std::invalid_argument {
  std::string element, expected, found;
  InvalidData(std::string at, std::string wanted, std::string got)
      : std::invalid_argument(at + ": expected " + wanted + ", found " + got),
        element(std::move(at)),
        expected(std::move(wanted)),
        found(std::move(got)) {}
};

/// Not converged or ill-posed. Whoever catches it and still writes outputs marks them and ends with exit code 4; where
/// nothing catches it, nothing is written: exit code 7.
struct NotSolved : std::runtime_error {
  std::shared_ptr<Report> report;  ///< not null; copies share it
  explicit NotSolved(Report what);
};

/// What is asked for takes more memory than there is, which is known before it is taken. Exit code 6.
struct OutOfMemory : NotSolved {
  explicit OutOfMemory(std::string reason);
};

/// Cannot write. Exit code 5.
struct OutputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Ctrl-C, SIGTERM or a closed terminal; what is left undone is said in the message. Exit code 130.
struct Interrupted : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Our bug. Exit code 70.
struct InternalError : std::logic_error {
  using std::logic_error::logic_error;
};

/// @throws InternalError with file and line where `holds` is false. The file without its folder: objects are the same
/// in every clone.
#define MBTFM_ASSERT(holds)                                                                                    \
  do {                                                                                                         \
    if (!(holds))                                                                                              \
      throw ::mbtfm::InternalError(std::string(__FILE_NAME__) + ":" + std::to_string(__LINE__) + ": " #holds); \
  } while (false)

/// In a catch block: report what was thrown, with its hint, as an error of `program` on stderr.
/// @returns its exit code
int report_current_exception(const std::string& program);

}  // namespace mbtfm
