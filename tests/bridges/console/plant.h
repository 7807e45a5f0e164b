// SPDX-License-Identifier: Apache-2.0
// Two lines as a console receives them: press (network 3) with a drive and an unconfigured node,
// hall (4) with a thermometer.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <utility>

#include "bridges/console/model.h"
#include "stack/line/event_severity.h"

namespace linegate::console::test {

inline const LineId kPress{"plant", "press"};
inline const LineId kHall{"plant", "hall"};

inline LineView line_view(std::uint16_t network) {
  LineView view{.interface_uri = "virtual:press", .bit_rate = 500'000, .access = "all"};
  view.state.network_id = network;
  view.state.bus = can::BusState::error_active;
  view.state.load_permille = 123;
  view.state.nodes_configured = 1;
  view.state.nodes_operational = 1;
  return view;
}

inline image::Layout inputs() {
  image::Layout out{.direction = image::Direction::inputs, .id = 9, .byte_size = 6};
  out.entries.push_back({.bit_length = 16,
                         .type = od::DataType::integer16,
                         .node = 5,
                         .index = 0x6064,
                         .remote_pdo = 1,
                         .name = "ram.Position [mm]"});
  out.entries.push_back({.bit_offset = 16,
                         .bit_length = 32,
                         .type = od::DataType::real32,
                         .node = 5,
                         .index = 0x6077,
                         .remote_pdo = 2,
                         .name = "ram.Torque"});
  return out;
}

// -200 in the first entry, received 0.2 s before the image was taken. The second entry is invalid.
inline image::Snapshot input_image(std::uint64_t layout_id) {
  constexpr Duration kSecond = std::chrono::seconds(1);
  image::Snapshot out{.layout_id = layout_id, .sequence = 4, .acquired = Instant(2 * kSecond)};
  out.bytes = {std::byte{0x38}, std::byte{0xFF}, {}, {}, {}, {}};
  out.changed = {0b01};
  out.valid = {0b01};
  out.marks.push_back({.remote_pdo = 1,
                       .node = 5,
                       .count = 1,
                       .time = Instant(2 * kSecond - kSecond / 5),
                       .first_entry = 0,
                       .entries = 1});
  return out;
}

inline EventView event(EventKind kind, std::uint64_t number, std::uint8_t node, std::string text) {
  const EventData data = empty_event_data(kind);
  return {.number = number,
          .time = Instant{std::chrono::seconds(number)},
          .kind = kind,
          .severity = line::severity_of(data),
          .node = node,
          .data = data,
          .text = std::move(text)};
}

inline void add_hall(Model& model) {
  image::Layout layout{.direction = image::Direction::inputs, .id = 11, .byte_size = 2};
  layout.entries.push_back({.bit_length = 16,
                            .type = od::DataType::unsigned16,
                            .node = 10,
                            .index = 0x6401,
                            .sub = 1,
                            .remote_pdo = 1,
                            .name = "climate.Temperature [\xC2\xB0"
                                    "C]"});
  image::Snapshot image{.layout_id = 11, .changed = {0}, .valid = {1}};
  image.bytes = {std::byte{21}, std::byte{0}};
  model.on_line(kHall, line_view(4));
  model.on_node(kHall, {.name = "climate", .state = {.node = 10, .configured = true}});
  model.on_layout(kHall, layout);
  model.on_image(kHall, image);
  model.on_layout(kHall, {.direction = image::Direction::outputs, .id = 12});
}

inline Model plant() {
  Model model;
  add_hall(model);
  model.on_line(kPress, line_view(3));
  model.on_node(kPress, {.name = "ram",
                         .state = {.node = 5,
                                   .configured = true,
                                   .state = nmt::State::operational,
                                   .presence = line::Presence::present,
                                   .boot = manager::kBooted,
                                   .vendor = 0x319,
                                   .last_emcy = 0x8130,
                                   .emcy_count = 2}});
  model.on_node(kPress, {.state = {.node = 9, .state = nmt::State::pre_operational}});
  model.on_layout(kPress, inputs());
  model.on_image(kPress, input_image(9));
  image::Layout outputs{.direction = image::Direction::outputs, .id = 10, .byte_size = 2};
  outputs.entries.push_back({.bit_length = 16,
                             .type = od::DataType::unsigned16,
                             .node = 5,
                             .index = 0x6040,
                             .remote_pdo = 1,
                             .name = "ram.Controlword"});
  image::Snapshot image{.direction = image::Direction::outputs, .layout_id = 10};
  image.bytes = {std::byte{0x0F}, std::byte{0}};
  image.changed = {0};
  image.valid = {1};
  model.on_layout(kPress, outputs);
  model.on_image(kPress, image);
  model.on_event(kPress, event(EventKind::line_started, 1, 0, "first"));
  model.on_event(kPress, event(EventKind::heartbeat_lost, 2, 5, "second"));
  return model;
}

}  // namespace linegate::console::test
