// SPDX-License-Identifier: Apache-2.0
// Converts between ImageLayout, ProcessImage and PdoUpdate of the contract and the stack's values.
// gateway, line and incarnation are unchanged.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <linegate.h>

#include "bridges/dds/clock_map.h"
#include "bridges/dds/values.h"
#include "stack/image/layout.h"
#include "stack/image/snapshot.h"
#include "stack/pdo/reception.h"

namespace linegate::dds {

// Number of parts that a layout is published in, at least 1.
std::uint16_t layout_parts(const image::Layout& layout);

// part: 0 to layout_parts() - 1.
void to_wire(const image::Layout& from, std::uint16_t part, v1::ImageLayout& to);
// Whether scaling, limits and access are such as the contract permits.
bool is_plausible(const v1::LayoutEntry& entry);
void from_wire(const v1::LayoutEntry& from, image::Entry& to);

// Returns false if the snapshot exceeds the contract's bounds.
bool to_wire(const image::Snapshot& from, const ClockMap& clock, v1::ProcessImage& to);
// Returns false if the sample is inconsistent or violates the contract (bounds, direction).
bool from_wire(const v1::ProcessImage& from, const ClockMap& clock, image::Snapshot& to);

// The values of one PDO in `snapshot`. Returns false if mark, layout and snapshot do not belong
// together.
bool to_wire(const image::Layout& layout, const image::Snapshot& snapshot,
             const image::PdoMark& mark, std::uint32_t receptions, const ClockMap& clock,
             v1::PdoUpdate& to);
// Returns false if reception and layout do not belong together.
bool to_wire(const image::Layout& layout, const pdo::Reception& reception, const ClockMap& clock,
             v1::PdoReception& to);
void from_wire(const v1::PdoReception& from, const ClockMap& clock, PdoReception& to);
void from_wire(const v1::PdoUpdate& from, const ClockMap& clock, PdoUpdate& to);

// Copies `bits` bits (1..512) from bit `offset` of `area` to bit 0. The area must contain them.
void extract_bits(std::span<const std::byte> area, std::uint32_t offset, std::uint16_t bits,
                  std::vector<std::uint8_t>& to);

}  // namespace linegate::dds
