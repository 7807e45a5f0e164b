// SPDX-License-Identifier: Apache-2.0
#include <charconv>

#include "gateway/config/patch.h"
#include "gateway/config/sections.h"
#include "gateway/config/value.h"
#include "stack/can/cob_id.h"
#include "stack/pdo/described_cob_id.h"
#include "stack/pdo/mpdo.h"
#include "stack/pdo/parameters.h"

namespace linegate::config {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr std::uint8_t kInhibitTime = 3;      // sub-index
constexpr std::uint16_t kLastDummy = 0x0007;  // CiA 301 7.4.1: data types as dummy entries

// One `tpdoN:` or `rpdoN:`. The writes follow the order of CiA 301 7.5.2.36 and 7.5.2.38: make the
// PDO invalid, change parameters and mapping, make it valid.
class Override {
 public:
  Override(Findings& findings, const YAML::Node& key, const YAML::Node& value, PdoName pdo,
           line::NodeConfig& config, std::size_t longest)
      : findings_(findings),
        config_(config),
        longest_(longest),
        pdo_(pdo),
        place_(place_of(key)),
        value_(value),
        section_(findings, value, key.Scalar()) {}

  void apply() {
    if (read_queue()) {
      section_.done();
      return;
    }
    if (config_.device.find({pdo_.communication(), 1}) == nullptr) {
      findings_.error(place_, config_.device.file + " has no object " +
                                  format_address({pdo_.communication(), 1}));
      return;
    }
    const std::uint32_t raw = pdo::described_cob_id(config_.device, kind(), pdo_.number).raw;
    const std::uint32_t wanted = read_rtr(read_cob_id(raw));
    write({pdo_.communication(), 1}, wanted | can::CobId::kInvalidBit, place_);
    read_type();
    read_times();
    read_mapping();
    section_.done();
    if ((wanted & can::CobId::kInvalidBit) == 0) {
      write({pdo_.communication(), 1}, wanted, place_);
    }
  }

 private:
  void write(od::Address address, std::uint64_t value, Place place) {
    auto* variable = find_variable(config_.device, address);
    if (variable == nullptr) {
      findings_.error(place, config_.device.file + " has no object " + format_address(address));
      return;
    }
    auto data = little_endian(value, od::byte_size(variable->type));
    set_value(config_.device, address, data);
    config_.objects.push_back({address, std::move(data)});
  }

  pdo::PdoKind kind() const { return pdo_.transmit ? pdo::PdoKind::tpdo : pdo::PdoKind::rpdo; }

  std::uint32_t read_cob_id(std::uint32_t raw) {
    bool enabled = true;
    section_.read("enabled", enabled);
    const YAML::Node node = section_.find("cob_id");
    if (const auto id = section_.number(node, 1, 0x7FF)) {
      if (can::is_restricted(static_cast<std::uint32_t>(*id))) {
        findings_.error(place_of(node), "the identifier " + node.Scalar() +
                                            " is reserved for another service (CiA 301, 7.3.5)");
      }
      raw = (raw & can::CobId::kNoRtrBit) | static_cast<std::uint32_t>(*id);
    }
    if (enabled && (raw & can::CobId::kExtendedBit) == 0 && (raw & 0x7FFU) == 0) {
      findings_.error(place_,
                      config_.device.file + " gives no identifier for it: cob_id is needed");
    }
    const std::uint32_t valid = raw & ~can::CobId::kInvalidBit;
    return enabled ? valid : valid | can::CobId::kInvalidBit;
  }

  // Returns true if no other key is present, so that nothing is changed at the device.
  bool read_queue() {
    if (!pdo_.transmit) {
      return false;
    }
    if (const auto queue = read_pdo_queue(section_)) {
      config_.tpdo_queue[pdo_.number] = *queue;
    }
    const std::size_t keys = (section_.find("every").IsDefined() ? 1U : 0U) +
                             (section_.find("queue").IsDefined() ? 1U : 0U);
    return keys != 0 && keys == value_.size();
  }

  std::uint32_t read_rtr(std::uint32_t raw) {
    bool rtr = (raw & can::CobId::kNoRtrBit) == 0;
    section_.read("rtr", rtr);
    return rtr ? raw & ~can::CobId::kNoRtrBit : raw | can::CobId::kNoRtrBit;
  }

  void read_type() {
    const YAML::Node node = section_.find("type");
    if (!node.IsDefined()) {
      return;
    }
    if (const auto type = read_transmission_type(section_, node)) {
      write({pdo_.communication(), 2}, *type, place_of(node));
    }
  }

