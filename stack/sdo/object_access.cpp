// SPDX-License-Identifier: Apache-2.0
#include "stack/sdo/object_access.h"

#include <algorithm>

#include "stack/od/hook.h"

namespace linegate::sdo {

AbortCode open_upload(od::Dictionary& dictionary, od::Address address,
                      std::span<const std::byte> value, std::size_t most, Source& source,
                      od::Ticket& ticket) {
  const Result<od::ByteSource*> stream = dictionary.open_source(address);
  if (!stream.ok()) {
    const auto why = static_cast<AbortCode>(stream.error().code);
    ticket = why == od::kLater ? dictionary.put_off_source(address) : od::Ticket{0};
    return why;
  }
  if (*stream != nullptr) {
    source.start(**stream);
    return AbortCode::none;
  }
  if (value.size() > most) {
    return AbortCode::out_of_memory;
  }
  source.start(value);
  return AbortCode::none;
}

AbortCode open_download(od::Dictionary& dictionary, od::Address address,
                        std::optional<std::uint32_t> announced, std::size_t most, Sink& sink,
                        od::Ticket& ticket) {
  const auto variable = dictionary.find(address);
  if (!variable) {
    return dictionary.check(address, {});
  }
  if (!od::writable(variable->access)) {
    return AbortCode::read_only;
  }
  const Result<od::ByteSink*> stream = dictionary.open_sink(address, announced);
  if (!stream.ok()) {
    const auto why = static_cast<AbortCode>(stream.error().code);
    ticket = why == od::kLater ? dictionary.put_off_sink(address) : od::Ticket{0};
    return why;
  }
  if (*stream != nullptr) {
    sink.start(announced, **stream);
    return AbortCode::none;
  }
  if (announced) {
    if (*announced > variable->capacity) {
      return AbortCode::length_too_high;
    }
    if (od::byte_size(variable->type) != 0 && *announced < variable->size) {
      return AbortCode::length_too_low;
    }
    if (*announced > most) {
      return AbortCode::out_of_memory;
    }
  }
  sink.start(announced, std::min(std::size_t{variable->capacity}, most),
             variable->capacity <= most ? AbortCode::length_too_high : AbortCode::out_of_memory);
  return AbortCode::none;
}

AbortCode store_download(od::Dictionary& dictionary, od::Address address, Sink& sink,
                         od::Ticket& ticket) {
  const AbortCode why = sink.finish();
  if (why == od::kLater) {
    ticket = dictionary.put_off_sink(address);
  }
  return why != AbortCode::none || sink.streams() ? why
                                                  : dictionary.write(address, sink.bytes(), ticket);
}

}  // namespace linegate::sdo
