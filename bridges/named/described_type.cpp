// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/described_type.h"

#include <string_view>

#include "bridges/named/member_text.h"

namespace linegate::named {
namespace {

constexpr std::uint16_t kLongestKey = 64;  // of a gateway or a line

void add_marks(const DeviceType& type, std::string_view mark, Form form,
               std::vector<DescribedMember>& out) {
  for (const Member& member : type.members) {
    out.push_back({std::string(mark) + '_' + member.identifier, form, 0});
  }
}

}  // namespace

std::vector<DescribedMember> described_members(const DeviceType& type) {
  const bool is_input = type.direction == image::Direction::inputs;
  std::vector<DescribedMember> out = {{"gateway", Form::text, kLongestKey},
                                      {"line", Form::text, kLongestKey},
                                      {"incarnation", Form::uint64, 0},
                                      {"sequence_number", Form::uint64, 0},
                                      {"time", Form::int64, 0},
                                      {"clock", Form::uint8, 0}};
  const std::string time_of = is_input ? "received_" : "sent_";
  for (const std::uint16_t pdo : type.pdos) {
    out.push_back({time_of + time_member(pdo), Form::int64, 0});
  }
  add_marks(type, "valid", Form::boolean, out);
  if (!is_input) {
    add_marks(type, "known", Form::boolean, out);
    add_marks(type, "waits", Form::uint8, out);
  }
  for (const Member& member : type.members) {
    out.push_back({"values_" + member.identifier, member.form, member.length});
  }
  return out;
}

// CompleteTypeObject (DDS-XTypes 1.2, annex B) as Fast DDS 2.9 writes it: for each member its
// number, flags, type and name, and empty lists of annotations, with padding.
std::size_t description_size(const std::vector<DescribedMember>& members) {
  constexpr std::size_t kHead = 512;  // with the name of the type
  constexpr std::size_t kMember = 48;
  std::size_t out = kHead;
  for (const DescribedMember& member : members) {
    out += kMember + member.name.size();
  }
  return out;
}

bool can_be_described(const DeviceType& type) {
  return description_size(described_members(type)) <= kLongestDescription;
}

}  // namespace linegate::named
