// SPDX-License-Identifier: Apache-2.0
// The gateway: a plant configuration at run time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridges/sim/virtual_channel.h"
#include "gateway/config/plan_difference.h"
#include "gateway/config/plant.h"
#include "gateway/journal/journal_server.h"
#include "gateway/journal/journal_thread.h"
#include "gateway/process/progress_watch.h"
#include "gateway/process/status_text.h"
#include "gateway/publish/data_edge.h"
#include "gateway/publish/peer_thread.h"
#include "gateway/publish/process_ends.h"
#include "gateway/publish/publisher.h"
#include "gateway/publish/request_receiver.h"
#include "gateway/runtime/binder.h"
#include "gateway/runtime/executor.h"
#include "gateway/runtime/line_host.h"
#include "gateway/runtime/line_runner.h"
#include "gateway/runtime/recorder.h"
#include "gateway/runtime/route_links.h"
#include "gateway/runtime/signals.h"
#include "gateway/runtime/storage_thread.h"
#include "stack/base/diagnostic.h"
#include "stack/line/line.h"

namespace linegate::gateway {

// The reply to request::Versions, and the output of --version.
std::string versions();

class Gateway {
 public:
  // Creates all parts and starts none. incarnation: random for each start, not 0.
  static Loaded<std::unique_ptr<Gateway>> make(const config::Plant& plant,
                                               std::uint64_t incarnation);
  ~Gateway();
  Gateway(const Gateway&) = delete;
  Gateway& operator=(const Gateway&) = delete;

  void start();
  // Stops in order: the request receiver, the lines, and the publisher after the last events.
  void stop();

  // Changes the running gateway to the configuration `wanted`; unchanged lines are not touched.
  // Errors in the diagnostics were found before anything was changed. Call it from the thread that
  // called start(), at run time.
  struct Reload {
    std::vector<Diagnostic> diagnostics;
    config::PlanDifference difference;
    bool done = false;
  };
  Reload reload(const config::Plant& wanted);
  // The process that requested the next reload, for its event; nothing: not known.
  void set_reload_sender(const std::optional<SignalSender>& sender);
  // A configuration could not be read: reports this to subscribers, like a failed reload().
  void refuse_reload(const std::vector<Diagnostic>& diagnostics);

  // Makes lines anew from scans that were applied. Returns diagnostics; nothing if there were no
  // scans. Call it periodically from the thread that called start(), at run time.
  std::optional<std::vector<Diagnostic>> apply_scans();

  // Reports conditions of the journal as events of the gateway. Call it periodically from the
  // thread that called start().
  void report_journal();
  // Reports ends of the DDS process as events of the gateway. Call it likewise.
  void report_edge();
  // What the DDS processes lack to work, in words; none while they work.
  std::vector<std::string> edge_conditions() const;

  // The threads that must respond for the gateway to work. Excludes the threads that wait for
  // disks.
  std::vector<WatchedThread> threads();
  // All lines as last published, in the order of the configuration. For one thread only.
  std::vector<ShownLine> shown_lines();

 private:
  // A line that was created and does not run yet.
  struct NewLine {
    std::unique_ptr<line::Line> line;
    std::unique_ptr<LineHost> host;
    std::unique_ptr<LineRunner> runner;  // owns the line once it exists
  };

