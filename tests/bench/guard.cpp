// SPDX-License-Identifier: Apache-2.0
// The cost of the guard of bridges/dds: the time to judge a datagram, and the CPU time of a process
// that reads 10,000 samples a second, compared with one without a guard that reads the same
// samples.
//
//   measure_guard                      runs all measurements
//   measure_guard reader on|off DOMAIN the reading processes: print one figure a second
#include "bridges/dds/guard/guard.h"

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <fastdds/dds/core/status/PublicationMatchedStatus.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <linegatePubSubTypes.h>
#include <sys/resource.h>

#include "bridges/dds/endpoints.h"

#include "tests/bench/measure.h"
#include "tests/dds/guard/datagram.h"
#include "tests/dds/own_domain.h"
#include "tests/paths.h"

namespace linegate::bench {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr int kRate = 10'000;  // samples a second
constexpr int kSeconds = 8;
constexpr int kPatience = 40;    // seconds that a reader waits for the first sample
constexpr int kPause = 3;        // seconds without a sample after which a reader ends
constexpr double kBudget = 3.0;  // percent of a core

double cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) / 1e6;
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

v1::ProcessImage make_sample() {
  v1::ProcessImage sample;
  sample.gateway("bench");
  sample.line("bench");
  sample.direction(v1::DIRECTION_INPUTS);
  sample.incarnation(1);
  sample.bytes().resize(64);
  return sample;
}

// --- the readers ---------------------------------------------------------------------------------

int read(bool guarded, std::uint32_t domain) {
  std::vector<Diagnostic> diagnostics;
  dds::Endpoints endpoints("reader", domain, paths::kLoopbackProfiles, diagnostics, guarded);
  auto* reader = endpoints.reader<v1::ProcessImagePubSubType>(v1::TOPIC_PROCESS_IMAGE);
  require(endpoints.ok(), "no DDS reader");
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  v1::ProcessImage sample;
  eprosima::fastdds::dds::SampleInfo info;
  // Includes samples that were replaced before they were taken (KEEP_LAST 1).
  std::uint64_t samples = 0;
  std::uint64_t newest = 0;
  double cpu = 0;
  auto begin = Clock::now();
  for (int idle = 0; idle < kPatience;) {
    while (reader->take_next_sample(&sample, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data)
        continue;
      samples += newest == 0 ? 1 : sample.sequence_number() - newest;
      newest = sample.sequence_number();
    }
    const std::chrono::duration<double> elapsed = Clock::now() - begin;
    if (elapsed.count() >= 1) {
      const double now = cpu_seconds();
      std::printf("%.3f %llu\n", (now - cpu) / elapsed.count() * 100,
                  static_cast<unsigned long long>(samples));
      cpu = now;
      idle = samples == 0 ? idle + 1 : kPatience - kPause;
      samples = 0;
      begin = Clock::now();
    }
    std::this_thread::sleep_for(500us);
  }
  return 0;
}

// The figures of a reader, for those seconds in which it received about all samples.
std::vector<double> figures(std::FILE* reader) {
  std::vector<double> out;
  double cpu = 0;
  unsigned long long samples = 0;
  while (std::fscanf(reader, "%lf %llu", &cpu, &samples) == 2) {
    if (samples > kRate / 2)
      out.push_back(cpu);
  }
  ::pclose(reader);
  return out;
}

