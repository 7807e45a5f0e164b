// SPDX-License-Identifier: Apache-2.0
// The object dictionary of one CANopen device (CiA 301, 7.4): constant-time look-up by index and
// sub-index, access rights, limits, and hooks.
//
// Building it (add, remove, bind) allocates; look-up, and reading and writing of values of fixed
// size do not. Pointers to values stay valid until Observer::reshaped() names the object: PDO copy
// plans hold such pointers. (DOMAIN values move with each write, without a call of the observers.)
// A value in the dictionary's own storage may be loaded and stored in words of 8 bytes: it starts
// at a multiple of 8, and no word holds parts of two values. The unused bytes of the word of a
// value of fixed size are 0.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"
#include "stack/base/result.h"
#include "stack/od/description.h"
#include "stack/od/hook.h"
#include "stack/od/slot_pages.h"

namespace linegate::od {

class ByteSink;
class ByteSource;
class Deferrals;
class ObjectTable;

// One sub-index: the place of its bytes and its access rights.
struct Variable {
  std::byte* data = nullptr;   // at least capacity bytes; DOMAIN: at least size
  std::uint32_t size = 0;      // current size of the value in bytes
  std::uint32_t capacity = 0;  // size of the longest value; == size for types of fixed size
  DataType type = DataType::none;
  Access access = Access::ro;
  bool mappable : 1 = false;
  bool has_limits : 1 = false;  // avoids the look-up of limits in the hot path
  bool store : 1 = false;       // saved by 1010h (store parameters)
  bool watched : 1 = false;     // a hook watches RPDOs
  bool elsewhere : 1 = false;   // not in the dictionary's own storage
  FollowMark followed = 0;      // not 0: observers are informed of changes of the value
  Hook* hook = nullptr;

  std::span<const std::byte> bytes() const { return {data, size}; }
};

// A value for one variable, in a group of values that is written together.
struct Assignment {
  Address address;
  std::span<const std::byte> value;
};

class Dictionary {
 public:
  Dictionary();
  explicit Dictionary(const DeviceDescription& device);
  Dictionary(Dictionary&&) noexcept;
  Dictionary& operator=(Dictionary&&) noexcept;
  ~Dictionary();

  // --- building -------------------------------------------------------------------------------

  // Objects may be added and removed at any time; objects of the communication profile, which
  // services look up when they are constructed, must be added before the node of the dictionary is
  // constructed.

  // Adds the object with storage for its values. Fails with device_incompatible if the index exists
  // or is 0, or the description is inconsistent (sub-indices not ascending or FFh, no type, value
  // longer than its type). A value shorter than its type is padded with zeros. A written string may
  // be as long as the described one or 64 bytes, whichever is longer; a DOMAIN 16 MiB.
  Result<void> add(const ObjectDescription& object);
  // Removes the object and its hooks; waiting accesses are refused with no_object. PDOs that map
  // the object stop, which is reported as for any PDO that cannot be used. Returns no_object if it
  // does not exist.
  Result<void> remove(std::uint16_t index);

  // From now on the value of the variable is at `data` (for example in a process image); the bytes
  // there become the value. data must have room for the variable's capacity. kept: the value
  // belongs to another component, so that reset_values() leaves it unchanged, as it does for
  // windows. Errors: no_object, no_sub_index; unsupported_access for elements of a window and for
  // DOMAIN.
  Result<void> bind(Address address, std::byte* data, bool kept = false);

  // Adds an object whose sub-indices 1..count are adjacent elements of equal size, starting at
  // data: a window of CiA 302-4 network variables on a process image. Sub-index 0 reads count.
  Result<void> add_window(std::uint16_t index, DataType type, Access access, std::byte* data,
                          std::uint8_t count);

  // Sets the hook for all sub-indices of the object, in place of the previous one; nullptr removes
  // it. This is the hook of the service that the object belongs to. Returns no_object if the object
  // does not exist.
  Result<void> set_hook(std::uint16_t index, Hook* hook);
  // Adds a hook for the application: called after the service's hook, in the order of addition.
  // Returns no_object if the object does not exist. With Watch::rpdos it is also called for values
  // received in RPDOs that map the object. Accesses that wait for a removed hook are refused with
  // device_state.
  Result<void> add_hook(std::uint16_t index, Hook& hook, Watch watch = Watch::writes);
  void remove_hook(std::uint16_t index, Hook& hook);

