// The gateway as a whole: a plant, running.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bridges/dds/publisher.h"
#include "bridges/sim/virtual_channel.h"
#include "gateway/config/plant.h"
#include "gateway/executor.h"
#include "gateway/intake.h"
#include "gateway/line_host.h"
#include "gateway/parameter_keeper.h"
#include "gateway/progress_watch.h"
#include "gateway/publisher.h"
#include "gateway/status_text.h"
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

  // Those that must go round for the gateway to do its work. Not the one that waits for disks.
  std::vector<WatchedThread> threads();
  // All lines as they were published last, in the order of the configuration. By one thread.
  std::vector<ShownLine> shown_lines();

 private:
  Gateway() = default;
  std::vector<Diagnostic> make_lines(const config::Plant& plant);
  std::vector<Diagnostic> make_bridge(const config::Plant& plant, std::uint64_t incarnation);
  Executor& executor_for(const config::Plant& plant, const config::LinePlan& line);
  // Where the line's own node stores; nullptr if nowhere.
  KeptFile* storage_for(const LineHost& host, std::vector<Diagnostic>& diagnostics);
  std::vector<Diagnostic> add_devices(const config::LinePlan& line);

  struct NamedExecutor {
    std::string name;
    std::unique_ptr<Executor> executor;
  };

  // In the order in which they depend on each other.
  sim::VirtualNetwork network_;
  std::unique_ptr<dds::GatewayBridge> bridge_;
  std::vector<std::unique_ptr<line::Line>> lines_;  // until the executors have them
  std::vector<std::unique_ptr<LineHost>> hosts_;
  std::unique_ptr<Publisher> publisher_;
  ParameterKeeper keeper_;
  std::vector<NamedExecutor> executors_;
  std::unique_ptr<Executor> devices_;
  std::unique_ptr<Intake> intake_;
};

}  // namespace linegate::gateway
