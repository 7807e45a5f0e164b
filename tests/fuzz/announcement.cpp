// SPDX-License-Identifier: Apache-2.0
// A datagram that reaches the ports of discovery, which `linegate doctor` reads. Promise: texts are
// bounded, each locator has a port and an IPv4 address, and what was read is read again after it
// was written.
#include "bridges/dds/announcement.h"

#include <cstddef>
#include <cstdint>
#include <span>

#include <arpa/inet.h>

#include "tests/fuzz/expect.h"

namespace {

using linegate::dds::Announcement;
using linegate::dds::UdpLocator;

bool is_sound(const UdpLocator& locator) {
  in_addr address{};
  return locator.port != 0 && inet_pton(AF_INET, locator.address.c_str(), &address) == 1;
}

void check_written(Announcement read) {
  if (!read.leaving && read.unicast.size() != 1)
    read.unicast.assign(1, {"192.168.7.10", 7410});
  const auto again = linegate::dds::read_announcement(linegate::dds::write_announcement(read, 5));
  LINEGATE_EXPECT(again && again->prefix == read.prefix && again->leaving == read.leaving);
  LINEGATE_EXPECT(read.leaving || (again->name == read.name && again->unicast == read.unicast));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto read = linegate::dds::read_announcement(std::span(data, size));
  if (!read)
    return 0;
  LINEGATE_EXPECT(read->name.size() <= 256 && read->host.size() <= 256);
  LINEGATE_EXPECT(read->authority.size() <= 256);
  for (const UdpLocator& locator : read->unicast)
    LINEGATE_EXPECT(is_sound(locator));
  check_written(*read);
  return 0;
}
