// SPDX-License-Identifier: Apache-2.0
// The second process of the DDS tests.
//
//   dds_peer gateway DOMAIN [PROFILES]     publishes known_values.h and answers commands:
//     sdo_read             sub x 1024 bytes of pattern(seed = node); index 1234h: abort 06020000h
//     sdo_write            number of received bytes, in 4 bytes, if they are pattern(seed = node);
//                          else abort 08000000h
//     local_read           number of commands of other kinds that were executed, in 4 bytes
//     other kinds          done, without data
//   dds_peer unguarded DOMAIN [PROFILES]   the same without a guard
//   dds_peer slow_gateway DOMAIN [PROFILES]  the same, but looks for samples every 20 ms only
//   dds_peer image_gateway DOMAIN [PROFILES]  the same, and publishes an image every 20 ms;
//     multicast_gateway: with process images by multicast
//   dds_peer subscriber DOMAIN [PROFILES]  prints what it receives, one line for each sample;
//     multicast_subscriber: receives images by multicast
//
// Prints "guard REASON COUNT" whenever a guard has dropped more datagrams, and "guarded" at its end
// if datagrams passed through a guard. Prints "ready" when its endpoints exist (as a gateway: when
// everything is published). Ends at the end of its standard input.
#include <cstdio>
#include <cstdlib>
#include <thread>

#include <poll.h>
#include <unistd.h>

#include "bridges/dds/client.h"
#include "bridges/dds/publisher.h"
#include "stack/base/byte_order.h"

#include "tests/dds/known_values.h"
#include "tests/paths.h"

namespace linegate {
namespace {

using std::chrono::milliseconds;

bool input_ended() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  char byte = 0;
  return ::poll(&input, 1, 0) > 0 && ::read(STDIN_FILENO, &byte, 1) <= 0;
}

void complain(const std::vector<Diagnostic>& diagnostics) {
  for (const Diagnostic& diagnostic : diagnostics) {
    std::printf("%s\n", to_string(diagnostic).c_str());
  }
}

std::vector<std::byte> bytes_of(std::uint32_t value) {
  std::vector<std::byte> data(4);
  store_le(data.data(), value);
  return data;
}

class Plant : public dds::GatewayHandler {
 public:
  void on_output_write(dds::OutputMessage message) override {
    const line::OutputWrite& write = message.write;
    std::printf(
        "output line=%s client=%s group=%u layout=%llx arming=%llu watchdog=%lld "
        "reactions=%02x",
        message.line.c_str(), message.client.c_str(), write.group,
        static_cast<unsigned long long>(write.layout_id),
        static_cast<unsigned long long>(write.arming),
        static_cast<long long>(write.watchdog.count()), write.reactions);
    for (const line::OutputValue& value : write.values) {
      std::printf(" value=%u:", value.entry);
      for (std::size_t i = 0; i < value.length; ++i) {
        std::printf("%02x", std::to_integer<unsigned>(value.data[i]));
      }
    }
    for (const line::OutputBytes& run : write.bytes) {
      std::printf(" bytes=%u:%zu", run.offset, run.data.size());
    }
    std::printf("\n");
  }

  void on_command(dds::CommandMessage message) override {
    line::Reply reply;
    reply.tag = message.command.tag;
    carry_out(message.command, reply);
    if (bridge != nullptr)
      bridge->reply(reply);
  }

  void on_gateway_command(dds::GatewayCommandMessage message) override {
    if (bridge != nullptr)
      bridge->reply({.tag = message.command.tag});
  }

  void on_output_refused(const dds::RequestOrigin& origin, std::uint16_t group,
                         line::OutputRefusal refusal, std::string_view why) override {
    std::printf("output-refused line=%s group=%u refusal=%u %s\n", origin.line.c_str(), group,
                static_cast<unsigned>(refusal), std::string(why).c_str());
  }

  void on_command_refused(const dds::RequestOrigin& origin, std::uint8_t kind,
                          line::Refusal refusal, std::string_view why) override {
    std::printf("command-refused line=%s client=%s kind=%u refusal=%u %s\n", origin.line.c_str(),
                origin.client.c_str(), kind, static_cast<unsigned>(refusal),
                std::string(why).c_str());
  }

  void on_unreadable(std::uint64_t samples) override {
    unreadable_ += samples;
    std::printf("unreadable %llu\n", static_cast<unsigned long long>(unreadable_));
  }

  void on_misfit(std::string_view topic, std::string_view policy) override {
    std::printf("misfit %s %s\n", std::string(topic).c_str(), std::string(policy).c_str());
  }

  dds::GatewayBridge* bridge = nullptr;

