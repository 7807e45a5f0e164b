// SPDX-License-Identifier: Apache-2.0
// Composes an input of the target `line`, step by step.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <span>
#include <string>

#include "stack/can/frame.h"
#include "stack/line/command.h"

#include "tests/fuzz/command_form.h"
#include "tests/fuzz/line_input.h"

namespace linegate::fuzz {

// The bytes of the setup: the role, and bits.
constexpr SetupBytes setup_bytes(Role role, std::initializer_list<SetupBit> bits) {
  SetupBytes out{static_cast<std::uint8_t>(role)};
  for (const SetupBit bit : bits) {
    out[bit / 8U] |= static_cast<std::uint8_t>(1U << bit % 8U);
  }
  return out;
}

class Steps {
 public:
  explicit Steps(const SetupBytes& setup) {
    for (const std::uint8_t byte : setup) {
      put({byte});
    }
  }

  void step(Step step, std::initializer_list<std::uint8_t> fields = {}) {
    put({static_cast<std::uint8_t>(step)});
    put(fields);
  }

  void frame(const can::Frame& frame) {
    step(Step::frame, {byte_of(frame.id, 0), byte_of(frame.id, 1), frame.length});
    put_data(frame.bytes());
  }

  // Precondition: fewer than 64 bytes of data, a time-out of whole milliseconds below 128 or of
  // tenths of a second, up to 12.5 s.
  void command(const CommandForm& form) {
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(form.timeout).count();
    const auto timeout = static_cast<std::uint8_t>(ms < 0x80 ? ms : 0x80 + ms / 100);
    step(Step::command, {static_cast<std::uint8_t>(form.kind), form.node, byte_of(form.index, 0),
                         byte_of(form.index, 1), form.sub, static_cast<std::uint8_t>(form.nmt),
                         byte_of(form.code, 0), byte_of(form.code, 1), byte_of(form.entry, 0),
                         byte_of(form.entry, 1), byte_of(form.entry, 2), byte_of(form.entry, 3),
                         byte_of(form.network, 0), timeout, form.repeats,
                         static_cast<std::uint8_t>(form.data.size())});
    put_data(form.data);
  }

  void put(std::initializer_list<std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) {
      octets_ += static_cast<char>(byte);
    }
  }
  void put_data(std::span<const std::byte> data) {
    for (const std::byte byte : data) {
      octets_ += static_cast<char>(byte);
    }
  }

  void save(const std::filesystem::path& file) const {
    std::ofstream(file, std::ios::binary) << octets_;
  }

  static std::uint8_t byte_of(std::uint32_t word, unsigned place) {
    return static_cast<std::uint8_t>(word >> 8U * place);
  }

 private:
  std::string octets_;
};

}  // namespace linegate::fuzz
