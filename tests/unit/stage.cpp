#include <unistd.h>
#include <CLI/CLI.hpp>
#include <new>
#include <system_error>

#include "pipeline/contract/report.h"
#include "pipeline/files/text.h"
#include "pipeline/stage/console.h"
#include "pipeline/stage/manual.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "pipeline/stage/suggest.h"
#include "tests/support/findings.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm {
namespace {

struct Lengths {
  double length_um = 1.5;
  bool is_fast = false;
};
void declare(stage::ParameterList& list, Lengths& e) {
  list.table("network");
  list.add("length_um", e.length_um, Range::positive(), "length (um)");
  list.add("is_fast", e.is_fast, "whether to be fast");
}

const stage::StageDescription kDescription = {
    .name = "example",
    .files = {{"in", stage::FileArgument::Kind::input}, {"out", stage::FileArgument::Kind::output_folder}}};

class Stage : public ::testing::Test {
 protected:
  int run(std::vector<std::string> arguments,
          const std::function<StageReport(const Lengths&, stage::StageContext&)>& body) {
    arguments.insert(arguments.begin(), "mbtfm-example");
    std::vector<char*> argv;
    for (std::string& a : arguments) argv.push_back(a.data());
    return run_stage<Lengths>(kDescription, static_cast<int>(argv.size()), argv.data(), body);
  }
  std::vector<std::string> files() const {
    return {"--quiet", "--in", (folder_ / "in.txt").string(), "--out", (folder_ / "out").string()};
  }
  std::vector<std::string> files_and(std::vector<std::string> more) const {
    std::vector<std::string> all = files();
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  void SetUp() override { files::write_text(folder_ / "in.txt", "in"); }
  TemporaryFolder folder_;
};

StageReport write_two(const Lengths&, stage::StageContext& context) {
  context.input("in");
  files::write_text(context.output("out", "a.csv"), "a");
  files::write_text(context.output("out", "deep/b.csv"), "b");
  return {.summary = "two files", .figures = {{"n", std::int64_t{2}}}};
}

TEST_F(Stage, outputs_and_the_record_are_in_place_when_it_is_done) {
  EXPECT_EQ(run(files_and({"--record", (folder_ / "record.json").string(), "--length_um", "2.5", "--is_fast"}),
                [](const Lengths& e, stage::StageContext& context) {
                  EXPECT_EQ(e.length_um, 2.5);
                  EXPECT_TRUE(e.is_fast);
                  return write_two(e, context);
                }),
            0);
  EXPECT_EQ(files::read_text(folder_ / "out/a.csv"), "a");
  EXPECT_EQ(files::read_text(folder_ / "out/deep/b.csv"), "b");
  EXPECT_TRUE(has_words(files::read_text(folder_ / "record.json"), "\"stage\": \"example\"", "\"length_um\": 2.5",
                        "\"in.txt\"", "\"out/deep/b.csv\"", "\"n\": 2", "\"summary\": \"two files\""));
}

struct OnGel {
  Gel gel;
};
void declare(stage::ParameterList& list, OnGel& p) { declare(list, p.gel); }

TEST_F(Stage, what_was_assumed_and_what_is_unusual_are_findings_in_the_record) {
  const auto record_of = [&](std::vector<std::string> flags) {
    flags.insert(flags.begin(), {"mbtfm-example", "--record", (folder_ / "record.json").string()});
    for (const std::string& file : files()) flags.push_back(file);
    std::vector<char*> argv;
    for (std::string& a : flags) argv.push_back(a.data());
    EXPECT_EQ(stage::run_stage<OnGel>(kDescription, static_cast<int>(argv.size()), argv.data(),
                                      [](const OnGel&, stage::StageContext&) { return StageReport{}; }),
              0);
    return files::read_text(folder_ / "record.json");
  };
  const std::string sound =
      record_of({"--youngs_modulus_kPa", "8.4", "--poisson_ratio", "0.49", "--thickness_um", "60"});
  test::expect_silent({"assumed-input", "unusual-value"}, sound);
  const std::string doubtful = record_of({"--youngs_modulus_kPa", "300", "--poisson_ratio", "0.49"});
  EXPECT_TRUE(test::fires("assumed-input", doubtful)) << doubtful;
  EXPECT_TRUE(test::fires("unusual-value", doubtful)) << doubtful;
}

TEST_F(Stage, a_failure_leaves_no_file_and_no_folder_and_has_its_code) {
  const std::vector<std::pair<int, std::function<void()>>> failures = {
      {2, [] { throw UsageError("usage"); }},
      {3, [] { throw InputError("a.csv:3", "a number", "'x'"); }},
      {3, [] { throw InvalidData("adhesion 3", "an area", "none"); }},
      {7, [] { throw NotSolved(Report{.reason = "reason"}); }},
      {5, [] { throw OutputError("disk full"); }},
      {6, [] { throw OutOfMemory("the mesh would take 70 GB"); }},
      {6, [] { throw std::bad_alloc(); }},
      {6, [] { throw std::length_error("vector::_M_default_append"); }},
      {6, [] { throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again)); }},
      {6,
       [] { throw std::runtime_error("OpenCV(4.6) alloc.cpp: error: (-4:Insufficient memory) Failed to allocate"); }},
      {70, [] { throw InternalError("bug"); }},
  };
  for (const auto& [code, fail] : failures) {
    EXPECT_EQ(run(files(),
                  [&](const Lengths& e, stage::StageContext& context) {
                    write_two(e, context);
                    fail();
                    return StageReport{};
                  }),
              code);
    EXPECT_FALSE(fs::exists(folder_ / "out")) << "code " << code;
  }
}

