// SPDX-License-Identifier: Apache-2.0
// describe_pdos(): the PDOs of a device by its device file.
#include <algorithm>
#include <chrono>
#include <string>

#include "stack/base/byte_order.h"
#include "stack/base/hex_text.h"
#include "stack/od/description.h"
#include "stack/pdo/described_cob_id.h"
#include "stack/pdo/mapping.h"
#include "stack/pdo/parameters.h"

namespace linegate::pdo {
namespace {

class Reader {
 public:
  Reader(const od::DeviceDescription& device, PdoKind kind, std::size_t max_bits,
         std::vector<Diagnostic>& diagnostics)
      : device_(device), kind_(kind), max_bits_(max_bits), diagnostics_(diagnostics) {}

  // Errors in the file are tolerated for PDOs that the user did not configure.
  std::vector<Parameters> read() {
    std::vector<Parameters> pdos;
    for (std::uint16_t number = 1; number <= kMaxPdo; ++number) {
      Parameters parameters;
      const std::size_t before = diagnostics_.size();
      const bool used = read(number, parameters);
      const bool good = put_errors_in_one(before);
      if (used && good) {
        pdos.push_back(std::move(parameters));
      }
    }
    return pdos;
  }

  bool read(std::uint16_t number, Parameters& parameters) {
    number_ = number;
    return read_communication(parameters) && read_mapping(parameters);
  }

 private:
  bool is_configured(std::uint16_t index) const {
    const od::ObjectDescription* object = device_.find(index);
    return object != nullptr && std::ranges::any_of(object->variables, [](const auto& variable) {
             return variable.configured || variable.overridden;
           });
  }

  // Merges the errors from that position on into one, which is a warning if the PDO has its default
  // configuration. Returns false if there are errors.
  bool put_errors_in_one(std::size_t first) {
    const auto begin = diagnostics_.begin() + static_cast<std::ptrdiff_t>(first);
    const auto is_error = [](const Diagnostic& reported) {
      return reported.severity == Severity::error;
    };
    const auto count = std::count_if(begin, diagnostics_.end(), is_error);
    if (count == 0) {
      return true;
    }
    Diagnostic whole = *std::find_if(begin, diagnostics_.end(), is_error);
    const auto record = static_cast<std::uint16_t>(number_ - 1);
    const bool configured =
        is_configured(static_cast<std::uint16_t>(communication_base(kind_) + record)) ||
        is_configured(static_cast<std::uint16_t>(mapping_base(kind_) + record));
    if (count > 1) {
      whole.text += " (and " + std::to_string(count - 1) + " more of this PDO)";
    }
    if (!configured) {
      whole.severity = Severity::warning;
      whole.text += "; the PDO is left out, a mapping in pdos: replaces that of the file";
    }
    diagnostics_.erase(begin, diagnostics_.end());
    diagnostics_.push_back(std::move(whole));
    return false;
  }

  std::uint64_t value(od::Address address, std::uint64_t otherwise) const {
    const od::VariableDescription* variable = device_.find(address);
    const bool given = variable != nullptr && !variable->value.empty() &&
                       variable->value.size() <= sizeof(std::uint64_t);
    return given ? load_le(std::span<const std::byte>(variable->value)) : otherwise;
  }

  // Returns false if there is no such PDO or it is not valid.
  bool read_communication(Parameters& out) {
    const auto index = static_cast<std::uint16_t>(communication_base(kind_) + number_ - 1);
    if (device_.find(index) == nullptr) {
      return false;
    }
    out.number = number_;
    out.cob_id = described_cob_id(device_, kind_, number_);
    if (!out.cob_id.valid()) {
      return false;
    }
    if (!out.cob_id.extended() && can::is_restricted(out.cob_id.id())) {
      report(Severity::error, {index, 1},
             "COB-ID " + hex_text(out.cob_id.id(), 3) + " is reserved");
    }
    out.type = static_cast<std::uint8_t>(value({index, 2}, kEventProfile));
    out.inhibit = std::chrono::microseconds(100) * static_cast<int>(value({index, 3}, 0) & 0xFFFFU);
    out.event_timer = std::chrono::milliseconds(value({index, 5}, 0) & 0xFFFFU);
    out.sync_start = static_cast<std::uint8_t>(value({index, 6}, 0));
    return true;
  }

