// SPDX-License-Identifier: Apache-2.0
// The object dictionary of one CANopen device (CiA 301, 7.4): constant-time look-up by index and
// sub-index, access rights, limits, and hooks.
//
// Building it (add, remove, bind) allocates; look-up, reading and writing of values of fixed size
// do not. Pointers to values stay valid until Observer::reshaped() names the object: PDO copy plans
// hold them. (Those of DOMAIN move with each value, and nobody hears of it.) A value in the
// dictionary's own storage may be loaded and stored in words of 8 bytes: it starts at a multiple of
// 8, and no word holds parts of two values. The rest of the word of a value of fixed size is 0.
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

// One sub-index: where its bytes are and what may be done with them.
struct Variable {
  std::byte* data = nullptr;   // at least capacity bytes; DOMAIN: at least size
  std::uint32_t size = 0;      // bytes of the value now
  std::uint32_t capacity = 0;  // bytes of the longest value; == size for types of fixed size
  DataType type = DataType::none;
  Access access = Access::ro;
  bool mappable : 1 = false;
  bool has_limits : 1 = false;  // look-up of the limits is not in the hot part
  bool store : 1 = false;       // belongs to what 1010h saves
  bool watched : 1 = false;     // a hook wants to hear of RPDOs
  bool elsewhere : 1 = false;   // not in the dictionary's own storage
  FollowMark followed = 0;      // not 0: observers want to hear of other values
  Hook* hook = nullptr;

  std::span<const std::byte> bytes() const { return {data, size}; }
};

