// SPDX-License-Identifier: Apache-2.0
// The jitter of the SYNC period while the SDO transfers of its producer use the whole bus, compared
// with a bare loop on the same kind of wire:
//
//   measure_sync_jitter [--repetitions 31]
//
// The line: a manager, run by an executor, produces SYNC and uploads DOMAINs of 8 devices, by
// commands through its port. The bare loop: one thread waits with epoll_pwait2 for its socket and
// the next absolute time, like an executor, writes one frame at that time, and answers the same
// devices frame by frame. Both have the same bus at 1 Mbit/s (sdo_bus.h).
//
// Jitter: the difference between the interval of two SYNCs and the period. The times are those of
// the kernel, when the frame was written to the socket; the reading thread has no influence on
// them.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "gateway/runtime/clock.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"

#include "tests/bench/bare_loop.h"
#include "tests/bench/bare_uploads.h"
#include "tests/bench/measure.h"
#include "tests/bench/sdo_bus.h"
#include "tests/bench/upload_line.h"

namespace {

using namespace linegate;
using bench::Contestant;
using namespace std::chrono_literals;

constexpr Duration kPeriod = 1ms;
constexpr std::size_t kIntervals = 1000;  // in one repetition
constexpr auto kWarmUp = 100ms;           // until the transfers use the whole bus

// --- the bare loop ------------------------------------------------------------------------------

class BareProducer {
 public:
  explicit BareProducer(int descriptor) : loop_(descriptor), descriptor_(descriptor) {}

  // Sends SYNCs and uploads until `stop`, and then waits until the uploads have ended.
  void run(const std::atomic<bool>& stop) {
    prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);  // like executors
    const auto send = [this](const can_frame& frame) {
      bench::require(::send(descriptor_, &frame, sizeof frame, 0) == sizeof frame,
                     "a frame was not sent");
    };
    for (std::uint8_t node = 1; node <= bench::kUploadNodes; ++node) {
      uploads_.begin(node, send);
    }
    Instant next = gateway::monotonic_now() + kPeriod;
    while (uploads_.under_way() > 0) {
      loop_.wait((next - gateway::monotonic_now()).count());
      if (const Instant now = gateway::monotonic_now(); now >= next) {
        send(sync());
        next = next_after(next, kPeriod, now);
      }
      loop_.drain([&](const can_frame& frame, std::int64_t) { uploads_.answer(frame, send); });
      if (stop) {
        uploads_.stop();
      }
    }
  }

  unsigned ended() const { return uploads_.ended(); }

 private:
  can_frame sync() {
    can_frame out{};
    out.can_id = can::kSyncId;
    out.len = 1;
    out.data[0] = counter_;
    counter_ = counter_ == bench::kSyncOverflow ? std::uint8_t{1}
                                                : static_cast<std::uint8_t>(counter_ + 1);
    return out;
  }

  bench::BareLoop loop_;
  int descriptor_;
  bench::BareUploads uploads_;
  std::uint8_t counter_ = 1;
};

// --- figures ------------------------------------------------------------------------------------

// One figure for each repetition of one contestant.
struct Figures {
  std::vector<double> p999;     // us
  std::vector<double> bus_use;  // percent
  std::vector<double> uploads;  // uploads that ended
  std::size_t left_out = 0;     // SYNCs that were so late that the next one replaced them

  // Removes the figures of the warm-up repetition.
  void forget_first() {
    for (std::vector<double>* const each : {&p999, &bus_use, &uploads}) {
      each->erase(each->begin());
    }
  }
};

void require_none_lost(const bench::SyncTimes& syncs) {
  for (std::size_t i = 0; i < syncs.counters.size(); ++i) {
    bench::require(syncs.counters[i] >= 1 && syncs.counters[i] <= bench::kSyncOverflow,
                   "a SYNC without its counter");
    bench::require(i == 0 || syncs.counters[i] == syncs.counters[i - 1] % bench::kSyncOverflow + 1,
                   "SYNCs were lost");
  }
}

