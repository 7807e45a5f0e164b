// SPDX-License-Identifier: Apache-2.0
// Behaviour of an object besides its bytes: functions that are called before a value is read or
// written, and afterwards.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "stack/base/abort_code.h"
#include "stack/base/result.h"
#include "stack/od/description.h"

namespace linegate::od {

struct Variable;
class ByteSink;
class ByteSource;

// Identifies an access that waits for the answer of a hook; 0 is invalid.
using Ticket = std::uint32_t;

// The result of before_read() and check_write() for a hook that answers later (split indication):
// the access waits for Dictionary::complete(). Never sent on the bus. Also a result of
// open_source(), open_sink() and their streams (see stream.h).
inline constexpr AbortCode kLater = static_cast<AbortCode>(0xFFFF'FFFF);

// For callers that cannot wait.
constexpr AbortCode never_later(AbortCode answer) {
  return answer == kLater ? AbortCode::device_state : answer;
}

// A hook is registered for an object and receives calls for all its sub-indices. It must outlive
// the dictionary or be removed first. The default of every function does nothing.
//
// An access has two phases: first all checks (of the dictionary, then of all hooks, which must not
// change anything yet), then, if there is no refusal, the effect: hooks execute what a write
// orders, the value is stored, all hooks are informed. No function may remove its own object or
// hooks of it.
class Hook {
 public:
  virtual ~Hook() = default;

  // Called before a value is read: the hook may refresh it (writing to variable.data), refuse, or
  // return kLater, fetch the value, set() it and complete() the access.
  virtual AbortCode before_read(Address address, const Variable& variable);
  // May refuse a value that passed the type, access and limit checks, or return kLater. value has
  // an allowed length; it is valid only during the call.
  virtual AbortCode check_write(Address address, std::span<const std::byte> value);
  // Called after all checks of the write (of all values of a group) passed, before anything is
  // stored: for work that the write orders and that may fail. A refusal (never kLater) ends the
  // access; later hooks are not called, and the work of earlier ones is not undone. Must not add or
  // remove objects. Not called for values that the device itself sets.
  virtual AbortCode execute_write(Address address, std::span<const std::byte> value);
  // The value has been written.
  virtual void written(Address address);

  // The value was received in an RPDO, changed or not. Only called for hooks that were added with
  // Watch::rpdos.
  virtual void came_by_rpdo(Address address);

  // For a DOMAIN whose bytes may be outside the dictionary: the stream to read or write them in
  // pieces (see stream.h), nullptr for a value in the dictionary, or a refusal. size: number of
  // bytes to come, if indicated. The stream must live until its last call. It is not opened again
  // before that, unless another SDO server begins a transfer of its own. The dictionary should have
  // no value for such an object: its read() and write() do not use the stream. After kLater and
  // complete() with none, these functions are called again.
  virtual Result<ByteSource*> open_source(Address address);
  virtual Result<ByteSink*> open_sink(Address address, std::optional<std::uint32_t> size);

  // Called after kLater of this hook or of its stream: the access waits, and ticket identifies it.
  virtual void put_off(Address address, Ticket ticket);
  // The access no longer waits (abort, time-out, reset): complete() would return false. Not called
  // after complete().
  virtual void cancelled(Ticket ticket);
};

// Whether came_by_rpdo() of a hook is called. This costs time with each RPDO that maps the object.
enum class Watch : std::uint8_t { writes, rpdos };

// Chosen by the caller of Dictionary::follow() to identify the value in Observer::changed(); 0: the
// value is not followed.
using FollowMark = std::uint16_t;
// The mark of all elements of a window, and of values with several followers.
inline constexpr FollowMark kSharedMark = 0xFFFF;

// Informed when an object was added or removed, its variables moved (Dictionary::bind, a string
// longer than its capacity), or its hooks start or stop watching RPDOs: pointers into the object
// have to be looked up again. Also informed of new values that are followed.
class Observer {
 public:
  virtual ~Observer() = default;
  virtual void reshaped(std::uint16_t index) = 0;
  // A value that is followed (Dictionary::follow()) changed: it was written over SDO or MPDO, or
  // set by the device. Called after the hooks. Not called for RPDOs, resets and restored values.
  virtual void changed(Address address, FollowMark mark);
};

}  // namespace linegate::od
