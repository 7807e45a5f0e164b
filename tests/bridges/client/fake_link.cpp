// SPDX-License-Identifier: Apache-2.0
#include "fake_link.h"

namespace linegate::client {
namespace {

dds::Source source_of(std::uint64_t incarnation) {
  return {.gateway = "gw", .line = "press", .incarnation = incarnation};
}

}  // namespace

void FakeWorld::line(std::uint64_t incarnation, const std::string& namesakes) {
  std::vector<dds::Property> properties{{"lines", "1"}};
  if (!namesakes.empty())
    properties.push_back({"namesakes", namesakes});
  samples.emplace_back([incarnation, properties](dds::ClientListener& to) {
    to.on_line(source_of(incarnation), {}, {}, properties);
  });
}

void FakeWorld::node(std::uint64_t incarnation, const line::NodeState& state) {
  samples.emplace_back([incarnation, state](dds::ClientListener& to) {
    to.on_node(source_of(incarnation), {}, state, {});
  });
}

void FakeWorld::gateway(std::uint64_t incarnation, std::uint64_t events) {
  samples.emplace_back([incarnation, events](dds::ClientListener& to) {
    dds::GatewayInfo info;
    info.events = events;
    to.on_gateway({.gateway = "gw", .incarnation = incarnation}, info);
  });
}

void FakeWorld::gateway_event(std::uint64_t incarnation, std::uint64_t number) {
  samples.emplace_back([incarnation, number](dds::ClientListener& to) {
    dds::ReceivedEvent event{};
    event.number = number;
    to.on_event({.gateway = "gw", .incarnation = incarnation}, event, "text", {});
  });
}

void FakeWorld::invalid_image(image::Direction direction, std::uint64_t incarnation) {
  image::Snapshot out;
  out.direction = direction;
  out.layout_id = 7;
  out.sequence = ++sequence_;
  out.bytes = {std::byte{}};
  out.changed = {1};
  out.valid = {0};
  out.known = {0};
  samples.emplace_back(
      [incarnation, out](dds::ClientListener& to) { to.on_image(source_of(incarnation), out); });
}

void FakeWorld::layout(image::Direction direction, std::uint64_t incarnation, std::uint64_t id,
                       const std::string& name) {
  image::Layout out;
  out.direction = direction;
  out.id = id;
  image::Entry& entry = out.entries.emplace_back();
  const bool is_long = direction == image::Direction::outputs && out_bytes > 1;
  out.byte_size = is_long ? static_cast<std::uint32_t>(out_bytes) : 1;
  entry.bit_length = static_cast<std::uint16_t>(8 * out.byte_size);
  entry.type = is_long ? od::DataType::octet_string : od::DataType::unsigned8;
  entry.node = 1;
  entry.scaling = scaling;
  entry.name = direction == image::Direction::inputs ? "ram.In" : "ram.Out";
  if (!name.empty())
    entry.name = name;
  samples.emplace_back(
      [incarnation, out](dds::ClientListener& to) { to.on_layout(source_of(incarnation), out); });
}

void FakeWorld::image(image::Direction direction, std::uint64_t incarnation, std::uint8_t value,
                      std::uint64_t id) {
  image::Snapshot out;
  out.direction = direction;
  out.layout_id = id;
  out.sequence = ++sequence_;
  out.bytes = {std::byte{value}};
  out.changed = {1};
  out.valid = {1};
  out.known = {1};
  samples.emplace_back(
      [incarnation, out](dds::ClientListener& to) { to.on_image(source_of(incarnation), out); });
}

void FakeWorld::group(std::uint64_t incarnation, const line::OutputState& state) {
  samples.emplace_back([incarnation, state](dds::ClientListener& to) {
    to.on_output_state(source_of(incarnation), state);
  });
}

void FakeWorld::group_gone(std::uint16_t group) {
  samples.emplace_back(
      [group](dds::ClientListener& to) { to.on_output_state_gone("gw", "press", group); });
}

void FakeWorld::gone() {
  samples.emplace_back([](dds::ClientListener& to) { to.on_line_gone("gw", "press"); });
}

void FakeWorld::progress(std::uint8_t node, const event::CommandProgress& progress) {
  samples.emplace_back([node, progress](dds::ClientListener& to) {
    dds::ReceivedEvent event;
    event.number = 1;
    event.kind = EventKind::command_progress;
    event.node = node;
    event.data = progress;
    to.on_event(source_of(1), event, "", {});
  });
}

void FakeWorld::reply(std::uint64_t id, linegate::Error error, std::vector<std::byte> bytes) {
  dds::CommandResult out;
  out.id = id;
  out.reply.error = error;
  out.bytes = std::move(bytes);
  samples.emplace_back([out](dds::ClientListener& to) { to.on_reply({}, out); });
}

void FakeWorld::whole_line(std::uint64_t incarnation) {
  using enum image::Direction;
  line(incarnation);
  for (const auto direction : {inputs, outputs}) {
    layout(direction, incarnation);
    image(direction, incarnation, 5);
  }
  group(incarnation, {});
}

}  // namespace linegate::client
