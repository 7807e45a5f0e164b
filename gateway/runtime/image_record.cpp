// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/image_record.h"

#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

#include "stack/base/assert.h"

namespace linegate::gateway {
namespace {

// Behind it: the octets of the image, changed, valid, known, and the marks. The same program reads
// it, hence plain copies.
struct Head {
  std::uint64_t layout_id;
  std::int64_t acquired;
  std::int64_t offset;
  std::uint32_t sync_count;
  std::uint32_t bytes;
  std::uint32_t words;  // of each of the three
  std::uint32_t marks;
  std::uint8_t direction;
  std::uint8_t quality;
};
static_assert(std::is_trivially_copyable_v<image::PdoMark>);

std::size_t length_of(std::size_t bytes, std::size_t words, std::size_t marks) {
  return sizeof(Head) + bytes + words * 3 * sizeof(std::uint64_t) + marks * sizeof(image::PdoMark);
}

template <class Element>
void put(const std::vector<Element>& from, std::byte*& at) {
  if (!from.empty()) {
    std::memcpy(at, from.data(), from.size() * sizeof(Element));
    at += from.size() * sizeof(Element);
  }
}

template <class Element>
void take(const std::byte*& at, std::size_t count, std::vector<Element>& to) {
  to.resize(count);
  if (count != 0) {
    std::memcpy(to.data(), at, count * sizeof(Element));
    at += count * sizeof(Element);
  }
}

}  // namespace

std::size_t longest_record(const image::Layout& layout, std::size_t pdos) {
  return length_of(layout.byte_size, (layout.entries.size() + 63) / 64, pdos);
}

[[gnu::hot]] std::size_t write_record(const image::Snapshot& snapshot, const ClockMap& clock,
                                      std::span<std::byte> to) {
  const std::size_t words = snapshot.changed.size();
  LINEGATE_ASSERT(snapshot.valid.size() == words && snapshot.known.size() == words,
                  "a snapshot has one bit of each kind for an entry");
  const std::size_t length = length_of(snapshot.bytes.size(), words, snapshot.marks.size());
  LINEGATE_ASSERT(length <= to.size(), "the record has room");
  Head head{};
  head.layout_id = snapshot.layout_id;
  head.acquired = snapshot.acquired.time_since_epoch().count();
  head.offset = clock.offset.count();
  head.sync_count = snapshot.sync_count;
  head.bytes = static_cast<std::uint32_t>(snapshot.bytes.size());
  head.words = static_cast<std::uint32_t>(words);
  head.marks = static_cast<std::uint32_t>(snapshot.marks.size());
  head.direction = static_cast<std::uint8_t>(snapshot.direction);
  head.quality = static_cast<std::uint8_t>(clock.quality);
  std::byte* at = to.data();
  std::memcpy(at, &head, sizeof head);
  at += sizeof head;
  put(snapshot.bytes, at);
  put(snapshot.changed, at);
  put(snapshot.valid, at);
  put(snapshot.known, at);
  put(snapshot.marks, at);
  return length;
}

bool read_record(std::span<const std::byte> from, image::Snapshot& snapshot, ClockMap& clock) {
  Head head{};
  if (from.size() < sizeof head) {
    return false;
  }
  std::memcpy(&head, from.data(), sizeof head);
  if (from.size() != length_of(head.bytes, head.words, head.marks) ||
      head.direction > static_cast<std::uint8_t>(image::Direction::outputs) ||
      head.quality > static_cast<std::uint8_t>(ClockQuality::synchronised)) {
    return false;
  }
  snapshot.direction = static_cast<image::Direction>(head.direction);
  snapshot.layout_id = head.layout_id;
  snapshot.acquired = Instant{Duration{head.acquired}};
  snapshot.sync_count = head.sync_count;
  clock = {Duration{head.offset}, static_cast<ClockQuality>(head.quality)};
  const std::byte* at = from.data() + sizeof head;
  take(at, head.bytes, snapshot.bytes);
  take(at, head.words, snapshot.changed);
  take(at, head.words, snapshot.valid);
  take(at, head.words, snapshot.known);
  take(at, head.marks, snapshot.marks);
  return true;
}

}  // namespace linegate::gateway
