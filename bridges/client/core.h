// SPDX-License-Identifier: Apache-2.0
// The state behind the handles of a client.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "bridges/client/event_following.h"
#include "bridges/client/link.h"
#include "bridges/client/model.h"
#include "stack/line/replies.h"

namespace linegate::client {

// Of one kind of call-backs; the others are empty.
struct SubscriptionData {
  std::string gateway;
  std::string line;
  std::vector<std::string> names;
  std::function<void(const Snapshot&)> on_values;
  std::function<void(const Change&)> on_line;
  std::function<void(const Event&)> on_event;
  std::unique_ptr<EventFollowing> following;  // of on_event
  std::function<void(const Group&)> on_group;
  bool ended = false;  // its handles are gone; a call-back that runs still holds it
  bool begun = false;
  std::uint64_t revision = 0;      // of the line when it was last compared
  const void* compared = nullptr;  // that line
  bool ambiguous = false;          // there were several
  std::uint64_t lost = 0;
  std::vector<std::pair<Data, Quality>> last;
  std::set<std::pair<std::string, std::string>> reported;  // on_line: at the beginning
};

struct GroupData {
  std::string gateway;
  std::string line;
  std::string name;
  GroupOptions options;
  GroupState state = GroupState::idle;
  LossReason reason = LossReason::none;
  line::OutputRefusal refusal = line::OutputRefusal::none;
  std::uint64_t incarnation = 0;
  std::uint64_t layout_id = 0;
  std::uint64_t outputs_revision = 0;  // of the line, which the values are for
  std::uint16_t number = 0;            // of the name when it was armed
  std::uint64_t arming = 0;
  // Refusals of the group before this arming; not known before its first OutputState. Their times
  // are not compared: each publication converts them anew, with the noise of two clocks.
  std::optional<std::uint64_t> refused_before;
  Instant write_at{};
  bool dirty = false;
  std::map<std::uint32_t, line::OutputValue> values;  // by entry
  std::vector<std::weak_ptr<SubscriptionData>> subscriptions;
};

struct CallData {
  std::string gateway;
  std::string line;
  std::string sent_gateway;  // of the line that it was sent to
  dds::Target target{};
  Request raw;
  request::Request request;
  Instant deadline{};
  unsigned attempts = 1;
  std::uint64_t id = 0;  // 0: waits for the line
  Outcome outcome = Outcome::pending;
  std::uint32_t code = 0;
  std::string text;
  std::vector<std::byte> bytes;
  std::pair<std::uint32_t, std::uint32_t> progress{};
  std::function<void(const Call&)> on_done;
};

struct Core : dds::ClientListener, std::enable_shared_from_this<Core> {
  Core(std::unique_ptr<Link> the_link, std::string the_error);

  // Waits at most that long for samples. Returns whether the time has passed.
  bool step(linegate::Duration timeout);
  bool poll(linegate::Duration timeout);
  void close();

  // The line, or why it is not usable.
  Model::Found find(const std::string& gateway, const std::string& line) const;
  // Whether all discovered gateways, and all their lines, were received.
  bool settled() const;
  LineStatus status(const std::string& gateway, const std::string& line) const;
  Snapshot read(const std::string& gateway, const std::string& line,
                const std::vector<std::string>& names) const;

  std::shared_ptr<CallData> start(const Line& line, Request request, const CallOptions& options);
  // A call that ends at once, as a bad request.
  std::shared_ptr<CallData> refuse(std::string text);
  // Its data; nothing before it is done, or if they do not match the request.
  static std::optional<line::ReplyData> reply_of(const Call& call);
  // Of the command; without data that of a default one.
  static line::CommandKind kind_of(const Call& call) {
    return call.data_ ? request::kind(call.data_->request) : line::CommandKind{};
  }
  // Whether the data of a call that is done are of the form of its command; true of other calls. A
  // gateway of another version may answer in another one.
  static bool is_readable(const Call& call);
  // What was requested, if it is of that type.
  template <class T>
  static const T* request_of(const Call& call) {
    const auto* const request =
        call.data_ ? std::get_if<line::Request>(&call.data_->request) : nullptr;
    return request == nullptr ? nullptr : std::get_if<T>(request);
  }
  void finish(const std::shared_ptr<CallData>& call, Outcome outcome, std::uint32_t code,
              std::string text);
  void call_back_later(const std::shared_ptr<CallData>& call);

