// The object dictionary of one CANopen device (CiA 301, 7.4): constant-time look-up by index and
// sub-index, access rights, limits, and hooks.
//
// Building it (add, remove, bind) allocates; look-up, reading and writing of values of fixed size
// do not. Pointers to values stay valid until the object is removed: PDO copy plans hold them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"
#include "stack/base/result.h"
#include "stack/od/description.h"

namespace linegate::od {

struct Variable;

// What belongs to an object besides its bytes. A hook is registered for an object and sees all its
// sub-indices. It must outlive the dictionary or be removed first. Every function has a default
// that does nothing.
class Hook {
 public:
  virtual ~Hook() = default;

  // Before a value is read: the hook may refresh it (writing to variable.data).
  virtual AbortCode before_read(Address address, const Variable& variable);
  // May refuse a value that passed type, access and limit checks. value has the variable's size.
  virtual AbortCode check_write(Address address, std::span<const std::byte> value);
  // The value has been written.
  virtual void written(Address address);
};

// One sub-index: where its bytes are and what may be done with them.
struct Variable {
  std::byte* data = nullptr;   // at least capacity bytes
  std::uint32_t size = 0;      // bytes of the value now
  std::uint32_t capacity = 0;  // bytes there is room for; == size for types of fixed size
  DataType type = DataType::none;
  Access access = Access::ro;
  bool mappable = false;
  bool has_limits = false;  // look-up of the limits is not in the hot part
  Hook* hook = nullptr;

  std::span<const std::byte> bytes() const { return {data, size}; }
};

class Dictionary {
 public:
  Dictionary();
  explicit Dictionary(const DeviceDescription& device);
  Dictionary(Dictionary&&) noexcept;
  Dictionary& operator=(Dictionary&&) noexcept;
  ~Dictionary();

  // --- building -------------------------------------------------------------------------------

  // Adds the object with storage for its values. Fails with device_incompatible if the index exists
  // or the description makes no sense (duplicate sub-index, value longer than its type).
  Result<void> add(const ObjectDescription& object);
  // Removes it; its hook is forgotten. no_object if there is none.
  Result<void> remove(std::uint16_t index);

  // Values of the variable live at `data` from now on (for example in a process image); the bytes
  // there become the value. data must have room for the variable's capacity.
  Result<void> bind(Address address, std::byte* data);

  // An object whose sub-indices 1..count are equal elements that lie one after the other at data:
  // the windows that CiA 302-4 network variables open on a process image. Sub-index 0 reads count.
  Result<void> add_window(std::uint16_t index, DataType type, Access access, std::byte* data,
                          std::uint8_t count);

  // hook is called for all sub-indices of the object; nullptr takes it away. no_object if none.
  Result<void> set_hook(std::uint16_t index, Hook* hook);

  // --- look-up --------------------------------------------------------------------------------

  bool has_object(std::uint16_t index) const;

  // The variable, by value because elements of a window have none of their own; nothing if there is
  // no such object or sub-index. why (if given) becomes no_object or no_sub_index then.
  std::optional<Variable> find(Address address, AbortCode* why = nullptr) const;

  // Highest existing sub-index; nothing if there is no object.
  std::optional<std::uint8_t> highest_sub(std::uint16_t index) const;

  // Indices of all objects, ascending.
  std::vector<std::uint16_t> indices() const;

  // Name and type as described; empty / null if there is no such object or sub-index.
  std::string_view name(Address address) const;
  ObjectType object_type(std::uint16_t index) const;

  // --- access as over SDO: rights, size, limits and hooks apply --------------------------------

  // The value's bytes; valid until the next write or change of the dictionary.
  Result<std::span<const std::byte>> read(Address address) const;
  // Everything write() would check, without writing: for writes that are split in two.
  AbortCode check(Address address, std::span<const std::byte> value) const;
  AbortCode write(Address address, std::span<const std::byte> value);

  // --- access by the device itself: no rights, no limits, no check; hooks' written() is called ---

  // False if there is no such variable or value does not fit.
  bool set(Address address, std::span<const std::byte> value);

  template <class T>
  requires std::is_integral_v<T>
  bool set(Address address, T value) {
    std::array<std::byte, sizeof(T)> raw;
    store_le(std::span<std::byte>(raw), static_cast<std::uint64_t>(value));
    return set(address, std::span<const std::byte>(raw));
  }

  // The value as an unsigned number, zero-extended; nothing if there is none or it has 0 or more
  // than 8 bytes. Hooks are not called.
  std::optional<std::uint64_t> number(Address address) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace linegate::od
