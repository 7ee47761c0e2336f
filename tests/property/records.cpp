/// Records of a finished cell, each of their values in turn replaced by something else: whoever reads them throws an
/// InputError or nothing.
#include "pipeline/contract/errors.h"
#include "pipeline/cost/accuracy.h"
#include "pipeline/report/provenance.h"
#include "pipeline/report/report.h"
#include "pipeline/runner/batch.h"
#include "pipeline/runner/batch_table.h"
#include "pipeline/runner/run_record.h"
#include "pipeline/runner/verify.h"
#include "pipeline/stage/stage.h"
#include "tests/support/script_stages.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm {
namespace {

using nlohmann::ordered_json;

/// Pointers to the value and to all values in it. What the other stages tell is of the same form as the fit's.
void collect(const ordered_json& json, const ordered_json::json_pointer& at,
             std::vector<ordered_json::json_pointer>& all) {
  all.push_back(at);
  const std::string place = at.to_string();
  if (place == "/stages/segment" || place == "/stages/track" || place == "/stages/network") return;
  if (json.is_object()) {
    for (const auto& [key, value] : json.items()) collect(value, at / key, all);
  } else {
    constexpr std::size_t kAlike = 2;  // of a list: its values are of one form
    for (std::size_t i = 0; json.is_array() && i < std::min(kAlike, json.size()); ++i) collect(json[i], at / i, all);
  }
}

/// By another type, by what is out of range, by a name that leads elsewhere. As text: not all is a value of the
/// library.
const std::vector<std::string>& replacements() {
  static const std::vector<std::string> list = {
      "null", "true", "-7", "\"../../../outside\"", "1e308", "[1, 2]", "18446744073709551615", "{\"a\": 1}"};
  return list;
}

class RecordsOfCells : public testing::Test {
 protected:
  void SetUp() override {
    options_ = {.stage_folder = test::make_script_stages(folder_.path()), .is_checked = true, .version = "1"};
    test::make_unfinished_cell(cell_);
    runner::run_cell(cell_, options_);
    report::update_report(cell_);
  }

  void expect_input_errors_only(const std::string& what, const std::function<void()>& read) {
    try {
      read();
    } catch (const InputError& error) {
      ++n_errors_;
    } catch (const std::exception& error) {
      ADD_FAILURE() << what << ": " << error.what();
    }
  }

  /// All that reads records, but starts nothing.
  void read_all(const std::string& what) {
    const auto expect = [&](const std::function<void()>& read) { expect_input_errors_only(what, read); };
    const fs::path run_json = cell_ / "run.json";
    const runner::BatchCell cell{.cell = cell_};
    expect([&] { runner::is_done(cell_, options_, runner::look_at_cell(cell_, options_)); });
    expect([&] { runner::verify_cell(cell_); });
    expect([&] { runner::recorded_failure(cell_); });
    expect([&] { runner::last_summary(cell_, {}); });
    expect([&] { runner::list_cells({cell_}, options_, 1); });
    expect([&] { runner::write_batch_tables(folder_.path(), {cell}, {}, {}); });
    expect([&] { report::read_provenance(run_json); });
    expect([&] { files::read_fit_summary(cell_ / "4_fit/fit.json"); });
    for (const runner::Stage& stage : runner::stages()) {
      expect([&] { stage::read_report(runner::record_file_of(cell_, stage)); });
      expect([&] { runner::series_outputs(cell_, stage); });
      expect([&] { runner::is_begun(runner::record_file_of(cell_, stage)); });
    }
  }

