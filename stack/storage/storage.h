// SPDX-License-Identifier: Apache-2.0
// Store parameters and restore default parameters (CiA 301, 7.5.2.13 and 7.5.2.14), server side:
//   1010h  U32  sub 1 all, 2 communication, 3 application, 4 manufacturer parameters
//   1011h       as 1010h
// Writing 6576 6173h ("save") to a sub-index of 1010h stores the present values of its parameters.
// Writing 6461 6F6Ch ("load") to a sub-index of 1011h deletes their stored values at once, so that
// the defaults apply after the next reset: reset communication for 1000h to 1FFFh, reset node or
// power-on for all. Both read 1 (on command), or 0 without a medium.
//   0800 0020h  another value, a sub-index beyond 4, no medium
//   0606 0000h  the medium failed: the previously stored values are still stored
//   0800 0022h  the medium is still busy with the previous image
// With a slow medium the response is sent when the medium has finished: the access waits
// (od::kLater).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "stack/od/dictionary.h"
#include "stack/storage/image.h"
#include "stack/storage/medium.h"
#include "stack/storage/verify_configuration.h"

namespace linegate::storage {

inline constexpr std::uint32_t kSave = 0x6576'6173;
inline constexpr std::uint32_t kLoad = 0x6461'6F6C;

// Hook of 1010h and 1011h.
class Storage final : public od::Hook {
 public:
  // The dictionary must outlive this object; node_id is 1..127. The owner sets the hooks: this
  // object for 1010h and 1011h, configuration() for 1020h.
  Storage(od::Dictionary& dictionary, std::uint8_t node_id);

  // The medium must outlive the storage, or be removed with nullptr: then nothing can be stored.
  void set_medium(Medium* medium) { medium_ = medium; }

  // Changes a present value that is about to be stored: what holds for the time being only.
  using Adjustment = std::function<void(StoredValue& value)>;
  void set_adjustment(Adjustment adjustment) { adjust_ = std::move(adjustment); }

  // Call it at power-on: reads the stored image from the medium. An image that cannot be used has
  // the same effect as none.
  Damage load();

  // Copies stored values to the dictionary after its values were reset to their defaults: all
  // values (power-on, reset node) or those of 1000h to 1FFFh (reset communication). No hook is
  // called. Returns true if any value is stored.
  bool apply(bool whole_node);

  // Addresses and values that are stored, ascending.
  std::span<const StoredValue> stored() const { return stored_; }

  // Result of keep() of a slow medium: whether it stored the image. No effect if no keep() is
  // pending.
  void done(bool good);

  // Number of images that the medium stored since construction.
  std::uint64_t kept() const { return kept_; }

  VerifyConfiguration& configuration() { return configuration_; }

  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  AbortCode execute_write(od::Address address, std::span<const std::byte> value) override;
  void put_off(od::Address address, od::Ticket ticket) override;
  void cancelled(od::Ticket ticket) override;

 private:
  // The image that a slow medium is storing.
  struct Pending {
    std::vector<StoredValue> values;
    od::Ticket ticket = 0;  // of the access that waits for it; 0 = it was cancelled
  };

  Owner owner() const;
  bool usable(std::span<const StoredValue> values) const;
  // The values to store after a write to this sub-index of 1010h or 1011h.
  std::vector<StoredValue> wanted(od::Address address);
  std::vector<StoredValue> stored_without(std::uint8_t group) const;

  od::Dictionary& dictionary_;
  std::uint8_t node_id_;
  VerifyConfiguration configuration_;
  Medium* medium_ = nullptr;
  Adjustment adjust_;
  std::vector<StoredValue> stored_;
  std::optional<Pending> pending_;
  std::uint64_t kept_ = 0;
};

}  // namespace linegate::storage
