// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/dds_process.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <pthread.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "bridges/dds/guard/stalled_connections.h"
#include "bridges/dds/message_link.h"
#include "bridges/dds/port_server.h"
#include "bridges/dds/remote_port.h"
#include "gateway/edge/edge_end.h"
#include "gateway/edge/edge_process.h"
#include "gateway/edge/stall_time.h"
#include "gateway/exchange/cell.h"
#include "gateway/exchange/shared_rings.h"
#include "gateway/exchange/shared_slots.h"
#include "gateway/publish/dds_edge.h"
#include "gateway/publish/dds_process_main.h"
#include "gateway/publish/foreign_text.h"
#include "gateway/publish/library_logger.h"
#include "gateway/runtime/clock.h"
#include "gateway/runtime/direct_images.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/runtime/image_record.h"
#include "gateway/runtime/signals.h"

namespace linegate::gateway {
namespace {

constexpr Duration kTimeToStart = std::chrono::seconds(20);
// The lines start without DDS after that time. A process that works creates its endpoints, or
// reports an error of the configuration, in less than 1 s.
constexpr Duration kDelayOfLines = std::chrono::seconds(3);
constexpr Duration kReceivePeriod = std::chrono::milliseconds(200);
constexpr Duration kPollPeriod = std::chrono::milliseconds(100);
constexpr Duration kFullPeriod = std::chrono::milliseconds(2);  // while there is no room
// Fast DDS needs less than 10 ms for any datagram, a handshake of DDS-Security included.
constexpr Duration kLongestStall = std::chrono::milliseconds(100);
static_assert(StallTime::kObserved < kLongestStall);
// A TCP peer that reads nothing must not look like a library that hangs: a call that sends to it
// ends before.
static_assert(dds::guard::kStalled + dds::guard::kStalledLater < ProgressLimit::kToContinue);
static_assert(dds::kLongestMessage < exchange::SharedRings::kRingBytes / 2 - 8);

void write_log(Severity severity, std::string_view text) {
  const auto level = severity == Severity::error     ? spdlog::level::err
                     : severity == Severity::warning ? spdlog::level::warn
                                                     : spdlog::level::info;
  spdlog::log(level, "{}", printable(text));
}

class SharedImages final : public dds::SharedFiles, public SharedWithProcess {
 public:
  explicit SharedImages(std::shared_ptr<DirectImages> images) : images_(std::move(images)) {}

  std::array<int, 2> descriptors() const override { return images_->records().descriptors(); }
  bool damaged() const override { return images_->records().damaged(); }
  void forget_damage() override { images_->records().forget_damage(); }

 private:
  const std::shared_ptr<DirectImages> images_;
};

class ProcessLink final : public dds::MessageLink {
 public:
  ProcessLink(const config::Plant& plant, std::shared_ptr<ProcessEnds> ends,
              std::shared_ptr<exchange::Bell> bell)
      : ends_(std::move(ends)), process_(options_for(plant, std::move(bell))) {}

  dds::ProcessNumber process() const override { return process_.number(); }
  bool send(dds::ProcessNumber process, std::span<const std::byte> message) override {
    return process_.send(process, message);
  }
  bool share(dds::ProcessNumber process, std::uint64_t tag,
             const std::shared_ptr<dds::SharedFiles>& files) override {
    return process_.share(process, tag, std::dynamic_pointer_cast<SharedWithProcess>(files));
  }
  Positions positions(dds::ProcessNumber process) override {
    const EdgeProcess::Positions positions = process_.positions(process);
    return {positions.sent, positions.done};
  }
  dds::ProcessNumber receive(std::vector<std::byte>& message) override {
    return process_.receive(message);
  }
  void wait(Duration timeout) override { process_.wait(timeout); }
  void wake() override { process_.wake(); }
  void reject(dds::ProcessNumber process, std::string_view reason) override {
    process_.reject(process, reason);
  }
  void replace(dds::ProcessNumber process, std::string_view reason) override {
    process_.replace(process, reason);
  }
  void log(Severity severity, std::string_view text) override { write_log(severity, text); }
  void finish(Duration limit) override { process_.finish(limit); }

 private:
  EdgeProcess::Options options_for(const config::Plant& plant,
                                   std::shared_ptr<exchange::Bell> bell) {
    const std::string program = plant.dds_program.empty() ? "/proc/self/exe" : plant.dds_program;
    return {
        .program = program,
        .arguments = {"linegated-dds", std::string(kDdsProcessArgument)},
        .name = "DDS",
        .stable = plant.dds_stable,
        .memory = plant.dds_memory,
        .ended =
            [this](EdgeProcess::Options::End end) {
              ends_->note(end.cause, end.detail, end.pause, std::move(end.words), monotonic_now());
            },
        .changed = [this](ProcessEnds::Condition condition,
                          Instant start_due) { ends_->set_condition(condition, start_due); },
        .bell = std::move(bell),
        .log = write_log,
        .output = [this](
                      Severity severity,
                      std::string_view text) { library_.write(severity, text, monotonic_now()); }};
  }

