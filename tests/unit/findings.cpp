
#include <nlohmann/json.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/files/json.h"
#include "pipeline/files/text.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm {
namespace {

int n_words(const std::string& text) {
  std::istringstream stream(text);
  int n = 0;
  for (std::string word; stream >> word;) ++n;
  return n;
}

TEST(Findings, every_kind_has_an_identity_of_its_own_and_symptoms_that_lead_to_it) {
  std::set<std::string> ids;
  for (const KindOfFinding& kind : kinds_of_findings()) {
    EXPECT_TRUE(ids.insert(kind.id).second) << kind.id;
    EXPECT_EQ(std::string(kind.id).find_first_not_of("abcdefghijklmnopqrstuvwxyz-"), std::string::npos) << kind.id;
    EXPECT_FALSE(kind.symptoms.empty()) << kind.id;
    for (const KnownSymptom& s : kind.symptoms) {
      EXPECT_EQ(&properties_of(s.symptom), &s);
      EXPECT_EQ(&kind_of(s.symptom), &kind);
    }
  }
}

/// One number stands for `{}`; where a finding is, or which, is not counted.
TEST(Findings, are_a_sentence_of_at_most_25_words_with_one_number_and_a_short_remedy) {
  constexpr int kWords = 25, kWordsOfMeaning = 12, kWordsOfRemedy = 50;
  for (const KindOfFinding& kind : kinds_of_findings()) {
    EXPECT_LE(n_words(kind.meaning), kWordsOfMeaning) << kind.meaning;
    EXPECT_LE(n_words(kind.remedy), kWordsOfRemedy) << kind.remedy;
    EXPECT_GT(n_words(kind.remedy), 3) << kind.id;
    for (const KnownSymptom& s : kind.symptoms) {
      const std::string sentence = s.sentence;
      EXPECT_LE(n_words(sentence), kWords) << sentence;
      std::set<std::string> places;
      int n = 0;
      for (auto at = sentence.find('{'); at != sentence.npos; at = sentence.find('{', at + 1), ++n)
        places.insert(sentence.substr(at, sentence.find('}', at) + 1 - at));
      EXPECT_EQ(places.size(), static_cast<std::size_t>(n)) << "one of each: " << sentence;
      for (const std::string& place : places) EXPECT_TRUE(place == "{}" || place == "{%}" || place == "{at}") << place;
      EXPECT_FALSE(places.contains("{}") && places.contains("{%}")) << sentence;
    }
  }
}

TEST(Findings, of_older_versions_are_read_by_their_present_identity) {
  std::istringstream former(
      "unusual-value assumed-input lossy-image saturated pixel-size-unchecked scan-phase adhesions-left-out "
      "adhesions-long bright-actin bleed-through adhesions-off-actin outline-off-actin cells-touch actin-shift "
      "adhesions-assumed pattern-too-fine pattern-as-cell fibre-ends-anchored input-not-used vectors-masked "
      "nothing-moves moves-outward tracked-by-correlation defocused beads-wide beads-not-round pattern-repeats "
      "beads-lost little-at-rest slices-moved beads-scatter light-lost common-motion curved-motion channel-shift "
      "explains-little read-otherwise field-smoothed unexplained-displacement strain-beyond-linear noise-unknown "
      "noise-disagrees beads-disagree telling-beads-scatter adhesions-without-beads cell-cut neighbour-pulls "
      "missing-fibre missing-adhesion fibre-without-tension not-identifiable network-not-identifiable wide-interval "
      "tension-at-zero single-mesh forces-out-of-balance torques-out-of-balance off-the-surface surface-repaired "
      "surface-level surface-off-zero beads-off-the-gel beads-far beads-tell-little misfit-in-space patches-do-not-fit "
      "tractions-out-of-balance z-reversed beads-stray loss-decides lambda-runs-away modulus-error-unknown "
      "contraction-beyond-linear cases-not-solved registration-ambiguous cells-left-out few-cells sheet-thick "
      "sheet-strain sheet-coarse sheet-not-identifiable sheet-unexplained sheet-expands sheet-at-bound sheet-cut "
      "tractions-off-balance tractions-outside");
  int n_former = 0;
  std::set<std::string> present;
  for (const KindOfFinding& kind : kinds_of_findings()) present.insert(kind.id);
  for (std::string id; former >> id; ++n_former) EXPECT_TRUE(present.contains(present_id(id))) << id;
  EXPECT_EQ(n_former, 87);
  EXPECT_EQ(present_id("explains-little"), "misfit");
  EXPECT_EQ(present_id("of-a-later-version"), "of-a-later-version");
  const test::TemporaryFolder folder;
  files::write_text(folder / "a.json", R"({"findings": [{"id": "read-otherwise", "severity": "bad", "text": "b"}]})");
  const std::vector<Finding> read = files::findings_of(files::JsonRecord(folder / "a.json", "a record"));
  ASSERT_EQ(read.size(), 1u);
  EXPECT_EQ(read.front().id, "wrong-orientation");
  EXPECT_TRUE(spoils_cell(read.front()));
}

TEST(Findings, are_noticed_above_their_threshold_and_if_the_number_is_none) {
  const double threshold = properties_of(Symptom::moves_outward).threshold;
  EXPECT_FALSE(noticed(Symptom::moves_outward, threshold));
  EXPECT_TRUE(noticed(Symptom::moves_outward, threshold + 1e-9));
  const auto unknown = noticed(Symptom::moves_outward, std::numeric_limits<double>::quiet_NaN());
  ASSERT_TRUE(unknown);
  EXPECT_FALSE(unknown->number);
}

TEST(Findings, say_their_number_its_share_or_another_value_and_where) {
  EXPECT_EQ(noticed(Symptom::adhesions_without_beads, 2, {.at = "3 and 7"})->text,
            "Adhesions without a bead near by: 2 (3 and 7).");
  EXPECT_EQ(noticed(Symptom::light_lost, 0.6)->text, "60 % of the light is missing in the dimmer stack.");
  const Finding shown = *noticed(Symptom::few_cells, 1.25, {.value = "4", .severity = Severity::bad});
  EXPECT_EQ(shown.text, "The mean is over 4 cells.");
  EXPECT_EQ(shown.number, 1.25);
  EXPECT_EQ(shown.severity, Severity::bad);
}

TEST(Findings, notes_are_not_open) {
  const Finding note = *noticed(Symptom::wide_interval, 1);
  const Finding caution = *noticed(Symptom::missing_fibre, 1);
  EXPECT_FALSE(has_open({note}));
  EXPECT_TRUE(has_open({note, caution}));
  EXPECT_EQ(open_ids({note, caution, caution}), "missing-fibre");
  EXPECT_EQ(line_of(note), "note (wide-interval): " + note.text);
  EXPECT_EQ(line_of(caution), "caution (missing-fibre): " + caution.text + " " + caution.remedy);
}

TEST(Findings, pass_through_a_record_unchanged) {
  const test::TemporaryFolder folder;
  const Finding there = *noticed(Symptom::not_identifiable, 2, {.at = "\"two\"\n"});
  nlohmann::ordered_json json;
  json["findings"] = {files::json_of(there)};
  files::write_text(folder / "a.json", files::json_text(json));
  const std::vector<Finding> back = files::findings_of(files::JsonRecord(folder / "a.json", "a record"));
  ASSERT_EQ(back.size(), 1u);
  EXPECT_EQ(files::json_of(back.front()), files::json_of(there));
  files::write_text(folder / "b.json", R"({"findings": [{"id": "a", "severity": "loud", "text": "b"}]})");
  EXPECT_THROW(files::findings_of(files::JsonRecord(folder / "b.json", "a record")), InputError);
  files::write_text(folder / "c.json", "{}");  // as older versions wrote it
  EXPECT_TRUE(files::findings_of(files::JsonRecord(folder / "c.json", "a record")).empty());
}

TEST(WithError, a_number_ends_where_its_error_does) {
  EXPECT_EQ(with_error(2.3512, 0.4231), "2.35 +- 0.42");
  EXPECT_EQ(with_error(2.3512, 0.0996), "2.35 +- 0.10");
  EXPECT_EQ(with_error(-0.0004, 0.023), "0.000 +- 0.023");
  EXPECT_EQ(with_error(1234.5, 0.37), "1234.50 +- 0.37");
  EXPECT_EQ(with_error(1234.5, 37), "1235 +- 37");
  EXPECT_EQ(with_error(1234.5, 372), "1230 +- 370");
  EXPECT_EQ(with_error(1234.5, 999), "1200 +- 1000");
  EXPECT_EQ(with_error(Vec2{0.3021, -0.2456}, Vec2{0.0181, 0.2}), "(0.302, -0.25) +- (0.018, 0.20)");
  // without an error to go by
  EXPECT_EQ(with_error(2.3512, 0), "2.35 +- 0");
  EXPECT_EQ(with_error(2.3512, std::numeric_limits<double>::infinity()), "2.35 +- inf");
  EXPECT_EQ(with_error(2e9, 1e7), "2e+09 +- 1e+07");
}

}  // namespace
}  // namespace mbtfm
