// SPDX-License-Identifier: Apache-2.0
// The typed commands of linegate.h on commands.h, and their results.
#include <algorithm>
#include <any>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bridges/client/c_handles.h"
#include "bridges/client/commands.h"
#include "bridges/client/core.h"
#include "bridges/request/request.h"

namespace client = linegate::client;

namespace {

using client::Commands;
using client::capi::give;
using client::capi::Held;
using client::capi::kFirstSize;
using linegate::line::CommandKind;

// --- parameters ----------------------------------------------------------------------------------

// Begins a call with the commands of a line.
template <class Start>
int begin(const Held& held, client::Line& it, int line, int timeout_ms, const Start& start) {
  return client::capi::begin_call(held, line, timeout_ms, [&](const client::CallOptions& options) {
    return start(Commands(it), options);
  });
}

// The same if the pointers and flags are `valid`. The commands check numbers, and refuse the call.
template <class Start>
int begin_typed(linegate_client* handle, int line, int timeout_ms, bool valid,
                const Start& start) noexcept {
  return client::capi::with<client::Line>(
      handle, line, [&](const Held& held, client::Line& it) -> int {
        return valid ? begin(held, it, line, timeout_ms, start) : LINEGATE_ERROR_ARGUMENT;
      });
}

bool is_data(const void* data, std::size_t length) {
  return (data != nullptr || length == 0) && length <= client::capi::kMostData;
}

std::string text_of(const char* text) {
  return text == nullptr ? std::string() : std::string(text);
}

client::LssAddress lss_of(const linegate_lss_address* from) {
  return from == nullptr
             ? client::LssAddress()
             : client::LssAddress{from->vendor, from->product, from->revision, from->serial};
}

linegate_lss_address lss_in_c(const client::LssAddress& from) {
  return {.vendor = from.vendor,
          .product = from.product,
          .revision = from.revision,
          .serial = from.serial};
}

client::JournalQuery query_of(const linegate_journal_query& from) {
  client::JournalQuery out{.severity = from.severity,
                           .text = text_of(from.text),
                           .cursor = {from.cursor_position, from.cursor_check},
                           .newest_first = (from.flags & LINEGATE_JOURNAL_NEWEST_FIRST) != 0,
                           .most = from.most,
                           .values = (from.flags & LINEGATE_JOURNAL_VALUES) != 0};
  if (from.line != nullptr)
    out.line = from.line;
  if ((from.flags & LINEGATE_JOURNAL_NODE) != 0)
    out.node = from.node;
  if ((from.flags & LINEGATE_JOURNAL_KIND) != 0)
    out.kind = from.kind;
  if ((from.flags & LINEGATE_JOURNAL_SINCE) != 0)
    out.since = from.since;
  if ((from.flags & LINEGATE_JOURNAL_UNTIL) != 0)
    out.until = from.until;
  return out;
}

// --- results -------------------------------------------------------------------------------------

// Runs `body` with the result of a call of one of these kinds. It is made once, so that what the
// structs of the caller point to exists as long as the number of the call.
template <class T, class Body>
int with_result(linegate_client* handle, int number, std::initializer_list<CommandKind> kinds,
                const Body& body) noexcept {
  return client::capi::with<client::Call>(
      handle, number, [&](const Held& held, client::Call& call) -> int {
        const bool of_failure = std::is_same_v<T, client::ProgramFault>;
        if (call.ok() == of_failure || !call.done())
          return LINEGATE_ERROR_FAILED;
        const auto kind = client::Core::kind_of(call);
        if (std::ranges::find(kinds, kind) == kinds.end())
          return LINEGATE_ERROR_ARGUMENT;
        auto made = held->results.find(number);
        if (made == held->results.end()) {
          if (!client::Core::is_readable(call))
            return LINEGATE_ERROR_MALFORMED;
          made = held->results.emplace(number, client::Answer<T>(call).result()).first;
        }
        return body(*std::any_cast<T>(&made->second));
      });
}

// The same of an item of a list.
template <class From, class To, class Convert>
int give_one(const std::vector<From>& list, std::size_t place, To* to, const Convert& convert) {
  return place < list.size() ? give<To>(convert(list[place]), to) : LINEGATE_ERROR_NAME;
}

template <class From, class To, class Convert>
int give_of_list(linegate_client* handle, int call, std::initializer_list<CommandKind> kinds,
                 std::size_t place, To* to, const Convert& convert) noexcept {
  return with_result<std::vector<From>>(handle, call, kinds, [&](const std::vector<From>& list) {
    return give_one(list, place, to, convert);
  });
}

linegate_object object_in_c(const client::ListedObject& from) {
  return {.size = 0,
          .index = from.index,
          .sub = from.sub,
          .access = from.access,
          .type = from.type,
          .mappable = from.mappable,
          .stored = from.stored,
          .application = from.application,
          .name = from.name.c_str(),
          .value = from.value.data(),
          .length = from.value.size()};
}

linegate_boot_result boot_in_c(const client::BootResult& from) {
  return {.size = 0,
          .node = from.node,
          .letter = from.letter,
          .reason = static_cast<std::uint8_t>(from.reason),
          .ok = from.ok,
          .index = from.index,
          .sub = from.sub,
          .abort = from.abort,
          .expected = from.expected,
          .found = from.found,
          .text = from.text.c_str()};
}

linegate_configuration configuration_in_c(const client::Configuration& from) {
  return {.size = 0,
          .node = from.node,
          .letter = from.letter,
          .ok = from.ok,
          .abort = from.abort,
          .differences = from.differences.size()};
}

linegate_difference difference_in_c(const client::Difference& from) {
  return {.size = 0,
          .index = from.index,
          .sub = from.sub,
          .abort = from.abort,
          .expected = from.expected.data(),
          .expected_length = from.expected.size(),
          .found = from.found.data(),
          .found_length = from.found.size()};
}

linegate_connection connection_in_c(const client::SdoConnection& from) {
  return {.size = 0,
          .number = from.number,
          .client = from.client,
          .server = from.server,
          .client_object = from.client_object,
          .server_object = from.server_object,
          .request_id = from.request_id,
          .response_id = from.response_id,
          .state = static_cast<std::uint8_t>(from.state),
          .abort = from.abort};
}

linegate_history_value stored_in_c(const client::HistoryValue& from) {
  return {.size = 0,
          .line = from.line.c_str(),
          .name = from.name.c_str(),
          .unit = from.unit.c_str(),
          .time = from.time,
          .value = from.value.value_or(0),
          .scale = from.scale,
          .offset = from.offset,
          .type = from.type,
          .bits = from.bits,
          .node = from.node,
          .output = from.output,
          .valid = from.value.has_value()};
}

constexpr std::initializer_list<CommandKind> kScans{CommandKind::scan, CommandKind::scan_apply};

}  // namespace