TEST_F(Stage, what_the_command_line_gives_as_an_input_is_no_output) {
  fs::create_directories(folder_ / "out");
  fs::rename(folder_ / "in.txt", folder_ / "out/a.csv");
  EXPECT_EQ(run({"--quiet", "--in", (folder_ / "out/a.csv").string(), "--out", (folder_ / "out").string()}, write_two),
            2);
  EXPECT_EQ(
      run({"--quiet", "--in", (folder_ / "out/a.csv").string(), "--out", (folder_ / "out/a.csv").string()}, write_two),
      2);
  EXPECT_EQ(files::read_text(folder_ / "out/a.csv"), "in");
}

TEST_F(Stage, a_file_of_another_kind_is_not_written_over_and_nothing_else_is_written) {
  fs::create_directories(folder_ / "out/deep");
  files::write_text(folder_ / "out/deep/b.csv", "a table, of the user's");
  EXPECT_EQ(run(files(), write_two), 5);
  EXPECT_EQ(files::read_text(folder_ / "out/deep/b.csv"), "a table, of the user's");
  EXPECT_FALSE(fs::exists(folder_ / "out/a.csv"));
}

TEST_F(Stage, links_in_the_place_of_outputs_are_replaced_not_followed) {
  files::write_text(folder_ / "precious", "precious");
  fs::create_directories(folder_ / "out/deep");
  const fs::path record = folder_ / "record.json";
  for (const fs::path& output : {folder_ / "out/a.csv", folder_ / "out/deep/b.csv", record}) {
    fs::create_symlink(folder_ / "precious", output);
    fs::create_symlink(folder_ / "precious", files::temporary_name(output));
  }
  EXPECT_EQ(run(files_and({"--record", record.string()}), write_two), 0);
  EXPECT_EQ(files::read_text(folder_ / "precious"), "precious");
  for (const fs::path& output : {folder_ / "out/a.csv", folder_ / "out/deep/b.csv", record})
    EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(output))) << output;
}

TEST_F(Stage, a_folder_among_the_outputs_that_is_a_link_is_refused) {
  fs::create_directories(folder_ / "elsewhere");
  fs::create_directories(folder_ / "out");
  fs::create_symlink("../elsewhere", folder_ / "out/deep");
  EXPECT_EQ(run(files(), write_two), 3);
  EXPECT_TRUE(fs::is_empty(folder_ / "elsewhere"));
  EXPECT_FALSE(fs::exists(folder_ / "out/a.csv"));
  fs::rename(folder_ / "out", folder_ / "real");
  fs::remove(folder_ / "real/deep");
  fs::create_symlink("real", folder_ / "out");  // the folder that --out names may be one
  EXPECT_EQ(run(files(), write_two), 0);
  EXPECT_EQ(files::read_text(folder_ / "real/deep/b.csv"), "b");
}

