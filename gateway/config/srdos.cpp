// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>

#include "gateway/config/patch.h"
#include "gateway/config/sections.h"
#include "gateway/config/value.h"
#include "stack/base/byte_order.h"
#include "stack/srdo/parameters.h"

namespace linegate::config {
namespace {

using std::chrono::milliseconds;

constexpr Duration kLongestCycle = milliseconds(0xFFFF);     // 16 bits of ms
constexpr Duration kLongestValidation = milliseconds(0xFF);  // 8 bits of ms

// One `srdoN:`. The line brings the writes into the order of EN 50325-5, see srdo::order_writes().
class SrdoOverride {
 public:
  SrdoOverride(Findings& findings, const YAML::Node& key, const YAML::Node& value,
               std::uint8_t number, line::NodeConfig& config)
      : findings_(findings),
        config_(config),
        number_(number),
        record_(srdo::communication_record(number)),
        place_(place_of(key)),
        section_(findings, value, key.Scalar()) {}

  void apply() {
    if (config_.device.find({record_, srdo::kDirection}) == nullptr) {
      findings_.error(place_, config_.device.file + " has no object " +
                                  format_address({record_, srdo::kDirection}));
      return;
    }
    read_direction();
    read_times();
    if (const auto id =
            section_.number(section_.find("cob_id"), srdo::kFirstCobId, srdo::kLastCobId)) {
      write(srdo::kCobId, *id, place_);
      write(srdo::kInvertedCobId, *id + 1, place_);
    }
    read_mapping();
    section_.done();
  }

 private:
  void write(std::uint8_t sub, std::uint64_t value, Place place) {
    write_object({record_, sub}, value, place);
  }

  void write_object(od::Address address, std::uint64_t value, Place place) {
    const auto* variable = find_variable(config_.device, address);
    if (variable == nullptr) {
      findings_.error(place, config_.device.file + " has no object " + format_address(address));
      return;
    }
    auto data = little_endian(value, od::byte_size(variable->type));
    set_value(config_.device, address, data);
    config_.objects.push_back({address, std::move(data)});
  }

  srdo::Direction direction() const {
    const auto* variable = config_.device.find(od::Address{record_, srdo::kDirection});
    return static_cast<srdo::Direction>(load_le(std::span<const std::byte>(variable->value)));
  }

  void read_direction() {
    const YAML::Node node = section_.find("direction");
    if (node.IsDefined()) {
      auto direction = srdo::Direction::off;
      section_.choose<srdo::Direction>(node, direction,
                                       {{"off", srdo::Direction::off},
                                        {"transmit", srdo::Direction::transmit},
                                        {"receive", srdo::Direction::receive}});
      write(srdo::kDirection, static_cast<std::uint64_t>(direction), place_of(node));
    }
  }

  // Sub-index 2 is the refresh time of an SRDO that the device transmits: SCT and SRVT are then
  // those of the receiver, here the line.
  void read_times() {
    const bool transmits = direction() == srdo::Direction::transmit;
    if (const YAML::Node refresh = section_.find("refresh"); refresh.IsDefined()) {
      if (!transmits) {
        findings_.error(place_of(refresh), "refresh is for an SRDO that the device transmits");
      }
      if (const auto time = read_time("refresh", kLongestCycle)) {
        write_time(srdo::kCycleTime, *time, place_of(refresh));
      }
    }
    read_monitored("sct", srdo::kCycleTime, kLongestCycle,
                   transmits ? &config_.srdo_cycle : nullptr);
    read_monitored("srvt", srdo::kValidationTime, kLongestValidation,
                   transmits ? &config_.srdo_validation : nullptr);
  }

  // of_line: nullptr = the time is that of the device.
  void read_monitored(const char* key, std::uint8_t sub, Duration longest,
                      std::map<std::uint8_t, Duration>* of_line) {
    const Place place = place_of(section_.find(key));
    const auto time = read_time(key, longest);
    if (time && of_line != nullptr) {
      (*of_line)[number_] = *time;
    } else if (time) {
      write_time(sub, *time, place);
    }
  }

  // Nothing, after an error if it is not in the range, without the key.
  std::optional<Duration> read_time(const char* key, Duration longest) {
    const YAML::Node node = section_.find(key);
    if (!node.IsDefined()) {
      return std::nullopt;
    }
    const std::size_t before = findings_.errors();
    Duration time{};
    section_.read_multiple(key, time, milliseconds(1), longest);
    if (findings_.errors() == before && time == Duration::zero()) {
      findings_.error(place_of(node),
                      std::string(key) + " is 0: give 1ms to " + format_duration(longest));
    }
    return findings_.errors() == before ? std::optional(time) : std::nullopt;
  }

