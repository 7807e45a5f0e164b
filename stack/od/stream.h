// SPDX-License-Identifier: Apache-2.0
// Values that do not lie in memory as a whole: a DOMAIN that is a file, a flash memory, a firmware.
// They are read and written piece by piece, by whoever transfers them (stack/sdo). Data of a SDO
// client that are too long for a vector go the same way.
//
// To an SDO server, read(), write() and finish() may answer kLater (hook.h), as long as the flash
// memory or whatever it is takes: put_off() of the hook that gave the stream is told the ticket,
// and no other call but the last one comes before Dictionary::complete(). A client cannot wait: its
// transfer ends with device_state.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "stack/base/abort_code.h"
#include "stack/base/result.h"

namespace linegate::od {

// Gives the bytes of a value, from the first to the last.
class ByteSource {
 public:
  virtual ~ByteSource() = default;

  // Bytes in all; nothing if that is not known before the end.
  virtual std::optional<std::uint32_t> size() const = 0;
  // Fills out with the next bytes and gives how many they are: fewer than out has room for only at
  // the end. An abort code ends the transfer. Never asked for more bytes than size(). kLater: none
  // of them, and read() is called again after complete() with none.
  virtual Result<std::size_t> read(std::span<std::byte> out) = 0;
  // Begins again with the first byte, for a transfer that is repeated. False if it cannot.
  virtual bool rewind() { return false; }
  // Nobody will read any more. none: all bytes were transferred.
  virtual void closed(AbortCode /*why*/) {}
};

// Takes the bytes of a value, from the first to the last.
class ByteSink {
 public:
  virtual ~ByteSink() = default;

  // The next bytes. An abort code ends the transfer. kLater: the sink has them, and what complete()
  // says is its answer.
  virtual AbortCode write(std::span<const std::byte> piece) = 0;
  // All bytes came, and the check sum, if there was one, is right: from now on they are the value.
  // An abort code refuses them; after kLater, what complete() says does. The last call in any case.
  virtual AbortCode finish() { return AbortCode::none; }
  // The transfer ended before all bytes came: what was written is not the value. The last call.
  virtual void cancelled(AbortCode /*why*/) {}
  // Forgets what was written, for a transfer that is repeated. False if it cannot.
  virtual bool rewind() { return false; }
};

}  // namespace linegate::od