  const std::shared_ptr<ProcessEnds> ends_;  // outlives the process
  LibraryLogger library_;                    // as well
  EdgeProcess process_;
};

void send_samples(dds::PortServer& server, EdgeEnd& end, const exchange::Flag& stop) {
  pthread_setname_np(pthread_self(), "dds receiver");
  StallTime stalls;
  while (!stop.raised()) {
    const bool room = server.poll(
        kPollPeriod, [&](dds::PortServer::Message message) { return end.send(message); });
    if (!room) {
      std::this_thread::sleep_for(kFullPeriod);
    }
    // A datagram or a timer that keeps a thread of the library is no progress, whatever the other
    // threads do.
    const dds::guard::Stall longest = server.longest_stall();
    if (stalls.count(longest.thread, longest.time, monotonic_now()) < kLongestStall) {
      end.add_sender_progress();
    }
  }
}

// The images that lines publish without messages.
class ImageReceiver {
 public:
  ImageReceiver(dds::PortServer& server, EdgeEnd& end) : server_(server), end_(end) {}

  // Before the server handles the message.
  void look_at(dds::PortServer::Message message) {
    if (const auto shared = dds::PortServer::shared_images(message)) {
      const std::array<int, 2> files = end_.take_files(shared->tag);
      lines_.insert_or_assign(shared->line, std::make_unique<exchange::SlotReader>(files));
      close(files[0]);
      close(files[1]);
    } else if (const auto removed = dds::PortServer::removed_line(message)) {
      if (const auto line = lines_.find(*removed); line != lines_.end()) {
        while (publish_next(line->first, *line->second)) {
          end_.add_receiver_progress();
        }
        lines_.erase(line);
      }
    }
  }

  bool any() const {
    return std::ranges::any_of(lines_, [](const auto& line) { return line.second->any(); });
  }
  // One of each line and direction, because messages wait, too. Returns false if there was none.
  bool publish() {
    bool any = false;
    for (auto& [name, records] : lines_) {
      any |= publish_next(name, *records);
      end_.add_receiver_progress();
    }
    return any;
  }

 private:
  bool publish_next(const std::string& line, exchange::SlotReader& records) {
    bool any = false;
    for (std::size_t series = 0; series < exchange::kSharedSeries; ++series) {
      const exchange::SlotReader::Record record = records.next(series);
      if (record.number == 0) {
        continue;
      }
      any = true;
      ClockMap clock;
      if (read_record(record.data, snapshot_, clock)) {
        snapshot_.sequence = record.number;
        server_.publish(line, snapshot_,
                        {clock.offset, static_cast<dds::ClockQuality>(clock.quality)});
      }
      records.done(series);
    }
    return any;
  }

  dds::PortServer& server_;
  EdgeEnd& end_;
  std::map<std::string, std::unique_ptr<exchange::SlotReader>> lines_;
  image::Snapshot snapshot_;
};

// Returns when the parent asks for the end, after the last images.
void serve(dds::PortServer& server, EdgeEnd& end) {
  exchange::Flag stop;
  std::thread sender([&] { send_samples(server, end, stop); });
  ImageReceiver images(server, end);
  server.watch_readers([&end] { end.wake(); });
  const auto work_waits = [&] { return images.any() || server.readers_changed(); };
  bool more = true;
  while (more && !end.broken()) {
    const dds::PortServer::Message message = end.receive(kReceivePeriod, work_waits);
    if (!message.empty()) {
      images.look_at(message);
      more = server.handle(message);
      end.done();
    }
    images.publish();
    server.look_at_readers();
    end.add_receiver_progress();
  }
  for (std::uint64_t i = 0; i < exchange::SlotWriter::kSlots && images.publish(); ++i) {
  }
  stop.raise();
  server.wake();
  sender.join();
}

int run() {
  if (!enter_dds_process()) {
    return kExitFailed;
  }
  EdgeEnd end;
  const dds::PortServer::Message configure = end.receive(kTimeToStart);
  auto server = dds::PortServer::make(
      configure, [&](dds::PortServer::Message message) { return end.send(message); },
      add_security_functions);
  if (server == nullptr) {
    return kExitFailed;
  }
  end.done();
  serve(*server, end);
  server.reset();
  return kExitOk;
}

}  // namespace

std::shared_ptr<dds::SharedFiles> shared_files(std::shared_ptr<DirectImages> images) {
  return std::make_shared<SharedImages>(std::move(images));
}

Loaded<std::unique_ptr<dds::GatewayBridge>> make_bridge_to_process(
    const dds::GatewayOptions& options, const config::Plant& plant,
    std::shared_ptr<ProcessEnds> ends, std::shared_ptr<exchange::Bell> bell) {
  Loaded<std::unique_ptr<dds::GatewayBridge>> out;
  try {
    out = dds::make_remote_bridge(
        options, std::make_unique<ProcessLink>(plant, std::move(ends), std::move(bell)),
        kDelayOfLines, stop_signal_pending);
  } catch (const std::exception& error) {
    out.diagnostics.push_back({Severity::error, plant.file, 0, 0,
                               std::string("the DDS process cannot be started: ") + error.what()});
  }
  for (Diagnostic& diagnostic : out.diagnostics) {  // they may be texts of the process
    diagnostic.text = printable(diagnostic.text);
  }
  return out;
}

void run_dds_process() {
  run_process("linegated-dds", run);
}

}  // namespace linegate::gateway
