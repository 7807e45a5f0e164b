// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/transport.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include <fastdds/rtps/network/SenderResource.h>
#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/TCPTransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "bridges/dds/guard/delivery_thread.h"
#include "bridges/dds/guard/message_room.h"
#include "bridges/dds/guard/passed_on.h"
#include "bridges/dds/guard/stalled_connections.h"
#include "bridges/dds/guard/tcp_input.h"

namespace linegate::dds::guard {
namespace {

namespace fast = eprosima::fastdds::rtps;
namespace rtps = eprosima::fastrtps::rtps;

std::int64_t steady_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

SampleTime utc() {
  const auto now = std::chrono::duration_cast<std::chrono::nanoseconds>(
                       std::chrono::system_clock::now().time_since_epoch())
                       .count();
  constexpr std::int64_t kSecond = 1'000'000'000;
  return (now / kSecond << 32) | ((now % kSecond) << 32) / kSecond;
}

// Derived, because only a derived class has access to send_lambda_.
struct Sender final : rtps::SenderResource {
  // Passes each sent datagram to the guard.
  static void show(rtps::SenderResource& sender, const std::shared_ptr<Guard>& guard) {
    auto& send = sender.*(&Sender::send_lambda_);
    send = [guard, below = std::move(send)](
               const rtps::octet* octets, std::uint32_t size, rtps::LocatorsIterator* begin,
               rtps::LocatorsIterator* end, const std::chrono::steady_clock::time_point& until) {
      guard->sent({octets, size});
      return below(octets, size, begin, end, until);
    };
  }
};

// A transport for short messages, such as those of an Ethernet frame, keeps seven eighths of its
// size: the rest is still enough without *_WITH_ORIGIN_AUTHENTICATION.
std::uint32_t with_room(std::uint32_t size, std::uint32_t room) {
  return size - std::min(room, size / 8);
}

struct Descriptor final : fast::ChainingTransportDescriptor {
  // room: octets that the library does not fill in a message.
  Descriptor(std::shared_ptr<fast::TransportDescriptorInterface> below,
             std::shared_ptr<Guard> its_guard, std::uint32_t its_room)
      : ChainingTransportDescriptor(std::move(below)),
        guard(std::move(its_guard)),
        room(its_room) {}
  fast::TransportInterface* create_transport() const override;
  // Of sent messages; the transport below still receives longer ones.
  std::uint32_t max_message_size() const override {
    return with_room(ChainingTransportDescriptor::max_message_size(), room);
  }

  std::shared_ptr<Guard> guard;
  std::uint32_t room;
};

class Transport final : public fast::ChainingTransport {
 public:
  explicit Transport(const Descriptor& descriptor)
      : ChainingTransport(descriptor), descriptor_(descriptor) {}

  fast::TransportDescriptorInterface* get_configuration() override { return &descriptor_; }

  bool init(const rtps::PropertyPolicy* properties) override {
    const auto* const tcp = dynamic_cast<const fast::TCPTransportDescriptor*>(
        low_level_transport_->get_configuration());
    if (tcp != nullptr &&
        !check_tcp_input({tcp->maxMessageSize, tcp->apply_security}, descriptor_.guard))
      return false;
    if (low_level_transport_->kind() == LOCATOR_KIND_TCPv4)
      from_tcp_.emplace([this](FromTcp& datagram) { pass_from_tcp(datagram); });
    const bool made = low_level_transport_->init(properties);
    limit_stalls_of_listeners();
    return made;
  }

  // The wrapped transport recognises only its own senders: with wrapped senders, TCP and shared
  // memory would open another one at each discovery and send every datagram once with each.
  bool OpenOutputChannel(fast::SendResourceList& senders, const rtps::Locator_t& to) override {
    const std::size_t first = senders.size();
    const bool open = open_below(senders, to);
    for (std::size_t i = first; i < senders.size(); ++i)
      Sender::show(*senders[i], descriptor_.guard);
    return open;
  }
  bool send(rtps::SenderResource* below, const rtps::octet* octets, std::uint32_t size,
            rtps::LocatorsIterator* begin, rtps::LocatorsIterator* end,
            const std::chrono::steady_clock::time_point& until) override {
    return below->send(octets, size, begin, end, until);
  }
  // The library ends the receiver of this channel afterwards.
  bool CloseInputChannel(const rtps::Locator_t& on) override {
    const bool closed = ChainingTransport::CloseInputChannel(on);
    if (from_tcp_)
      from_tcp_->drop_all();
    return closed;
  }
  // Not forwarded by ChainingTransport.
  void shutdown() override { low_level_transport_->shutdown(); }

