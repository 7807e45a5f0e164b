// SPDX-License-Identifier: Apache-2.0
// The input is a sequence of calls of linegate.h, with arguments that fit and that do not, also
// within call-backs, and samples between them (client_world.h). Promises: no crash; each function
// returns 0 or more, or the error that its arguments deserve, and no failure of the library; texts
// end within their buffer; numbers are not used again; what was ended has no call-back any more; a
// client is not closed within a call-back, and nothing works after its end.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/client/c_api.h"

#include "tests/fuzz/client_world.h"
#include "tests/fuzz/expect.h"
#include "tests/fuzz/input.h"

namespace {

using namespace linegate;
using fuzz::ClientWorld;
using fuzz::Input;
using fuzz::number;

constexpr int kMostDepth = 3;  // of call-backs within call-backs

// A buffer of exactly that size: a sanitizer sees a byte that is written behind it.
class Buffer {
 public:
  explicit Buffer(std::size_t size) : bytes_(new char[size]), size_(size) {
    std::memset(bytes_.get(), 'x', size);
  }
  char* data() const { return size_ == 0 ? nullptr : bytes_.get(); }
  std::size_t size() const { return size_; }
  bool is_text() const { return size_ == 0 || std::memchr(bytes_.get(), 0, size_) != nullptr; }

 private:
  std::unique_ptr<char[]> bytes_;
  std::size_t size_;
};

void check(const linegate_value& value) {
  LINEGATE_EXPECT(std::string_view(linegate_quality_text(value.quality)) != "unknown");
  LINEGATE_EXPECT(value.type >= LINEGATE_NONE && value.type <= LINEGATE_BYTES);
  LINEGATE_EXPECT(value.quality != LINEGATE_GOOD || value.type != LINEGATE_NONE);
  LINEGATE_EXPECT(value.length <= LINEGATE_VALUE_BYTES);
  LINEGATE_EXPECT(value.type != LINEGATE_TEXT || value.bytes[value.length] == 0);
  LINEGATE_EXPECT(std::memchr(value.unit, 0, sizeof value.unit) != nullptr);
}

class Application {
 public:
  explicit Application(const std::shared_ptr<ClientWorld>& world) : world_(world), in_(world->in) {
    open();
  }

  void step() {
    static constexpr std::array kSteps{
        &Application::poll,     &Application::poll,        &Application::poll,
        &Application::results,  &Application::line,        &Application::look_at_line,
        &Application::read,     &Application::subscribe,   &Application::follow,
        &Application::position, &Application::end_object,  &Application::group,
        &Application::set,      &Application::set_several, &Application::use_group,
        &Application::call,     &Application::typed,       &Application::use_call,
        &Application::connect,  &Application::close};
    (this->*kSteps[in_.byte() % kSteps.size()])();
  }

  void end() {
    LINEGATE_EXPECT(linegate_close(client_) == LINEGATE_OK);
    LINEGATE_EXPECT(linegate_poll(client_, 0) == LINEGATE_ERROR_CLOSED);
    LINEGATE_EXPECT(linegate_line(client_, "press") == LINEGATE_ERROR_CLOSED);
    LINEGATE_EXPECT(linegate_free(client_, 1) == LINEGATE_ERROR_CLOSED);
    LINEGATE_EXPECT(linegate_close(client_) == LINEGATE_ERROR_CLOSED);
  }

 private:
  // The user pointer of a call-back.
  struct Registration {
    Application* application;
    bool ended = false;
    bool once = false;
  };

  void open() {
    client_ = client::adopt(client_of(world_));
    newest_ = 0;
    numbers_.clear();
    of_number_.clear();
    line();
  }

  // --- arguments ---

