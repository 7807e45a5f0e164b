// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/parameters.h"

#include <algorithm>
#include <array>

namespace linegate::dds::guard {
namespace {

constexpr std::size_t kLongestList = 4096;  // parameters of one list

// Reads CDR: strings and sequences, each aligned to 4. ok() is false as soon as one exceeds the
// available octets.
class Walk {
 public:
  explicit Walk(const Wire& wire, std::size_t at = 0) : wire_(wire), at_(at) {}

  bool ok() const { return ok_; }
  std::size_t left() const { return wire_.size() - at_; }

  void skip(std::size_t size) {
    ok_ = ok_ && size <= left();
    if (ok_)
      at_ += size;
  }
  std::uint32_t u32() {
    align();
    const std::size_t at = at_;
    skip(4);
    return ok_ ? wire_.u32(at) : 0;
  }
  // A sequence of octets.
  void octets() { skip(u32()); }
  // The length includes the terminating NUL (DDS-XTypes 1.2 7.4.1.1.2), up to which Fast DDS reads.
  void string() {
    const std::size_t length = u32();
    skip(length);
    ok_ = ok_ && length != 0 && wire_.u8(at_ - 1) == 0;
  }
  // A sequence whose elements take at least `smallest` octets each.
  template <class Element>
  void sequence(std::size_t smallest, Element element) {
    const std::size_t count = u32();
    ok_ = ok_ && count <= left() / smallest;
    for (std::size_t i = 0; ok_ && i < count; ++i)
      element();
  }
  void strings() {
    sequence(5, [this] { string(); });
  }
  // Sequence of Property_t or BinaryProperty_t: a name and a value. With the shortest name and
  // value and their padding an element has 16 octets, without the padding at the end.
  void properties() {
    sequence(13, [this] {
      octets();
      octets();
    });
  }
  // DataHolder (DDS-Security 1.1 7.2.3): class, properties, binary properties.
  void data_holder() {
    octets();
    properties();
    properties();
  }

 private:
  void align() {
    const std::size_t aligned = align4(at_);
    skip(aligned - at_);
  }

