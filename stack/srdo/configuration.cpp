// SPDX-License-Identifier: Apache-2.0
#include "stack/srdo/configuration.h"

#include <algorithm>
#include <map>
#include <optional>
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
    (void)add({od::objects::kSrdoConfigurationValid, 0}, 0);
    add_rest([](od::Address address) {
      return number_of(address.index) == 0 && address.index < od::objects::kSrdoConfigurationValid;
    });
    for (const std::uint8_t number : numbers_) {
      configure(number);
    }
    for (const std::uint8_t number : signed_) {
      sign(number);
    }
    add_rest([](od::Address address) { return address.index == od::objects::kSrdoSignature; });
    restore({od::objects::kSrdoConfigurationValid, 0}, kConfigurationValid);
  }

 private:
  using Wanted = std::map<od::Address, std::vector<std::byte>>;

  void take_writes() {
    for (const manager::ObjectWrite& write : writes_) {
      const od::Address address = write.address;
      if (!is_srdo_object(address.index)) {
        continue;
      }
      if (const std::uint8_t number = number_of(address.index); number != 0) {
        numbers_.insert(number);
        signed_.insert(number);
      } else if (address.index == od::objects::kSrdoSignature && address.sub != 0) {
        signed_.insert(address.sub);
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

  // Adds a write, if the device has a writable object for it. Returns whether it has.
  bool add(od::Address address, std::uint64_t value) {
    const od::VariableDescription* const variable = device_.find(address);
    if (variable == nullptr || !od::writable(variable->access)) {
      return false;
    }
    std::vector<std::byte> data(std::min<std::size_t>(od::byte_size(variable->type), sizeof value));
    store_le(std::span(data), value);
    writes_.push_back({address, std::move(data)});
    return true;
  }

  // Adds the value that the object is to have, if it is among the writes that are left.
  bool add_wanted(od::Address address) {
    const Wanted::node_type found = wanted_.extract(address);
    if (found.empty()) {
      return false;
    }
    writes_.push_back({address, found.mapped()});
    return true;
  }

  // Adds those of the writes that are left.
  template <class Condition>
  void add_rest(Condition wanted) {
    for (auto it = wanted_.begin(); it != wanted_.end();) {
      const od::Address address = (it++)->first;
      if (wanted(address)) {
        add_wanted(address);
      }
    }
  }

  std::optional<std::uint64_t> value_of(od::Address address) const {
    const od::VariableDescription* const variable = device_.find(address);
    const bool is_known = variable != nullptr && !variable->value.empty() &&
                          variable->value.size() <= sizeof(std::uint64_t);
    return is_known ? std::optional(load_le(std::span<const std::byte>(variable->value)))
                    : std::nullopt;
  }

  // The last write to the object. Without a value, or if it is read-only by its device file, it is
  // written if it is among the writes alone.
  void restore(od::Address address, std::optional<std::uint64_t> value) {
    if (value && add(address, *value)) {
      wanted_.erase(address);
    } else {
      add_wanted(address);
    }
  }

  // A direction that is not known could not be restored, so it is not switched off.
  void configure(std::uint8_t number) {
    const od::Address direction{communication_record(number), kDirection};
    const std::optional<std::uint64_t> last = value_of(direction);
    if (last) {
      (void)add(direction, 0);
    }
    configure_mapping(mapping_record(number));
    add_rest([direction](od::Address address) {
      return address.index == direction.index && address.sub != direction.sub;
    });
    restore(direction, last);
  }

  // Devices accept an entry while the number of entries is 0.
  void configure_mapping(std::uint16_t record) {
    const auto of_record = [record](const auto& wanted) { return wanted.first.index == record; };
    if (std::ranges::none_of(wanted_, of_record)) {
      return;
    }
    const std::optional<std::uint64_t> count = value_of({record, 0});
    if (count) {
      (void)add({record, 0}, 0);
    }
    add_rest([record](od::Address address) { return address.index == record && address.sub != 0; });
    restore({record, 0}, count);
  }

  void sign(std::uint8_t number) {
    const od::Address place{od::objects::kSrdoSignature, number};
    if (add_wanted(place)) {
      return;
    }
    std::vector<Diagnostic> ignored;
    const Description srdo = describe_srdo(device_, number, ignored);
    if (srdo.usable) {
      (void)add(place, signature(srdo.parameters));
    }
  }

  od::DeviceDescription device_;  // with the values that are written
  std::vector<manager::ObjectWrite>& writes_;
  Wanted wanted_;  // and not yet added
  std::set<std::uint8_t> numbers_;
  std::set<std::uint8_t> signed_;
};

}  // namespace

void order_writes(const od::DeviceDescription& device, std::vector<manager::ObjectWrite>& writes) {
  Order(device, writes).apply();
}

}  // namespace linegate::srdo
