// The input is a sequence of steps: frames to a server, frames to a client, transfers begun, time
// passing. Whatever it is: no crash, the server answers a request with one frame at most, or a
// sub-block, values keep to their rights and limits, every transfer ends once, and a valid read
// afterwards works.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stack/od/dictionary.h"
#include "stack/sdo/client.h"
#include "stack/sdo/server.h"

#include "tests/fuzz/expect.h"

namespace {

using namespace linegate;

constexpr std::uint32_t kRequestId = 0x605;
constexpr std::uint32_t kResponseId = 0x585;
constexpr Duration kTimeout = std::chrono::milliseconds(100);

// First byte of a step, modulo their number.
enum class Step : std::uint8_t {
  to_server,  // length, then that many (at most 8) bytes
  to_client,  // the same
  read,       // object
  write,      // object, size; the bytes are 0, 1, 2, ...
  deliver,    // everything on the wire arrives
  lose,       // everything on the wire is lost
  wait,       // milliseconds
};
constexpr unsigned kSteps = 7;

od::ObjectDescription object(std::uint16_t index, od::DataType type, od::Access access,
                             std::vector<std::byte> value) {
  od::VariableDescription variable;
  variable.type = type;
  variable.access = access;
  variable.value = std::move(value);
  od::ObjectDescription out;
  out.index = index;
  out.variables.push_back(std::move(variable));
  return out;
}

od::DeviceDescription device() {
  od::DeviceDescription out;
  out.objects.push_back(object(0x1000, od::DataType::unsigned32, od::Access::ro,
                               {std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}}));
  out.objects.push_back(object(0x2000, od::DataType::unsigned8, od::Access::rw, {}));
  out.objects.back().variables[0].high_limit = {std::byte{100}};
  out.objects.push_back(object(0x2001, od::DataType::unsigned64, od::Access::rw, {}));
  out.objects.push_back(object(0x2002, od::DataType::visible_string, od::Access::rw, {}));
  out.objects.push_back(object(0x2003, od::DataType::domain, od::Access::rw, {}));
  out.objects.push_back(object(0x2004, od::DataType::unsigned32, od::Access::wo, {}));
  return out;
}

class Input {
 public:
  explicit Input(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  bool empty() const { return bytes_.empty(); }
  std::uint8_t next() {
    if (bytes_.empty()) {
      return 0;
    }
    const std::uint8_t value = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return value;
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

class Pair {
 public:
  void run(Input input) {
    while (!input.empty()) {
      step(input);
      check();
    }
    finish();
    check_read();
  }

 private:
  void step(Input& input) {
    switch (static_cast<Step>(input.next() % kSteps)) {
      case Step::to_server:
        ask(frame(kRequestId, input));
        break;
      case Step::to_client:
        client_.receive(frame(kResponseId, input), to_server_);
        break;
      case Step::read:
        begin();
        client_.read(address(input), kTimeout, now_, to_server_);
        break;
      case Step::write: {
        begin();
        const od::Address where = address(input);
        client_.write(where, value(input), kTimeout, now_, to_server_);
        break;
      }
      case Step::deliver:
        deliver();
        break;
      case Step::lose:
        to_server_.clear();
        to_client_.clear();
        break;
      case Step::wait:
        advance(std::chrono::milliseconds(input.next()));
        break;
    }
  }

  void ask(const can::Frame& request) {
    ++asked_;
    server_.receive(request, to_client_);
  }

  // Only one transfer at a time: the one before is given up.
  void begin() {
    client_.abort(AbortCode::general, now_, to_server_);
    take();
    ++begun_;
  }

  void take() {
    while (client_.take()) {
      ++ended_;
    }
  }

  void deliver() {
    can::Frame next;
    for (bool any = true; any;) {
      any = false;
      if (to_server_.pop_rest(next)) {
        expect_sdo(next, kRequestId);
        next.time = now_;
        ask(next);
        any = true;
      }
      if (to_client_.pop_rest(next)) {
        expect_sdo(next, kResponseId);
        ++answered_;
        LINEGATE_EXPECT(answered_ <= asked_ * (sdo::kMaxBlockSize + 1U));
        next.time = now_;
        client_.receive(next, to_server_);
        any = true;
      }
    }
  }

  void advance(Duration step) {
    now_ += step;
    asked_ += server_.busy() ? 1U : 0U;  // an abort may come unasked
    server_.advance(now_, to_client_);
    client_.advance(now_, to_server_);
    LINEGATE_EXPECT(server_.next_wake() > now_);
    LINEGATE_EXPECT(client_.next_wake() > now_);
  }

  void finish() {
    deliver();
    advance(std::chrono::seconds(10));
    deliver();
    advance(std::chrono::seconds(10));
    take();
    LINEGATE_EXPECT(!client_.busy() && !server_.busy());
    LINEGATE_EXPECT(begun_ == ended_);
    deliver();
  }

  void check_read() {
    client_.read({0x1000, 0}, kTimeout, now_, to_server_);
    deliver();
    const std::optional<sdo::Outcome> outcome = client_.take();
    LINEGATE_EXPECT(outcome && outcome->abort == AbortCode::none);
    LINEGATE_EXPECT(load_le(std::span<const std::byte>(outcome->data)) == 0x0403'0201);
  }

  void check() {
    take();
    LINEGATE_EXPECT(dictionary_.number({0x1000, 0}) == 0x0403'0201U);
    LINEGATE_EXPECT(*dictionary_.number({0x2000, 0}) <= 100);
    LINEGATE_EXPECT(dictionary_.find({0x2001, 0})->size == 8);
    LINEGATE_EXPECT(dictionary_.find({0x2002, 0})->size <= 64);
  }

  can::Frame frame(std::uint32_t id, Input& input) {
    std::vector<std::byte> bytes(std::min<std::size_t>(input.next(), 8));
    for (std::byte& byte : bytes) {
      byte = std::byte{input.next()};
    }
    can::Frame out = can::make_frame(id, bytes);
    out.time = now_;
    return out;
  }

  static od::Address address(Input& input) {
    return {static_cast<std::uint16_t>(0x2000 + input.next() % 6), 0};
  }

  static std::vector<std::byte> value(Input& input) {
    std::vector<std::byte> out(input.next());
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i] = static_cast<std::byte>(i);
    }
    return out;
  }

  static void expect_sdo(const can::Frame& frame, std::uint32_t id) {
    LINEGATE_EXPECT(frame.id == id && frame.length == 8 && frame.flags == 0);
  }

  static constexpr std::size_t kQueue = 4;

  od::Dictionary dictionary_{device()};
  EventLog events_;
  can::TransmitQueue to_server_{kQueue};
  can::TransmitQueue to_client_{kQueue};
  sdo::Server server_{dictionary_, can::CobId{kRequestId}, can::CobId{kResponseId}, events_};
  sdo::Client client_{can::CobId{kRequestId}};
  Instant now_ = Instant{} + std::chrono::seconds(1);
  unsigned asked_ = 0;
  unsigned answered_ = 0;
  unsigned begun_ = 0;
  unsigned ended_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Pair().run(Input({data, size}));
  return 0;
}
