// SPDX-License-Identifier: Apache-2.0
// The input is a sequence of steps: samples that bridges/dds may pass to the client library,
// however little they fit together, and calls of an application. Promises: no
// crash; a value of good quality has data and is of a line that is ready; no output is written but
// of an armed group, with the layout and the start of the gateway that its values were set for;
// each call ends, once; the numbers of followed events rise, and their position is accepted again.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bridges/client/link.h"

#include "tests/fuzz/client_world.h"
#include "tests/fuzz/expect.h"
#include "tests/fuzz/input.h"

namespace {

using namespace linegate;
using fuzz::client_of;
using fuzz::ClientWorld;
using fuzz::Input;
using fuzz::kNames;
using fuzz::number;
using fuzz::one_of;

void check(const client::Value& value, const client::Line& line) {
  if (value.good())
    LINEGATE_EXPECT(value.data.index() != 0 && line.status() != client::LineStatus::lost);
  (void)value.as<int>();
  (void)value.as<std::uint64_t>();
  (void)value.as<float>();
  (void)value.text();
  (void)describe(value.quality);
}

client::Data data_of(Input& in) {
  switch (in.byte() % 6) {
    case 0:
      return in.flag();
    case 1:
      return static_cast<std::int64_t>(number(in));
    case 2:
      return number(in);
    case 3:
      return in.flag() ? std::nan("") : 1e300;
    case 4:
      return std::string(in.byte() % 12, 'x');
    default:
      return in.bytes(in.byte() % 12);
  }
}

// Steps of an application; handles end with it, in any order with the client.
class Application {
 public:
  explicit Application(const std::shared_ptr<ClientWorld>& world)
      : world_(world),
        in_(world->in),
        client_(client_of(world)),
        line_(client_.line(in_.flag() ? "press" : "gw/press")),
        group_(group_of(in_, line_)) {
    values_ = line_.on_change({"a", "outputs:a"}, [this](const client::Snapshot& now) {
      for (const client::Value& value : now.values)
        check(value, line_);
    });
    lines_ = client_.on_line([](const client::Change& change) { (void)describe(change.status); });
    events_ = client_.on_event([](const client::Event&) {});
    following_ = follow(std::nullopt);
    oldest_ = follow("");
    states_ = group_.on_state([](const client::Group& group) { (void)group.text(); });
  }

  void step() {
    switch (in_.byte() % 8) {
      case 0:
        check(line_.read(one_of(in_, kNames)), line_);
        return;
      case 1:
        (void)group_.set(one_of(in_, kNames), data_of(in_));
        return;
      case 2:
        world_->armed = true;
        if (group_.arm() == client::Error::none)
          LINEGATE_EXPECT(group_.state() == client::GroupState::taking);
        return;
      case 3:
        return release();
      case 4:
        return call();
      case 5:
        return look();
      default:
        client_.poll(linegate::Duration(static_cast<std::int64_t>(number(in_) & 0xFFFFFFFF)));
    }
  }

  void end() {
    LINEGATE_EXPECT(client_.follow_events(following_.position(), [](const client::Event&) {}));
    client_ = make_client(client::make_core(nullptr, "ended"));
    for (const auto& [call, ended] : calls_)
      LINEGATE_EXPECT(call.done() && *ended <= 1);
  }

 private:
  static client::Group group_of(Input& in, const client::Line& line) {
    const char* const name = in.flag() ? "" : "a";
    return line.group(name,
                      {.watchdog = linegate::Duration(static_cast<std::int64_t>(number(in)))});
  }
  // Each event is passed on once.
  client::EventReader follow(const std::optional<std::string>& after) {
    using Key = std::tuple<std::string, std::string, std::uint64_t, std::uint64_t>;
    return client_.follow_events(
        after, [seen = std::make_shared<std::set<Key>>()](const client::Event& event) {
          const bool is_new =
              seen->emplace(event.gateway, event.line, event.stream, event.number).second;
          LINEGATE_EXPECT(is_new || event.stream == 0 || event.number == 0);
        });
  }
  void release() {
    group_.release();
    const std::uint64_t before = world_->written;
    client_.poll(linegate::Duration::zero());
    LINEGATE_EXPECT(world_->written == before);
  }
  void call() {
    if (calls_.size() > 50)
      return;
    const client::CallOptions options{.timeout = linegate::Duration(number(in_)),
                                      .attempts = in_.byte() % 3U};
    const client::Request request{.kind = in_.byte(),
                                  .node = in_.byte(),
                                  .sub = in_.byte(),
                                  .data = in_.bytes(in_.byte() % 12)};
    const auto ended = std::make_shared<int>(0);
    calls_.emplace_back(line_.request(request, options), ended);
    calls_.back().first.on_done([ended](const client::Call& done) {
      ++*ended;
      LINEGATE_EXPECT(done.done());
    });
    if (in_.byte() % 8 == 0)
      calls_.back().first.cancel();
  }
  void look() {
    (void)group_.owner();
    (void)group_.waiting();
    (void)line_.inputs();
    (void)line_.outputs();
    (void)client_.lines();
    for (const auto& [call, ended] : calls_) {
      (void)call.number();
      (void)call.text();
      (void)call.progress();
    }
  }

  std::shared_ptr<ClientWorld> world_;
  Input& in_;
  client::Client client_;
  client::Line line_;
  client::Group group_;
  client::Subscription values_, lines_, events_, states_;
  client::EventReader following_, oldest_;
  std::vector<std::pair<client::Call, std::shared_ptr<int>>> calls_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Input in({data, size});
  Application application(std::make_shared<ClientWorld>(in));
  for (int steps = 0; !in.empty() && steps < 2000; ++steps)
    application.step();
  application.end();
  return 0;
}