// --- objects and outputs -------------------------------------------------------------------------

int linegate_write_object(linegate_client* handle, int line, unsigned node, unsigned index,
                          unsigned sub, const void* value, std::size_t length, unsigned flags,
                          int timeout_ms) {
  const bool valid = is_data(value, length) && flags <= (LINEGATE_BY_SDO | LINEGATE_KEEP_PDO);
  return begin_typed(
      handle, line, timeout_ms, valid, [&](const Commands& to, const client::CallOptions& options) {
        return to.write_object(node, index, sub, client::capi::bytes_of(value, length),
                               (flags & LINEGATE_BY_SDO) != 0, (flags & LINEGATE_KEEP_PDO) != 0,
                               options);
      });
}

int linegate_write_output(linegate_client* handle, int line, const linegate_setting* output,
                          int timeout_ms) {
  return client::capi::with<client::Line>(
      handle, line, [&](const Held& held, client::Line& it) -> int {
        const bool named = output != nullptr && output->name != nullptr;
        const auto value = named ? client::capi::data_of(*output) : std::nullopt;
        if (!value)
          return LINEGATE_ERROR_ARGUMENT;
        return begin(held, it, line, timeout_ms,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.write_output(output->name, *value, output->raw != 0, options);
                     });
      });
}

int linegate_read_network(linegate_client* handle, int line, unsigned network, unsigned node,
                          unsigned index, unsigned sub, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.read_network(network, node, index, sub, options);
                     });
}

int linegate_write_network(linegate_client* handle, int line, unsigned network, unsigned node,
                           unsigned index, unsigned sub, const void* value, std::size_t length,
                           int timeout_ms) {
  const bool valid = is_data(value, length);
  return begin_typed(handle, line, timeout_ms, valid,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.write_network(network, node, index, sub,
                                               client::capi::bytes_of(value, length), options);
                     });
}

int linegate_read_own(linegate_client* handle, int line, unsigned index, unsigned sub,
                      unsigned node, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.read_own(index, sub, node, options);
                     });
}

