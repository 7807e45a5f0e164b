// SPDX-License-Identifier: Apache-2.0
// Object 1003h, pre-defined error field (CiA 301, 7.5.2.4).
//   sub 0     U8   number of errors; writing 0 clears the history
//   sub 1..n  U32  newest first: emergency error code, above it two bytes of additional information
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/emcy/message.h"
#include "stack/od/dictionary.h"

namespace linegate::emcy {

// Hook of 1003h. Keeps as many errors as the object has sub-indices; without the object, none.
class ErrorHistory final : public od::Hook {
 public:
  // dictionary must outlive this object. The owner sets the hook.
  explicit ErrorHistory(od::Dictionary& dictionary);

  // Adds an error; the first two manufacturer bytes become the additional information.
  void add(const Message& message);
  void clear();
  std::uint8_t count() const;

  // Returns no_data for entries that are not in use.
  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  // Returns invalid_value for any write except 0 to sub-index 0.
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;

 private:
  void wipe_entries();

  od::Dictionary& dictionary_;
};

}  // namespace linegate::emcy