void compare_readers(const std::string& self) {
  const std::uint32_t domain = test::own_domain();
  const auto start = [&](const char* guard) {
    const std::string command = self + " reader " + guard + " " + std::to_string(domain);
    return ::popen(command.c_str(), "r");
  };
  std::FILE* const on = start("on");
  std::FILE* const off = start("off");
  require(on != nullptr && off != nullptr, "a reader cannot be started");
  {
    std::vector<Diagnostic> diagnostics;
    dds::Endpoints endpoints("writer", domain, paths::kLoopbackProfiles, diagnostics);
    auto* writer = endpoints.writer<v1::ProcessImagePubSubType>(v1::TOPIC_PROCESS_IMAGE);
    require(endpoints.ok(), "no DDS writer");
    eprosima::fastdds::dds::PublicationMatchedStatus status;
    const auto deadline = Clock::now() + 30s;
    while (status.current_count < 2 && Clock::now() < deadline) {
      std::this_thread::sleep_for(10ms);
      writer->get_publication_matched_status(status);
    }
    require(status.current_count == 2, "the readers are not found");
    v1::ProcessImage sample = make_sample();
    auto next = Clock::now();
    for (int i = 0; i < kRate * kSeconds; ++i) {
      sample.sequence_number(sample.sequence_number() + 1);
      writer->write(&sample);
      next += std::chrono::nanoseconds(1'000'000'000 / kRate);
      if (next > Clock::now())
        std::this_thread::sleep_until(next);
    }
  }
  const std::vector<double> guarded = figures(on);
  const std::vector<double> bare = figures(off);
  require(!guarded.empty() && !bare.empty(), "the readers did not keep up with the writer");
  std::printf("reader with guard     %6.2f %% of a core at %d samples/s\n", median(guarded), kRate);
  std::printf("reader without guard  %6.2f %%\n", median(bare));
  print_target("guard at 10,000 samples/s", median(guarded) - median(bare), kBudget, "% of a core");
}

// --- one datagram --------------------------------------------------------------------------------

double judge_once(dds::guard::Guard& guard, std::vector<std::uint8_t>& octets, bool with_clock) {
  constexpr int kPasses = 100'000;
  const auto begin = Clock::now();
  std::uint64_t dropped = 0;
  dds::guard::PassedOn out;
  for (int i = 0; i < kPasses; ++i) {
    const auto now = with_clock ? Clock::now() : begin;
    const auto verdict = guard.judge(octets, now.time_since_epoch().count(), {}, &out);
    dropped += verdict.reason == dds::guard::Reason::none ? 0U : 1U;
  }
  require(dropped == 0, "the guard drops a good datagram");
  const std::chrono::duration<double, std::nano> elapsed = Clock::now() - begin;
  return elapsed.count() / kPasses;
}

void measure_datagram() {
  using test::Fields;
  dds::guard::Guard guard(false);
  const Fields qos = Fields().parameter(0x70, Fields().zeros(16)).sentinel();
  test::Datagram datagram;
  datagram.add(0x0E, Fields().zeros(12))
      .add(0x09, Fields().zeros(8))
      .add(0x15, test::data(7).octets(qos.get()).zeros(120), test::kHasInlineQos | test::kHasData)
      .add(0x07, test::heartbeat(7, 7));
  std::vector<std::uint8_t> copy(datagram.get().size());
  std::vector<Contestant> contestants;
  contestants.push_back({"judge a datagram of 4 submessages",
                         [&] { return judge_once(guard, datagram.get(), true); },
                         {}});
  contestants.push_back({"copy its octets",
                         [&] {
                           const auto begin = Clock::now();
                           for (int i = 0; i < 100'000; ++i) {
                             std::memcpy(copy.data(), datagram.get().data(), copy.size());
                             asm volatile("" : : "r"(copy.data()) : "memory");
                           }
                           const std::chrono::duration<double, std::nano> elapsed =
                               Clock::now() - begin;
                           return elapsed.count() / 100'000;
                         },
                         {}});
  interleave(contestants);
  for (const Contestant& it : contestants)
    print_figure(it, "ns");
}

}  // namespace
}  // namespace linegate::bench

int main(int argc, char** argv) {
  using namespace linegate::bench;
  if (argc == 4 && std::string_view(argv[1]) == "reader") {
    return read(std::string_view(argv[2]) == "on",
                static_cast<std::uint32_t>(std::strtoul(argv[3], nullptr, 10)));
  }
  print_heading("guard of bridges/dds");
  measure_datagram();
  compare_readers(argv[0]);
  return 0;
}
