// SPDX-License-Identifier: Apache-2.0
// Reading and writing the values of a Dictionary.
#include <algorithm>

#include "stack/od/data_type.h"
#include "stack/od/deferrals.h"
#include "stack/od/object_table.h"

namespace linegate::od {
namespace {

// Half a character at the end of a UNICODE_STRING.
bool odd_character(DataType type, std::size_t size) {
  return type == DataType::unicode_string && size % 2 != 0;
}

AbortCode check_length(const Variable& variable, std::size_t size) {
  if (size > variable.capacity) {
    return AbortCode::length_too_high;
  }
  if (byte_size(variable.type) != 0) {
    return size < variable.size ? AbortCode::length_too_low : AbortCode::none;
  }
  return odd_character(variable.type, size) ? AbortCode::length_mismatch : AbortCode::none;
}

// All checks except that of the hook.
AbortCode check_value(const ObjectTable& objects, Address address, const Variable& variable,
                      std::span<const std::byte> value) {
  if (!writable(variable.access)) {
    return AbortCode::read_only;
  }
  if (const AbortCode why = check_length(variable, value.size()); why != AbortCode::none) {
    return why;
  }
  if (variable.type == DataType::boolean && value[0] > std::byte{1}) {
    return AbortCode::invalid_value;
  }
  if (variable.has_limits) {
    const VariableDetails& details = objects.details(address);
    return check_limits(variable.type, value, details.low, details.high);
  }
  return AbortCode::none;
}

AbortCode check_variable(const ObjectTable& objects, Address address, const Variable& variable,
                         std::span<const std::byte> value) {
  const AbortCode why = check_value(objects, address, variable, value);
  return why != AbortCode::none || variable.hook == nullptr
             ? why
             : variable.hook->check_write(address, value);
}

// Executes what the write orders, after all checks.
AbortCode execute(Address address, const Variable& variable, std::span<const std::byte> value) {
  return variable.hook == nullptr ? AbortCode::none
                                  : never_later(variable.hook->execute_write(address, value));
}

// Runs one phase for all values of a group. Returns the first refusal, and its position in refused
// unless that is nullptr.
template <class Phase>
AbortCode first_refusal(std::span<const Assignment> values, std::size_t* refused, Phase phase) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const AbortCode why = phase(values[i]);
    if (why != AbortCode::none) {
      if (refused != nullptr) {
        *refused = i;
      }
      return why;
    }
  }
  return AbortCode::none;
}

// The reason why an address without a variable cannot be written: sub-index FFh exists, and is
// const.
AbortCode unwritable(Address address, AbortCode why) {
  return address.sub == kStructureSub && why == AbortCode::no_sub_index ? AbortCode::read_only
                                                                        : why;
}

// Values are short: for a few bytes a function call takes longer than the comparison.
bool same_bytes(std::span<const std::byte> a, std::span<const std::byte> b) {
  if (a.size() != b.size()) {
    return false;
  }
  switch (a.size()) {
    case 1:
      return a[0] == b[0];
    case 2:
      return load_le<std::uint16_t>(a.data()) == load_le<std::uint16_t>(b.data());
    case 4:
      return load_le<std::uint32_t>(a.data()) == load_le<std::uint32_t>(b.data());
    default:
      return std::equal(a.begin(), a.end(), b.begin());
  }
}

void copy_bytes(std::byte* to, std::span<const std::byte> from) {
  switch (from.size()) {
    case 0:
      break;
    case 1:
      *to = from[0];
      break;
    case 2:
      store_le(to, load_le<std::uint16_t>(from.data()));
      break;
    case 4:
      store_le(to, load_le<std::uint32_t>(from.data()));
      break;
    default:
      std::memmove(to, from.data(), from.size());
      break;
  }
}

