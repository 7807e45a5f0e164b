// SPDX-License-Identifier: Apache-2.0
// describe_srdo(): an SRDO of a device by its device file.
#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/base/hex_text.h"
#include "stack/pdo/mapping.h"
#include "stack/srdo/parameters.h"

namespace linegate::srdo {
namespace {

bool is_set(const od::VariableDescription& variable) {
  return variable.configured || variable.overridden;
}

class Describer {
 public:
  Describer(const od::DeviceDescription& device, std::uint8_t number,
            std::vector<Diagnostic>& diagnostics)
      : device_(device), number_(number), diagnostics_(diagnostics), first_(diagnostics.size()) {}

  Description read() {
    Description out;
    Parameters& srdo = out.parameters;
    srdo.number = number_;
    const std::uint16_t record = communication_record(number_);
    const std::uint64_t direction = value({record, kDirection}).value_or(0);
    if (direction == 0) {
      return out;
    }
    if (direction > static_cast<std::uint64_t>(Direction::receive)) {
      error({record, kDirection}, "direction " + std::to_string(direction) + " is none");
    } else {
      srdo.direction = static_cast<Direction>(direction);
    }
    read_times(srdo);
    read_cob_ids(srdo);
    read_mapping(srdo);
    const bool good = merge_errors();
    if (good) {
      check_signature(srdo);
    }
    out.usable = good;
    return out;
  }

 private:
  std::optional<std::uint64_t> value(od::Address address) const {
    const od::VariableDescription* const variable = device_.find(address);
    const bool given = variable != nullptr && !variable->value.empty() &&
                       variable->value.size() <= sizeof(std::uint64_t);
    return given ? std::optional(load_le(std::span<const std::byte>(variable->value)))
                 : std::nullopt;
  }

  void read_times(Parameters& out) {
    const std::uint16_t record = communication_record(number_);
    out.cycle_ms = read_time<std::uint16_t>({record, kCycleTime}, "refresh time or SCT");
    out.validation_ms = read_time<std::uint8_t>({record, kValidationTime}, "SRVT");
  }

  // Milliseconds, or 0 after an error.
  template <class Time>
  Time read_time(od::Address place, std::string_view what) {
    constexpr std::uint64_t kLongest = std::numeric_limits<Time>::max();
    const std::uint64_t time = value(place).value_or(0);
    if (time == 0 || time > kLongest) {
      // Appended: GCC 12 reports an access out of bounds in the sum of these strings, in which
      // there is none.
      std::string text(what);
      text.append(" is ").append(std::to_string(time));
      text.append(": give 1 to ").append(std::to_string(kLongest)).append(" ms");
      error(place, text);
      return 0;
    }
    return static_cast<Time>(time);
  }

  // Of 32 bits; 0, which is no valid one, if the file has a larger number.
  std::optional<std::uint32_t> value32(od::Address address) const {
    const auto number = value(address);
    const bool fits = number && *number <= std::numeric_limits<std::uint32_t>::max();
    return number ? std::optional(fits ? static_cast<std::uint32_t>(*number) : 0U) : std::nullopt;
  }

  void read_cob_ids(Parameters& out) {
    const std::uint16_t record = communication_record(number_);
    const std::uint32_t by_default = number_ == 1 ? default_cob_id(device_.node_id) : 0U;
    out.cob_id = value32({record, kCobId}).value_or(by_default);
    out.inverted_cob_id = value32({record, kInvertedCobId}).value_or(out.cob_id + 1);
    if (out.cob_id < kFirstCobId || out.cob_id > kLastCobId || out.cob_id % 2 == 0) {
      error({record, kCobId},
            "COB-ID 1 " + hex_text(out.cob_id, 3) + " is not an odd one of 101h to 17Fh");
    } else if (out.inverted_cob_id != out.cob_id + 1) {
      error({record, kInvertedCobId},
            "COB-ID 2 " + hex_text(out.inverted_cob_id, 3) + " is not that after COB-ID 1");
    }
  }

  void read_mapping(Parameters& out) {
    const std::uint16_t record = mapping_record(number_);
    const std::uint64_t count = value({record, 0}).value_or(0);
    if (count == 0 || count > kMaxMapped || count % 2 != 0) {
      error({record, 0}, "maps " + std::to_string(count) + " objects, not 2 to 16 in pairs");
      return;
    }
    std::uint32_t bits = 0;
    for (std::uint8_t sub = 1; sub <= count; ++sub) {
      const auto mapping = pdo::Mapping::from_raw(value32({record, sub}).value_or(0));
      check_entry({record, sub}, mapping, out.direction);
      if (sub % 2 == 0 && mapping.bits != out.mapping.back().bits) {
        error({record, sub}, "maps an inverted object of another length");
      }
      bits += sub % 2 != 0 ? mapping.bits : 0U;
      out.mapping.push_back(mapping);
    }
    if (bits > 8 * can::kMaxClassicData) {
      error({record, 0}, "maps " + std::to_string(bits) + " bits in a frame, more than 64");
    }
  }