  void receive(fast::TransportReceiverInterface* next, const rtps::octet* octets,
               std::uint32_t size, const rtps::Locator_t& local,
               const rtps::Locator_t& remote) override {
    Address from{};
    std::copy(std::begin(remote.address), std::end(remote.address), from.begin());
    thread_local PassedOn out;
    const std::int64_t now = steady_ns();
    if (descriptor_.guard->judge({octets, size}, now, from, &out).reason != Reason::none)
      return;
    const Octets datagram = out.octets();
    if (!from_tcp_)
      return pass(next, datagram, local, remote, now);
    from_tcp_->add(
        {next, {datagram.begin(), datagram.end()}, local, remote, receiving_connection()},
        datagram.size(), [] { return is_opening_channel(); });
  }

 private:
  // A datagram from a TCP connection.
  struct FromTcp {
    fast::TransportReceiverInterface* next;
    std::vector<std::uint8_t> octets;
    rtps::Locator_t local;
    rtps::Locator_t remote;
    LostPeers::Connection connection;
  };

  void pass(fast::TransportReceiverInterface* next, Octets datagram, const rtps::Locator_t& local,
            const rtps::Locator_t& remote, std::int64_t now) {
    thread_local const auto thread = static_cast<int>(syscall(SYS_gettid));
    const CallWatch::Call call(descriptor_.guard->calls(), now, thread);
    next->OnDataReceived(datagram.data(), static_cast<std::uint32_t>(datagram.size()), local,
                         remote);
  }

  void pass_from_tcp(const FromTcp& datagram) {
    const auto known = [this](const Prefix& prefix) { return descriptor_.guard->knows(prefix); };
    constexpr std::ptrdiff_t kPrefix = 8;  // RTPS 2.3 9.4.4
    Prefix sender{};
    std::copy_n(datagram.octets.begin() + kPrefix, sender.size(), sender.begin());
    const bool before = known(sender);
    if (!lost_.may_pass(sender, before, has_ended))
      return;
    pass(datagram.next, datagram.octets, datagram.local, datagram.remote, steady_ns());
    if (!before && known(sender))
      lost_.found(sender, datagram.connection, descriptor_.guard->is_endless(sender), known);
  }

  bool open_below(fast::SendResourceList& senders, const rtps::Locator_t& to) {
    if (to.kind != LOCATOR_KIND_TCPv4)
      return low_level_transport_->OpenOutputChannel(senders, to);
    const OpeningChannel opening;
    return low_level_transport_->OpenOutputChannel(senders, to);
  }

  Descriptor descriptor_;
  LostPeers lost_;
  std::optional<DeliveryThread<FromTcp>> from_tcp_;  // for TCP; it uses the others
};

fast::TransportInterface* Descriptor::create_transport() const {
  return new Transport(*this);  // its caller owns it
}

// Fast DDS determines by this type whether shared memory is available; without it, it drops the
// shared memory locators of other participants.
struct SharedMemory final : fast::SharedMemTransportDescriptor {
  SharedMemory(const fast::SharedMemTransportDescriptor& below, std::shared_ptr<Guard> its_guard,
               std::uint32_t its_room)
      : SharedMemTransportDescriptor(below), guard(std::move(its_guard)), room(its_room) {}
  fast::TransportInterface* create_transport() const override {
    return new Transport(
        Descriptor(std::make_shared<fast::SharedMemTransportDescriptor>(*this), guard, room));
  }
  std::uint32_t max_message_size() const override {
    return with_room(SharedMemTransportDescriptor::max_message_size(), room);
  }

