// SPDX-License-Identifier: Apache-2.0
// A subscriber that has each event of a line once, in order, whatever it missed.
//
//   event_reader DOMAIN PROFILES GATEWAY LINE [STREAM NUMBER]
//
// Begins after the event with that stream (hexadecimal) and number, or with the first that it
// receives. Prints "event STREAM NUMBER KIND" for each event, "missing STREAM FIRST LAST" for
// numbers that do not exist, and "stream BEFORE NOW lost" or "kept", until it is ended.
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "bridges/dds/client.h"

namespace linegate {
namespace {

class Printer final : public dds::ClientListener {
 public:
  explicit Printer(std::string line) : line_(std::move(line)) {}

  void on_event(const dds::Source& source, const dds::ReceivedEvent& event,
                std::string_view /*text*/, const std::vector<dds::Property>&) override {
    if (source.line == line_)
      std::printf("event %016" PRIx64 " %" PRIu64 " %s\n", event.stream, event.number,
                  std::string(name(event.kind)).c_str());
  }
  void on_events_missing(const dds::Source& source, std::uint64_t stream, std::uint64_t first,
                         std::uint64_t last) override {
    if (source.line == line_)
      std::printf("missing %016" PRIx64 " %" PRIu64 " %" PRIu64 "\n", stream, first, last);
  }
  void on_event_stream(const dds::Source& source, std::uint64_t before, std::uint64_t now,
                       bool lost) override {
    if (source.line == line_)
      std::printf("stream %016" PRIx64 " %016" PRIx64 " %s\n", before, now, lost ? "lost" : "kept");
  }

 private:
  std::string line_;
};

int run(int argc, char** argv) {
  if (argc != 5 && argc != 7) {
    std::fprintf(stderr, "usage: %s DOMAIN PROFILES GATEWAY LINE [STREAM NUMBER]\n", argv[0]);
    return 2;
  }
  auto made =
      dds::Client::make({.domain = static_cast<std::uint32_t>(std::strtoul(argv[1], nullptr, 10)),
                         .profile_file = argv[2],
                         .images = false,
                         .pdos = false,
                         .receptions = false,
                         .complete_events = true});
  if (!made.value) {
    for (const Diagnostic& diagnostic : made.diagnostics)
      std::fprintf(stderr, "%s\n", to_string(diagnostic).c_str());
    return 1;
  }
  dds::Client& client = **made.value;
  if (argc == 7) {
    client.begin_events_after(
        argv[3], argv[4],
        {std::strtoull(argv[5], nullptr, 16), std::strtoull(argv[6], nullptr, 10)});
  }
  Printer printer(argv[4]);
  for (;;) {
    client.poll(std::chrono::milliseconds(100), printer);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace linegate

int main(int argc, char** argv) {
  return linegate::run(argc, argv);
}
