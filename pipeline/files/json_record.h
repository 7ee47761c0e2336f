/// The JSON files of a cell (record.json, run.json, fit.json), read with doubt. Inside pipeline/ only.
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/contract/figures.h"

namespace mbtfm::files {

/// A value in a JSON file, and where it is. The file may be damaged, of another program or of another version: each
/// question that the value does not answer is an InputError with the file, the place in it, and what is there instead.
class JsonRecord {
 public:
  using Json = nlohmann::ordered_json;

  /// @param kind  what the file should be, for messages: "a record of mbtfm run"
  /// @throws InputError where it is not there, no JSON, no object, or larger or deeper than any of ours
  JsonRecord(const std::filesystem::path& file, std::string kind, std::string hint = {});

  /// The member of an object. @throws InputError where this is no object, or has no such member
  JsonRecord at(const std::string& key) const;
  /// The same; none where there is no such member, or it is null.
  std::optional<JsonRecord> find(const std::string& key) const;
  /// All members of an object, by name. @throws InputError where it is none
  std::vector<std::pair<std::string, JsonRecord>> members() const;
  /// All values of a list. @throws InputError where it is none
  std::vector<JsonRecord> list() const;

  // the value itself; @throws InputError where it is of another type
  std::string text() const;
  bool is_true() const;
  double number() const;  ///< finite: JSON has no other
  int integer() const;
  Value figure() const;  ///< a truth value, a number, a text, or a list

  // of a member that may lack; @throws InputError where it is there and of another type
  std::string text_or(const std::string& key, const std::string& otherwise) const;
  bool is_true_or(const std::string& key, bool otherwise) const;
  double number_or(const std::string& key, double otherwise) const;

  void expect_object() const;
  /// As it is, to be passed on.
  const Json& json() const { return *value_; }
  /// The value is not `expected`. @throws InputError
  [[noreturn]] void fail(const std::string& expected) const;

 private:
  struct File;
  JsonRecord(std::shared_ptr<const File> file, const Json& value, std::string place)
      : file_(std::move(file)), value_(&value), place_(std::move(place)) {}
  JsonRecord child(const std::string& key, const Json& value) const;
  std::string place() const;  ///< for messages

  std::shared_ptr<const File> file_;
  const Json* value_;
  std::string place_;  ///< "stages.fit.run"; empty: the whole
};

}  // namespace mbtfm::files
