// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/group_types.h"

#include <algorithm>
#include <utility>

#include "bridges/named/identifiers.h"
#include "bridges/named/type_parts.h"
#include "stack/line/output_write.h"

namespace linegate::named {
namespace {

constexpr std::string_view kSetEnding = "/outputs/set";

// The version of the members of a group's type that are not values: part of the hash.
constexpr std::string_view kSetScheme = "set 1";
constexpr unsigned kMostBits = 8 * line::OutputValue::kMaxLength;

class GroupMaker {
 public:
  GroupMaker(const image::Layout& outputs, std::span<const Alias> aliases, const Group& group)
      : outputs_(outputs), aliases_(aliases), group_(group) {}

  // Returns false, with sentences in `collisions`, if the group has no type.
  bool run(GroupType& type, std::vector<std::string>& collisions) {
    std::vector<std::uint32_t> entries = group_.entries;
    std::ranges::sort(entries);
    bool good = !entries.empty();
    if (!good) {
      collisions.push_back(of() + "it has no outputs");
    }
    for (const std::uint32_t entry : entries) {
      if (std::string why = add(entry, type); !why.empty()) {
        collisions.push_back(of() + std::move(why));
        good = false;
      }
    }
    return good;
  }

 private:
  std::string of() const { return "group " + group_.name + " has no named topic: "; }

  // Returns why there is no member for the entry; empty: there is one.
  std::string add(std::uint32_t number, GroupType& type) {
    if (number >= outputs_.entries.size()) {
      return "it has outputs that the layout does not have";
    }
    const image::Entry& entry = outputs_.entries[number];
    const std::string name = '"' + printable(entry.name) + '"';
    const std::string object = object_identifier(outputs_, entry, aliases_);
    Member member = member_of(outputs_, number);
    member.identifier = identifier_of(std::string(parts_of(entry).device) + '.' + object);
    member.object_name = entry.name;
    if (entry.bit_length > kMostBits) {
      return name + " is longer than " + std::to_string(line::OutputValue::kMaxLength) + " octets";
    }
    if (object.empty() || !is_identifier(member.identifier)) {
      return name + " makes no identifier: give it an alias";
    }
    if (const auto other = scope_.add(member.identifier, entry.name)) {
      return name + " and \"" + printable(*other) + "\" make the same identifier " +
             member.identifier + ": give one of them an alias";
    }
    type.members.push_back(std::move(member));
    return {};
  }

  const image::Layout& outputs_;
  std::span<const Alias> aliases_;
  const Group& group_;
  Identifiers scope_;
};

std::string struct_name(const GroupType& type) {
  TypeHash hash;
  hash.add(kSetScheme);
  hash.add(std::string_view(type.line));
  hash.add(std::string_view(type.group));
  hash.add(type.number);
  for (const Member& member : type.members) {
    hash.add(member);
  }
  return name_part(type.line) + '_' + name_part(type.group) + "_set_" + hash.digits();
}

}  // namespace

std::string GroupType::type_name() const {
  return std::string(kModule) + "::" + name;
}

std::string GroupType::topic() const {
  return std::string(kModule) + '/' + line + '/' + group + std::string(kSetEnding);
}

bool is_set_topic(std::string_view topic) {
  return topic.starts_with(std::string(kModule) + '/') && topic.ends_with(kSetEnding);
}

GroupTypes group_types(std::string_view line, const image::Layout& outputs,
                       std::span<const Group> groups, std::span<const Alias> aliases) {
  GroupTypes out;
  for (const Group& group : groups) {
    GroupType type{.line = std::string(line),
                   .group = group.name,
                   .number = group.number,
                   .layout_id = outputs.id,
                   .name = {},
                   .members = {}};
    if (GroupMaker(outputs, aliases, group).run(type, out.collisions)) {
      type.name = struct_name(type);
      out.types.push_back(std::move(type));
    }
  }
  return out;
}

}  // namespace linegate::named