  Gateway() = default;
  static std::vector<NewLine> make_lines(const config::Plant& plant,
                                         const std::vector<std::string>& names,
                                         std::vector<Diagnostic>& diagnostics);
  // Updates hosts_ to the plant: keeps present lines and adds the new ones.
  std::vector<Diagnostic> apply_lines(std::vector<NewLine> lines, const config::Plant& plant);
  // Adds it to its executor when all runners exist, because they may call each other.
  void offer_named_groups(const LineHost& host, std::vector<Diagnostic>& diagnostics);
  void make_runner(NewLine& made, std::vector<Diagnostic>& diagnostics);
  // Links the bindings between two lines of which at least one is new. stay: the lines that are not
  // new.
  void link_lines(const config::Plant& plant, const std::vector<NewLine>& lines,
                  const std::vector<std::unique_ptr<LineHost>>& stay);
  // Adds new links to the remaining lines. Call it when all runners exist.
  void bind_ends(const std::vector<const BoundLink*>& known, const std::vector<LineHost*>& started);
  // Removes links to the stopping lines from the remaining ones: before the stop those that send to
  // the stopping lines, after it (stopped) those that receive from them.
  void unbind_ends(const std::vector<std::string>& go, bool stopped);
  void set_routes(const std::vector<std::string>& names, const config::Plant& wanted);
  // Adds links between the lines that route if at least one of the two was just added to its
  // executor.
  void join_routes(const std::vector<LineHost*>& started);
  void add_route_link(LineHost& from, LineHost& to);
  // Informs the remaining lines that those lines were removed.
  void leave_routes(const std::vector<std::string>& names);
  Executor& executor_for(const config::Plant& plant, const config::LinePlan& line);
  // The storage of the line's own nodes; empty if there is none.
  std::vector<NodeStorage> storage_for(const LineHost& host, std::vector<Diagnostic>& diagnostics);
  void run_devices(LineHost& host, std::vector<Diagnostic>& diagnostics);
  // Stops those lines in an orderly way. Their last data stays available to the publisher.
  void stop_lines(const std::vector<std::string>& names);
  // Removes lines that have stopped, while the publisher is stopped.
  void forget_lines(const std::vector<std::string>& names);
  LineHost& host(const std::string& name);
  // Removes and adds lines while the others run.
  void change(const std::vector<std::string>& go, const std::vector<std::string>& come,
              std::vector<NewLine> lines, const config::Plant& wanted,
              std::vector<Diagnostic>& diagnostics, const std::vector<std::string>& rerouted = {});
  void report(const EventData& what, std::string text);
  void stop_journal();
  void apply_scan(const std::string& name, const AppliedScan& scan,
                  std::vector<Diagnostic>& diagnostics);
  // Moves waiting commands of a line to its replacement, which does not run yet. Call it while the
  // request receiver is stopped.
  void hand_on_commands(LineHost& from, LineHost& to);
  // The running lines, only by name, with this line's plan.
  config::Plant plant_with(config::LinePlan line) const;
  // The channel of the line's interface, recorded if configured.
  std::unique_ptr<can_bridge::Channel> channel_for(LineHost& host);

  struct NamedExecutor {
    std::string name;
    std::unique_ptr<Executor> executor;
  };

  // In the order of their dependencies.
  sim::VirtualNetwork network_;
  std::unique_ptr<DataEdge> edge_;
  std::vector<std::unique_ptr<LineHost>> hosts_;
  std::vector<std::unique_ptr<BoundLink>> links_;
  std::vector<std::unique_ptr<RouteLink>> route_links_;
  std::unique_ptr<JournalThread> journal_;  // if configured
  std::unique_ptr<Publisher> publisher_;
  std::unique_ptr<JournalServer> pages_;     // with the journal
  std::shared_ptr<ProcessEnds> peer_ends_ =  // of the process of peers_
      std::make_shared<ProcessEnds>(event::DdsProcess::routes);
  std::unique_ptr<PeerThread> peers_;  // outlives the executors, which wake it
  StorageThread storage_;
  Recorder recorder_;
  std::vector<NamedExecutor> executors_;
  std::unique_ptr<Executor> devices_;
  std::unique_ptr<RequestReceiver> requests_;
  GatewayInfo info_;
  std::optional<SignalSender> reload_sender_;
  config::PlantIdentity identity_;                    // of the present configuration
  std::vector<config::ExecutorPlan> executor_plans_;  // of the present configuration
};

}  // namespace linegate::gateway
