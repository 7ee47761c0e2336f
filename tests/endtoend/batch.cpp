/// Batches that survive: kills at any time, a full disk, another batch in the same folder. However a batch comes to its
/// end, its results are byte for byte those of an undisturbed one.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>
#include <thread>

#include "tests/support/program.h"

namespace mbtfm {
namespace {

using Files = std::map<std::string, std::string>;

/// Bytes by path of what the stages of all cells below a folder wrote. Records and reports tell times, and differ.
Files results_in(const fs::path& folder) {
  Files files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const fs::path path = entry.path().lexically_relative(folder);
    const std::string stage = path.parent_path().filename().string(), name = path.filename().string();
    const bool is_of_stage = stage == "1_segment" || stage == "2_track" || stage == "3_network" || stage == "4_fit";
    if (!is_of_stage || name == "record.json" || name.starts_with(".")) continue;
    files[path.generic_string()] = files::read_text(entry.path());
  }
  return files;
}

/// Every result that is there is whole: as in the undisturbed batch.
void expect_nothing_half_written(const fs::path& folder, const Files& whole, const std::string& when) {
  for (const auto& [path, bytes] : results_in(folder)) {
    const auto found = whole.find(path);
    if (found == whole.end() || found->second != bytes) ADD_FAILURE() << path << " is not whole, " << when;
  }
}

void expect_the_same(const fs::path& folder, const Files& whole) {
  expect_nothing_half_written(folder, whole, "at the end");
  EXPECT_EQ(results_in(folder).size(), whole.size());
}

std::string batch_command(const fs::path& folder) { return "mbtfm batch --quiet --jobs 2 " + folder.string(); }

/// A batch that has been started and is not waited for.
pid_t start_batch(const fs::path& folder) {
  const pid_t pid = fork();
  if (pid == 0) {
    freopen("/dev/null", "w", stderr);
    const std::string program = test::build_folder().string() + "/bin/mbtfm";
    execl(program.c_str(), program.c_str(), "batch", "--quiet", "--jobs", "2", folder.c_str(), nullptr);
    _exit(127);
  }
  return pid;
}

int exit_code_of(pid_t pid) {
  int status = 0;
  waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// The process and all that it has started, and these, at this moment.
std::vector<pid_t> family_of(pid_t pid) {
  std::vector<pid_t> family = {pid};
  for (std::size_t i = 0; i < family.size(); ++i) {
    std::error_code has_ended;
    const fs::path tasks = "/proc/" + std::to_string(family[i]) + "/task";
    for (const auto& task : fs::directory_iterator(tasks, has_ended)) {
      std::ifstream children(task.path() / "children");
      for (pid_t child = 0; children >> child;) family.push_back(child);
    }
  }
  return family;
}

class Batches : public testing::Test {
 protected:
  /// Three cells with images, a second of work each, and what an undisturbed batch makes of them.
  static void SetUpTestSuite() {
    scene_ = new TemporaryFolder;
    const fs::path first = *scene_ / "study/cell1";
    output_of("mbtfm-simulate --scenario two-adhesions --seed 103 --noise 0.05 --beads 300 --images --quiet --out " +
              first.string());
    fs::remove_all(first / "truth");
    const std::string settings = files::read_text(first / "cell.toml") +
                                 "[fit]\nn_meshes = 1\n[substrate]\nmodel = \"layer\"\n[network]\nseed = ";
    for (const char* number : {"1", "2", "3"}) {
      const fs::path cell = *scene_ / (std::string("study/cell") + number);
      if (cell != first) fs::copy(first, cell, fs::copy_options::recursive);
      files::write_text(cell / "cell.toml", settings + number + "\n");
    }
    fs::copy(*scene_ / "study", *scene_ / "whole", fs::copy_options::recursive);
    output_of(batch_command(*scene_ / "whole"));
    whole_ = results_in(*scene_ / "whole");
    ASSERT_GT(whole_.size(), 3u * 15u);
  }
  static void TearDownTestSuite() { delete scene_; }

  void SetUp() override { fs::copy(*scene_ / "study", study_, fs::copy_options::recursive); }

  TemporaryFolder folder_;
  const fs::path study_ = folder_ / "study";
  static inline TemporaryFolder* scene_ = nullptr;
  static inline Files whole_;
};

TEST_F(Batches, killed_at_random_moments_resume_to_the_same_bytes) {
  std::mt19937_64 random(8);
  int n_killed = 0;
  for (int round = 0; round < 8; ++round) {
    const pid_t batch = start_batch(study_);
    std::this_thread::sleep_for(std::chrono::milliseconds(20 + random() % 700));
    // The batch itself, or any program below it: all go the hard way at some time.
    const std::vector<pid_t> family = family_of(batch);
    const pid_t victim = round % 2 == 0 ? batch : family[random() % family.size()];
    kill(victim, SIGKILL);
    if (exit_code_of(batch) != 0) ++n_killed;
    expect_nothing_half_written(study_, whole_, "round " + std::to_string(round));
  }
  EXPECT_GT(n_killed, 0);
  output_of(batch_command(study_));
  expect_the_same(study_, whole_);
  for (const auto& entry : fs::recursive_directory_iterator(study_))
    EXPECT_FALSE(entry.path().filename().string().starts_with(".partial-")) << entry.path();
}

TEST_F(Batches, do_not_depend_on_the_libraries_own_threads) {
  // As on a machine of other processors: Snakemake and many clusters set these.
  output_of("mbtfm run --quiet " + (study_ / "cell1").string(), 0, "export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1; ");
  expect_nothing_half_written(study_, whole_, "with one thread of the BLAS");
}

TEST_F(Batches, two_in_one_folder_share_the_work) {
  const pid_t a = start_batch(study_), b = start_batch(study_);
  EXPECT_EQ(exit_code_of(a), 0);
  EXPECT_EQ(exit_code_of(b), 0);
  expect_the_same(study_, whole_);
}

TEST_F(Batches, a_full_disk_leaves_nothing_half_written) {
  // A limit on the size of files, its signal ignored, fails a write half-way as a full disk does.
  const Outcome full = run_program(batch_command(study_), "trap '' XFSZ; ulimit -f 4; ");
  EXPECT_NE(full.code, 0);
  expect_nothing_half_written(study_, whole_, "on a full disk");
  output_of(batch_command(study_));
  expect_the_same(study_, whole_);
}

TEST_F(Batches, a_parameter_that_was_changed_and_changed_back_gives_the_same_bytes) {
  ASSERT_EQ(run_program(batch_command(study_)).code, 0);
  const std::string settings = files::read_text(study_ / "cell2/cell.toml");
  files::write_text(study_ / "cell2/cell.toml", settings + "edge_length_um = 2\n");  // of [network]
  ASSERT_EQ(run_program(batch_command(study_)).code, 0);
  EXPECT_NE(results_in(study_).at("cell2/4_fit/tensions.csv"), whole_.at("cell2/4_fit/tensions.csv"));
  files::write_text(study_ / "cell2/cell.toml", settings);
  ASSERT_EQ(run_program(batch_command(study_)).code, 0);
  expect_the_same(study_, whole_);
}

TEST_F(Batches, a_run_is_repeated_from_its_record_alone) {
  const std::string cell = (*scene_ / "whole/cell1").string(), out = (folder_ / "again").string();
  // run.json, away from the cell; of the folder it tells of, the images alone are read
  fs::copy(cell + "/run.json", folder_ / "run.json");
  output_of("mbtfm repeat " + (folder_ / "run.json").string() + " --inputs " + (study_ / "cell1").string() +
            " --quiet --out " + out);
  for (const auto& [path, bytes] : results_in(folder_ / "again")) EXPECT_EQ(bytes, whole_.at("cell1/" + path)) << path;
}

TEST_F(Batches, a_changed_file_is_found_by_verify) {
  const fs::path cell = study_ / "cell1";
  ASSERT_EQ(run_program("mbtfm run --quiet " + cell.string()).code, 0);
  EXPECT_EQ(run_program("mbtfm verify " + cell.string()).code, 0);
  for (const char* name : {"4_fit/substrate.vtu", "paxillin.tif"}) {
    const std::string bytes = files::read_text(cell / name);
    std::string changed = bytes;
    changed[changed.size() / 2] ^= 1;
    files::write_text(cell / name, changed);
    EXPECT_TRUE(has_words(output_of("mbtfm verify " + cell.string(), 1), std::string(name) + " differs"));
    files::write_text(cell / name, bytes);
  }
  files::write_text(cell / "cell.toml", files::read_text(cell / "cell.toml") + "edge_length_um = 2\n");
  EXPECT_EQ(run_program("mbtfm verify " + cell.string()).code, 1);
}

}  // namespace
}  // namespace mbtfm
