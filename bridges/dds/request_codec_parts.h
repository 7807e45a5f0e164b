// SPDX-License-Identifier: Apache-2.0
// What the codecs of several kinds of requests have in common. Private to request_codec.cpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <linegate.h>

#include "bridges/request/field_bytes.h"
#include "bridges/request/request.h"
#include "stack/can/cob_id.h"
#include "stack/line/requests.h"

namespace linegate::dds {

using request::FieldReader;
using request::FieldWriter;
using Bytes = std::vector<std::byte>;

inline const char* one_node(std::uint8_t node) {
  return node < can::kMinNodeId || node > can::kMaxNodeId ? "node is not 1..127" : nullptr;
}
inline const char* node_or_all(std::uint8_t node) {
  return node > can::kMaxNodeId ? "node is not 0..127" : nullptr;
}

inline od::Address address_of(const v1::CommandRequest& sample) {
  return {sample.index(), sample.sub()};
}
inline void set_address(od::Address address, v1::CommandRequest& sample) {
  sample.index(address.index);
  sample.sub(address.sub);
}

// A codec has the kind of the contract, write() and read() of the members, encode() and decode() of
// the data.
template <class Request>
struct RequestCodec;

struct WithoutMembers {
  template <class Request>
  static void write(const Request& /*from*/, v1::CommandRequest& /*to*/) {}
  template <class Request>
  static const char* read(const v1::CommandRequest& /*from*/, Request& /*to*/) {
    return nullptr;
  }
};

struct WithoutData {
  template <class Request>
  static Bytes encode(const Request& /*from*/) {
    return {};
  }
  template <class Request>
  static const char* decode(const Bytes& data, Request& /*to*/) {
    return data.empty() ? nullptr : "this kind of command takes no data";
  }
};

// A value to be written.
struct WithValue {
  template <class Request>
  static Bytes encode(const Request& from) {
    return from.data;
  }
  template <class Request>
  static const char* decode(Bytes data, Request& to) {
    to.data = std::move(data);
    return to.data.empty() ? "there are no data to write" : nullptr;
  }
};

// node alone, of which 0 means all.
struct WithNodeOrAll {
  template <class Request>
  static void write(const Request& from, v1::CommandRequest& to) {
    to.node(from.node);
  }
  template <class Request>
  static const char* read(const v1::CommandRequest& from, Request& to) {
    to.node = from.node();
    return node_or_all(to.node);
  }
};

}  // namespace linegate::dds