  std::shared_ptr<Guard> guard;
  std::uint32_t room;  // see Descriptor
};

std::shared_ptr<fast::TransportDescriptorInterface> wrap(
    const std::shared_ptr<fast::TransportDescriptorInterface>& below,
    const std::shared_ptr<Guard>& guard, std::uint32_t room) {
  const auto* shared = dynamic_cast<const fast::SharedMemTransportDescriptor*>(below.get());
  if (shared != nullptr)
    return std::make_shared<SharedMemory>(*shared, guard, room);
  return std::make_shared<Descriptor>(below, guard, room);
}

// The same transports as the built-in ones of Fast DDS, which cannot be wrapped because the API
// gives no access to them.
void replace_built_in(eprosima::fastdds::dds::TransportConfigQos& transport) {
  auto udp = std::make_shared<fast::UDPv4TransportDescriptor>();
  udp->sendBufferSize = transport.send_socket_buffer_size;
  udp->receiveBufferSize = transport.listen_socket_buffer_size;
  auto shared = std::make_shared<fast::SharedMemTransportDescriptor>();
  shared->segment_size(2 * std::max(udp->sendBufferSize, udp->receiveBufferSize));
  shared->max_message_size(udp->max_message_size());
  transport.user_transports.push_back(udp);
  transport.user_transports.push_back(shared);
  transport.use_builtin_transports = false;
}

// Searches the text of the document. A document signed as text contains it in clear; in any other
// nothing is found.
bool leaves_plain(const std::string& document) {
  std::string file = document;
  if (file.rfind("file://", 0) == 0)
    file.erase(0, 7);
  std::ifstream in(file);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  return text.find("<rtps_protection_kind>NONE<") != std::string::npos;
}

}  // namespace

void wrap_transports(eprosima::fastdds::dds::DomainParticipantQos& qos,
                     const std::shared_ptr<Guard>& guard) {
  guard->set_utc(utc);
  auto& transport = qos.transport();
  if (transport.use_builtin_transports)
    replace_built_in(transport);
  const std::uint32_t room = requires_protection(qos) ? kProtectionRoom : 0;
  for (auto& each : transport.user_transports)
    each = wrap(each, guard, room);
}

bool has_tcp(const eprosima::fastdds::dds::DomainParticipantQos& qos) {
  const auto& transports = qos.transport().user_transports;
  return std::any_of(transports.begin(), transports.end(), [](const auto& each) {
    return dynamic_cast<const fast::TCPTransportDescriptor*>(each.get()) != nullptr;
  });
}

DiscoveryLimits discovery_limits(const eprosima::fastdds::dds::DomainParticipantQos& qos) {
  DiscoveryLimits out;
  out.participants = qos.allocation().participants.maximum - 1;  // others
  // With a discovery server, the end of a participant is one of a sequence of reliable samples, so
  // it cannot be dropped.
  using Protocol = rtps::DiscoveryProtocol_t;
  out.simple = qos.wire_protocol().builtin.discovery_config.discoveryProtocol == Protocol::SIMPLE;
  for (const rtps::Locator_t& locator : qos.wire_protocol().builtin.initialPeersList) {
    if (locator.kind == LOCATOR_KIND_SHM || rtps::IPLocator::isMulticast(locator))
      continue;
    std::copy(std::begin(locator.address), std::end(locator.address),
              out.peers.emplace_back().begin());
  }
  for (const auto& server : qos.wire_protocol().builtin.discovery_config.m_DiscoveryServers) {
    std::copy(std::begin(server.guidPrefix.value), std::end(server.guidPrefix.value),
              out.servers.emplace_back().begin());
  }
  return out;
}

bool requires_protection(const eprosima::fastdds::dds::DomainParticipantQos& qos) {
  constexpr const char* kGovernance = "dds.sec.access.builtin.Access-Permissions.governance";
  for (const auto& property : qos.properties().properties()) {
    if (property.name() == kGovernance)
      return !leaves_plain(property.value());
  }
  return false;
}

}  // namespace linegate::dds::guard
