/// What can go wrong, one type for each kind; `run_stage` turns them into messages and exit codes.
#pragma once

#include <stdexcept>
#include <string>

#include "pipeline/contract/report.h"

namespace mbtfm {

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

/// Not converged or ill-posed. The outputs are still written, marked as such. Exit code 4.
struct NotSolved : std::runtime_error {
  Report report;
  explicit NotSolved(Report what) : std::runtime_error(what.reason), report(std::move(what)) {}
};

/// Cannot write. Exit code 5.
struct OutputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Our bug. Exit code 70.
struct InternalError : std::logic_error {
  using std::logic_error::logic_error;
};

/// @throws InternalError with file and line where `holds` is false.
#define MBTFM_ASSERT(holds)                                                                                           \
  do {                                                                                                                \
    if (!(holds)) throw ::mbtfm::InternalError(std::string(__FILE__) + ":" + std::to_string(__LINE__) + ": " #holds); \
  } while (false)

}  // namespace mbtfm