int linegate_write_own(linegate_client* handle, int line, unsigned index, unsigned sub,
                       const void* value, std::size_t length, unsigned node, int as_owner,
                       int timeout_ms) {
  const bool valid = is_data(value, length);
  return begin_typed(handle, line, timeout_ms, valid,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.write_own(index, sub, client::capi::bytes_of(value, length), node,
                                           as_owner != 0, options);
                     });
}

int linegate_list_objects(linegate_client* handle, int line, unsigned first, unsigned last,
                          unsigned node, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.list_objects(first, last, node, options);
                     });
}

int linegate_create_object(linegate_client* handle, int line, const linegate_object* object,
                           std::int64_t image_byte, int timeout_ms) {
  const bool valid = object != nullptr && object->size >= kFirstSize<linegate_object> &&
                     is_data(object->value, object->length);
  return begin_typed(
      handle, line, timeout_ms, valid, [&](const Commands& to, const client::CallOptions& options) {
        std::optional<std::uint64_t> at;
        if (image_byte >= 0)
          at = static_cast<std::uint64_t>(image_byte);
        return to.create_object({.index = object->index,
                                 .sub = object->sub,
                                 .type = object->type,
                                 .access = object->access,
                                 .mappable = object->mappable != 0,
                                 .stored = object->stored != 0,
                                 .application = object->application != 0,
                                 .name = text_of(object->name),
                                 .value = client::capi::bytes_of(object->value, object->length)},
                                at, options);
      });
}

int linegate_remove_object(linegate_client* handle, int line, unsigned index, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.remove_object(index, options);
                     });
}

// --- nodes ---------------------------------------------------------------------------------------

int linegate_scan(linegate_client* handle, int line, unsigned node, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.scan(node, options);
                     });
}

int linegate_apply_scan(linegate_client* handle, int line, unsigned node, int set_up, int restore,
                        int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.apply_scan(node, set_up != 0, restore != 0, options);
                     });
}

int linegate_boot(linegate_client* handle, int line, unsigned node, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.boot(node, options);
                     });
}

int linegate_compare(linegate_client* handle, int line, unsigned node, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.compare(node, options);
                     });
}

int linegate_configure(linegate_client* handle, int line, unsigned node, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.configure(node, options);
                     });
}

int linegate_program(linegate_client* handle, int line, unsigned node, unsigned number,
                     const void* program, std::size_t length, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, is_data(program, length),
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.program(node, number, client::capi::bytes_of(program, length),
                                         options);
                     });
}

// --- LSS -----------------------------------------------------------------------------------------

int linegate_lss_switch_global(linegate_client* handle, int line, int configuration,
                               int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.lss_switch_global(configuration != 0, options);
                     });
}

int linegate_lss_switch_selective(linegate_client* handle, int line,
                                  const linegate_lss_address* address, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, address != nullptr,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.lss_switch_selective(lss_of(address), options);
                     });
}

int linegate_lss_set_node_id(linegate_client* handle, int line, unsigned node, int unchecked,
                             int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.lss_set_node_id(node, unchecked != 0, options);
                     });
}

int linegate_lss_set_bit_timing(linegate_client* handle, int line, unsigned table, unsigned index,
                                int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.lss_set_bit_timing(table, index, options);
                     });
}

int linegate_lss_activate_bit_timing(linegate_client* handle, int line, unsigned delay_ms,
                                     int timeout_ms) {
  return begin_typed(
      handle, line, timeout_ms, true, [&](const Commands& to, const client::CallOptions& options) {
        return to.lss_activate_bit_timing(std::chrono::milliseconds(delay_ms), options);
      });
}

int linegate_lss_store(linegate_client* handle, int line, int timeout_ms) {
  return begin_typed(
      handle, line, timeout_ms, true,
      [](const Commands& to, const client::CallOptions& options) { return to.lss_store(options); });
}

int linegate_lss_inquire_address(linegate_client* handle, int line, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [](const Commands& to, const client::CallOptions& options) {
                       return to.lss_inquire_address(options);
                     });
}

int linegate_lss_inquire_node_id(linegate_client* handle, int line, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [](const Commands& to, const client::CallOptions& options) {
                       return to.lss_inquire_node_id(options);
                     });
}

int linegate_lss_identify(linegate_client* handle, int line, const linegate_lss_address* lowest,
                          std::uint32_t highest_revision, std::uint32_t highest_serial,
                          int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, lowest != nullptr,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.lss_identify(lss_of(lowest), highest_revision, highest_serial,
                                              options);
                     });
}

int linegate_lss_identify_unconfigured(linegate_client* handle, int line, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [](const Commands& to, const client::CallOptions& options) {
                       return to.lss_identify_unconfigured(options);
                     });
}

