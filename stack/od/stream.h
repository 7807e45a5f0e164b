// SPDX-License-Identifier: Apache-2.0
// Values that are not in memory as a whole: a DOMAIN that is a file, a flash memory, a firmware
// image. The SDO service (stack/sdo) reads and writes them in pieces. SDO clients use the same
// interface for data that are too long for a vector.
//
// For an SDO server, read(), write() and finish() may return kLater (hook.h) while the flash memory
// or other storage is busy: put_off() of the hook that returned the stream receives the ticket, and
// no call except the last one comes before Dictionary::complete(). A client cannot wait: its
// transfer ends with device_state.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "stack/base/abort_code.h"
#include "stack/base/result.h"

namespace linegate::od {

// Supplies the bytes of a value, from the first to the last.
class ByteSource {
 public:
  virtual ~ByteSource() = default;

  // Total size in bytes; nothing if it is unknown before the end.
  virtual std::optional<std::uint32_t> size() const = 0;
  // Copies the next bytes to out and returns their number, which is less than out.size() only at
  // the end. An abort code ends the transfer. No more than size() bytes are read in total. kLater:
  // no bytes were copied, and read() is called again after complete() with none.
  virtual Result<std::size_t> read(std::span<std::byte> out) = 0;
  // Restarts at the first byte, for a transfer that is repeated. Returns false if that is
  // impossible.
  virtual bool rewind() { return false; }
  // Of an SDO client: the server acknowledged the first count bytes, with a segment or a sub-block;
  // bytes that were read need not have been sent. Not called for an expedited transfer.
  virtual void acknowledged(std::size_t /*count*/) {}
  // The last call. none: all bytes were transferred.
  virtual void closed(AbortCode /*why*/) {}
};

// Accepts the bytes of a value, from the first to the last.
class ByteSink {
 public:
  virtual ~ByteSink() = default;

  // Accepts the next bytes. An abort code ends the transfer. kLater: the sink has taken the bytes,
  // and the result is that of complete().
  virtual AbortCode write(std::span<const std::byte> piece) = 0;
  // All bytes were transferred, and the checksum, if any, is right: they become the value. An abort
  // code refuses them; after kLater, the result is that of complete(). The last call in any case.
  virtual AbortCode finish() { return AbortCode::none; }
  // The transfer ended before all bytes were transferred: the written bytes are not the value. The
  // last call.
  virtual void cancelled(AbortCode /*why*/) {}
  // Discards the written bytes, for a transfer that is repeated. Returns false if that is
  // impossible.
  virtual bool rewind() { return false; }
};

}  // namespace linegate::od
