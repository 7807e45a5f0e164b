// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/multicast_codec.h"

#include <array>
#include <cstring>
#include <string_view>
#include <utility>

#include <linux/can/error.h>
#include <msgpack/null_visitor.hpp>
#include <msgpack/pack.hpp>
#include <msgpack/parse.hpp>
#include <msgpack/unpack.hpp>

#include "bridges/can/sendable.h"
#include "stack/base/assert.h"

namespace linegate::can_bridge {
namespace {

using can::Frame;

class Output {
 public:
  explicit Output(std::span<char, kMulticastDatagram> out) : out_(out) {}

  void write(const char* bytes, std::size_t count) {
    std::memcpy(out_.data() + size_, bytes, count);
    size_ += count;
  }
  std::size_t size() const { return size_; }

 private:
  std::span<char, kMulticastDatagram> out_;
  std::size_t size_ = 0;
};

class Packer {
 public:
  explicit Packer(Output& output) : packer_(output) {}

  msgpack::packer<Output>& key(std::string_view name) {
    packer_.pack_str(static_cast<std::uint32_t>(name.size()));
    packer_.pack_str_body(name.data(), static_cast<std::uint32_t>(name.size()));
    return packer_;
  }
  void flag(std::string_view name, bool value) {
    auto& to = key(name);
    value ? to.pack_true() : to.pack_false();
  }
  void map(std::uint32_t pairs) { packer_.pack_map(pairs); }

 private:
  msgpack::packer<Output> packer_;
};

// What the map says; the parser calls the functions in the order of the datagram. False ends it.
class Fields : public msgpack::null_visitor {
 public:
  void init() { *this = Fields(); }

  bool start_map(std::uint32_t /*pairs*/) { return !std::exchange(map_, true); }
  bool start_array(std::uint32_t /*elements*/) { return false; }
  bool start_map_key() { return in_key_ = true; }
  bool end_map_key() {
    in_key_ = false;
    return true;
  }
  bool visit_str(const char* text, std::uint32_t count) {
    if (in_key_) {
      key_ = {text, count};
    }
    return map_ && (in_key_ || key_ != "data");
  }
  bool visit_bin(const char* bytes, std::uint32_t count) {
    if (key_ != "data" || in_key_ || count > can::kMaxFdData) {
      return false;
    }
    std::memcpy(data.data(), bytes, count);
    size = count;
    return true;
  }
  bool visit_boolean(bool value) {
    if (!value) {
      return map_ && !in_key_;
    }
    if (key_ == "is_extended_id") {
      flags |= Frame::kExtended;
    } else if (key_ == "is_remote_frame") {
      flags |= Frame::kRemote;
    } else if (key_ == "is_fd") {
      flags |= Frame::kFd;
    } else if (key_ == "bitrate_switch") {
      flags |= Frame::kBitRateSwitch;
    } else if (key_ == "error_state_indicator") {
      flags |= Frame::kErrorStateIndicator;
    } else if (key_ == "is_error_frame") {
      error = true;
    }
    return map_ && !in_key_;
  }
  bool visit_positive_integer(std::uint64_t value) {
    if (key_ == "arbitration_id") {
      has_id = true;
      id = value;
    } else if (key_ == "dlc") {
      has_length = true;
      length = value;
    }
    return map_ && !in_key_;
  }
  bool visit_negative_integer(std::int64_t /*value*/) {
    return map_ && !in_key_ && key_ != "arbitration_id" && key_ != "dlc";
  }

  std::array<std::byte, can::kMaxFdData> data{};
  std::size_t size = 0;
  std::uint64_t id = 0;
  std::uint64_t length = 0;
  std::uint8_t flags = 0;
  bool has_id = false;
  bool has_length = false;
  bool error = false;

 private:
  bool map_ = false;
  bool in_key_ = false;
  std::string_view key_;
};

struct NoHook {
  void operator()(char* /*buffer*/) const {}
};

}  // namespace

// The library's parser keeps its buffers from one datagram to the next.
struct MulticastDecoder::Parser : msgpack::parser<MulticastDecoder::Parser, NoHook> {
  explicit Parser(NoHook& hook) : parser(hook, 4 * kMulticastDatagram) {}

  Fields& visitor() { return fields; }
  bool referenced() const { return false; }
  void set_referenced(bool /*referenced*/) {}

  bool read(std::span<const char> datagram) {
    reset();  // fields, too
    skip_nonparsed_buffer(nonparsed_size());
    reserve_buffer(datagram.size());
    std::memcpy(buffer(), datagram.data(), datagram.size());
    buffer_consumed(datagram.size());
    return next() && nonparsed_size() == 0;
  }

  Fields fields;
};

std::size_t encode_multicast(const Frame& frame, std::int64_t stamp_ns,
                             std::span<char, kMulticastDatagram> out) {
  constexpr std::uint32_t kPairs = 11;
  Output output(out);
  Packer to(output);
  to.map(kPairs);
  to.key("timestamp").pack_double(static_cast<double>(stamp_ns) / 1e9);
  to.key("arbitration_id").pack_uint32(frame.id);
  to.flag("is_extended_id", frame.extended());
  to.flag("is_remote_frame", frame.remote());
  to.flag("is_error_frame", false);
  to.key("channel").pack_nil();
  to.key("dlc").pack_uint8(frame.length);
  const std::uint32_t size = frame.remote() ? 0 : frame.length;
  to.key("data").pack_bin(size).pack_bin_body(reinterpret_cast<const char*>(frame.data.data()),
                                              size);
  to.flag("is_fd", frame.fd());
  to.flag("bitrate_switch", (frame.flags & Frame::kBitRateSwitch) != 0);
  to.flag("error_state_indicator", (frame.flags & Frame::kErrorStateIndicator) != 0);
  return output.size();
}

MulticastDecoder::MulticastDecoder() {
  static NoHook hook;
  parser_ = std::make_unique<Parser>(hook);
}

MulticastDecoder::~MulticastDecoder() = default;

MulticastDecoder::Result MulticastDecoder::decode(std::span<const char> datagram, Frame& frame,
                                                  canfd_frame& error) {
  LINEGATE_ASSERT(datagram.size() <= kMulticastDatagram, "no datagram of this format is longer");
  if (!parser_->read(datagram)) {
    return Result::malformed;
  }
  const Fields& fields = parser_->fields;
  if (fields.error) {
    // One that names no class is an error nevertheless.
    const auto classes = static_cast<std::uint32_t>(fields.id & CAN_ERR_MASK);
    error = {};
    error.can_id = CAN_ERR_FLAG | (classes != 0 ? classes : CAN_ERR_PROT);
    error.len = CAN_ERR_DLC;
    std::memcpy(error.data, fields.data.data(), CAN_ERR_DLC);
    return Result::error_frame;
  }
  const bool remote = (fields.flags & Frame::kRemote) != 0;
  const std::uint64_t length = remote && fields.has_length ? fields.length : fields.size;
  if (!fields.has_id || fields.id > CAN_EFF_MASK || length > can::kMaxFdData ||
      (remote ? fields.size != 0 : fields.has_length && fields.length != fields.size)) {
    return Result::malformed;
  }
  frame.id = static_cast<std::uint32_t>(fields.id);
  frame.flags = fields.flags;
  frame.length = static_cast<std::uint8_t>(length);
  frame.data = fields.data;
  return sendable(frame, true) ? Result::frame : Result::malformed;
}

}  // namespace linegate::can_bridge
