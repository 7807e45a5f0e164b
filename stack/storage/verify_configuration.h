// SPDX-License-Identifier: Apache-2.0
// Verify configuration (CiA 301, 7.5.2.23): date and time of the device's configuration.
//   1020h:1  U32  days since 1984-01-01
//   1020h:2  U32  milliseconds since midnight
// A configuration tool writes both last, and compares them at the next boot-up to decide whether it
// has to configure the device again. Both read 0 once any parameter (a variable with the store
// flag) differs from its value at that write; values that were changed and changed back count as
// unchanged.
#pragma once

#include <cstdint>

#include "stack/od/dictionary.h"

namespace linegate::storage {

// Hook of 1020h.
class VerifyConfiguration final : public od::Hook {
 public:
  explicit VerifyConfiguration(od::Dictionary& dictionary) : dictionary_(dictionary) {}

  // Call it after a reset of values: of all objects, or of 1000h to 1FFFh including 1020h.
  void values_reset(bool whole_node);
  // Clears 1020h if a parameter changed.
  void refresh();

  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  void written(od::Address address) override;

 private:
  // A hash of the values of many parameters.
  struct Fingerprint {
    std::uint64_t communication = 0;
    std::uint64_t others = 0;

    friend bool operator==(const Fingerprint&, const Fingerprint&) = default;
  };
  Fingerprint fingerprint() const;

  od::Dictionary& dictionary_;
  Fingerprint configured_;
};

}  // namespace linegate::storage
