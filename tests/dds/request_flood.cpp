// SPDX-License-Identifier: Apache-2.0
// A client that sends more requests to a line than the line serves.
//
//   request_flood KIND GATEWAY LINE NODE RATE SECONDS DOMAIN PROFILES
//
// KIND: nmt, can, sdo or outputs. RATE: requests a second; a process that is too slow for it sends
// as many as it can. Prints {"kind", "sent", "done", "busy", "other"} as JSON at its end: how many
// requests were sent, and how they were answered. An OutputWrite has no answer.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include "bridges/dds/client.h"

namespace linegate {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::uint32_t kFreeIdentifier = 0x101;  // precedes all but NMT and SYNC
constexpr int kAtOnce = 100;                      // requests between two looks at the answers
constexpr Duration kPatience = std::chrono::seconds(60);

struct Answers : dds::ClientListener {
  std::uint64_t done = 0;
  std::uint64_t busy = 0;
  std::uint64_t other = 0;
  std::map<std::string, image::Layout> outputs{};  // by line

  void on_reply(const dds::Target&, const dds::CommandResult& result) override {
    const bool is_busy = result.reply.error == line::to_error(line::Refusal::busy);
    ++(result.reply.ok() ? done : is_busy ? busy : other);
  }
  void on_layout(const dds::Source& source, const image::Layout& layout) override {
    if (layout.direction == image::Direction::outputs) {
      outputs[source.line] = layout;
    }
  }
};

class Flood {
 public:
  Flood(std::string kind, dds::Target target, std::uint8_t node)
      : kind_(std::move(kind)), target_(std::move(target)), node_(node) {}

  bool connect(std::uint32_t domain, const char* profiles) {
    auto made = dds::Client::make({.name = "flood-" + kind_,
                                   .domain = domain,
                                   .profile_file = profiles,
                                   .images = false,
                                   .pdos = false,
                                   .receptions = false,
                                   .events = false,
                                   .outputs = kind_ == "outputs",
                                   .output_strength = 1});
    if (!made.value) {
      return false;
    }
    client_ = *std::move(made.value);
    for (const auto end = Clock::now() + kPatience; !is_connected();) {
      if (Clock::now() > end) {
        return false;
      }
      client_->poll(std::chrono::milliseconds(100), answers_);
    }
    return true;
  }

  void run(double rate, double seconds) {
    const auto begin = Clock::now();
    const auto elapsed = [&] {
      return std::chrono::duration<double>(Clock::now() - begin).count();
    };
    while (elapsed() < seconds) {
      for (int i = 0; i < kAtOnce && static_cast<double>(sent_) < rate * elapsed(); ++i) {
        send();
      }
      client_->poll(std::chrono::milliseconds(1), answers_);
    }
    std::printf(R"({"kind": "%s", "sent": %llu, "done": %llu, "busy": %llu, "other": %llu})"
                "\n",
                kind_.c_str(), to_print(sent_), to_print(answers_.done), to_print(answers_.busy),
                to_print(answers_.other));
  }

 private:
  static unsigned long long to_print(std::uint64_t number) { return number; }

  bool is_connected() const {
    return kind_ == "outputs"
               ? client_->output_peers() > 0 && answers_.outputs.contains(target_.line)
               : client_->command_peers() > 0;
  }

  line::Request request() const {
    if (kind_ == "nmt") {
      return line::NmtRequest{.node = node_, .command = nmt::Command::start};
    }
    if (kind_ == "can") {
      return line::CanSend{.frame = {.id = kFreeIdentifier, .length = 8}};
    }
    return line::SdoRead{.node = node_, .address = {0x1000, 0}};
  }

  void send() {
    ++sent_;
    if (kind_ != "outputs") {
      client_->send(target_, {.request = request()}, kPatience);
      return;
    }
    const image::Layout& layout = answers_.outputs[target_.line];
    line::OutputWrite write{.layout_id = layout.id, .arming = 1};
    for (std::uint32_t i = 0; i < layout.entries.size(); ++i) {
      line::OutputValue value{
          .entry = i, .length = static_cast<std::uint8_t>(layout.entries[i].bit_length / 8)};
      value.data[0] = static_cast<std::byte>(sent_);
      write.values.push_back(value);
    }
    client_->write_outputs(target_, write);
  }

  std::string kind_;
  dds::Target target_;
  std::uint8_t node_;
  Answers answers_;
  std::unique_ptr<dds::Client> client_;
  std::uint64_t sent_ = 0;
};

}  // namespace
}  // namespace linegate

int main(int argc, char** argv) {
  if (argc != 9) {
    std::fprintf(stderr, "request_flood KIND GATEWAY LINE NODE RATE SECONDS DOMAIN PROFILES\n");
    return 2;
  }
  const auto number = [&](int i) { return std::strtoul(argv[i], nullptr, 10); };
  linegate::Flood flood(argv[1], {.gateway = argv[2], .line = argv[3]},
                        static_cast<std::uint8_t>(number(4)));
  if (!flood.connect(static_cast<std::uint32_t>(number(7)), argv[8])) {
    std::fprintf(stderr, "the line %s of the gateway %s was not found\n", argv[3], argv[2]);
    return 1;
  }
  flood.run(std::strtod(argv[5], nullptr), std::strtod(argv[6], nullptr));
}