  // observer is informed of changes from now on; it must outlive the dictionary or be removed
  // first.
  void add_observer(Observer& observer);
  void remove_observer(Observer& observer);
  // Calls observers (Observer::changed) with this mark when the value of the variable changes,
  // until its object is removed; mark 0 ends this. In a window all elements are followed or none,
  // with kSharedMark. Reading costs nothing more. Errors: no_object, no_sub_index.
  Result<void> follow(Address address, FollowMark mark);

  // --- look-up --------------------------------------------------------------------------------

  bool has_object(std::uint16_t index) const;

  // The variable, by value because elements of a window have no Variable of their own; nothing if
  // there is no such object or sub-index. Then why, unless nullptr, becomes no_object or
  // no_sub_index.
  std::optional<Variable> find(Address address, AbortCode* why = nullptr) const;

  // Highest existing sub-index; nothing if the object does not exist.
  std::optional<std::uint8_t> highest_sub(std::uint16_t index) const;

  // Indices of all objects, ascending.
  std::vector<std::uint16_t> indices() const;

  // The value in the variable's description (its default value, or that of a DCF), which
  // reset_values() restores. Empty if there is no such variable, or for elements of a window.
  std::span<const std::byte> initial_value(Address address) const;

  // Whether 1010h (store parameters) saves the variable; overrides the description. Errors:
  // no_object, no_sub_index; unsupported_access for elements of a window.
  Result<void> set_store(Address address, bool store);
  // Variables in objects first..last with that flag, ascending.
  std::vector<Address> stored(std::uint16_t first, std::uint16_t last) const;

  // All objects as values, with the values of their descriptions, as an EDS of the device contains
  // them. A missing name is derived from the index or from the name of the object; elements of
  // windows are 0.
  std::vector<ObjectDescription> describe() const;

  // Name and type from the description; empty / null if there is no such object or sub-index.
  std::string_view name(Address address) const;
  ObjectType object_type(std::uint16_t index) const;

  // --- access as over SDO: rights, size, limits and hooks apply --------------------------------

  // The bytes of the value; valid until the next write or change of the dictionary. Sub-index FFh
  // returns the structure of the object, UNSIGNED32: data type << 8 | object code (CiA 301, 7.4.7).
  // It is const: descriptions do not contain it, and writing it is refused with read_only.
  Result<std::span<const std::byte>> read(Address address) const;
  // A fast variant of read() for most short values: sub-index 0 of 1 to 4 bytes without hook, in
  // the dictionary's own storage. Size 0 for all others, and where read() fails.
  Glance glance(Address address) const { return slots_->glance(address); }
  // All checks of write(), without writing: for writes that are split in two. In this order:
  // no_object, no_sub_index, read_only, length_too_high or length_too_low (length_mismatch for half
  // a character of a UNICODE_STRING), invalid_value for a BOOLEAN above 1, value_too_high or
  // value_too_low (max_less_than_min if the limits exclude every value), then the hook.
  AbortCode check(Address address, std::span<const std::byte> value) const;
  AbortCode write(Address address, std::span<const std::byte> value);

  // Whether open_source() or open_sink() may return a stream.
  bool streams(Address address) const;
  // The stream that the hook of a DOMAIN returns for transfers in pieces; nullptr if the hook
  // returns none, or the object is not a DOMAIN with such a hook: then its bytes are in the
  // dictionary. Access rights are not checked. For the error kLater see put_off_source().
  Result<ByteSource*> open_source(Address address) const;
  Result<ByteSink*> open_sink(Address address, std::optional<std::uint32_t> size) const;

  // Writes all values or none. First everything is checked as check() does, against the present
  // values. Then the hooks execute what the writes order, then all values are stored, and then the
  // hooks are informed. Returns the first refusal, with its position in refused unless that is
  // nullptr.
  AbortCode write_all(std::span<const Assignment> values, std::size_t* refused = nullptr);

  // --- accesses that may wait (split indication) ------------------------------------------------

  // For callers that can wait, such as SDO servers: if a hook returns kLater (for read: an error
  // with that code) the access waits, and ticket identifies it until it is finished or cancelled.
  // All other accesses to the object proceed. The functions above, for callers that cannot wait,
  // refuse with device_state in that case.
  Result<std::span<const std::byte>> read(Address address, Ticket& ticket);
  AbortCode write(Address address, std::span<const std::byte> value, Ticket& ticket);

