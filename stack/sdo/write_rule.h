// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/base/abort_code.h"
#include "stack/base/time.h"
#include "stack/od/description.h"

namespace linegate::sdo {

// What clients and other networks may write to the nodes of a line.
class WriteRule {
 public:
  WriteRule() = default;
  WriteRule(const WriteRule&) = delete;
  WriteRule& operator=(const WriteRule&) = delete;
  virtual ~WriteRule() = default;
  // none, or the abort code of the refusal: device_state, or invalid_value if the value cannot be
  // permitted at any time. value: empty if the transfer is not expedited.
  virtual AbortCode may_write(std::uint8_t node, od::Address address,
                              std::span<const std::byte> value, Instant now) const = 0;
};

}  // namespace linegate::sdo
