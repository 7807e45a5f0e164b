// SPDX-License-Identifier: Apache-2.0
#include "stack/image/network_variables.h"

#include <algorithm>
#include <array>
#include <memory>

#include "stack/od/objects.h"

namespace linegate::image {
namespace {

using od::DataType;

constexpr std::uint16_t kIndicesPerType = 0x40;
constexpr std::uint32_t kSubsPerIndex = 254;
constexpr std::uint32_t kMaxElements = kIndicesPerType * kSubsPerIndex;

// In the order of their arrays, at distances of kIndicesPerType.
constexpr std::array<DataType, 18> kTypes = {
    DataType::integer8,   DataType::unsigned8,  DataType::boolean,    DataType::integer16,
    DataType::unsigned16, DataType::integer24,  DataType::unsigned24, DataType::integer32,
    DataType::unsigned32, DataType::real32,     DataType::unsigned40, DataType::integer40,
    DataType::unsigned48, DataType::integer48,  DataType::unsigned56, DataType::integer56,
    DataType::integer64,  DataType::unsigned64,
};

constexpr std::uint16_t base_of(Direction direction) {
  return direction == Direction::inputs ? od::objects::kOutputVariables
                                        : od::objects::kInputVariables;
}

// The type whose array shows values of this number of bits; DataType::none if there is none.
DataType array_type(DataType type, std::uint32_t bit_length) {
  const auto has_array = [](DataType t) { return std::ranges::find(kTypes, t) != kTypes.end(); };
  if (od::bit_size(type) == bit_length && has_array(type)) {
    return type;
  }
  constexpr std::array kUnsigned = {
      DataType::boolean,    DataType::unsigned8,  DataType::unsigned16,
      DataType::unsigned24, DataType::unsigned32, DataType::unsigned40,
      DataType::unsigned48, DataType::unsigned56, DataType::unsigned64};
  const auto* it = std::ranges::find_if(
      kUnsigned, [bit_length](DataType t) { return od::bit_size(t) == bit_length; });
  return it == kUnsigned.end() ? DataType::none : *it;
}

// Shows the bits of an area as BOOLEANs and marks bits that are written by SDO.
class Variables final : public od::Hook {
 public:
  explicit Variables(ProcessImage& image) : image_(image) {}

  AbortCode before_read(od::Address address, const od::Variable& variable) override {
    const std::optional<VariablePlace> place = variable_place(address);
    if (address.sub != 0 && place && place->type == DataType::boolean) {
      *variable.data = bit(*place);
    }
    return AbortCode::none;
  }

  AbortCode check_write(od::Address address, std::span<const std::byte> value) override {
    const std::optional<VariablePlace> place = variable_place(address);
    const bool boolean = place && place->type == DataType::boolean;
    return boolean && value[0] > std::byte{1} ? AbortCode::invalid_value : AbortCode::none;
  }

  void written(od::Address address) override {
    const std::optional<VariablePlace> place = variable_place(address);
    if (!place) {
      return;
    }
    if (place->type == DataType::boolean) {
      store_bit(*place);
    } else {
      image_.mark_written(place->direction, place->bit_offset, place->bit_length);
    }
  }

 private:
  std::byte bit(const VariablePlace& place) const {
    const std::byte at = image_.bytes(place.direction)[place.bit_offset / 8];
    return at >> (place.bit_offset % 8) & std::byte{1};
  }

  void store_bit(const VariablePlace& place) {
    const std::byte value = image_.boolean_bytes(place.direction, 0)[place.bit_offset];
    const std::uint32_t shift = place.bit_offset % 8;
    image_.area(place.direction)
        .merge(place.bit_offset / 8, std::to_integer<std::uint64_t>(value) << shift,
               std::uint64_t{1} << shift);
  }