int linegate_lss_fastscan(linegate_client* handle, int line, unsigned known,
                          const linegate_lss_address* address, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, known == 0 || address != nullptr,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.lss_fastscan(known, lss_of(address), options);
                     });
}

int linegate_lss_assign_node_ids(linegate_client* handle, int line, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [](const Commands& to, const client::CallOptions& options) {
                       return to.lss_assign_node_ids(options);
                     });
}

// --- PDOs, EMCYs and frames ----------------------------------------------------------------------

int linegate_trigger_pdo(linegate_client* handle, int line, unsigned number, unsigned node,
                         int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.trigger_pdo(number, node, options);
                     });
}

int linegate_trigger_pdos_of(linegate_client* handle, int line, const char* output,
                             int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, output != nullptr,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.trigger_pdos_of(output, options);
                     });
}

int linegate_request_pdo(linegate_client* handle, int line, unsigned node, unsigned number,
                         int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.request_pdo(node, number, options);
                     });
}

int linegate_write_mpdo(linegate_client* handle, int line, unsigned node, unsigned index,
                        unsigned sub, const void* value, std::size_t length, unsigned tpdo,
                        int timeout_ms) {
  const bool valid = is_data(value, length);
  return begin_typed(handle, line, timeout_ms, valid,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.write_mpdo(node, index, sub, client::capi::bytes_of(value, length),
                                            tpdo, options);
                     });
}

int linegate_send_emcy(linegate_client* handle, int line, unsigned code, unsigned error_register,
                       const std::uint8_t* manufacturer, unsigned node, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       std::array<std::byte, 5> bytes{};
                       if (manufacturer != nullptr)
                         std::transform(manufacturer, manufacturer + bytes.size(), bytes.begin(),
                                        [](std::uint8_t one) { return std::byte{one}; });
                       return to.send_emcy(code, error_register, bytes, node, options);
                     });
}

int linegate_send_frame(linegate_client* handle, int line, std::uint32_t identifier,
                        const void* data, std::size_t length, unsigned flags, int timeout_ms) {
  constexpr unsigned kFlags = LINEGATE_EXTENDED | LINEGATE_FD | LINEGATE_BIT_RATE_SWITCH;
  return begin_typed(handle, line, timeout_ms, is_data(data, length) && flags <= kFlags,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.send_frame(identifier, client::capi::bytes_of(data, length),
                                            (flags & LINEGATE_EXTENDED) != 0,
                                            (flags & LINEGATE_FD) != 0,
                                            (flags & LINEGATE_BIT_RATE_SWITCH) != 0, options);
                     });
}

int linegate_send_remote_frame(linegate_client* handle, int line, std::uint32_t identifier,
                               unsigned length, int extended, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.send_remote_frame(identifier, length, extended != 0, options);
                     });
}

int linegate_listen(linegate_client* handle, int line, unsigned seconds, std::uint32_t identifier,
                    std::uint32_t mask, int extended, int timeout_ms) {
  return begin_typed(
      handle, line, timeout_ms, true, [&](const Commands& to, const client::CallOptions& options) {
        std::optional<bool> length;
        if (extended >= 0)
          length = extended != 0;
        return to.listen(std::chrono::seconds(seconds), identifier, mask, length, options);
      });
}

int linegate_trace_routing(linegate_client* handle, int line, unsigned seconds, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.trace_routing(std::chrono::seconds(seconds), options);
                     });
}

// --- SDO connections, sleep ----------------------------------------------------------------------

int linegate_open_connection(linegate_client* handle, int line, unsigned client_node,
                             unsigned server_node, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.open_connection(client_node, server_node, options);
                     });
}

int linegate_close_connection(linegate_client* handle, int line, std::uint32_t number,
                              int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.close_connection(number, options);
                     });
}

int linegate_connections(linegate_client* handle, int line, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [](const Commands& to, const client::CallOptions& options) {
                       return to.connections(options);
                     });
}

int linegate_check_sleep(linegate_client* handle, int line, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [](const Commands& to, const client::CallOptions& options) {
                       return to.check_sleep(options);
                     });
}

int linegate_sleep(linegate_client* handle, int line, int timeout_ms) {
  return begin_typed(
      handle, line, timeout_ms, true,
      [](const Commands& to, const client::CallOptions& options) { return to.sleep(options); });
}

int linegate_sleep_unchecked(linegate_client* handle, int line, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [](const Commands& to, const client::CallOptions& options) {
                       return to.sleep_unchecked(options);
                     });
}

