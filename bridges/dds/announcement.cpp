// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/announcement.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include "bridges/dds/guard/submessages.h"

namespace linegate::dds {
namespace {

using guard::Wire;

// Parameters of RTPS 2.3 table 9.13 and DDS-Security 1.1 table 14.
enum Parameter : std::uint16_t {
  kSentinelParameter = 0x0001,
  kLeaseParameter = 0x0002,
  kDomainParameter = 0x000F,
  kVersionParameter = 0x0015,
  kVendorParameter = 0x0016,
  kDefaultUnicastParameter = 0x0031,
  kMetatrafficUnicastParameter = 0x0032,
  kParticipantParameter = 0x0050,
  kBuiltinParameter = 0x0058,
  kPropertiesParameter = 0x0059,
  kNameParameter = 0x0062,
  kKeyHashParameter = 0x0070,
  kStatusParameter = 0x0071,
  kIdentityParameter = 0x1001,
};

constexpr std::size_t kLongestAnnounced = 256;
constexpr std::size_t kMostLocators = 16;
constexpr std::uint32_t kUdpV4 = 1;  // LOCATOR_KIND_UDPv4
constexpr std::uint32_t kParticipantEntity = 0x000001C1;
// Announces and detects participants (RTPS 2.3 table 9.4).
constexpr std::uint32_t kNoEndpoints = 0x3;

// Reads CDR within the octets of one parameter. After the first failure everything is empty.
class Text {
 public:
  explicit Text(const Wire& wire) : wire_(wire) {}

  std::uint32_t number() {
    at_ = guard::align4(at_);
    if (!ok_ || at_ > wire_.size() || wire_.size() - at_ < 4) {
      ok_ = false;
      return 0;
    }
    const std::uint32_t out = wire_.u32(at_);
    at_ += 4;
    return out;
  }
  std::string string() {
    const std::size_t length = number();
    if (!ok_ || length > wire_.size() - at_) {
      ok_ = false;
      return {};
    }
    std::string out;
    for (std::size_t i = 0; i < std::min(length, kLongestAnnounced) && wire_.u8(at_ + i) != 0; ++i)
      out += static_cast<char>(wire_.u8(at_ + i));
    at_ += length;
    return out;
  }
  // Calls use(name, value) for each element.
  template <class Use>
  void properties(Use use) {
    const std::uint32_t count = number();
    for (std::uint32_t i = 0; ok_ && i < count; ++i) {
      const std::string name = string();
      const std::string value = string();
      if (ok_)
        use(name, value);
    }
  }

 private:
  Wire wire_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

void read_locator(const Wire& value, std::vector<UdpLocator>& out) {
  if (value.size() < 24 || value.u32(0) != kUdpV4 || out.size() >= kMostLocators)
    return;
  const std::uint32_t port = value.u32(4);
  std::string address;
  for (std::size_t i = 20; i < 24; ++i)
    address += (address.empty() ? "" : ".") + std::to_string(unsigned{value.u8(i)});
  if (port >= 1 && port <= 0xFFFF)
    out.push_back({std::move(address), static_cast<std::uint16_t>(port)});
}

void read_parameter(std::uint16_t id, const Wire& value, Announcement& out) {
  switch (id) {
    case kNameParameter:
      out.name = Text(value).string();
      break;
    case kDomainParameter:
      if (value.size() >= 4)
        out.domain = value.u32(0);
      break;
    case kMetatrafficUnicastParameter:
      read_locator(value, out.unicast);
      break;
    case kPropertiesParameter:
      Text(value).properties([&](std::string_view name, std::string_view property) {
        if (name == "fastdds.physical_data.host")  // "name:number"
          out.host = property.substr(0, property.find(':'));
      });
      break;
    case kIdentityParameter: {
      out.secured = true;
      Text token(value);
      (void)token.string();  // class of the token
      token.properties([&](std::string_view name, std::string_view property) {
        if (name == "dds.ca.sn")
          out.authority = property;
      });
      break;
    }
    default:
      break;
  }
}

// A parameter list behind its encapsulation header.
void read_parameters(const Wire& payload, Announcement& out) {
  if (payload.size() < 4 || payload.u8(0) != 0 || (payload.u8(1) != 2 && payload.u8(1) != 3))
    return;  // neither PL_CDR_BE nor PL_CDR_LE
  const Wire list(payload.octets().subspan(4), payload.u8(1) == 3);
  for (std::size_t at = 0; list.size() - at >= 4;) {
    const std::uint16_t id = list.u16(at);
    const std::size_t length = list.u16(at + 2);
    at += 4;
    if (id == kSentinelParameter || length > list.size() - at)
      return;
    read_parameter(id, list.part(at, length), out);
    at += length;
  }
}

// Builds a little-endian datagram.
class Datagram {
 public:
  std::vector<std::uint8_t> take() { return std::move(octets_); }
  std::size_t size() const { return octets_.size(); }
  void u8(unsigned value) { octets_.push_back(static_cast<std::uint8_t>(value)); }
  void u16(unsigned value) {
    u8(value & 0xFFU);
    u8(value >> 8U & 0xFFU);
  }
  void u32(std::uint32_t value) {
    u16(value & 0xFFFFU);
    u16(value >> 16U);
  }
  void entity(std::uint32_t value) {
    for (const unsigned shift : {24U, 16U, 8U, 0U})
      u8(value >> shift & 0xFFU);
  }
  void octets(std::span<const std::uint8_t> value) {
    octets_.insert(octets_.end(), value.begin(), value.end());
  }
  void parameter(unsigned id, unsigned length) {
    u16(id);
    u16(length);
  }
  void guid_parameter(unsigned id, const ObservedPrefix& prefix) {
    parameter(id, 16);
    octets(prefix);
    entity(kParticipantEntity);
  }
  void locator_parameter(unsigned id, const UdpLocator& locator) {
    parameter(id, 24);
    u32(kUdpV4);
    u32(locator.port);
    for (int i = 0; i < 12; ++i)
      u8(0);
    unsigned octet = 0;
    for (const char c : locator.address + ".") {
      if (c == '.') {
        u8(octet);
        octet = 0;
      } else {
        octet = octet * 10 + static_cast<unsigned>(c - '0');
      }
    }
  }
  void string_parameter(unsigned id, std::string_view text) {
    const auto length = static_cast<std::uint32_t>(text.size() + 1);
    parameter(id, static_cast<unsigned>(4 + guard::align4(length)));
    u32(length);
    for (const char c : text)
      u8(static_cast<std::uint8_t>(c));
    for (std::size_t i = text.size(); i < guard::align4(length); ++i)
      u8(0);
  }
  void set_u16(std::size_t at, std::size_t value) {
    octets_[at] = static_cast<std::uint8_t>(value & 0xFFU);
    octets_[at + 1] = static_cast<std::uint8_t>(value >> 8U & 0xFFU);
  }

