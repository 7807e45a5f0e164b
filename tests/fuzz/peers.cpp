// SPDX-License-Identifier: Apache-2.0
// The input is what happens between a gateway and linegated-peers, the process that sends its
// requests to other gateways, step by step: messages of a hostile process, samples of hostile hosts
// that a working process receives, requests of lines, new lines, time, and the end of the process.
// Promises: no crash; each request is answered once at most; lines that nobody wants are never
// reported; EMCYs keep their rate; and no sample makes a working process send what the gateway
// rejects.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/publish/peer_emcys.h"
#include "gateway/publish/peer_routes.h"
#include "gateway/publish/peer_server.h"
#include "gateway/publish/remote_peers.h"

#include "tests/fuzz/expect.h"
#include "tests/fuzz/input.h"

namespace {

using namespace linegate;
using namespace linegate::gateway;
using fuzz::Input;
using routing::GatewayLine;

constexpr std::size_t kMostSteps = 2'000;
const std::array<GatewayLine, 4> kPeerLines{
    GatewayLine{"hall-b", "press"}, {"hall-b", "store"}, {"hall-c", "press"}, {"", "press"}};

// peer_seeds.py has the same numbers.
enum class Step : std::uint8_t { raw, sample, answer, request, cancel, lines, time, end, count };

GatewayLine line_of(Input& input) {
  return kPeerLines[input.byte() % kPeerLines.size()];
}

std::uint64_t number_of(Input& input) {
  std::uint64_t out = 0;
  for (int i = 0; i < 8; ++i) {
    out = out << 8U | input.byte();
  }
  return out;
}

// The process, and the client in it, which sends nothing.
class Process final : public PeerClient {
 public:
  using Act = std::function<void(PeerHandler&)>;

  std::uint64_t number = 1;
  bool is_hostile = false;
  std::deque<PeerMessage> to;
  std::deque<PeerMessage> from;

  void set_lines(const std::vector<GatewayLine>& /*addressed*/,
                 const std::vector<GatewayLine>& /*emcys*/) override {}
  std::uint64_t send(const GatewayLine& /*to*/, std::uint64_t incarnation,
                     const line::Request& /*request*/, Duration timeout) override {
    LINEGATE_EXPECT(incarnation != 0);
    LINEGATE_EXPECT(timeout > Duration::zero());
    open.push_back(++sent_);
    return sent_;
  }
  void cancel(std::uint64_t id) override { std::erase(open, id); }
  void poll(Duration /*timeout*/, PeerHandler& handler) override {
    if (const auto act = std::exchange(act_, {})) {
      act(handler);
    }
  }
  void wake() override {}

  // No effect before it has the settings.
  void receive(Act act) {
    act_ = server_ == nullptr ? Act() : std::move(act);
    serve();
  }
  void restart() {
    ++number;
    is_hostile = false;
    server_ = nullptr;
    to.clear();
    from.clear();
    open.clear();
  }
  void set_clock(const Instant& now) { now_ = &now; }
  // Carries out what it was sent.
  void serve() {
    for (const PeerMessage& message : std::exchange(to, {})) {
      if (kind_of(message) == static_cast<std::uint8_t>(ToPeers::configure)) {
        LINEGATE_EXPECT(decode_settings(message).has_value());
        server_ = std::make_unique<PeerServer>(*this, [this] { return *now_; });
      } else {
        LINEGATE_EXPECT(server_ != nullptr && server_->handle(message));
      }
    }
    if (server_ != nullptr) {
      LINEGATE_EXPECT(server_->poll(Duration::zero(), [this](PeerBytes message) {
        from.emplace_back(message.begin(), message.end());
        return true;
      }));
    }
  }

  std::vector<std::uint64_t> open;  // requests

 private:
  const Instant* now_ = nullptr;
  std::uint64_t sent_ = 0;
  std::unique_ptr<PeerServer> server_;
  Act act_;
};

class Link final : public PeerLink {
 public:
  explicit Link(Process& process) : process_(process) {}
  std::uint64_t number() const override { return process_.number; }
  bool send(std::uint64_t number, PeerBytes message) override {
    if (number == process_.number) {
      process_.to.emplace_back(message.begin(), message.end());
    }
    return number == process_.number;
  }
  std::uint64_t receive(PeerMessage& message) override {
    if (process_.from.empty()) {
      return 0;
    }
    message = std::move(process_.from.front());
    process_.from.pop_front();
    return process_.number;
  }
  void wait(Duration /*timeout*/) override {}
  void wake() override {}
  void reject(std::uint64_t number, std::string_view /*reason*/) override {
    LINEGATE_EXPECT(number == process_.number && process_.is_hostile);
    process_.restart();
  }
  void replace(std::uint64_t /*number*/, std::string_view /*reason*/) override {}
  void finish(Duration /*limit*/) override {}