int linegate_wake_up(linegate_client* handle, int line, int timeout_ms) {
  return begin_typed(
      handle, line, timeout_ms, true,
      [](const Commands& to, const client::CallOptions& options) { return to.wake_up(options); });
}

int linegate_object_to_sleep(linegate_client* handle, int line, int object, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.object_to_sleep(object != 0, options);
                     });
}

// --- the gateway ---------------------------------------------------------------------------------

int linegate_versions(linegate_client* handle, int line, int timeout_ms) {
  return begin_typed(
      handle, line, timeout_ms, true,
      [](const Commands& to, const client::CallOptions& options) { return to.versions(options); });
}

int linegate_restart_bus(linegate_client* handle, int line, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, true,
                     [](const Commands& to, const client::CallOptions& options) {
                       return to.restart_bus(options);
                     });
}

int linegate_set_bus_faults(linegate_client* handle, int line, const char* faults, int timeout_ms) {
  return begin_typed(handle, line, timeout_ms, faults != nullptr,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.set_bus_faults(faults, options);
                     });
}

int linegate_read_journal(linegate_client* handle, int line, const linegate_journal_query* query,
                          int timeout_ms) {
  constexpr unsigned kFlags = LINEGATE_JOURNAL_NODE | LINEGATE_JOURNAL_KIND |
                              LINEGATE_JOURNAL_SINCE | LINEGATE_JOURNAL_UNTIL |
                              LINEGATE_JOURNAL_NEWEST_FIRST | LINEGATE_JOURNAL_VALUES;
  const bool valid = query != nullptr && query->size >= kFirstSize<linegate_journal_query> &&
                     (query->flags & ~kFlags) == 0;
  return begin_typed(handle, line, timeout_ms, valid,
                     [&](const Commands& to, const client::CallOptions& options) {
                       return to.read_journal(query_of(*query), options);
                     });
}

// --- results of calls ----------------------------------------------------------------------------

int linegate_call_delivery(linegate_client* handle, int call, linegate_delivery* delivery) {
  return with_result<client::Delivery>(
      handle, call, {CommandKind::object_write, CommandKind::output_write},
      [&](const client::Delivery& from) {
        return give<linegate_delivery>({.size = 0,
                                        .way = static_cast<std::int32_t>(from.way),
                                        .wait = static_cast<std::int32_t>(from.wait),
                                        .pdo = from.pdo,
                                        .missing = from.missing.data(),
                                        .missing_count = from.missing.size()},
                                       delivery);
      });
}

int linegate_call_object(linegate_client* handle, int call, std::size_t place,
                         linegate_object* object) {
  return give_of_list<client::ListedObject>(handle, call, {CommandKind::local_read}, place, object,
                                            object_in_c);
}

int linegate_call_scanned(linegate_client* handle, int call, std::size_t place,
                          linegate_scanned_node* node) {
  return give_of_list<client::ScannedNode>(
      handle, call, kScans, place, node, [](const client::ScannedNode& from) {
        return linegate_scanned_node{
            .size = 0, .node = from.node, .abort = from.abort, .values = from.values.size()};
      });
}

int linegate_call_scanned_value(linegate_client* handle, int call, std::size_t place,
                                std::size_t value_place, linegate_object_value* value) {
  using Nodes = std::vector<client::ScannedNode>;
  return with_result<Nodes>(handle, call, kScans, [&](const Nodes& nodes) -> int {
    if (place >= nodes.size())
      return LINEGATE_ERROR_NAME;
    return give_one(nodes[place].values, value_place, value, [](const client::ObjectValue& from) {
      return linegate_object_value{.size = 0,
                                   .index = from.index,
                                   .sub = from.sub,
                                   .value = from.value.data(),
                                   .length = from.value.size()};
    });
  });
}

int linegate_call_boot(linegate_client* handle, int call, std::size_t place,
                       linegate_boot_result* boot) {
  return give_of_list<client::BootResult>(handle, call, {CommandKind::boot}, place, boot,
                                          boot_in_c);
}

int linegate_call_configuration(linegate_client* handle, int call, std::size_t place,
                                linegate_configuration* configuration) {
  return give_of_list<client::Configuration>(handle, call, {CommandKind::configure}, place,
                                             configuration, configuration_in_c);
}

