// SPDX-License-Identifier: Apache-2.0
// Shared by the functions of linegate.h: a client with the objects of its numbers, and checks of
// arguments.
#pragma once

#include <algorithm>
#include <any>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "bridges/client/client.h"
#include "bridges/client/linegate.h"

struct linegate_client {
  explicit linegate_client(linegate::client::Client the_client) : client(std::move(the_client)) {}

  // From any thread: poll() holds `mutex`.
  void wake() {
    const std::lock_guard lock(waking);
    client.wake();
  }

  // Recursive for call-backs, timed because a poll() in another thread has to be woken.
  std::recursive_timed_mutex mutex;
  std::timed_mutex turn;  // before `mutex`, of the thread that is the next to have it
  std::mutex waking;      // after `mutex`: while a wake() is under way, the client is not ended
  linegate::client::Client client;
  using Object =
      std::variant<linegate::client::Line, linegate::client::Group, linegate::client::Call,
                   linegate::client::Subscription, linegate::client::EventReader>;
  std::map<int, Object> objects;
  std::map<int, unsigned> attempts;  // of the commands to a line, if it was set
  std::map<int, std::any> results;   // of calls, once they were read: the structs in C point there
  int next = 1;
  int polls = 0;  // depth: a client is not closed within a call-back
};

namespace linegate::client::capi {

inline constexpr std::chrono::milliseconds kWakeAgain{10};
inline constexpr std::size_t kMostObjects = 65'536;
inline constexpr std::size_t kMostData = 16U << 20U;  // of a request

// Empty: it was closed, or never was one.
std::shared_ptr<linegate_client> find_client(linegate_client* handle);

// Holds a client for the time of a function.
class Held {
 public:
  explicit Held(linegate_client* handle) : it_(find_client(handle)) {
    if (!it_)
      return;
    if (!it_->mutex.try_lock()) {
      const std::lock_guard next(it_->turn);
      do
        it_->wake();
      while (!it_->mutex.try_lock_for(kWakeAgain));
    }
    if (!it_->client.ok()) {  // it was closed meanwhile
      it_->mutex.unlock();
      it_.reset();
    }
  }
  ~Held() {
    if (it_)
      it_->mutex.unlock();
  }
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;

  explicit operator bool() const { return it_ != nullptr; }
  linegate_client* operator->() const { return it_.get(); }
  linegate_client& operator*() const { return *it_; }
  std::shared_ptr<linegate_client> share() const { return it_; }

  template <class T>
  T* get(int number) const {
    const auto found = it_->objects.find(number);
    return found == it_->objects.end() ? nullptr : std::get_if<T>(&found->second);
  }
  // Numbers are not used again.
  bool full() const {
    return it_->next == std::numeric_limits<int>::max() || it_->objects.size() >= kMostObjects;
  }
  template <class T>
  int add(T object) const {
    if (full())
      return LINEGATE_ERROR_FULL;
    it_->objects.emplace(it_->next, std::move(object));
    return it_->next++;
  }

 private:
  std::shared_ptr<linegate_client> it_;
};

// Runs `body` with the client.
template <class Body>
int with(linegate_client* handle, const Body& body) noexcept {
  if (handle == nullptr)
    return LINEGATE_ERROR_ARGUMENT;
  try {
    const Held held(handle);
    return held ? body(held) : LINEGATE_ERROR_CLOSED;
  } catch (...) {
    return LINEGATE_ERROR_MEMORY;
  }
}

// The same with one of its objects.
template <class T, class Body>
int with(linegate_client* handle, int number, const Body& body) noexcept {
  return with(handle, [&](const Held& held) -> int {
    T* const object = held.get<T>(number);
    if (object == nullptr)
      return LINEGATE_ERROR_ARGUMENT;
    T copy = *object;  // a call-back may end it
    return body(held, copy);
  });
}

std::vector<std::byte> bytes_of(const void* data, std::size_t length);
// Nothing: it has no value.
std::optional<Data> data_of(const linegate_setting& from);
// With the texts of `from`.
linegate_event event_in_c(const Event& from);
// Of a command to a line. attempts: 0 = those of the line.
CallOptions options_of(const Held& held, int line, int timeout_ms, unsigned attempts = 0);

// Adds a call to a line, which `start` begins with these options.
template <class Start>
int begin_call(const Held& held, int line, int timeout_ms, const Start& start) {
  if (held.full())  // what is reported as failed is not sent
    return LINEGATE_ERROR_FULL;
  Call call = start(options_of(held, line, timeout_ms));
  return held.add(std::move(call));
}

// --- structs that may grow -----------------------------------------------------------------------

// The size of a struct in the first version that had it. Later versions add members at its end, and
// not into its padding.
template <class T>
inline constexpr std::size_t kFirstSize = 0;
#define FIRST_SIZE(type, last) \
  template <>                  \
  inline constexpr std::size_t kFirstSize<type> = offsetof(type, last) + sizeof(type::last)
FIRST_SIZE(linegate_event, journal_lost);
FIRST_SIZE(linegate_request, attempts);
FIRST_SIZE(linegate_object, length);
FIRST_SIZE(linegate_delivery, missing_count);
FIRST_SIZE(linegate_scanned_node, values);
FIRST_SIZE(linegate_object_value, length);
FIRST_SIZE(linegate_boot_result, text);
FIRST_SIZE(linegate_configuration, differences);
FIRST_SIZE(linegate_difference, found_length);
FIRST_SIZE(linegate_program_fault, value);
FIRST_SIZE(linegate_lss_result, assignments);
FIRST_SIZE(linegate_lss_assignment, address);
FIRST_SIZE(linegate_connection, abort);
FIRST_SIZE(linegate_journal_page, unknown_entry);
FIRST_SIZE(linegate_history_value, valid);
FIRST_SIZE(linegate_journal_query, cursor_check);
#undef FIRST_SIZE

// Copies a result to the struct of the caller, whose version of it may have fewer members, or more:
// its size is then that of those which are set.
template <class T>
int give(T from, T* to) {
  static_assert(kFirstSize<T> != 0);
  if (to == nullptr || to->size < kFirstSize<T>)
    return LINEGATE_ERROR_ARGUMENT;
  from.size = std::min(to->size, sizeof(T));
  std::memcpy(static_cast<void*>(to), &from, from.size);
  return LINEGATE_OK;
}

}  // namespace linegate::client::capi
