#include "pipeline/stage/stage.h"

#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/stopwatch.h"
#include "pipeline/contract/version.h"
#include "pipeline/files/hash.h"
#include "pipeline/files/json.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/numerics/machine.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/stage/console.h"
#include "pipeline/stage/effects.h"
#include "pipeline/stage/help.h"
#include "pipeline/stage/manual.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/suggest.h"

namespace mbtfm::stage {

namespace {

using namespace exit_code;

/// What the command line says, before any of it is believed.
struct CommandLine {
  std::map<std::string, std::string> files = {}, values = {};
  std::string config, record, manuals;
  int threads = numerics::available_threads();
  bool is_quiet = false, is_json = false, only_check = false, only_parameters = false, only_version = false;
};

void add_options(CLI::App& app, CommandLine& line, const StageDescription& description, const ParameterList& list) {
  for (const FileArgument& file : description.files) {
    const bool is_output = file.kind == FileArgument::Kind::output || file.kind == FileArgument::Kind::output_folder;
    std::string meaning = help_on("mbtfm-" + description.name, "--" + file.name);
    if (file.kind == FileArgument::Kind::optional_input) meaning += " (optional)";
    app.add_option((file.is_positional ? file.name + "," : "") + "--" + file.name, line.files[file.name], meaning)
        ->type_name(file.kind == FileArgument::Kind::output_folder ? "FOLDER" : "FILE")
        ->group(is_output ? "Outputs" : "Inputs");
  }
  app.add_option("--config,--gel", line.config)->type_name("FILE")->group("Inputs");
  app.add_option("--record", line.record)->type_name("FILE")->group("Outputs");
  app.add_option("--threads", line.threads)->check(CLI::Range(1, 1024))->capture_default_str();
  app.add_flag("--quiet", line.is_quiet);
  app.add_flag("--json", line.is_json);
  app.add_flag("--check", line.only_check);
  app.add_flag("--parameters", line.only_parameters);
  app.add_flag("--version", line.only_version);
  app.add_option("--manuals", line.manuals)->group("");
  for (const Parameter& p : list.all()) {
    std::string meaning = p.meaning;
    if (const auto* choice = std::get_if<Choice>(&p.member)) meaning += " (one of " + listed(choice->words) + ")";
    if (!p.default_value.empty() && !p.is_required) meaning += " [" + p.default_value + "]";
    const std::string group = p.meaning.empty() ? ""
                              : p.table.empty() ? "Parameters of the image"
                                                : "Parameters [" + p.table + "]";
    if (std::holds_alternative<bool*>(p.member))
      app.add_flag("--" + p.flag + "{true}", line.values[p.flag], meaning)->group(group);
    else
      app.add_option("--" + p.flag, line.values[p.flag], meaning)->type_name("")->group(group);
  }
}

WordsOfFlags words_of_flags(const ParameterList& list) {
  WordsOfFlags words;
  for (const Parameter& p : list.all())
    if (const auto* choice = std::get_if<Choice>(&p.member)) words["--" + p.flag] = choice->words;
  return words;
}

/// What a text says: of flags by hand, under `mbtfm run` of the keys of cell.toml.
std::string worded(const ParameterList& list, const StageDescription& description, const std::string& text) {
  if (std::getenv(kRunnerVariable) == nullptr) return text;
  std::map<std::string, std::string> images;
  for (const FileArgument& file : description.files)
    if (!file.image.empty()) images[file.name] = file.image;
  return in_keys(list, images, text);
}

/// As CLI11 takes them, the last first. `--TABLE.KEY` is the flag of that key: two tables may have one of a name.
std::vector<std::string> arguments_of(int argc, char** argv, const ParameterList& list) {
  std::vector<std::string> arguments;
  for (int k = argc; k-- > 1;) {
    std::string& argument = arguments.emplace_back(argv[k]);
    const std::size_t end = std::min(argument.find('='), argument.size()), point = argument.find('.');
    if (!argument.starts_with("--") || point >= end) continue;
    const std::string table = argument.substr(2, point - 2), key = argument.substr(point + 1, end - point - 1);
    const auto meant =
        std::ranges::find_if(list.all(), [&](const Parameter& p) { return p.table == table && p.name == key; });
    if (meant != list.all().end()) argument.replace(2, end - 2, meant->flag);  // else it is refused as it is
  }
  return arguments;
}

/// After an error of the command line: to whom files were given without saying which they are; else nothing.
std::string how_files_are_given(const StageDescription& description, const std::string& error) {
  if (!error.starts_with("The following argument") || error.find(" -") != error.npos) return {};
  std::string flags;
  for (const FileArgument& file : description.files)
    if (file.kind == FileArgument::Kind::input || flags.empty()) flags += " --" + file.name + " ...";
  return "; say what each is: mbtfm-" + description.name + flags;
}

/// In a catch block: what was thrown, in other words.
template <class Words>
[[noreturn]] void rethrow_worded(const Words& words) {
  try {
    throw;
  } catch (const UsageError& error) {
    throw UsageError(words(error.what()));
  } catch (const InputError& error) {
    throw InputError(words(error.where), words(error.expected), words(error.found), words(error.hint));
  }
}

void set_parameters(ParameterList& list, const CommandLine& line, const CLI::App& app) {
  if (!line.config.empty()) read_toml(list, fs::path(line.config));
  for (Parameter& p : list.all())
    if (app.count("--" + p.flag) > 0) set_from_text(p, line.values.at(p.flag));
  list.derive_all();
  check_complete(list);
}

enum class Need { as_described, where_given };

void set_files(StageContext& context, const StageDescription& description, const CommandLine& line, Need need) {
  using Kind = FileArgument::Kind;
  for (const FileArgument& file : description.files) {
    std::string path = line.files.at(file.name);
    const std::string& first = line.files.at(description.files.front().name);
    if (path.empty() && !file.beneath.empty() && !first.empty()) path = fs::path(first) / file.beneath;
    const bool is_output = file.kind == Kind::output || file.kind == Kind::output_folder;
    if (path.empty() && file.kind != Kind::optional_input && need == Need::as_described)
      throw UsageError("--" + file.name + " is missing: " + help_on("mbtfm-" + description.name, "--" + file.name));
    if (path.empty()) continue;
    (is_output ? context.outputs_ : context.inputs_)[file.name] = path;
    if (file.kind == Kind::output_folder && files::is_file(path))
      throw UsageError("--" + file.name + ": expected a folder, found the file " + path + ": give another name");
  }
  if (!line.config.empty()) context.never_written_["config"] = line.config;
  context.never_written_.insert(context.inputs_.begin(), context.inputs_.end());
  for (const auto& [name, output] : context.outputs_) context.expect_no_input(output);
}

/// " 35 % meshes, about 40 s left": the time at the rate so far, where that is long enough to be asked.
std::string progress_line(int percent, std::string_view what, std::optional<double> left_s) {
  std::string line = (percent < 10 ? "   " : percent < 100 ? "  " : " ") + std::to_string(percent) + " % ";
  line += what;
  if (left_s) line += ", about " + readable_duration(*left_s) + " left";
  return line;
}

void write_event(const nlohmann::ordered_json& event, Reader reader) {
  const std::string line = files::json_text(event) + "\n";
  if (reader == Reader::program) return print(line);
  std::fputs(line.c_str(), stderr);
}

/// A line that is overwritten as the work goes on, on a terminal only; or an event for each percent.
Progress progress_for(const std::string& stage, Reader reader) {
  const bool is_event = reader == Reader::program || reader == Reader::json_runner;
  const bool is_shown = is_event || (reader != Reader::nobody && is_terminal());
  return [=, watch = Stopwatch(), last = -1](double fraction, std::string_view what) mutable {
    if (is_stop_asked()) throw Interrupted("interrupted; nothing was written");
    const int percent = static_cast<int>(100 * fraction);
    if (!is_shown || percent == last) return;
    last = percent;
    constexpr double kLong_s = 5, kLittle = 0.02;  // shorter work ends before one asks; too little shows no rate
    const double gone_s = watch.seconds();
    std::optional<double> left_s;
    if (gone_s > kLong_s && fraction > kLittle) left_s = gone_s * (1 - fraction) / fraction;
    if (is_event) {
      nlohmann::ordered_json event = {{"event", "progress"}, {"stage", stage}, {"fraction", fraction}, {"what", what}};
      if (left_s) event["left_s"] = *left_s;
      return write_event(event, reader);
    }
    std::fprintf(stderr, "\r\033[K%s%s", stage.c_str(), progress_line(percent, what, left_s).c_str());
    if (percent >= 100) std::fprintf(stderr, "\r\033[K");
  };
}

/// The last lines of a program that was started by hand.
void print_end(const std::string& stage, const StageReport& report, double seconds, Reader reader) {
  if (reader == Reader::program) {
    write_event({{"event", "stage"},
                 {"stage", stage},
                 {"converged", report.converged},
                 {"seconds", seconds},
                 {"summary", report.summary},
                 {"figures", files::json_of(report.figures)}},
                reader);
    print(files::events_of(stage, report));
  }
  if (!report.converged)
    std::fprintf(stderr, "mbtfm-%s: error: not converged: %s\n", stage.c_str(), report.summary.c_str());
  if (reader != Reader::person) return;
  if (report.converged) std::fprintf(stderr, "mbtfm-%s: %s\n", stage.c_str(), report.summary.c_str());
  for (const Effect& e : report.effects) std::fprintf(stderr, "  %s\n", line_of(e).c_str());
  for (const Finding& f : report.findings) {
    const std::string line = line_of(f);
    std::fprintf(stderr, "  %s\n", (is_open(f) ? warning(line) : line).c_str());
  }
}

/// Content hashes, called as they are when all is in place.
nlohmann::ordered_json hashes_of(const std::vector<StageContext::Pending>& files, const fs::path& folder) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& [at, name] : files)
    if (fs::is_regular_file(at))
      list.push_back({{"file", fs::proximate(name, folder).generic_string()}, {"sha256", files::sha256_of_file(at)}});
  return list;
}