 private:
  std::vector<std::uint8_t> octets_;
};

void write_list(const Announcement& it, std::uint32_t lease, Datagram& out) {
  out.parameter(kVersionParameter, 4);
  out.u32(0x0302);  // 2.3
  out.parameter(kVendorParameter, 4);
  out.u32(0);  // unknown
  out.guid_parameter(kParticipantParameter, it.prefix);
  out.locator_parameter(kMetatrafficUnicastParameter, it.unicast.front());
  out.locator_parameter(kDefaultUnicastParameter, it.unicast.front());
  out.parameter(kLeaseParameter, 8);
  out.u32(lease);
  out.u32(0);
  out.parameter(kBuiltinParameter, 4);
  out.u32(kNoEndpoints);
  out.string_parameter(kNameParameter, it.name);
  out.parameter(kSentinelParameter, 0);
}

}  // namespace

std::optional<Announcement> read_announcement(std::span<const std::uint8_t> datagram) {
  if (!guard::has_header(datagram))
    return std::nullopt;
  for (std::size_t at = guard::kHeader; at < datagram.size();) {
    guard::Submessage submessage;
    guard::Content content;
    if (guard::split(datagram, at, submessage) != guard::Reason::none)
      return std::nullopt;
    if (submessage.kind == guard::Kind::data) {
      if (guard::check(submessage, content) != guard::Reason::none)
        return std::nullopt;
      if (content.writer == guard::entity::kParticipants) {
        Announcement out;
        std::copy_n(datagram.begin() + 8, out.prefix.size(), out.prefix.begin());
        out.leaving = content.has_key || content.ends_instance;
        if (!out.leaving)
          read_parameters(content.payload, out);
        return out;
      }
    }
    at = guard::align4(at + 4 + submessage.body.size());
    if (submessage.open_end)
      break;
  }
  return std::nullopt;
}

std::vector<std::uint8_t> write_announcement(const Announcement& it, std::uint32_t lease) {
  constexpr unsigned kLittle = 0x01;
  constexpr unsigned kInlineQos = 0x02;
  constexpr unsigned kData = 0x04;
  constexpr unsigned kKey = 0x08;
  Datagram out;
  for (const char c : std::string_view("RTPS"))
    out.u8(static_cast<std::uint8_t>(c));
  out.u16(0x0302);
  out.u16(0);
  out.octets(it.prefix);
  out.u8(static_cast<unsigned>(guard::Kind::data));
  out.u8(kLittle | (it.leaving ? kInlineQos | kKey : kData));
  const std::size_t length_at = out.size();
  out.u16(0);
  out.u16(0);
  out.u16(16);  // octets to the inline QoS
  out.entity(0x000100C7);
  out.entity(guard::entity::kParticipants);
  out.u32(0);
  out.u32(it.leaving ? 2 : 1);
  if (it.leaving) {
    out.guid_parameter(kKeyHashParameter, it.prefix);
    out.parameter(kStatusParameter, 4);
    out.entity(0x3);  // disposed and unregistered, big-endian
    out.parameter(kSentinelParameter, 0);
  }
  out.u16(0x0300);  // PL_CDR_LE
  out.u16(0);
  if (it.leaving) {
    out.guid_parameter(kParticipantParameter, it.prefix);
    out.parameter(kSentinelParameter, 0);
  } else {
    write_list(it, lease, out);
  }
  out.set_u16(length_at, out.size() - length_at - 2);
  return out.take();
}

}  // namespace linegate::dds
