// SPDX-License-Identifier: Apache-2.0
#include "stack/routing/sdo_ingress.h"

#include <algorithm>

#include "stack/base/assert.h"
#include "stack/can/cob_id.h"
#include "stack/routing/table.h"
#include "stack/sdo/protocol.h"

namespace linegate::routing {
namespace {

constexpr std::uint32_t kIndexBits = 0xFFFF;
constexpr Duration kMargin = std::chrono::milliseconds(50);  // for the transport between two lines

bool is_sdo_abort(std::uint64_t word) {
  return static_cast<std::uint8_t>(word) == sdo::command_byte(sdo::ClientCommand::abort);
}

AbortCode abort_in(std::uint64_t word) {
  return static_cast<AbortCode>(sdo::long_word(word));
}

}  // namespace

Duration gateway_timeout(const Config& config, Duration sdo_timeout, unsigned hops) {
  const Duration whole =
      config.gateway_timeout > Duration::zero() ? config.gateway_timeout : 2 * sdo_timeout;
  const unsigned left = hops > kMaxHops ? 1U : kMaxHops + 1U - std::max(hops, 1U);
  return whole * left / kMaxHops;
}

Duration channel_wait(const Config& config, Duration sdo_timeout) {
  return config.channel_wait > Duration::zero() ? config.channel_wait : sdo_timeout / 2;
}

struct SdoIngress::Connection {
  enum class State : std::uint8_t { free, opening, armed, forward, draining };

