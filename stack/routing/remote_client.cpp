// SPDX-License-Identifier: Apache-2.0
#include "stack/routing/remote_client.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "stack/base/assert.h"
#include "stack/sdo/client.h"
#include "stack/sdo/protocol.h"

namespace linegate::routing {
namespace {

constexpr std::uint32_t kPlacesOfAClient = 16;  // more than a client sends at once

}  // namespace

class RemoteClient::Transfer final : public ClientSide {
 public:
  explicit Transfer(SdoIngress& ingress) : ingress_(ingress) {}

  bool busy() const { return busy_; }
  sdo::TransferOwner* owner() const { return request_.owner; }
  std::uint64_t number() const { return request_.number; }
  Instant next_wake() const { return client_.next_wake(); }
  bool may_be_carried_out() const { return client_.may_be_carried_out(); }

  void start(RemoteRequest request) {
    request_ = std::move(request);
    busy_ = true;
    begun_ = false;
    refusal_.reset();
    wants_connection_ = true;
  }

  // True if a frame was sent.
  bool pump(Instant now) {
    bool active = false;
    can::Frame frame;
    while (connected_ && queue_.pop(frame)) {
      ingress_.request(*this, sdo::word_of(frame), now);
      active = true;
    }
    const bool waits = !connected_ && !opening_ && client_.busy() && !queue_.empty();
    if (std::exchange(wants_connection_, false) || waits) {
      opening_ = true;
      const std::uint8_t hops =
          std::max(request_.hops, static_cast<std::uint8_t>(request_.as_device ? 1 : 0));
      ingress_.request(
          *this,
          encode(Indication{.network = request_.network, .node = request_.node, .hops = hops}),
          now);
      active = true;
    }
    return active;
  }

  void advance(Instant now) { client_.advance(now, queue_); }

  // Returns the result once.
  std::optional<sdo::Outcome> take() {
    std::optional<sdo::Outcome> outcome = client_.take();
    if (!outcome && refusal_) {
      outcome = sdo::Outcome{.abort = *refusal_, .data = {}};
    }
    if (outcome) {
      finish();
    }
    return outcome;
  }

  void cancel(Instant now) {
    client_.abort(AbortCode::general, now, queue_);
    (void)pump(now);
    (void)client_.take();
    finish();
  }

  sdo::Completion completion(sdo::Outcome&& outcome) const {
    return {.number = request_.number,
            .node = request_.node,
            .address = request_.address,
            .write = request_.write,
            .abort = outcome.abort,
            .data = std::move(outcome.data)};
  }

  // --- ClientSide
  bool response(std::uint64_t word, Instant now) override {
    if (opening_) {
      opening_ = false;
      connected_ = is_indication(word);
      connected_ ? begin(now) : refused(static_cast<AbortCode>(sdo::long_word(word)), now);
      return true;
    }
    can::Frame frame;
    frame.length = sdo::kFrameSize;
    frame.time = now;
    store_le(frame.data.data(), word);
    (void)client_.receive(frame, queue_);
    return true;
  }
  void released(Instant /*now*/) override {
    connected_ = false;
    opening_ = false;
  }
  bool on_bus() const override { return false; }
  bool is_device() const override { return request_.as_device; }
  std::uint32_t client() const override { return request_.client; }
  void paced(Instant now) override { client_.restart_timeout(now); }

 private:
  void begin(Instant now) {
    if (std::exchange(begun_, true)) {
      return;
    }
    sdo::TransferOptions options{.repeats = request_.repeats};
    if (!request_.write) {
      // A switch to block transfer would abort the transfer, which ends the connection
      options.block_from = sdo::kNoBlocks;
    }
    if (request_.write) {
      client_.write(request_.address, std::move(request_.data), request_.timeout, now, queue_,
                    options);
    } else {
      client_.read(request_.address, request_.timeout, now, queue_, options);
    }
  }

  void refused(AbortCode why, Instant now) {
    if (begun_) {
      client_.abort(why, now, queue_);
      (void)client_.take();
    } else if (why == AbortCode::timeout && request_.repeats > 0) {
      --request_.repeats;
      wants_connection_ = true;
      return;
    }
    refusal_ = why;
  }

  void finish() {
    ingress_.gone(*this);
    connected_ = false;
    opening_ = false;
    wants_connection_ = false;
    busy_ = false;
    queue_.clear();
  }

  SdoIngress& ingress_;
  RemoteRequest request_;
  sdo::Client client_{can::CobId{0}};
  can::TransmitQueue queue_{kPlacesOfAClient};
  bool busy_ = false;
  bool wants_connection_ = false;
  bool opening_ = false;
  bool connected_ = false;
  bool begun_ = false;
  std::optional<AbortCode> refusal_;
};

RemoteClient::RemoteClient(SdoIngress& ingress) : ingress_(ingress) {
}

RemoteClient::~RemoteClient() = default;

void RemoteClient::start(RemoteRequest request, Instant now) {
  LINEGATE_ASSERT(request.owner != nullptr, "a request to another network has an owner");
  auto place = std::find_if(transfers_.begin(), transfers_.end(),
                            [](const auto& each) { return !each->busy(); });
  if (place == transfers_.end()) {
    transfers_.push_back(std::make_unique<Transfer>(ingress_));
    place = transfers_.end() - 1;
  }
  (*place)->start(std::move(request));
  (void)pump(now);
}

void RemoteClient::cancel(const sdo::TransferOwner& owner, std::uint64_t number, Instant now) {
  for (const auto& each : transfers_) {
    if (each->busy() && each->owner() == &owner && each->number() == number) {
      each->cancel(now);
    }
  }
  std::erase_if(ended_, [&](const Ended& ended) {
    return ended.owner == &owner && ended.completion.number == number;
  });
}

bool RemoteClient::may_be_carried_out(const sdo::TransferOwner& owner, std::uint64_t number) const {
  return std::ranges::any_of(transfers_, [&](const auto& each) {
    return each->busy() && each->owner() == &owner && each->number() == number &&
           each->may_be_carried_out();
  });
}

void RemoteClient::deliver_completions(Instant now) {
  while (!ended_.empty()) {
    Ended next = std::move(ended_.front());
    ended_.pop_front();
    next.owner->completed(next.completion, now);
  }
}

bool RemoteClient::pump(Instant now) {
  bool active = false;
  for (const auto& each : transfers_) {
    if (!each->busy()) {
      continue;
    }
    active = each->pump(now) || active;
    if (std::optional<sdo::Outcome> outcome = each->take()) {
      ended_.push_back({each->owner(), each->completion(*std::move(outcome))});
    }
  }
  return active;
}

void RemoteClient::advance(Instant now) {
  for (const auto& each : transfers_) {
    if (each->busy() && now >= each->next_wake()) {
      each->advance(now);
    }
  }
}

Instant RemoteClient::next_wake() const {
  Instant wake = kNever;
  for (const auto& each : transfers_) {
    wake = each->busy() ? earlier(wake, each->next_wake()) : wake;
  }
  return wake;
}

}  // namespace linegate::routing
