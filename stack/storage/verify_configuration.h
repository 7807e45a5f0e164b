// SPDX-License-Identifier: Apache-2.0
// Verify configuration (CiA 301, 7.5.2.23): when the device got its configuration.
//   1020h:1  U32  days since 1984-01-01
//   1020h:2  U32  milliseconds since midnight
// A configuration tool writes both last, and compares them at the next boot-up to see whether it
// has to configure again. Both read 0 once any parameter (a variable with the store flag) has
// another value than when they were written; values that were changed and changed back count as
// unchanged.
#pragma once

#include <cstdint>

#include "stack/od/dictionary.h"

namespace linegate::storage {

// Hook of 1020h.
class VerifyConfiguration final : public od::Hook {
 public:
  explicit VerifyConfiguration(od::Dictionary& dictionary) : dictionary_(dictionary) {}

  // Values were set back by a reset: all, or those of 1000h to 1FFFh, 1020h among them.
  void values_reset(bool whole_node);
  // Clears 1020h if a parameter has changed.
  void refresh();

  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  void written(od::Address address) override;

 private:
  // One number for the values of many parameters.
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
