// SPDX-License-Identifier: Apache-2.0
// The input is a sequence of steps on two USDO clients and the server of one device: frames to each
// of them, new transfers with values and with streams, delivery and loss of frames, late answers of
// the device, and time. Promises: no crash, the server answers a request with at most one frame,
// frames are FD frames of a permitted length, values keep their access rights and limits, every
// transfer and every stream ends once, a successful transfer of a stream has the right bytes
// whatever was lost, and a valid read afterwards works.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/usdo/client.h"
#include "stack/usdo/server.h"

#include "tests/fuzz/expect.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/sdo_subject.h"

namespace {

using namespace linegate;
using namespace std::chrono_literals;

constexpr std::uint8_t kUsdoServer = 5;
constexpr std::uint8_t kUsdoClients = 2;  // node-IDs 1 and 2
constexpr Duration kUsdoTimeout = 100ms;
constexpr std::size_t kUsdoQueue = 4;

// The first byte of a step, modulo the number of steps. Steps apply to the client selected last.
enum class UsdoStep : std::uint8_t {
  to_server,     // client, length, then that many bytes, at most 64
  to_client,     // length, then that many bytes
  read,          // object
  write,         // object, size; the bytes are 0, 1, 2, ...
  deliver,       // all frames on the wire arrive
  lose,          // all frames on the wire are lost
  wait,          // milliseconds
  select,        // client
  read_stream,   // object
  write_stream,  // object, size / 16; the bytes are a pattern
  answer,        // number, whether it is a success: a late answer of the device
  repeats,       // of the next transfers
  deliver_some,  // bit mask for the next eight frames: those with a 0 are lost
};
constexpr unsigned kUsdoSteps = 13;

void expect_usdo(const can::Frame& frame, std::uint32_t base) {
  LINEGATE_EXPECT(frame.id > base && frame.id <= base + can::kMaxNodeId);
  LINEGATE_EXPECT(frame.flags == (can::Frame::kFd | can::Frame::kBitRateSwitch));
  LINEGATE_EXPECT(frame.length == can::fd_length(frame.length));
  LINEGATE_EXPECT(usdo::well_formed(frame) && usdo::has_fields(frame));
}

class UsdoUser {
 public:
  explicit UsdoUser(std::uint8_t id) : id_(id), client_(id, kUsdoServer) {}

  void read(od::Address where, Instant now) {
    begin(now);
    client_.read(where, kUsdoTimeout, now, queue_, options_);
  }
  void write(od::Address where, std::vector<std::byte> value, Instant now) {
    begin(now);
    client_.write(where, std::move(value), kUsdoTimeout, now, queue_, options_);
  }
  void read_stream(od::Address where, Instant now) {
    begin(now);
    client_.read(where, sinks_.emplace_back(nullptr), kUsdoTimeout, now, queue_, options_);
  }
  void write_stream(od::Address where, std::uint32_t size, bool has_size, Instant now) {
    begin(now);
    client_.write(where, sources_.emplace_back(size, has_size, nullptr), kUsdoTimeout, now, queue_,
                  options_);
  }
  void receive(const can::Frame& frame) {
    client_.receive(frame, queue_);
    take();
  }
  bool pop(can::Frame& out) {
    if (!queue_.pop_rest(out)) {
      return false;
    }
    expect_usdo(out, can::kSdoRequestBase);
    return true;
  }
  void lose() { queue_.clear(); }
  void advance(Instant now) {
    client_.advance(now, queue_);
    take();
    LINEGATE_EXPECT(client_.next_wake() > now);
  }
  Instant next_wake() const { return client_.next_wake(); }
  void set_repeats(unsigned repeats) { options_.repeats = repeats; }
  void check_end() const {
    LINEGATE_EXPECT(!client_.busy() && begun_ == ended_);
    const auto over = [](const auto& stream) { return stream.over(); };
    LINEGATE_EXPECT(std::ranges::all_of(sources_, over) && std::ranges::all_of(sinks_, over));
  }
  std::optional<sdo::Outcome> last_outcome() const { return last_; }
  std::uint8_t id() const { return id_; }

 private:
  // A client has one transfer at a time: aborts the previous one.
  void begin(Instant now) {
    client_.abort(AbortCode::general, now, queue_);
    take();
    ++begun_;
  }
  void take() {
    while (std::optional<sdo::Outcome> outcome = client_.take()) {
      ++ended_;
      LINEGATE_EXPECT(outcome->abort != od::kLater);
      last_ = std::move(outcome);
    }
  }

  std::uint8_t id_;
  can::TransmitQueue queue_{kUsdoQueue};
  std::list<fuzz::PatternSource> sources_;
  std::list<fuzz::PatternSink> sinks_;
  usdo::Client client_;
  sdo::TransferOptions options_;
  std::optional<sdo::Outcome> last_;
  unsigned begun_ = 0;
  unsigned ended_ = 0;
};

class UsdoDevice {
 public:
  UsdoDevice() {
    for (std::uint8_t id = 1; id <= kUsdoClients; ++id) {
      users_.emplace_back(id);
    }
    selected_ = &users_.front();
  }

