// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/ini.h"

#include <algorithm>
#include <optional>

#include "stack/eds/text.h"

namespace linegate::eds {

class IniParser {
 public:
  IniParser(Ini& ini, Report& report) : ini_(ini), report_(report) {}

  void line(std::string_view text, std::uint32_t number) {
    line_ = text;
    number_ = number;
    const std::string_view content = trim(text);
    if (content.empty() || content.front() == ';') {
      return;
    }
    if (content.front() == '[') {
      section(content);
    } else {
      entry(content);
    }
  }

 private:
  Place place(std::string_view part) const {
    return {number_, static_cast<std::uint32_t>(part.data() - line_.data()) + 1};
  }

  void section(std::string_view content) {
    const std::size_t end = content.find(']');
    if (end == std::string_view::npos) {
      report_.error(place(content), "section name " + quote(content) + " is not closed by ']'");
    } else if (!without_comment(content.substr(end + 1)).empty()) {
      report_.warning(place(content.substr(end + 1)), "text behind the section name is ignored");
    }
    const std::string_view name =
        trim(content.substr(1, end == std::string_view::npos ? end : end - 1));
    const auto [known, is_new] = ini_.by_name_.try_emplace(comparable(name), ini_.sections_.size());
    if (!keys_.empty()) {
      keys_ = {};  // clear() would iterate over the buckets of the longest section each time
    }
    current_.reset();
    if (is_new) {
      current_ = ini_.sections_.size();
      ini_.sections_.push_back({name, place(content), {}});
    } else {
      report_.warning(place(content), "section " + quote(name) + " was already given in line " +
                                          std::to_string(ini_.sections_[known->second].place.line) +
                                          "; ignored");
    }
    before_first_section_ = false;
  }

  void entry(std::string_view content) {
    const std::size_t equals = content.find('=');
    if (equals == std::string_view::npos) {
      report_.warning(place(content),
                      quote(content) + " is neither a section nor key=value; ignored");
      return;
    }
    const std::string_view key = trim(content.substr(0, equals));
    if (before_first_section_) {
      report_.warning(place(content), quote(key) + " is in no section; ignored");
    }
    if (!current_) {
      return;
    }
    Section& section = ini_.sections_[*current_];
    const Entry* const known = given(section, key);
    if (known == nullptr) {
      const std::string_view value = content.substr(equals + 1);
      const std::string_view trimmed = trim(value);
      section.entries.push_back(
          {key, trimmed, place(content), place(trimmed.empty() ? value : trimmed)});
    } else {
      report_.warning(place(content), "key " + quote(key) + " was already given in line " +
                                          std::to_string(known->key_place.line) + "; ignored");
    }
  }

  // The entry of the section with this key; nullptr if there is none: the caller then appends it.
  const Entry* given(const Section& section, std::string_view key) {
    const std::vector<Entry>& entries = section.entries;
    if (entries.size() < kFew) {
      return section.find(key);
    }
    for (std::size_t i = keys_.size(); i < entries.size(); ++i) {
      keys_.try_emplace(lower(entries[i].key), i);
    }
    const auto at = keys_.find(lower(key));
    return at == keys_.end() ? nullptr : &entries[at->second];
  }

  static constexpr std::size_t kFew = 32;

  Ini& ini_;
  Report& report_;
  std::string_view line_;
  std::uint32_t number_ = 0;
  bool before_first_section_ = true;
  std::optional<std::size_t> current_;                 // none: in a section that is ignored
  std::unordered_map<std::string, std::size_t> keys_;  // of a section with many keys, in lower case
};

namespace {

// The number of the line at position `end`.
std::uint32_t line_at(std::string_view text, std::size_t end) {
  std::uint32_t line = 1;
  for (std::size_t at = 0; at < end; ++at) {
    line += text[at] == '\n' || (text[at] == '\r' && text.substr(at + 1, 1) != "\n") ? 1U : 0U;
  }
  return line;
}

bool is_text(std::string_view text, Report& report) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
    report.error({}, "the file is UTF-16; it must be ASCII, Latin-1 or UTF-8");
    return false;
  }
  const std::size_t zero = text.find('\0');
  if (zero != std::string_view::npos) {
    report.error({line_at(text, zero), 0},
                 "the file is not a text file (it contains a NUL character)");
    return false;
  }
  return true;
}

}  // namespace

const Entry* Section::find(std::string_view key) const {
  const auto at = std::find_if(entries.begin(), entries.end(), [key](const Entry& entry) {
    return equal_ignoring_case(entry.key, key);
  });
  return at == entries.end() ? nullptr : &*at;
}

const Section* Ini::find(std::string_view name) const {
  const auto at = by_name_.find(comparable(name));
  return at == by_name_.end() ? nullptr : &sections_[at->second];
}

bool Ini::add(Section section) {
  const bool is_new = by_name_.try_emplace(comparable(section.name), sections_.size()).second;
  if (is_new) {
    sections_.push_back(std::move(section));
  }
  return is_new;
}

Ini Ini::parse(std::string_view text, Report& report) {
  Ini ini;
  if (!is_text(text, report)) {
    return ini;
  }
  if (text.starts_with("\xEF\xBB\xBF")) {
    text.remove_prefix(3);
  }
  if (const std::size_t at = first_not_utf8(text); at != text.size()) {
    report.warning({line_at(text, at), 0},
                   "this line is neither ASCII nor UTF-8; such text is read as Latin-1");
  }
  IniParser parser(ini, report);
  for (std::uint32_t number = 1; !text.empty(); ++number) {
    const auto is_end = [](char c) { return c == '\r' || c == '\n'; };
    const auto end =
        static_cast<std::size_t>(std::find_if(text.begin(), text.end(), is_end) - text.begin());
    parser.line(text.substr(0, end), number);
    text.remove_prefix(end);
    text.remove_prefix(text.starts_with("\r\n") ? 2 : text.empty() ? 0 : 1);
  }
  return ini;
}

}  // namespace linegate::eds