template <class Things>
nlohmann::ordered_json list_of(const Things& things) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& thing : things) list.push_back(files::json_of(thing));
  return list;
}

nlohmann::ordered_json parameters_of(const ParameterList& list) {
  auto json = nlohmann::ordered_json::object();
  for (const Parameter& p : list.all()) {
    auto& table = p.table.empty() ? json : json[p.table];
    table[p.name] = std::visit(
        [&](const auto& member) -> nlohmann::ordered_json {
          using Member = std::decay_t<decltype(member)>;
          if constexpr (std::is_same_v<Member, Choice>)
            return to_text(p);
          else if constexpr (std::is_same_v<Member, std::optional<double>*> ||
                             std::is_same_v<Member, std::optional<int>*>)
            return *member ? nlohmann::ordered_json(**member) : nlohmann::ordered_json();
          else
            return *member;
        },
        p.member);
  }
  return json;
}

double peak_memory_MB() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

void write_record(const fs::path& file, const StageDescription& description, const ParameterList& list,
                  StageContext& context, const StageReport& report, const std::string& started, double seconds) {
  const fs::path folder = fs::absolute(file).parent_path();
  std::vector<StageContext::Pending> inputs;
  for (const fs::path& read : context.read_) inputs.push_back({.temporary = read, .destination = read});
  const nlohmann::ordered_json record = {{"stage", description.name},
                                         {"version", kVersion},
                                         {"parameters", parameters_of(list)},
                                         {"inputs", hashes_of(inputs, folder)},
                                         {"outputs", hashes_of(context.pending_, folder)},
                                         {"started", started},
                                         {"ended", numerics::utc_now()},
                                         {"processor", numerics::processor_name()},
                                         {"threads", context.threads},
                                         {"seconds", seconds},
                                         {"peak_memory_MB", peak_memory_MB()},
                                         {"converged", report.converged},
                                         {"summary", report.summary},
                                         {"figures", files::json_of(report.figures)},
                                         {"effects", list_of(report.effects)},
                                         {"findings", list_of(report.findings)}};
  files::write_text(context.pending_path(file), files::json_text(record, 2) + "\n");
}

