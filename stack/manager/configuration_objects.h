// SPDX-License-Identifier: Apache-2.0
// The configurations of all nodes in the manager's own object dictionary, as in CiA 302-3. The
// objects are authoritative; plant.yaml and files provide their initial values.
//
//   1F22h:n  DOMAIN  concise DCF of node n; written whole or not at all, refused with 0607 0010h if
//                    its count and sizes do not agree with its length
//   1F25h:n  U32 wo  request to configure node n, 128 = all: "conf". See MayConfigure for
//                    refusals; another value: 0800 0021h
//   1F26h:n  U32     expected date of the configuration, days since 1984-01-01
//   1F27h:n  U32     expected time, ms since midnight. 0: the node is always configured
//
// A new concise DCF sets 1F26h and 1F27h to the values that it writes to 1020h of the device, and
// to 0 if it does not write 1020h, so that they never belong to an older configuration.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "stack/manager/configuration_run.h"
#include "stack/manager/network_list.h"
#include "stack/manager/plan.h"
#include "stack/od/dictionary.h"

namespace linegate::manager {

inline constexpr std::uint32_t kConf = 0x666E'6F63;  // "conf"

// These objects, with the values of the plans.
std::vector<od::ObjectDescription> configuration_objects(std::span<const NodePlan> plans);

class ConfigurationObjects final : public od::Hook {
 public:
  // Whether a request to configure this node (1..127) can be carried out: none, or the abort code
  // of the refusal. A request for all nodes is refused only if it is refused for each node.
  using MayConfigure = std::function<AbortCode(std::uint8_t node)>;

  // dictionary has all objects of configuration_objects(), or none of them (then no node has a
  // configuration), and must outlive this object. plans: the PDOs of the image, which parameters
  // the nodes store, and restore if there is no 1F81h.
  ConfigurationObjects(od::Dictionary& dictionary, std::span<const NodePlan> plans);
  ~ConfigurationObjects() override;

  void set_may_configure(MayConfigure ask) { may_configure_ = std::move(ask); }

  // The present values of the objects.
  ConfigurationOrder order(std::uint8_t node) const;
  bool has_configuration(std::uint8_t node) const;
  // The PDOs of the node in the image.
  const std::vector<AssumedPdo>& pdos(std::uint8_t node) const { return pdos_[node]; }

  // Nodes requested with 1F25h since the last call.
  bool requested() const { return requests_.any(); }
  std::bitset<128> pop_requests() { return std::exchange(requests_, {}); }

  // od::Hook
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;

 private:
  struct Extent {
    std::uint8_t restore = 0;
    std::uint8_t store = 0;
  };
  AbortCode check_request(std::uint8_t sub, std::span<const std::byte> value) const;
  AbortCode may_configure(std::uint8_t node) const;
  std::vector<ObjectWrite> writes(std::uint8_t node) const;
  std::uint8_t restore(std::uint8_t node) const;

  od::Dictionary& dictionary_;
  std::array<Extent, 128> extents_{};              // by node-ID
  std::array<std::vector<AssumedPdo>, 128> pdos_;  // by node-ID
  std::bitset<128> requests_;
  MayConfigure may_configure_;
};

}  // namespace linegate::manager