  linegate_client* handle() {
    static int foreign = 0;
    switch (in_.byte() % 64) {
      case 1:
        return nullptr;
      case 2:
        return reinterpret_cast<linegate_client*>(&foreign);
      default:
        return client_;
    }
  }
  int object() {
    const std::uint8_t byte = in_.byte();
    if (numbers_.empty() || byte % 16 == 15)
      return static_cast<int>(number(in_));
    return numbers_[byte % numbers_.size()];
  }
  const char* text() {
    const std::uint8_t byte = in_.byte();
    return byte == 0xFF ? nullptr : fuzz::kNames[byte % std::size(fuzz::kNames)].c_str();
  }
  std::vector<const char*> texts() {
    std::vector<const char*> out(in_.byte() % 4);
    for (const char*& one : out)
      one = text();
    return out;
  }
  Buffer buffer() { return Buffer(in_.byte() % 48); }
  void* registration(bool once = false) {
    return &registrations_.emplace_back(Registration{.application = this, .once = once});
  }

  // --- results ---

  static int check(int result) {
    LINEGATE_EXPECT(result >= LINEGATE_ERROR_FAILED);  // and not LINEGATE_ERROR_MEMORY
    LINEGATE_EXPECT(result >= 0 ||
                    std::string_view(linegate_error_text(result)) != "unknown error");
    return result;
  }
  static void check_text(int result, const Buffer& text) {
    if (check(result) >= 0 && text.size() != 0) {
      LINEGATE_EXPECT(text.is_text());
      LINEGATE_EXPECT(std::strlen(text.data()) <= static_cast<std::size_t>(result));
    }
  }
  // A new object, with the registration of its call-back, if any.
  void keep(int result, void* registration = nullptr) {
    if (check(result) <= 0)
      return;
    LINEGATE_EXPECT(result > newest_);
    newest_ = result;
    numbers_.push_back(result);
    if (registration != nullptr)
      of_number_.emplace(result, static_cast<Registration*>(registration));
  }
  void note_end(int ended) {
    const auto [begin, end] = of_number_.equal_range(ended);
    for (auto it = begin; it != end; ++it)
      it->second->ended = true;
  }

  // --- call-backs ---

  static void called(void* user) {
    auto& registration = *static_cast<Registration*>(user);
    LINEGATE_EXPECT(!registration.ended);
    registration.ended = registration.once;
    Application& application = *registration.application;
    LINEGATE_EXPECT(application.polls_ > 0);
    if (application.depth_ == kMostDepth || application.in_.byte() % 2 == 0)
      return;
    ++application.depth_;
    application.step();
    --application.depth_;
  }
  static void on_values(void* user, const linegate_value* values, std::size_t count,
                        const linegate_image* image) {
    for (std::size_t i = 0; i < count; ++i)
      ::check(values[i]);
    LINEGATE_EXPECT(image != nullptr);
    called(user);
  }
  static void on_line(void* user, const char* gateway, const char* line, int status, int restarted,
                      int changed) {
    LINEGATE_EXPECT(gateway != nullptr && line != nullptr && restarted <= 1 && changed <= 1);
    LINEGATE_EXPECT(std::string_view(linegate_status_text(status)) != "unknown");
    called(user);
  }
  static void on_event(void* user, const linegate_event* event) {
    LINEGATE_EXPECT(std::strlen(event->gateway) + std::strlen(event->line) < 1000);
    LINEGATE_EXPECT(std::strlen(event->name) + std::strlen(event->text) < 1000);
    LINEGATE_EXPECT(event->length <= sizeof event->data);
    called(user);
  }
  static void on_group(void* user, int /*group*/, int state) {
    LINEGATE_EXPECT(state >= LINEGATE_GROUP_IDLE && state <= LINEGATE_GROUP_LOST);
    called(user);
  }
  static void on_call(void* user, int /*call*/) { called(user); }

  // --- steps ---

  template <class Function>
  int polling(const Function& function) {
    ++polls_;
    const int out = function();
    --polls_;
    return out;
  }
  // Short: a group with a watchdog of 1 ms is written many times within a long poll.
  int timeout() { return static_cast<int>(number(in_) % 2000) - 1; }

