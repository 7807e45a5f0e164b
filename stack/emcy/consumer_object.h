// SPDX-License-Identifier: Apache-2.0
// Object 1028h, emergency consumer (CiA 301, 7.5.2.31): configures a Consumer.
//   sub 1..127  U32  COB-ID of the EMCY of the node with that node-ID, bit 31 = not consumed
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/emcy/consumer.h"
#include "stack/od/dictionary.h"

namespace linegate::emcy {

// Hook of 1028h: writes take effect at once. Only EMCYs of listed nodes are consumed.
class ConsumerObject final : public od::Hook {
 public:
  // Both must outlive this object. The owner sets the hook.
  ConsumerObject(const od::Dictionary& dictionary, Consumer& consumer);

  // Reads all elements.
  void configure();

  // Returns invalid_value as for 1014h, see can::check_cob_id().
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;

 private:
  can::CobId cob_id(std::uint8_t node) const;

  const od::Dictionary& dictionary_;
  Consumer& consumer_;
};

}  // namespace linegate::emcy
