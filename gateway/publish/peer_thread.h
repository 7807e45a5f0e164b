// SPDX-License-Identifier: Apache-2.0
// The thread that carries requests of the lines to other gateways (PeerRoutes). It exists only
// while a line has a route over another gateway.
//
// Nothing waits for it: a request that it does not answer ends at its deadline in the line. So it
// is no thread that the gateway must be restarted for.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "gateway/exchange/cell.h"
#include "gateway/exchange/wakeup.h"
#include "gateway/publish/peer_emcys.h"
#include "gateway/publish/peer_routes.h"
#include "gateway/runtime/line_host.h"

namespace linegate::gateway {

class PeerThread final : private PeerRoutes::Sink, private PeerEmcys::Sink, private PeerHandler {
 public:
  // Makes the client; nullptr if DDS refuses, which was logged.
  using MakeClient = std::function<std::unique_ptr<PeerClient>(bool events)>;

  explicit PeerThread(MakeClient make_client) : make_client_(std::move(make_client)) {}
  ~PeerThread() override;
  PeerThread(const PeerThread&) = delete;
  PeerThread& operator=(const PeerThread&) = delete;

  // EMCYs of other gateways that were lost, and events that may have been some. From any thread.
  const exchange::Counter& emcys_lost() const { return emcys_lost_; }

  // For LinePort::peers.
  exchange::Wakeup& wakeup() { return wakeup_; }

  // The lines of the gateway, with their present routes. Makes the client if one is needed, and
  // removes it otherwise. Call it while the thread is stopped.
  void set_lines(std::span<const std::unique_ptr<LineHost>> lines);
  // No effect without a route over another gateway. May be started again after stop().
  void start();
  void stop();

 private:
  // PeerRoutes::Sink
  bool answer(const std::string& line, routing::GatewayAnswer& answer) override;
  void set_present(const std::vector<routing::GatewayLine>& present) override;
  // PeerEmcys::Sink
  bool is_wanted(const routing::GatewayLine& from,
                 const routing::ForwardedEmcy& emcy) const override;
  void take_emcy(const routing::GatewayLine& from, const routing::ForwardedEmcy& emcy) override;
  void take_excess(const routing::GatewayLine& from, const routing::ForwardedEmcy& emcy) override;
  void take_loss(const routing::GatewayLine& from, std::uint16_t network,
                 std::uint64_t count) override;
  // PeerHandler
  void on_state(const routing::GatewayLine& line, std::uint64_t incarnation, std::int64_t time,
                std::uint16_t network) override;
  void on_event(const routing::GatewayLine& line, std::uint64_t incarnation,
                const PeerEvent& event) override;
  void on_gone(const routing::GatewayLine& line) override;
  void on_answer(std::uint64_t id, const line::Reply& reply) override;

  // Losses that a line has not reported yet.
  struct Loss {
    std::string line;
    routing::GatewayLine from;
    AbortCode why = AbortCode::none;  // out_of_memory: more than PeerEmcyLimit permits
    std::uint16_t network = 0;
    std::uint8_t node = 0;  // of the last one; 0: not known
    std::uint64_t count = 0;
    Instant reported{};
  };

  void choose_client();
  void run();
  void relay();
  void note_loss(const LineHost& host, Loss loss);
  void report_losses(Instant now);
  static bool pass_on(LineHost& host, const routing::GatewayLine& from,
                      const routing::ForwardedEmcy& emcy);
  void take_requests();
  void log_present(const std::vector<routing::GatewayLine>& present);

  MakeClient make_client_;
  std::span<const std::unique_ptr<LineHost>> lines_;
  std::vector<std::pair<std::string, const LineHost*>> known_;  // of the last set_lines()
  std::unique_ptr<PeerClient> client_;  // nullptr without a route over another gateway
  PeerRoutes routes_{*this};
  PeerEmcys emcys_{*this};
  bool with_events_ = false;  // of client_
  exchange::Counter emcys_lost_;
  std::vector<Loss> losses_;
  std::vector<routing::GatewayLine> addressed_;
  std::vector<routing::GatewayLine> emcy_lines_;
  std::vector<routing::GatewayLine> present_;
  exchange::Wakeup wakeup_;
  exchange::Flag stop_;
  std::thread thread_;
  std::thread relay_;  // wakes client_ when a line has requests
};

}  // namespace linegate::gateway
