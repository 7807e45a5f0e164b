// SPDX-License-Identifier: Apache-2.0
#include "stack/srdo/configuration.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/srdo/parameters.h"

namespace linegate::srdo {
namespace {

class Order {
 public:
  Order(const od::DeviceDescription& device, std::vector<manager::ObjectWrite>& writes)
      : device_(device), writes_(writes) {}

  void apply() {
    const bool changes = std::ranges::any_of(writes_, [](const manager::ObjectWrite& write) {
      return is_srdo_object(write.address.index) &&
             write.address.index < od::objects::kSrdoConfigurationValid;
    });
    if (!changes) {
      return;
    }
    take_writes();
    add({od::objects::kSrdoConfigurationValid, 0}, 0);
    for (auto& [address, data] : wanted_) {
      if (number_of(address.index) == 0 && address.index < od::objects::kSrdoConfigurationValid) {
        writes_.push_back({address, data});
      }
    }
    for (const std::uint8_t number : numbers_) {
      configure(number);
    }
    for (const std::uint8_t number : numbers_) {
      sign(number);
    }
    add({od::objects::kSrdoConfigurationValid, 0}, kConfigurationValid);
  }

 private:
  void take_writes() {
    for (const manager::ObjectWrite& write : writes_) {
      const od::Address address = write.address;
      if (!is_srdo_object(address.index)) {
        continue;
      }
      if (const std::uint8_t number = number_of(address.index); number != 0) {
        numbers_.insert(number);
      }
      if (od::VariableDescription* const variable = device_.find(address)) {
        variable->value = write.data;
      }
      wanted_[address] = write.data;
    }
    std::erase_if(writes_, [](const manager::ObjectWrite& write) {
      return is_srdo_object(write.address.index);
    });
  }

  // Adds a write, if the device has a writable object for it.
  void add(od::Address address, std::uint64_t value) {
    const od::VariableDescription* const variable = device_.find(address);
    if (variable == nullptr || !od::writable(variable->access)) {
      return;
    }
    std::vector<std::byte> data(std::min<std::size_t>(od::byte_size(variable->type), sizeof value));
    store_le(std::span(data), value);
    writes_.push_back({address, std::move(data)});
  }

  // Adds the value that the object is to have, if it is among the writes.
  bool add_wanted(od::Address address) {
    const auto found = wanted_.find(address);
    if (found == wanted_.end()) {
      return false;
    }
    writes_.push_back({address, found->second});
    return true;
  }

  std::uint64_t value_of(od::Address address) const {
    const od::VariableDescription* const variable = device_.find(address);
    return variable == nullptr || variable->value.size() > sizeof(std::uint64_t)
               ? 0
               : load_le(std::span<const std::byte>(variable->value));
  }

  void configure(std::uint8_t number) {
    const std::uint16_t record = communication_record(number);
    add({record, kDirection}, 0);
    configure_mapping(mapping_record(number));
    for (const std::uint8_t sub :
         {kCycleTime, kValidationTime, kTransmissionType, kCobId, kInvertedCobId}) {
      add_wanted({record, sub});
    }
    add({record, kDirection}, value_of({record, kDirection}));
  }

  void configure_mapping(std::uint16_t record) {
    const auto of_record = [record](const auto& wanted) { return wanted.first.index == record; };
    if (std::ranges::none_of(wanted_, of_record)) {
      return;
    }
    add({record, 0}, 0);
    const std::uint64_t count = value_of({record, 0});
    for (std::uint8_t sub = 1; sub <= std::min<std::uint64_t>(count, kMaxMapped); ++sub) {
      add_wanted({record, sub});
    }
    add({record, 0}, count);
  }

  void sign(std::uint8_t number) {
    const od::Address place{od::objects::kSrdoSignature, number};
    if (add_wanted(place)) {
      return;
    }
    std::vector<Diagnostic> ignored;
    const Description srdo = describe_srdo(device_, number, ignored);
    if (srdo.usable) {
      add(place, signature(srdo.parameters));
    }
  }

  od::DeviceDescription device_;  // with the values that are written
  std::vector<manager::ObjectWrite>& writes_;
  std::map<od::Address, std::vector<std::byte>> wanted_;
  std::set<std::uint8_t> numbers_;
};

}  // namespace

void order_writes(const od::DeviceDescription& device, std::vector<manager::ObjectWrite>& writes) {
  Order(device, writes).apply();
}

}  // namespace linegate::srdo