 private:
  Process& process_;
};

// The gateway: what its thread for the routes does (gateway/publish/peer_thread.cpp).
class World final : PeerHandler, PeerRoutes::Sink, PeerEmcys::Sink {
 public:
  World() {
    process_.set_clock(now_);
    set_lines(3);
    poll();
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  void step(Input& input) {
    switch (static_cast<Step>(input.byte() % static_cast<std::uint8_t>(Step::count))) {
      case Step::raw:
        process_.is_hostile = true;
        process_.from.push_back(input.bytes(input.word()));
        break;
      case Step::sample:
        process_.receive(sample(input));
        break;
      case Step::answer:
        process_.receive(answer_one(input));
        break;
      case Step::request:
        request(input);
        break;
      case Step::cancel:
        routes_.take(peers_, kLine, {.number = input.byte(), .cancelled = true}, now_);
        break;
      case Step::lines:
        set_lines(input.byte());
        break;
      case Step::time:
        now_ += std::chrono::milliseconds(input.word());
        break;
      case Step::end:
        process_.restart();
        return;  // the next process may send something before it has the settings
      case Step::count:
        break;
    }
    poll();
  }

 private:
  static constexpr const char* kLine = "hall";

  void poll() {
    peers_.poll(Duration::zero(), *this);
    process_.serve();
    peers_.poll(Duration::zero(), *this);
    routes_.advance(now_);
    emcys_.advance([this](const GatewayLine& of) { return routes_.publisher_of(of, now_); }, now_);
    LINEGATE_EXPECT(emcys_.next_wake(now_) >= now_);
  }

  // Of a foreign host.
  static Process::Act sample(Input& input) {
    const std::uint8_t kind = input.byte();
    const GatewayLine line = line_of(input);
    const std::uint64_t incarnation = input.byte();
    if (kind % 4 == 0) {
      const auto time = static_cast<std::int64_t>(number_of(input));
      const std::uint16_t network = input.word();
      return [=](PeerHandler& handler) { handler.on_state(line, incarnation, time, network); };
    }
    if (kind % 4 == 1) {
      return [=](PeerHandler& handler) { handler.on_gone(line); };
    }
    const PeerEvent event = event_of(input);
    const unsigned count = kind / 4 % 2 == 0 ? 1U : input.byte();
    return [=](PeerHandler& handler) {
      PeerEvent next = event;
      for (unsigned i = 0; i < count; ++i, ++next.number) {
        handler.on_event(line, incarnation, next);
      }
    };
  }

  static PeerEvent event_of(Input& input) {
    PeerEvent out{.stream = input.byte(), .number = input.word()};
    out.time = static_cast<std::int64_t>(number_of(input));
    out.node = input.byte();
    out.routed = input.flag();
    if (input.flag()) {
      out.emcy = {.code = input.word(), .error_register = input.byte(), .network = input.word()};
      out.emcy->node = input.byte();
      out.emcy->hops = input.byte();
      out.emcy->number = input.byte();
    }
    return out;
  }

  Process::Act answer_one(Input& input) {
    const std::uint8_t which = input.byte();
    line::Reply reply{.error = {static_cast<Domain>(input.byte()), input.word()}};
    reply.data = input.bytes(input.word());
    return [this, which, reply](PeerHandler& handler) {
      if (!process_.open.empty()) {
        const std::uint64_t id = process_.open[which % process_.open.size()];
        std::erase(process_.open, id);
        handler.on_answer(id, reply);
      }
      handler.on_answer(which, reply);
    };
  }

  void request(Input& input) {
    routing::GatewayWay way{.to = line_of(input)};
    routing::GatewayRequest request{.number = ++requested_,
                                    .way = std::make_shared<routing::GatewayWay>(way),
                                    .deadline = now_ + std::chrono::milliseconds(input.word()),
                                    .network = input.word(),
                                    .node = input.byte(),
                                    .hops = input.byte(),
                                    .address = {input.word(), input.byte()},
                                    .write = input.flag()};
    request.data = input.bytes(request.write ? input.byte() : 0U);
    routes_.take(peers_, kLine, std::move(request), now_);
  }

  void set_lines(std::uint8_t which) {
    std::vector<GatewayLine> lines;
    for (std::size_t i = 0; i + 1 < kPeerLines.size(); ++i) {
      if ((which >> i & 1U) != 0) {
        lines.push_back(kPeerLines[i]);
      }
    }
    lines_ = {lines.begin(), lines.end()};
    peers_.set_lines(lines, lines);
    emcys_.set_lines(lines);
    routes_.set_lines(lines, now_);
    since_ = now_;
    passed_ = 0;
  }

  // PeerHandler
  void on_state(const GatewayLine& line, std::uint64_t incarnation, std::int64_t time,
                std::uint16_t network) override {
    LINEGATE_EXPECT(lines_.contains(line));
    routes_.take_state(line, incarnation, time, now_);
    emcys_.take_state(line, incarnation, time, network, now_);
  }
  void on_event(const GatewayLine& line, std::uint64_t incarnation,
                const PeerEvent& event) override {
    LINEGATE_EXPECT(lines_.contains(line));
    emcys_.take_event(line, incarnation, event, now_);
  }
  void on_gone(const GatewayLine& line) override { routes_.take_end(line, now_); }
  void on_answer(std::uint64_t id, const line::Reply& reply) override {
    LINEGATE_EXPECT(reply.bytes().size() <= kLongestPeerValue);
    routes_.take_answer(id, reply);
  }

  // PeerRoutes::Sink
  bool answer(const std::string& /*line*/, routing::GatewayAnswer& answer) override {
    LINEGATE_EXPECT(answer.number >= 1 && answer.number <= requested_);
    LINEGATE_EXPECT(answered_.insert(answer.number).second);
    return true;
  }
  void set_present(const std::vector<GatewayLine>& present) override {
    LINEGATE_EXPECT(present.size() <= kPeerLines.size());
  }

  // PeerEmcys::Sink
  bool is_wanted(const GatewayLine& /*from*/,
                 const routing::ForwardedEmcy& /*emcy*/) const override {
    return true;
  }
  void take_emcy(const GatewayLine& from, const routing::ForwardedEmcy& emcy) override {
    LINEGATE_EXPECT(lines_.contains(from));
    LINEGATE_EXPECT(emcy.node >= 1 && emcy.node <= can::kMaxNodeId && emcy.hops >= 1);
    const double seconds = std::chrono::duration<double>(now_ - since_).count();
    LINEGATE_EXPECT(static_cast<double>(++passed_) <=
                    PeerEmcyLimit::kAllBurst + 1 + seconds * PeerEmcyLimit::kAllPerSecond);
  }
  void take_excess(const GatewayLine& from, const routing::ForwardedEmcy& /*emcy*/) override {
    LINEGATE_EXPECT(lines_.contains(from));
  }
  void take_loss(const GatewayLine& from, std::uint16_t /*network*/, std::uint64_t count) override {
    LINEGATE_EXPECT(lines_.contains(from));
    LINEGATE_EXPECT(count >= 1 && count <= PeerEmcys::kMostLostAtOnce);
  }

  Instant now_{std::chrono::hours(1)};
  Process process_;
  PeerRoutes routes_{*this};
  PeerEmcys emcys_{*this};
  std::set<GatewayLine> lines_;
  Instant since_{};  // the lines are these
  std::uint64_t passed_ = 0;
  std::uint64_t requested_ = 0;
  std::set<std::uint64_t> answered_;
  RemotePeers peers_{std::make_unique<Link>(process_), PeerSettings{.gateway = "hall-a"},
                     [this] { return now_; }};
};

// Whatever is accepted is encoded in as many octets, and accepted again.
template <class Value>
void check_decoded(const std::optional<Value>& value, PeerBytes message) {
  if (value) {
    const PeerMessage again = encode(*value);
    LINEGATE_EXPECT(again.size() == message.size());
    LINEGATE_EXPECT(again.front() == message.front());
  }
}

void decode_all(PeerBytes message) {
  const std::uint8_t kind = kind_of(message);
  if (kind == static_cast<std::uint8_t>(FromPeers::state)) {
    check_decoded(decode_state(message), message);
  } else if (kind == static_cast<std::uint8_t>(FromPeers::answer)) {
    check_decoded(decode_answer(message), message);
  } else if (kind == static_cast<std::uint8_t>(FromPeers::event)) {
    check_decoded(decode_event(message), message);
  }
  (void)decode_gone(message);
  (void)decode_number(message);
  (void)decode_settings(message);
  (void)decode_lines(message);
  (void)decode_send(message);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span octets(data, size);
  decode_all(std::as_bytes(octets));
  Input input(octets);
  World world;
  for (std::size_t step = 0; step < kMostSteps && !input.empty(); ++step) {
    world.step(input);
  }
  return 0;
}