  void write_time(std::uint8_t sub, Duration time, Place place) {
    write(sub, static_cast<std::uint64_t>(time / milliseconds(1)), place);
  }

  void read_mapping() {
    const YAML::Node node = section_.find("map");
    if (!node.IsDefined()) {
      return;
    }
    const std::uint16_t record = srdo::mapping_record(number_);
    std::uint8_t count = 0;
    for (const YAML::Node& element : elements(findings_, node, "map")) {
      const auto text = section_.text(element);
      const auto address = text ? parse_address(*text) : std::nullopt;
      const auto* variable = address ? config_.device.find(*address) : nullptr;
      if (text && !address) {
        findings_.error(place_of(element),
                        "expected an object such as 6000:1, got \"" + *text + "\"");
      } else if (text && variable == nullptr) {
        findings_.error(place_of(element),
                        config_.device.file + " has no object " + format_address(*address));
      }
      if (variable == nullptr || count == srdo::kMaxMapped) {
        continue;
      }
      const auto bits = static_cast<std::uint8_t>(od::bit_size(variable->type));
      write_object({record, ++count}, pdo::Mapping{*address, bits}.raw(), place_of(element));
    }
    if (node.size() % 2 != 0 || node.size() == 0 || node.size() > srdo::kMaxMapped) {
      findings_.error(place_of(node),
                      "an SRDO maps 2 to 16 objects: each is followed by its inverted object");
    }
    write_object({record, 0}, count, place_of(node));
  }

  Findings& findings_;
  line::NodeConfig& config_;
  std::uint8_t number_;
  std::uint16_t record_;
  Place place_;
  Section section_;
};

// "srdo1" .. "srdo64".
std::optional<std::uint8_t> parse_srdo_name(const std::string& text) {
  constexpr std::string_view kPrefix = "srdo";
  unsigned number = 0;
  const char* const end = text.data() + text.size();
  if (!text.starts_with(kPrefix)) {
    return std::nullopt;
  }
  const auto parsed = std::from_chars(text.data() + kPrefix.size(), end, number);
  const bool good =
      parsed.ec == std::errc{} && parsed.ptr == end && number >= 1 && number <= srdo::kMaxSrdo;
  return good ? std::optional(static_cast<std::uint8_t>(number)) : std::nullopt;
}

bool is_signed(const line::NodeConfig& config, std::uint8_t number) {
  return std::ranges::any_of(config.objects, [number](const line::ObjectValue& object) {
    return object.address == od::Address{od::objects::kSrdoSignature, number};
  });
}

}  // namespace

void sign_srdos(const std::set<std::uint8_t>& written, line::NodeConfig& config) {
  for (const std::uint8_t number : written) {
    const od::Address place{od::objects::kSrdoSignature, number};
    const auto* const variable = find_variable(config.device, place);
    if (variable == nullptr || !od::writable(variable->access) || is_signed(config, number)) {
      continue;
    }
    std::vector<Diagnostic> ignored;  // reported when the line is made
    const srdo::Description srdo = srdo::describe_srdo(config.device, number, ignored);
    if (srdo.usable) {
      auto data = little_endian(srdo::signature(srdo.parameters), od::byte_size(variable->type));
      set_value(config.device, place, data);
      config.objects.push_back({place, std::move(data)});
    }
  }
}

std::set<std::uint8_t> read_srdos(Findings& findings, const YAML::Node& node,
                                  line::NodeConfig& config) {
  std::set<std::uint8_t> written;
  if (!node.IsDefined()) {
    return written;
  }
  Section section(findings, node, "srdo");
  if (!section.valid()) {
    return written;
  }
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) {
      continue;  // already reported by the section
    }
    section.find(pair.first.Scalar());
    const auto number = parse_srdo_name(pair.first.Scalar());
    if (!number) {
      findings.error(place_of(pair.first),
                     "expected srdo1 to srdo64, got \"" + pair.first.Scalar() + "\"");
      continue;
    }
    const std::size_t before = config.objects.size();
    SrdoOverride(findings, pair.first, pair.second, *number, config).apply();
    if (config.objects.size() != before) {
      written.insert(*number);
    }
  }
  section.done();
  return written;
}

}  // namespace linegate::config
