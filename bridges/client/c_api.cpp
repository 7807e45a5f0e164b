// SPDX-License-Identifier: Apache-2.0
// linegate.h on client.h: checks arguments and numbers, and lets no exception pass.
#include "bridges/client/c_api.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "bridges/client/c_handles.h"
#include "stack/line/output_write.h"

namespace client = linegate::client;

namespace {

constexpr std::size_t kMostNames = 65'536;
constexpr std::chrono::hours kLongestPoll{1};

// The clients that are open: a pointer of another one is refused. Never destroyed, as a thread may
// outlive main().
struct Open {
  std::mutex mutex;
  std::map<linegate_client*, std::shared_ptr<linegate_client>> clients;
};
Open& open() {
  static Open* const all = new Open;
  return *all;
}

// Of a function that polls, whose caller calls it again.
std::chrono::milliseconds timeout_of(int ms) {
  return std::clamp<std::chrono::milliseconds>(std::chrono::milliseconds(ms), {}, kLongestPoll);
}

}  // namespace

namespace linegate::client::capi {

std::shared_ptr<linegate_client> find_client(linegate_client* handle) {
  const std::lock_guard lock(open().mutex);
  const auto found = open().clients.find(handle);
  return found == open().clients.end() ? nullptr : found->second;
}

std::vector<std::byte> bytes_of(const void* data, std::size_t length) {
  const auto* const begin = static_cast<const std::byte*>(data);
  return length == 0 ? std::vector<std::byte>() : std::vector<std::byte>(begin, begin + length);
}

std::optional<Data> data_of(const linegate_setting& from) {
  const bool has_bytes = from.bytes != nullptr || from.length == 0;
  switch (from.type) {
    case LINEGATE_BOOLEAN:
      return from.integer != 0;
    case LINEGATE_INTEGER:
      return from.integer;
    case LINEGATE_UNSIGNED:
      return from.unsigned_integer;
    case LINEGATE_REAL:
      return from.real;
    case LINEGATE_TEXT:
      if (has_bytes && from.length <= LINEGATE_VALUE_BYTES)
        return std::string(static_cast<const char*>(from.bytes), from.length);
      return std::nullopt;
    case LINEGATE_BYTES:
      if (has_bytes && from.length <= LINEGATE_VALUE_BYTES)
        return bytes_of(from.bytes, from.length);
      return std::nullopt;
    default:
      return std::nullopt;
  }
}

linegate_event event_in_c(const Event& from) {
  linegate_event to{};
  to.size = sizeof to;
  to.gateway = from.gateway.c_str();
  to.line = from.line.c_str();
  to.name = from.name.c_str();
  to.text = from.text.c_str();
  to.number = from.number;
  to.stream = from.stream;
  to.time = from.time;
  to.code = from.code;
  to.value = from.value;
  to.kind = from.kind;
  to.severity = from.severity;
  to.node = from.node;
  to.length = static_cast<std::uint8_t>(std::min(from.data.size(), sizeof to.data));
  std::ranges::transform(from.data.begin(), from.data.begin() + to.length, to.data,
                         [](std::byte b) { return std::to_integer<std::uint8_t>(b); });
  to.missed = from.missed;
  to.journal_lost = from.journal_lost ? 1 : 0;
  return to;
}

CallOptions options_of(const Held& held, int line, int timeout_ms, unsigned attempts) {
  const auto of_line = held->attempts.find(line);
  return {
      .timeout = std::chrono::milliseconds(timeout_ms),
      .attempts = attempts != 0 || of_line == held->attempts.end() ? attempts : of_line->second};
}

}  // namespace linegate::client::capi

