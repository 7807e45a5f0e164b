// SPDX-License-Identifier: Apache-2.0
// Scalars with units, as written in plant.yaml.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "stack/base/time.h"
#include "stack/od/data_type.h"
#include "stack/od/description.h"

namespace linegate::config {

// "10us", "100ms", "1.5s", "2min", "1h"; "0" needs no unit. At most 24 hours, not negative.
std::optional<Duration> parse_duration(std::string_view text);
// The shortest exact form, "100ms".
std::string format_duration(Duration duration);

// "500kbit", "1Mbit", "125000bit", also with "/s". Bits a second.
std::optional<std::uint32_t> parse_bit_rate(std::string_view text);

// "100MB", "1.5GB", "64kB", "5000B": bytes, in powers of 1000. At most 1 TB.
std::optional<std::uint64_t> parse_size(std::string_view text);

// The shortest form in powers of 1000, "100MB".
std::string format_size(std::uint64_t bytes);

// "90d", "36h", or as parse_duration(): 1 minute to 100 years.
std::optional<Duration> parse_age(std::string_view text);
// The shortest exact form, "90d".
std::string format_age(Duration age);

// Decimal, or hexadecimal with 0x. Not negative.
std::optional<std::uint64_t> parse_unsigned(std::string_view text);

// "6083:1", "6083" (sub-index 0), "0x6083:0x01": index always hexadecimal, sub-index hexadecimal.
std::optional<od::Address> parse_address(std::string_view text);
std::string format_address(od::Address address);
// What commands take the name of an object for, instead: "an object, INDEX:SUB" or "all objects";
// empty: it is a name. Without a sub-index it is a name, as Feed, unless there is that object.
std::string_view other_reading(std::string_view name,
                               const std::function<bool(std::uint16_t index)>& exists);

// Parses a value of the object's type, little-endian: numbers decimal or with 0x, BOOLEAN also true
// and false, VISIBLE_STRING verbatim, other types as hexadecimal bytes ("01 02 FF") of the size of
// the type. Nothing if it is invalid or out of range.
std::optional<std::vector<std::byte>> parse_value(std::string_view text, od::DataType type);

// The `size` low bytes of a number.
std::vector<std::byte> little_endian(std::uint64_t value, std::size_t size);

// The most similar candidate; empty if none is similar.
std::string nearest(std::string_view text, std::span<const std::string> candidates);

}  // namespace linegate::config
