// SPDX-License-Identifier: Apache-2.0
// The input is a sequence of steps on three channels between clients and the servers of one device:
// frames to a server or client, new transfers with values and with streams, delivery and loss of
// frames, late answers of the device, and time. Promises: no crash, a server answers a request with
// at most one frame or a sub-block, values keep their access rights and limits, every transfer and
// every stream ends once, a successful transfer has the right bytes whatever was lost, and a valid
// read afterwards works.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <span>
#include <vector>

#include "stack/sdo/client.h"
#include "stack/sdo/server.h"

#include "tests/fuzz/expect.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/sdo_subject.h"

namespace {

using namespace linegate;
using namespace std::chrono_literals;

constexpr std::uint32_t kRequestIds[] = {0x605, 0x6C1, 0x6C2};
constexpr std::uint32_t kResponseIds[] = {0x585, 0x5C1, 0x5C2};
constexpr unsigned kChannels = 3;
constexpr Duration kTimeout = 100ms;
constexpr std::size_t kQueue = 4;

// The first byte of a step, modulo the number of steps. Steps apply to the channel selected last.
enum class Step : std::uint8_t {
  to_server,     // length, then that many bytes, at most 8
  to_client,     // the same
  read,          // object
  write,         // object, size; the bytes are 0, 1, 2, ...
  deliver,       // all frames on the wire arrive
  lose,          // all frames on the wire are lost
  wait,          // milliseconds
  select,        // channel
  read_stream,   // object
  write_stream,  // object, size / 16; the bytes are a pattern
  answer,        // number, whether it is a success: a late answer of the device
  options,       // Transfer, repeats
  deliver_some,  // bit mask for the next eight frames: those with a 0 are lost
};
constexpr unsigned kSteps = 13;

// One client and its server.
class Channel {
 public:
  Channel(unsigned number, od::Dictionary& dictionary, fuzz::SdoObjects& objects, EventLog& events)
      : number_(number),
        objects_(objects),
        server_(dictionary, can::CobId{kRequestIds[number]}, can::CobId{kResponseIds[number]},
                events, {.stall = 30ms}),
        client_(can::CobId{kRequestIds[number]}) {}

  void set_options(sdo::TransferOptions options) { options_ = options; }

  void read(od::Address where, Instant now) {
    begin(now);
    client_.read(where, kTimeout, now, to_server_, options_);
  }
  void write(od::Address where, std::vector<std::byte> value, Instant now) {
    begin(now);
    client_.write(where, std::move(value), kTimeout, now, to_server_, options_);
  }
  void read_stream(od::Address where, Instant now) {
    begin(now);
    under_way_.sink = &sinks_.emplace_back(nullptr);
    under_way_.checked = under_way_.checked && is_stream(where);
    client_.read(where, sinks_.back(), kTimeout, now, to_server_, options_);
  }
  void write_stream(od::Address where, std::uint32_t size, bool tells, Instant now) {
    begin(now);
    under_way_.source = &sources_.emplace_back(size, tells, nullptr);
    under_way_.checked = under_way_.checked && is_stream(where);
    client_.write(where, sources_.back(), kTimeout, now, to_server_, options_);
  }

  void inject_to_server(const can::Frame& frame) {
    injected_ = true;
    under_way_.checked = false;
    ask(frame);
  }
  void inject_to_client(const can::Frame& frame) {
    injected_ = true;
    under_way_.checked = false;
    client_.receive(frame, to_server_);
    take();
  }

  void lose() {
    to_server_.clear();
    to_client_.clear();
  }

  // Delivers the next frame of each side. Returns false if there is none.
  bool pass(bool good, Instant now) {
    const bool to_server = pass_to_server(good, now);
    return pass_to_client(good, now) || to_server;
  }

  void advance(Instant now) {
    // A busy server may send an abort or a delayed answer without a request.
    asked_ += server_.busy() ? 1U : 0U;
    objects_.serve(number_);
    server_.advance(now, to_client_);
    client_.advance(now, to_server_);
    take();
    LINEGATE_EXPECT(server_.next_wake() > now);
    LINEGATE_EXPECT(client_.next_wake() > now);
  }
  Instant next_wake() const { return earlier(server_.next_wake(), client_.next_wake()); }