/// Remove what an unfinished run has left: temporary files, and folders made for them that are still empty.
void discard(const StageContext& context) {
  std::error_code ignored;
  for (const auto& pending : context.pending_) fs::remove(pending.temporary, ignored);
  for (auto folder = context.made_.rbegin(); folder != context.made_.rend(); ++folder) fs::remove(*folder, ignored);
}

void expect_all_written(const StageContext& context) {
  for (const auto& [temporary, destination] : context.pending_)
    if (!fs::exists(temporary)) throw InternalError(destination.string() + " was announced and not written");
}

/// Before any of them takes its place.
void expect_all_replaceable(const StageContext& context) {
  for (const auto& [temporary, destination] : context.pending_) {
    files::expect_own_kind(destination, files::kind_of_file(temporary));
    if (context.remedy_to_replace.empty() || !files::is_own_file(destination)) continue;
    if (files::sha256_of_file(destination) != files::sha256_of_file(temporary))
      throw UsageError(destination.string() + " is there, with other content; " + context.remedy_to_replace);
  }
}

void commit(const StageContext& context) {
  for (const auto& [temporary, destination] : context.pending_) files::put_in_place(temporary, destination);
}

/// What was noticed, doubted and assumed besides what the stage itself reports.
void add_findings(StageReport& report, const StageContext& context) {
  std::vector<Finding> findings;
  for (const Doubt& doubt : context.doubts) {
    const Finding kind = *noticed(Symptom::unusual_value, 1, {.at = sentence_of(doubt)});
    findings.push_back({.id = kind.id,
                        .severity = kind.severity,
                        .text = kind.text,
                        .number = doubt.value,
                        .threshold = doubt.limit,
                        .number_is = doubt.quantity,
                        .reason = doubt.source,
                        .remedy = doubt.remedy});
  }
  findings.insert(findings.end(), context.findings_.begin(), context.findings_.end());
  report.findings.insert(report.findings.begin(), findings.begin(), findings.end());
  for (const AssumedInput& input : context.assumed)
    report.findings.push_back(*noticed(Symptom::assumed_input, 1, {.at = sentence_of(input) + ". " + input.effect}));
}