  // The sender, here the line, keeps the inhibit time of an RPDO of the device.
  void read_times() {
    const auto read = [&](const char* key, std::uint8_t sub, Duration unit) {
      const YAML::Node node = section_.find(key);
      if (node.IsDefined()) {
        Duration time{};
        section_.read_multiple(key, time, unit, 65'535 * unit);
        if (sub == kInhibitTime && !pdo_.transmit) {
          config_.rpdo_inhibit[pdo_.number] = time;
          return;
        }
        write({pdo_.communication(), sub}, static_cast<std::uint64_t>(time / unit), place_of(node));
      }
    };
    read("inhibit", kInhibitTime, microseconds(100));
    read("event_timer", 5, milliseconds(1));
  }

  void read_mapping() {
    const YAML::Node node = section_.find("map");
    const YAML::Node mpdo = section_.find("mpdo");
    std::uint8_t mode = 0;
    section_.choose<std::uint8_t>(
        mpdo, mode, {{"source", pdo::kSourceMode}, {"destination", pdo::kDestinationMode}});
    if (!node.IsDefined() && !mpdo.IsDefined()) {
      return;
    }
    if (!config_.device.dynamic_mapping) {
      findings_.error(place_of(node), config_.device.file +
                                          " does not allow changes of the mapping (Granularity=0)");
      return;
    }
    std::vector<pdo::Mapping> mapping;
    unsigned bits = 0;
    for (const YAML::Node& element : elements(findings_, node, "map")) {
      if (const auto mapped = read_mapped(element)) {
        mapping.push_back(*mapped);
        bits += mapped->bits;
      }
    }
    if (bits > longest_) {
      findings_.error(place_of(node), "the objects have " + std::to_string(bits) +
                                          " bits; a PDO has room for " + std::to_string(longest_));
    }
    const std::size_t wanted = pdo_.transmit && mode == pdo::kDestinationMode ? 1 : 0;
    if (mode != 0 && mapping.size() != wanted) {
      findings_.error(place_, wanted == 1
                                  ? "a TPDO in destination address mode maps the one object whose "
                                    "value it sends"
                                  : "this MPDO maps nothing: leave out map");
    }
    write({pdo_.mapping(), 0}, 0, place_);
    for (std::size_t i = 0; i < mapping.size() && i < pdo::kMaxMapped; ++i) {
      write({pdo_.mapping(), static_cast<std::uint8_t>(i + 1)}, mapping[i].raw(), place_);
    }
    write({pdo_.mapping(), 0}, mode != 0 ? mode : mapping.size(), place_);
  }

  std::optional<pdo::Mapping> read_mapped(const YAML::Node& element) {
    const auto text = section_.text(element);
    if (!text) {
      return std::nullopt;
    }
    const auto address = parse_address(*text);
    if (!address) {
      findings_.error(place_of(element),
                      "expected an object such as 6000:1, got \"" + *text + "\"");
      return std::nullopt;
    }
    if (!pdo_.transmit && address->index <= kLastDummy && address->index != 0) {
      const auto bits = od::bit_size(static_cast<od::DataType>(address->index));
      return pdo::Mapping{*address, static_cast<std::uint8_t>(bits)};
    }
    const auto* variable = config_.device.find(*address);
    if (variable == nullptr) {
      findings_.error(place_of(element),
                      config_.device.file + " has no object " + format_address(*address));
      return std::nullopt;
    }
    const bool direction =
        pdo_.transmit ? od::tpdo_mappable(variable->access) : od::rpdo_mappable(variable->access);
    if (!variable->mappable || !direction) {
      findings_.error(place_of(element), "object " + format_address(*address) + " (" +
                                             variable->name + ") cannot be mapped into " +
                                             (pdo_.transmit ? "a TPDO" : "an RPDO"));
      return std::nullopt;
    }
    return pdo::Mapping{*address, static_cast<std::uint8_t>(od::bit_size(variable->type))};
  }

  Findings& findings_;
  line::NodeConfig& config_;
  std::size_t longest_;  // PDO, in bits
  PdoName pdo_;
  Place place_;
  YAML::Node value_;
  Section section_;
};

}  // namespace

// "tpdo1" .. "tpdo512", "rpdo1" .. "rpdo512".
std::optional<PdoName> parse_pdo_name(const std::string& text) {
  PdoName name;
  name.transmit = text.starts_with("tpdo");
  if (!name.transmit && !text.starts_with("rpdo")) {
    return std::nullopt;
  }
  const char* end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data() + 4, end, name.number);
  const bool good = parsed.ec == std::errc{} && parsed.ptr == end && name.number >= 1 &&
                    name.number <= pdo::kMaxPdo;
  return good ? std::optional(name) : std::nullopt;
}

std::optional<std::uint8_t> read_transmission_type(Section& section, const YAML::Node& node) {
  std::uint8_t type = 0;
  if (!node.IsScalar() || !parse_unsigned(node.Scalar())) {
    const std::size_t before = section.findings().errors();
    section.choose<std::uint8_t>(
        node, type,
        {{"sync", 1}, {"sync_acyclic", pdo::kSyncAcyclic}, {"event", pdo::kEventProfile}});
    return section.findings().errors() == before ? std::optional(type) : std::nullopt;
  }
  const auto number = section.number(node, 0, 255);
  if (!number || (*number > 240 && *number < 252)) {
    section.findings().error(place_of(node),
                             "transmission types 241 to 251 are reserved (CiA 301)");
    return std::nullopt;
  }
  return static_cast<std::uint8_t>(*number);
}

std::optional<std::uint32_t> read_pdo_queue(Section& section) {
  constexpr std::uint32_t kLongestQueue = 16'384;
  bool every = false;
  std::uint32_t queue = 64;
  section.read("every", every);
  section.read_number("queue", queue, 1, kLongestQueue);
  const YAML::Node length = section.find("queue");
  if (length.IsDefined() && !every) {
    section.findings().error(place_of(length), "queue needs every: true");
  }
  if (!section.find("every").IsDefined()) {
    return std::nullopt;
  }
  return every ? queue : 0;
}

void read_pdos(Findings& findings, const YAML::Node& node, line::NodeConfig& config,
               std::size_t longest_pdo) {
  if (!node.IsDefined()) {
    return;
  }
  Section section(findings, node, "pdos");
  if (!section.valid()) {
    return;
  }
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) {
      continue;  // already reported by the section
    }
    section.find(pair.first.Scalar());
    const auto pdo = parse_pdo_name(pair.first.Scalar());
    if (!pdo) {
      findings.error(place_of(pair.first), "expected tpdo1 to tpdo512 or rpdo1 to rpdo512, got \"" +
                                               pair.first.Scalar() + "\"");
      continue;
    }
    Override(findings, pair.first, pair.second, *pdo, config, longest_pdo).apply();
  }
  section.done();
}

}  // namespace linegate::config
