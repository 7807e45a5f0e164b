// SPDX-License-Identifier: Apache-2.0
// What belongs to an object besides its bytes: who is asked before a value is read or written, and
// told afterwards.
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

// An access that waits for the answer of a hook; 0 is none.
using Ticket = std::uint32_t;

// What before_read() and check_write() may give besides none and a refusal: the hook will answer
// later (split indication). The access waits for Dictionary::complete(). Never on the bus. The same
// goes for open_source(), open_sink() and the streams that they give (see stream.h).
inline constexpr AbortCode kLater = static_cast<AbortCode>(0xFFFF'FFFF);

// For callers that cannot wait.
constexpr AbortCode never_later(AbortCode answer) {
  return answer == kLater ? AbortCode::device_state : answer;
}

// A hook is registered for an object and sees all its sub-indices. It must outlive the dictionary
// or be removed first. Every function has a default that does nothing.
//
// Accesses are done in two phases: first all checks (of the dictionary, then of all hooks, which
// change nothing yet), and if there is no refusal the effect: hooks do what a write orders, the
// value is stored, all hooks are told. No function may remove its own object or hooks of it.
class Hook {
 public:
  virtual ~Hook() = default;

  // Before a value is read: the hook may refresh it (writing to variable.data), refuse, or answer
  // kLater, fetch the value, set() it and complete() the access.
  virtual AbortCode before_read(Address address, const Variable& variable);
  // May refuse a value that passed type, access and limit checks, or answer kLater. value has a
  // length the variable takes; it is not kept for the hook.
  virtual AbortCode check_write(Address address, std::span<const std::byte> value);
  // All checks of the write, in a group of all its values, passed, and nothing is stored yet: for
  // work that the write orders and that may fail. A refusal (never kLater) ends the access, and
  // hooks that come later are not asked; what those before did stays done. Must not add or remove
  // objects. Not called for values that the device itself sets.
  virtual AbortCode execute_write(Address address, std::span<const std::byte> value);
  // The value has been written.
  virtual void written(Address address);

  // The value came in an RPDO, whether it is a new one or not. Only for hooks that were added with
  // Watch::rpdos.
  virtual void came_by_rpdo(Address address);

  // For a DOMAIN, whose bytes may be elsewhere than in the dictionary: where to read or write them
  // piece by piece (see stream.h), nullptr for the dictionary's own, or why not. size: bytes that
  // will come, if told. What they give must live until its last call, and is not asked for again
  // before, unless another SDO server begins a transfer of its own. The dictionary should have no
  // value for such an object: its read() and write() know nothing of the stream. After kLater and
  // complete() with none they are asked again.
  virtual Result<ByteSource*> open_source(Address address);
  virtual Result<ByteSink*> open_sink(Address address, std::optional<std::uint32_t> size);

  // After kLater, of this hook or of a stream that it gave: the access waits, and ticket stands for
  // it.
  virtual void put_off(Address address, Ticket ticket);
  // Nobody waits any longer (abort, time-out, reset): complete() would find no access. Not called
  // after complete().
  virtual void cancelled(Ticket ticket);
};

// Whether a hook hears of came_by_rpdo(). It costs time with each RPDO that maps the object.
enum class Watch : std::uint8_t { writes, rpdos };

// Chosen by who follows a value, so that it is known again in Observer::changed(); 0: it is not
// followed.
using FollowMark = std::uint16_t;
// Of the elements of a window, which have one mark, and of values with several followers.
inline constexpr FollowMark kSharedMark = 0xFFFF;

// Hears that an object was added or removed, that its variables live elsewhere (Dictionary::bind, a
// string longer than its room), or is watched or not: pointers into it have to be looked up. And of
// new values, where somebody asked for that.
class Observer {
 public:
  virtual ~Observer() = default;
  virtual void reshaped(std::uint16_t index) = 0;
  // Of a value that Dictionary::follow() names: it is another one than before, written over SDO or
  // MPDO, or set by the device. Told after the hooks. Not told of RPDOs, resets and restored
  // values.
  virtual void changed(Address address, FollowMark mark);
};

}  // namespace linegate::od
