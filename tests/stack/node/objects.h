// SPDX-License-Identifier: Apache-2.0
// Objects for the dictionaries of tests, and functions that many tests use.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/dictionary.h"

namespace linegate::testing {

inline od::VariableDescription sub(std::uint8_t number, od::DataType type, std::uint64_t value,
                                   od::Access access = od::Access::rw, bool mappable = false) {
  od::VariableDescription out;
  out.sub = number;
  out.type = type;
  out.access = access;
  out.mappable = mappable;
  out.value.resize(od::byte_size(type));
  store_le(std::span<std::byte>(out.value), value);
  return out;
}

inline od::ObjectDescription object(std::uint16_t index, od::DataType type, std::uint64_t value,
                                    od::Access access = od::Access::rw, bool mappable = false) {
  od::ObjectDescription out;
  out.index = index;
  out.variables.push_back(sub(0, type, value, access, mappable));
  return out;
}

// Sub 0 (the count, or `first`) and elements 1..count of one type, all with `value`.
inline od::ObjectDescription array(std::uint16_t index, od::DataType type, std::uint8_t count,
                                   std::uint64_t value, od::VariableDescription first) {
  od::ObjectDescription out;
  out.index = index;
  out.type = od::ObjectType::array;
  out.variables.push_back(std::move(first));
  for (std::uint8_t i = 1; i <= count; ++i) {
    out.variables.push_back(sub(i, type, value));
  }
  return out;
}

inline od::ObjectDescription array(std::uint16_t index, od::DataType type, std::uint8_t count,
                                   std::uint64_t value = 0) {
  return array(index, type, count, value, sub(0, od::DataType::unsigned8, count, od::Access::ro));
}

inline od::ObjectDescription record(std::uint16_t index,
                                    std::initializer_list<od::VariableDescription> variables) {
  od::ObjectDescription out;
  out.index = index;
  out.type = od::ObjectType::record;
  out.variables = variables;
  return out;
}

inline od::Dictionary dictionary_of(std::initializer_list<od::ObjectDescription> objects) {
  od::DeviceDescription device;
  device.objects = objects;
  return od::Dictionary(device);
}

// A write as by SDO, with as many bytes as T has.
template <class T>
AbortCode write(od::Dictionary& dictionary, od::Address address, T value) {
  std::array<std::byte, sizeof(T)> raw;
  store_le(std::span<std::byte>(raw), static_cast<std::uint64_t>(value));
  return dictionary.write(address, raw);
}

inline std::vector<Event> pop_events(EventLog& log) {
  std::vector<Event> out(1024);
  out.resize(log.take(out));
  return out;
}

// All frames of the queue, highest priority first.
inline std::vector<can::Frame> pop_frames(can::TransmitQueue& queue) {
  std::vector<can::Frame> out;
  can::Frame frame;
  while (queue.pop_urgent(frame) || queue.pop_rest(frame)) {
    out.push_back(frame);
  }
  return out;
}

inline std::vector<int> data_of(const can::Frame& frame) {
  std::vector<int> out;
  for (const std::byte b : frame.bytes()) {
    out.push_back(std::to_integer<int>(b));
  }
  return out;
}

// An instant of virtual time. Not zero, because no real clock returns zero.
template <class D>
constexpr Instant at(D since_start) {
  return Instant{std::chrono::seconds(1000)} + since_start;
}

inline can::Frame frame_at(Instant time, std::uint32_t id,
                           std::initializer_list<std::uint8_t> data) {
  can::Frame frame = can::make_frame(id, data);
  frame.time = time;
  return frame;
}

}  // namespace linegate::testing
