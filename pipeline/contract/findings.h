/// What the program notices and a user should know. Kinds of findings are declared in findings.txt, with words,
/// thresholds and remedies; docs/findings.md is written from it. From the records of the stages findings reach the
/// terminal, run.json, batch.csv, run.log, the report and the study.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/words.h"

namespace mbtfm {

enum class Severity {
  note,     ///< worth knowing; the results hold
  caution,  ///< open: the results may be off by more than their error bars say
  bad       ///< open: what it names must not be used
};

constexpr auto words(Severity) { return std::array{"note", "caution", "bad"}; }

/// One number by which a kind of finding is seen. A new one compiles again only what names symptoms: what includes
/// kinds_of_findings.h, which the build makes of findings.txt.
enum class Symptom : int;

struct KnownSymptom {
  Symptom symptom;
  const char* stage;
  Severity severity;
  const char* sentence;  ///< `{}`: the value, `{%}`: as a percentage, `{at}`: where, which or how
  const char* number;    ///< what is asked, with its unit
  double threshold;      ///< a finding if the number is above it
  const char* reason;    ///< of the threshold
};

/// A cause, which may have several symptoms.
struct KindOfFinding {
  const char* id;  ///< its identity in files
  const char* meaning;
  const char* remedy;
  const char* false_alarms;  ///< "11 of 400" sound cells; empty: not measured
  std::vector<KnownSymptom> symptoms;
};

const std::vector<KindOfFinding>& kinds_of_findings();
const KindOfFinding& kind_of(Symptom symptom);
const KnownSymptom& properties_of(Symptom symptom);
/// The identity that took the place of one of older versions; others stay.
std::string present_id(const std::string& id);

/// As it is written to files and shown, complete in itself.
struct Finding {
  std::string id;
  Severity severity = Severity::note;
  std::string text;  ///< what was found
  std::optional<double> number, threshold;
  std::string number_is;  ///< what the number is, with its unit
  std::string reason, remedy;
};

bool is_open(const Finding& finding);
/// Whether none of the cell's results may be used. What is marked by itself, as `identifiable` does, spoils no cell.
bool spoils_cell(const Finding& finding);
/// The first one that spoils the cell, else the first open one; null if none is open.
const Finding* worst_of(const std::vector<Finding>& findings);
bool has_open(const std::vector<Finding>& findings);

/// What a sentence says besides the number.
struct Shown {
  std::string value = {};  ///< in place of the number
  std::string at = {};
  std::optional<Severity> severity = {};  ///< if this case is milder or worse than the symptom as a rule
};

/// A finding if the number is above its threshold, or is not a number.
std::optional<Finding> noticed(Symptom symptom, double number, const Shown& shown = {});

/// "caution (missing-fibre): text Remedy."
std::string line_of(const Finding& finding);
/// Identities of the open ones, each once, in their order: "missing-fibre; common-motion".
std::string open_ids(const std::vector<Finding>& findings);

/// docs/findings.md
std::string findings_page();

}  // namespace mbtfm