TEST_F(Stage, what_has_not_converged_is_written_and_marked) {
  EXPECT_EQ(run(files_and({"--record", (folder_ / "record.json").string()}),
                [](const Lengths& e, stage::StageContext& context) {
                  StageReport report = write_two(e, context);
                  report.converged = false;
                  return report;
                }),
            4);
  EXPECT_TRUE(fs::exists(folder_ / "out/a.csv"));
  EXPECT_TRUE(has_words(files::read_text(folder_ / "record.json"), "\"converged\": false"));
}

TEST_F(Stage, flags_win_over_the_file_and_the_file_over_the_default) {
  files::write_text(folder_ / "cell.toml", "[network]\nlength_um = 3\nis_fast = true\n");
  const std::string config = (folder_ / "cell.toml").string();
  const auto expect_length = [](double length_um) {
    return [length_um](const Lengths& e, stage::StageContext& context) {
      EXPECT_EQ(e.length_um, length_um);
      return write_two(e, context);
    };
  };
  EXPECT_EQ(run(files(), expect_length(1.5)), 0);
  EXPECT_EQ(run(files_and({"--config", config}), expect_length(3)), 0);
  EXPECT_EQ(run(files_and({"--config", config, "--length_um", "4"}), expect_length(4)), 0);
}

TEST_F(Stage, wrong_flags_and_values_are_usage_errors_and_a_wrong_file_an_input_error) {
  EXPECT_EQ(run(files_and({"--lenght_um", "2"}), write_two), 2);
  EXPECT_EQ(run(files_and({"--length_um", "-2"}), write_two), 2);
  EXPECT_EQ(run(files_and({"--fit.length_um", "2"}), write_two), 2) << "a table that the program lacks";
  EXPECT_EQ(run(files_and({"--network.length_um", "2"}), write_two), 0);
  fs::remove_all(folder_ / "out");
  EXPECT_EQ(run({"--out", "x"}, write_two), 2) << "an input is missing";
  EXPECT_EQ(run(files_and({"--config", (folder_ / "none.toml").string()}), write_two), 3);
  files::write_text(folder_ / "bad.toml", "[network]\nlength = 3\n");
  EXPECT_EQ(run(files_and({"--check", "--config", (folder_ / "bad.toml").string()}), write_two), 3);
  EXPECT_FALSE(fs::exists(folder_ / "out")) << "--check runs nothing";
}

TEST(Suggestion, names_the_flag_or_command_that_was_meant_and_nothing_where_none_is_alike) {
  CLI::App app("what it does", "mbtfm");
  app.add_subcommand("batch", "")->add_option("--threads", "");
  app.get_subcommand("batch")->add_option("--jobs", "");
  app.add_subcommand("verify", "");
  const auto after = [&](std::vector<std::string> arguments) {
    std::ranges::reverse(arguments);
    const auto error = test::caught<CLI::ParseError>([&] { app.parse(arguments); });
    return error ? stage::suggestion(app, error->what()) : std::string("parsed");
  };
  EXPECT_EQ(after({"batch", "--thread=2"}), "; did you mean '--threads'?");
  EXPECT_EQ(after({"bacth"}), "; did you mean 'batch'?");
  EXPECT_EQ(after({"verfy", "CELL"}), "; did you mean 'verify'?");
  const std::string none = "; what is known of a cell is written in its cell.toml";
  EXPECT_EQ(after({"batch", "--xyz"}), none);
  EXPECT_EQ(after({"batch", "--cell"}), none) << "of --help it has half of the letters, and the dashes";
  EXPECT_EQ(after({"batch", "--cores", "2"}), "; did you mean '--threads'?") << "another program's word";
  EXPECT_EQ(after({"batch", "--resume"}), "; a run goes on by itself where the last one stopped");
  EXPECT_EQ(after({"all"}), "; did you mean 'batch'?");
  EXPECT_EQ(after({"batch", "-j4"}), "; did you mean '--jobs'?");
  EXPECT_EQ(after({"batch", "\u2013threads"}), "; '\u2013threads' begins with a long dash: type --threads");
  EXPECT_EQ(after({"batch", "\u2013-threads", "2"}), "; '\u2013-threads' begins with a long dash: type --threads");
  EXPECT_EQ(after({"batch", "x", "=", "4"}), "; write no blanks around =");
  EXPECT_EQ(after({"Batch"}), "; did you mean 'batch'?");
  EXPECT_EQ(after({"btach"}), "; did you mean 'batch'?") << "one slip";
  EXPECT_EQ(after({"start"}), "; the commands are batch, verify");
}