// Whether `bytes` bytes can represent the value. negative: the value is below 0, in two's
// complement.
bool fits(std::uint64_t value, bool negative, std::uint32_t bytes) {
  if (bytes >= sizeof value) {
    return true;
  }
  const unsigned bits = 8 * bytes;
  const std::uint64_t beyond = value >> bits;
  const bool top = ((value >> (bits - 1)) & 1U) != 0;
  return negative ? beyond == ~std::uint64_t{0} >> bits && top : beyond == 0;
}

// For types of fixed size, up to 8 bytes. Returns true if the value changed. A value in the
// dictionary's own storage is stored as one word, so that a load soon afterwards does not stall on
// partial stores.
bool replace_number(const Variable& variable, std::uint64_t value) {
  if (variable.elsewhere) {
    const std::uint64_t before = load_le(variable.bytes());
    store_le(std::span(variable.data, variable.size), value);
    return before != load_le(variable.bytes());
  }
  const std::uint64_t word = value & ~std::uint64_t{0} >> (64 - 8 * variable.size);
  if (load_le<std::uint64_t>(variable.data) == word) {
    return false;
  }
  store_le(variable.data, word);
  return true;
}

// Precondition: value has an allowed length. It may overlap the variable's own bytes. Returns true
// if observers are to be informed.
bool store(const ObjectTable& objects, Address address, Variable& variable,
           std::span<const std::byte> value) {
  const std::span<const std::byte> before = variable.bytes();
  const bool news = variable.followed != 0 && !same_bytes(before, value);
  if (variable.type == DataType::domain) {
    objects.details(address).domain = std::vector<std::byte>(value.begin(), value.end());
    variable.data = objects.details(address).domain.data();
  } else {
    copy_bytes(variable.data, value);
  }
  variable.size = static_cast<std::uint32_t>(value.size());
  return news;
}

// A string that the device itself sets may exceed its capacity: it is then moved to a buffer of its
// own.
void make_room(const ObjectTable& objects, Address address, Variable& variable, std::size_t size) {
  if (!is_string(variable.type) || size <= variable.capacity || size > kLongestValue ||
      odd_character(variable.type, size)) {
    return;
  }
  VariableDetails& details = objects.details(address);
  if (details.kept) {
    return;
  }
  std::vector<std::byte> room(size);
  std::copy_n(variable.data, variable.size, room.begin());
  details.domain = std::move(room);
  variable.data = details.domain.data();
  variable.capacity = static_cast<std::uint32_t>(size);
}

// A string in a buffer of its own changed its length: its bytes may have moved, and PDOs that map
// it do not fit, so pointers to it have to be looked up again.
bool reshaped(const ObjectTable& objects, Address address, const Variable& variable,
              std::uint32_t before) {
  return variable.size != before && is_string(variable.type) &&
         variable.data == objects.details(address).domain.data();
}

// refuse(why) returns the error for a hook that refuses or returns kLater.
template <class Refuse>
[[gnu::always_inline]] inline Result<std::span<const std::byte>> read_variable(
    Address address, const Variable& variable, Refuse refuse) {
  if (!readable(variable.access)) {
    return to_error(AbortCode::write_only);
  }
  if (variable.hook != nullptr) {
    const AbortCode why = variable.hook->before_read(address, variable);
    if (why != AbortCode::none) {
      return refuse(why);
    }
  }
  return variable.bytes();
}

std::optional<std::uint64_t> number_in(const Variable& variable) {
  if (variable.size == 0 || variable.size > sizeof(std::uint64_t)) {
    return std::nullopt;
  }
  return load_le(variable.bytes());
}

}  // namespace

void Dictionary::notify(Address address, const Variable& variable) {
  if (variable.hook != nullptr) {
    ++writes_reported_;
    variable.hook->written(address);
  }
}

void Dictionary::store_and_notify(Address address, Variable& variable,
                                  std::span<const std::byte> value) {
  const std::uint32_t before = variable.size;
  const bool news = store(*objects_, address, variable, value);
  if (reshaped(*objects_, address, variable, before)) {
    notify_observers(address.index);
  }
  notify(address, variable);
  if (news) {
    notify_changed(address);
  }
}

