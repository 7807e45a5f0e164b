// SPDX-License-Identifier: Apache-2.0
// Walks through a YAML document and records each finding with its position.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "gateway/config/value.h"
#include "stack/base/diagnostic.h"
#include "stack/base/time.h"

namespace linegate::config {

// A position in the document, from 1; 0 = the document as a whole.
struct Place {
  std::uint32_t line = 0;
  std::uint32_t column = 0;
};
Place place_of(const YAML::Node& node);
Place place_of(const YAML::Mark& mark);

class Findings {
 public:
  explicit Findings(std::string file) : file_(std::move(file)) {}

  void error(Place place, std::string text);
  void warning(Place place, std::string text);
  // Adds findings of another file; duplicates are dropped.
  void add(std::vector<Diagnostic> diagnostics);

  // Records something besides the document that was read; for pop_sources().
  void add_source(std::string source) { sources_ += source; }
  // Everything recorded since the last call.
  std::string pop_sources() { return std::exchange(sources_, {}); }

  const std::string& file() const { return file_; }
  bool failed() const { return errors_ != 0; }
  std::size_t errors() const { return errors_; }
  // Ordered by file, line and column.
  std::vector<Diagnostic> take();

 private:
  std::string file_;
  std::string sources_;
  std::vector<Diagnostic> diagnostics_;
  std::unordered_set<std::string> there_;
  std::size_t errors_ = 0;
};

// One mapping of the document. Every key that is looked up is known; done() reports the others. A
// reading function leaves its target unchanged if the key is absent, and reports an invalid value.
class Section {
 public:
  // what: the name of the section in messages, with its article: "a line".
  Section(Findings& findings, const YAML::Node& node, std::string what);

  // Whether the document has a mapping here; if not, that was reported and every key is absent.
  bool valid() const { return valid_; }
  Place place() const { return place_; }

  // The value, or an undefined node (false as a condition) if the key is absent.
  YAML::Node find(std::string_view key);
  // The same; reports an absent key.
  YAML::Node require(std::string_view key);

  void read(std::string_view key, std::string& target);
  void read(std::string_view key, bool& target);
  // Reads a time from lowest to highest; 0 is permitted only if lowest is 0.
  void read(std::string_view key, Duration& target, Duration lowest, Duration highest);
  // Reads a whole multiple of unit.
  void read_multiple(std::string_view key, Duration& target, Duration unit, Duration highest);

  template <class T>
  void read_number(std::string_view key, T& target, std::uint64_t lowest, std::uint64_t highest) {
    if (const auto value = number(find(key), lowest, highest)) {
      target = static_cast<T>(*value);
    }
  }
  template <class T>
  void read_choice(std::string_view key, T& target,
                   std::initializer_list<std::pair<const char*, T>> choices) {
    choose(find(key), target, choices);
  }

  // The same for a given node. An undefined node yields nothing and reports nothing.
  std::optional<std::string> text(const YAML::Node& node);
  std::optional<std::uint64_t> number(const YAML::Node& node, std::uint64_t lowest,
                                      std::uint64_t highest);
  std::optional<Duration> duration(const YAML::Node& node, Duration lowest, Duration highest);
  template <class T>
  void choose(const YAML::Node& node, T& target,
              std::initializer_list<std::pair<const char*, T>> choices) {
    const auto value = text(node);
    if (!value) {
      return;
    }
    std::vector<std::string> names;
    for (const auto& [name, meaning] : choices) {
      if (*value == name) {
        target = meaning;
        return;
      }
      names.emplace_back(name);
    }
    not_one_of(node, *value, names);
  }
  void not_one_of(const YAML::Node& node, const std::string& value,
                  const std::vector<std::string>& names);

  // Reports unknown and repeated keys.
  void done();

  Findings& findings() { return *findings_; }

 private:
  struct Member {
    YAML::Node key;
    YAML::Node value;
  };

  void report_unknown();

  Findings* findings_;
  YAML::Node node_;
  std::string what_;
  Place place_;
  bool valid_ = false;
  std::unordered_map<std::string, Member> members_;
  std::vector<YAML::Node> repeated_;  // keys that occur twice
  std::vector<std::string> known_;    // in the order of look-up
  std::unordered_set<std::string> is_known_;
};

inline constexpr std::size_t kMostElements = 65'536;
inline constexpr std::size_t kMostNodes = 127;  // of nodes of a line, and of lines of a gateway

// The elements of a list. Reports a node that is not a list, and more than `most` elements, which
// are dropped. Undefined: empty.
std::vector<YAML::Node> elements(Findings& findings, const YAML::Node& node, std::string_view what,
                                 std::size_t most = kMostElements);

}  // namespace linegate::config
