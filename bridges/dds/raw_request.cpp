// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/raw_request.h"

#include "bridges/dds/request_codec.h"

namespace linegate::dds {

std::string to_request(const RawRequest& from, request::Request& to) {
  v1::CommandRequest sample;
  sample.kind(from.kind);
  sample.node(from.node);
  sample.index(from.index);
  sample.sub(from.sub);
  sample.nmt(from.nmt);
  sample.code(from.code);
  sample.error_register(from.error_register);
  sample.entry(from.entry);
  if (const char* const why = read_members(sample, to))
    return why;
  const char* const why = decode_data(from.data, to);
  return why == nullptr ? "" : why;
}

RawRequest to_raw(const request::Request& from) {
  v1::CommandRequest sample;
  write_members(from, sample);
  return {.kind = sample.kind(),
          .node = sample.node(),
          .index = sample.index(),
          .sub = sample.sub(),
          .nmt = sample.nmt(),
          .code = sample.code(),
          .error_register = sample.error_register(),
          .entry = sample.entry(),
          .data = encode_data(from)};
}

}  // namespace linegate::dds