  void run(fuzz::Input input) {
    while (!input.empty()) {
      step(input);
      check();
    }
    finish();
    for (UsdoUser& user : users_) {
      user.read({0x1000, 0}, now_);
      deliver();
      const std::optional<sdo::Outcome> outcome = user.last_outcome();
      LINEGATE_EXPECT(outcome && outcome->abort == AbortCode::none);
      LINEGATE_EXPECT(load_le(std::span<const std::byte>(outcome->data)) == 0x0403'0201);
    }
  }

 private:
  void step(fuzz::Input& input) {
    switch (static_cast<UsdoStep>(input.byte() % kUsdoSteps)) {
      case UsdoStep::to_server: {
        const std::uint32_t id = can::kSdoRequestBase + 1 + input.byte() % can::kMaxNodeId;
        ask(frame(id, input));
        break;
      }
      case UsdoStep::to_client:
        selected_->receive(frame(can::kSdoResponseBase + kUsdoServer, input));
        break;
      case UsdoStep::read:
        selected_->read(address(input), now_);
        break;
      case UsdoStep::write: {
        const od::Address where = address(input);
        selected_->write(where, value(input), now_);
        break;
      }
      case UsdoStep::deliver:
        deliver();
        break;
      case UsdoStep::lose:
        selected_->lose();
        to_clients_.clear();
        break;
      case UsdoStep::wait:
        advance(std::chrono::milliseconds(input.byte()));
        break;
      case UsdoStep::select:
        selected_ = &*std::next(users_.begin(), input.byte() % kUsdoClients);
        break;
      case UsdoStep::read_stream:
        selected_->read_stream(address(input), now_);
        break;
      case UsdoStep::write_stream: {
        const od::Address where = address(input);
        const std::uint8_t size = input.byte();
        selected_->write_stream(where, size * 16U, size % 2 == 0, now_);
        break;
      }
      case UsdoStep::answer: {
        const std::uint8_t which = input.byte();
        objects_.answer(which, input.flag());
        break;
      }
      case UsdoStep::repeats:
        selected_->set_repeats(input.byte() % 3U);
        break;
      case UsdoStep::deliver_some: {
        const unsigned mask = input.byte();
        for (unsigned i = 0; i < 8; ++i) {
          if (!pass((mask >> i & 1U) != 0)) {
            advance(1ms);
          }
        }
        break;
      }
    }
  }

  void ask(const can::Frame& request) {
    const std::size_t before = to_clients_.queued(can::TransmitClass::sdo);
    server_.receive(request, to_clients_);
    LINEGATE_EXPECT(to_clients_.queued(can::TransmitClass::sdo) <= before + 1);
    LINEGATE_EXPECT(server_.sessions() <= usdo::Server::kSessions);
  }

  // Delivers or loses the next frame of each station. Returns false if there is none.
  bool pass(bool good) {
    bool any = false;
    can::Frame next;
    for (UsdoUser& user : users_) {
      if (user.pop(next)) {
        any = true;
        next.time = now_;
        good ? ask(next) : void();
      }
    }
    if (to_clients_.pop_rest(next)) {
      any = true;
      expect_usdo(next, can::kSdoResponseBase);
      next.time = now_;
      for (UsdoUser& user : users_) {
        good ? user.receive(next) : void();
      }
    }
    return any;
  }

  void deliver() {
    for (unsigned i = 0; i < 100'000; ++i) {
      if (!pass(true)) {
        const Instant wake = next_wake();
        if (wake > now_ + 5ms) {
          return;
        }
        advance(std::max<Duration>(wake - now_, 1us));
      }
    }
  }

  Instant next_wake() const {
    Instant wake = server_.next_wake();
    for (const UsdoUser& user : users_) {
      wake = earlier(wake, user.next_wake());
    }
    return wake;
  }

  void advance(Duration step) {
    now_ += step;
    server_.advance(now_, to_clients_);
    LINEGATE_EXPECT(server_.next_wake() > now_);
    for (UsdoUser& user : users_) {
      user.advance(now_);
    }
  }

  // The device gives no more late answers: all waiting transfers time out, and are repeated as
  // often as requested.
  void finish() {
    for (unsigned i = 0; i < 12; ++i) {
      deliver();
      advance(10s);
    }
    deliver();
    for (const UsdoUser& user : users_) {
      user.check_end();
    }
    LINEGATE_EXPECT(server_.sessions() == 0 && objects_.at_rest());
  }

  void check() const {
    LINEGATE_EXPECT(dictionary_.number({0x1000, 0}) == 0x0403'0201U);
    LINEGATE_EXPECT(*dictionary_.number({0x2000, 0}) <= 100);
    LINEGATE_EXPECT(dictionary_.find({0x2001, 0})->size == 8);
    LINEGATE_EXPECT(dictionary_.find({0x2002, 0})->size <= 64);
    LINEGATE_EXPECT(dictionary_.find({fuzz::kStream, 0})->size == 0);
    LINEGATE_EXPECT(dictionary_.find({fuzz::kSlowStream, 0})->size == 0);
  }

  can::Frame frame(std::uint32_t id, fuzz::Input& input) const {
    can::Frame out;
    const std::vector<std::byte> bytes =
        input.bytes(std::min<std::size_t>(input.byte(), can::kMaxFdData));
    out.id = id;
    out.flags = bytes.size() == 7 ? std::uint8_t{0} : std::uint8_t{can::Frame::kFd};
    out.length = can::fd_length(bytes.size());
    std::ranges::copy(bytes, out.data.begin());
    out.time = now_;
    return out;
  }

  static od::Address address(fuzz::Input& input) {
    return {static_cast<std::uint16_t>(0x2000 + input.byte() % 9), 0};
  }

  static std::vector<std::byte> value(fuzz::Input& input) {
    std::vector<std::byte> out(input.byte());
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i] = static_cast<std::byte>(i);
    }
    return out;
  }

  od::Dictionary dictionary_{fuzz::sdo_device()};
  fuzz::SdoObjects objects_{dictionary_};
  EventLog events_;
  can::TransmitQueue to_clients_{kUsdoQueue};
  usdo::Server server_{dictionary_, kUsdoServer, events_};
  std::list<UsdoUser> users_;
  UsdoUser* selected_ = nullptr;
  Instant now_ = Instant{} + 1s;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  UsdoDevice().run(fuzz::Input({data, size}));
  return 0;
}
