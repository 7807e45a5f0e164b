// SPDX-License-Identifier: Apache-2.0
// Values of a process image from and to the types of an application.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bridges/client/client.h"
#include "stack/image/layout.h"

namespace linegate::client {

// The bits of an entry, in the low end; empty if they are not in the area.
std::vector<std::byte> bits_of(std::span<const std::byte> area, std::uint32_t bit_offset,
                               std::uint16_t bit_length);

// The value of a type; bits: its size. A size that is not that of a number or time is given as
// bytes.
Data decode(od::DataType type, std::uint16_t bits, std::span<const std::byte> value);

// The reverse. out has as many bytes as the bits need.
Error encode(const Data& value, od::DataType type, std::uint16_t bits, std::vector<std::byte>& out);

// The value in the unit of the entry, as a double; the raw value itself if it is not scaled.
Data scaled(const image::Entry& entry, const Data& raw, std::span<const std::byte> value);

// The reverse, within the limits of the entry.
Error encode_scaled(const Data& value, const image::Entry& entry, std::vector<std::byte>& out);

std::string text_of(const Data& data);

// Whether they are the same; a NaN is the same as a NaN of the same bits.
bool is_same(const Data& a, const Data& b);

}  // namespace linegate::client