  bool at_rest() const {
    return !client_.busy() && !server_.busy() && to_server_.empty() && to_client_.empty();
  }
  void check_end() const {
    LINEGATE_EXPECT(at_rest());
    LINEGATE_EXPECT(begun_ == ended_);
    const auto over = [](const auto& stream) { return stream.over(); };
    LINEGATE_EXPECT(std::ranges::all_of(sources_, over) && std::ranges::all_of(sinks_, over));
  }
  std::optional<sdo::Outcome> last_outcome() const { return last_; }

 private:
  struct UnderWay {
    bool checked = false;  // only lost frames can have disturbed it, so its bytes are checked
    const fuzz::PatternSource* source = nullptr;
    const fuzz::PatternSink* sink = nullptr;
  };

  static bool is_stream(od::Address where) {
    return where.index == fuzz::kStream || where.index == fuzz::kSlowStream;
  }

  // A client has one transfer at a time: aborts the previous one.
  void begin(Instant now) {
    const bool quiet = at_rest() && !client_.strays_expected();
    client_.abort(AbortCode::general, now, to_server_);
    take();
    ++begun_;
    under_way_ = {.checked = quiet && !injected_};
  }

  void take() {
    while (std::optional<sdo::Outcome> outcome = client_.take()) {
      ++ended_;
      LINEGATE_EXPECT(outcome->abort != od::kLater);
      if (outcome->abort == AbortCode::none && under_way_.checked) {
        check_bytes();
      }
      last_ = std::move(outcome);
    }
  }

  void check_bytes() const {
    if (under_way_.source != nullptr) {
      const fuzz::PatternSink* sink = objects_.last_sink(number_);
      LINEGATE_EXPECT(sink != nullptr && sink->has(under_way_.source->bytes()));
    } else if (under_way_.sink != nullptr) {
      const fuzz::PatternSource* source = objects_.last_source(number_);
      LINEGATE_EXPECT(source != nullptr && under_way_.sink->has(source->bytes()));
    }
  }

  void ask(const can::Frame& request) {
    ++asked_;
    objects_.serve(number_);
    server_.receive(request, to_client_);
  }

  bool pass_to_server(bool good, Instant now) {
    can::Frame next;
    if (!to_server_.pop_rest(next)) {
      return false;
    }
    expect_sdo(next, kRequestIds[number_]);
    next.time = now;
    if (good) {
      ask(next);
    }
    return true;
  }

  bool pass_to_client(bool good, Instant now) {
    can::Frame next;
    if (!to_client_.pop_rest(next)) {
      return false;
    }
    expect_sdo(next, kResponseIds[number_]);
    ++answered_;
    LINEGATE_EXPECT(answered_ <= asked_ * (sdo::kMaxBlockSize + 1U));
    next.time = now;
    if (good) {
      client_.receive(next, to_server_);
      take();
    }
    return true;
  }

  static void expect_sdo(const can::Frame& frame, std::uint32_t id) {
    LINEGATE_EXPECT(frame.id == id && frame.length == 8 && frame.flags == 0);
    const auto word = sdo::word_of(frame);
    const bool abort = static_cast<std::uint8_t>(word) == 0x80;
    LINEGATE_EXPECT(!abort || sdo::long_word(word) != static_cast<std::uint32_t>(od::kLater));
  }

  unsigned number_;
  fuzz::SdoObjects& objects_;
  can::TransmitQueue to_server_{kQueue};
  can::TransmitQueue to_client_{kQueue};
  std::list<fuzz::PatternSource> sources_;
  std::list<fuzz::PatternSink> sinks_;
  sdo::Server server_;
  sdo::Client client_;
  sdo::TransferOptions options_;
  UnderWay under_way_;
  std::optional<sdo::Outcome> last_;
  bool injected_ = false;
  std::uint64_t asked_ = 0;
  std::uint64_t answered_ = 0;
  unsigned begun_ = 0;
  unsigned ended_ = 0;
};

class Device {
 public:
  Device() {
    for (unsigned number = 0; number < kChannels; ++number) {
      channels_.emplace_back(number, dictionary_, objects_, events_);
    }
    selected_ = &channels_.front();
  }

  void run(fuzz::Input input) {
    while (!input.empty()) {
      step(input);
      check();
    }
    finish();
    for (Channel& channel : channels_) {
      check_read(channel);
    }
  }