  /// The same for all that writes what it read into another record. run.json is then another.
  void rewrite_all(const std::string& what) {
    const fs::path run_json = cell_ / "run.json";
    const std::string before = files::read_text(run_json);
    for (const StageState state : {StageState::up_to_date, StageState::not_asked}) {
      runner::CellOutcome outcome;
      for (const runner::Stage& stage : runner::stages())
        outcome.stages.push_back({.stage = stage.name, .status = {state, ""}});
      expect_input_errors_only(what, [&] { runner::write_run_record(cell_, options_, outcome); });
      files::write_text(run_json, before);
    }
    expect_input_errors_only(what, [&] { cost::record_accuracy(cell_, 0.1, {.preset = "fast", .verdict = "met"}); });
    files::write_text(run_json, before);
  }

  void replace_each_value_of(const std::string& file) {
    const std::string whole = files::read_text(cell_ / file);
    const auto json = ordered_json::parse(whole);
    std::vector<ordered_json::json_pointer> places;
    collect(json, ordered_json::json_pointer(), places);
    constexpr const char* kMark = "to be replaced";
    for (const auto& place : places) {
      ordered_json changed = json;
      changed[place] = kMark;
      const std::string text = changed.dump();
      const auto at = text.find('"' + std::string(kMark) + '"');
      for (std::size_t k = 0; k < replacements().size(); ++k) {
        const std::string& other = replacements()[k];
        files::write_text(cell_ / file, std::string(text).replace(at, std::string(kMark).size() + 2, other));
        const std::string what = file + " with " + place.to_string() + " = " + other;
        read_all(what);
        if (k % 3 == 0) rewrite_all(what);  // null, a name, a number too large: the slower of the two
        if (HasFailure()) return;           // one says it
      }
    }
    files::write_text(cell_ / file, whole);
    EXPECT_GT(n_errors_, static_cast<int>(places.size())) << "most replacements are errors of somebody";
  }

  test::TemporaryFolder folder_;
  const fs::path cell_ = folder_ / "cell";
  runner::RunOptions options_;
  int n_errors_ = 0;
};

TEST_F(RecordsOfCells, a_run_record_of_any_other_values_is_an_input_error_at_most) {
  replace_each_value_of("run.json");
}

TEST_F(RecordsOfCells, a_stage_record_of_any_other_values_is_an_input_error_at_most) {
  replace_each_value_of("4_fit/record.json");
}

TEST_F(RecordsOfCells, a_fit_summary_of_any_other_values_is_an_input_error_at_most) {
  replace_each_value_of("4_fit/fit.json");
}

TEST_F(RecordsOfCells, a_record_cut_short_or_too_deep_is_an_input_error_at_most) {
  for (const char* file : {"run.json", "4_fit/record.json", "4_fit/fit.json"}) {
    const std::string whole = files::read_text(cell_ / file);
    for (std::size_t n = 0; n < whole.size(); n += 1 + whole.size() / 29) {
      files::write_text(cell_ / file, whole.substr(0, n));
      read_all(std::string(file) + " cut after " + std::to_string(n));
    }
    for (const std::string& value : {std::string("1e999"), std::string(100000, '[') + std::string(100000, ']')}) {
      files::write_text(cell_ / file, "{\"stages\": " + value + "}");
      read_all(std::string(file) + " with " + value.substr(0, 10));
    }
    files::write_text(cell_ / file, whole);
  }
}

TEST_F(RecordsOfCells, the_whole_report_and_run_stand_damage_of_each_part_of_the_records) {
  for (const char* file : {"run.json", "4_fit/record.json", "4_fit/fit.json"}) {
    const std::string whole = files::read_text(cell_ / file);
    const auto json = ordered_json::parse(whole);
    for (const auto& [key, value] : json.items())
      for (const ordered_json& other : {ordered_json(), ordered_json(1), ordered_json("x"), ordered_json{1, 2}}) {
        ordered_json changed = json;
        changed[key] = other;
        files::write_text(cell_ / file, changed.dump());
        expect_input_errors_only(std::string(file) + " with " + key + " = " + other.dump(), [&] {
          runner::run_cell(cell_, options_);
          report::update_report(cell_);
        });
        files::write_text(cell_ / file, whole);
      }
  }
}

}  // namespace
}  // namespace mbtfm
