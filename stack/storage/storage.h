// SPDX-License-Identifier: Apache-2.0
// Store parameters and restore default parameters (CiA 301, 7.5.2.13 and 7.5.2.14), server side:
//   1010h  U32  sub 1 all, 2 communication, 3 application, 4 manufacturer parameters
//   1011h       as 1010h
// Writing 6576 6173h ("save") to a sub-index of 1010h stores the parameters it means as they are.
// Writing 6461 6F6Ch ("load") to one of 1011h takes the stored ones away, at once, and so gives the
// defaults after the next reset: of communication for 1000h to 1FFFh, of the node for all, or
// power-on. Both read 1 (on command), or 0 without a medium.
//   0800 0020h  another value, a sub-index beyond 4, no medium
//   0606 0000h  the medium could not keep it: what was stored before still is
//   0800 0022h  the medium is still busy with what it was given before
// With a medium that is slow the answer comes when it is done: the access waits (od::kLater).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
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
  // The dictionary must outlive it; node_id is 1..127. The owner sets the hooks: the storage itself
  // for 1010h and 1011h, configuration() for 1020h.
  Storage(od::Dictionary& dictionary, std::uint8_t node_id);

  // Must outlive the storage, or be taken away with nullptr: nothing is stored then.
  void set_medium(Medium* medium) { medium_ = medium; }

  // Power-on: asks the medium for what it kept. What cannot be used is as if nothing were kept.
  Damage load();

  // Gives what is stored to the dictionary, whose values have been set back to their defaults: all
  // (power-on, reset node) or those of 1000h to 1FFFh (reset communication). No hook is called.
  // True if anything is stored.
  bool apply(bool whole_node);

  // Addresses and values that are stored, ascending.
  std::span<const StoredValue> stored() const { return stored_; }

  // A slow medium kept what keep() gave it, or did not. Without an effect if nothing was given.
  void done(bool good);

  // Images that the medium kept since the storage was made.
  std::uint64_t kept() const { return kept_; }

  VerifyConfiguration& configuration() { return configuration_; }

  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  AbortCode execute_write(od::Address address, std::span<const std::byte> value) override;
  void put_off(od::Address address, od::Ticket ticket) override;
  void cancelled(od::Ticket ticket) override;

 private:
  // What a slow medium is busy with.
  struct Pending {
    std::vector<StoredValue> values;
    od::Ticket ticket = 0;  // of the access that waits for it; 0 = it has given up
  };

  Owner owner() const;
  bool usable(std::span<const StoredValue> values) const;
  // What is to be stored after a write to this sub-index of 1010h or 1011h.
  std::vector<StoredValue> wanted(od::Address address);
  std::vector<StoredValue> stored_without(std::uint8_t group) const;

  od::Dictionary& dictionary_;
  std::uint8_t node_id_;
  VerifyConfiguration configuration_;
  Medium* medium_ = nullptr;
  std::vector<StoredValue> stored_;
  std::optional<Pending> pending_;
  std::uint64_t kept_ = 0;
};

}  // namespace linegate::storage
