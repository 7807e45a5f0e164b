// SPDX-License-Identifier: Apache-2.0
// The INI syntax of EDS, DCF and node lists (CiA 306), without the meaning of the content:
// sections, keys, values, comments.
//
// Lines end in CR, LF or both. Blanks around names and values are ignored. Names are compared
// without regard to case, and section names also without regard to blanks. A line that begins with
// ';' is a comment. Of duplicate sections or keys the first one is used.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "stack/eds/report.h"

namespace linegate::eds {

struct Entry {
  std::string_view key;
  std::string_view value;  // may be empty
  Place key_place;
  Place value_place;
};

struct Section {
  std::string_view name;
  Place place;
  std::vector<Entry> entries;  // keys are unique

  // nullptr if there is no such key.
  const Entry* find(std::string_view key) const;
};

// Consists of views into the parsed text, which must outlive it.
class Ini {
 public:
  // Fails as a whole only if the input is not text: then there are no sections. Errors: a NUL
  // character, UTF-16, a section name without its closing bracket. Warnings: duplicates, and lines
  // that are neither section, key nor comment.
  static Ini parse(std::string_view text, Report& report);

  // Adds a section from another syntax; its texts must outlive the Ini too. Returns false, without
  // an effect, if a section of that name exists.
  bool add(Section section);

  const std::vector<Section>& sections() const { return sections_; }
  // nullptr if there is no such section.
  const Section* find(std::string_view name) const;

 private:
  friend class IniParser;

  std::vector<Section> sections_;
  std::unordered_map<std::string, std::size_t> by_name_;  // in lower case
};

}  // namespace linegate::eds