  void check_entry(od::Address place, const pdo::Mapping& mapping, Direction direction) {
    if (direction == Direction::receive && pdo::is_dummy(mapping)) {
      return;
    }
    const od::VariableDescription* const variable = device_.find(mapping.address);
    const std::string object = "maps " + od::to_text(mapping.address);
    if (variable == nullptr) {
      error(place, object + ", which does not exist");
      return;
    }
    const unsigned bits = od::bit_size(variable->type);
    const bool fits =
        bits == mapping.bits || bits == 0 || pdo::is_boolean_in_a_byte(mapping, variable->type);
    if (mapping.bits == 0 || !fits) {
      error(place, object + " with " + std::to_string(mapping.bits) + " bits, but it is " +
                       std::string(od::name(variable->type)));
    }
  }

  // A device that is configured by Linegate gets the right signature, see order_writes(), unless
  // the user configures another one.
  void check_signature(const Parameters& srdo) {
    const od::Address place{od::objects::kSrdoSignature, number_};
    const std::uint64_t valid = value({od::objects::kSrdoConfigurationValid, 0}).value_or(0);
    const std::uint64_t described = value(place).value_or(0);
    const std::uint16_t computed = signature(srdo);
    if (described == computed || (described == 0 && valid != kConfigurationValid) ||
        device_.find(place) == nullptr) {
      return;
    }
    const bool configured = is_set(*device_.find(place));
    if (!configured && is_configured()) {
      return;  // its value is that of the default parameters
    }
    report(configured ? Severity::error : Severity::warning, place,
           "signature is " + hex_text(static_cast<std::uint32_t>(described), 4) +
               ", but that of its parameters is " + hex_text(computed, 4));
  }

  bool is_configured() const { return srdo::is_configured(device_, number_); }

  // Returns false if there are errors. Those of an SRDO that was not configured become one warning.
  bool merge_errors() {
    const std::size_t count = diagnostics_.size() - first_;
    if (count == 0) {
      return true;
    }
    diagnostics_.resize(first_ + 1);
    Diagnostic& whole = diagnostics_.back();
    if (count > 1) {
      whole.text += " (and " + std::to_string(count - 1) + " more of this SRDO)";
    }
    if (!is_configured()) {
      whole.severity = Severity::warning;
      whole.text += "; the SRDO is left out";
    }
    return false;
  }

  void error(od::Address place, const std::string& what) { report(Severity::error, place, what); }

  void report(Severity severity, od::Address place, const std::string& what) {
    const od::VariableDescription* const variable = device_.find(place);
    const od::ObjectDescription* const object = device_.find(place.index);
    const std::uint32_t line = variable != nullptr && variable->line != 0 ? variable->line
                               : object != nullptr                        ? object->line
                                                                          : 0;
    diagnostics_.push_back(
        {severity, device_.file, line, 0,
         "SRDO " + std::to_string(number_) + " (" + od::to_text(place) + ") " + what});
  }

  const od::DeviceDescription& device_;
  std::uint8_t number_;
  std::vector<Diagnostic>& diagnostics_;
  std::size_t first_;
};

}  // namespace

bool is_configured(const od::DeviceDescription& device, std::uint8_t number) {
  return std::ranges::any_of(std::array{communication_record(number), mapping_record(number)},
                             [&device](std::uint16_t index) {
                               const od::ObjectDescription* const object = device.find(index);
                               return object != nullptr &&
                                      std::ranges::any_of(object->variables, is_set);
                             });
}

Description describe_srdo(const od::DeviceDescription& device, std::uint8_t number,
                          std::vector<Diagnostic>& diagnostics) {
  return Describer(device, number, diagnostics).read();
}

Loaded<std::vector<Parameters>> describe_srdos(const od::DeviceDescription& device) {
  Loaded<std::vector<Parameters>> loaded;
  std::vector<Parameters> srdos;
  for (std::uint8_t number = 1; number <= kMaxSrdo; ++number) {
    if (device.find(communication_record(number)) != nullptr) {
      Description described = describe_srdo(device, number, loaded.diagnostics);
      if (described.usable) {
        srdos.push_back(std::move(described.parameters));
      }
    }
  }
  if (!has_errors(loaded.diagnostics)) {
    loaded.value = std::move(srdos);
  }
  return loaded;
}

}  // namespace linegate::srdo