TEST(Suggestion, takes_a_word_s_beginning_end_or_part_for_it_and_no_two_letters) {
  const std::vector<std::string> known = {"--beads_per_um2", "--threads",          "--lambda_by", "--lambda_um_per_kPa",
                                          "track",           "youngs_modulus_kPa", "layer"};
  EXPECT_EQ(stage::did_you_mean(known, "--beads"), "did you mean '--beads_per_um2'?") << "nearer than --threads";
  EXPECT_EQ(stage::did_you_mean(known, "--lambda"), "did you mean '--lambda_by' or '--lambda_um_per_kPa'?");
  EXPECT_EQ(stage::did_you_mean(known, "tracking"), "did you mean 'track'?");
  EXPECT_EQ(stage::did_you_mean(known, "modulus"), "did you mean 'youngs_modulus_kPa'?");
  EXPECT_EQ(stage::did_you_mean(known, "E"), "did you mean 'youngs_modulus_kPa'?");
  EXPECT_EQ(stage::did_you_mean(known, "layr"), "did you mean 'layer'?");
  EXPECT_EQ(stage::did_you_mean({"adhesion_time", "adhesion_smallest_area", "fibre_widths"}, "adhesion_min_area"),
            "did you mean 'adhesion_smallest_area'?")
      << "more parts are the same, more letters are not";
  EXPECT_EQ(stage::did_you_mean({"adhesion_time", "fibre_width"}, "--fibers"), "did you mean 'fibre_width'?");
  for (const char* word : {"la", "y", "", "-", "kPas"}) EXPECT_EQ(stage::did_you_mean(known, word), "") << word;
}

TEST(Manual, has_every_option_and_hides_what_help_hides) {
  CLI::App app("what it does: 'all', and more", "mbtfm-example");
  app.add_option("--length_um", "length (um); a line\n.that begins with a point")->type_name("FILE");
  bool is_secret = false;
  app.add_flag("--secret", is_secret, "nobody's")->group("");
  const std::string page = stage::manual_page(app);
  EXPECT_TRUE(has_words(page, "\\-\\-length_um"));
  EXPECT_TRUE(has_words(page, "\n\\&.that begins")) << "troff takes a leading point for a command";
  for (const std::string& text :
       {page, stage::bash_completion(app, {}), stage::zsh_completion(app, {}), stage::fish_completion(app, {})})
    EXPECT_FALSE(has_words(text, "secret"));
}

TEST(Completion, offers_the_words_of_a_choice) {
  CLI::App app("what it does", "mbtfm-example");
  app.add_option("--model", "which");
  const stage::WordsOfFlags words = {{"--model", {"layer", "half-space"}}};
  EXPECT_TRUE(has_words(stage::bash_completion(app, words), "--model) COMPREPLY=($(compgen -W 'layer half-space'"));
  EXPECT_TRUE(has_words(stage::zsh_completion(app, words), ":(layer half-space)"));
  EXPECT_TRUE(has_words(stage::fish_completion(app, words), "-l model -d 'which' -x -a 'layer half-space'"));
}

TEST(Console, colours_warnings_on_a_terminal_alone_and_never_against_no_color) {
  setenv("MBTFM_TERMINAL", "1", 1);
  setenv("TERM", "xterm", 1);
  unsetenv("NO_COLOR");
  EXPECT_EQ(stage::warning("x"), "\033[33mx\033[0m");
  setenv("NO_COLOR", "1", 1);
  EXPECT_EQ(stage::warning("x"), "x");
  unsetenv("NO_COLOR");
  unsetenv("MBTFM_TERMINAL");
  if (isatty(STDERR_FILENO) == 0) EXPECT_EQ(stage::warning("x"), "x");
}

}  // namespace
}  // namespace mbtfm
