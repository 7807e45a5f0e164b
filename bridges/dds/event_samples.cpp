// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/event_samples.h"

#include <algorithm>
#include <string>

#include "stack/line/event_severity.h"

namespace linegate::dds {

void to_wire(const linegate::Event& from, std::string_view text, const ClockMap& clock,
             v1::Event& to) {
  to.number(from.number);
  to.time(clock.utc(from.time));
  to.clock(static_cast<std::uint8_t>(clock.quality));
  to.kind(static_cast<std::uint8_t>(from.kind));
  to.severity(static_cast<std::uint8_t>(line::severity_of(from)));
  to.node(from.node);
  to.code(from.code);
  to.value(from.value);
  to.data().resize(std::min<std::size_t>(from.length, from.data.size()));
  for (std::size_t i = 0; i < to.data().size(); ++i) {
    to.data()[i] = std::to_integer<std::uint8_t>(from.data[i]);
  }
  to.text(std::string(text));
}

void from_wire(const v1::Event& from, const ClockMap& clock, linegate::Event& to) {
  to.number = from.number();
  to.time = clock.instant(from.time());
  to.kind = static_cast<EventKind>(from.kind());
  to.node = from.node();
  to.length = static_cast<std::uint8_t>(std::min(from.data().size(), to.data.size()));
  to.code = from.code();
  to.value = from.value();
  to.data.fill(std::byte{0});
  for (std::size_t i = 0; i < to.length; ++i)
    to.data[i] = std::byte{from.data()[i]};
}

}  // namespace linegate::dds
