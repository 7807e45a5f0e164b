#include "stack/eds/sections.h"

#include <algorithm>
#include <charconv>
#include <string>

#include "stack/eds/text.h"

namespace linegate::eds {
namespace {

constexpr std::uint8_t kStructureSub = 0xFF;

bool is_hex_digit(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
}

// Digits and nothing else, in the given base.
bool parse_digits(std::string_view text, int base, unsigned& value) {
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value, base);
  return error == std::errc() && stop == end;
}

// "tool1", "m2fixedobjects": a word, a number, perhaps more.
bool is_numbered(std::string_view name, std::string_view word) {
  return name.starts_with(word) && name.size() > word.size() && name[word.size()] >= '0' &&
         name[word.size()] <= '9';
}

}  // namespace

bool is_commissioning(std::string_view name) {
  return name.starts_with("devicecom") && name.ends_with("ning");
}

namespace {

// Sections without an object, known to CiA 306 whether they are of use here or not.
bool is_known(std::string_view name) {
  static constexpr std::string_view kNames[] = {
      "fileinfo",         "deviceinfo",       "dummyusage",          "comments",
      "mandatoryobjects", "optionalobjects",  "manufacturerobjects", "tools",
      "supportedmodules", "connectedmodules", "dynamicchannels"};
  return std::find(std::begin(kNames), std::end(kNames), name) != std::end(kNames) ||
         is_commissioning(name) || is_numbered(name, "tool") || is_numbered(name, "m");
}

class Sorter {
 public:
  explicit Sorter(Report& report) : report_(report) {}

  void add(const Section& section) {
    const std::string name = comparable(section.name);
    const auto digits = static_cast<std::size_t>(
        std::find_if_not(name.begin(), name.end(), is_hex_digit) - name.begin());
    if (digits < 4 && !is_known(name)) {
      report_.note(section.place, "section " + quote(section.name) + " is not known; ignored");
      return;
    }
    if (name.size() != section.name.size()) {
      report_.warning(section.place,
                      "section " + quote(section.name) + " is read as [" + name + ']');
    }
    if (is_known(name)) {
      return;
    }
    // "1000denotation" goes on with letters that are hexadecimal digits too.
    const std::string_view index_digits(name.data(), digits == name.size() ? digits : 4);
    unsigned index = 0;
    if (!parse_digits(index_digits, 16, index) || index == 0 || index > 0xFFFF) {
      not_understood(section, ": its index is not in 1h to FFFFh");
      return;
    }
    place(section, static_cast<std::uint16_t>(index), std::string_view(name).substr(4));
  }

  std::map<std::uint16_t, ObjectSections> objects;

 private:
  void place(const Section& section, std::uint16_t index, std::string_view what) {
    if (what.empty()) {
      objects[index].object = &section;
    } else if (what == "name") {
      objects[index].names = &section;
    } else if (what == "value") {
      objects[index].values = &section;
    } else if (what.starts_with("sub")) {
      place_sub(section, index, what.substr(3));
    } else if (what != "denotation" && what != "objectlinks") {
      not_understood(section, "");
    }
  }

  void place_sub(const Section& section, std::uint16_t index, std::string_view digits) {
    unsigned sub = 0;
    if (!parse_digits(digits, 16, sub) || sub >= kStructureSub) {
      not_understood(section, ": its sub-index is not in 0 to FEh");
      return;
    }
    const auto [known, is_new] =
        objects[index].subs.try_emplace(static_cast<std::uint8_t>(sub), &section);
    if (!is_new) {
      not_understood(section, ": it is already described in line " +
                                  std::to_string(known->second->place.line));
    }
  }

  void not_understood(const Section& section, const std::string& why) {
    report_.warning(section.place, "section " + quote(section.name) + " is ignored" +
                                       (why.empty() ? ": its name is not known" : why));
  }

  Report& report_;
};

}  // namespace

std::map<std::uint16_t, ObjectSections> sort_sections(const Ini& ini, Report& report) {
  Sorter sorter(report);
  for (const Section& section : ini.sections()) {
    sorter.add(section);
  }
  return std::move(sorter.objects);
}

}  // namespace linegate::eds
