// SPDX-License-Identifier: Apache-2.0
// The INI syntax that EDS, DCF and node lists (CiA 306) are written in, and nothing of their
// meaning: sections, keys, values, comments.
//
// Lines end in CR, LF or both; blanks around names and values do not count; names are compared
// without regard to case, and those of sections without regard to blanks. A line that begins with
// ';' is a comment. Of sections or keys that come twice the first counts.
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
  std::vector<Entry> entries;  // keys differ

  // nullptr if there is no such key.
  const Entry* find(std::string_view key) const;
};

// Views into the text it was parsed from, which must outlive it.
class Ini {
 public:
  // Never fails as a whole unless the text is no text: then there are no sections. Errors: a NUL
  // character, UTF-16, a section name that is not closed. Warnings: duplicates, and lines that are
  // neither.
  static Ini parse(std::string_view text, Report& report);

  // A section that was written in another syntax; its texts must outlive the Ini too. False if
  // there is one of that name, which counts.
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
