// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/sections.h"

#include <algorithm>
#include <charconv>
#include <string>
#include <utility>

#include "stack/eds/text.h"

namespace linegate::eds {
namespace {

constexpr std::uint8_t kStructureSub = 0xFF;

bool is_hex_digit(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
}

// Parses digits only, in the given base.
bool parse_digits(std::string_view text, int base, unsigned& value) {
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value, base);
  return error == std::errc() && stop == end;
}

// "tool1", "m2fixedobjects": a word, a number, and an optional rest.
bool is_numbered(std::string_view name, std::string_view word) {
  return name.starts_with(word) && name.size() > word.size() && name[word.size()] >= '0' &&
         name[word.size()] <= '9';
}

}  // namespace

bool is_commissioning(std::string_view name) {
  return name.starts_with("devicecom") && name.ends_with("ning");
}

namespace {

// The sections of CiA 306 that do not belong to an object, including those that are not used here.
bool is_known(std::string_view name) {
  static constexpr std::string_view kNames[] = {
      "fileinfo",         "deviceinfo",       "dummyusage",          "comments",
      "mandatoryobjects", "optionalobjects",  "manufacturerobjects", "tools",
      "supportedmodules", "connectedmodules", "dynamicchannels"};
  return std::find(std::begin(kNames), std::end(kNames), name) != std::end(kNames) ||
         is_commissioning(name) || is_numbered(name, "tool");
}

class Sorter {
 public:
  explicit Sorter(Report& report) : report_(report) {}

  void add(const Section& section) {
    const std::string name = comparable(section.name);
    const bool is_module = is_numbered(name, "m");
    const auto digits = static_cast<std::size_t>(
        std::find_if_not(name.begin(), name.end(), is_hex_digit) - name.begin());
    if (digits < 4 && !is_known(name) && !is_module) {
      report_.note(section.place, "section " + quote(section.name) + " is not known; ignored");
      return;
    }
    if (name.size() != section.name.size()) {
      report_.warning(section.place,
                      "section " + quote(section.name) + " is read as [" + name + ']');
    }
    if (is_module) {
      add_module(section, name);
    } else if (!is_known(name)) {
      add_object(section, name, sorted.objects);
    }
  }

  SortedSections sorted;

 private:
  using Objects = std::map<std::uint16_t, ObjectSections>;

  // Precondition: name begins with four hexadecimal digits.
  void add_object(const Section& section, std::string_view name, Objects& objects) {
    // "1000denotation" continues with letters that are hexadecimal digits too.
    const auto digits = static_cast<std::size_t>(
        std::find_if_not(name.begin(), name.end(), is_hex_digit) - name.begin());
    unsigned index = 0;
    if (!parse_digits(name.substr(0, digits == name.size() ? digits : 4), 16, index) ||
        index == 0 || index > 0xFFFF) {
      not_understood(section, ": its index is not in 1h to FFFFh");
      return;
    }
    place(section, objects[static_cast<std::uint16_t>(index)], name.substr(4));
  }

  void place(const Section& section, ObjectSections& object, std::string_view what) {
    static constexpr std::pair<std::string_view, const Section * ObjectSections::*> kNames[] = {
        {"", &ObjectSections::object},
        {"name", &ObjectSections::names},
        {"value", &ObjectSections::values},
        {"denotation", &ObjectSections::denotations},
        {"objectlinks", &ObjectSections::links}};
    for (const auto& [name, member] : kNames) {
      if (what == name) {
        object.*member = &section;
        return;
      }
    }
    if (what.starts_with("sub")) {
      place_sub(section, object, what.substr(3));
    } else {
      not_understood(section, "");
    }
  }

  void place_sub(const Section& section, ObjectSections& object, std::string_view digits) {
    unsigned sub = 0;
    if (!parse_digits(digits, 16, sub) || sub > kStructureSub) {
      not_understood(section, ": its sub-index is not in 0 to FFh");
      return;
    }
    if (sub == kStructureSub) {
      object.structure = &section;
      return;
    }
    const auto [known, is_new] = object.subs.try_emplace(static_cast<std::uint8_t>(sub), &section);
    if (!is_new) {
      not_understood(section, ": it is already described in line " +
                                  std::to_string(known->second->place.line));
    }
  }

  // name: "m", a number, and the kind of the section.
  void add_module(const Section& section, std::string_view name) {
    const std::size_t end = std::min(name.find_first_not_of("0123456789", 1), name.size());
    unsigned number = 0;
    if (!parse_digits(name.substr(1, end - 1), 10, number) || number == 0 || number > 0xFFFF) {
      not_understood(section, ": its number is not in 1 to 65535");
      return;
    }
    ModuleSections& module = sorted.modules[static_cast<std::uint16_t>(number)];
    const std::string_view what = name.substr(end);
    if (what == "moduleinfo") {
      module.info = &section;
    } else if (what == "comments") {
      module.comments = &section;
    } else if (what == "fixedobjects") {
      module.fixed_list = &section;
    } else if (what == "subextends") {
      module.extension_list = &section;
    } else if (what.starts_with("fixed") && has_index(what.substr(5))) {
      add_object(section, what.substr(5), module.fixed);
    } else if (what.starts_with("subext")) {
      add_extension(section, what.substr(6), module);
    } else {
      not_understood(section, "");
    }
  }

  static bool has_index(std::string_view name) {
    return name.size() >= 4 && std::all_of(name.begin(), name.begin() + 4, is_hex_digit);
  }

  void add_extension(const Section& section, std::string_view digits, ModuleSections& module) {
    unsigned index = 0;
    if (!parse_digits(digits, 16, index) || index == 0 || index > 0xFFFF) {
      not_understood(section, ": its index is not in 1h to FFFFh");
    } else {
      module.extension.try_emplace(static_cast<std::uint16_t>(index), &section);
    }
  }

  void not_understood(const Section& section, const std::string& why) {
    report_.warning(section.place, "section " + quote(section.name) + " is ignored" +
                                       (why.empty() ? ": its name is not known" : why));
  }

  Report& report_;
};

}  // namespace

SortedSections sort_sections(const Ini& ini, Report& report) {
  Sorter sorter(report);
  for (const Section& section : ini.sections()) {
    sorter.add(section);
  }
  return std::move(sorter.sorted);
}

}  // namespace linegate::eds