 private:
  void step(fuzz::Input& input) {
    switch (static_cast<Step>(input.byte() % kSteps)) {
      case Step::to_server:
        selected_->inject_to_server(frame(input));
        break;
      case Step::to_client:
        selected_->inject_to_client(frame(input));
        break;
      case Step::read:
        selected_->read(address(input), now_);
        break;
      case Step::write: {
        const od::Address where = address(input);
        selected_->write(where, value(input), now_);
        break;
      }
      case Step::deliver:
        deliver();
        break;
      case Step::lose:
        selected_->lose();
        break;
      case Step::wait:
        advance(std::chrono::milliseconds(input.byte()));
        break;
      case Step::select:
        selected_ = &*std::next(channels_.begin(), input.byte() % kChannels);
        break;
      case Step::read_stream:
        selected_->read_stream(address(input), now_);
        break;
      case Step::write_stream: {
        const od::Address where = address(input);
        const std::uint8_t size = input.byte();
        selected_->write_stream(where, size * 16U, size % 2 == 0, now_);
        break;
      }
      case Step::answer: {
        const std::uint8_t which = input.byte();
        objects_.answer(which, input.flag());
        break;
      }
      case Step::options:
        selected_->set_options({.transfer = static_cast<sdo::Transfer>(input.byte() % 3U),
                                .repeats = input.byte() % 3U});
        break;
      case Step::deliver_some:
        deliver_some(input.byte());
        break;
    }
  }

  bool pass_all() {
    bool any = false;
    for (Channel& channel : channels_) {
      any = channel.pass(true, now_) || any;
    }
    return any;
  }

  // Delivers all frames, including those that full queues delay for a few milliseconds.
  void deliver() {
    for (unsigned rounds = 0;; ++rounds) {
      LINEGATE_EXPECT(rounds < 100'000);
      if (pass_all()) {
        continue;
      }
      const Instant wake = next_wake();
      if (wake > now_ + 2ms) {
        return;
      }
      advance(wake > now_ ? wake - now_ : Duration::zero());
    }
  }

  void deliver_some(unsigned mask) {
    for (unsigned i = 0; i < 8; ++i) {
      if (!selected_->pass((mask >> i & 1U) != 0, now_)) {
        advance(1ms);
      }
    }
  }

  Instant next_wake() const {
    Instant wake = kNever;
    for (const Channel& channel : channels_) {
      wake = earlier(wake, channel.next_wake());
    }
    return wake;
  }

  void advance(Duration step) {
    now_ += step;
    for (Channel& channel : channels_) {
      channel.advance(now_);
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
    for (const Channel& channel : channels_) {
      channel.check_end();
    }
    LINEGATE_EXPECT(objects_.at_rest());
  }

  void check_read(Channel& channel) {
    channel.set_options({});
    channel.read({0x1000, 0}, now_);
    deliver();
    const std::optional<sdo::Outcome> outcome = channel.last_outcome();
    LINEGATE_EXPECT(outcome && outcome->abort == AbortCode::none);
    LINEGATE_EXPECT(load_le(std::span<const std::byte>(outcome->data)) == 0x0403'0201);
  }

  void check() const {
    LINEGATE_EXPECT(dictionary_.number({0x1000, 0}) == 0x0403'0201U);
    LINEGATE_EXPECT(*dictionary_.number({0x2000, 0}) <= 100);
    LINEGATE_EXPECT(dictionary_.find({0x2001, 0})->size == 8);
    LINEGATE_EXPECT(dictionary_.find({0x2002, 0})->size <= 64);
    LINEGATE_EXPECT(dictionary_.find({fuzz::kStream, 0})->size == 0);
    LINEGATE_EXPECT(dictionary_.find({fuzz::kSlowStream, 0})->size == 0);
  }

  can::Frame frame(fuzz::Input& input) const {
    can::Frame out =
        can::make_frame(kRequestIds[0], input.bytes(std::min<std::size_t>(input.byte(), 8)));
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
  std::list<Channel> channels_;
  Channel* selected_ = nullptr;
  Instant now_ = Instant{} + 1s;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Device().run(fuzz::Input({data, size}));
  return 0;
}