int run(const StageDescription& description, ParameterList& list, const CommandLine& line, StageContext context,
        const std::function<StageReport(StageContext&)>& body) {
  const Stopwatch watch;
  const std::string started = numerics::utc_now();
  set_files(context, description, line, Need::as_described);
  context.threads = line.threads;
  const Reader whose = reader(line.is_quiet, line.is_json);
  context.progress = progress_for(description.name, whose);
  try {
    StageReport report = body(context);
    add_findings(report, context);
    report.summary = worded(list, description, report.summary);
    for (Finding& finding : report.findings)
      for (std::string* text : {&finding.text, &finding.remedy}) *text = worded(list, description, *text);
    expect_all_written(context);
    const double seconds = watch.seconds();
    // The record takes its place last: where it is, all that it speaks of is.
    if (!line.record.empty()) write_record(line.record, description, list, context, report, started, seconds);
    expect_all_replaceable(context);
    commit(context);
    print_end(description.name, report, seconds, whose);
    return report.converged ? kDone : kNotSolved;
  } catch (...) {
    discard(context);
    throw;
  }
}

}  // namespace

StageReport read_report(const fs::path& record_file) {
  const files::JsonRecord record(record_file, "a stage's record");
  StageReport report{.converged = record.is_true_or("converged", true),
                     .summary = record.text_or("summary", ""),
                     .findings = files::findings_of(record)};
  for (const auto& [name, value] : record.at("figures").members())  // null: not a number, in JSON
    report.figures.emplace_back(name, value.json().is_null() ? Value(std::string()) : value.figure());
  if (const auto effects = record.find("effects"))
    for (const files::JsonRecord& effect : effects->list()) report.effects.push_back(files::effect_of(effect));
  return report;
}

fs::path StageContext::input(const std::string& name) {
  MBTFM_ASSERT(inputs_.contains(name));
  read_.push_back(inputs_.at(name));
  return inputs_.at(name);
}

fs::path StageContext::input(const std::string& name, const std::vector<std::string>& files) {
  MBTFM_ASSERT(inputs_.contains(name));
  for (const std::string& file : files) read_.push_back(inputs_.at(name) / file);
  return inputs_.at(name);
}

fs::path StageContext::output(const std::string& name) { return output(name, {}); }

fs::path StageContext::output(const std::string& name, const std::string& file) {
  MBTFM_ASSERT(outputs_.contains(name));
  const fs::path& output = outputs_.at(name);
  // The output folder may be a link, of whoever named it; folders in it may not.
  if (const fs::path below = fs::path(file).parent_path(); !below.empty())
    files::inside(output, below, output.string());
  return pending_path(file.empty() ? output : output / file);
}

