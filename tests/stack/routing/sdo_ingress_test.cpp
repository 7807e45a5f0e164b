// SPDX-License-Identifier: Apache-2.0
#include "stack/routing/sdo_ingress.h"

#include <chrono>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "stack/od/description.h"
#include "stack/od/dictionary.h"
#include "stack/od/objects.h"
#include "stack/routing/post.h"
#include "stack/routing/sdo_indication.h"
#include "stack/routing/table.h"
#include "stack/sdo/protocol.h"

namespace linegate::routing {
namespace {

using namespace std::chrono_literals;

constexpr std::uint16_t kOtherNetwork = 20;

// A client on a bus that accepts no frames while it is blocked.
class BlockableClient final : public ClientSide {
 public:
  bool response(std::uint64_t word, Instant /*now*/) override {
    if (!blocked) {
      responses.push_back(word);
    }
    return !blocked;
  }
  void released(Instant /*now*/) override { ++releases; }
  bool on_bus() const override { return true; }
  bool is_device() const override { return true; }

  bool blocked = false;
  std::vector<std::uint64_t> responses;
  unsigned releases = 0;
};

od::ObjectDescription routing_table() {
  od::ObjectDescription out;
  out.index = od::objects::kRoutingTable;
  out.type = od::ObjectType::array;
  const Route route{.first = kOtherNetwork, .last = kOtherNetwork, .interface = 2};
  out.variables = {
      od::number_variable(0, "Number of routes", od::DataType::unsigned8, od::Access::rw, 1),
      od::number_variable(1, "Route 1", od::DataType::unsigned64, od::Access::rw, encode(route))};
  return out;
}

// The requests sent before the connection was open fill the queue of the client, while its bus
// accepts no frames; then the target refuses, and the bus accepts frames again.
TEST(SdoIngress, ARefusalGoesBeforeWhatWaitsForTheBus) {
  od::Dictionary dictionary;
  ASSERT_TRUE(dictionary.add(routing_table()).ok());
  Config config;
  config.interface = 1;
  EventLog events;
  Counters counters;
  MessageQueue out(16);
  Post post(config.interface, out);
  SdoIngress ingress(config, {.network = 10, .node = 1, .sdo_timeout = 100ms}, dictionary, post,
                     events, counters);
  BlockableClient client;
  const Instant now{1s};
  ingress.request(client, encode(Indication{.network = kOtherNetwork, .node = 5}), now);
  Message open;
  ASSERT_TRUE(out.pop(open));
  ASSERT_EQ(open.kind, MessageKind::sdo_open);

  client.blocked = true;
  const std::uint64_t upload =
      sdo::initiate_word(sdo::command_byte(sdo::ClientCommand::upload_initiate), {0x1000, 0});
  for (std::size_t i = 0; i < WordQueue::kCapacity; ++i) {
    ingress.request(client, upload, now);
  }
  client.blocked = false;
  Message refused = refusal(open, AbortCode::sdo_connection);
  refused.connection = open.connection;
  ingress.deliver(refused, now);

  EXPECT_EQ(client.releases, 1U);
  ASSERT_EQ(client.responses.size(), 1U);
  EXPECT_EQ(client.responses[0], sdo::abort_word({}, AbortCode::sdo_connection));
  EXPECT_EQ(counters.refused, 1U);
}

}  // namespace
}  // namespace linegate::routing
