// SPDX-License-Identifier: Apache-2.0
// CANopen FD. PDOs of 64 bytes to the image, 64 values of one byte each, half of the bytes
// changing, in batches of 64 frames: ns a frame. The floor finds the place by the identifier,
// copies the 64 bytes in words and sets the same marks; it has no protocol.
//
// USDO downloads and uploads in segments, 1 MB, between a client and a server that stream it, on
// the virtual bus in virtual time: the share of the time in which their frames occupy the wire,
// which is the floor.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "bridges/sim/bus.h"
#include "stack/image/process_image.h"
#include "stack/od/dictionary.h"
#include "stack/pdo/engine.h"
#include "stack/pdo/link.h"
#include "stack/usdo/client.h"
#include "stack/usdo/server.h"

#include "tests/bench/measure.h"
#include "tests/bench/pdo_line.h"
#include "tests/bench/transfer_device.h"

namespace {

using namespace linegate;

constexpr std::size_t kFrames = 4096;
constexpr std::size_t kBatch = 64;
constexpr std::size_t kBytes = can::kMaxFdData;
constexpr std::uint16_t kSource = 0x6000;

// --- PDOs ----------------------------------------------------------------------------------------

od::DeviceDescription fd_device() {
  od::DeviceDescription description;
  od::ObjectDescription object{
      .index = kSource, .name = "Value", .type = od::ObjectType::array, .variables = {}};
  for (std::size_t sub = 1; sub <= kBytes; ++sub) {
    object.variables.push_back({.sub = static_cast<std::uint8_t>(sub),
                                .name = "Value " + std::to_string(sub),
                                .type = od::DataType::unsigned8,
                                .access = od::Access::ro,
                                .mappable = true});
  }
  description.objects.push_back(std::move(object));
  return description;
}

std::vector<pdo::RemoteNode> fd_nodes(const od::DeviceDescription& device,
                                      const std::vector<std::uint32_t>& ids) {
  std::vector<pdo::RemoteNode> out;
  for (const std::uint32_t id : ids) {
    const auto node = static_cast<std::uint8_t>(out.size() + 1);
    pdo::RemoteNode& made = out.emplace_back(pdo::RemoteNode{.id = node,
                                                             .name = "n" + std::to_string(node),
                                                             .device = &device,
                                                             .deadline = std::chrono::seconds(1)});
    pdo::Parameters tpdo{.number = 1, .cob_id = {id}, .type = 255};
    for (const od::VariableDescription& variable : device.objects[0].variables) {
      tpdo.mapping.push_back({{kSource, variable.sub}, 8});
    }
    made.pdos.tpdos.push_back(std::move(tpdo));
  }
  return out;
}

class FdReceiver {
 public:
  explicit FdReceiver(const std::vector<std::uint32_t>& ids) {
    const pdo::LinkPlan plan = *pdo::plan_links(fd_nodes(description_, ids)).value;
    image_.emplace(plan.inputs, plan.outputs);
    (void)pdo::add_linked_objects(dictionary_, *image_, plan);
    engine_.emplace(dictionary_, dispatch_, events_, &*image_);
    engine_->set_max_length(kBytes);
    engine_->link(plan);
    engine_->configure();
    engine_->set_operational(true, Instant{});
  }

  void receive(std::span<const can::Frame> batch) {
    while (!batch.empty()) {
      batch = batch.subspan(engine_->receive_ordinary(batch, traffic_));
      if (!batch.empty()) {
        engine_->receive(dispatch_.find(batch.front())->index, batch.front());
        batch = batch.subspan(1);
      }
    }
  }
  std::span<const std::byte> bytes() const { return image_->bytes(image::Direction::inputs); }

 private:
  od::DeviceDescription description_ = fd_device();
  std::optional<image::ProcessImage> image_;
  od::Dictionary dictionary_;
  can::Dispatch dispatch_;
  EventLog events_;
  std::optional<pdo::Engine> engine_;
  can::Traffic traffic_;
};

class FdFloor {
 public:
  explicit FdFloor(const std::vector<std::uint32_t>& ids)
      : place_(0x800), image_(kBytes * ids.size()), dirty_(image_.size()), marks_(ids.size() + 1) {
    for (std::size_t i = 0; i < ids.size(); ++i) {
      place_[ids[i]] = static_cast<std::uint16_t>(i + 1);
    }
  }

