// SPDX-License-Identifier: Apache-2.0
// Access to objects by the servers of SDO and USDO: values of the dictionary and streams alike. A
// function that returns od::kLater sets ticket, which is 0 if no hook could answer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "stack/base/abort_code.h"
#include "stack/od/dictionary.h"
#include "stack/sdo/transfer.h"

namespace linegate::sdo {

// Starts source with the stream of the object, or with a copy of value. most: the longest value, in
// bytes.
AbortCode open_upload(od::Dictionary& dictionary, od::Address address,
                      std::span<const std::byte> value, std::size_t most, Source& source,
                      od::Ticket& ticket);
// Starts sink for the object. Refuses as early as possible, before the client sends thousands of
// segments in vain. announced: the size in bytes, if the client indicates it.
AbortCode open_download(od::Dictionary& dictionary, od::Address address,
                        std::optional<std::uint32_t> announced, std::size_t most, Sink& sink,
                        od::Ticket& ticket);
// All bytes were received: makes them the value.
AbortCode store_download(od::Dictionary& dictionary, od::Address address, Sink& sink,
                         od::Ticket& ticket);

}  // namespace linegate::sdo
