// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/event_samples.h"

#include <algorithm>
#include <charconv>
#include <string>

#include "bridges/dds/event_codec.h"
#include "stack/base/short_text.h"
#include "stack/line/event_severity.h"

namespace linegate::dds {
namespace {

constexpr std::size_t kLongestEventText = 256;  // of Event::text, in bytes
constexpr std::string_view kStreamProperty = "stream";

std::uint64_t stream_of(const v1::Event& event) {
  std::uint64_t stream = 0;
  for (const v1::Property& property : event.properties()) {
    const std::string_view value = property.value().c_str();
    if (property.name() != kStreamProperty.data())
      continue;
    const char* const end = value.data() + value.size();
    const auto [rest, error] = std::from_chars(value.data(), end, stream, 16);
    return error == std::errc{} && rest == end ? stream : 0;
  }
  return 0;
}

}  // namespace

void add_stream(std::uint64_t stream, v1::Event& to) {
  constexpr const char* kDigits = "0123456789abcdef";
  if (stream == 0 || to.properties().size() >= kMaxProperties)
    return;
  std::string value(16, '0');
  for (auto digit = value.rbegin(); digit != value.rend(); ++digit, stream >>= 4U)
    *digit = kDigits[stream & 0xFU];
  v1::Property& property = to.properties().emplace_back();
  property.name(kStreamProperty.data());
  property.value(value);
}

void to_wire(const linegate::Event& from, std::string_view text, const ClockMap& clock,
             v1::Event& to) {
  const EventFields fields = pack(from.data);
  to.number(from.number);
  to.time(clock.utc(from.time));
  to.clock(static_cast<std::uint8_t>(clock.quality));
  to.kind(static_cast<std::uint8_t>(from.kind()));
  to.severity(static_cast<std::uint8_t>(line::severity_of(from.data)));
  to.node(from.node);
  to.code(fields.code);
  to.value(fields.value);
  to.data().resize(fields.length);
  for (std::size_t i = 0; i < fields.length; ++i)
    to.data()[i] = std::to_integer<std::uint8_t>(fields.data[i]);
  to.text(short_text(text, kLongestEventText));
}

void from_wire(const v1::Event& from, const ClockMap& clock, ReceivedEvent& to) {
  EventFields fields{.code = from.code(), .value = from.value()};
  fields.length = static_cast<std::uint8_t>(std::min(from.data().size(), fields.data.size()));
  for (std::size_t i = 0; i < fields.length; ++i)
    fields.data[i] = std::byte{from.data()[i]};
  to.number = from.number();
  to.stream = stream_of(from);
  to.time = clock.instant(from.time());
  to.kind = static_cast<EventKind>(from.kind());
  to.node = from.node();
  to.fields = fields;
  to.data = unpack(to.kind, fields);
  to.severity = to.data ? line::severity_of(*to.data) : severity(to.kind);
}

}  // namespace linegate::dds
