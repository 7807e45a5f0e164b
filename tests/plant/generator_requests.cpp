// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/generator_requests.h"

#include <algorithm>
#include <array>
#include <sstream>

#include "tests/plant/generator_outputs.h"

namespace linegate::plant {

std::string RequestsAndBursts::device_words(const Device& device) {
  constexpr unsigned kFirst = 0x180;  // CiA 301 7.3.5
  constexpr unsigned kSecond = 0x280;
  const bool has_other_mapping = device.swapped && device.profile == "encoder";  // of that TPDO
  if (fd_ || !device.listed || below(4) != 0 || has_other_mapping) {
    return {};
  }
  const bool second = device.profile == "analog-io";  // it has no TPDO 1
  const Tpdo tpdo{.node = device.id,
                  .number = second ? 2U : 1U,
                  .cob_id = (second ? kSecond : kFirst) + device.id};
  tpdos_.push_back(tpdo);
  return " on-request " + std::to_string(tpdo.number) + (below(2) == 0 ? " 252" : " 253");
}

RequestsAndBursts::Actions RequestsAndBursts::draw(const std::vector<Device>& devices,
                                                   unsigned time) {
  Actions out;
  if (!tpdos_.empty() && below(2) == 0) {
    const Tpdo& tpdo = tpdos_[below(static_cast<unsigned>(tpdos_.size()))];
    const unsigned count = 1 + below(3);
    for (unsigned i = 0; i < count; ++i) {
      out.emplace_back(time + below(20), below(2) == 0 ? stranger(tpdo)
                                                       : "request q" + std::to_string(++number_) +
                                                             ' ' + std::to_string(tpdo.node) + ' ' +
                                                             std::to_string(tpdo.number));
    }
  }
  if (below(4) == 0) {
    burst(out, devices[below(static_cast<unsigned>(devices.size()))], time);
  }
  return out;
}

// Near a start of the node, or an inhibit time.
void RequestsAndBursts::burst(Actions& out, const Device& device, unsigned time) {
  constexpr unsigned kArming = 100'000;
  constexpr std::array<const char*, 4> kBefore{"reset-node ", "reset-communication ",
                                               "pre-operational ", "start "};
  if (!device.listed) {
    return;
  }
  const std::string node = std::to_string(device.id);
  const unsigned before = below(6);
  if (before < kBefore.size()) {
    out.emplace_back(time, "nmt " + (kBefore[before] + node));
  }
  if (before == 2) {
    out.emplace_back(time + 1 + below(400), "nmt start " + node);
  }
  const unsigned pace = 1 + below(40);
  const unsigned count = 2 + below(8);
  for (unsigned i = 0; i < count; ++i) {
    std::ostringstream values;
    give_numbered(values, device, ++value_);
    if (!values.str().empty()) {
      time += below(pace);
      out.emplace_back(time, "write 0 arming " + std::to_string(kArming + value_) + values.str());
    }
  }
}

const RequestsAndBursts::Tpdo* RequestsAndBursts::find(const Device& device) const {
  const auto it = std::ranges::find(tpdos_, device.id, &Tpdo::node);
  return it == tpdos_.end() ? nullptr : &*it;
}

std::string RequestsAndBursts::stranger(const Tpdo& tpdo) {
  return "frame " + std::to_string(tpdo.cob_id) + " remote " + std::to_string(below(9));
}

void RequestsAndBursts::request_by_stranger(std::ostream& out, const Device& device,
                                            unsigned time) {
  if (const Tpdo* const tpdo = find(device)) {
    out << "at " << time << "ms " << stranger(*tpdo) << '\n';
  }
}

void RequestsAndBursts::expect_answers(std::ostream& out, const std::vector<Device>& devices,
                                       unsigned time) {
  for (const Device& device : devices) {
    const Tpdo* const tpdo = find(device);
    if (tpdo != nullptr && device.alive && device.answers_after == 0) {
      out << "at " << time << "ms request last" << device.id << ' ' << device.id << ' '
          << tpdo->number << "\nexpect reply last" << device.id << " ok within 1s\nexpect frame "
          << tpdo->cob_id << " within 1ms\n";
    }
  }
}

}  // namespace linegate::plant
