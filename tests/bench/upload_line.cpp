// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/upload_line.h"

#include <chrono>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"

#include "tests/bench/measure.h"
#include "tests/bench/pdo_line.h"
#include "tests/bench/transfer_device.h"

namespace linegate::bench {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kPdosOfDevice = 8;
constexpr int kBootTime = 500;            // ms
constexpr std::uint64_t kSyncTag = 1000;  // tags of uploads are node-IDs
constexpr int kLooks = 3000;

constexpr std::uint16_t kSyncCobId = 0x1005;
constexpr std::uint16_t kSyncPeriod = 0x1006;
constexpr std::uint16_t kSyncOverflowObject = 0x1019;

template <class Condition>
void wait_until(Condition condition, const char* otherwise) {
  for (int looks = 0; !condition(); ++looks) {
    require(looks < kLooks, otherwise);
    std::this_thread::sleep_for(10ms);
  }
}

std::vector<std::byte> in_microseconds(Duration time) {
  std::vector<std::byte> out(4);
  store_le(out.data(), static_cast<std::uint32_t>(
                           std::chrono::duration_cast<std::chrono::microseconds>(time).count()));
  return out;
}

bool all_bytes(std::span<const std::byte> bytes) {
  bool right = bytes.size() == kUploadBytes;
  for (std::uint32_t at = 0; at < bytes.size(); ++at) {
    right = right && bytes[at] == pattern(at);
  }
  return right;
}

}  // namespace

UploadLine::UploadLine(SdoBus& bus, Duration sync_period)
    : bus_(bus), executor_({}), publisher_([this] { take(); }) {
  config::LinePlan plan;
  plan.config = pdo_line(Mapping::event_driven, pdo_identifiers(kUploadNodes * kPdosOfDevice));
  plan.config.sdo_timeout = kSdoPatience;
  // The counter distinguishes a SYNC that was lost from one that was skipped because it was late.
  plan.config.own_values = {{{kSyncOverflowObject, 0}, {std::byte{kSyncOverflow}}},
                            {{kSyncPeriod, 0}, in_microseconds(sync_period)}};
  executor_.add(make_runner(make_line(plan.config), bus.wire, plan, port_, publisher_.wakeup));
  publisher_.start();
  executor_.start();
  bus.wire.play_devices(kUploadNodes, kBootTime);
  wait_until([this] { return manager_runs_.load(); }, "the line's manager does not run");
  bus.start();
}

UploadLine::~UploadLine() {
  bus_.stop();
  executor_.request_stop();
  executor_.join();
  publisher_.stop();
}

void UploadLine::start() {
  wanted_ = true;
  publisher_.wakeup.signal();
}

void UploadLine::stop() {
  wanted_ = false;
  publisher_.wakeup.signal();
  wait_until([this] { return asked_.load() == 0; }, "an upload does not end");
}

void UploadLine::take() {
  if (const bool wanted = wanted_; wanted != on_) {
    turn(wanted);
  }
  for (line::Reply reply; port_.replies.pop(reply);) {
    take(reply);
  }
  if (const gateway::LineStatus* status = discard_reports(port_)) {
    manager_runs_ = manager_runs(*status);
  }
  discard_images(port_);
}

void UploadLine::turn(bool on) {
  on_ = on;
  line::LocalWrite write{.address = {kSyncCobId, 0}};
  write.data.resize(4);
  store_le(write.data.data(), can::kSyncId | (on ? can::CobId::kProducerBit : 0U));
  ask({.tag = kSyncTag, .request = std::move(write)});
  for (std::uint8_t node = 1; on && node <= kUploadNodes; ++node) {
    read(node);
  }
}

void UploadLine::read(std::uint8_t node) {
  line::Command command{
      .tag = node, .request = line::SdoRead{.node = node, .address = {kDomain.index, kDomain.sub}}};
  ask(std::move(command));
}

void UploadLine::ask(line::Command command) {
  ++asked_;
  require(port_.commands.push(std::move(command)), "the line accepts no command");
  executor_.wakeup().signal();
}

void UploadLine::take(const line::Reply& reply) {
  require(reply.ok(), "the line refuses a command, or a transfer was aborted");
  if (reply.tag != kSyncTag) {
    require(all_bytes(reply.bytes()), "the bytes differ from those of the device");
    ++ended_;
    if (on_) {
      read(static_cast<std::uint8_t>(reply.tag));
    }
  }
  --asked_;
}

}  // namespace linegate::bench
