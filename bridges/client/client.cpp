// SPDX-License-Identifier: Apache-2.0
#include "bridges/client/client.h"

#include <utility>

#include "bridges/client/core.h"
#include "bridges/client/parameters.h"
#include "stack/line/command.h"

namespace linegate::client {

std::string_view describe(Quality quality) {
  switch (quality) {
    case Quality::good:
      return "good";
    case Quality::no_line:
      return "the line was not received";
    case Quality::no_data:
      return "the image was not received";
    case Quality::no_name:
      return "the line has no value of this name";
    case Quality::not_received:
      return "not received from its node";
    case Quality::node_missing:
      return "its node is missing";
    case Quality::not_sent:
      return "not sent to its node";
    case Quality::gateway_silent:
      return "the gateway is silent";
    case Quality::gateway_lost:
      return "the gateway is lost";
    case Quality::ambiguous:
      return "several gateways have a line of that name";
  }
  return "unknown";
}

std::string_view describe(Error error) {
  switch (error) {
    case Error::none:
      return "done";
    case Error::bad_argument:
      return "an argument is not valid";
    case Error::not_ready:
      return "the line is not ready";
    case Error::ambiguous:
      return "several gateways have a line of that name: name it GATEWAY/LINE";
    case Error::no_name:
      return "the line has no output or group of this name";
    case Error::wrong_type:
      return "the value is not of the type of the output";
    case Error::out_of_range:
      return "the value does not fit the type of the output";
    case Error::too_long:
      return "too many outputs";
    case Error::closed:
      return "the client is not connected";
  }
  return "unknown";
}

std::string_view describe(LineStatus status) {
  switch (status) {
    case LineStatus::waiting:
      return "waiting";
    case LineStatus::ready:
      return "ready";
    case LineStatus::silent:
      return "silent";
    case LineStatus::lost:
      return "lost";
    case LineStatus::ambiguous:
      return "ambiguous";
  }
  return "unknown";
}

// --- Client --------------------------------------------------------------------------------------

Client make_client(std::shared_ptr<Core> core) {
  return Core::client_of(std::move(core));
}

Client Core::client_of(std::shared_ptr<Core> core) {
  return Client(std::move(core));
}

Client::Client(std::shared_ptr<Core> core) : core_(std::move(core)) {
}

Client::~Client() {
  if (core_)
    core_->close();
}

Client::Client(Client&&) noexcept = default;

Client& Client::operator=(Client&& other) noexcept {
  std::swap(core_, other.core_);
  return *this;
}

bool Client::ok() const {
  return core_ && core_->link;
}

std::string Client::error() const {
  return core_ ? core_->error : "";
}

std::string Client::name() const {
  return core_ ? core_->name : "";
}

bool Client::poll(Duration timeout) {
  return core_ && core_->poll(timeout);
}

void Client::wake() {
  if (ok())
    core_->link->wake();
}

Line Client::line(std::string_view name) const {
  Line out;
  out.core_ = core_;
  const std::size_t slash = name.find('/');
  if (slash != std::string_view::npos)
    out.gateway_ = name.substr(0, slash);
  out.line_ = name.substr(slash == std::string_view::npos ? 0 : slash + 1);
  return out;
}

std::vector<std::string> Client::lines() const {
  std::vector<std::string> out;
  if (!core_)
    return out;
  for (const auto& [key, line] : core_->model.lines()) {
    if (line.seen && !line.gone)
      out.push_back(key.first + "/" + key.second);
  }
  return out;
}

Subscription Client::on_line(std::function<void(const Change&)> call_back) {
  if (!core_ || !call_back)
    return {};
  SubscriptionData data;
  data.on_line = std::move(call_back);
  return core_->subscribe(std::move(data));
}

Subscription Client::on_event(std::function<void(const Event&)> call_back) {
  if (!core_ || !call_back)
    return {};
  SubscriptionData data;
  data.on_event = std::move(call_back);
  return core_->subscribe(std::move(data));
}

EventReader Client::follow_events(const std::optional<std::string>& after,
                                  std::function<void(const Event&)> call_back) {
  std::optional<EventFollowing::Positions> positions;
  if (after)
    positions = EventFollowing::parse(*after);
  if (!core_ || !call_back || after.has_value() != positions.has_value())
    return {};
  return core_->follow(std::make_unique<EventFollowing>(std::move(positions)),
                       std::move(call_back));
}

std::string EventReader::position() const {
  return data_ ? data_->following->position() : "";
}

// --- Line ----------------------------------------------------------------------------------------

std::string Line::name() const {
  return gateway_.empty() ? line_ : gateway_ + "/" + line_;
}

LineStatus Line::status() const {
  return core_ ? core_->status(gateway_, line_) : LineStatus::lost;
}

bool Line::wait(Duration timeout) const {
  if (!core_ || !core_->link)
    return false;
  const Instant begin = core_->link->now();
  while (core_->link && !ready()) {
    const Duration left = timeout - (core_->link->now() - begin);
    if (left <= Duration::zero())
      return false;
    core_->step(left);
  }
  return ready();
}

Value Line::read(const std::string& name) const {
  return std::move(read(std::vector{name}).values.front());
}

Snapshot Line::read(const std::vector<std::string>& names) const {
  if (core_)
    return core_->read(gateway_, line_, names);
  Snapshot out;
  for (const std::string& name : names)
    out.values.emplace_back().name = name;
  return out;
}

namespace {

std::vector<std::string> names_of(const Core* core, const std::string& gateway,
                                  const std::string& line, image::Direction direction) {
  std::vector<std::string> out;
  const Model::Found found = core == nullptr ? Model::Found{} : core->find(gateway, line);
  if (found.line == nullptr || !found.line->area(direction).layout)
    return out;
  for (const image::Entry& entry : found.line->area(direction).layout->entries)
    out.push_back(entry.name);
  return out;
}

// Precondition: the numbers are in their ranges.
Request sdo_request(line::CommandKind kind, unsigned node, unsigned index, unsigned sub) {
  Request request;
  request.kind = static_cast<std::uint8_t>(kind);
  request.node = static_cast<std::uint8_t>(node);
  request.index = static_cast<std::uint16_t>(index);
  request.sub = static_cast<std::uint8_t>(sub);
  return request;
}

}  // namespace

std::vector<std::string> Line::inputs() const {
  return names_of(core_.get(), gateway_, line_, image::Direction::inputs);
}

std::vector<std::string> Line::outputs() const {
  return names_of(core_.get(), gateway_, line_, image::Direction::outputs);
}

Subscription Line::on_change(std::vector<std::string> names,
                             std::function<void(const Snapshot&)> call_back) const {
  if (!core_ || !call_back)
    return {};
  SubscriptionData data;
  data.gateway = gateway_;
  data.line = line_;
  data.names = std::move(names);
  data.on_values = std::move(call_back);
  return core_->subscribe(std::move(data));
}

Group Line::group(std::string_view name, const GroupOptions& options) const {
  if (!core_)
    return {};
  auto data = std::make_shared<GroupData>();
  data->gateway = gateway_;
  data->line = line_;
  data->name = name;
  data->options = options;
  core_->groups.push_back(data);
  return Core::group_of(core_, std::move(data));
}

Call Line::request(Request request, const CallOptions& options) const {
  if (!core_)
    return {};
  return Core::call_of(core_, core_->start(*this, std::move(request), options));
}

Call Line::refused(std::string why) const {
  return core_ ? Core::call_of(core_, core_->refuse(std::move(why))) : Call();
}

Call Line::sdo_read(unsigned node, unsigned index, unsigned sub, const CallOptions& options) const {
  if (std::string why = out_of_range({one_node(node), index_of(index), sub_of(sub)}); !why.empty())
    return refused(std::move(why));
  return request(sdo_request(line::CommandKind::sdo_read, node, index, sub), options);
}

Call Line::sdo_write(unsigned node, unsigned index, unsigned sub, std::vector<std::byte> value,
                     const CallOptions& options) const {
  if (std::string why = out_of_range({one_node(node), index_of(index), sub_of(sub)}); !why.empty())
    return refused(std::move(why));
  Request out = sdo_request(line::CommandKind::sdo_write, node, index, sub);
  out.data = std::move(value);
  return request(std::move(out), options);
}

Call Line::nmt(unsigned node, unsigned command, const CallOptions& options) const {
  const bool known = command <= 0xFF && nmt::is_command(static_cast<std::uint8_t>(command));
  const Parameter of_nmt{"command", known, "1, 2, 128, 129 or 130"};
  if (std::string why = out_of_range({node_or_0(node), of_nmt}); !why.empty())
    return refused(std::move(why));
  Request out;
  out.kind = static_cast<std::uint8_t>(line::CommandKind::nmt);
  out.node = static_cast<std::uint8_t>(node);
  out.nmt = static_cast<std::uint8_t>(command);
  return request(std::move(out), options);
}

}  // namespace linegate::client