  // The hook's late answer: none or a refusal. The access takes place when its caller calls finish,
  // not in here. Returns false if no access waits with this ticket (any more).
  bool complete(Ticket ticket, AbortCode why);

  // The answer; nothing as long as there is none. no_data for an unknown ticket.
  std::optional<AbortCode> outcome(Ticket ticket) const;
  // Performs the access after the outcome; the ticket becomes invalid. The hook is not called
  // again; all other checks of write() are repeated, because the object may have changed meanwhile.
  // Without an outcome the access is refused with device_state.
  Result<std::span<const std::byte>> finish_read(Ticket ticket);
  AbortCode finish_write(Ticket ticket, std::span<const std::byte> value);
  // Abandons the access; informs the hook if it has not answered.
  void cancel(Ticket ticket);

  // Call it if open_source(), open_sink() or the stream returned kLater: the transfer waits, and
  // the ticket identifies it. Returns 0 if there is no hook that could answer. Of several hooks of
  // the object, the last one that opened a source (sink) is informed.
  Ticket put_off_source(Address address) { return put_off_stream(address, false); }
  Ticket put_off_sink(Address address) { return put_off_stream(address, true); }
  // The outcome for such a ticket, which becomes invalid: none, or the reason why the transfer
  // ends. Without an outcome device_state.
  AbortCode finish(Ticket ticket);

  // --- access by the device itself: no rights, no limits, no check; hooks' written() is called ---

  // An RPDO has stored a value in the variable: calls hooks that watch RPDOs.
  void came_by_rpdo(Address address);

  // Returns false if there is no such variable or the length does not fit. A string may be longer
  // than the described one, up to 16 MiB.
  bool set(Address address, std::span<const std::byte> value);

  // The same for a number, in the size of the variable; the type of value does not matter. Returns
  // false if there is no such variable, it is not of fixed size or it cannot represent the value.
  template <class T>
  requires std::is_integral_v<T>
  bool set(Address address, T value) {
    bool negative = false;
    if constexpr (std::is_signed_v<T>) {
      negative = value < 0;
    }
    return set_number(address, static_cast<std::uint64_t>(value), negative);
  }

  // Restores the described initial values of all variables in objects first..last (NMT reset node:
  // all objects; reset communication: 1000h to 1FFFh). Bound variables are written where they are
  // bound; kept ones and windows belong to other components and are left unchanged. Hooks are not
  // called: after a reset the services have to read their parameters again.
  void reset_values(std::uint16_t first, std::uint16_t last);

  // Replaces the value that reset_values() restored with a stored one: like set(), but without
  // calling a hook.
  bool restore(Address address, std::span<const std::byte> value);

  // Increases whenever a hook is informed of a write: as long as it is unchanged, no service
  // parameter has changed.
  std::uint64_t writes_reported() const { return writes_reported_; }

  // The value as an unsigned number, zero-extended; nothing if there is no such variable, or its
  // size is 0 or more than 8 bytes. Hooks are not called.
  std::optional<std::uint64_t> number(Address address) const;

 private:
  template <class Refuse>
  Result<std::span<const std::byte>> access(Address address, Refuse refuse) const;
  bool set_number(Address address, std::uint64_t value, bool negative);
  bool set_hooked_number(Address address, std::uint64_t value, bool negative);
  void notify(Address address, const Variable& variable);
  AbortCode execute_and_store(Address address, Variable& variable,
                              std::span<const std::byte> value);
  void store_and_notify(Address address, Variable& variable, std::span<const std::byte> value);
  void point_at(std::uint16_t index, Hook* hook);
  Ticket put_off(Address address);
  Ticket put_off_stream(Address address, bool writing);
  void notify_changed(Address address);
  void notify_changed(Address address, FollowMark mark);
  void notify_observers(std::uint16_t index);

  std::unique_ptr<SlotPages> slots_;
  std::unique_ptr<ObjectTable> objects_;  // uses slots_
  std::unique_ptr<Deferrals> deferrals_;
  std::vector<Observer*> observers_;
  std::uint64_t writes_reported_ = 0;
};

}  // namespace linegate::od