  void receive(std::span<const can::Frame> frames) {
    for (const can::Frame& frame : frames) {
      const std::uint16_t place = place_[frame.id & 0x7FFU];
      if (place != 0) {
        put(place, frame);
      }
    }
  }
  std::span<const std::byte> bytes() const { return image_; }

 private:
  struct Mark {
    std::int64_t time = 0;
    std::uint32_t count = 0;
    std::uint32_t valid = 0;
    std::uint64_t generation = 0;
  };

  void put(std::uint16_t place, const can::Frame& frame) {
    const std::size_t offset = kBytes * (place - 1U);
    for (std::size_t at = 0; at < kBytes; at += 8) {
      std::uint64_t before = 0;
      std::uint64_t after = 0;
      std::uint64_t dirty = 0;
      std::memcpy(&before, image_.data() + offset + at, 8);
      std::memcpy(&after, frame.data.data() + at, 8);
      std::memcpy(image_.data() + offset + at, &after, 8);
      std::memcpy(&dirty, dirty_.data() + offset + at, 8);
      dirty |= before ^ after;
      std::memcpy(dirty_.data() + offset + at, &dirty, 8);
    }
    Mark& mark = marks_[place];
    mark.time = frame.time.time_since_epoch().count();
    ++mark.count;
    mark.valid = 1;
    ++mark.generation;
  }

  std::vector<std::uint16_t> place_;
  std::vector<std::byte> image_;
  std::vector<std::byte> dirty_;
  std::vector<Mark> marks_;
};

std::vector<can::Frame> fd_frames(const std::vector<std::uint32_t>& ids) {
  std::mt19937_64 random(42);
  std::vector<can::Frame> out;
  std::vector<std::array<std::byte, kBytes>> values(ids.size());
  for (std::size_t i = 0; i < kFrames; ++i) {
    const std::size_t pdo = random() % ids.size();
    for (std::size_t pair = 0; pair < kBytes / 2; ++pair) {
      std::byte& value = values[pdo][2 * pair + random() % 2];
      value = static_cast<std::byte>(std::to_integer<unsigned>(value) + 1 + random() % 255);
    }
    can::Frame& frame = out.emplace_back();
    frame.id = ids[pdo];
    frame.flags = can::Frame::kFd | can::Frame::kBitRateSwitch;
    frame.length = kBytes;
    frame.data = values[pdo];
    frame.time = Instant(std::chrono::microseconds(i + 1));
  }
  return out;
}

template <class Subject>
double ns_a_frame(Subject& subject, std::span<const can::Frame> frames) {
  constexpr int kRounds = 20;
  const auto begin = std::chrono::steady_clock::now();
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t at = 0; at < frames.size(); at += kBatch) {
      subject.receive(frames.subspan(at, kBatch));
    }
  }
  const std::chrono::duration<double, std::nano> time = std::chrono::steady_clock::now() - begin;
  return time.count() / static_cast<double>(kRounds * frames.size());
}

void measure_pdos() {
  std::vector<bench::Contestant> all;
  for (const std::size_t pdos : {std::size_t{1}, std::size_t{64}}) {
    const std::vector<std::uint32_t> ids = bench::pdo_identifiers(pdos);
    auto frames = std::make_shared<std::vector<can::Frame>>(fd_frames(ids));
    auto floor = std::make_shared<FdFloor>(ids);
    auto receiver = std::make_shared<FdReceiver>(ids);
    floor->receive(*frames);
    receiver->receive(*frames);
    bench::require(std::ranges::equal(floor->bytes(), receiver->bytes()),
                   "the image is not that of the floor");
    const std::string name = std::to_string(pdos) + " PDOs of 64 bytes";
    all.push_back({"floor, " + name, [floor, frames] { return ns_a_frame(*floor, *frames); }, {}});
    all.push_back({name, [receiver, frames] { return ns_a_frame(*receiver, *frames); }, {}});
  }
  bench::interleave(all);
  bench::print_heading("FD PDO of 64 bytes to the image, a frame");
  bench::print_beside_floors(all, 2, "ns");
}

