// SPDX-License-Identifier: Apache-2.0
// Text that any participant of the DDS domain can publish never reaches a terminal as a control
// sequence.
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "bridges/console/commands.h"

#include "tests/bridges/console/command_test.h"

namespace linegate::console {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr const char* kEscape =
    "x\x1b[2J\x1b]0;owned\x07\nforged line\xC2\x9B"
    "2J\x7F\xFF";

image::Layout named_entry(image::Direction direction) {
  image::Layout out{.direction = direction, .id = 5, .byte_size = 1};
  out.entries.push_back({.bit_length = 8,
                         .type = od::DataType::unsigned8,
                         .node = 8,
                         .index = 0x6200,
                         .sub = 1,
                         .remote_pdo = 1,
                         .name = kEscape,
                         .scaling = {.unit = kEscape},
                         .high = 0});
  return out;
}

// A line whose names, texts and answers all contain control sequences.
class EscapingGateway : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    LineView view{.interface_uri = kEscape, .access = kEscape};
    view.state.nodes_configured = 1;
    listener.on_line(id, view);
    listener.on_node(id, {.name = kEscape, .state = {.node = 8, .configured = true}});
    for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
      listener.on_layout(id, named_entry(direction));
      image::Snapshot image{.direction = direction, .layout_id = 5, .sequence = 1};
      image.bytes.resize(1);
      image.changed = {0};
      image.valid = {1};
      listener.on_image(id, image);
    }
  }
  Answer call(const LineId& /*id*/, const line::Command& /*command*/, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    return escaping();
  }
  Answer call_gateway(const LineId& /*id*/, const request::GatewayRequest& /*request*/,
                      Duration /*timeout*/, Listener& /*listener*/) override {
    return escaping();
  }
  Answer escaping() const {
    Answer out;
    out.text = kEscape;
    out.reply.error = line::to_error(refusal);
    const std::string text = kEscape;
    const auto bytes = std::as_bytes(std::span(text));
    out.reply.data = std::vector(bytes.begin(), bytes.end());
    return out;
  }

  LineId id{kEscape, kEscape};
  line::Refusal refusal = line::Refusal::not_permitted;
};

class Escapes : public test::CommandTest<EscapingGateway> {
 protected:
  void expect_none(const std::function<int()>& command, const std::string& name) {
    out_.str("");
    err_.str("");
    (void)command();
    for (const std::string& text : {out_.str(), err_.str()}) {
      for (const char* const bad : {"\x1b", "\x07", "\nforged", "\xC2\x9B", "\x7F", "\xFF"}) {
        EXPECT_THAT(text, Not(HasSubstr(bad))) << name;
      }
    }
  }
  void expect_none_of_all() {
    expect_none([&] { return lines(context_); }, "lines");
    expect_none([&] { return nodes(context_, ""); }, "nodes");
    expect_none([&] { return routes(context_); }, "routes");
    expect_none([&] { return image(context_, "", image::Direction::inputs); }, "image");
    expect_none([&] { return image(context_, "", image::Direction::outputs); }, "image -o");
    expect_none([&] { return write(context_, line_, "no such entry", "1"); }, "no entry");
    expect_none([&] { return write(context_, line_, "0", "1"); }, "write");
    expect_none([&] { return sdo_read(context_, line_ + ":8", "1000:00", "", "u32"); }, "read");
    expect_none([&] { return sdo_read(context_, line_ + ":all", "1000:00", "", "u32"); }, "all");
    expect_none([&] { return sdo_write(context_, line_ + ":8", "1017", "0", "u16", "5"); },
                "sdo write");
    expect_none([&] { return sdo_read(context_, "other:8", "1000:00", "", "u32"); }, "no line");
    expect_none([&] { return nmt(context_, "start", line_ + ":other"); }, "no node");
    expect_none([&] { return bus_restart(context_, line_); }, "bus-restart");
    expect_none([&] { return fault(context_, line_, {}); }, "fault");
    expect_none([&] { return versions(context_, ""); }, "versions");
  }

  std::string line_ = kEscape;
};

TEST_F(Escapes, FromTheNetworkReachNoTerminal) {
  expect_none_of_all();
  gateway_.refusal = line::Refusal::none;
  expect_none_of_all();
}

TEST_F(Escapes, FromTheNetworkReachNoTerminalAsJson) {
  context_.json = true;
  expect_none_of_all();
  gateway_.refusal = line::Refusal::none;
  expect_none_of_all();
}

}  // namespace
}  // namespace linegate::console
