/// What a program meets outside of its own: a reader that goes away, a terminal that closes, no memory, a full device,
/// names that are no text. Every time: an answer, or an error with its code, and nothing half written.
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "pipeline/contract/errors.h"
#include "pipeline/files/names.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

using namespace exit_code;

const std::string kBin = test::build_folder().string() + "/bin/";

/// The first of the command's words is a program of build/bin.
pid_t start(std::vector<std::string> command, int output, int messages, void (*hangup)(int) = SIG_DFL) {
  command[0] = kBin + command[0];
  std::vector<char*> arguments;
  for (std::string& word : command) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const pid_t pid = fork();
  if (pid != 0) return pid;
  std::signal(SIGHUP, hangup);
  std::signal(SIGPIPE, SIG_DFL);
  dup2(output, STDOUT_FILENO);
  dup2(messages, STDERR_FILENO);
  execv(arguments[0], arguments.data());
  _exit(127);
}

int code_of(pid_t pid) {
  int status = 0;
  waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// The writing end of a pipe that nobody reads.
int broken_pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw OutputError("pipe2");
  close(ends[0]);
  return ends[1];
}

int nowhere() { return open("/dev/null", O_WRONLY | O_CLOEXEC); }

std::vector<pid_t> children_of(pid_t pid) {
  std::vector<pid_t> all;
  std::error_code has_ended;
  for (const auto& task : fs::directory_iterator("/proc/" + std::to_string(pid) + "/task", has_ended)) {
    std::ifstream children(task.path() / "children");
    for (pid_t child = 0; children >> child;) all.push_back(child);
  }
  return all;
}

/// Look until a stage runs.
std::vector<pid_t> wait_for_children_of(pid_t pid) {
  for (;;) {
    const std::vector<pid_t> children = children_of(pid);
    if (!children.empty() || waitpid(pid, nullptr, WNOHANG) != 0) return children;
    std::this_thread::yield();
  }
}

bool is_running(pid_t pid) { return kill(pid, 0) == 0; }

class Surroundings : public ::testing::Test {
 protected:
  /// A small cell with images: two adhesions and a fibre.
  static void SetUpTestSuite() {
    scene_ = new TemporaryFolder;
    const fs::path cell = *scene_ / "cell";
    output_of("mbtfm-simulate --scenario two-adhesions --seed 3 --beads 300 --images --quiet --out " + cell.string());
    files::write_text(cell / "cell.toml", files::read_text(cell / "cell.toml") +
                                              "[fit]\nn_meshes = 1\n[substrate]\nmodel = \"layer\"\n[network]\n");
  }
  static void TearDownTestSuite() { delete scene_; }
  void SetUp() override { put_cell(cell_); }

  void put_cell(const fs::path& place) const {
    fs::create_directories(place.parent_path());
    fs::copy(*scene_ / "cell", place, fs::copy_options::recursive);
  }
  void set(const std::string& network) const {
    files::write_text(cell_ / "cell.toml", files::read_text(cell_ / "cell.toml") + network + "\n");
  }
  void expect_nothing_half_written() const {
    for (const auto& entry : fs::recursive_directory_iterator(cell_))
      EXPECT_FALSE(entry.path().filename().string().starts_with(".partial-")) << entry.path();
  }

  TemporaryFolder folder_;
  const fs::path study_ = folder_ / "study";
  const fs::path cell_ = study_ / "cell";
  static inline TemporaryFolder* scene_ = nullptr;
};