  // Returns false if it maps nothing.
  bool read_mapping(Parameters& out) {
    const auto index = static_cast<std::uint16_t>(mapping_base(kind_) + number_ - 1);
    if (device_.find(index) == nullptr) {
      const auto record = static_cast<std::uint16_t>(communication_base(kind_) + number_ - 1);
      report(Severity::warning, {record, 0}, "has no mapping record " + hex_text(index, 4));
      return false;
    }
    const std::uint64_t count = value({index, 0}, 0);
    if (count >= 0xFE) {
      report(Severity::warning, {index, 0}, "is a multiplexed PDO (MPDO), which is left out");
      return false;
    }
    if (count > kMaxMapped) {
      report(Severity::error, {index, 0},
             "maps " + std::to_string(count) + " objects, more than " + std::to_string(kMaxMapped));
      return false;
    }
    std::uint32_t bits = 0;
    for (std::uint8_t sub = 1; sub <= count; ++sub) {
      bits += read_entry({index, sub}, out);
    }
    if (bits > max_bits_) {
      report(Severity::error, {index, 0},
             "maps " + std::to_string(bits) + " bits, more than " + std::to_string(max_bits_));
    }
    return !out.mapping.empty();
  }

  // Returns the number of bits of the entry.
  std::uint32_t read_entry(od::Address place, Parameters& out) {
    const od::VariableDescription* entry = device_.find(place);
    if (entry == nullptr || entry->value.empty()) {
      report(Severity::error, entry == nullptr ? od::Address{place.index, 0} : place,
             "entry " + std::to_string(place.sub) + " is counted but has no value");
      return 0;
    }
    const Mapping mapping = Mapping::from_raw(static_cast<std::uint32_t>(value(place, 0)));
    check_entry(place, mapping);
    out.mapping.push_back(mapping);
    return mapping.bits;
  }

  // The device sends what its mapping specifies, so a doubtful object is still usable; an object
  // that does not exist or has another length is not.
  void check_entry(od::Address place, const Mapping& mapping) {
    if (is_dummy(mapping)) {
      return;
    }
    const std::string object = "maps " + od::to_text(mapping.address);
    const od::VariableDescription* variable = device_.find(mapping.address);
    if (variable == nullptr) {
      report(Severity::error, place, object + ", which does not exist");
      return;
    }
    const unsigned bits = od::bit_size(variable->type);
    if (is_boolean_in_a_byte(mapping, variable->type)) {
      report(Severity::warning, place,
             object + " with 8 bits, but it is BOOLEAN: the lowest bit is its value");
      return;
    }
    if (mapping.bits == 0 || (bits != 0 && bits != mapping.bits)) {
      report(Severity::error, place,
             object + " with " + std::to_string(mapping.bits) + " bits, but it is " +
                 std::string(od::name(variable->type)));
      return;
    }
    if (!variable->mappable) {
      report(Severity::warning, place, object + ", which may not be mapped (PDOMapping=0)");
    }
    const bool direction = kind_ == PdoKind::rpdo ? od::rpdo_mappable(variable->access)
                                                  : od::tpdo_mappable(variable->access);
    if (!direction) {
      report(Severity::warning, place, object + ", whose access type does not allow it");
    }
  }

  void report(Severity severity, od::Address place, const std::string& what) {
    const od::VariableDescription* variable = device_.find(place);
    const od::ObjectDescription* object = device_.find(place.index);
    const std::uint32_t line = variable != nullptr && variable->line != 0 ? variable->line
                               : object != nullptr                        ? object->line
                                                                          : 0;
    diagnostics_.push_back({severity, device_.file, line, 0,
                            std::string(name(kind_)) + " " + std::to_string(number_) + " (" +
                                od::to_text(place) + ") " + what});
  }

  const od::DeviceDescription& device_;
  PdoKind kind_;
  std::size_t max_bits_;
  std::vector<Diagnostic>& diagnostics_;
  std::uint16_t number_ = 1;
};

}  // namespace

Loaded<DevicePdos> describe_pdos(const od::DeviceDescription& device, std::size_t max_bits) {
  Loaded<DevicePdos> loaded;
  DevicePdos pdos;
  pdos.tpdos = Reader(device, PdoKind::tpdo, max_bits, loaded.diagnostics).read();
  pdos.rpdos = Reader(device, PdoKind::rpdo, max_bits, loaded.diagnostics).read();
  if (!has_errors(loaded.diagnostics)) {
    loaded.value = std::move(pdos);
  }
  return loaded;
}

Loaded<Parameters> describe_pdo(const od::DeviceDescription& device, PdoKind kind,
                                std::uint16_t number, std::size_t max_bits) {
  Loaded<Parameters> loaded;
  Parameters parameters;
  const bool used = Reader(device, kind, max_bits, loaded.diagnostics).read(number, parameters);
  if (used && !has_errors(loaded.diagnostics)) {
    loaded.value = std::move(parameters);
  }
  return loaded;
}

}  // namespace linegate::pdo
