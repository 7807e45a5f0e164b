// SPDX-License-Identifier: Apache-2.0
// A command as an input says it: the same fields for every kind, of which each kind takes its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/base/time.h"
#include "stack/line/command.h"
#include "stack/nmt/state.h"

#include "tests/fuzz/input.h"

namespace linegate::fuzz {

struct CommandForm {
  line::CommandKind kind{};
  std::uint8_t node = 0;
  std::uint16_t network = 0;
  std::uint16_t index = 0;
  std::uint8_t sub = 0;  // or number of a program, error register, flags of a CAN FD frame
  nmt::Command nmt = nmt::Command::start;
  std::uint16_t code = 0;   // or a number, bits, a time in seconds
  std::uint32_t entry = 0;  // or an identifier, an offset
  Duration timeout{};
  std::uint8_t repeats = 0;
  std::vector<std::byte> data{};
};
// code and entry of them.
inline constexpr std::uint16_t kFormFromImage = 1;  // SdoRead
inline constexpr std::uint16_t kFormFromScan = 2;
inline constexpr std::uint16_t kFormRange = 2;  // LocalRead: index to entry
inline constexpr std::uint16_t kFormAsOwner = 1;
inline constexpr std::uint16_t kFormForceSdo = 1;  // ObjectWrite
inline constexpr std::uint16_t kFormKeepPdo = 2;
inline constexpr std::uint16_t kFormSetUp = 1;  // ScanApply
inline constexpr std::uint16_t kFormRestore = 2;
inline constexpr std::uint16_t kFormRemoval = 1;  // ObjectCreate
inline constexpr std::uint32_t kFormExtended = 0x8000'0000;
inline constexpr std::uint32_t kFormRemote = 0x4000'0000;

// The kind is one of all kinds, whatever the byte. Kind, node, index (2), sub-index, NMT command,
// code (2), entry (4), network, time-out, repeats, data.
CommandForm read_form(Input& input);
line::Command to_command(CommandForm form);

// Milliseconds; from 80h on tenths of a second, from 0 again; FEh is -1 ms, FFh without end.
Duration time_out(std::uint8_t byte);
// Size, and so many bytes; from 64 on eight times as many, of which only the first four are given.
std::vector<std::byte> read_data(Input& input);

}  // namespace linegate::fuzz