TEST_F(Surroundings, what_cannot_be_printed_is_an_output_error) {
  const std::string command = run_program("mbtfm run --quiet " + cell_.string()).output;
  ASSERT_EQ(command, "");
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"mbtfm", "batch", "--list", study_.string()},
                                             {"mbtfm", "verify", cell_.string()},
                                             {"mbtfm", "compare", cell_.string()},
                                             {"mbtfm", "--help"},
                                             {"mbtfm", "--version"},
                                             {"mbtfm", "run", "--help"},
                                             {"mbtfm-network", "--help"},
                                             {"mbtfm-network", "--version"},
                                             {"mbtfm-network", "--parameters"}}) {
    SCOPED_TRACE(words[0] + " " + words[1]);
    const fs::path log = folder_ / "log";
    const int messages = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    const int full = open("/dev/full", O_WRONLY | O_CLOEXEC);
    EXPECT_EQ(code_of(start(words, full, messages)), kOutput);
    EXPECT_TRUE(has_words(files::read_text(log), "standard output"));
    close(full);
    close(messages);
  }
}

TEST_F(Surroundings, a_list_whose_reader_has_gone_ends_as_any_program_does) {
  const int pipe = broken_pipe();
  EXPECT_EQ(code_of(start({"mbtfm", "batch", "--list", study_.string()}, pipe, nowhere())), 128 + SIGPIPE);
  EXPECT_EQ(code_of(start({"mbtfm-network", "--parameters"}, pipe, nowhere())), 128 + SIGPIPE);
}

TEST_F(Surroundings, work_goes_on_where_nobody_reads_the_messages) {
  const int pipe = broken_pipe();
  EXPECT_EQ(code_of(start({"mbtfm", "run", cell_.string()}, pipe, pipe)), kDone);
  EXPECT_TRUE(fs::exists(cell_ / "report.html"));
  fs::remove_all(cell_ / "3_network");
  const std::string cell = (cell_ / "1_segment").string(), out = (cell_ / "3_network/network.vtu").string();
  EXPECT_EQ(code_of(start({"mbtfm-network", "--cell", cell, "--out", out}, pipe, pipe)), kDone);
  EXPECT_TRUE(fs::exists(out));
}

TEST_F(Surroundings, a_closed_terminal_stops_the_work_and_all_that_was_started) {
  const pid_t run = start({"mbtfm", "run", cell_.string()}, nowhere(), nowhere());
  const std::vector<pid_t> stages = wait_for_children_of(run);
  ASSERT_FALSE(stages.empty());
  kill(run, SIGHUP);
  EXPECT_EQ(code_of(run), kInterrupted);
  for (const pid_t stage : stages) EXPECT_FALSE(is_running(stage));
  expect_nothing_half_written();
  EXPECT_EQ(run_program("mbtfm run --quiet " + cell_.string()).code, kDone) << "the next call goes on";
}

TEST_F(Surroundings, under_nohup_a_closed_terminal_is_no_reason_to_stop) {
  const pid_t run = start({"mbtfm", "run", cell_.string()}, nowhere(), nowhere(), SIG_IGN);
  ASSERT_FALSE(wait_for_children_of(run).empty());
  kill(run, SIGHUP);
  EXPECT_EQ(code_of(run), kDone);
}

TEST_F(Surroundings, little_memory_is_an_answer_or_an_error_and_never_a_hang) {
  // timeout(1) ends a hang, with a code that is neither; its kill is what one that waits for ever in a library obeys
  for (const char* kilobytes : {"150000", "250000", "350000", "450000"}) {
    SCOPED_TRACE(kilobytes);
    fs::remove_all(cell_);
    put_cell(cell_);
    const Outcome run = run_program("mbtfm run --threads 2 --quiet " + cell_.string(),
                                    "ulimit -v " + std::string(kilobytes) + "; timeout -s KILL 60 ");
    EXPECT_TRUE(run.code == kDone || run.code == kResources || run.code == 127) << run.code << ": " << run.output;
    if (run.code == kResources) EXPECT_TRUE(has_words(run.output, "memory"));
    if (run.code == 127) EXPECT_TRUE(has_words(run.output, "shared librar"));
    expect_nothing_half_written();
    EXPECT_EQ(fs::exists(cell_ / "4_fit/tensions.csv"), run.code == kDone);
  }
}

