// SPDX-License-Identifier: Apache-2.0
// DOMAINs whose hook supplies their bytes in pieces.
#include "stack/od/stream.h"

#include "stack/od/dictionary.h"

namespace linegate::od {
namespace {

Hook* streaming_hook(const Dictionary& dictionary, Address address) {
  const std::optional<Variable> variable = dictionary.find(address);
  return variable && variable->type == DataType::domain ? variable->hook : nullptr;
}

}  // namespace

Result<ByteSource*> Hook::open_source(Address /*address*/) {
  return nullptr;
}

Result<ByteSink*> Hook::open_sink(Address /*address*/, std::optional<std::uint32_t> /*size*/) {
  return nullptr;
}

bool Dictionary::streams(Address address) const {
  return streaming_hook(*this, address) != nullptr;
}

Result<ByteSource*> Dictionary::open_source(Address address) const {
  Hook* hook = streaming_hook(*this, address);
  return hook == nullptr ? nullptr : hook->open_source(address);
}

Result<ByteSink*> Dictionary::open_sink(Address address, std::optional<std::uint32_t> size) const {
  Hook* hook = streaming_hook(*this, address);
  return hook == nullptr ? nullptr : hook->open_sink(address, size);
}

}  // namespace linegate::od