  Wire wire_;
  std::size_t at_;
  bool ok_ = true;
};

enum class Shape {
  fixed,
  octets,
  string,
  strings,
  numbers2,  // a sequence of numbers of 2 octets
  numbers8,
  properties,
  data_holder,
  filter
};

struct Rule {
  std::uint16_t id;
  Shape shape;
  std::uint16_t size = 0;  // fixed: minimum number of octets
};

// RTPS 2.3 table 9.13, DDS-Security 1.1 table 14, DDS-XTypes 1.2 7.6.3.
constexpr std::array<Rule, 54> kRules = {{
    {0x0002, Shape::fixed, 8},     // participant lease duration
    {0x0004, Shape::fixed, 8},     // time-based filter
    {0x0005, Shape::string},       // topic name
    {0x0006, Shape::fixed, 4},     // ownership strength
    {0x0007, Shape::string},       // type name
    {0x000B, Shape::fixed, 4},     // metatraffic multicast IP address
    {0x000C, Shape::fixed, 4},     // default unicast IP address
    {0x000D, Shape::fixed, 4},     // metatraffic unicast port
    {0x000E, Shape::fixed, 4},     // default unicast port
    {0x0011, Shape::fixed, 4},     // multicast IP address
    {0x0015, Shape::fixed, 2},     // protocol version
    {0x0016, Shape::fixed, 2},     // vendor
    {0x001A, Shape::fixed, 12},    // reliability
    {0x001B, Shape::fixed, 12},    // liveliness
    {0x001D, Shape::fixed, 4},     // durability
    {0x001E, Shape::fixed, 24},    // durability service
    {0x001F, Shape::fixed, 4},     // ownership
    {0x0021, Shape::fixed, 8},     // presentation
    {0x0023, Shape::fixed, 8},     // deadline
    {0x0025, Shape::fixed, 4},     // destination order
    {0x0027, Shape::fixed, 8},     // latency budget
    {0x0029, Shape::strings},      // partition
    {0x002B, Shape::fixed, 8},     // lifespan
    {0x002C, Shape::octets},       // user data
    {0x002D, Shape::octets},       // group data
    {0x002E, Shape::octets},       // topic data
    {0x002F, Shape::fixed, 24},    // unicast locator
    {0x0030, Shape::fixed, 24},    // multicast locator
    {0x0031, Shape::fixed, 24},    // default unicast locator
    {0x0032, Shape::fixed, 24},    // metatraffic unicast locator
    {0x0033, Shape::fixed, 24},    // metatraffic multicast locator
    {0x0034, Shape::fixed, 4},     // manual liveliness count
    {0x0035, Shape::filter},       // content filter property
    {0x0040, Shape::fixed, 8},     // history
    {0x0041, Shape::fixed, 12},    // resource limits
    {0x0043, Shape::fixed, 1},     // expects inline QoS
    {0x0044, Shape::fixed, 4},     // builtin endpoints
    {0x0048, Shape::fixed, 24},    // default multicast locator
    {0x0049, Shape::fixed, 4},     // transport priority
    {0x0050, Shape::fixed, 16},    // participant GUID
    {0x0052, Shape::fixed, 16},    // group GUID
    {0x0058, Shape::fixed, 4},     // builtin endpoint set
    {0x0059, Shape::properties},   // property list
    {0x005A, Shape::fixed, 16},    // endpoint GUID
    {0x0062, Shape::string},       // entity name
    {0x0070, Shape::fixed, 16},    // key hash
    {0x0071, Shape::fixed, 4},     // status info
    {0x0073, Shape::numbers2},     // data representation
    {0x0074, Shape::fixed, 2},     // type consistency enforcement
    {0x1001, Shape::data_holder},  // identity token
    {0x1002, Shape::data_holder},  // permissions token
    {0x1006, Shape::data_holder},  // identity status token
    {0x8002, Shape::fixed, 16},    // persistence GUID, of Fast DDS
    {0x8006, Shape::numbers8},     // data sharing domains, of Fast DDS
}};

constexpr std::uint16_t kLease = 0x0002;
constexpr std::uint16_t kReliability = 0x001A;
constexpr std::uint16_t kParticipantGuid = 0x0050;
constexpr std::uint16_t kEndpointGuid = 0x005A;
constexpr std::uint16_t kKeyHash = 0x0070;
constexpr std::uint16_t kStatusInfo = 0x0071;
constexpr std::uint16_t kTypeId = 0x0069;
constexpr std::uint16_t kTypeObject = 0x0072;
constexpr std::uint16_t kTypeInformation = 0x0075;
constexpr std::uint8_t kPad = 0;
constexpr std::uint16_t kPersistenceGuid = 0x8002;
constexpr std::uint8_t kEnds = 0x03;    // disposed, unregistered
constexpr std::uint32_t kReliable = 2;  // RTPS 2.3 9.3.2.7 ReliabilityKind_t

bool check_shape(const Rule& rule, const Wire& value) {
  Walk walk(value);
  switch (rule.shape) {
    case Shape::fixed:
      return value.size() >= rule.size;
    case Shape::octets:
      walk.octets();
      return walk.ok();
    case Shape::string:
      walk.string();
      return walk.ok();
    case Shape::strings:
      walk.strings();
      return walk.ok();
    case Shape::numbers2:
      walk.sequence(2, [&] { walk.skip(2); });
      return walk.ok();
    case Shape::numbers8:
      walk.sequence(8, [&] { walk.skip(8); });
      return walk.ok();
    case Shape::properties:
      walk.properties();
      return walk.ok();
    case Shape::data_holder:
      walk.data_holder();
      return walk.ok();
    case Shape::filter:  // name, related topic, filter class, expression, parameters
      for (int i = 0; i < 4; ++i)
        walk.string();
      walk.strings();
      return walk.ok();
  }
  return false;
}

bool check_parameter(std::uint16_t id, const Wire& value) {
  const auto* const rule =
      std::lower_bound(kRules.begin(), kRules.end(), id,
                       [](const Rule& it, std::uint16_t wanted) { return it.id < wanted; });
  return rule == kRules.end() || rule->id != id || check_shape(*rule, value);
}

Guid guid_in(const Wire& value) {
  Guid out{};
  std::copy_n(value.octets().begin(), out.size(), out.begin());
  return out;
}

// Calls each(id, value) until it returns false. Returns the octets of the list, including the
// sentinel; 0 if the list is malformed or each() returned false. Fast DDS reads neither the length
// of a sentinel nor the octets after it.
template <class Each>
std::size_t walk_list(const Wire& list, Each each) {
  std::size_t at = 0;
  for (std::size_t count = 0; count < kLongestList; ++count) {
    if (list.size() - at < kParameterHeader)
      return 0;
    const std::uint16_t id = list.u16(at);
    const std::size_t length = list.u16(at + 2);
    at += kParameterHeader;
    if (id == kSentinel)
      return at;
    if (length > list.size() - at || length % 4 != 0 || !each(id, list.part(at, length)))
      return 0;
    at += length;
  }
  return 0;
}

// The payload in the octet order of the encapsulation header (RTPS 2.3 10.2); nothing if the
// encapsulation is unknown.
std::optional<Wire> encapsulated(const Wire& payload, unsigned big_endian) {
  if (payload.size() < 4 || payload.u8(0) != 0)
    return std::nullopt;
  const unsigned representation = payload.u8(1);
  if (representation != big_endian && representation != big_endian + 1)
    return std::nullopt;
  return Wire(payload.octets().subspan(4), representation == big_endian + 1);
}

// Replaces the IDs for which which(id) is true by that of padding.
template <class Which>
void pad(std::span<std::uint8_t> list, bool little, Which which) {
  each_parameter(Wire(list, little), [&](std::size_t at, std::uint16_t id, const Wire&) {
    if (which(id))
      list[at] = list[at + 1] = kPad;
  });
}

constexpr unsigned kCdr = 0;            // CDR_BE, then CDR_LE
constexpr unsigned kParameterList = 2;  // PL_CDR_BE, then PL_CDR_LE

}  // namespace

InlineQos read_inline_qos(const Wire& rest) {
  InlineQos out;
  out.length = walk_list(rest, [&](std::uint16_t id, const Wire& value) {
    if (!check_parameter(id, value))
      return false;
    if (id == kStatusInfo && (value.u8(3) & kEnds) != 0)  // big endian in both octet orders
      out.ends_instance = true;
    if (id == kKeyHash) {
      out.key = guid_in(value);
      out.instance.add(prefix_of(*out.key));
    }
    return true;
  });
  return out;
}

bool check_parameter_list(const Wire& payload, Announcement& out) {
  const auto list = encapsulated(payload, kParameterList);
  if (!list)
    return false;
  out.list = *list;
  return walk_list(*list, [&](std::uint16_t id, const Wire& value) {
           if (!check_parameter(id, value))
             return false;
           if (id == kLease)
             out.lease = value.u32(0);
           if (id == kPersistenceGuid)
             out.persistence = guid_in(value);
           if (id == kReliability)
             out.reliable = value.u32(0) == kReliable;
           // Fast DDS accepts either as the GUID.
           if (id == kEndpointGuid || id == kKeyHash)
             out.endpoint = guid_in(value);
           if (id == kParticipantGuid || id == kEndpointGuid || id == kKeyHash)
             out.owner.add(prefix_of(guid_in(value)));
           return true;
         }) != 0;
}

void pad_types(std::span<std::uint8_t> list, bool little) {
  pad(list, little, [](std::uint16_t id) {
    return id == kTypeId || id == kTypeObject || id == kTypeInformation;
  });
}

void pad_key_hash(std::span<std::uint8_t> list, bool little) {
  pad(list, little, [](std::uint16_t id) { return id == kKeyHash; });
}

// Participant prefix, kind, sequence of octets. Fast DDS sends it with the encapsulation of a
// parameter list, although it is not one.
bool check_liveliness_message(const Wire& payload) {
  auto message = encapsulated(payload, kCdr);
  if (!message)
    message = encapsulated(payload, kParameterList);
  if (!message)
    return false;
  Walk walk(*message);
  walk.skip(16);
  walk.octets();
  return walk.ok();
}

// Two MessageIdentity (GUID and number), three GUIDs, class, sequence of DataHolder.
bool check_stateless_message(const Wire& payload) {
  const auto message = encapsulated(payload, kCdr);
  if (!message)
    return false;
  Walk walk(*message);
  walk.skip(2 * 24 + 3 * 16);
  walk.octets();
  walk.sequence(12, [&] { walk.data_holder(); });
  return walk.ok();
}

}  // namespace linegate::dds::guard