TEST_F(Surroundings, a_stage_alone_knows_how_little_memory_it_has) {
  for (const char* stage : {"mbtfm-fit", "mbtfm-substrate", "mbtfm-network", "mbtfm-traction"}) {
    const Outcome version = run_program(std::string(stage) + " --version", "ulimit -v 200000; timeout -s KILL 60 ");
    EXPECT_EQ(version.code, kDone) << stage << ": " << version.output;
  }
}

TEST_F(Surroundings, a_name_that_is_not_utf8_is_a_name) {
  const fs::path odd = study_ / "caf\xE9", image = odd / "actin_\xFF.tif";
  fs::rename(cell_, odd);
  fs::rename(odd / "actin.tif", image);
  files::write_text(odd / "cell.toml", files::read_text(odd / "cell.toml") + "[images]\nactin = 'actin_*.tif'\n");
  const Outcome batch = run_program("mbtfm batch --quiet " + study_.string());
  EXPECT_EQ(batch.code, kDone) << batch.output;
  const auto run = nlohmann::json::parse(files::read_text(odd / "run.json"));
  EXPECT_EQ(run["cell"], "caf\\xE9");
  EXPECT_EQ(run["images"]["actin"], "actin_\\xFF.tif");
  for (const fs::path& file : {odd / "report.html", odd / "run.json", study_ / "batch.csv"})
    EXPECT_TRUE(files::is_utf8(files::read_text(file))) << file;
  EXPECT_TRUE(has_words(files::read_text(odd / "report.html"), "caf\\xE9"));
  EXPECT_TRUE(has_words(files::read_text(study_ / "batch.csv"), "caf\\xE9,,"));
  EXPECT_TRUE(has_words(files::read_text(study_ / "batch_all.csv"), "caf\\xE9,0"));
  output_of("mbtfm verify '" + odd.string() + "'", kDone);
  output_of("mbtfm repeat --quiet --out " + (folder_ / "again").string() + " '" + odd.string() + "'", kDone);
  const Outcome list = run_program("mbtfm batch --list " + study_.string());
  EXPECT_FALSE(has_words(list.output, "run,")) << "all is up to date";
}

TEST_F(Surroundings, a_mesh_that_memory_cannot_hold_is_refused_with_its_count) {
  set("edge_length_um = 0.01");  // 1.3 million vertices, of a kilobyte each at the least
  EXPECT_TRUE(has_words(output_of("mbtfm run " + cell_.string(), kResources, "ulimit -v 1000000; "),
                        " vertices, which take ", "edge_length_um"));
  EXPECT_FALSE(fs::exists(cell_ / "3_network"));
}

TEST_F(Surroundings, an_edge_length_that_is_no_length_is_refused_before_anything_runs) {
  set("edge_length_um = 1e-300");
  EXPECT_TRUE(has_words(output_of("mbtfm run " + cell_.string(), kInput),
                        "expected a number >= 0.01 and <= 100, found '1e-300'"));
  EXPECT_FALSE(fs::exists(cell_ / "1_segment"));
  EXPECT_TRUE(has_words(output_of("mbtfm-network --edge_length_um 1500 --check", kUsage), "1500 nm is 1.5 um"));
}

TEST_F(Surroundings, stages_are_chosen_one_by_one_or_with_commas) {
  EXPECT_EQ(run_program("mbtfm run --quiet --only segment,network " + cell_.string()).code, kDone);
  EXPECT_TRUE(fs::exists(cell_ / "3_network/network.vtu"));
  EXPECT_FALSE(fs::exists(cell_ / "2_track"));
  EXPECT_EQ(run_program("mbtfm run --quiet --only track --only fit " + cell_.string()).code, kDone);
  EXPECT_EQ(run_program("mbtfm run --only segment network " + cell_.string()).code, kUsage);
}

}  // namespace
}  // namespace mbtfm
