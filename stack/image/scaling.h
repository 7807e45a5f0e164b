// SPDX-License-Identifier: Apache-2.0
// Values of an entry in the unit that people use: value = raw * scale + offset.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "stack/od/data_type.h"
#include "stack/od/description.h"
#include "stack/od/scaling.h"

namespace linegate::image {

using od::Scaling;

struct Entry;

// The unit at the end of the name of an object: "bar" of "Pressure [bar]", but nothing of
// "Output [3]" or "Limits [-5..5]".
std::string_view unit_in(std::string_view name);

// Whether a value of this type and length can be scaled: an integer of up to 64 bits, or a real of
// its full length; not a BOOLEAN.
bool is_scalable(od::DataType type, std::uint16_t bits);

// The number that the bytes are, without scaling; nothing if the type is not scalable or the length
// is another. value: little-endian, (bits + 7) / 8 bytes.
std::optional<double> raw_number(od::DataType type, std::uint16_t bits,
                                 std::span<const std::byte> value);

// The value in the unit of the entry, rounded to 15 significant digits, so that every tool shows
// the same digits. An integer above 2^53 loses its last digits. Nothing as above.
std::optional<double> scaled_number(const Entry& entry, std::span<const std::byte> value);

// Why a number does not become a value.
enum class ScalingFault : std::uint8_t {
  none,
  not_scalable,
  out_of_range,  // of the bits of the raw value; also NaN and infinite for an integer
  below_low,     // the low limit of the entry
  above_high
};
// "is below the low limit"
std::string_view describe(ScalingFault fault);

// The reverse of scaled_number(): an integer is rounded to the nearest raw value, and refused if
// its bits do not hold it. The limits of the entry hold for the number that is given.
// out: (bits + 7) / 8 bytes, little-endian; unchanged if refused.
ScalingFault raw_of_scaled(const Entry& entry, double number, std::vector<std::byte>& out);

// The same without limits.
ScalingFault raw_of_scaled(const Scaling& scaling, od::DataType type, std::uint16_t bits,
                           double number, std::vector<std::byte>& out);

// Whether the number is beyond the limits of the entry. A tolerance of a millionth of the scale
// covers the rounding of limits.
ScalingFault check_limits(const Entry& entry, double number);

// Sets access, scaling and limits of an entry whose type is set, as a description of its object has
// them. A unit that the name of the object ends with, "Pressure [bar]", counts if there is no
// other.
void describe_value(const od::VariableDescription& variable, Entry& entry);

// "12.3": up to 15 significant digits, the shortest form.
std::string number_text(double number);

// "raw * 0.1 - 40, in bar, 0 to 250": what is known of scaling, unit and limits; empty if nothing
// is.
std::string meaning_text(const Scaling& scaling, const std::optional<double>& low,
                         const std::optional<double>& high);

// The number of such a text, or of 0x..; nothing for other texts. "nan" and "inf" are numbers.
std::optional<double> parse_number(std::string_view text);

}  // namespace linegate::image