// The effect of a write that passed all checks.
AbortCode Dictionary::execute_and_store(Address address, Variable& variable,
                                        std::span<const std::byte> value) {
  const AbortCode why = execute(address, variable, value);
  if (why == AbortCode::none) {
    store_and_notify(address, variable, value);
  }
  return why;
}

template <class Refuse>
[[gnu::always_inline]] inline Result<std::span<const std::byte>> Dictionary::access(
    Address address, Refuse refuse) const {
  if (const Variable* variable = objects_->find_plain(address)) {
    return read_variable(address, *variable, refuse);
  }
  Variable element;
  AbortCode why = AbortCode::none;
  if (const Variable* variable = objects_->find(address, element, why)) {
    return read_variable(address, *variable, refuse);
  }
  if (address.sub == kStructureSub && why == AbortCode::no_sub_index) {
    return std::span<const std::byte>(objects_->details(*objects_->find(address.index)).structure);
  }
  return to_error(why);
}

Result<std::span<const std::byte>> Dictionary::read(Address address) const {
  return access(address, [](AbortCode answer) { return to_error(never_later(answer)); });
}

Result<std::span<const std::byte>> Dictionary::read(Address address, Ticket& ticket) {
  return access(address, [&](AbortCode answer) {
    if (answer == kLater) {
      ticket = put_off(address);
    }
    return to_error(answer);
  });
}

AbortCode Dictionary::check(Address address, std::span<const std::byte> value) const {
  Variable element;
  AbortCode why = AbortCode::none;
  const Variable* variable = objects_->find(address, element, why);
  return variable == nullptr ? unwritable(address, why)
                             : never_later(check_variable(*objects_, address, *variable, value));
}

AbortCode Dictionary::write(Address address, std::span<const std::byte> value) {
  Variable element;
  AbortCode why = AbortCode::none;
  Variable* variable = objects_->find(address, element, why);
  if (variable == nullptr) {
    return unwritable(address, why);
  }
  why = never_later(check_variable(*objects_, address, *variable, value));
  return why == AbortCode::none ? execute_and_store(address, *variable, value) : why;
}

AbortCode Dictionary::write(Address address, std::span<const std::byte> value, Ticket& ticket) {
  Variable element;
  AbortCode why = AbortCode::none;
  Variable* variable = objects_->find(address, element, why);
  if (variable == nullptr) {
    return unwritable(address, why);
  }
  why = check_variable(*objects_, address, *variable, value);
  if (why == AbortCode::none) {
    return execute_and_store(address, *variable, value);
  }
  if (why == kLater) {
    ticket = put_off(address);
  }
  return why;
}

AbortCode Dictionary::write_all(std::span<const Assignment> values, std::size_t* refused) {
  Variable element;
  AbortCode why = AbortCode::none;
  why = first_refusal(values, refused,
                      [this](const Assignment& one) { return check(one.address, one.value); });
  if (why == AbortCode::none) {
    why = first_refusal(values, refused, [&](const Assignment& one) {
      return execute(one.address, *objects_->find(one.address, element, why), one.value);
    });
  }
  if (why != AbortCode::none) {
    return why;
  }
  std::vector<Address> changed;
  std::vector<std::uint16_t> moved;
  for (const auto& [address, value] : values) {
    Variable& variable = *objects_->find(address, element, why);
    const std::uint32_t before = variable.size;
    if (store(*objects_, address, variable, value)) {
      changed.push_back(address);
    }
    if (reshaped(*objects_, address, variable, before)) {
      moved.push_back(address.index);
    }
  }
  for (const std::uint16_t index : moved) {
    notify_observers(index);
  }
  for (const auto& [address, value] : values) {
    const Variable* variable = objects_->find(address, element, why);
    if (variable != nullptr) {  // a hook may have removed the object
      notify(address, *variable);
    }
  }
  for (const Address address : changed) {
    notify_changed(address);
  }
  return AbortCode::none;
}