// A value for one variable, of a group that is written together.
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

  // Objects may be added and removed at any time; those of the communication profile, which
  // services look for when they begin, before the node that has the dictionary is made.

  // Adds the object with storage for its values. Fails with device_incompatible if the index exists
  // or is 0, or the description makes no sense (sub-indices not ascending or FFh, no type, value
  // longer than its type). A value shorter than its type is filled up with zeros. Written strings
  // are as long as the described one or 64 bytes at most, DOMAIN 16 MiB.
  Result<void> add(const ObjectDescription& object);
  // Removes it; its hooks are forgotten, accesses that wait are refused with no_object. PDOs that
  // map it stop, which is told as for any that cannot be used. no_object if there is none.
  Result<void> remove(std::uint16_t index);

  // Values of the variable live at `data` from now on (for example in a process image); the bytes
  // there become the value. data must have room for the variable's capacity. kept: it shows what
  // belongs to others, so that reset_values() leaves it alone, as it does windows. no_object or
  // no_sub_index; unsupported_access for elements of a window and for DOMAIN.
  Result<void> bind(Address address, std::byte* data, bool kept = false);

  // An object whose sub-indices 1..count are equal elements that lie one after the other at data:
  // the windows that CiA 302-4 network variables open on a process image. Sub-index 0 reads count.
  Result<void> add_window(std::uint16_t index, DataType type, Access access, std::byte* data,
                          std::uint8_t count);

  // hook is called for all sub-indices of the object, in place of the one set before; nullptr takes
  // it away. It is the one of the service that the object belongs to. no_object if none.
  Result<void> set_hook(std::uint16_t index, Hook* hook);
  // One more hook besides that, for the application: called after it, in the order they were added.
  // no_object if none. With Watch::rpdos it hears of values that come in PDOs, too: the object is
  // observed by all who change it. Accesses that wait for a hook that is taken away are refused
  // with device_state.
  Result<void> add_hook(std::uint16_t index, Hook& hook, Watch watch = Watch::writes);
  void remove_hook(std::uint16_t index, Hook& hook);

  // observer is told of changes from now on; it must outlive the dictionary or be removed first.
  void add_observer(Observer& observer);
  void remove_observer(Observer& observer);
  // Observers hear of other values of the variable (Observer::changed), with that mark, until its
  // object is removed; 0: not any more. In a window all elements are followed, or none, and have
  // kSharedMark. Costs nothing when it is read. no_object, no_sub_index.
  Result<void> follow(Address address, FollowMark mark);

  // --- look-up --------------------------------------------------------------------------------

  bool has_object(std::uint16_t index) const;

  // The variable, by value because elements of a window have none of their own; nothing if there is
  // no such object or sub-index. why (if given) becomes no_object or no_sub_index then.
  std::optional<Variable> find(Address address, AbortCode* why = nullptr) const;

  // Highest existing sub-index; nothing if there is no object.
  std::optional<std::uint8_t> highest_sub(std::uint16_t index) const;

  // Indices of all objects, ascending.
  std::vector<std::uint16_t> indices() const;

  // What the variable was described with (its default value, or a DCF's): what reset_values() gives
  // it. Empty if there is no such variable, or in a window.
  std::span<const std::byte> initial_value(Address address) const;

  // Whether 1010h (store parameters) shall save the variable; as described until it is set here.
  // no_object, no_sub_index; unsupported_access for elements of a window.
  Result<void> set_store(Address address, bool store);
  // Variables of first..last with that flag, ascending.
  std::vector<Address> stored(std::uint16_t first, std::uint16_t last) const;

  // All objects as values, with the values they were described with: what an EDS of the device
  // holds. What has no name gets one made of its index or its object's name; elements of windows
  // are 0.
  std::vector<ObjectDescription> describe() const;

  // Name and type as described; empty / null if there is no such object or sub-index.
  std::string_view name(Address address) const;
  ObjectType object_type(std::uint16_t index) const;

  // --- access as over SDO: rights, size, limits and hooks apply --------------------------------

  // The value's bytes; valid until the next write or change of the dictionary. Sub-index FFh gives
  // the structure of the object, UNSIGNED32: data type << 8 | object code (CiA 301, 7.4.7). It is
  // const: nobody describes it, and writing it is refused with read_only.
  Result<std::span<const std::byte>> read(Address address) const;
  // The same for most short values at a fraction of the price: sub-index 0 of 1 to 4 bytes without
  // hook, in the dictionary's own storage. Size 0 for all others, and where read() fails.
  Glance glance(Address address) const { return slots_->glance(address); }
  // Everything write() would check, without writing: for writes that are split in two. In this
  // order: no_object, no_sub_index, read_only, length_too_high or length_too_low (length_mismatch
  // for half a character of a UNICODE_STRING), invalid_value for a BOOLEAN above 1, value_too_high
  // or value_too_low (max_less_than_min if the limits leave nothing), then the hook.
  AbortCode check(Address address, std::span<const std::byte> value) const;
  AbortCode write(Address address, std::span<const std::byte> value);

  // Whether open_source() or open_sink() may give something.
  bool streams(Address address) const;
  // What the hook of a DOMAIN gives for transfers piece by piece; nullptr if it, or another object,
  // has its bytes in the dictionary, or is none. Rights are not looked at. An error of the code
  // kLater: see put_off_source().
  Result<ByteSource*> open_source(Address address) const;
  Result<ByteSink*> open_sink(Address address, std::optional<std::uint32_t> size) const;

  // All of them or none: everything is checked as check() does, against the values that are there,
  // before the first hook executes what a write orders, all have before the first value is stored,
  // and all are stored before the first hook is told. Gives why not, and which one was refused (if
  // wanted).
  AbortCode write_all(std::span<const Assignment> values, std::size_t* refused = nullptr);

  // --- accesses that may wait (split indication) ------------------------------------------------

  // For callers that can wait, as SDO servers: where a hook answers kLater (an error of that code
  // for read) the access waits and ticket stands for it, until it is finished or cancelled. All
  // other accesses to the object go on. Callers that cannot wait, as those above, are refused with
  // device_state then.
  Result<std::span<const std::byte>> read(Address address, Ticket& ticket);
  AbortCode write(Address address, std::span<const std::byte> value, Ticket& ticket);

  // The hook's late answer: none or a refusal. The access takes place when its caller looks for the
  // outcome, not in here. False if nobody waits (any longer).
  bool complete(Ticket ticket, AbortCode why);

  // The answer, nothing as long as there is none. no_data for a ticket that is not known.
  std::optional<AbortCode> outcome(Ticket ticket) const;
  // The access with the outcome; the ticket is used up. The hook is not asked again; what else
  // write() checks is checked again, for the object may be another one by now. Without an outcome
  // the access is refused with device_state.
  Result<std::span<const std::byte>> finish_read(Ticket ticket);
  AbortCode finish_write(Ticket ticket, std::span<const std::byte> value);
  // Gives the access up; tells the hook if it has not answered.
  void cancel(Ticket ticket);

  // open_source() or open_sink() or the stream that it gave answered kLater: the transfer waits,
  // and the ticket stands for it. 0 if nobody is there who could answer. Of several hooks of the
  // object, the one that opened a source (sink) last is told.
  Ticket put_off_source(Address address) { return put_off_stream(address, false); }
  Ticket put_off_sink(Address address) { return put_off_stream(address, true); }
  // The outcome for such a ticket, which is used up: none, or why the transfer ends. Without an
  // outcome device_state.
  AbortCode finish(Ticket ticket);

  // --- access by the device itself: no rights, no limits, no check; hooks' written() is called ---

  // An RPDO has put a new value into the variable: tells hooks that watch RPDOs.
  void came_by_rpdo(Address address);

  // False if there is no such variable or value does not have its length. A string may be longer
  // than what was described, up to 16 MiB.
  bool set(Address address, std::span<const std::byte> value);

  // The same for a number, in as many bytes as the variable has; the type of value does not matter.
  // False if there is no such variable, it is not of fixed size or value does not fit into it.
  template <class T>
  requires std::is_integral_v<T>
  bool set(Address address, T value) {
    bool negative = false;
    if constexpr (std::is_signed_v<T>) {
      negative = value < 0;
    }
    return set_number(address, static_cast<std::uint64_t>(value), negative);
  }

  // Gives all variables of first..last their initial values again, as described (NMT reset node:
  // everything; reset communication: 1000h to 1FFFh). Bound variables are written where they live;
  // those that are kept, and windows, show what belongs to others and are left alone. Hooks are not
  // called: whoever resets lets the services read their parameters anew.
  void reset_values(std::uint16_t first, std::uint16_t last);

  // Gives the variable a stored value in place of the one that reset_values() gave it: as set(),
  // but no hook is called.
  bool restore(Address address, std::span<const std::byte> value);

  // Grows whenever a hook is told of a write: as long as it does not, no service has other
  // parameters than before.
  std::uint64_t writes_told() const { return writes_told_; }

  // The value as an unsigned number, zero-extended; nothing if there is none or it has 0 or more
  // than 8 bytes. Hooks are not called.
  std::optional<std::uint64_t> number(Address address) const;

 private:
  template <class Refuse>
  Result<std::span<const std::byte>> access(Address address, Refuse refuse) const;
  bool set_number(Address address, std::uint64_t value, bool negative);
  bool set_hooked_number(Address address, std::uint64_t value, bool negative);
  void tell(Address address, const Variable& variable);
  AbortCode execute_and_store(Address address, Variable& variable,
                              std::span<const std::byte> value);
  void store_and_tell(Address address, Variable& variable, std::span<const std::byte> value);
  void point_at(std::uint16_t index, Hook* hook);
  Ticket put_off(Address address);
  Ticket put_off_stream(Address address, bool writing);
  void tell_changed(Address address);
  void tell_changed(Address address, FollowMark mark);
  void tell_observers(std::uint16_t index);

  std::unique_ptr<SlotPages> slots_;
  std::unique_ptr<ObjectTable> objects_;  // on slots_
  std::unique_ptr<Deferrals> deferrals_;
  std::vector<Observer*> observers_;
  std::uint64_t writes_told_ = 0;
};

}  // namespace linegate::od