int linegate_call_difference(linegate_client* handle, int call, std::size_t place,
                             std::size_t difference_place, linegate_difference* difference) {
  using Nodes = std::vector<client::Configuration>;
  return with_result<Nodes>(handle, call, {CommandKind::configure}, [&](const Nodes& nodes) -> int {
    return place < nodes.size()
               ? give_one(nodes[place].differences, difference_place, difference, difference_in_c)
               : LINEGATE_ERROR_NAME;
  });
}

int linegate_call_program_fault(linegate_client* handle, int call, linegate_program_fault* fault) {
  return with_result<client::ProgramFault>(
      handle, call, {CommandKind::program}, [&](const client::ProgramFault& from) -> int {
        return from.index == 0
                   ? LINEGATE_ERROR_NAME
                   : give<linegate_program_fault>(
                         {.size = 0, .index = from.index, .sub = from.sub, .value = from.value},
                         fault);
      });
}

int linegate_call_lss(linegate_client* handle, int call, linegate_lss_result* result) {
  return with_result<client::LssResult>(
      handle, call, {CommandKind::lss}, [&](const client::LssResult& from) {
        return give<linegate_lss_result>({.size = 0,
                                          .outcome = static_cast<std::uint8_t>(from.outcome),
                                          .error = from.error,
                                          .specific_error = from.specific_error,
                                          .node = from.node,
                                          .address = lss_in_c(from.address),
                                          .assignments = from.assignments.size()},
                                         result);
      });
}

int linegate_call_assignment(linegate_client* handle, int call, std::size_t place,
                             linegate_lss_assignment* assignment) {
  return with_result<client::LssResult>(
      handle, call, {CommandKind::lss}, [&](const client::LssResult& result) {
        return give_one(result.assignments, place, assignment,
                        [](const client::LssAssignment& from) {
                          return linegate_lss_assignment{.size = 0,
                                                         .verdict = from.verdict,
                                                         .node = from.node,
                                                         .error = from.error,
                                                         .specific_error = from.specific_error,
                                                         .address = lss_in_c(from.address)};
                        });
      });
}

int linegate_call_pdo(linegate_client* handle, int call, std::size_t place) {
  const auto number = [&](const std::vector<std::uint16_t>& pdos) -> int {
    return place < pdos.size() ? int{pdos[place]} : LINEGATE_ERROR_NAME;
  };
  const int of_mpdo = with_result<std::uint16_t>(
      handle, call, {CommandKind::mpdo_write},
      [&](std::uint16_t tpdo) { return number(std::vector<std::uint16_t>{tpdo}); });
  return of_mpdo != LINEGATE_ERROR_ARGUMENT ? of_mpdo
                                            : with_result<std::vector<std::uint16_t>>(
                                                  handle, call, {CommandKind::pdo_trigger}, number);
}

int linegate_call_objection(linegate_client* handle, int call, std::size_t place) {
  using Nodes = std::vector<std::uint8_t>;
  return with_result<Nodes>(handle, call, {CommandKind::sleep}, [&](const Nodes& nodes) -> int {
    return place < nodes.size() ? int{nodes[place]} : LINEGATE_ERROR_NAME;
  });
}

int linegate_call_connection(linegate_client* handle, int call, std::size_t place,
                             linegate_connection* connection) {
  return give_of_list<client::SdoConnection>(
      handle, call, {CommandKind::connection_open, CommandKind::connection_list}, place, connection,
      connection_in_c);
}

int linegate_call_page(linegate_client* handle, int call, linegate_journal_page* page) {
  return with_result<client::JournalPage>(
      handle, call, {linegate::request::JournalRead::kKind}, [&](const client::JournalPage& from) {
        return give<linegate_journal_page>({.size = 0,
                                            .events = from.events.size(),
                                            .values = from.values.size(),
                                            .cursor_position = from.cursor.position,
                                            .cursor_check = from.cursor.check,
                                            .more = from.more ? 1 : 0,
                                            .unknown_entry = from.unknown_entry ? 1 : 0},
                                           page);
      });
}

int linegate_call_event(linegate_client* handle, int call, std::size_t place,
                        linegate_event* event) {
  return with_result<client::JournalPage>(
      handle, call, {linegate::request::JournalRead::kKind}, [&](const client::JournalPage& page) {
        return give_one(page.events, place, event, client::capi::event_in_c);
      });
}

int linegate_call_history_value(linegate_client* handle, int call, std::size_t place,
                                linegate_history_value* value) {
  return with_result<client::JournalPage>(handle, call, {linegate::request::JournalRead::kKind},
                                          [&](const client::JournalPage& page) {
                                            return give_one(page.values, place, value, stored_in_c);
                                          });
}
