// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/event_words.h"

#include "stack/base/event_members.h"

namespace linegate::plant {
namespace {

class MemberFinder final : public EventMemberVisitor {
 public:
  explicit MemberFinder(std::string_view wanted) : wanted_(wanted) {}

  void number(std::string_view name, std::uint64_t value) override {
    if (name == wanted_) {
      found = value;
    }
  }
  void bytes(std::string_view /*name*/, std::span<const std::byte> /*value*/) override {}

  std::optional<std::uint64_t> found;

 private:
  std::string_view wanted_;
};

class MemberText final : public EventMemberVisitor {
 public:
  void number(std::string_view name, std::uint64_t value) override {
    text += ' ' + std::string(name) + '=' + std::to_string(value);
  }
  void bytes(std::string_view name, std::span<const std::byte> value) override {
    text += ' ' + std::string(name) + '=';
    for (const std::byte b : value) {
      text += std::to_string(std::to_integer<unsigned>(b)) + '.';
    }
    text.pop_back();
  }

  std::string text;
};

}  // namespace

std::optional<std::uint64_t> member_of(const EventData& data, std::string_view name) {
  MemberFinder finder(name);
  visit_members(data, finder);
  return finder.found;
}

std::string members_text(const EventData& data) {
  MemberText text;
  visit_members(data, text);
  return text.text;
}

}  // namespace linegate::plant