  State state = State::free;
  std::uint8_t to = 0;       // interface of the route that is being tried, or is used
  std::uint8_t gateway = 0;  // on that interface
  bool traced = false;       // its opening was reported
  std::uint32_t number = 0;  // the number in messages
  ClientSide* side = nullptr;
  std::uint64_t word = 0;  // the indication
  std::size_t tried = 0;   // number of routes that failed
  AbortCode first_failure = AbortCode::none;
  AbortCode said = AbortCode::none;  // abort code in the frame that ended it
  SdoPhase phase;
  Instant deadline = kNever;
  WordQueue waiting;  // frames that wait for room on the way to the client
};

SdoIngress::SdoIngress(const Config& config, Line line, const od::Dictionary& dictionary,
                       Post& post, EventLog& events, Counters& counters)
    : config_(config),
      line_(line),
      dictionary_(dictionary),
      post_(post),
      events_(events),
      counters_(counters) {
}

SdoIngress::~SdoIngress() = default;

SdoIngress::Connection* SdoIngress::of(const ClientSide& side) const {
  return find(side.connection_);
}

SdoIngress::Connection* SdoIngress::find(std::uint32_t number) const {
  const std::uint32_t index = number & kIndexBits;
  if (index >= connections_.size()) {
    return nullptr;
  }
  Connection& found = *connections_[index];
  return found.number == number && found.state != Connection::State::free ? &found : nullptr;
}

// Connection numbers consist of index and generation, and are never 0.
SdoIngress::Connection* SdoIngress::make(ClientSide& side) {
  const auto place = std::find_if(connections_.begin(), connections_.end(), [](const auto& each) {
    return each->state == Connection::State::free;
  });
  Connection* made = place == connections_.end() ? nullptr : place->get();
  if (made == nullptr) {
    if (connections_.size() == kMaxConnections) {
      return nullptr;
    }
    connections_.push_back(std::make_unique<Connection>());
    made = connections_.back().get();
    made->number = static_cast<std::uint32_t>(connections_.size() - 1);
  }
  made->state = Connection::State::opening;
  made->side = &side;
  renumber(*made);
  made->tried = 0;
  made->first_failure = AbortCode::none;
  made->phase.reset();
  made->traced = false;
  made->said = AbortCode::none;
  made->deadline = kNever;
  made->waiting.clear();
  return made;
}

// A new number, so that a late answer to an earlier attempt is not mistaken for the present one.
void SdoIngress::renumber(Connection& connection) {
  const std::uint32_t index = connection.number & kIndexBits;
  const std::uint32_t generation = (connection.number >> 16U) % kIndexBits + 1;
  connection.number = generation << 16U | index;
  connection.side->connection_ = connection.number;
}

// --- from the client ----------------------------------------------------------------------------

void SdoIngress::request(ClientSide& side, std::uint64_t word, Instant now) {
  now_ = now;
  Connection* const connection = of(side);
  const bool segment = connection != nullptr && connection->phase.in_sub_block();
  if (has_network_specifier(word) && !segment) {
    indication(side, word, now);
    return;
  }
  if (connection == nullptr) {
    return;
  }
  switch (connection->state) {
    case Connection::State::armed:
      armed(*connection, word, now);
      return;
    case Connection::State::forward:
      forward(*connection, word, now);
      return;
    case Connection::State::opening:
      if (is_sdo_abort(word)) {
        close_exit(*connection, AbortCode::general);
        release(*connection, now);
      } else {
        give(*connection, sdo::abort_word(sdo::multiplexer(word), AbortCode::device_state), now);
      }
      return;
    default:
      return;
  }
}

void SdoIngress::indication(ClientSide& side, std::uint64_t word, Instant now) {
  if (Connection* const old = of(side)) {
    if (old->state == Connection::State::opening && old->word == word) {
      return;  // a repeated indication, which is already being processed
    }
    if (old->state != Connection::State::draining) {
      count_end(*old, SdoPhase::End::aborted, AbortCode::general, now);
      close_exit(*old, AbortCode::general);
    }
    free(*old);
  }
  Connection* const made = make(side);
  if (made == nullptr) {
    (void)side.response(sdo::abort_word({}, AbortCode::sdo_connection), now);
    side.released(now);
    return;
  }
  made->word = word;
  const Indication wanted = decode_indication(word);
  if (const AbortCode why = refusal_of(side, word); why != AbortCode::none) {
    refuse(*made, why, now);
  } else if (is_this_gateway(wanted)) {
    give(*made, word, now);
    release(*made, now);
  } else {
    try_route(*made, now);
  }
}

AbortCode SdoIngress::refusal_of(const ClientSide& side, std::uint64_t word) const {
  const Indication wanted = decode_indication(word);
  if (!is_indication(word)) {
    return AbortCode::command_specifier;
  }
  if (wanted.node > can::kMaxNodeId || wanted.hops > config_.hop_limit) {
    return AbortCode::invalid_value;
  }
  const bool here = wanted.network == 0 || wanted.network == line_.network;
  // A node of this line: the route would lead back to the source.
  return here && side.is_device() && !is_this_gateway(wanted) ? AbortCode::invalid_value
                                                              : AbortCode::none;
}

std::uint16_t SdoIngress::source_of(const ClientSide& side) const {
  return side.is_device() ? line_.network : std::uint16_t{0};
}

bool SdoIngress::is_this_gateway(const Indication& wanted) const {
  return (wanted.network == 0 || wanted.network == line_.network) &&
         (wanted.node == 0 || wanted.node == line_.node);
}

void SdoIngress::try_route(Connection& connection, Instant now) {
  const Indication wanted = decode_indication(connection.word);
  const std::uint8_t not_over = connection.side->is_device() ? config_.interface : std::uint8_t {
    0
  };
  const Table table = read_table(dictionary_);
  const Route* const route = table.find(wanted.network, not_over, connection.tried);
  if (route == nullptr) {
    refuse(connection, connection.tried == 0 ? AbortCode::invalid_value : connection.first_failure,
           now);
    return;
  }
  connection.to = route->interface;
  connection.gateway = route->gateway;
  wait_until(connection, now + opening_timeout(wanted.hops + 1U));
  Message open{
      .to = route->interface,
      .kind = MessageKind::sdo_open,
      .hops = wanted.hops,
      .connection = connection.number,
      .network = wanted.network,
      .source = source_of(*connection.side),
      .node = wanted.node,
      .gateway = route->gateway,
      .of_process = !connection.side->on_bus(),
  };
  store_le(open.data.data(), connection.side->client());
  if (!post_.send(open)) {
    refuse(connection, AbortCode::out_of_memory, now);
  }
}

void SdoIngress::route_failed(Connection& connection, AbortCode why, Instant now) {
  LINEGATE_ASSERT(connection.state == Connection::State::opening, "a route is being tried");
  if (connection.tried++ == 0) {
    connection.first_failure = why;
  }
  renumber(connection);
  try_route(connection, now);
}

void SdoIngress::refuse(Connection& connection, AbortCode why, Instant now) {
  ++counters_.refused;
  report_refused(events_, RoutedService::sdo, source_of(*connection.side),
                 decode_indication(connection.word), why, now);
  connection.waiting.clear();  // refusals of requests that arrived before the route was open
  give(connection, sdo::abort_word({}, why), now);
  release(connection, now);
}

void SdoIngress::armed(Connection& connection, std::uint64_t word, Instant now) {
  if (is_sdo_abort(word)) {
    count_end(connection, SdoPhase::End::aborted, AbortCode::general, now);
    close_exit(connection, AbortCode::general);
    release(connection, now);
  } else if (SdoPhase::initiates(word)) {
    connection.state = Connection::State::forward;
    forward(connection, word, now);
  } else {
    give(connection, sdo::abort_word(sdo::multiplexer(word), AbortCode::command_specifier), now);
  }
}

void SdoIngress::forward(Connection& connection, std::uint64_t word, Instant now) {
  const SdoPhase::End end = connection.phase.request(word);
  if (!post_.send(
          to_connection(MessageKind::sdo_request, connection.to, connection.number, word))) {
    break_down(connection, AbortCode::out_of_memory, now);
    return;
  }
  wait_until(connection, now + frame_timeout());
  if (end != SdoPhase::End::none) {
    connection.said = end == SdoPhase::End::aborted ? abort_in(word) : AbortCode::none;
    count_end(connection, end, AbortCode::general, now);
    release(connection, now);
  }
}

void SdoIngress::gone(ClientSide& side) {
  if (Connection* const connection = of(side)) {
    if (connection->state != Connection::State::draining) {
      count_end(*connection, SdoPhase::End::aborted, AbortCode::general, now_);
      close_exit(*connection, AbortCode::general);
    }
    free(*connection);
  }
}

// --- from the other line ------------------------------------------------------------------------

void SdoIngress::deliver(const Message& message, Instant now) {
  now_ = now;
  Connection* const connection = find(message.connection);
  if (connection == nullptr || connection->to != message.from ||
      connection->state == Connection::State::draining) {
    ++counters_.unexpected;
    return;
  }
  const bool opening = connection->state == Connection::State::opening;
  switch (message.kind) {
    case MessageKind::sdo_opened:
      if (opening) {
        connection->state = Connection::State::armed;
        ++counters_.opened;
        ++counters_.open;
        connection->traced = trace_.admit(now);
        report_opened(*connection, now);
        wait_until(*connection, now + config_.arm_timeout);
        give(*connection, connection->word, now);
      }
      return;
    case MessageKind::sdo_refused:
      if (opening) {
        route_failed(*connection, abort_of(message), now);
      } else {
        count_end(*connection, SdoPhase::End::aborted, abort_of(message), now);
        if (connection->state == Connection::State::forward) {
          connection->waiting.clear();  // obsolete after the abort
          give(*connection, sdo::abort_word(connection->phase.address(), abort_of(message)), now);
        }
        release(*connection, now);
      }
      return;
    case MessageKind::sdo_paced:
      paced(*connection, now);
      return;
    default:
      response(*connection, message, now);
      return;
  }
}

void SdoIngress::paced(Connection& connection, Instant now) {
  if (connection.state == Connection::State::forward) {
    wait_until(connection, now + frame_timeout());
    connection.side->paced(now);
  }
}

void SdoIngress::response(Connection& connection, const Message& message, Instant now) {
  if (message.kind != MessageKind::sdo_response || connection.state != Connection::State::forward) {
    ++counters_.unexpected;
    return;
  }
  const std::uint64_t word = word_of(message);
  const SdoPhase::End end = connection.phase.response(word);
  wait_until(connection, now + frame_timeout());
  give(connection, word, now);
  if (end != SdoPhase::End::none && connection.state == Connection::State::forward) {
    connection.said = end == SdoPhase::End::aborted ? abort_in(word) : AbortCode::none;
    count_end(connection, end, AbortCode::general, now);
    release(connection, now);
  }
}

// --- to the client ------------------------------------------------------------------------------

void SdoIngress::give(Connection& connection, std::uint64_t word, Instant now) {
  if (connection.waiting.empty() && connection.side->response(word, now)) {
    counters_.forwarded += connection.side->on_bus() ? 1U : 0U;
    return;
  }
  if (!connection.waiting.push(word)) {
    break_down(connection, AbortCode::out_of_memory, now);
    return;
  }
  wake_ = earlier(wake_, now + WordQueue::kRetry);
}

void SdoIngress::flush(Connection& connection, Instant now) {
  while (!connection.waiting.empty()) {
    if (!connection.side->response(connection.waiting.front(), now)) {
      wake_ = earlier(wake_, now + WordQueue::kRetry);
      return;
    }
    counters_.forwarded += connection.side->on_bus() ? 1U : 0U;
    connection.waiting.pop();
  }
  if (connection.state == Connection::State::draining) {
    ClientSide& side = *connection.side;
    free(connection);
    side.released(now);
  }
}

void SdoIngress::release(Connection& connection, Instant now) {
  LINEGATE_ASSERT(connection.state != Connection::State::free, "the connection has a client");
  connection.state = Connection::State::draining;
  connection.deadline = kNever;
  flush(connection, now);
}

void SdoIngress::free(Connection& connection) {
  LINEGATE_ASSERT(connection.side != nullptr && connection.side->connection_ == connection.number,
                  "client and connection name each other");
  connection.state = Connection::State::free;
  connection.deadline = kNever;
  connection.side->connection_ = 0;
  connection.side = nullptr;
}

// Frames that still wait are obsolete, because the client gets an abort.
void SdoIngress::break_down(Connection& connection, AbortCode why, Instant now) {
  count_end(connection, SdoPhase::End::aborted, why, now);
  close_exit(connection, why);
  connection.waiting.clear();
  give(connection, sdo::abort_word(connection.phase.address(), why), now);
  release(connection, now);
}

void SdoIngress::close_exit(const Connection& connection, AbortCode why) {
  (void)post_.send(to_connection(MessageKind::sdo_close, connection.to, connection.number,
                                 static_cast<std::uint32_t>(why)));
}

void SdoIngress::count_end(Connection& connection, SdoPhase::End how, AbortCode why, Instant now) {
  if (connection.state != Connection::State::armed &&
      connection.state != Connection::State::forward) {
    return;
  }
  LINEGATE_ASSERT(counters_.open > 0, "an open connection is counted");
  --counters_.open;
  if (how == SdoPhase::End::finished) {
    ++counters_.finished;
  } else {
    ++(why == AbortCode::timeout ? counters_.timed_out : counters_.aborted);
  }
  const AbortCode code = connection.said != AbortCode::none ? connection.said : why;
  report_ended(connection, how == SdoPhase::End::finished ? AbortCode::none : code, now);
}

void SdoIngress::report_opened(const Connection& connection, Instant now) {
  if (!connection.traced) {
    return;
  }
  const Indication wanted = decode_indication(connection.word);
  events_.emit({.time = now,
                .data = event::RoutingOpened{.connection = connection.number,
                                             .suppressed = trace_.pop_withheld(),
                                             .source = source_of(*connection.side),
                                             .target = wanted.network,
                                             .target_node = wanted.node,
                                             .interface = connection.to,
                                             .gateway = connection.gateway,
                                             .hops = wanted.hops}});
}

void SdoIngress::report_ended(const Connection& connection, AbortCode why, Instant now) {
  if (!connection.traced) {
    return;
  }
  const Indication wanted = decode_indication(connection.word);
  events_.emit({.time = now,
                .data = event::RoutingEnded{.connection = connection.number,
                                            .abort = why,
                                            .bytes = connection.phase.bytes(),
                                            .source = source_of(*connection.side),
                                            .target = wanted.network,
                                            .index = connection.phase.address().index,
                                            .sub = connection.phase.address().sub,
                                            .target_node = wanted.node,
                                            .interface = connection.to,
                                            .gateway = connection.gateway,
                                            .service = connection.phase.service()}});
}

// --- time ---------------------------------------------------------------------------------------

void SdoIngress::wait_until(Connection& connection, Instant deadline) {
  connection.deadline = deadline;
  wake_ = earlier(wake_, deadline);
}

Duration SdoIngress::frame_timeout() const {
  return config_.frame_timeout > Duration::zero() ? config_.frame_timeout : 2 * line_.sdo_timeout;
}

Duration SdoIngress::opening_timeout(unsigned hops) const {
  return std::max(channel_wait(config_, line_.sdo_timeout),
                  gateway_timeout(config_, line_.sdo_timeout, hops)) +
         kMargin;
}

void SdoIngress::advance(Instant now) {
  now_ = now;
  if (now < wake_) {
    return;
  }
  wake_ = kNever;
  // By index: a client may start again when its connection ends, which adds connections.
  for (std::size_t i = 0; i < connections_.size(); ++i) {
    Connection& connection = *connections_[i];
    if (connection.state == Connection::State::free) {
      continue;
    }
    flush(connection, now);
    if (now >= connection.deadline) {
      expire(connection, now);
    }
    wake_ = earlier(wake_, connection.deadline);
  }
}

void SdoIngress::expire(Connection& connection, Instant now) {
  connection.deadline = kNever;
  switch (connection.state) {
    case Connection::State::opening:
      close_exit(connection, AbortCode::timeout);
      route_failed(connection, AbortCode::timeout, now);
      return;
    case Connection::State::armed:
      count_end(connection, SdoPhase::End::aborted, AbortCode::timeout, now);
      close_exit(connection, AbortCode::timeout);
      release(connection, now);
      return;
    default:
      break_down(connection, AbortCode::timeout, now);
      return;
  }
}

void SdoIngress::stop(Instant now) {
  for (std::size_t i = 0; i < connections_.size(); ++i) {
    Connection& connection = *connections_[i];
    if (connection.state != Connection::State::free &&
        connection.state != Connection::State::draining) {
      break_down(connection, connection.phase.stop_code(), now);
    }
  }
}

}  // namespace linegate::routing