  // The line of the group, while outputs can be written; otherwise the reason.
  Error ready_line(const GroupData& group, const LineData*& line) const;
  static void bind(GroupData& group, const LineData& line);
  // raw: the value in the PDO, see Group::set_raw().
  Error set(GroupData& group, std::string_view name, const Data& value, bool raw);
  // All of them, or none: `failed` is the place of the first that is not possible.
  Error set(GroupData& group, std::span<const Setting> settings, std::size_t& failed);
  Error arm(GroupData& group);
  void release(GroupData& group);
  const LineData::Group* state_of(const GroupData& group) const;

  static Client client_of(std::shared_ptr<Core> core);
  static Subscription handle(std::shared_ptr<SubscriptionData> data);
  EventReader follow(std::unique_ptr<EventFollowing> following,
                     std::function<void(const Event&)> call_back);
  static Call call_of(std::shared_ptr<Core> core, std::shared_ptr<CallData> data);
  static Group group_of(std::shared_ptr<Core> core, std::shared_ptr<GroupData> data);
  Subscription subscribe(SubscriptionData data);

  void on_gateway(const dds::Source& source, const dds::GatewayInfo& info) override;
  void on_line(const dds::Source& source, const dds::LineInfo& info, const line::LineState& state,
               const std::vector<dds::Property>& properties) override;
  void on_node(const dds::Source& source, const dds::NodeInfo& info, const line::NodeState& state,
               const std::vector<dds::Property>& properties) override;
  void on_output_state(const dds::Source& source, const line::OutputState& state) override;
  void on_layout(const dds::Source& source, const image::Layout& layout) override;
  void on_image(const dds::Source& source, const image::Snapshot& image) override;
  void on_event(const dds::Source& source, const dds::ReceivedEvent& event, std::string_view text,
                const std::vector<dds::Property>& properties) override;
  void on_line_gone(std::string_view gateway, std::string_view line) override;
  void on_node_gone(std::string_view gateway, std::string_view line, std::uint8_t node) override;
  void on_output_state_gone(std::string_view gateway, std::string_view line,
                            std::uint16_t group) override;
  void on_reply(const dds::Target& target, const dds::CommandResult& result) override;

  std::unique_ptr<Link> link;
  std::string error;  // why there is no link
  std::string name;
  Model model;
  struct FirstEvents {
    std::uint64_t incarnation = 0;
    std::uint64_t number = 0;  // of the newest event at the beginning
  };
  std::map<std::string, FirstEvents> gateway_events;
  NewestEvents newest_events;
  std::vector<std::weak_ptr<SubscriptionData>> subscriptions;
  std::vector<std::weak_ptr<GroupData>> groups;
  std::vector<std::shared_ptr<CallData>> calls;  // pending
  std::deque<std::function<void()>> due;         // call-backs
  std::uint64_t last_arming = 0;
  bool was_settled = false;  // a name without gateway may be resolved
  bool received = false;     // samples, in the present step

 private:
  LineData* sample_of(const dds::Source& source);
  bool is_new(const dds::Source& source, std::uint64_t number);
  void note_progress(const dds::Source& source, const dds::ReceivedEvent& event);
  void service();
  void report_lines();
  void report_line(LineData& line, const Change& change);
  void report_values();
  void compare(const std::shared_ptr<SubscriptionData>& subscription);
  std::vector<std::shared_ptr<SubscriptionData>> followings();
  void follow_events();
  void service_calls();
  void send(const std::shared_ptr<CallData>& call);
  void service_groups();
  void service_group(const std::shared_ptr<GroupData>& group);
  void judge(GroupData& group, const LineData::Group& state);
  void write(GroupData& group, const LineData& line);
  void set_state(GroupData& group, GroupState state, LossReason reason);
  void lose(GroupData& group, LossReason reason);
  Instant next_wake() const;
  // Nothing: it has ended.
  static std::shared_ptr<SubscriptionData> lock(const std::weak_ptr<SubscriptionData>& weak);
  // What a handle holds: with the last copy the subscription has ended.
  static std::shared_ptr<SubscriptionData> owned(std::shared_ptr<SubscriptionData> data);
  // The live subscriptions of that list.
  static std::vector<std::shared_ptr<SubscriptionData>> live(
      std::vector<std::weak_ptr<SubscriptionData>>& list);
};

// The number of a group of outputs by name or number; nothing: no group that is published has that
// name.
std::optional<std::uint16_t> group_number(const LineData& line, std::string_view name);

}  // namespace linegate::client