  void poll() {
    linegate_client* const with = handle();
    const int time = timeout();
    check(polling([&] { return linegate_poll(with, time); }));
    check(linegate_wake(handle()));
  }
  void line() {
    static constexpr std::array kLines{"press", "gw/press", "hall", "", "/", "gw/"};
    const std::uint8_t byte = in_.byte();
    keep(linegate_line(handle(), byte == 0xFF ? nullptr : kLines[byte % kLines.size()]));
  }
  void look_at_line() {
    const int line = object();
    const int status = check(linegate_line_status(handle(), line));
    if (status >= 0)
      LINEGATE_EXPECT(std::string_view(linegate_status_text(status)) != "unknown");
    const Buffer name = buffer();
    check_text(
        linegate_line_name(handle(), line, in_.byte() % 2, number(in_), name.data(), name.size()),
        name);
    if (in_.byte() % 4 == 0) {
      linegate_client* const with = handle();
      const int time = timeout();
      check(polling([&] { return linegate_line_wait(with, line, time); }));
    }
  }
  void read() {
    const std::vector<const char*> names = texts();
    const std::unique_ptr<linegate_value[]> values(new linegate_value[names.size()]);
    linegate_image image{};
    const int good = check(linegate_read(handle(), object(), names.data(), names.size(),
                                         in_.byte() == 0xFF ? nullptr : values.get(),
                                         in_.flag() ? &image : nullptr));
    for (std::size_t i = 0; good > 0 && i < names.size(); ++i)
      ::check(values[i]);
    LINEGATE_EXPECT(good <= static_cast<int>(names.size()));
  }
  void subscribe() {
    void* const user = registration();
    const std::vector<const char*> names = texts();
    switch (in_.byte() % 5) {
      case 0:
        return keep(linegate_subscribe_lines(handle(), on_line, user), user);
      case 1:
        return keep(linegate_subscribe_events(handle(), on_event, user), user);
      case 2:
        return keep(linegate_subscribe_group(handle(), object(), on_group, user), user);
      case 3:
        return keep(linegate_subscribe_lines(handle(), nullptr, nullptr));
      default:
        return keep(linegate_subscribe(handle(), object(), names.data(), names.size(),
                                       in_.byte() == 0xFF ? nullptr : on_values, user),
                    user);
    }
  }
  void follow() {
    static constexpr std::array<const char*, 4> kAfter{nullptr, "", "1:2:gw/press", "1:x"};
    void* const user = registration();
    const char* const after = in_.flag() ? position_.c_str() : kAfter[in_.byte() % kAfter.size()];
    keep(linegate_follow_events(handle(), after, on_event, user), user);
  }
  void position() {
    const int reader = object();
    const Buffer cut = buffer();
    check_text(linegate_event_position(handle(), reader, cut.data(), cut.size()), cut);
    const int length = linegate_event_position(client_, reader, nullptr, 0);
    if (length < 0)
      return;
    const Buffer whole(static_cast<std::size_t>(length) + 1);
    LINEGATE_EXPECT(linegate_event_position(client_, reader, whole.data(), whole.size()) == length);
    position_ = whole.data();
    const int again = linegate_follow_events(client_, position_.c_str(), on_event, registration());
    LINEGATE_EXPECT(again > 0);
    LINEGATE_EXPECT(linegate_unsubscribe(client_, again) == LINEGATE_OK);
    newest_ = again;
  }
  void end_object() {
    const int ended = object();
    linegate_client* const with = handle();
    const int result = in_.flag() ? linegate_unsubscribe(with, ended) : linegate_free(with, ended);
    if (check(result) == LINEGATE_OK) {
      note_end(ended);
      LINEGATE_EXPECT(linegate_free(client_, ended) == LINEGATE_ERROR_ARGUMENT);
    }
  }
  void group() {
    keep(linegate_group(handle(), object(), text(), timeout(), static_cast<unsigned>(number(in_))));
  }
  void set() {
    const int group = object();
    const char* const name = text();
    const std::vector<std::byte> bytes = in_.bytes(in_.byte() % 12);
    const auto value = number(in_);
    switch (in_.byte() % 8) {
      case 0:
        return void(
            check(linegate_set_integer(handle(), group, name, static_cast<std::int64_t>(value))));
      case 1:
        return void(check(linegate_set_unsigned(handle(), group, name, value)));
      case 2:
        return void(check(linegate_set_real(handle(), group, name, static_cast<double>(value))));
      case 3:
        return void(check(linegate_set_bytes(handle(), group, name, bytes.data(), bytes.size())));
      case 4:
        return void(check(linegate_set_text(handle(), group, name, text())));
      case 5:
        return void(check(
            linegate_set_raw_integer(handle(), group, name, static_cast<std::int64_t>(value))));
      case 6:
        return void(check(linegate_set_raw_unsigned(handle(), group, name, value)));
      default:
        return void(check(linegate_set_raw_real(handle(), group, name,
                                                std::numeric_limits<double>::quiet_NaN())));
    }
  }
  void set_several() {
    const std::vector<std::byte> bytes = in_.bytes(in_.byte() % 12);
    std::vector<linegate_setting> settings(in_.byte() % 4);
    for (linegate_setting& one : settings) {
      one.name = text();
      one.type = in_.byte() % 8;
      one.raw = in_.byte() % 2;
      one.integer = static_cast<std::int64_t>(number(in_));
      one.unsigned_integer = number(in_);
      one.real = static_cast<double>(one.integer);
      one.bytes = in_.byte() == 0xFF ? nullptr : bytes.data();
      one.length = bytes.size();
    }
    std::size_t failed = settings.size();
    if (check(linegate_set(handle(), object(), settings.data(), settings.size(), &failed)) < 0)
      LINEGATE_EXPECT(failed <= settings.size());
  }
  void use_group() {
    const int group = object();
    const Buffer words = buffer();
    switch (in_.byte() % 4) {
      case 0:
        world_->armed = true;
        check(linegate_arm(handle(), group));
        return;
      case 1:
        check(linegate_release(handle(), group));
        return;
      case 2:
        check(linegate_group_state(handle(), group, words.data(), words.size()));
        return;
      default:
        return check_text(linegate_group_owner(handle(), group, words.data(), words.size()), words);
    }
  }
  void call() {
    const int line = object();
    const auto node = static_cast<unsigned>(number(in_));
    const auto index = static_cast<unsigned>(number(in_));
    const std::vector<std::byte> bytes = in_.bytes(in_.byte() % 12);
    linegate_request request{};
    switch (in_.byte() % 4) {
      case 0:
        return keep(linegate_sdo_read(handle(), line, node, index, in_.byte(), timeout()));
      case 1:
        return keep(linegate_sdo_write(handle(), line, node, index, in_.byte(), bytes.data(),
                                       in_.byte() == 0xFF ? std::size_t{1} << 40U : bytes.size(),
                                       timeout()));
      case 2:
        return keep(linegate_nmt(handle(), line, node, index, timeout()));
      default:
        request = {.size = sizeof request - in_.byte() / 255U,
                   .kind = in_.byte(),
                   .node = in_.byte(),
                   .data = in_.byte() == 0xFF ? nullptr : bytes.data(),
                   .length = bytes.size(),
                   .attempts = in_.byte() % 3U};
        return keep(linegate_request_call(handle(), line, in_.byte() == 0xFF ? nullptr : &request,
                                          timeout()));
    }
  }
  // The typed commands, with the same arguments in the places of each.
  void typed() {
    linegate_client* const with = handle();
    const int line = object();
    const std::array<unsigned, 4> n{argument(), argument(), argument(), argument()};
    const std::vector<std::byte> bytes = in_.bytes(in_.byte() % 12);
    const std::size_t length = in_.byte() == 0xFF ? std::size_t{1} << 40U : bytes.size();
    const void* const data = in_.byte() == 0xFF ? nullptr : bytes.data();
    const int flag = static_cast<int>(in_.byte() % 3) - 1;
    const linegate_lss_address address{n[0], n[1], n[2], n[3]};
    const linegate_lss_address* const lss = in_.byte() == 0xFF ? nullptr : &address;
    const char* const words = text();
    const int time = timeout();
    const std::array<std::function<int()>, 48> commands{
        [&] {
          return linegate_write_object(with, line, n[0], n[1], n[2], data, length, n[3], time);
        },
        [&] { return write_output(with, line, words, bytes, time); },
        [&] { return linegate_read_network(with, line, n[0], n[1], n[2], n[3], time); },
        [&] {
          return linegate_write_network(with, line, n[0], n[1], n[2], n[3], data, length, time);
        },
        [&] { return linegate_read_own(with, line, n[0], n[1], n[2], time); },
        [&] { return linegate_write_own(with, line, n[0], n[1], data, length, n[2], flag, time); },
        [&] { return linegate_list_objects(with, line, n[0], n[1], n[2], time); },
        [&] { return create_object(with, line, words, bytes, time); },
        [&] { return linegate_remove_object(with, line, n[0], time); },
        [&] { return linegate_scan(with, line, n[0], time); },
        [&] { return linegate_apply_scan(with, line, n[0], flag, -flag, time); },
        [&] { return linegate_boot(with, line, n[0], time); },
        [&] { return linegate_compare(with, line, n[0], time); },
        [&] { return linegate_configure(with, line, n[0], time); },
        [&] { return linegate_program(with, line, n[0], n[1], data, length, time); },
        [&] { return linegate_lss_switch_global(with, line, flag, time); },
        [&] { return linegate_lss_switch_selective(with, line, lss, time); },
        [&] { return linegate_lss_set_node_id(with, line, n[0], flag, time); },
        [&] { return linegate_lss_set_bit_timing(with, line, n[0], n[1], time); },
        [&] { return linegate_lss_activate_bit_timing(with, line, n[0], time); },
        [&] { return linegate_lss_store(with, line, time); },
        [&] { return linegate_lss_inquire_address(with, line, time); },
        [&] { return linegate_lss_inquire_node_id(with, line, time); },
        [&] { return linegate_lss_identify(with, line, lss, n[0], n[1], time); },
        [&] { return linegate_lss_identify_unconfigured(with, line, time); },
        [&] { return linegate_lss_fastscan(with, line, n[0], lss, time); },
        [&] { return linegate_lss_assign_node_ids(with, line, time); },
        [&] { return linegate_trigger_pdo(with, line, n[0], n[1], time); },
        [&] { return linegate_trigger_pdos_of(with, line, words, time); },
        [&] { return linegate_request_pdo(with, line, n[0], n[1], time); },
        [&] { return linegate_write_mpdo(with, line, n[0], n[1], n[2], data, length, n[3], time); },
        [&] { return linegate_send_emcy(with, line, n[0], n[1], nullptr, n[2], time); },
        [&] { return linegate_send_frame(with, line, n[0], data, length, n[1], time); },
        [&] { return linegate_send_remote_frame(with, line, n[0], n[1], flag, time); },
        [&] { return linegate_listen(with, line, n[0], n[1], n[2], flag, time); },
        [&] { return linegate_trace_routing(with, line, n[0], time); },
        [&] { return linegate_open_connection(with, line, n[0], n[1], time); },
        [&] { return linegate_close_connection(with, line, n[0], time); },
        [&] { return linegate_connections(with, line, time); },
        [&] { return linegate_check_sleep(with, line, time); },
        [&] { return linegate_sleep(with, line, time); },
        [&] { return linegate_sleep_unchecked(with, line, time); },
        [&] { return linegate_wake_up(with, line, time); },
        [&] { return linegate_object_to_sleep(with, line, flag, time); },
        [&] { return linegate_versions(with, line, time); },
        [&] { return linegate_restart_bus(with, line, time); },
        [&] { return linegate_set_bus_faults(with, line, words, time); },
        [&] { return read_journal(with, line, words, n, time); }};
    keep(commands[in_.byte() % commands.size()]());
  }
  unsigned argument() {
    const std::uint8_t byte = in_.byte();
    return byte % 16 == 15 ? static_cast<unsigned>(number(in_)) : byte;
  }
  static int write_output(linegate_client* with, int line, const char* name,
                          const std::vector<std::byte>& bytes, int time) {
    linegate_setting output{};
    output.name = name;
    output.type = bytes.empty() ? LINEGATE_UNSIGNED : LINEGATE_BYTES;
    output.bytes = bytes.data();
    output.length = bytes.size();
    return linegate_write_output(with, line, &output, time);
  }
  int create_object(linegate_client* with, int line, const char* name,
                    const std::vector<std::byte>& value, int time) {
    linegate_object object{};
    object.size = sizeof object - in_.byte() / 255U;
    object.index = static_cast<std::uint16_t>(0x2000U + in_.byte());
    object.type = in_.byte();
    object.access = in_.byte();
    object.name = name;
    object.value = value.data();
    object.length = value.size();
    return linegate_create_object(with, line, &object, static_cast<std::int64_t>(number(in_)),
                                  time);
  }
  int read_journal(linegate_client* with, int line, const char* words,
                   const std::array<unsigned, 4>& n, int time) {
    linegate_journal_query query{};
    query.size = sizeof query - in_.byte() / 255U;
    query.flags = n[0];
    query.most = n[1];
    query.line = words;
    query.node = static_cast<std::uint8_t>(n[2]);
    query.kind = static_cast<std::uint8_t>(n[3]);
    query.severity = in_.byte();
    query.since = static_cast<std::int64_t>(number(in_));
    return linegate_read_journal(with, line, in_.byte() == 0xFF ? nullptr : &query, time);
  }

