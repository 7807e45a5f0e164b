// SPDX-License-Identifier: Apache-2.0
// A walk through a YAML document that keeps every finding with its place.
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

// A place in the document, from 1; 0 = the document as a whole.
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
  // Those of another file; one that is there already is not repeated.
  void add(std::vector<Diagnostic> diagnostics);

  // Something besides the document that was read; for take_sources().
  void add_source(std::string source) { sources_ += source; }
  // All since the last call.
  std::string take_sources() { return std::exchange(sources_, {}); }

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

// One mapping of the document. Every key that is asked for is known; done() reports the others. A
// reading function leaves its target alone if the key is absent, and reports a value that is wrong.
class Section {
 public:
  // what: for messages, with its article: "a line".
  Section(Findings& findings, const YAML::Node& node, std::string what);

  // The document has a mapping here; if not, that has been reported and every key is absent.
  bool valid() const { return valid_; }
  Place place() const { return place_; }

  // The value, or an undefined node (false as a condition) if the key is absent.
  YAML::Node find(std::string_view key);
  // The same; an absent key is reported.
  YAML::Node require(std::string_view key);

  void read(std::string_view key, std::string& target);
  void read(std::string_view key, bool& target);
  // A time from lowest to highest; 0 is allowed only if lowest is 0.
  void read(std::string_view key, Duration& target, Duration lowest, Duration highest);
  // Only whole multiples of unit.
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

  // The same for a node in hand. An undefined node gives nothing and reports nothing.
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

  // Reports the keys nobody asked for, and those that are there twice.
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
  std::vector<YAML::Node> repeated_;  // keys that are there already
  std::vector<std::string> known_;    // in the order in which they were asked for
  std::unordered_set<std::string> is_known_;
};

inline constexpr std::size_t kMostElements = 65'536;
inline constexpr std::size_t kMostNodes = 127;  // of a line, and lines of a gateway

// The elements of a list; a node that is none is reported, and so are more than `most`, which are
// left out. Undefined: none.
std::vector<YAML::Node> elements(Findings& findings, const YAML::Node& node, std::string_view what,
                                 std::size_t most = kMostElements);

}  // namespace linegate::config
