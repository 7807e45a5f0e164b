// SPDX-License-Identifier: Apache-2.0
#include "bridges/client/c_api.h"

#include <gtest/gtest.h>

#include "fake_link.h"

extern "C" int use_in_c(linegate_client* client);  // c_use.c

namespace linegate::client {
namespace {

struct ClientInC : testing::Test {
  std::shared_ptr<FakeWorld> world = std::make_shared<FakeWorld>();
  linegate_client* client = adopt(fake_client(world));
  int line = linegate_line(client, "press");

  void SetUp() override {
    world->whole_line(1);
    ASSERT_EQ(linegate_poll(client, 0), LINEGATE_OK);
    ASSERT_EQ(linegate_line_status(client, line), LINEGATE_STATUS_READY);
  }
  void TearDown() override {
    world->fails = false;
    linegate_close(client);
  }
};

TEST_F(ClientInC, ReadsHoldsAndCommands) {
  const char* const names[] = {"ram.In", "ram.None"};
  linegate_value values[2];
  EXPECT_EQ(linegate_read(client, line, names, 2, values, nullptr), 1);
  EXPECT_EQ(values[0].unsigned_integer, 5U);
  EXPECT_EQ(values[1].quality, LINEGATE_NO_NAME);

  const int group = linegate_group(client, line, "", 1000, 1);
  ASSERT_GT(group, 0);
  EXPECT_EQ(linegate_set_integer(client, group, "ram.Out", 3), LINEGATE_OK);
  EXPECT_EQ(linegate_arm(client, group), LINEGATE_OK);
  EXPECT_EQ(linegate_group_state(client, group, nullptr, 0), LINEGATE_GROUP_TAKING);
  EXPECT_EQ(world->writes.size(), 1U);
  EXPECT_EQ(linegate_release(client, group), LINEGATE_OK);

  const int call = linegate_sdo_read(client, line, 1, 0x1000, 0, 1000);
  ASSERT_GT(call, 0);
  world->reply(1, {}, {std::byte{7}});
  EXPECT_EQ(linegate_call_wait(client, call), 1);
  linegate_result result;
  EXPECT_EQ(linegate_call_result(client, call, &result), LINEGATE_OK);
  EXPECT_EQ(result.number, 7U);
}

TEST_F(ClientInC, CommandsAreTriedAsOftenAsTheLineOrTheRequestSays) {
  const linegate::Error busy = line::to_error(line::Refusal::busy);
  const auto tries = [&](int call) {
    const std::uint64_t before = world->sent;
    linegate_result result{};
    while (linegate_call_result(client, call, &result) == LINEGATE_OK &&
           result.outcome == LINEGATE_PENDING) {
      world->reply(world->sent, busy);
      linegate_poll(client, 0);
    }
    EXPECT_EQ(result.outcome, LINEGATE_REFUSED);
    return world->sent - before + 1;
  };
  EXPECT_EQ(tries(linegate_sdo_read(client, line, 1, 0x1000, 0, 1000)), 1U);
  EXPECT_EQ(linegate_set_attempts(client, line, 3), LINEGATE_OK);
  EXPECT_EQ(linegate_set_attempts(client, -1, 3), LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(tries(linegate_sdo_read(client, line, 1, 0x1000, 0, 1000)), 3U);
  EXPECT_EQ(tries(linegate_sdo_write(client, line, 1, 0x1017, 0, "x", 1, 1000)), 3U);
  EXPECT_EQ(tries(linegate_nmt(client, line, 1, 1, 1000)), 3U);
  linegate_request request{};
  request.size = sizeof request;
  request.node = 1;
  request.attempts = 2;
  EXPECT_EQ(tries(linegate_request_call(client, line, &request, 1000)), 2U);
  EXPECT_EQ(linegate_set_attempts(client, line, 0), LINEGATE_OK);
  EXPECT_EQ(tries(linegate_sdo_read(client, line, 1, 0x1000, 0, 1000)), 1U);
}

TEST_F(ClientInC, AScaledValueHasItsUnitAndTheRawOne) {
  world->scaling = {.unit = "bar", .scale = 0.5, .offset = -1};
  for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
    world->layout(direction, 1, 8);
    world->image(direction, 1, 5, 8);
  }
  ASSERT_EQ(linegate_poll(client, 0), LINEGATE_OK);
  world->now += std::chrono::seconds(1);
  const char* const names[] = {"ram.In"};
  linegate_value value;
  ASSERT_EQ(linegate_read(client, line, names, 1, &value, nullptr), 1);
  EXPECT_EQ(value.type, LINEGATE_REAL);
  EXPECT_EQ(value.real, 1.5);
  EXPECT_EQ(value.number, 1.5);
  EXPECT_STREQ(value.unit, "bar");
  EXPECT_EQ(value.raw_type, LINEGATE_UNSIGNED);
  EXPECT_EQ(value.unsigned_integer, 5U);
  EXPECT_EQ(value.raw, 5);

  const int group = linegate_group(client, line, "", 1000, 1);
  EXPECT_EQ(linegate_set_real(client, group, "ram.Out", 126.8), LINEGATE_ERROR_RANGE);
  EXPECT_EQ(linegate_set_integer(client, group, "ram.Out", 2), LINEGATE_OK);
  EXPECT_EQ(linegate_arm(client, group), LINEGATE_OK);
  ASSERT_EQ(world->writes.size(), 1U);
  EXPECT_EQ(world->writes[0].second.values.at(0).data[0], std::byte{6});
  EXPECT_EQ(linegate_set_raw_integer(client, group, "ram.Out", 256), LINEGATE_ERROR_RANGE);
  EXPECT_EQ(linegate_set_raw_unsigned(client, group, "ram.Out", 255), LINEGATE_OK);
  EXPECT_EQ(linegate_set_raw_real(client, group, "ram.Out", 0.5), LINEGATE_ERROR_RANGE);
}

// A string in a PDO of CANopen FD.
TEST_F(ClientInC, AnOutputOfMoreThanEightBytesIsSet) {
  world->out_bytes = 16;
  world->layout(image::Direction::outputs, 1, 8);
  world->image(image::Direction::outputs, 1, 5, 8);
  ASSERT_EQ(linegate_poll(client, 0), LINEGATE_OK);
  world->now += std::chrono::seconds(1);
  const int group = linegate_group(client, line, "", 1000, 1);
  EXPECT_EQ(linegate_set_bytes(client, group, "ram.Out", "0123456789abcdef", 16), LINEGATE_OK);
  EXPECT_EQ(linegate_arm(client, group), LINEGATE_OK);
  ASSERT_EQ(world->writes.size(), 1U);
  const line::OutputValue& sent = world->writes[0].second.values.at(0);
  EXPECT_EQ(sent.length, 16);
  EXPECT_EQ(sent.data[15], std::byte{'f'});
}

TEST_F(ClientInC, AProgramInCUsesIt) {
  EXPECT_EQ(use_in_c(client), 0);
}

TEST(OptionsInC, LinesAreNamedWithTheirGateway) {
  char error[120];
  linegate_options options{};
  options.size = sizeof options;
  options.interfaces = "no-such-interface";
  options.lines = "cell/press,press";
  EXPECT_EQ(linegate_connect(&options, error, sizeof error), nullptr);
  EXPECT_STREQ(error, "\"press\" is not GATEWAY/LINE");
  options.lines = "cell/press";
  EXPECT_EQ(linegate_connect(&options, error, sizeof error), nullptr);
  EXPECT_NE(std::string(error).find("no-such-interface"), std::string::npos) << error;
}

// The member `lines` was added after the others.
TEST(OptionsInC, AProgramThatWasBuiltBeforeHasNoLines) {
  char error[120];
  linegate_options options{};
  options.size = offsetof(linegate_options, lines);
  options.interfaces = "no-such-interface";
  options.lines = "press";
  EXPECT_EQ(linegate_connect(&options, error, sizeof error), nullptr);
  EXPECT_NE(std::string(error).find("no-such-interface"), std::string::npos) << error;
  options.size -= 1;
  EXPECT_EQ(linegate_connect(&options, error, sizeof error), nullptr);
  EXPECT_NE(std::string(error).find("size"), std::string::npos) << error;
}

TEST_F(ClientInC, WrongArgumentsAreErrors) {
  linegate_value value;
  const char* const names[] = {nullptr};
  EXPECT_EQ(linegate_poll(nullptr, 0), LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(linegate_line(client, nullptr), LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(linegate_read(client, line, names, 1, &value, nullptr), LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(linegate_read(client, line, nullptr, 1, &value, nullptr), LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(linegate_subscribe(client, line, nullptr, 0, nullptr, nullptr),
            LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(linegate_request_call(client, line, nullptr, 0), LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(linegate_sdo_write(client, line, 1, 0, 0, nullptr, 1, 0), LINEGATE_ERROR_ARGUMENT);
  const int group = linegate_group(client, line, "", 0, 0);
  EXPECT_EQ(linegate_arm(client, line), LINEGATE_ERROR_ARGUMENT);  // of another kind
  EXPECT_EQ(linegate_call_wait(client, group), LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(linegate_set_integer(client, group, nullptr, 1), LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(linegate_set_integer(client, group, "ram.None", 1), LINEGATE_ERROR_NAME);
  EXPECT_EQ(linegate_set_integer(client, group, "ram.Out", 256), LINEGATE_ERROR_RANGE);
  EXPECT_EQ(linegate_set_bytes(client, group, "ram.Out", "123456789", 9), LINEGATE_ERROR_TYPE);
  const std::string longer(33, 'x');
  EXPECT_EQ(linegate_set_bytes(client, group, "ram.Out", longer.data(), longer.size()),
            LINEGATE_ERROR_RANGE);
  EXPECT_EQ(linegate_set_text(client, group, "ram.Out", "1"), LINEGATE_ERROR_TYPE);
  EXPECT_EQ(linegate_set_text(client, group, "ram.None", "1"), LINEGATE_ERROR_NAME);
  EXPECT_EQ(linegate_set_text(client, group, "ram.Out", nullptr), LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(linegate_line_status(client, -1), LINEGATE_ERROR_ARGUMENT);
  char name[4];
  EXPECT_EQ(linegate_line_name(client, line, 0, 0, name, sizeof name), LINEGATE_ERROR_TOO_LONG);
  EXPECT_STREQ(name, "ram");
  EXPECT_EQ(linegate_line_name(client, line, 0, 1, name, sizeof name), LINEGATE_ERROR_NAME);
  EXPECT_EQ(linegate_free(client, group), LINEGATE_OK);
  EXPECT_EQ(linegate_free(client, group), LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(linegate_arm(client, group), LINEGATE_ERROR_ARGUMENT);
}

TEST_F(ClientInC, SeveralValuesAreSetOrNoneOfThem) {
  const int group = linegate_group(client, line, "", 1000, 1);
  linegate_setting settings[2] = {
      {.name = "ram.Out", .type = LINEGATE_UNSIGNED, .unsigned_integer = 9},
      {.name = "ram.Out", .type = LINEGATE_REAL, .raw = 1, .real = 300}};
  std::size_t failed = 7;
  EXPECT_EQ(linegate_set(client, group, settings, 2, &failed), LINEGATE_ERROR_RANGE);
  EXPECT_EQ(failed, 1U);
  settings[1] = {.name = nullptr, .type = LINEGATE_INTEGER};
  EXPECT_EQ(linegate_set(client, group, settings, 2, &failed), LINEGATE_ERROR_ARGUMENT);
  settings[1] = {.name = "ram.Out", .type = LINEGATE_TEXT, .length = 1};
  EXPECT_EQ(linegate_set(client, group, settings, 2, nullptr), LINEGATE_ERROR_ARGUMENT);
  settings[1] = {.name = "ram.Out", .type = LINEGATE_NONE};
  EXPECT_EQ(linegate_set(client, group, settings, 2, &failed), LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(linegate_arm(client, group), LINEGATE_OK);
  EXPECT_TRUE(world->writes.back().second.values.empty());
  EXPECT_EQ(linegate_set(client, group, settings, 1, &failed), LINEGATE_OK);
  EXPECT_EQ(linegate_poll(client, 0), LINEGATE_OK);
  ASSERT_EQ(world->writes.back().second.values.size(), 1U);
  EXPECT_EQ(world->writes.back().second.values[0].data[0], std::byte{9});
}

TEST_F(ClientInC, WhatHasNoRoomIsNotSent) {
  int last = 0;
  while ((last = linegate_line(client, "press")) > 0) {
  }
  EXPECT_EQ(last, LINEGATE_ERROR_FULL);
  EXPECT_EQ(linegate_nmt(client, line, 1, 1, 1000), LINEGATE_ERROR_FULL);
  EXPECT_EQ(world->sent, 0U);
  EXPECT_EQ(linegate_free(client, line + 1), LINEGATE_OK);
  EXPECT_GT(linegate_nmt(client, line, 1, 1, 1000), 0);
  EXPECT_EQ(world->sent, 1U);
}

TEST_F(ClientInC, ATextIsCutBetweenTwoCharacters) {
  world->layout(image::Direction::inputs, 1, 7, "a\u00E4\u20AC");
  world->image(image::Direction::inputs, 1, 5, 7);
  ASSERT_EQ(linegate_poll(client, 0), LINEGATE_OK);
  const auto name = [&](std::size_t size) {
    char text[8] = "xxxxxxx";
    EXPECT_EQ(linegate_line_name(client, line, 0, 0, text, size),
              size > 6 ? 6 : LINEGATE_ERROR_TOO_LONG);
    return std::string(text);
  };
  EXPECT_EQ(name(7), "a\u00E4\u20AC");
  for (const std::size_t size : {6U, 5U, 4U})
    EXPECT_EQ(name(size), "a\u00E4") << size;
  for (const std::size_t size : {3U, 2U})
    EXPECT_EQ(name(size), "a") << size;
  EXPECT_EQ(name(1), "");
}

TEST_F(ClientInC, EventsAreFollowedFromAPosition) {
  std::uint64_t number = 0;
  const auto keep = [](void* to, const linegate_event* event) {
    *static_cast<std::uint64_t*>(to) = event->number;
  };
  const int reader = linegate_follow_events(client, "3:8:gw/press", keep, &number);
  ASSERT_GT(reader, 0);
  world->samples.emplace_back([](dds::ClientListener& to) {
    dds::ReceivedEvent event;
    event.stream = 3;
    event.number = 9;
    to.on_event({.gateway = "gw", .line = "press"}, event, "", {});
  });
  EXPECT_EQ(linegate_poll(client, 0), LINEGATE_OK);
  EXPECT_EQ(number, 9U);
  char text[20];
  EXPECT_EQ(linegate_event_position(client, reader, nullptr, 0), 12);
  EXPECT_EQ(linegate_event_position(client, reader, text, sizeof text), 12);
  EXPECT_STREQ(text, "3:9:gw/press");
  EXPECT_EQ(linegate_event_position(client, reader, text, 3), LINEGATE_ERROR_TOO_LONG);
  EXPECT_EQ(linegate_follow_events(client, "3", keep, nullptr), LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(linegate_follow_events(client, nullptr, nullptr, nullptr), LINEGATE_ERROR_ARGUMENT);
  const int plain = linegate_subscribe_events(client, keep, &number);
  EXPECT_EQ(linegate_event_position(client, plain, text, sizeof text), LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(linegate_unsubscribe(client, reader), LINEGATE_OK);
  EXPECT_EQ(linegate_event_position(client, reader, text, sizeof text), LINEGATE_ERROR_ARGUMENT);
}

TEST_F(ClientInC, AnEventOfALaterVersionHasAllItsData) {
  linegate_event got{};
  const auto keep = [](void* to, const linegate_event* event) {
    EXPECT_STREQ(event->name, "");
    *static_cast<linegate_event*>(to) = *event;
  };
  ASSERT_GT(linegate_subscribe_events(client, keep, &got), 0);
  world->samples.emplace_back([](dds::ClientListener& to) {
    dds::ReceivedEvent event;
    event.number = 1;
    event.kind = static_cast<EventKind>(250);
    event.fields.length = 64;
    for (std::size_t i = 0; i < event.fields.data.size(); ++i)
      event.fields.data[i] = static_cast<std::byte>(200 + i);
    to.on_event({.gateway = "gw", .line = "press"}, event, "words", {});
  });
  EXPECT_EQ(linegate_poll(client, 0), LINEGATE_OK);
  EXPECT_EQ(got.size, sizeof got);
  EXPECT_EQ(got.kind, 250);
  ASSERT_EQ(got.length, 64);
  for (std::size_t i = 0; i < sizeof got.data; ++i)
    EXPECT_EQ(got.data[i], static_cast<std::uint8_t>(200 + i)) << i;
}

TEST_F(ClientInC, AClosedOrForeignClientIsAnError) {
  EXPECT_EQ(linegate_close(client), LINEGATE_OK);
  EXPECT_EQ(linegate_poll(client, 0), LINEGATE_ERROR_CLOSED);
  EXPECT_EQ(linegate_close(client), LINEGATE_ERROR_CLOSED);
  int foreign = 0;
  EXPECT_EQ(linegate_wake(reinterpret_cast<linegate_client*>(&foreign)), LINEGATE_ERROR_CLOSED);
}

TEST_F(ClientInC, AnExceptionOfTheLinkIsAnErrorAndTheClientCanBeClosed) {
  const int call = linegate_sdo_read(client, line, 1, 0x1000, 0, 1000);
  const int absent = linegate_line(client, "absent");
  world->fails = true;
  EXPECT_EQ(linegate_poll(client, 0), LINEGATE_ERROR_MEMORY);
  EXPECT_EQ(linegate_line_wait(client, absent, 10), LINEGATE_ERROR_MEMORY);
  EXPECT_EQ(linegate_call_wait(client, call), LINEGATE_ERROR_MEMORY);
  EXPECT_EQ(linegate_call_cancel(client, call), LINEGATE_ERROR_MEMORY);
  EXPECT_EQ(linegate_wake(client), LINEGATE_ERROR_MEMORY);
  world->fails = false;
  EXPECT_EQ(linegate_poll(client, 0), LINEGATE_OK);
  EXPECT_EQ(linegate_close(client), LINEGATE_OK);
}

}  // namespace
}  // namespace linegate::client
