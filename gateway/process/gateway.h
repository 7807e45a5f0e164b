// SPDX-License-Identifier: Apache-2.0
// The gateway as a whole: a plant, running.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridges/sim/virtual_channel.h"
#include "gateway/config/plan_difference.h"
#include "gateway/config/plant.h"
#include "gateway/process/progress_watch.h"
#include "gateway/process/status_text.h"
#include "gateway/publish/data_edge.h"
#include "gateway/publish/publisher.h"
#include "gateway/publish/request_receiver.h"
#include "gateway/runtime/binder.h"
#include "gateway/runtime/executor.h"
#include "gateway/runtime/line_host.h"
#include "gateway/runtime/line_runner.h"
#include "gateway/runtime/recorder.h"
#include "gateway/runtime/route_links.h"
#include "gateway/runtime/storage_thread.h"
#include "stack/base/diagnostic.h"
#include "stack/line/line.h"

namespace linegate::gateway {

// What CommandKind::versions answers, and --version.
std::string versions();

class Gateway {
 public:
  // Makes everything and starts nothing. incarnation: random per start, not 0.
  static Loaded<std::unique_ptr<Gateway>> make(const config::Plant& plant,
                                               std::uint64_t incarnation);
  ~Gateway();
  Gateway(const Gateway&) = delete;
  Gateway& operator=(const Gateway&) = delete;

  void start();
  // In good order: no more requests, then the lines, then the last events are published.
  void stop();

  // Makes of what runs what `wanted` says: lines that did not change are not touched. If there are
  // errors among the diagnostics, those before anything was changed. By the thread that started it,
  // while it runs.
  struct Reload {
    std::vector<Diagnostic> diagnostics;
    config::PlanDifference difference;
    bool done = false;
  };
  Reload reload(const config::Plant& wanted);
  // A configuration could not even be read: subscribers learn what reload() reports otherwise.
  void refuse_reload(const std::vector<Diagnostic>& diagnostics);

  // Lines of which a scan was applied are made anew with what it found. What there is to say of
  // that; nothing if there was none. By the thread that started it, while it runs: soon after.
  std::optional<std::vector<Diagnostic>> take_scans();

  // Those that must go round for the gateway to do its work. Not the one that waits for disks.
  std::vector<WatchedThread> threads();
  // All lines as they were published last, in the order of the configuration. By one thread.
  std::vector<ShownLine> shown_lines();

 private:
  // A line that has been made and does not run yet.
  struct NewLine {
    std::unique_ptr<line::Line> line;
    std::unique_ptr<LineHost> host;
    std::unique_ptr<LineRunner> runner;  // once there is one, it has the line
  };

  Gateway() = default;
  static std::vector<NewLine> make_lines(const config::Plant& plant,
                                         const std::vector<std::string>& names,
                                         std::vector<Diagnostic>& diagnostics);
  // hosts_ becomes what the plant says: of those that were there, and the new ones.
  std::vector<Diagnostic> take_in(std::vector<NewLine> lines, const config::Plant& plant);
  // On its executor once all are there: they may call each other.
  void make_runner(NewLine& made, std::vector<Diagnostic>& diagnostics);
  // What is bound between two lines of which one is new. `stay`: those that are not.
  void link_lines(const config::Plant& plant, const std::vector<NewLine>& lines,
                  const std::vector<std::unique_ptr<LineHost>>& stay);
  // Lines that stay get their ends of links that were not known before. Once all runners are there.
  void bind_ends(const std::vector<const BoundLink*>& known, const std::vector<LineHost*>& started);
  // Lines that stay lose the ends of links to those that go: first what the latter receive, and
  // once they have stopped what they sent.
  void unbind_ends(const std::vector<std::string>& go, bool stopped);
  void set_routes(const std::vector<std::string>& names, const config::Plant& wanted);
  // Links between the lines that route, as far as one of the two has just been put into its
  // executor.
  void join_routes(const std::vector<LineHost*>& started);
  void add_route_link(LineHost& from, LineHost& to);
  // Those that stay learn that those lines have gone.
  void leave_routes(const std::vector<std::string>& names);
  Executor& executor_for(const config::Plant& plant, const config::LinePlan& line);
  // Where the line's own node stores; nullptr if nowhere.
  std::vector<NodeStorage> storage_for(const LineHost& host, std::vector<Diagnostic>& diagnostics);
  void run_devices(LineHost& host, std::vector<Diagnostic>& diagnostics);
  // Stops those lines in good order. What they said last is there to be published.
  void stop_lines(const std::vector<std::string>& names);
  // Of lines that have stopped, while nothing is published.
  void forget_lines(const std::vector<std::string>& names);
  LineHost& host(const std::string& name);
  // Those lines go, and come as what has been made of them, while the others run on.
  void change(const std::vector<std::string>& go, const std::vector<std::string>& come,
              std::vector<NewLine> lines, const config::Plant& wanted,
              std::vector<Diagnostic>& diagnostics, const std::vector<std::string>& rerouted = {});
  void report(EventKind kind, std::size_t code, std::size_t value, std::string text);
  void take_scan(const std::string& name, const TakenScan& scan,
                 std::vector<Diagnostic>& diagnostics);
  // Commands that wait for a line go to the one that takes its place and does not run yet. While
  // nobody takes any from DDS.
  void hand_on_commands(LineHost& from, LineHost& to);
  // The lines that run, by their names alone, but for this one.
  config::Plant plant_with(config::LinePlan line) const;
  // The line's interface, recorded if the line is.
  std::unique_ptr<can_bridge::Channel> channel_for(LineHost& host);

  struct NamedExecutor {
    std::string name;
    std::unique_ptr<Executor> executor;
  };

  // In the order in which they depend on each other.
  sim::VirtualNetwork network_;
  std::unique_ptr<DataEdge> edge_;
  std::vector<std::unique_ptr<LineHost>> hosts_;
  std::vector<std::unique_ptr<BoundLink>> links_;
  std::vector<std::unique_ptr<RouteLink>> route_links_;
  std::unique_ptr<Publisher> publisher_;
  StorageThread storage_;
  Recorder recorder_;
  std::vector<NamedExecutor> executors_;
  std::unique_ptr<Executor> devices_;
  std::unique_ptr<RequestReceiver> requests_;
  GatewayInfo info_;
  config::PlantIdentity identity_;                    // of the configuration that runs
  std::vector<config::ExecutorPlan> executor_plans_;  // likewise
};

}  // namespace linegate::gateway