// --- USDO ----------------------------------------------------------------------------------------

constexpr std::uint32_t kDomainBytes = 1'000'000;
constexpr std::uint8_t kClientNode = 1;
constexpr std::uint8_t kServerNode = 5;
constexpr Duration kUsdoTimeout = std::chrono::milliseconds(500);

class FdTransfer {
 public:
  FdTransfer() {
    bench::require(dictionary_.set_hook(bench::kDomain.index, &domain_).ok(), "no hook");
  }

  void run(bool download) {
    if (download) {
      client_.write(bench::kDomain, source_, kUsdoTimeout, now_, from_client_, {});
    } else {
      client_.read(bench::kDomain, sink_, kUsdoTimeout, now_, from_client_, {});
    }
    std::optional<sdo::Outcome> outcome;
    while (!(outcome = client_.take())) {
      step();
    }
    bench::require(outcome->abort == AbortCode::none, "a transfer was aborted");
    bench::require(download ? domain_.complete() : sink_.complete(),
                   "the bytes differ from those that were sent");
  }
  void print(const char* name) const {
    const double all = std::chrono::duration<double>(now_ - Instant{}).count();
    const double wire = std::chrono::duration<double>(bus_.busy()).count();
    std::printf("    %-46s %9.0f byte/s, %.1f %% of the time the wire is busy, %llu frames\n", name,
                kDomainBytes / all, 100 * wire / all,
                static_cast<unsigned long long>(bus_.frames()));
    bench::print_target(name, all / wire, 1 / 0.95, "x its frames on the wire");
  }

 private:
  void step() {
    submit(from_client_, client_end_);
    submit(from_server_, server_end_);
    const Instant wake =
        earlier(bus_.next_wake(), earlier(client_.next_wake(), server_.next_wake()));
    bench::require(wake != kNever, "no frame and no time-out is pending");
    now_ = std::max(now_, wake);
    bus_.advance(now_);
    std::array<can::Frame, 8> frames;
    for (std::size_t i = 0, count = bus_.take(server_end_, frames, now_); i < count; ++i)
      server_.receive(frames[i], from_server_);
    for (std::size_t i = 0, count = bus_.take(client_end_, frames, now_); i < count; ++i)
      client_.receive(frames[i], from_client_);
    server_.advance(now_, from_server_);
    client_.advance(now_, from_client_);
  }
  void submit(can::TransmitQueue& queue, sim::Bus::Endpoint end) {
    for (can::Frame frame; bus_.room(end) > 0 && queue.pop_rest(frame);)
      bus_.submit(end, frame, now_);
  }

  sim::Bus bus_{{.bit_rate = 1'000'000, .data_bit_rate = 5'000'000}};
  sim::Bus::Endpoint client_end_ = bus_.attach();
  sim::Bus::Endpoint server_end_ = bus_.attach();
  bench::PatternDomain domain_{kDomainBytes};
  bench::PatternSource source_{kDomainBytes};
  bench::PatternSink sink_{kDomainBytes};
  od::Dictionary dictionary_{bench::transfer_device()};
  EventLog events_;
  can::TransmitQueue from_client_{16};
  can::TransmitQueue from_server_{16};
  usdo::Server server_{dictionary_, kServerNode, events_};
  usdo::Client client_{kClientNode, kServerNode};
  Instant now_{};
};

void measure_usdo() {
  bench::print_heading("USDO in segments on a virtual bus at 1 Mbit/s and 5 Mbit/s, virtual time");
  for (const bool download : {true, false}) {
    FdTransfer transfer;
    transfer.run(download);
    transfer.print(download ? "USDO download, 1 MB" : "USDO upload, 1 MB");
  }
}

}  // namespace

int main() {
  measure_pdos();
  measure_usdo();
}
