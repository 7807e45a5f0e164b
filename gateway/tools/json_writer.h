// SPDX-License-Identifier: Apache-2.0
// Writes JSON text, member by member.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace linegate::gateway {

// Calls must nest as JSON does; commas and quotes are its own affair.
class JsonWriter {
 public:
  JsonWriter& begin_object();
  JsonWriter& end_object();
  JsonWriter& begin_array();
  JsonWriter& end_array();
  JsonWriter& key(std::string_view name);

  JsonWriter& value(std::string_view text);
  JsonWriter& value(const char* text) { return value(std::string_view(text)); }
  JsonWriter& value(std::uint64_t number);
  JsonWriter& value(bool truth);

  template <class T>
  JsonWriter& member(std::string_view name, const T& content) {
    key(name);
    if constexpr (std::is_same_v<T, bool> || !std::is_integral_v<T>) {
      return value(content);
    } else {
      return value(static_cast<std::uint64_t>(content));
    }
  }

  const std::string& text() const { return text_; }

 private:
  void separate();
  void quote(std::string_view text);

  std::string text_;
  bool first_ = true;  // nothing before in the present object or array
};

}  // namespace linegate::gateway