AbortCode Dictionary::finish_write(Ticket ticket, std::span<const std::byte> value) {
  const auto waiting = deferrals_->take(ticket);
  AbortCode why = waiting ? waiting->outcome.value_or(AbortCode::device_state) : AbortCode::no_data;
  if (why != AbortCode::none) {
    return why;
  }
  Variable element;
  Variable* variable = objects_->find(waiting->address, element, why);
  if (variable == nullptr) {
    return why;
  }
  why = check_value(*objects_, waiting->address, *variable, value);
  return why == AbortCode::none ? execute_and_store(waiting->address, *variable, value) : why;
}

bool Dictionary::set(Address address, std::span<const std::byte> value) {
  Variable element;
  AbortCode why = AbortCode::none;
  Variable* variable = objects_->find(address, element, why);
  if (variable != nullptr) {
    make_room(*objects_, address, *variable, value.size());
  }
  if (variable == nullptr || check_length(*variable, value.size()) != AbortCode::none) {
    return false;
  }
  store_and_notify(address, *variable, value);
  return true;
}

bool Dictionary::restore(Address address, std::span<const std::byte> value) {
  Variable element;
  AbortCode why = AbortCode::none;
  Variable* variable = objects_->find(address, element, why);
  if (variable != nullptr) {
    make_room(*objects_, address, *variable, value.size());
  }
  if (variable == nullptr || check_length(*variable, value.size()) != AbortCode::none) {
    return false;
  }
  const std::uint32_t before = variable->size;
  (void)store(*objects_, address, *variable, value);
  if (reshaped(*objects_, address, *variable, before)) {
    notify_observers(address.index);
  }
  return true;
}

[[gnu::hot]] bool Dictionary::set_number(Address address, std::uint64_t value, bool negative) {
  const Variable* const variable = objects_->find_plain(address);
  if (variable == nullptr || variable->hook != nullptr) [[unlikely]] {
    return set_hooked_number(address, value, negative);
  }
  if (!has_fixed_size(variable->type) || !fits(value, negative, variable->size)) {
    return false;
  }
  if (replace_number(*variable, value) && variable->followed != 0) {
    notify_changed(address, variable->followed);
  }
  return true;
}

// Also for variables of a window.
bool Dictionary::set_hooked_number(Address address, std::uint64_t value, bool negative) {
  Variable element;
  AbortCode why = AbortCode::none;
  const Variable* const variable = objects_->find(address, element, why);
  if (variable == nullptr || !has_fixed_size(variable->type) ||
      !fits(value, negative, variable->size)) {
    return false;
  }
  const bool news = replace_number(*variable, value);
  notify(address, *variable);
  if (news) {
    notify_changed(address);
  }
  return true;
}

void Dictionary::reset_values(std::uint16_t first, std::uint16_t last) {
  for (const std::uint16_t index : indices()) {
    const Slot& slot = *objects_->find(index);
    if (index < first || index > last || slot.kind == Slot::Kind::window) {
      continue;
    }
    for (unsigned sub = 0; sub <= slot.highest; ++sub) {
      const Address address{index, static_cast<std::uint8_t>(sub)};
      const VariableDetails& details = objects_->details(address);
      if (slot.variables[sub].type != DataType::none && !details.kept) {
        (void)store(*objects_, address, slot.variables[sub], details.initial);
      }
    }
  }
}

std::optional<std::uint64_t> Dictionary::number(Address address) const {
  if (const Variable* variable = objects_->find_plain(address)) {
    return number_in(*variable);
  }
  const std::optional<Variable> element = find(address);
  return element ? number_in(*element) : std::nullopt;
}

}  // namespace linegate::od
