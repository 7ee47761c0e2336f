/// The frame of every executable: arguments, parameters, errors to exit codes, atomic outputs, provenance.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/stage_report.h"
#include "pipeline/contract/work.h"
#include "pipeline/stage/parameters_fwd.h"
#include "pipeline/stage/plausible.h"

namespace mbtfm::stage {

struct FileArgument {
  enum class Kind { input, optional_input, output, output_folder };
  std::string name;  ///< the flag --name
  Kind kind = Kind::input;
  bool is_positional = false;  ///< may be given without its flag
  std::string image = {};      ///< key of [images] from which `mbtfm run` takes it
  std::string beneath = {};    ///< of an output that need not be given: its name in the folder that is the first input
};

struct StageDescription {
  std::string name;  ///< the executable is mbtfm-NAME, of which help.txt has the purpose, and what each file is
  std::vector<FileArgument> files = {};
};

/// A stage's files and surroundings. Outputs go to temporary names and take their own only when the stage is done.
class StageContext {
 public:
  int threads = 1;
  Progress progress;
  /// About inputs and results, so far; they become findings of the stage.
  std::vector<Doubt> doubts;
  std::vector<AssumedInput> assumed;
  /// Add a finding, if there is one that was not there yet.
  void notice(const std::optional<Finding>& finding);

  /// A doubt about an input or a result, if there is one. @param where  as in messages
  /// @throws InputError where it is refused and [checks] does not allow it
  void doubt(const std::optional<Doubt>& doubt, const std::string& where);
  /// The same about a result of the table of plausible values.
  void expect_plausible(std::string_view id, double value) { doubt(doubt_about(id, value), std::string(id)); }

  /// Path of an input that was given.
  fs::path input(const std::string& name);
  /// An input that is a folder, of which these files are read.
  fs::path input(const std::string& name, const std::vector<std::string>& files);
  bool has_input(const std::string& name) const { return inputs_.contains(name); }
  /// Temporary path to write an output to.
  fs::path output(const std::string& name);
  /// Temporary path for `file` of an output folder.
  fs::path output(const std::string& name, const std::string& file);
  /// Temporary path for a file beside the output `name`, called after it: its name with `ending` for its extension.
  fs::path output_beside(const std::string& name, const std::string& ending);

  /// Empty: a file of the stage's own kind may be replaced. Else only by the same bytes, and this is what to do.
  std::string remedy_to_replace;

  // used by run_stage
  std::vector<Finding> findings_;
  std::vector<std::string> allowed_;  ///< quantities whose values are not refused
  /// Temporary path, free to be written to, of what is to be `destination`.
  fs::path pending_path(const fs::path& destination);
  /// @throws UsageError if it is one of the files that the command line gives as inputs
  void expect_no_input(const fs::path& output) const;
  std::map<std::string, fs::path> inputs_, outputs_, never_written_;
  std::vector<fs::path> read_, made_;
  struct Pending {
    fs::path temporary, destination;
  };
  std::vector<Pending> pending_;

 private:
  /// Folders that outputs need are made, and unmade where the stage fails.
  void make_folder(const fs::path& folder);
};

/// What a stage reported when it wrote this record. @throws InputError where it is no record of a stage
StageReport read_report(const fs::path& record_file);

/// Parse the arguments, read the parameters, call `body`, put the outputs in place, write the record, return the exit
/// code. Flags of every stage: --help --version --threads --quiet --config (or --gel)
/// --record --check --parameters.
/// @param look  at the inputs that are given with --check: what the body would refuse at once. None: --check reads the
///              parameters alone
int run_stage(const StageDescription& description, int argc, char** argv,
              const std::function<void(ParameterList&)>& declare_parameters,
              const std::function<StageReport(StageContext&)>& body,
              const std::function<void(StageContext&)>& look = {});

/// The same for a struct with a `declare(ParameterList&, Parameters&)` beside it.
template <class Parameters>
int run_stage(const StageDescription& description, int argc, char** argv,
              const std::function<StageReport(const Parameters&, StageContext&)>& body,
              const std::function<void(const Parameters&, StageContext&)>& look = {}) {
  Parameters parameters;
  return run_stage(
      description, argc, argv, [&](ParameterList& list) { declare(list, parameters); },
      [&](StageContext& context) { return body(parameters, context); },
      [&](StageContext& context) {
        if (look) look(parameters, context);
      });
}

}  // namespace mbtfm::stage