namespace {

using client::capi::bytes_of;
using client::capi::data_of;
using client::capi::find_client;
using client::capi::Held;
using client::capi::with;

int to_int(client::Error error) {
  switch (error) {
    case client::Error::none:
      return LINEGATE_OK;
    case client::Error::bad_argument:
      return LINEGATE_ERROR_ARGUMENT;
    case client::Error::not_ready:
      return LINEGATE_ERROR_NOT_READY;
    case client::Error::ambiguous:
      return LINEGATE_ERROR_AMBIGUOUS;
    case client::Error::no_name:
      return LINEGATE_ERROR_NAME;
    case client::Error::wrong_type:
      return LINEGATE_ERROR_TYPE;
    case client::Error::out_of_range:
      return LINEGATE_ERROR_RANGE;
    case client::Error::too_long:
      return LINEGATE_ERROR_TOO_LONG;
    case client::Error::closed:
      return LINEGATE_ERROR_CLOSED;
  }
  return LINEGATE_ERROR_ARGUMENT;
}

// Copies a text with its 0, cut to the size between two characters. Returns its length, or that it
// was cut.
int copy_text(const std::string& text, char* to, std::size_t size) {
  if (to == nullptr || size == 0)
    return static_cast<int>(text.size());
  std::size_t length = std::min(text.size(), size - 1);
  while (length > 0 && length < text.size() &&
         (static_cast<unsigned char>(text[length]) & 0xC0U) == 0x80U)
    --length;
  std::memcpy(to, text.data(), length);
  to[length] = 0;
  return length == text.size() ? static_cast<int>(length) : LINEGATE_ERROR_TOO_LONG;
}

void set_bytes(const void* data, std::size_t length, std::size_t most, linegate_value& to) {
  to.length = static_cast<std::uint32_t>(std::min(length, most));
  if (to.length != 0)
    std::memcpy(to.bytes, data, to.length);
}

struct ToC {
  linegate_value& to;