  // What the results point to: a sanitizer sees what does not exist.
  static void touch(const char* text) { LINEGATE_EXPECT(std::strlen(text) < 100'000); }
  static void touch(const void* data, std::size_t length) {
    const auto* const bytes = static_cast<const unsigned char*>(data);
    unsigned sum = 0;
    for (std::size_t i = 0; i < length; ++i)
      sum += bytes[i];
    LINEGATE_EXPECT(sum <= 255 * length);
  }
  // Whether there is one.
  static bool look(int result) {
    const bool known = result == LINEGATE_ERROR_NAME || result == LINEGATE_ERROR_FAILED ||
                       result == LINEGATE_ERROR_ARGUMENT || result == LINEGATE_ERROR_CLOSED;
    LINEGATE_EXPECT(result >= 0 || known);
    return result >= 0;
  }
  template <class T>
  T sized() {
    T out{};
    out.size = sizeof out - in_.byte() / 255U;
    return out;
  }
  void results() {
    linegate_client* const with = handle();
    const int call = object();
    const std::size_t place = argument(), inner = argument();
    results_of_objects(with, call, place, inner);
    results_of_nodes(with, call, place, inner);
    results_of_journal(with, call, place);
  }
  void results_of_objects(linegate_client* with, int call, std::size_t place, std::size_t inner) {
    auto delivery = sized<linegate_delivery>();
    if (look(linegate_call_delivery(with, call, &delivery)))
      touch(delivery.missing, delivery.missing_count * sizeof *delivery.missing);
    auto listed = sized<linegate_object>();
    if (look(linegate_call_object(with, call, place, &listed))) {
      touch(listed.name);
      touch(listed.value, listed.length);
    }
    auto scanned = sized<linegate_scanned_node>();
    auto value = sized<linegate_object_value>();
    const bool has_node = look(linegate_call_scanned(with, call, place, &scanned));
    if (look(linegate_call_scanned_value(with, call, place, inner, &value))) {
      LINEGATE_EXPECT(!has_node || inner < scanned.values);
      touch(value.value, value.length);
    }
    look(linegate_call_pdo(with, call, place));
    look(linegate_call_objection(with, call, place));
  }
  void results_of_nodes(linegate_client* with, int call, std::size_t place, std::size_t inner) {
    auto boot = sized<linegate_boot_result>();
    if (look(linegate_call_boot(with, call, place, &boot)))
      touch(boot.text);
    auto configuration = sized<linegate_configuration>();
    auto difference = sized<linegate_difference>();
    const bool has_node = look(linegate_call_configuration(with, call, place, &configuration));
    if (look(linegate_call_difference(with, call, place, inner, &difference))) {
      LINEGATE_EXPECT(!has_node || inner < configuration.differences);
      touch(difference.expected, difference.expected_length);
      touch(difference.found, difference.found_length);
    }
    auto fault = sized<linegate_program_fault>();
    look(linegate_call_program_fault(with, call, &fault));
    auto lss = sized<linegate_lss_result>();
    auto assignment = sized<linegate_lss_assignment>();
    look(linegate_call_lss(with, call, &lss));
    look(linegate_call_assignment(with, call, place, &assignment));
    auto connection = sized<linegate_connection>();
    look(linegate_call_connection(with, call, place, &connection));
  }
  void results_of_journal(linegate_client* with, int call, std::size_t place) {
    auto page = sized<linegate_journal_page>();
    look(linegate_call_page(with, call, &page));
    auto event = sized<linegate_event>();
    if (look(linegate_call_event(with, call, place, &event))) {
      touch(event.line);
      touch(event.text);
    }
    auto value = sized<linegate_history_value>();
    if (look(linegate_call_history_value(with, call, place, &value))) {
      touch(value.line);
      touch(value.name);
      touch(value.unit);
    }
  }
  void use_call() {
    const int call = object();
    const Buffer data = buffer();
    linegate_client* const with = handle();
    switch (in_.byte() % 4) {
      case 0:
        check(polling([&] { return linegate_call_wait(with, call); }));
        return;
      case 1:
        return look_at_result(with, call, data);
      case 2:
        check(linegate_call_cancel(with, call));
        return;
      default:
        notify(with, call);
    }
  }
  void notify(linegate_client* with, int call) {
    void* const user = registration(true);
    if (check(linegate_call_notify(with, call, on_call, user)) != LINEGATE_OK)
      return;
    note_end(call);  // its call-back is replaced
    of_number_.emplace(call, static_cast<Registration*>(user));
  }
  static void look_at_result(linegate_client* with, int call, const Buffer& data) {
    linegate_result result{};
    const int known = check(linegate_call_result(with, call, &result));
    const int copied = check(linegate_call_data(with, call, data.data(), data.size()));
    if (known != LINEGATE_OK)
      return;
    LINEGATE_EXPECT(std::memchr(result.text, 0, sizeof result.text) != nullptr);
    LINEGATE_EXPECT((result.outcome == LINEGATE_DONE || result.outcome == LINEGATE_PENDING) ==
                    (result.text[0] == 0));
    if (copied >= 0)
      LINEGATE_EXPECT(static_cast<std::uint64_t>(copied) ==
                      std::min<std::uint64_t>(result.length, data.size()));
  }
  // There is no domain here.
  void connect() {
    linegate_options options{};
    options.size = sizeof options - in_.byte() % 2;
    options.domain = static_cast<std::uint32_t>(number(in_));
    options.interfaces = text();
    options.peers = text();
    options.lines = text();
    const Buffer words = buffer();
    LINEGATE_EXPECT(linegate_connect(in_.flag() ? &options : nullptr, words.data(), words.size()) ==
                    nullptr);
    LINEGATE_EXPECT(words.is_text());
  }
  void close() {
    if (in_.byte() % 16 != 0)
      return;
    if (polls_ > 0) {
      LINEGATE_EXPECT(linegate_close(client_) == LINEGATE_ERROR_ARGUMENT);
      return;
    }
    for (Registration& one : registrations_)
      one.ended = true;
    end();
    open();
  }

  std::shared_ptr<ClientWorld> world_;
  Input& in_;
  linegate_client* client_ = nullptr;
  int newest_ = 0;            // number
  std::vector<int> numbers_;  // of this client, also ended ones
  std::deque<Registration> registrations_;
  std::multimap<int, Registration*> of_number_;
  std::string position_;
  int polls_ = 0;
  int depth_ = 0;
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
