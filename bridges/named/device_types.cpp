// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/device_types.h"

#include <algorithm>
#include <map>
#include <utility>

#include "bridges/named/identifiers.h"
#include "bridges/named/ros2_types.h"
#include "bridges/named/type_parts.h"

namespace linegate::named {
namespace {

// The version of the fixed members, and of the readings: part of the hash.
constexpr std::string_view scheme_of(image::Direction direction) {
  return direction == image::Direction::inputs ? "1" : "2";
}

class Maker {
 public:
  Maker(std::string_view line, const image::Layout& layout, std::span<const Alias> aliases)
      : line_(line), layout_(layout), aliases_(aliases) {}

  DeviceTypes run() {
    for (std::uint32_t i = 0; i < layout_.entries.size(); ++i) {
      add(i);
    }
    DeviceTypes out{.types = {}, .collisions = std::move(collisions_)};
    for (Draft& draft : drafts_) {
      if (!draft.collides) {
        finish(draft.type);
        out.types.push_back(std::move(draft.type));
      }
    }
    return out;
  }

 private:
  struct Draft {
    DeviceType type;
    Identifiers scope;
    bool collides = false;
  };

  Draft& draft_of(std::string_view device, std::uint8_t node) {
    const auto [known, is_new] = places_.try_emplace(std::string(device), drafts_.size());
    if (is_new) {
      drafts_.emplace_back();
      DeviceType& type = drafts_.back().type;
      type.line = line_;
      type.device = device;
      type.direction = layout_.direction;
      type.node = node;
    }
    return drafts_[known->second];
  }

  void add(std::uint32_t number) {
    const image::Entry& entry = layout_.entries[number];
    Draft& draft = draft_of(parts_of(entry).device, entry.node);
    Member member = member_of(layout_, number);
    member.identifier = object_identifier(layout_, entry, aliases_);
    if (const std::string why = complaint_about(draft, entry, member); !why.empty()) {
      collisions_.push_back(why);
      draft.collides = true;
      return;
    }
    draft.type.members.push_back(std::move(member));
  }

  std::string complaint_about(Draft& draft, const image::Entry& entry, const Member& member) const {
    const std::string name = printable(entry.name);
    const std::string of = std::string(image::name(layout_.direction)) + " of line " + line_ + ": ";
    if (entry.node != draft.type.node) {
      return of + "\"" + name + "\" is of node " + std::to_string(entry.node) + ", and node " +
             std::to_string(draft.type.node) + " has the name " + draft.type.device +
             ", too: give it another name";
    }
    if (!is_identifier(member.identifier)) {
      return of + "\"" + name + "\" makes no identifier: give it an alias";
    }
    const auto other = draft.scope.add(member.identifier, entry.name);
    return other ? of + "\"" + name + "\" and \"" + printable(*other) +
                       "\" make the same identifier " + member.identifier +
                       ": give one of them an alias"
                 : std::string();
  }

  static void finish(DeviceType& type) {
    for (const Member& member : type.members) {
      const auto place = std::ranges::lower_bound(type.pdos, member.pdo);
      if (member.pdo != 0 && (place == type.pdos.end() || *place != member.pdo)) {
        type.pdos.insert(place, member.pdo);
      }
    }
    TypeHash hash;
    hash.add(scheme_of(type.direction));
    hash.add(type.line);
    hash.add(type.device);
    hash.add(image::name(type.direction));
    for (const Member& member : type.members) {
      hash.add(member);
    }
    type.name = name_part(type.line) + '_' + name_part(type.device) + '_' +
                std::string(image::name(type.direction)) + '_' + hash.digits();
  }

  std::string line_;
  const image::Layout& layout_;
  std::span<const Alias> aliases_;
  std::vector<Draft> drafts_;
  std::map<std::string, std::size_t> places_;  // of the draft of each device
  std::vector<std::string> collisions_;
};

}  // namespace

std::string DeviceType::type_name() const {
  return ros2 ? ros2_type_name(name) : std::string(kModule) + "::" + name;
}

std::string DeviceType::topic() const {
  return ros2 ? ros2_topic(*this)
              : std::string(kModule) + '/' + line + '/' + device + '/' +
                    std::string(image::name(direction));
}

DeviceTypes device_types(std::string_view line, const image::Layout& layout,
                         std::span<const Alias> aliases) {
  return Maker(line, layout, aliases).run();
}

}  // namespace linegate::named
