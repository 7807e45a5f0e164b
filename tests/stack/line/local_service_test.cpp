// SPDX-License-Identifier: Apache-2.0
#include "stack/line/local_service.h"

#include <gtest/gtest.h>

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

constexpr od::Address kHeartbeat{0x1017, 0};

// Completes writes later.
struct LateHook final : od::Hook {
  AbortCode check_write(od::Address /*address*/, std::span<const std::byte> /*value*/) override {
    return od::kLater;
  }
  void put_off(od::Address /*address*/, od::Ticket of_access) override { ticket = of_access; }
  void cancelled(od::Ticket /*ticket*/) override { is_cancelled = true; }

  od::Ticket ticket = 0;
  bool is_cancelled = false;
};

struct LocalServiceTest : testing::Test {
  void execute(Request request) {
    service.execute({.tag = ++tag, .request = std::move(request)}, parts.now);
  }
  void read(od::Address address) { execute(LocalRead{.what = address}); }
  void write(od::Address address, std::vector<std::byte> data) {
    execute(LocalWrite{.address = address, .data = std::move(data)});
  }
  void list(std::uint8_t node = 0) {
    execute(LocalRead{.node = node, .what = ObjectRange{0x1000, 0xFFFF}});
  }

  NodeParts parts{config_with_axis()};
  RecordingHost host;
  LocalService service{host, parts.node->dictionary(), parts.own_objects, parts.config};
  std::uint64_t tag = 0;
};

const std::vector<std::byte> kTwoBytes{std::byte{0xE8}, std::byte{3}};

TEST_F(LocalServiceTest, ReadsAndWritesTheOwnDictionary) {
  write(kHeartbeat, kTwoBytes);
  EXPECT_EQ(host.answer(tag), Error{});
  read(kHeartbeat);
  EXPECT_EQ(host.answer(tag), Error{});
  EXPECT_EQ(host.bytes(tag), kTwoBytes);
  write(kHeartbeat, {std::byte{1}});
  EXPECT_EQ(host.answer(tag), to_error(AbortCode::length_too_low));
  read({0x2FFF, 0});
  EXPECT_EQ(host.answer(tag), to_error(AbortCode::no_object));
}

TEST_F(LocalServiceTest, AWriteWhoseObjectAnswersLaterIsAnsweredThen) {
  LateHook late;
  ASSERT_TRUE(parts.node->dictionary().add_hook(kHeartbeat.index, late).ok());
  write(kHeartbeat, kTwoBytes);
  service.advance(parts.now);
  EXPECT_FALSE(host.answer(tag));
  EXPECT_TRUE(parts.node->dictionary().complete(late.ticket, AbortCode::none));
  service.advance(parts.now);
  EXPECT_EQ(host.answer(tag), Error{});
  EXPECT_EQ(parts.node->dictionary().number(kHeartbeat), 1000U);
  parts.node->dictionary().remove_hook(kHeartbeat.index, late);
}

TEST_F(LocalServiceTest, EndCancelsWritesThatWait) {
  LateHook late;
  ASSERT_TRUE(parts.node->dictionary().add_hook(kHeartbeat.index, late).ok());
  write(kHeartbeat, kTwoBytes);
  service.end(Refusal::cancelled, parts.now);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::cancelled));
  EXPECT_TRUE(late.is_cancelled);
  service.end(Refusal::cancelled, parts.now);
  parts.node->dictionary().remove_hook(kHeartbeat.index, late);
}

TEST_F(LocalServiceTest, ObjectsAreListedOfTheOwnNodeAndOfADeviceFile) {
  list();
  EXPECT_EQ(host.answer(tag), Error{});
  EXPECT_FALSE(std::get<std::vector<ListedObject>>(host.data(tag)).empty());
  list(5);
  EXPECT_EQ(host.answer(tag), Error{});
  EXPECT_NE(host.data(tag), host.data(tag - 1));
  list(6);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::bad_request)) << "no such node is configured";
}

TEST_F(LocalServiceTest, CreatesAndRemovesObjects) {
  OwnObject object{.index = 0x2100};
  object.variable.type = od::DataType::unsigned16;
  object.variable.access = od::Access::rw;
  execute(ObjectCreate{object});
  EXPECT_EQ(host.answer(tag), Error{});
  write({0x2100, 0}, kTwoBytes);
  EXPECT_EQ(host.answer(tag), Error{});
  execute(ObjectCreate{ObjectRemoval{0x2100}});
  EXPECT_EQ(host.answer(tag), Error{});
  execute(ObjectCreate{ObjectRemoval{0x2100}});
  EXPECT_EQ(host.answer(tag), to_error(Refusal::unknown_entry));
  object.variable.type = od::DataType::domain;
  execute(ObjectCreate{object});
  EXPECT_EQ(host.answer(tag), to_error(Refusal::bad_request));
}

}  // namespace
}  // namespace linegate::line
