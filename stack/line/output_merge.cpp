// SPDX-License-Identifier: Apache-2.0
#include "stack/line/output_merge.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace linegate::line {
namespace {

std::uint64_t end_of(const OutputBytes& run) {
  return std::uint64_t{run.offset} + run.data.size();
}

// Writes the value into the bytes that contain its entry, if the run does.
void write_into(OutputBytes& run, const OutputValue& value, const OutputPlace& place) {
  const std::uint64_t begin = std::uint64_t{run.offset} * 8U;
  const std::uint32_t bits = std::min<std::uint32_t>(place.bit_length, 8U * value.length);
  if (place.bit_offset < begin || place.bit_offset + std::uint64_t{bits} > end_of(run) * 8U) {
    return;
  }
  for (std::uint32_t i = 0; i < bits; ++i) {
    const std::uint64_t at = place.bit_offset - begin + i;
    const auto mask = std::byte{1} << static_cast<unsigned>(at % 8U);
    const bool set = (value.data[i / 8U] & (std::byte{1} << (i % 8U))) != std::byte{0};
    std::byte& byte = run.data[at / 8U];
    byte = set ? byte | mask : byte & ~mask;
  }
}

// Adds a run that replaces what the others have in its bytes. Runs that overlap become one.
void overlay(std::vector<OutputBytes>& runs, OutputBytes run) {
  const auto overlaps = [&run](const OutputBytes& other) {
    return other.offset < end_of(run) && run.offset < end_of(other);
  };
  for (auto it = std::ranges::find_if(runs, overlaps); it != runs.end();
       it = std::ranges::find_if(runs, overlaps)) {
    OutputBytes whole{.offset = std::min(it->offset, run.offset), .data = {}};
    whole.data.resize(std::max(end_of(*it), end_of(run)) - whole.offset);
    std::ranges::copy(it->data, whole.data.begin() + (it->offset - whole.offset));
    std::ranges::copy(run.data, whole.data.begin() + (run.offset - whole.offset));
    runs.erase(it);
    run = std::move(whole);
  }
  runs.push_back(std::move(run));
}

}  // namespace

// A write applies its values before its bytes, so a newer value is written into earlier bytes.
void add_earlier(OutputWrite& newer, OutputWrite& earlier, std::span<const OutputPlace> places) {
  std::vector<bool> replaced(places.size());
  for (const OutputValue& value : newer.values) {
    if (value.entry < places.size()) {
      replaced[value.entry] = true;
      for (OutputBytes& run : earlier.bytes) {
        write_into(run, value, places[value.entry]);
      }
    }
  }
  std::erase_if(earlier.values, [&](const OutputValue& value) {
    return value.entry >= places.size() || replaced[value.entry];
  });
  newer.values.insert(newer.values.end(), earlier.values.begin(), earlier.values.end());
  std::vector<OutputBytes> runs;
  for (std::vector<OutputBytes>* const from : {&earlier.bytes, &newer.bytes}) {
    for (OutputBytes& run : *from) {
      overlay(runs, std::move(run));
    }
  }
  newer.bytes = std::move(runs);
  earlier.values.clear();
  earlier.bytes.clear();
}

}  // namespace linegate::line
