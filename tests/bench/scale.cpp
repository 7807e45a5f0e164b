// SPDX-License-Identifier: Apache-2.0
// The scale of one gateway: lines at the load of a full bus at 1 Mbit/s each, published on change
// every 1 ms, to readers in processes of their own. Processor time of the gateway for a frame, from
// the wire to the sample, beside bare loops that read the same frames and write samples of the same
// size, QoS and number with Fast DDS, in the same run.
//
//   measure_scale [--seconds 4] [--lines 8] [READERS...]
//
// The readers are on this host, by UDP: what the kernel does to deliver a datagram to a reader
// counts as processor time of its writer, alike on both sides.
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <unistd.h>

#include "tests/bench/image_counts.h"
#include "tests/bench/load_sender.h"
#include "tests/bench/processes.h"
#include "tests/bench/sample_course.h"
#include "tests/paths.h"

namespace linegate::bench {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kPdosOfLine = 64;
constexpr std::size_t kMostReaders = 100;
constexpr auto kSeparation = 1ms;  // of the images of a line
constexpr auto kToMatch = 60s;

enum class Way : std::uint8_t { bare, same, own };
constexpr std::array<const char*, 3> kWays{"bare loops", "gateway, process: same",
                                           "gateway, process: own"};

struct Options {
  std::uint32_t seconds = 4;
  std::size_t lines = 8;
  std::vector<std::size_t> readers;
};

// Of all processes.
struct Shared {
  std::atomic<bool> go{false};
  std::atomic<bool> done{false};
  double time = 0;            // us, of the writer
  std::uint64_t frames = 0;   // sent
  std::uint64_t refused = 0;  // by the socket of a line
  std::uint64_t late_ms = 0;  // of the sender: frames that were never sent
  std::array<ImageCounts, kMostReaders> readers;
};

std::string name_of_line(std::size_t number) {
  return "line" + std::to_string(number);
}

void await(const std::function<bool()>& condition, const char* otherwise) {
  const auto until = std::chrono::steady_clock::now() + kToMatch;
  while (!condition()) {
    require(std::chrono::steady_clock::now() < until, otherwise);
    std::this_thread::sleep_for(10ms);
  }
}

// --- the writers --------------------------------------------------------------------------------

// A line: a thread that reads frames and writes a sample of them every kSeparation.
class BareLine {
 public:
  BareLine(SampleEndpoints& endpoints, std::size_t number, int far)
      : samples_(endpoints, name_of_line(number), kPdosOfLine), far_(far) {
    const std::vector<std::uint32_t> ids = pdo_identifiers(kPdosOfLine);
    for (std::size_t i = 0; i < ids.size(); ++i) {
      positions_[ids[i]] = static_cast<std::uint8_t>(i);
    }
    samples_.write();  // so that a reader sees the line, as that of a gateway
    thread_ = std::thread([this] { run(); });
  }
  ~BareLine() {
    stop_ = true;
    thread_.join();
    close(far_);
  }
  BareLine(const BareLine&) = delete;
  BareLine& operator=(const BareLine&) = delete;

 private:
  void run() {
    BareLoop loop(far_);
    auto due = std::chrono::steady_clock::now();
    bool changed = false;
    while (!stop_) {
      loop.wait(changed ? (due - std::chrono::steady_clock::now()).count() : 100'000'000);
      loop.drain([&](const can_frame& frame, std::int64_t) {
        samples_.take(positions_[frame.can_id & CAN_SFF_MASK], frame);
        changed = true;
      });
      const auto now = std::chrono::steady_clock::now();
      if (changed && now >= due) {
        samples_.write();
        changed = false;
        due = now + kSeparation;
      }
    }
  }

