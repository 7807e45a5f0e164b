// SPDX-License-Identifier: Apache-2.0
// The thread that receives commands and outputs and passes them to the lines.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "gateway/exchange/cell.h"
#include "gateway/exchange/ring.h"
#include "gateway/exchange/wakeup.h"
#include "gateway/journal/journal_server.h"
#include "gateway/publish/client_directory.h"
#include "gateway/publish/data_edge.h"
#include "gateway/publish/gateway_news.h"
#include "gateway/publish/notice_limit.h"
#include "gateway/publish/remote_inputs.h"
#include "gateway/runtime/line_host.h"

namespace linegate::gateway {

// What the receiver passes to the publisher.
struct PublisherInlets {
  exchange::Ring<line::Reply>& refusals;
  exchange::Ring<GatewayNotice>& notices;
  exchange::Wakeup& wakeup;
};

class RequestReceiver final : public RequestHandler, private RemoteInputs::Sink {
 public:
  // versions: the answer to request::Versions. journal: executes request::JournalRead; nullptr: the
  // gateway has no journal. All references and pointers must outlive this object.
  RequestReceiver(DataEdge& edge, std::span<const std::unique_ptr<LineHost>> lines,
                  PublisherInlets publisher, ClientDirectory& clients, std::string versions,
                  JournalServer* journal = nullptr);
  ~RequestReceiver() override;
  RequestReceiver(const RequestReceiver&) = delete;
  RequestReceiver& operator=(const RequestReceiver&) = delete;

  // May be started again after stop().
  void start();
  // No more requests are received: they wait in the edge. Call it while the lines still run.
  void stop();
  // Call it while the receiver is stopped.
  void set_lines(std::span<const std::unique_ptr<LineHost>> lines);

  // Iterations of the thread; wake() causes one.
  const exchange::Counter& rounds() const { return rounds_; }
  void wake() { edge_.wake(); }

  // Called by the edge within poll(); public for tests.
  void on_output_write(OutputRequest request) override;
  void on_command(CommandRequest request) override;
  void on_gateway_command(GatewayCommandRequest request) override;
  void on_output_refused(RequestOrigin origin, std::uint16_t group, line::OutputRefusal refusal,
                         std::string_view why) override;
  void on_command_refused(RequestOrigin origin, std::uint8_t kind, line::Refusal refusal,
                          std::string_view why) override;
  void on_unreadable(std::uint64_t samples) override;
  void on_misfit(std::string_view topic, std::string_view policy) override;
  void on_remote_state(const RemoteSource& source, std::int64_t time) override;
  void on_remote_layout(const RemoteSource& source, const image::Layout& layout) override;
  void on_remote_image(const RemoteSource& source, const image::Snapshot& image) override;
  // Retries replies that found their ring full.
  void flush();
  // Answers a command that was passed to a line but is not executed by any. Call it while the
  // receiver is stopped.
  void refuse(std::uint64_t tag, line::Refusal refusal);

 private:
  LineHost* find(std::string_view line) const;
  line::Refusal judge(const LineHost& host, const CommandRequest& request) const;
  // host: nullptr if no line has the name.
  static line::OutputRefusal judge_outputs(const LineHost* host, const OutputRequest& request);
  // Whether every line on the route to another network permits the command of this client. True for
  // commands within the network of the line.
  bool crosses(const LineHost& host, const CommandRequest& request) const;
  void read_journal(GatewayCommandRequest request);
  void answer(line::Reply reply);
  // Answers a command that was not passed to a line. host, line: see notice().
  void refuse_command(LineHost* host, std::string_view line, std::uint64_t tag,
                      const event::CommandRefused& refused);
  void report_namesakes();
  void report_warnings();
  void report_suppressed();
  // While more than half of a ring is free, everyone may push.
  class RingUse {
   public:
    // Whether the client may push one more. Call it before each push.
    template <class Entry>
    bool admit(exchange::Ring<Entry>& ring, std::uint32_t client) {
      const std::size_t of_one_client = ring.capacity() / 2;
      if (ring.room() == ring.capacity()) {
        used_.clear();
      }
      const bool crowded = ring.room() <= of_one_client;
      return ++used_[client] <= of_one_client || !crowded;
    }

   private:
    std::map<std::uint32_t, std::size_t> used_;  // pushes since the ring was empty
  };
  struct PortUse {
    RingUse commands;
    RingUse interface_commands;
    RingUse outputs;
  };

  // --- values of other gateways ---------------------------------------------------------------
  bool write(const std::string& line, const line::OutputWrite& write) override;
  void refuse(const RemoteInputs::Rule& rule, line::OutputRefusal why) override;
  void follow_lines();

  // Reports a refusal as an event of the line; without a host as one of the gateway: `line` is the
  // name of a line that does not exist.
  void notice(LineHost* host, std::string_view line, const EventData& what);
  void notice_unknown_line(std::string_view line, const EventData& what);
  void run();

  DataEdge& edge_;
  std::span<const std::unique_ptr<LineHost>> lines_;
  PublisherInlets publisher_;
  ClientDirectory& clients_;
  std::string versions_;
  JournalServer* journal_;
  std::deque<line::Reply> waiting_;
  std::map<std::string, NoticeLimit>
      notices_;  // by line: a writer whose samples are refused may continue to write
  std::map<std::string, PortUse> uses_;  // by line
  RemoteInputs remote_inputs_{*this};
  RingUse journal_use_;
  std::uint64_t unreadable_ = 0;  // samples since the last report
  Instant unreadable_reported_{};
  Instant misfit_reported_{};
  std::size_t namesakes_ = 0;  // other gateways of this name at the last report
  Instant namesakes_reported_{};
  exchange::Flag stop_;
  exchange::Counter rounds_;
  std::thread thread_;
};

}  // namespace linegate::gateway
