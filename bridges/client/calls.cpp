// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <utility>

#include "bridges/client/core.h"
#include "bridges/dds/raw_request.h"
#include "bridges/dds/reply_codec.h"
#include "bridges/request/journal.h"
#include "stack/base/byte_order.h"
#include "stack/base/events.h"
#include "stack/lss/procedure.h"

namespace linegate::client {
namespace {

constexpr std::uint32_t kSdoTimeout = 0x0504'0000;
constexpr std::size_t kMostData = 16U << 20U;  // of COMMAND_PROGRAM, the longest
constexpr std::size_t kMostCalls = 4096;

std::uint32_t code_of(line::Refusal refusal) {
  return static_cast<std::uint32_t>(refusal);
}

Outcome outcome_of(linegate::Error error) {
  switch (error.domain) {
    case Domain::none:
      return Outcome::done;
    case Domain::sdo:
      return Outcome::sdo_abort;
    case Domain::can:
      return Outcome::interface;
    case Domain::command:
      return Outcome::refused;
  }
  return Outcome::refused;
}

// What was refused as busy was not begun. What ended with 0504 0000h may have reached the device
// (idl/README.md), so a command that writes is not repeated then.
bool is_repeated(std::uint8_t kind, linegate::Error error) {
  if (error == line::to_error(line::Refusal::busy))
    return true;
  return error.domain == Domain::sdo && error.code == kSdoTimeout &&
         request::only_reads(line::CommandKind{kind});
}

std::string why_not_sent(const CallData& call, const Model::Found& found) {
  if (found.ambiguous)
    return "several gateways have a line " + call.line + ": name it GATEWAY/LINE";
  if (found.line == nullptr || !found.line->seen)
    return "line " + call.line + " was not received in time";
  if (found.line->gone)
    return "line " + call.line + " is lost: its gateway has ended or removed it";
  return found.line->has_namesake
             ? "another gateway has the name " + found.line->gateway + ": give each its own"
             : "the time-out left no time to send it";
}

}  // namespace

std::shared_ptr<CallData> Core::start(const Line& line, Request request,
                                      const CallOptions& options) {
  auto call = std::make_shared<CallData>();
  call->gateway = line.gateway_;
  call->line = line.line_;
  call->attempts = std::max(options.attempts, 1U);
  call->raw = std::move(request);
  if (!link) {
    finish(call, Outcome::refused, code_of(line::Refusal::cancelled), error);
    return call;
  }
  const Instant now = link->now();
  const auto timeout = std::clamp<linegate::Duration>(options.timeout, linegate::Duration::zero(),
                                                      std::chrono::hours(24));
  call->deadline = now + timeout;
  std::string why = call->raw.data.size() > kMostData ? "the data are longer than 16 MiB" : "";
  if (why.empty()) {
    why = dds::to_request({.kind = call->raw.kind,
                           .node = call->raw.node,
                           .index = call->raw.index,
                           .sub = call->raw.sub,
                           .nmt = call->raw.nmt,
                           .code = call->raw.code,
                           .error_register = call->raw.error_register,
                           .entry = call->raw.entry,
                           .data = std::move(call->raw.data)},
                          call->request);
  }
  call->raw.data.clear();
  if (!why.empty() || calls.size() >= kMostCalls) {
    const auto refusal = why.empty() ? line::Refusal::busy : line::Refusal::bad_request;
    finish(call, Outcome::refused, code_of(refusal),
           why.empty() ? "4096 calls of this client are pending" : why);
    return call;
  }
  calls.push_back(call);
  send(call);
  return call;
}

std::shared_ptr<CallData> Core::refuse(std::string text) {
  auto call = std::make_shared<CallData>();
  finish(call, Outcome::refused, code_of(line::Refusal::bad_request), std::move(text));
  return call;
}

// Later, if the line is not received yet.
void Core::send(const std::shared_ptr<CallData>& call) {
  const Model::Found found = find(call->gateway, call->line);
  if (found.line == nullptr || found.ambiguous || found.line->gone || found.line->has_namesake)
    return;
  const linegate::Duration left = call->deadline - link->now();
  if (left <= linegate::Duration::zero())
    return;
  call->target = {found.line->gateway, found.line->line, found.line->incarnation};
  call->progress = {};
  call->id = link->send(call->target, call->request, left, call->raw.layout_id);
  if (call->id == 0) {
    std::erase(calls, call);
    finish(call, Outcome::refused, code_of(line::Refusal::not_permitted),
           "this client sends no commands");
  }
}

void Core::service_calls() {
  const Instant now = link->now();
  for (const auto& call : std::vector(calls)) {
    if (call->id == 0)
      send(call);
    // The link reports the end of a request that was sent.
    if (call->outcome != Outcome::pending || call->id != 0 || call->deadline > now)
      continue;
    const Model::Found found = find(call->gateway, call->line);
    std::erase(calls, call);
    finish(call, Outcome::refused, code_of(line::Refusal::timed_out), why_not_sent(*call, found));
  }
}

void Core::on_reply(const dds::Target& /*target*/, const dds::CommandResult& result) {
  received = true;
  for (const auto& one : followings()) {
    if (one->following->receive_answer(result, link->now()))
      return;
  }
  const auto found =
      std::ranges::find_if(calls, [&](const auto& call) { return call->id == result.id; });
  if (found == calls.end() || result.id == 0)
    return;
  const std::shared_ptr<CallData> call = *found;
  const bool again = call->attempts > 1 && call->deadline > link->now();
  if (again && is_repeated(call->raw.kind, result.reply.error)) {
    --call->attempts;
    call->id = 0;  // with a new ID, by service_calls()
    return;
  }
  calls.erase(found);
  call->bytes = result.bytes;
  const Outcome outcome = outcome_of(result.reply.error);
  const bool silent = outcome != Outcome::done && result.text.empty();
  finish(call, outcome, result.reply.error.code,
         silent ? "the gateway did not state the reason" : result.text);
}

void Core::finish(const std::shared_ptr<CallData>& call, Outcome outcome, std::uint32_t code,
                  std::string text) {
  call->outcome = outcome;
  call->code = code;
  call->text = std::move(text);
  call_back_later(call);
}

// Holds the call, which may have no handle any more.
void Core::call_back_later(const std::shared_ptr<CallData>& call) {
  if (!call->on_done)
    return;
  due.emplace_back([call] {
    if (const auto call_back = std::exchange(call->on_done, {}))
      call_back({});
  });
}

void Core::note_progress(const dds::Source& source, const dds::ReceivedEvent& event) {
  const auto* const progress = event.get<event::CommandProgress>();
  if (progress == nullptr)
    return;
  // The event does not name the request. A line carries out such commands of a node one after the
  // other, so it belongs to the first one.
  for (const auto& call : calls) {
    const bool same = call->id != 0 && call->target.gateway == source.gateway &&
                      call->target.line == source.line &&
                      call->raw.kind == static_cast<std::uint8_t>(progress->command) &&
                      (call->raw.node == event.node || event.node == 0);
    if (same) {
      call->progress = {progress->done, progress->total};
      return;
    }
  }
}

std::optional<line::ReplyData> Core::reply_of(const Call& call) {
  if (!call.done() || call.data_ == nullptr)
    return std::nullopt;
  const Domain domain = call.ok() ? Domain::none : Domain::sdo;
  return dds::decode_reply(call.data_->request, {domain, call.code()}, call.data_->bytes);
}

bool Core::is_readable(const Call& call) {
  if (!call.ok() || call.data_ == nullptr)
    return true;
  if (kind_of(call) == request::JournalRead::kKind)
    return request::decode_page(call.data_->bytes).has_value();
  if (request_of<line::LssRequest>(call) != nullptr)
    return call.data_->bytes.size() >= lss::kReplyHead;
  return reply_of(call).has_value();
}

// --- the handle ----------------------------------------------------------------------------------

Call Core::call_of(std::shared_ptr<Core> core, std::shared_ptr<CallData> data) {
  Call out;
  out.core_ = std::move(core);
  out.data_ = std::move(data);
  return out;
}

Outcome Call::outcome() const {
  return data_ ? data_->outcome : Outcome::refused;
}

std::uint32_t Call::code() const {
  return data_ ? data_->code : code_of(line::Refusal::cancelled);
}

std::string Call::text() const {
  return data_ ? data_->text : "no line";
}

std::vector<std::byte> Call::bytes() const {
  return data_ ? data_->bytes : std::vector<std::byte>();
}

std::uint64_t Call::number() const {
  return data_ && data_->bytes.size() <= 8 ? load_le(std::span(std::as_const(data_->bytes))) : 0;
}

std::pair<std::uint32_t, std::uint32_t> Call::progress() const {
  return data_ ? data_->progress : std::pair<std::uint32_t, std::uint32_t>();
}

bool Call::wait() {
  while (!done() && core_->link)
    core_->step(std::chrono::hours(1));
  return ok();
}

void Call::cancel() {
  if (!data_ || done())
    return;
  if (data_->id != 0 && core_->link)
    core_->link->cancel(data_->id);
  std::erase(core_->calls, data_);
  core_->finish(data_, Outcome::refused, code_of(line::Refusal::cancelled),
                "cancelled by the application; the gateway may have carried it out");
}

void Call::on_done(std::function<void(const Call&)> call_back) {
  if (!data_)
    return;
  if (!call_back) {
    data_->on_done = {};
    return;
  }
  // The data hold the call-back, so it must not hold them.
  data_->on_done = [core = std::weak_ptr(core_), weak = std::weak_ptr(data_),
                    call_back = std::move(call_back)](const Call& /*none*/) {
    auto owner = core.lock();
    auto call = weak.lock();
    if (owner && call)
      call_back(Core::call_of(std::move(owner), std::move(call)));
  };
  if (done())
    core_->call_back_later(data_);
}

}  // namespace linegate::client
