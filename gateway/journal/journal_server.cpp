// SPDX-License-Identifier: Apache-2.0
#include "gateway/journal/journal_server.h"

#include <span>
#include <utility>
#include <variant>

#include <poll.h>
#include <pthread.h>

#include "gateway/runtime/clock.h"
#include "stack/base/assert.h"

namespace linegate::gateway {
namespace {

constexpr auto kPause = std::chrono::milliseconds(1);

}  // namespace

line::Reply refused_page(std::uint64_t tag, const PageRefusal& refusal) {
  const auto text = std::as_bytes(std::span(refusal.text));
  return {.tag = tag,
          .error = line::to_error(refusal.refusal),
          .data = std::vector(text.begin(), text.end())};
}

JournalServer::JournalServer(std::string file, exchange::Ring<line::Reply>& replies,
                             exchange::Wakeup& answered)
    : pages_(std::move(file)), replies_(replies), answered_(answered) {
}

JournalServer::~JournalServer() {
  stop_.raise();
  wakeup_.signal();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void JournalServer::start() {
  if (thread_.joinable()) {
    return;
  }
  stop_.lower();
  ended_.lower();
  thread_ = std::thread([this] { run(); });
}

bool JournalServer::stop() {
  if (!thread_.joinable()) {
    return true;
  }
  stop_.raise();
  wakeup_.signal();
  for (const Instant until = monotonic_now() + kLongestStop; !ended_.raised();) {
    if (monotonic_now() >= until) {
      const std::lock_guard lock(given_up_mutex_);
      given_up_ = true;
      return false;
    }
    std::this_thread::sleep_for(kPause);
  }
  thread_.join();
  return true;
}

void JournalServer::run() {
  pthread_setname_np(pthread_self(), "journal-read");
  for (;;) {
    wakeup_.clear();
    const bool last = stop_.raised();
    for (request::GatewayCommand command; requests_.pop(command);) {
      push(answer(command));
    }
    pages_.close();
    if (last) {
      ended_.raise();
      return;
    }
    pollfd waiting{wakeup_.descriptor(), POLLIN, 0};
    poll(&waiting, 1, -1);
  }
}

line::Reply JournalServer::answer(const request::GatewayCommand& command) {
  const auto* const request = std::get_if<request::JournalRead>(&command.request);
  LINEGATE_ASSERT(request != nullptr, "only requests for pages are passed to this thread");
  if (stop_.raised()) {
    return refused_page(command.tag, {line::Refusal::cancelled, "the gateway is stopping"});
  }
  const auto result = pages_.read(*request, stop_);
  if (const auto* const refusal = std::get_if<PageRefusal>(&result)) {
    return refused_page(command.tag, *refusal);
  }
  return {.tag = command.tag, .data = encode(std::get<request::JournalPage>(result))};
}

// The publisher is stopped during a reload.
void JournalServer::push(line::Reply reply) {
  const Instant until = monotonic_now() + kLongestStop;
  while (!try_push(reply)) {
    if (stop_.raised() && monotonic_now() >= until) {
      return;
    }
    std::this_thread::sleep_for(kPause);
  }
}

// True: the reply was passed on, or is not wanted any more.
bool JournalServer::try_push(line::Reply& reply) {
  const std::lock_guard lock(given_up_mutex_);
  if (given_up_) {
    return true;
  }
  const bool pushed = replies_.push(reply);
  if (pushed) {
    answered_.signal();
  }
  return pushed;
}

}  // namespace linegate::gateway
