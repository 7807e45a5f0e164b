// SPDX-License-Identifier: Apache-2.0
// The error type and the result type of the project.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "stack/base/assert.h"

namespace linegate {

// Defines the meaning of Error::code.
enum class Domain : std::uint8_t {
  none,
  sdo,      // code is a CiA 301 SDO abort code, see abort_code.h
  can,      // code is an errno of the operating system
  command,  // code is a Refusal, see stack/line/command.h
};

struct Error {
  Domain domain = Domain::none;
  std::uint32_t code = 0;

  friend constexpr bool operator==(Error, Error) = default;
};

// A value or an Error, never both and never neither.
template <class T>
class [[nodiscard]] Result {
 public:
  constexpr Result(T value) : value_(std::move(value)) {}  // NOLINT(google-explicit-constructor)
  constexpr Result(Error error) : error_(error) {}         // NOLINT(google-explicit-constructor)

  constexpr bool ok() const { return value_.has_value(); }
  constexpr explicit operator bool() const { return ok(); }

  // Precondition: ok().
  constexpr T& value() & {
    expect_value();
    return *value_;
  }
  constexpr const T& value() const& {
    expect_value();
    return *value_;
  }
  constexpr T&& value() && {
    expect_value();
    return *std::move(value_);
  }
  constexpr T& operator*() & { return value(); }
  constexpr const T& operator*() const& { return value(); }
  constexpr T* operator->() { return &value(); }
  constexpr const T* operator->() const { return &value(); }

  // Precondition: !ok().
  constexpr Error error() const {
    LINEGATE_ASSERT(!ok(), "the result is an error");
    return error_;
  }

 private:
  constexpr void expect_value() const { LINEGATE_ASSERT(ok(), "the result is a value"); }

  std::optional<T> value_;
  Error error_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  constexpr Result() = default;
  constexpr Result(Error error)
      : error_(error), ok_(false) {}  // NOLINT(google-explicit-constructor)

  constexpr bool ok() const { return ok_; }
  constexpr explicit operator bool() const { return ok_; }
  constexpr Error error() const { return error_; }

 private:
  Error error_;
  bool ok_ = true;
};

}  // namespace linegate