 private:
  void carry_out(const line::Command& command, line::Reply& reply) {
    if (std::holds_alternative<line::LocalRead>(command.request)) {
      reply.data = bytes_of(carried_out_);
      return;
    }
    ++carried_out_;
    if (const auto* const read = std::get_if<line::SdoRead>(&command.request)) {
      if (read->address.index == 0x1234)
        reply.error = {Domain::sdo, 0x0602'0000};
      if (reply.ok())
        reply.data = known::pattern(std::size_t{read->address.sub} * 1024, read->node);
    } else if (const auto* const write = std::get_if<line::SdoWrite>(&command.request)) {
      const bool same = write->data == known::pattern(write->data.size(), write->node);
      if (!same)
        reply.error = {Domain::sdo, 0x0800'0000};
      reply.data = bytes_of(static_cast<std::uint32_t>(write->data.size()));
    }
  }

  std::uint32_t carried_out_ = 0;
  std::uint64_t unreadable_ = 0;
};

// Counts the datagrams that a guard dropped since the last call.
class Dropped {
 public:
  void print(const dds::guard::Counters& now) {
    for (std::size_t i = 0; i < dds::guard::kReasons; ++i) {
      if (now.dropped[i] == before_.dropped[i])
        continue;
      const std::string name(to_string(static_cast<dds::guard::Reason>(i)));
      std::printf("guard %s %llu\n", name.c_str(), static_cast<unsigned long long>(now.dropped[i]));
    }
    before_ = now;
  }

  void end() const {
    if (before_.received != 0)
      std::printf("guarded\n");
  }

 private:
  dds::guard::Counters before_;
};

bool publish_all(dds::GatewayBridge& bridge) {
  using namespace known;
  bridge.set_clock(clock());
  bool ok = bridge.publish(line_info(), line_state(), at(1), properties());
  ok = bridge.publish(gateway_info(), at(1)) && ok;
  ok = bridge.publish(kLine, node_info(), node_state(), at(2), all_properties()) && ok;
  ok = bridge.publish(kLine, output_state(), at(4)) && ok;
  ok = bridge.publish(kLine, layout()) && ok;
  ok = bridge.publish(kLine, snapshot()) && ok;
  for (std::uint64_t number = 1; number <= kEvents; ++number) {
    ok = bridge.publish(kLine, known::event(number), event_text(number), properties()) && ok;
  }
  return ok;
}

struct Role {
  bool guard = true;
  bool slow = false;
  bool images = false;
  bool multicast = false;
};

int run_gateway(std::uint32_t domain, const std::string& profiles, Role role) {
  dds::GatewayOptions options{
      known::kGateway, known::kIncarnation, domain, profiles, {known::kLine}};
  options.guard = role.guard;
  options.network.multicast_images = role.multicast;
  auto made = dds::GatewayBridge::make(options);
  if (!made.ok())
    return complain(made.diagnostics), 1;
  dds::GatewayBridge& bridge = **made.value;
  Plant plant;
  plant.bridge = &bridge;
  if (!publish_all(bridge))
    return std::printf("not published\n"), 1;
  std::printf("ready\n");
  image::Snapshot snapshot = known::snapshot();
  Dropped dropped;
  while (!input_ended()) {
    if (role.slow || role.images)
      std::this_thread::sleep_for(milliseconds(20));
    bridge.poll(milliseconds(role.slow || role.images ? 0 : 20), plant);
    if (role.images) {
      ++snapshot.sequence;
      bridge.publish(known::kLine, snapshot);
    }
    dropped.print(bridge.guard_counters());
    // Repeated, because a volatile reader that matches late receives only later samples.
    bridge.publish_pdo_update(known::kLine, known::layout(), snapshot, snapshot.marks[0], 3);
    bridge.publish(known::kLine, known::layout(), known::reception());
  }
  dropped.end();
  return 0;
}

class Printer : public dds::ClientListener {
 public:
  explicit Printer(bool pdos) : pdos_(pdos) {}

  void on_line(const dds::Source& source, const dds::LineInfo&, const line::LineState& state,
               const std::vector<dds::Property>&) override {
    std::printf("line %s %u\n", source.line.c_str(), state.load_permille);
  }
  void on_image(const dds::Source&, const image::Snapshot& snapshot) override {
    std::printf("image %llu\n", static_cast<unsigned long long>(snapshot.sequence));
  }
  void on_event(const dds::Source&, const dds::ReceivedEvent& event, std::string_view,
                const std::vector<dds::Property>&) override {
    std::printf("event %llu\n", static_cast<unsigned long long>(event.number));
  }
  void on_pdo(const dds::Source&, const dds::PdoUpdate&) override {
    if (pdos_)
      std::printf("pdo\n");
  }

 private:
  const bool pdos_;
};

int run_subscriber(std::uint32_t domain, const std::string& profiles, bool pdos, bool multicast) {
  dds::ClientOptions options;
  options.domain = domain;
  options.profile_file = profiles;
  options.network.multicast_images = multicast;
  auto made = dds::Client::make(options);
  if (!made.ok())
    return complain(made.diagnostics), 1;
  Printer printer(pdos);
  std::printf("ready\n");
  Dropped dropped;
  while (!input_ended()) {
    (*made.value)->poll(milliseconds(20), printer);
    dropped.print((*made.value)->guard_counters());
  }
  dropped.end();
  return 0;
}

}  // namespace
}  // namespace linegate

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  if (argc < 3)
    return 2;
  const std::string role = argv[1];
  const auto domain = static_cast<std::uint32_t>(std::strtoul(argv[2], nullptr, 10));
  const std::string profiles = argc > 3 ? argv[3] : linegate::paths::kLoopbackProfiles;
  if (role == "gateway" || role == "unguarded" || role == "slow_gateway" ||
      role == "image_gateway" || role == "multicast_gateway")
    return linegate::run_gateway(domain, profiles,
                                 {.guard = role != "unguarded",
                                  .slow = role == "slow_gateway",
                                  .images = role == "image_gateway" || role == "multicast_gateway",
                                  .multicast = role == "multicast_gateway"});
  if (role == "subscriber" || role == "pdo_subscriber" || role == "multicast_subscriber")
    return linegate::run_subscriber(domain, profiles, role == "pdo_subscriber",
                                    role == "multicast_subscriber");
  return 2;
}