  LineSamples samples_;
  const int far_;
  std::array<std::uint8_t, CAN_SFF_MASK + 1> positions_{};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

// Waits for the readers, sends the frames, and notes the processor time of this process.
void measure_load(Shared& shared, LoadSender& sender, const Options& options) {
  await([&] { return shared.go.load(); }, "the readers do not receive each line");
  const double before = processor_time_of_all(getpid(), sender.process());
  sender.go(options.seconds, 0);
  std::uint64_t late = 0;
  for (const SenderReport& line : sender.wait(late)) {
    shared.frames += line.sent;
    shared.refused += line.refused;
  }
  shared.time = processor_time_of_all(getpid(), sender.process()) - before;
  shared.late_ms = late / 1'000'000;
  shared.done = true;
  pause();
}

config::Plant plant_of(std::size_t lines, std::uint32_t domain, bool own_process) {
  config::Plant plant;
  plant.gateway = "gateway";
  plant.dds_domain = domain;
  plant.dds_own_process = own_process;
  for (std::size_t i = 0; i < lines; ++i) {
    config::LinePlan& plan = plant.lines.emplace_back();
    plan.config = pdo_line(Mapping::event_driven, pdo_identifiers(kPdosOfLine));
    plan.config.name = name_of_line(i);
    plan.publish = {config::Publish::Rule::on_change, kSeparation};
  }
  return plant;
}

void run_writer(Way way, std::uint32_t domain, const Options& options, Shared& shared) {
  require(std::freopen("/dev/null", "w", stdout) != nullptr, "no /dev/null");  // its log
  std::vector<std::unique_ptr<Wire>> wires;
  std::vector<int> far;
  for (std::size_t i = 0; i < options.lines; ++i) {
    wires.push_back(std::make_unique<Wire>());
    far.push_back(wires.back()->far());
  }
  LoadSender sender(wires, kPdosOfLine);  // forks, so it must precede any thread
  if (way == Way::bare) {
    SampleEndpoints endpoints("bare", domain);
    std::vector<std::unique_ptr<BareLine>> lines;
    sender.wait_ready();
    for (std::size_t i = 0; i < far.size(); ++i) {
      lines.push_back(std::make_unique<BareLine>(endpoints, i, far[i]));
    }
    measure_load(shared, sender, options);
    return;
  }
  LineGateway gateway(plant_of(options.lines, domain, way == Way::own), far);
  sender.wait_ready();
  await([&] { return gateway.run(); }, "the managers do not run");
  measure_load(shared, sender, options);
}

// --- the readers --------------------------------------------------------------------------------

void run_reader(std::uint32_t domain, ImageCounts& counts) {
  dds::ClientOptions options;
  options.domain = domain;
  options.profile_file = paths::kLoopbackProfiles;
  options.lines = options.nodes = options.layouts = options.pdos = false;
  options.receptions = options.events = options.commands = false;
  auto client = dds::Client::make(options);
  require(client.ok(), "no DDS client");
  ImageCounter images(counts);
  for (;;) {
    (*client.value)->poll(100ms, images);
  }
}

// --- the measurement ----------------------------------------------------------------------------

struct Figure {
  double of_frame = 0;   // us
  double of_sample = 0;  // us
  double samples = 0;    // a second
  double lost = 0;       // of all samples, as a fraction
  std::uint64_t refused = 0;
  std::uint64_t late_ms = 0;
};

std::uint64_t sum(const Shared& shared, std::atomic<std::uint64_t> ImageCounts::*member) {
  std::uint64_t out = 0;
  for (const ImageCounts& reader : shared.readers) {
    out += reader.*member;
  }
  return out;
}

Figure measure(Way way, std::uint32_t domain, std::size_t readers, const Options& options) {
  auto& shared = make_shared_with_children<Shared>();
  const pid_t writer = start_process([&] { run_writer(way, domain, options, shared); });
  std::vector<pid_t> clients;
  for (std::size_t i = 0; i < readers; ++i) {
    clients.push_back(start_process([&] { run_reader(domain, shared.readers[i]); }));
  }
  await(
      [&] {
        return std::ranges::all_of(
            std::span(shared.readers).first(readers),
            [&](const ImageCounts& reader) { return reader.lines == options.lines; });
      },
      "a reader does not receive each line");
  std::this_thread::sleep_for(2s);  // announcements at the start
  const std::uint64_t before = sum(shared, &ImageCounts::received);
  shared.go = true;
  await([&] { return shared.done.load(); }, "the frames were not sent");
  std::this_thread::sleep_for(500ms);  // until the last samples are received
  const auto received = static_cast<double>(sum(shared, &ImageCounts::received) - before);
  const auto lost = static_cast<double>(sum(shared, &ImageCounts::lost));
  for (const pid_t client : clients) {
    end_process(client);
  }
  end_process(writer);
  require(shared.frames != 0 && received > 0, "nothing was sent, or nothing received");
  const double samples = (received + lost) / static_cast<double>(readers);
  return {.of_frame = shared.time / static_cast<double>(shared.frames),
          .of_sample = shared.time / samples,
          .samples = samples / options.seconds,
          .lost = lost / (received + lost),
          .refused = shared.refused,
          .late_ms = shared.late_ms};
}

void print(std::size_t readers, const std::array<Figure, kWays.size()>& figures) {
  print_heading(std::to_string(readers) + (readers == 1 ? " reader" : " readers"));
  for (std::size_t i = 0; i < figures.size(); ++i) {
    const Figure& one = figures[i];
    std::printf(
        "  %-24s %7.2f us a frame %5.2f x; %7.1f us a sample %5.2f x; %6.0f samples/s, %.1f %% "
        "lost by readers; %llu frames refused, sender late by %llu ms\n",
        kWays[i], one.of_frame, one.of_frame / figures[0].of_frame, one.of_sample,
        one.of_sample / figures[0].of_sample, one.samples, 100 * one.lost,
        static_cast<unsigned long long>(one.refused), static_cast<unsigned long long>(one.late_ms));
  }
}

bool parse(int argc, char** argv, Options& out) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    const bool is_option = word == "--seconds" || word == "--lines";
    if (is_option && i + 1 == argc) {
      return false;
    }
    const auto number = std::strtoul(argv[is_option ? ++i : i], nullptr, 10);
    if (number == 0) {
      return false;
    }
    if (word == "--seconds") {
      out.seconds = static_cast<std::uint32_t>(number);
    } else if (word == "--lines") {
      out.lines = number;
    } else if (number <= kMostReaders) {
      out.readers.push_back(number);
    } else {
      return false;
    }
  }
  if (out.readers.empty()) {
    out.readers = {1, 10};
  }
  return true;
}

int run(int argc, char** argv) {
  if (argc == 2 && std::string_view(argv[1]) == gateway::kDdsProcessArgument) {
    gateway::run_dds_process();
  }
  Options options;
  if (!parse(argc, argv, options)) {
    std::fprintf(stderr,
                 "usage: measure_scale [--seconds N] [--lines N] [READERS up to 100 ...]\n");
    return 2;
  }
  std::printf("%zu lines at %lld frames/s each, images on change every %lld ms\n", options.lines,
              static_cast<long long>(kFramesPerSecond),
              static_cast<long long>(kSeparation.count()));
  std::uint32_t domain = 100 + static_cast<std::uint32_t>(getpid()) % 60;
  for (const std::size_t readers : options.readers) {
    std::array<Figure, kWays.size()> figures;
    for (const Way way : {Way::bare, Way::same, Way::own}) {
      figures[static_cast<std::size_t>(way)] = measure(way, domain++, readers, options);
    }
    print(readers, figures);
  }
  return 0;
}

}  // namespace
}  // namespace linegate::bench

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  return linegate::bench::run(argc, argv);
}
