// SPDX-License-Identifier: Apache-2.0
// The result of a verification or of an application of configurations, and its form as bytes: the
// reply to line::CommandKind::configure.
//
//   per node, ascending: U8 node-ID, U8 boot (0, or a letter), U32 end (0, or an SDO abort code),
//   U32 number of differences, then each: U16 index, U8 sub-index, U32 SDO abort code or 0,
//   U32 size and bytes of the expected value, U32 size and bytes of the value found
//
// little-endian, without gaps. OWN: there is no public format.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/result.h"
#include "stack/manager/state.h"
#include "stack/od/description.h"

namespace linegate::manager {

// An object of a node that differs from its expected value.
struct Difference {
  od::Address object;
  std::vector<std::byte> expected;  // little-endian
  // Why it cannot be written or read; none: its value is `found`
  AbortCode abort = AbortCode::none;
  std::vector<std::byte> found{};

  friend bool operator==(const Difference&, const Difference&) = default;
};

struct NodeReport {
  std::uint8_t node = 0;
  // After an application: error status of the boot slave process. After a verification: kBooted.
  char boot = kBooted;
  // After a verification: why not every object was read. After an application: the abort code that
  // ended it, of the object in `differences` if there is one.
  AbortCode end = AbortCode::none;
  std::vector<Difference> differences;

  bool good() const { return boot == kBooted && end == AbortCode::none && differences.empty(); }
  friend bool operator==(const NodeReport&, const NodeReport&) = default;
};

std::vector<std::byte> write_configuration_report(std::span<const NodeReport> nodes);
// Fails with length_mismatch if the sizes do not agree with the number of bytes, or a node-ID is
// invalid.
Result<std::vector<NodeReport>> read_configuration_report(std::span<const std::byte> data);

}  // namespace linegate::manager