  ProcessImage& image_;
};

// Adds all windows of one type on one area.
Result<void> add_array(od::Dictionary& dictionary, DataType type, std::uint16_t index,
                       od::Access access, std::span<std::byte> bytes, od::Hook& hook) {
  const std::size_t size = od::byte_size(type);
  const std::size_t elements = std::min<std::size_t>(bytes.size() / size, kMaxElements);
  for (std::size_t first = 0; first < elements; first += kSubsPerIndex, ++index) {
    const auto count = std::min<std::size_t>(elements - first, kSubsPerIndex);
    Result<void> added = dictionary.add_window(index, type, access, bytes.data() + first * size,
                                               static_cast<std::uint8_t>(count));
    if (!added.ok()) {
      return added;
    }
    added = dictionary.set_hook(index, &hook);
    if (!added.ok()) {
      return added;
    }
  }
  return {};
}

}  // namespace

std::optional<od::Address> variable_address(Direction direction, od::DataType type,
                                            std::uint32_t bit_offset, std::uint32_t bit_length) {
  const DataType shown = array_type(type, bit_length);
  if (shown == DataType::none || bit_offset % bit_length != 0) {
    return std::nullopt;
  }
  const std::uint32_t element = bit_offset / bit_length;
  if (element >= kMaxElements) {
    return std::nullopt;
  }
  const auto array = static_cast<std::uint32_t>(std::ranges::find(kTypes, shown) - kTypes.begin());
  return od::Address{static_cast<std::uint16_t>(base_of(direction) + array * kIndicesPerType +
                                                element / kSubsPerIndex),
                     static_cast<std::uint8_t>(1 + element % kSubsPerIndex)};
}

std::optional<VariablePlace> variable_place(od::Address address) {
  constexpr std::uint32_t kIndices = kTypes.size() * kIndicesPerType;
  if (address.index < od::objects::kInputVariables ||
      address.index >= od::objects::kOutputVariables + kIndices || address.sub == 0 ||
      address.sub > kSubsPerIndex) {
    return std::nullopt;
  }
  VariablePlace place;
  place.direction =
      address.index < od::objects::kOutputVariables ? Direction::outputs : Direction::inputs;
  const std::uint32_t from_base = address.index - std::uint32_t{base_of(place.direction)};
  place.type = kTypes[from_base / kIndicesPerType];
  place.bit_length = od::bit_size(place.type);
  const std::uint32_t element =
      from_base % kIndicesPerType * kSubsPerIndex + address.sub - std::uint32_t{1};
  place.bit_offset = element * place.bit_length;
  return place;
}

std::vector<od::Address> variables_showing(Direction direction, std::uint32_t begin,
                                           std::uint32_t end) {
  std::vector<od::Address> out;
  for (std::uint32_t array = 0; array < kTypes.size() && begin < end; ++array) {
    const std::uint32_t bits_of_index = od::bit_size(kTypes[array]) * kSubsPerIndex;
    const std::uint32_t last = (end - 1) / bits_of_index;
    for (std::uint32_t i = begin / bits_of_index; i <= last && i < kIndicesPerType; ++i) {
      out.push_back(
          {static_cast<std::uint16_t>(base_of(direction) + array * kIndicesPerType + i), 1});
    }
  }
  return out;
}

Result<void> add_network_variables(od::Dictionary& dictionary, ProcessImage& image) {
  image.keep(std::make_unique<Variables>(image));
  for (const Direction direction : {Direction::outputs, Direction::inputs}) {
    const od::Access access = direction == Direction::inputs ? od::Access::rww : od::Access::ro;
    Area& area = image.area(direction);
    const std::span<std::byte> bytes(area.data(), area.size());
    const std::span<std::byte> booleans =
        image.boolean_bytes(direction, std::min<std::size_t>(8 * area.size(), kMaxElements));
    std::uint16_t index = base_of(direction);
    for (const DataType type : kTypes) {
      Result<void> added = add_array(dictionary, type, index, access,
                                     type == DataType::boolean ? booleans : bytes, *image.kept());
      if (!added.ok()) {
        return added;
      }
      index = static_cast<std::uint16_t>(index + kIndicesPerType);
    }
  }
  return {};
}

}  // namespace linegate::image