  void operator()(std::monostate) const { to.type = LINEGATE_NONE; }
  void operator()(bool value) const {
    to.type = LINEGATE_BOOLEAN;
    to.integer = value ? 1 : 0;
    to.number = value ? 1 : 0;
  }
  void operator()(std::int64_t value) const {
    to.type = LINEGATE_INTEGER;
    to.integer = value;
    to.number = static_cast<double>(value);
  }
  void operator()(std::uint64_t value) const {
    to.type = LINEGATE_UNSIGNED;
    to.unsigned_integer = value;
    to.number = static_cast<double>(value);
  }
  void operator()(double value) const {
    to.type = LINEGATE_REAL;
    to.real = value;
    to.number = value;
  }
  void operator()(const std::string& value) const {
    to.type = LINEGATE_TEXT;
    set_bytes(value.data(), value.size(), LINEGATE_VALUE_BYTES - 1, to);
  }
  void operator()(const std::vector<std::byte>& value) const {
    to.type = LINEGATE_BYTES;
    set_bytes(value.data(), value.size(), LINEGATE_VALUE_BYTES, to);
  }
};

linegate_value to_c(const client::Value& from) {
  linegate_value to{};
  to.quality = static_cast<std::int32_t>(from.quality);
  to.known = from.known ? 1 : 0;
  to.time = from.time;
  std::visit(ToC{to}, from.raw);
  to.raw = to.number;
  to.raw_type = to.type;
  if (from.data.index() != from.raw.index() || from.data != from.raw) {
    to.real = 0;
    std::visit(ToC{to}, from.data);
  }
  copy_text(from.unit, to.unit, sizeof to.unit);
  return to;
}

linegate_image image_of(const client::Snapshot& snapshot) {
  return {.time = snapshot.time, .sequence = snapshot.sequence, .lost = snapshot.lost};
}

// Names with commas between them.
std::vector<std::string> list_of(const char* text) {
  std::vector<std::string> out;
  for (std::string_view rest = text == nullptr ? "" : text; !rest.empty();) {
    const std::size_t end = std::min(rest.find(','), rest.size());
    out.emplace_back(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return out;
}

bool names_of(const char* const* names, std::size_t count, std::vector<std::string>& out) {
  if ((names == nullptr && count != 0) || count > kMostNames)
    return false;
  for (std::size_t i = 0; i < count; ++i) {
    if (names[i] == nullptr)
      return false;
    out.emplace_back(names[i]);
  }
  return true;
}

void call_with(const client::Event& from, linegate_on_event call_back, void* user) {
  const linegate_event to = client::capi::event_in_c(from);
  call_back(user, &to);
}

// While it exists, the client cannot be closed. Ends with an exception, too.
class Polling {
 public:
  explicit Polling(const Held& held) : held_(held) { ++held_->polls; }
  ~Polling() { --held_->polls; }
  Polling(const Polling&) = delete;
  Polling& operator=(const Polling&) = delete;

 private:
  const Held& held_;
};

int poll(const Held& held, std::chrono::nanoseconds timeout) {
  const Polling polling(held);
  const bool ok = held->client.poll(timeout);
  return ok ? LINEGATE_OK : LINEGATE_ERROR_CLOSED;
}

// Of a function that waits: not yet.
constexpr int kPending = std::numeric_limits<int>::min();
constexpr std::chrono::milliseconds kLineSlice{20};
constexpr std::chrono::milliseconds kCallSlice{500};  // ends when another thread wants the client

// Between two polls of a function that waits: the thread that is next has its turn. Not for ever,
// because within a call-back this thread keeps the client.
void let_others(linegate_client* handle) {
  constexpr std::chrono::milliseconds kTurn{5};
  if (const auto client = find_client(handle); client && client->turn.try_lock_for(kTurn))
    client->turn.unlock();
}

}  // namespace

namespace linegate::client {

linegate_client* adopt(Client client) {
  const auto made = std::make_shared<linegate_client>(std::move(client));
  const std::lock_guard lock(open().mutex);
  open().clients.emplace(made.get(), made);
  return made.get();
}

}  // namespace linegate::client

// --- client --------------------------------------------------------------------------------------

const char* linegate_error_text(int error) {
  switch (error) {
    case LINEGATE_OK:
      return "done";
    case LINEGATE_ERROR_ARGUMENT:
      return "an argument is not valid";
    case LINEGATE_ERROR_NOT_READY:
      return "the line is not ready";
    case LINEGATE_ERROR_AMBIGUOUS:
      return "several gateways have a line of that name: name it GATEWAY/LINE";
    case LINEGATE_ERROR_NAME:
      return "there is no such name";
    case LINEGATE_ERROR_TYPE:
      return "the value is not of the type of the output";
    case LINEGATE_ERROR_RANGE:
      return "the value is out of the range of its type, or beyond the limits of the output";
    case LINEGATE_ERROR_TOO_LONG:
      return "too long";
    case LINEGATE_ERROR_CLOSED:
      return "the client is closed";
    case LINEGATE_ERROR_TIMEOUT:
      return "not in time";
    case LINEGATE_ERROR_FAILED:
      return "the command failed";
    case LINEGATE_ERROR_MEMORY:
      return "no memory, or a failure of a library";
    case LINEGATE_ERROR_FULL:
      return "65,536 lines, groups, calls and subscriptions of the client were not freed";
    case LINEGATE_ERROR_MALFORMED:
      return "the gateway answered in a form that this version cannot read";
    default:
      return error > 0 ? "done" : "unknown error";
  }
}

const char* linegate_quality_text(int quality) {
  return quality < 0 || quality > LINEGATE_NAME_AMBIGUOUS
             ? "unknown"
             : client::describe(static_cast<client::Quality>(quality)).data();
}

const char* linegate_status_text(int status) {
  return status < 0 || status > LINEGATE_STATUS_AMBIGUOUS
             ? "unknown"
             : client::describe(static_cast<client::LineStatus>(status)).data();
}

const char* linegate_version(void) {
  return LINEGATE_VERSION;
}

linegate_client* linegate_connect(const linegate_options* options, char* error,
                                  std::size_t error_size) {
  copy_text("", error, error_size);
  try {
    client::Options to;
    // A program may have been built with a header whose options ended before `lines`.
    if (options != nullptr && options->size < offsetof(linegate_options, lines)) {
      copy_text("size of the options is not sizeof(linegate_options)", error, error_size);
      return nullptr;
    }
    const auto text = [](const char* from) { return from == nullptr ? std::string() : from; };
    if (options != nullptr) {
      to = {.domain = options->domain,
            .profile = text(options->profile),
            .identity = text(options->identity),
            .name = text(options->name),
            .strength = options->strength,
            .read_only = options->read_only != 0,
            .interfaces = list_of(options->interfaces),
            .peers = list_of(options->peers),
            .discovery_servers = list_of(options->discovery_servers),
            .multicast = options->multicast != 0};
      if (options->size >= sizeof(linegate_options))
        to.lines = list_of(options->lines);
    }
    client::Client made(to);
    if (!made) {
      copy_text(made.error(), error, error_size);
      return nullptr;
    }
    return client::adopt(std::move(made));
  } catch (...) {
    copy_text("no memory, or a failure of a library", error, error_size);
    return nullptr;
  }
}

int linegate_close(linegate_client* handle) {
  if (handle == nullptr)
    return LINEGATE_OK;
  return with(handle, [&](const Held& held) -> int {
    if (held->polls != 0)
      return LINEGATE_ERROR_ARGUMENT;
    {
      const std::lock_guard lock(open().mutex);
      open().clients.erase(handle);
    }
    held->objects.clear();
    const std::lock_guard waking(held->waking);
    const client::Client ended = std::move(held->client);
    return LINEGATE_OK;
  });
}

int linegate_poll(linegate_client* handle, int timeout_ms) {
  return with(handle, [&](const Held& held) -> int { return poll(held, timeout_of(timeout_ms)); });
}

int linegate_wake(linegate_client* handle) {
  try {
    const auto found = handle == nullptr ? nullptr : find_client(handle);
    if (!found)
      return handle == nullptr ? LINEGATE_ERROR_ARGUMENT : LINEGATE_ERROR_CLOSED;
    found->wake();
    return LINEGATE_OK;
  } catch (...) {
    return LINEGATE_ERROR_MEMORY;
  }
}

// --- lines ---------------------------------------------------------------------------------------

int linegate_line(linegate_client* handle, const char* name) {
  return with(handle, [&](const Held& held) -> int {
    return name == nullptr ? LINEGATE_ERROR_ARGUMENT : held.add(held->client.line(name));
  });
}

int linegate_line_status(linegate_client* handle, int line) {
  return with<client::Line>(handle, line, [](const Held& /*held*/, client::Line& it) -> int {
    return static_cast<int>(it.status());
  });
}

int linegate_line_wait(linegate_client* handle, int line, int timeout_ms) {
  for (auto left = timeout_of(timeout_ms);; let_others(handle)) {
    const auto slice = std::min(left, kLineSlice);
    const int result =
        with<client::Line>(handle, line, [&](const Held& held, client::Line& it) -> int {
          const Polling polling(held);
          return it.wait(slice) ? LINEGATE_OK : kPending;
        });
    left -= slice;
    if (result != kPending)
      return result;
    if (left <= std::chrono::milliseconds::zero())
      return LINEGATE_ERROR_TIMEOUT;
  }
}

int linegate_line_name(linegate_client* handle, int line, int outputs, std::size_t place,
                       char* name, std::size_t name_size) {
  return with<client::Line>(handle, line, [&](const Held& /*held*/, client::Line& it) -> int {
    const auto names = outputs != 0 ? it.outputs() : it.inputs();
    return place < names.size() ? copy_text(names[place], name, name_size) : LINEGATE_ERROR_NAME;
  });
}

// --- values --------------------------------------------------------------------------------------

int linegate_read(linegate_client* handle, int line, const char* const* names, std::size_t count,
                  linegate_value* values, linegate_image* image) {
  return with<client::Line>(handle, line, [&](const Held& /*held*/, client::Line& it) -> int {
    std::vector<std::string> wanted;
    if ((values == nullptr && count != 0) || !names_of(names, count, wanted))
      return LINEGATE_ERROR_ARGUMENT;
    const client::Snapshot snapshot = it.read(wanted);
    std::ranges::transform(snapshot.values, values, to_c);
    if (image != nullptr)
      *image = image_of(snapshot);
    return static_cast<int>(std::ranges::count_if(snapshot.values, &client::Value::good));
  });
}

int linegate_subscribe(linegate_client* handle, int line, const char* const* names,
                       std::size_t count, linegate_on_values call_back, void* user) {
  return with<client::Line>(handle, line, [&](const Held& held, client::Line& it) -> int {
    std::vector<std::string> wanted;
    if (call_back == nullptr || !names_of(names, count, wanted))
      return LINEGATE_ERROR_ARGUMENT;
    return held.add(it.on_change(wanted, [call_back, user](const client::Snapshot& snapshot) {
      std::vector<linegate_value> values(snapshot.values.size());
      std::ranges::transform(snapshot.values, values.begin(), to_c);
      const linegate_image image = image_of(snapshot);
      call_back(user, values.data(), values.size(), &image);
    }));
  });
}

int linegate_subscribe_lines(linegate_client* handle, linegate_on_line call_back, void* user) {
  return with(handle, [&](const Held& held) -> int {
    if (call_back == nullptr)
      return LINEGATE_ERROR_ARGUMENT;
    return held.add(held->client.on_line([call_back, user](const client::Change& change) {
      call_back(user, change.gateway.c_str(), change.line.c_str(), static_cast<int>(change.status),
                change.restarted ? 1 : 0, change.layout_changed ? 1 : 0);
    }));
  });
}

int linegate_subscribe_events(linegate_client* handle, linegate_on_event call_back, void* user) {
  return with(handle, [&](const Held& held) -> int {
    if (call_back == nullptr)
      return LINEGATE_ERROR_ARGUMENT;
    return held.add(held->client.on_event(
        [call_back, user](const client::Event& event) { call_with(event, call_back, user); }));
  });
}

int linegate_follow_events(linegate_client* handle, const char* after, linegate_on_event call_back,
                           void* user) {
  return with(handle, [&](const Held& held) -> int {
    if (call_back == nullptr)
      return LINEGATE_ERROR_ARGUMENT;
    auto reader = held->client.follow_events(
        after == nullptr ? std::nullopt : std::optional<std::string>(after),
        [call_back, user](const client::Event& event) { call_with(event, call_back, user); });
    return reader ? held.add(std::move(reader)) : LINEGATE_ERROR_ARGUMENT;
  });
}

int linegate_event_position(linegate_client* handle, int subscription, char* text,
                            std::size_t size) {
  return with<client::EventReader>(handle, subscription,
                                   [&](const Held&, const client::EventReader& reader) {
                                     return copy_text(reader.position(), text, size);
                                   });
}

int linegate_unsubscribe(linegate_client* handle, int subscription) {
  return with(handle, [&](const Held& held) -> int {
    if (held.get<client::Subscription>(subscription) == nullptr &&
        held.get<client::EventReader>(subscription) == nullptr)
      return LINEGATE_ERROR_ARGUMENT;
    const auto ended = held->objects.extract(subscription);  // destroyed last
    return LINEGATE_OK;
  });
}

// --- outputs -------------------------------------------------------------------------------------

int linegate_group(linegate_client* handle, int line, const char* name, int watchdog_ms,
                   unsigned reactions) {
  return with<client::Line>(handle, line, [&](const Held& held, client::Line& it) -> int {
    if (name == nullptr || watchdog_ms < 0 || reactions > 0xFF)
      return LINEGATE_ERROR_ARGUMENT;
    return held.add(it.group(name, {.watchdog = std::chrono::milliseconds(watchdog_ms),
                                    .reactions = static_cast<std::uint8_t>(reactions)}));
  });
}

namespace {

int set_value(linegate_client* handle, int group, const char* name, const client::Data& value,
              bool raw = false) {
  return with<client::Group>(handle, group, [&](const Held& /*held*/, client::Group& it) -> int {
    if (name == nullptr)
      return LINEGATE_ERROR_ARGUMENT;
    return to_int(raw ? it.set_raw(name, value) : it.set(name, value));
  });
}

}  // namespace

int linegate_set_integer(linegate_client* handle, int group, const char* name, std::int64_t value) {
  return set_value(handle, group, name, value);
}

int linegate_set_unsigned(linegate_client* handle, int group, const char* name,
                          std::uint64_t value) {
  return set_value(handle, group, name, value);
}

int linegate_set_real(linegate_client* handle, int group, const char* name, double value) {
  return set_value(handle, group, name, value);
}

int linegate_set_raw_integer(linegate_client* handle, int group, const char* name,
                             std::int64_t value) {
  return set_value(handle, group, name, value, true);
}

int linegate_set_raw_unsigned(linegate_client* handle, int group, const char* name,
                              std::uint64_t value) {
  return set_value(handle, group, name, value, true);
}

int linegate_set_raw_real(linegate_client* handle, int group, const char* name, double value) {
  return set_value(handle, group, name, value, true);
}

int linegate_set_bytes(linegate_client* handle, int group, const char* name, const void* bytes,
                       std::size_t length) {
  return with<client::Group>(handle, group, [&](const Held& /*held*/, client::Group& it) -> int {
    if (name == nullptr || bytes == nullptr)
      return LINEGATE_ERROR_ARGUMENT;
    return length > linegate::line::OutputValue::kMaxLength
               ? LINEGATE_ERROR_RANGE
               : to_int(it.set(name, bytes_of(bytes, length)));
  });
}

int linegate_set_text(linegate_client* handle, int group, const char* name, const char* text) {
  return with<client::Group>(handle, group, [&](const Held& /*held*/, client::Group& it) -> int {
    if (name == nullptr || text == nullptr)
      return LINEGATE_ERROR_ARGUMENT;
    return to_int(it.set(name, std::string(text)));
  });
}

int linegate_set(linegate_client* handle, int group, const linegate_setting* settings,
                 std::size_t count, std::size_t* failed) {
  return with<client::Group>(handle, group, [&](const Held& /*held*/, client::Group& it) -> int {
    if ((settings == nullptr && count != 0) || count > kMostNames)
      return LINEGATE_ERROR_ARGUMENT;
    std::vector<client::Setting> all;
    for (const linegate_setting& from : std::span(settings, count)) {
      if (failed != nullptr)
        *failed = all.size();
      const auto value = data_of(from);
      if (from.name == nullptr || !value)
        return LINEGATE_ERROR_ARGUMENT;
      all.push_back({from.name, *value, from.raw != 0});
    }
    return to_int(it.set(all, failed));
  });
}

int linegate_arm(linegate_client* handle, int group) {
  return with<client::Group>(handle, group, [](const Held& /*held*/, client::Group& it) -> int {
    return to_int(it.arm());
  });
}

int linegate_release(linegate_client* handle, int group) {
  return with<client::Group>(handle, group, [](const Held& /*held*/, client::Group& it) -> int {
    it.release();
    return LINEGATE_OK;
  });
}

int linegate_group_state(linegate_client* handle, int group, char* text, std::size_t text_size) {
  return with<client::Group>(handle, group, [&](const Held& /*held*/, client::Group& it) -> int {
    copy_text(it.text(), text, text_size);
    return static_cast<int>(it.state());
  });
}

int linegate_group_owner(linegate_client* handle, int group, char* owner, std::size_t owner_size) {
  return with<client::Group>(handle, group, [&](const Held& /*held*/, client::Group& it) -> int {
    return copy_text(it.owner(), owner, owner_size);
  });
}

int linegate_subscribe_group(linegate_client* handle, int group, linegate_on_group call_back,
                             void* user) {
  return with<client::Group>(handle, group, [&](const Held& held, client::Group& it) -> int {
    if (call_back == nullptr)
      return LINEGATE_ERROR_ARGUMENT;
    return held.add(it.on_state([call_back, user, group](const client::Group& now) {
      call_back(user, group, static_cast<int>(now.state()));
    }));
  });
}

// --- commands ------------------------------------------------------------------------------------

int linegate_set_attempts(linegate_client* handle, int line, unsigned attempts) {
  return with<client::Line>(handle, line, [&](const Held& held, client::Line& /*it*/) -> int {
    held->attempts[line] = attempts;
    return LINEGATE_OK;
  });
}

namespace {

template <class Start>
int with_line(linegate_client* handle, int line, int timeout_ms, const Start& start) noexcept {
  return with<client::Line>(handle, line, [&](const Held& held, client::Line& it) -> int {
    return client::capi::begin_call(
        held, line, timeout_ms,
        [&](const client::CallOptions& options) { return start(it, options); });
  });
}

}  // namespace

int linegate_sdo_read(linegate_client* handle, int line, unsigned node, unsigned index,
                      unsigned sub, int timeout_ms) {
  return with_line(handle, line, timeout_ms, [&](const client::Line& it, const auto& options) {
    return it.sdo_read(node, index, sub, options);
  });
}

int linegate_sdo_write(linegate_client* handle, int line, unsigned node, unsigned index,
                       unsigned sub, const void* value, std::size_t length, int timeout_ms) {
  if ((value == nullptr && length != 0) || length > client::capi::kMostData)
    return LINEGATE_ERROR_ARGUMENT;
  return with_line(handle, line, timeout_ms, [&](const client::Line& it, const auto& options) {
    return it.sdo_write(node, index, sub, bytes_of(value, length), options);
  });
}

int linegate_nmt(linegate_client* handle, int line, unsigned node, unsigned command,
                 int timeout_ms) {
  return with_line(handle, line, timeout_ms, [&](const client::Line& it, const auto& options) {
    return it.nmt(node, command, options);
  });
}

int linegate_request_call(linegate_client* handle, int line, const linegate_request* request,
                          int timeout_ms) {
  return with<client::Line>(handle, line, [&](const Held& held, client::Line& it) -> int {
    if (request == nullptr || request->size < client::capi::kFirstSize<linegate_request> ||
        (request->data == nullptr && request->length != 0) ||
        request->length > client::capi::kMostData)
      return LINEGATE_ERROR_ARGUMENT;
    if (held.full())  // what is reported as failed is not sent
      return LINEGATE_ERROR_FULL;
    return held.add(
        it.request({.kind = request->kind,
                    .node = request->node,
                    .index = request->index,
                    .sub = request->sub,
                    .nmt = request->nmt,
                    .code = request->code,
                    .error_register = request->error_register,
                    .entry = request->entry,
                    .layout_id = request->layout_id,
                    .data = bytes_of(request->data, request->length)},
                   client::capi::options_of(held, line, timeout_ms, request->attempts)));
  });
}

int linegate_call_wait(linegate_client* handle, int call) {
  for (;; let_others(handle)) {
    const int result =
        with<client::Call>(handle, call, [](const Held& held, client::Call& it) -> int {
          if (it.done())
            return it.ok() ? static_cast<int>(it.bytes().size()) : LINEGATE_ERROR_FAILED;
          const int polled = poll(held, kCallSlice);
          return polled == LINEGATE_OK ? kPending : polled;
        });
    if (result != kPending)
      return result;
  }
}

int linegate_call_result(linegate_client* handle, int call, linegate_result* result) {
  return with<client::Call>(handle, call, [&](const Held& /*held*/, client::Call& it) -> int {
    if (result == nullptr)
      return LINEGATE_ERROR_ARGUMENT;
    *result = {};
    result->outcome = static_cast<std::int32_t>(it.outcome());
    result->code = it.code();
    result->length = it.bytes().size();
    result->number = it.number();
    result->progress_done = it.progress().first;
    result->progress_total = it.progress().second;
    copy_text(it.text(), result->text, sizeof result->text);
    return LINEGATE_OK;
  });
}

int linegate_call_data(linegate_client* handle, int call, void* data, std::size_t size) {
  return with<client::Call>(handle, call, [&](const Held& /*held*/, client::Call& it) -> int {
    if (data == nullptr && size != 0)
      return LINEGATE_ERROR_ARGUMENT;
    const auto bytes = it.bytes();
    const std::size_t length = std::min(bytes.size(), size);
    if (length != 0)
      std::memcpy(data, bytes.data(), length);
    return static_cast<int>(length);
  });
}

int linegate_call_cancel(linegate_client* handle, int call) {
  return with<client::Call>(handle, call, [](const Held& /*held*/, client::Call& it) -> int {
    it.cancel();
    return LINEGATE_OK;
  });
}

int linegate_call_notify(linegate_client* handle, int call, linegate_on_call call_back,
                         void* user) {
  return with<client::Call>(handle, call, [&](const Held& /*held*/, client::Call& it) -> int {
    if (call_back == nullptr)
      return LINEGATE_ERROR_ARGUMENT;
    it.on_done([call_back, user, call](const client::Call& /*done*/) { call_back(user, call); });
    return LINEGATE_OK;
  });
}

int linegate_free(linegate_client* handle, int number) {
  return with(handle, [&](const Held& held) -> int {
    if (auto* const call = held.get<client::Call>(number))
      call->on_done({});
    held->attempts.erase(number);
    held->results.erase(number);
    return held->objects.erase(number) == 0 ? LINEGATE_ERROR_ARGUMENT : LINEGATE_OK;
  });
}