fs::path StageContext::output_beside(const std::string& name, const std::string& ending) {
  MBTFM_ASSERT(outputs_.contains(name));
  const fs::path& output = outputs_.at(name);
  return pending_path(output.parent_path() / (output.stem().string() + ending));
}

void StageContext::expect_no_input(const fs::path& output) const {
  std::error_code is_new;
  for (const auto& [name, input] : never_written_)
    if (files::is_file(input) && fs::equivalent(input, output, is_new))
      throw UsageError(output.string() + " is the file of --" + name +
                       ", which would be lost: give the output another name");
}

fs::path StageContext::pending_path(const fs::path& destination) {
  expect_no_input(destination);
  make_folder(destination.parent_path());
  const fs::path temporary = files::temporary_name(destination);
  files::make_way(temporary);  // whoever writes it, VTK or a TIFF library, opens it by name
  pending_.push_back({.temporary = temporary, .destination = destination});
  return temporary;
}

void StageContext::notice(const std::optional<Finding>& finding) {
  const auto is_same = [&](const Finding& f) { return f.id == finding->id && f.text == finding->text; };
  if (finding && std::ranges::none_of(findings_, is_same)) findings_.push_back(*finding);
}

void StageContext::doubt(const std::optional<Doubt>& doubt, const std::string& where) {
  if (!doubt) return;
  require_possible(*doubt, allowed_, where);
  const auto is_same = [&](const Doubt& d) { return d.id == doubt->id && d.value == doubt->value; };
  if (std::ranges::any_of(doubts, is_same)) return;  // of another frame or channel
  doubts.push_back(*doubt);
}

void StageContext::make_folder(const fs::path& folder) {
  if (folder.empty() || fs::exists(folder)) return;
  make_folder(folder.parent_path());
  std::error_code error;
  fs::create_directory(folder, error);
  if (error) throw OutputError("cannot make the folder " + folder.string() + ": " + error.message());
  made_.push_back(folder);
}

int run_stage(const StageDescription& description, int argc, char** argv,
              const std::function<void(ParameterList&)>& declare_parameters,
              const std::function<StageReport(StageContext&)>& body, const std::function<void(StageContext&)>& look) {
  const std::string& stage = description.name;
  numerics::restart_as_blas_needs(argv);
  watch_signals(SecondSignal::ends_at_once);
  numerics::keep_blas_to_one_thread();
  ParameterList list;
  try {
    declare_parameters(list);
    CheckParameters checks;
    if (has_plausible_quantity(list)) declare(list, checks);
    CommandLine line;
    CLI::App app("", "mbtfm-" + stage);
    add_options(app, line, description, list);
    describe(app, "mbtfm-" + stage);
    try {
      app.parse(arguments_of(argc, argv, list));
    } catch (const CLI::CallForHelp&) {
      print(app.help());
      return kDone;
    } catch (const CLI::ParseError& error) {
      throw UsageError(error.what() + suggestion(app, error.what()) + how_files_are_given(description, error.what()) +
                       " (see mbtfm-" + stage + " --help)");
    }
    if (line.only_version || line.only_parameters) {
      print(line.only_version ? "mbtfm-" + stage + " " + kVersion + "\n" : to_markdown(list));
      return kDone;
    }
    if (!line.manuals.empty()) {
      write_manuals(app, words_of_flags(list), line.manuals);
      return kDone;
    }
    set_parameters(list, line, app);
    StageContext context;
    context.allowed_ = allowed_quantities(checks);
    context.doubts = doubts_about(list, context.allowed_);
    context.assumed = assumed_inputs(list);
    if (line.only_check) {
      set_files(context, description, line, Need::where_given);
      if (look) look(context);
      return kDone;
    }
    numerics::reserve_blas_buffers(line.threads);
    return run(description, list, line, std::move(context), body);
  } catch (...) {
    try {
      rethrow_worded([&](const std::string& text) { return worded(list, description, text); });
    } catch (...) {
      return report_current_exception("mbtfm-" + stage);
    }
  }
}

}  // namespace mbtfm::stage
