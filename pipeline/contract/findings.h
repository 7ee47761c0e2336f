/// What the program notices and a user should know. Every finding has a kind, declared in the one table of findings.cpp
/// with the threshold, its reason and the remedy; docs/findings.md is written from that table. From the records of the
/// stages the findings reach the terminal, run.json, batch.csv, run.log, the report and the study.
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

/// A new kind compiles again only what names kinds: kinds_of_findings.h has the list.
enum class FindingKind : int;

struct KindOfFinding {
  FindingKind kind;
  const char* id;  ///< its identity in files
  const char* stage;
  Severity severity;
  const char* number;  ///< what is asked, with its unit
  double threshold;    ///< a finding where the number is above it
  const char* reason;  ///< of the threshold
  const char* remedy;
};

const std::vector<KindOfFinding>& kinds_of_findings();
const KindOfFinding& properties_of(FindingKind kind);

/// As it is written to files and shown, complete in itself.
struct Finding {
  std::string id;
  Severity severity = Severity::note;
  std::string text;  ///< what was found, one to three sentences
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

/// A finding where the number is above its kind's threshold, or is not a number.
std::optional<Finding> noticed(FindingKind kind, double number, const std::string& text);
/// The same, with another severity than the kind's own: where this case is milder or worse than the kind as a rule.
std::optional<Finding> noticed(FindingKind kind, double number, const std::string& text, Severity severity);

/// "caution (missing-fibre): text Remedy."
std::string line_of(const Finding& finding);
/// Identities of the open ones, each once, in their order: "missing-fibre; common-motion".
std::string open_ids(const std::vector<Finding>& findings);

/// docs/findings.md
std::string findings_page();

}  // namespace mbtfm
