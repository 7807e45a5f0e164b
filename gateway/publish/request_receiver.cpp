// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/request_receiver.h"

#include <algorithm>
#include <functional>
#include <utility>

#include <pthread.h>
#include <spdlog/spdlog.h>

#include "gateway/publish/access.h"
#include "gateway/publish/event_text.h"
#include "gateway/publish/foreign_text.h"
#include "gateway/runtime/clock.h"

namespace linegate::gateway {
namespace {

constexpr Duration kPoll = std::chrono::milliseconds(200);
constexpr Duration kPollWhileWaiting = std::chrono::milliseconds(1);
constexpr Duration kNoticePeriod = std::chrono::seconds(1);

void warn_of_suppressed(std::string_view line, std::uint64_t notices) {
  if (notices > 0) {
    spdlog::warn("{}: {} further refusals are not reported as events, too many came at once",
                 line.empty() ? "gateway" : line, notices);
  }
}

}  // namespace

RequestReceiver::RequestReceiver(DataEdge& edge, std::span<const std::unique_ptr<LineHost>> lines,
                                 PublisherInlets publisher, ClientDirectory& clients,
                                 std::string versions, JournalServer* journal)
    : edge_(edge),
      lines_(lines),
      publisher_(publisher),
      clients_(clients),
      versions_(std::move(versions)),
      journal_(journal) {
}

RequestReceiver::~RequestReceiver() {
  stop();
}

void RequestReceiver::set_lines(std::span<const std::unique_ptr<LineHost>> lines) {
  lines_ = lines;
  notices_.clear();
  uses_.clear();
  follow_lines();
}

void RequestReceiver::follow_lines() {
  std::vector<RemoteInputs::Rule> rules;
  for (const auto& host : lines_) {
    for (const config::RemoteInput& input : host->plan.remote_inputs) {
      rules.push_back({host->name(), host->layout(image::Direction::outputs).id, input});
    }
  }
  remote_inputs_.set_rules(std::move(rules));
  if (!edge_.follow(remote_inputs_.lines())) {
    spdlog::error("the values of other gateways are not received: DDS has no readers for them");
  }
}

void RequestReceiver::start() {
  stop_.lower();
  thread_ = std::thread([this] { run(); });
}

void RequestReceiver::stop() {
  stop_.raise();
  if (thread_.joinable()) {
    edge_.wake();
    thread_.join();
  }
  for (auto& [line, limit] : notices_) {
    warn_of_suppressed(line, limit.pop_suppressed());
  }
}

void RequestReceiver::run() {
  pthread_setname_np(pthread_self(), "requests");
  while (!stop_.raised()) {
    edge_.poll(waiting_.empty() ? kPoll : kPollWhileWaiting, *this);
    flush();
    remote_inputs_.advance(monotonic_now());
    report_namesakes();
    report_warnings();
    report_suppressed();
    rounds_.add();
  }
}

LineHost* RequestReceiver::find(std::string_view line) const {
  for (const auto& host : lines_) {
    if (host->name() == line) {
      return host.get();
    }
  }
  return nullptr;
}

bool RequestReceiver::crosses(const LineHost& host, const CommandRequest& request) const {
  const line::Command& command = request.command;
  const auto* const read = std::get_if<line::NetworkRead>(&command.request);
  const auto* const write = std::get_if<line::NetworkWrite>(&command.request);
  if (read == nullptr && write == nullptr) {
    return true;
  }
  const std::uint16_t network = read != nullptr ? read->network : write->network;
  const auto& routes = host.plan.config.routing.routes;
  return std::none_of(routes.begin(), routes.end(), [&](const routing::Route& route) {
    return route.reaches(network) &&
           std::any_of(lines_.begin(), lines_.end(), [&](const auto& other) {
             const config::LineAccess access = access_of(other->plan, request.from);
             return other->interface() == route.interface &&
                    !permitted(line::kind(command), access.commands, access.outputs);
           });
  });
}

line::Refusal RequestReceiver::judge(const LineHost& host, const CommandRequest& request) const {
  const line::Command& command = request.command;
  const config::LineAccess access = access_of(host.plan, request.from);
  if (!permitted(command, request.from.right)) {
    return line::Refusal::no_right;
  }
  if (!permitted(command, access.commands, access.outputs)) {
    return line::Refusal::not_permitted;
  }
  if (!crosses(host, request)) {
    return line::Refusal::not_permitted;
  }
  const std::uint64_t layout = host.layout(image::Direction::outputs).id;
  if (is_of_outputs(line::kind(command)) && request.layout_id != 0 && request.layout_id != layout) {
    return line::Refusal::stale_layout;
  }
  return line::Refusal::none;
}

line::OutputRefusal RequestReceiver::judge_outputs(const LineHost* host,
                                                   const OutputRequest& request) {
  if (host == nullptr) {
    return line::OutputRefusal::unknown_group;
  }
  if (request.from.right == ClientRight::none) {
    return line::OutputRefusal::no_right;
  }
  if (access_of(host->plan, request.from).outputs != config::Access::all) {
    return line::OutputRefusal::not_permitted;
  }
  const bool is_named = host->plan.named.has_group(request.write.group);
  if (is_named && !request.by_name) {
    return line::OutputRefusal::written_by_name;
  }
  return request.by_name && !is_named ? line::OutputRefusal::unknown_group
                                      : line::OutputRefusal::none;
}

void RequestReceiver::on_command(CommandRequest request) {
  const std::uint64_t tag = request.command.tag;
  const std::uint32_t client = clients_.number(request.from, request.client);
  const line::CommandKind kind = line::kind(request.command);
  request.command.client = client;
  request.command.audited = !permitted(request.command, config::Access::read, config::Access::off);
  LineHost* host = find(request.line);
  line::Refusal refusal = host == nullptr ? line::Refusal::unknown_line : judge(*host, request);
  if (refusal == line::Refusal::none) {
    if (uses_[host->name()].commands.admit(host->port.commands, client) &&
        host->port.commands.push(request.command)) {
      host->executor->wakeup().signal();
      return;
    }
    refusal = line::Refusal::busy;
  }
  refuse_command(host, request.line, tag, {.refusal = refusal, .command = kind, .client = client});
}

void RequestReceiver::on_gateway_command(GatewayCommandRequest request) {
  const std::uint64_t tag = request.command.tag;
  if (std::holds_alternative<request::Versions>(request.command.request)) {
    const auto* text = reinterpret_cast<const std::byte*>(versions_.data());
    answer({.tag = tag, .data = std::vector(text, text + versions_.size())});
    return;
  }
  if (std::holds_alternative<request::JournalRead>(request.command.request)) {
    read_journal(std::move(request));
    return;
  }
  const std::uint32_t client = clients_.number(request.from, request.client);
  const line::CommandKind kind = request::kind(request.command.request);
  request.command.client = client;
  request.command.audited = !permitted(request.command.request, config::Access::read);
  LineHost* host = find(request.line);
  line::Refusal refusal = line::Refusal::unknown_line;
  if (host != nullptr && !permitted(request.command.request, request.from.right)) {
    refusal = line::Refusal::no_right;
  } else if (host != nullptr &&
             !permitted(request.command.request, access_of(host->plan, request.from).commands)) {
    refusal = line::Refusal::not_permitted;
  } else if (host != nullptr) {
    auto& ring = host->port.interface_commands;
    if (uses_[host->name()].interface_commands.admit(ring, client) && ring.push(request.command)) {
      host->executor->wakeup().signal();
      return;
    }
    refusal = line::Refusal::busy;
  }
  refuse_command(host, request.line, tag, {.refusal = refusal, .command = kind, .client = client});
}

// Of the whole gateway, whatever line it is addressed to: a refusal is no event.
void RequestReceiver::read_journal(GatewayCommandRequest request) {
  const std::uint64_t tag = request.command.tag;
  if (!permitted(request.command.request, request.from.right)) {
    refuse(tag, line::Refusal::no_right);
  } else if (journal_ == nullptr) {
    answer(refused_page(tag, {line::Refusal::wrong_state,
                              std::string(request::kNoJournal) + " (journal: in its plant.yaml)"}));
  } else {
    const std::uint32_t client = clients_.number(request.from, request.client);
    if (journal_use_.admit(journal_->requests(), client) &&
        journal_->requests().push(request.command)) {
      journal_->signal();
    } else {
      answer(refused_page(
          tag, {line::Refusal::busy, "too many requests wait for the journal: repeat it later"}));
    }
  }
}

void RequestReceiver::refuse_command(LineHost* host, std::string_view line, std::uint64_t tag,
                                     const event::CommandRefused& refused) {
  notice(host, line, refused);
  refuse(tag, refused.refusal);
}

void RequestReceiver::on_output_write(OutputRequest request) {
  LineHost* host = find(request.line);
  request.write.client_number = clients_.number(request.from, request.client);
  const line::OutputRefusal refusal = judge_outputs(host, request);
  if (refusal != line::OutputRefusal::none) {
    notice(host, request.line,
           event::OutputRefused{.refusal = refusal,
                                .group = request.write.group,
                                .client = request.write.client_number});
    return;
  }
  request.write.client = std::move(request.client);
  if (!uses_[host->name()].outputs.admit(host->port.outputs, request.write.client_number) ||
      !host->port.outputs.push(request.write)) {
    host->port.requests_lost.add();
  }
  host->executor->wakeup().signal();
}

void RequestReceiver::on_output_refused(RequestOrigin origin, std::uint16_t group,
                                        line::OutputRefusal refusal, std::string_view why) {
  spdlog::debug("{}: outputs of group {} refused: {}", printable(origin.line), group, why);
  const std::uint32_t client = clients_.number(origin.from, origin.client);
  notice(find(origin.line), origin.line,
         event::OutputRefused{.refusal = refusal, .group = group, .client = client});
}

void RequestReceiver::on_command_refused(RequestOrigin origin, std::uint8_t kind,
                                         line::Refusal refusal, std::string_view why) {
  spdlog::debug("{}: command of {} refused: {}", printable(origin.line), printable(origin.client),
                why);
  const std::uint32_t client = clients_.number(origin.from, origin.client);
  notice(
      find(origin.line), origin.line,
      event::CommandRefused{
          .refusal = refusal, .command = static_cast<line::CommandKind>(kind), .client = client});
}

void RequestReceiver::on_unreadable(std::uint64_t samples) {
  unreadable_ += samples;
  const Instant now = monotonic_now();
  if (now - unreadable_reported_ < kNoticePeriod) {
    return;
  }
  unreadable_reported_ = now;
  spdlog::warn(
      "{} samples were received and dropped: damaged, or not of the gateway that they name",
      std::exchange(unreadable_, 0));
}

void RequestReceiver::on_misfit(std::string_view topic, std::string_view policy) {
  const Instant now = monotonic_now();
  if (now - misfit_reported_ < kNoticePeriod) {
    return;
  }
  misfit_reported_ = now;
  spdlog::warn("{}: a subscriber writes with a quality of service that does not fit ({})", topic,
               policy);
}

// --- values of other gateways -----------------------------------------------------------------

void RequestReceiver::on_remote_state(const RemoteSource& source, std::int64_t time) {
  remote_inputs_.take_state(source, time, monotonic_now());
}

void RequestReceiver::on_remote_layout(const RemoteSource& source, const image::Layout& layout) {
  remote_inputs_.take_layout(source, layout, monotonic_now());
}

void RequestReceiver::on_remote_image(const RemoteSource& source, const image::Snapshot& image) {
  remote_inputs_.take_image(source, image, monotonic_now());
}

namespace {

// Not that of the participant: the values have one owner, whichever incarnation they come from.
ClientIdentity identity_of(std::string_view source) {
  ClientIdentity out;
  out.id = {'f', 'o', 'r', 'w'};
  const std::uint64_t hash = std::hash<std::string_view>()(source);
  for (std::size_t i = 0; i < sizeof hash; ++i) {
    out.id[4 + i] = static_cast<std::uint8_t>(hash >> (8 * i));
  }
  return out;
}

}  // namespace

bool RequestReceiver::write(const std::string& line, const line::OutputWrite& write) {
  LineHost* const host = find(line);
  if (host == nullptr) {
    return true;
  }
  line::OutputWrite numbered = write;
  numbered.client_number = clients_.number(identity_of(write.client), write.client);
  const bool pushed = host->port.outputs.push(numbered);
  host->executor->wakeup().signal();
  return pushed;
}

void RequestReceiver::refuse(const RemoteInputs::Rule& rule, line::OutputRefusal why) {
  const std::string client = rule.input.from.gateway + '/' + rule.input.from.line;
  spdlog::warn("{}: {} is not forwarded to {}: {}", rule.line, rule.input.source(),
               rule.input.output_name, line::describe(why));
  notice(find(rule.line), rule.line,
         event::OutputRefused{.refusal = why,
                              .group = rule.input.group,
                              .client = clients_.number(identity_of(client), client)});
}

void RequestReceiver::report_namesakes() {
  const std::size_t others = edge_.namesakes();
  const Instant now = monotonic_now();
  if (others == namesakes_ || now - namesakes_reported_ < kNoticePeriod) {
    return;
  }
  namesakes_ = others;
  namesakes_reported_ = now;
  if (others == 0) {
    spdlog::info("no other gateway of this name is in the DDS domain any more");
  } else {
    spdlog::warn(
        "{} of the same name as this one in its DDS domain: subscribers mix them up, and each "
        "takes what is asked of another; give one another name (gateway: {{name: ...}}) or domain",
        others == 1 ? std::string("another gateway is") : std::to_string(others) + " gateways are");
  }
}

void RequestReceiver::report_warnings() {
  for (const std::string& warning : edge_.warnings(monotonic_now())) {
    spdlog::warn("{}", warning);
  }
}

void RequestReceiver::report_suppressed() {
  const Instant now = monotonic_now();
  for (auto& [line, limit] : notices_) {
    warn_of_suppressed(line, limit.pop_suppressed(now));
  }
}

void RequestReceiver::notice(LineHost* host, std::string_view line, const EventData& what) {
  if (!notices_[host == nullptr ? std::string() : host->name()].admit(what, monotonic_now())) {
    return;
  }
  if (host == nullptr) {
    notice_unknown_line(line, what);
    return;
  }
  Event event{.data = what};
  if (!host->port.notices.push(event)) {
    host->port.requests_lost.add();
  }
  host->executor->wakeup().signal();
}

// The ring has room for the events of several seconds.
void RequestReceiver::notice_unknown_line(std::string_view line, const EventData& what) {
  GatewayNotice notice{.event = {.time = monotonic_now(), .data = what}, .text = {}};
  notice.text = "line '" + printable(line) +
                "' does not exist: " + describe(notice.event, line::LineConfig{}, {}, &clients_);
  if (!publisher_.notices.push(notice)) {
    spdlog::warn("{}", notice.text);
  }
  publisher_.wakeup.signal();
}

void RequestReceiver::refuse(std::uint64_t tag, line::Refusal refusal) {
  line::Reply reply;
  reply.tag = tag;
  reply.error = line::to_error(refusal);
  answer(std::move(reply));
}

void RequestReceiver::answer(line::Reply reply) {
  waiting_.push_back(std::move(reply));
  flush();
}

void RequestReceiver::flush() {
  bool moved = false;
  while (!waiting_.empty() && publisher_.refusals.push(waiting_.front())) {
    waiting_.pop_front();
    moved = true;
  }
  if (moved) {
    publisher_.wakeup.signal();
  }
}

}  // namespace linegate::gateway
