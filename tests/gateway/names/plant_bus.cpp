// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/names/plant_bus.h"

#include <array>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"

namespace linegate::names {
namespace {

using std::chrono::milliseconds;

constexpr std::uint8_t kStart = 1;
constexpr std::uint8_t kOperational = 5;
constexpr std::uint8_t kPreOperational = 127;

std::string diagnostics_text(const std::vector<Diagnostic>& diagnostics) {
  std::string out;
  for (const Diagnostic& one : diagnostics)
    out += to_string(one) + '\n';
  return out;
}

std::array<std::byte, 1> octet(std::uint8_t value) {
  return {std::byte{value}};
}

}  // namespace

PlantBus::PlantBus(const std::vector<RandomDevice>& devices) {
  line::LineConfig config;
  config.name = "press";
  for (const RandomDevice& device : devices) {
    line::NodeConfig node;
    node.id = static_cast<std::uint8_t>(config.nodes.size() + 1);
    node.name = "n" + std::to_string(node.id);
    auto loaded = eds::load(device.eds(), node.name + ".eds", node.id);
    if (!loaded.value) {
      error_ = "the file of " + node.name + ": " + diagnostics_text(loaded.diagnostics);
      return;
    }
    node.device = std::move(*loaded.value);
    node.heartbeat = milliseconds(100);
    states_[node.id] = 0;
    config.nodes.push_back(std::move(node));
  }
  auto made = line::Line::make(std::move(config));
  if (!made.value) {
    error_ = "the line: " + diagnostics_text(made.diagnostics);
    return;
  }
  line_ = std::move(*made.value);
  line_->start(now_);
  pass(std::chrono::seconds(2));
}

void PlantBus::send(std::uint32_t identifier, std::span<const std::byte> data) {
  can::Frame frame = can::make_frame(identifier, data);
  frame.time = now_;
  line_->receive(std::span(&frame, 1), now_);
}

void PlantBus::pass(Duration time) {
  for (const Instant end = now_ + time; now_ < end; now_ += milliseconds(1)) {
    line_->advance(now_);
    for (can::Frame frame; line_->next_frame(frame, now_);)
      answer(frame);
    if (now_ < heartbeat_)
      continue;
    heartbeat_ = now_ + milliseconds(50);
    for (const auto& [node, state] : states_) {
      if (state != 0)
        send(0x700U + node, octet(state));
    }
  }
}

image::Snapshot PlantBus::snapshot(image::Direction direction) {
  image::Snapshot out;
  line_->snapshot(direction, out, now_, false);
  return out;
}

std::vector<std::byte> PlantBus::last_frame(std::uint32_t identifier) const {
  const auto found = frames_.find(identifier);
  return found == frames_.end() ? std::vector<std::byte>{} : found->second;
}

void PlantBus::answer(const can::Frame& frame) {
  if (frame.id > 0x600 && frame.id <= 0x67F)
    return answer_sdo(static_cast<std::uint8_t>(frame.id - 0x600), frame);
  frames_[frame.id].assign(frame.bytes().begin(), frame.bytes().end());
  if (frame.id != 0)
    return;
  for (auto& [node, state] : states_) {
    if (frame.data[1] != std::byte{0} && frame.data[1] != std::byte{node})
      continue;
    if (frame.data[0] == std::byte{kStart}) {
      state = kOperational;
    } else {
      send(0x700U + node, octet(0));
      state = kPreOperational;
    }
  }
}

// A device type of 0, no identity, and every download is accepted.
void PlantBus::answer_sdo(std::uint8_t node, const can::Frame& request) {
  std::array<std::byte, 8> response{};
  std::copy_n(request.data.begin() + 1, 3, response.begin() + 1);
  const unsigned command = std::to_integer<unsigned>(request.data[0]) >> 5U;
  const auto index = load_le<std::uint16_t>(request.data.data() + 1);
  if (command == 1) {
    response[0] = std::byte{0x60};
  } else if (command == 2 && index == 0x1000) {
    response[0] = std::byte{0x43};
  } else if (command == 2) {
    response[0] = std::byte{0x80};
    store_le(std::span(response).subspan(4), std::uint32_t{0x0602'0000});
  } else {
    return;
  }
  send(0x580U + node, response);
}

}  // namespace linegate::names