// Returns the median of the jitter in us, and appends to the figures.
double evaluate(const bench::SyncTimes& syncs, double uploads, Figures& figures) {
  require_none_lost(syncs);
  bench::require(uploads > 0, "no SDO transfer has ended");
  std::vector<double> jitter;
  for (std::size_t i = 1; i < syncs.stamps.size(); ++i) {
    const std::int64_t late = syncs.stamps[i] - syncs.stamps[i - 1] - kPeriod.count();
    jitter.push_back(static_cast<double>(std::abs(late)) / 1000);
    figures.left_out += late > kPeriod.count() / 2 ? 1U : 0U;
  }
  std::sort(jitter.begin(), jitter.end());
  const auto rank = [&](std::size_t of_thousand) {
    return jitter[(jitter.size() * of_thousand + 999) / 1000 - 1];
  };
  figures.p999.push_back(rank(999));
  figures.bus_use.push_back(100 * syncs.bus_use);
  figures.uploads.push_back(uploads);
  return rank(500);
}

double measure_bare(bench::SdoBus& bus, Figures& figures) {
  BareProducer producer(bus.wire.far());
  std::atomic<bool> stop{false};
  std::thread thread([&] { producer.run(stop); });
  std::this_thread::sleep_for(kWarmUp);
  const bench::SyncTimes syncs = bus.record_syncs(kIntervals + 1);
  stop = true;
  thread.join();
  return evaluate(syncs, producer.ended(), figures);
}

double measure_line(bench::SdoBus& bus, bench::UploadLine& line, Figures& figures) {
  const std::uint64_t before = line.ended();
  line.start();
  std::this_thread::sleep_for(kWarmUp);
  const bench::SyncTimes syncs = bus.record_syncs(kIntervals + 1);
  line.stop();
  return evaluate(syncs, static_cast<double>(line.ended() - before), figures);
}

void print_side(const Contestant& p50, const Contestant& p999, const Figures& figures) {
  char note[120];
  std::snprintf(note, sizeof note,
                ", bus busy %.1f %% of the time, %.0f uploads ended, %zu left out",
                bench::median(figures.bus_use), bench::median(figures.uploads), figures.left_out);
  bench::print_figure({p50.name + ": p50", {}, p50.figures}, "us", note);
  bench::print_figure({p999.name + ": p99.9", {}, p999.figures}, "us");
}

int repetitions_of(int count, char** words) {
  if (count == 3 && std::string_view(words[1]) == "--repetitions") {
    return std::atoi(words[2]);
  }
  return count == 1 ? bench::kRepetitions : 0;
}

}  // namespace

int main(int count, char** words) {
  const int repetitions = repetitions_of(count, words);
  if (repetitions <= 0) {
    std::fprintf(stderr, "usage: measure_sync_jitter [--repetitions N]\n");
    return 2;
  }
  bench::SdoBus bare_bus;
  bare_bus.start();
  bench::SdoBus line_bus;
  bench::UploadLine line(line_bus, kPeriod);

  std::array<Figures, 2> figures;
  std::vector<Contestant> p50;
  p50.push_back({"bare loop", [&] { return measure_bare(bare_bus, figures[0]); }, {}});
  p50.push_back({"line", [&] { return measure_line(line_bus, line, figures[1]); }, {}});
  bench::interleave(p50, repetitions);

  bench::print_heading("SYNC every 1 ms, SDO uploads from 8 devices at 1 Mbit/s: period jitter");
  std::vector<Contestant> p999;
  for (std::size_t i = 0; i < 2; ++i) {
    figures[i].forget_first();
    p999.push_back({p50[i].name, {}, figures[i].p999});
    print_side(p50[i], p999[i], figures[i]);
  }
  bench::print_target("p50: to the bare loop", bench::median_ratio(p50[1], p50[0]), 1.3, "x");
  bench::print_target("p99.9: to the bare loop", bench::median_ratio(p999[1], p999[0]), 1.3, "x");
  bare_bus.stop();
  close(bare_bus.wire.far());
}
