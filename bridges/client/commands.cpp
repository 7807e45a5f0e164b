// SPDX-License-Identifier: Apache-2.0
#include "bridges/client/commands.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "bridges/client/core.h"
#include "bridges/client/parameters.h"
#include "bridges/client/values.h"
#include "bridges/dds/raw_request.h"
#include "bridges/request/journal.h"
#include "stack/base/byte_order.h"
#include "stack/lss/message.h"
#include "stack/lss/procedure.h"

namespace linegate::client {
namespace {

using linegate::load_le;

constexpr std::string_view kOfOutputs = "outputs:";
constexpr std::size_t kAssignmentBytes = 20;
constexpr std::size_t kMostSized = 255;              // bytes after a length of 1 byte
constexpr std::size_t kMostFaults = 256;             // bytes of COMMAND_BUS_FAULT
constexpr std::size_t kMostMpdo = 4;                 // bytes of a value
constexpr std::size_t kLongestProgram = 16U << 20U;  // bytes
constexpr auto kLongestListening = std::chrono::hours(1);

// Numbers in their ranges; others are refused before they are sent.
std::uint8_t byte_of(unsigned number) {
  return static_cast<std::uint8_t>(number);
}
std::uint16_t word_of(unsigned number) {
  return static_cast<std::uint16_t>(number);
}
od::Address address_of(unsigned index, unsigned sub) {
  return {word_of(index), byte_of(sub)};
}

Request members_of(const request::Request& from) {
  dds::RawRequest raw = dds::to_raw(from);
  return {.kind = raw.kind,
          .node = raw.node,
          .index = raw.index,
          .sub = raw.sub,
          .nmt = raw.nmt,
          .code = raw.code,
          .error_register = raw.error_register,
          .entry = raw.entry,
          .data = std::move(raw.data)};
}
template <class Kind>
Request request_of(Kind from) {
  return members_of(request::Request(line::Request(std::move(from))));
}
Request gateway_request_of(request::GatewayRequest from) {
  return members_of(request::Request(std::move(from)));
}

// --- results -------------------------------------------------------------------------------------

// The alternative of that type, or an empty one.
template <class T>
T part_of(const std::optional<line::ReplyData>& data) {
  const T* const part = data ? std::get_if<T>(&*data) : nullptr;
  return part == nullptr ? T{} : *part;
}

std::uint32_t abort_number(AbortCode code) {
  return static_cast<std::uint32_t>(code);
}

template <class To, class From>
std::vector<To> convert_all(const std::vector<From>& from, To (*convert)(const From&)) {
  std::vector<To> out;
  out.reserve(from.size());
  std::ranges::transform(from, std::back_inserter(out), convert);
  return out;
}

ListedObject object_from(const line::ListedObject& from) {
  return {.index = from.address.index,
          .sub = from.address.sub,
          .type = static_cast<std::uint16_t>(from.type),
          .access = static_cast<std::uint8_t>(from.access),
          .mappable = from.mappable,
          .stored = from.stored,
          .application = from.application,
          .name = from.name,
          .value = from.value};
}

ScannedNode node_from(const scan::ScannedNode& from) {
  ScannedNode out{.node = from.id, .abort = abort_number(from.end)};
  for (const manager::ObjectWrite& one : from.values)
    out.values.push_back({one.address.index, one.address.sub, one.data});
  return out;
}

char letter_from(char letter) {
  return letter == manager::kBooted ? '\0' : letter;
}

BootResult boot_from(const manager::BootOutcome& from) {
  const manager::BootFinding& finding = from.finding;
  return {.node = from.node,
          .letter = letter_from(from.letter),
          .reason = static_cast<BootResult::Reason>(finding.kind),
          .index = finding.object.index,
          .sub = finding.object.sub,
          .abort = abort_number(finding.abort),
          .expected = finding.expected,
          .found = finding.found,
          .text = manager::describe_boot(from.letter, finding),
          .ok = manager::is_booted(from.letter)};
}

Configuration report_from(const manager::NodeReport& from) {
  Configuration out{.node = from.node,
                    .letter = letter_from(from.boot),
                    .abort = abort_number(from.end),
                    .ok = from.good()};
  for (const manager::Difference& one : from.differences)
    out.differences.push_back({.index = one.object.index,
                               .sub = one.object.sub,
                               .abort = abort_number(one.abort),
                               .expected = one.expected,
                               .found = one.found});
  return out;
}

SdoConnection connection_from(const manager::Connection& from) {
  return {.number = from.number,
          .client = from.client,
          .server = from.server,
          .client_object = from.client_record,
          .server_object = from.server_record,
          .request_id = from.request,
          .response_id = from.response,
          .state = static_cast<SdoConnection::State>(from.state),
          .abort = abort_number(from.abort)};
}

LssAddress lss_address_from(std::span<const std::byte> bytes) {
  const auto part = [&](std::size_t at) { return load_le<std::uint32_t>(bytes.data() + at); };
  return {part(0), part(4), part(8), part(12)};
}

// COMMANDS.md, COMMAND_LSS.
LssResult lss_from(lss::Procedure procedure, const std::vector<std::byte>& bytes) {
  LssResult out;
  if (bytes.size() < lss::kReplyHead)
    return out;
  out.outcome = static_cast<LssResult::Outcome>(bytes[0]);
  out.error = std::to_integer<std::uint8_t>(bytes[1]);
  out.specific_error = std::to_integer<std::uint8_t>(bytes[2]);
  std::span<const std::byte> data = std::span(bytes).subspan(lss::kReplyHead);
  if (procedure == lss::Procedure::inquire_node_id && !data.empty())
    out.node = std::to_integer<std::uint8_t>(data[0]);
  const bool has_address =
      procedure == lss::Procedure::inquire_address || procedure == lss::Procedure::fastscan;
  if (has_address && data.size() >= sizeof(LssAddress))
    out.address = lss_address_from(data);
  if (procedure != lss::Procedure::assign)
    return out;
  for (; data.size() >= kAssignmentBytes; data = data.subspan(kAssignmentBytes)) {
    const auto number = [&](std::size_t at) { return std::to_integer<std::uint8_t>(data[at]); };
    out.assignments.push_back({.verdict = number(0),
                               .node = number(1),
                               .error = number(2),
                               .specific_error = number(3),
                               .address = lss_address_from(data.subspan(4))});
  }
  return out;
}

Event event_from(const request::JournalRecord& from) {
  return {.gateway = {},
          .line = from.line,
          .number = from.number,
          .stream = from.stream,
          .time = from.time.time_since_epoch().count(),
          .kind = static_cast<std::uint8_t>(from.kind),
          .severity = static_cast<std::uint8_t>(from.severity),
          .node = from.node,
          .code = from.code,
          .value = from.value,
          .data = from.data,
          .text = from.text};
}

HistoryValue value_from(const request::JournalValue& from) {
  const request::JournalSeries& series = from.series;
  return {.line = series.line,
          .output = series.direction != 0,
          .node = series.node,
          .name = series.name,
          .unit = series.unit,
          .type = series.type,
          .bits = series.bits,
          .scale = series.scale,
          .offset = series.offset,
          .time = from.time.time_since_epoch().count(),
          .value = from.value};
}

// --- parameters ----------------------------------------------------------------------------------

std::vector<std::byte> lss_bytes(const LssAddress& address) {
  std::vector<std::byte> out;
  lss::put({address.vendor, address.product, address.revision, address.serial}, out);
  return out;
}

void append_number(std::uint32_t number, std::size_t bytes, std::vector<std::byte>& out) {
  for (std::size_t i = 0; i < bytes; ++i)
    out.push_back(static_cast<std::byte>(number >> (8 * i) & 0xFFU));
}

Request lss_request(lss::Procedure procedure, std::vector<std::byte> arguments = {}) {
  return request_of(line::LssRequest{.procedure = procedure, .arguments = std::move(arguments)});
}

can::Frame frame_of(std::uint32_t identifier, bool extended, std::uint8_t flags) {
  can::Frame out;
  out.id = identifier;
  out.flags = static_cast<std::uint8_t>((extended ? unsigned{can::Frame::kExtended} : 0U) | flags);
  return out;
}

request::JournalRead journal_request(const JournalQuery& from) {
  request::JournalRead out{.line = from.line,
                           .node = from.node,
                           .least = static_cast<EventSeverity>(from.severity),
                           .text = from.text,
                           .cursor = {from.cursor.position, from.cursor.check},
                           .newest_first = from.newest_first,
                           .most = from.most,
                           .values = from.values};
  if (from.kind)
    out.kind = static_cast<EventKind>(*from.kind);
  if (from.since)
    out.since = Instant(linegate::Duration(*from.since));
  if (from.until)
    out.until = Instant(linegate::Duration(*from.until));
  return out;
}

}  // namespace

// --- results of calls ----------------------------------------------------------------------------

template <>
Bytes Answer<Bytes>::result() const {
  return ok() ? bytes() : Bytes();
}

template <>
std::string Answer<std::string>::result() const {
  const Bytes from = bytes();
  return {reinterpret_cast<const char*>(from.data()), from.size()};
}

template <>
Delivery Answer<Delivery>::result() const {
  const auto reply = Core::reply_of(*this);
  if (!ok() || !reply)
    return {};
  if (std::holds_alternative<line::WrittenBySdo>(*reply))
    return {.way = Delivery::Way::sdo};
  const auto* const pdo = std::get_if<line::WrittenByPdo>(&*reply);
  if (pdo == nullptr)
    return {};
  return {.way = Delivery::Way::pdo,
          .pdo = pdo->pdo,
          .wait = static_cast<Delivery::Wait>(pdo->wait),
          .missing = pdo->missing};
}

template <>
std::vector<ListedObject> Answer<std::vector<ListedObject>>::result() const {
  return convert_all(part_of<std::vector<line::ListedObject>>(Core::reply_of(*this)), object_from);
}

template <>
std::vector<ScannedNode> Answer<std::vector<ScannedNode>>::result() const {
  return convert_all(part_of<std::vector<scan::ScannedNode>>(Core::reply_of(*this)), node_from);
}

template <>
std::vector<BootResult> Answer<std::vector<BootResult>>::result() const {
  return convert_all(part_of<std::vector<manager::BootOutcome>>(Core::reply_of(*this)), boot_from);
}

template <>
std::vector<Configuration> Answer<std::vector<Configuration>>::result() const {
  return convert_all(part_of<std::vector<manager::NodeReport>>(Core::reply_of(*this)), report_from);
}

template <>
ProgramFault Answer<ProgramFault>::result() const {
  const auto fault = part_of<line::ProgramFault>(Core::reply_of(*this));
  return {fault.object.index, fault.object.sub, fault.value};
}

template <>
std::vector<SdoConnection> Answer<std::vector<SdoConnection>>::result() const {
  return convert_all(part_of<line::SdoConnections>(Core::reply_of(*this)), connection_from);
}

template <>
std::vector<std::uint16_t> Answer<std::vector<std::uint16_t>>::result() const {
  return part_of<line::TriggeredPdos>(Core::reply_of(*this));
}

template <>
std::uint16_t Answer<std::uint16_t>::result() const {
  return part_of<line::SentByMpdo>(Core::reply_of(*this)).tpdo;
}

template <>
std::vector<std::uint8_t> Answer<std::vector<std::uint8_t>>::result() const {
  std::vector<std::uint8_t> out;
  if (ok())
    std::ranges::transform(bytes(), std::back_inserter(out),
                           [](std::byte one) { return std::to_integer<std::uint8_t>(one); });
  return out;
}

template <>
LssResult Answer<LssResult>::result() const {
  const auto* const request = Core::request_of<line::LssRequest>(*this);
  return request == nullptr || !ok() ? LssResult() : lss_from(request->procedure, bytes());
}

template <>
JournalPage Answer<JournalPage>::result() const {
  const auto page = ok() ? request::decode_page(bytes()) : std::nullopt;
  if (!page)
    return {};
  return {.events = convert_all(page->records, event_from),
          .values = convert_all(page->values, value_from),
          .cursor = {page->cursor.position, page->cursor.check},
          .more = page->more,
          .unknown_entry = page->unknown_entry};
}

// --- objects and outputs -------------------------------------------------------------------------

Call Commands::start(std::string why, Request request, const CallOptions& options) const {
  return why.empty() ? line_.request(std::move(request), options) : line_.refused(std::move(why));
}

Answer<Delivery> Commands::write_object(unsigned node, unsigned index, unsigned sub, Bytes value,
                                        bool by_sdo, bool keep_pdo,
                                        const CallOptions& options) const {
  return Answer<Delivery>(start(out_of_range({one_node(node), index_of(index), sub_of(sub)}),
                                request_of(line::ObjectWrite{.node = byte_of(node),
                                                             .address = address_of(index, sub),
                                                             .data = std::move(value),
                                                             .force_sdo = by_sdo,
                                                             .keep_pdo = keep_pdo}),
                                options));
}

// The output of that name, or why it cannot be used.
Error Commands::find_output(std::string_view name, const image::Entry*& entry,
                            std::uint32_t& number, std::uint64_t& layout_id) const {
  if (!line_.core_ || !line_.core_->link)
    return Error::closed;
  const LineStatus status = line_.status();
  if (status != LineStatus::ready)
    return status == LineStatus::ambiguous ? Error::ambiguous : Error::not_ready;
  if (name.starts_with(kOfOutputs))
    name.remove_prefix(kOfOutputs.size());
  const LineData& data = *line_.core_->find(line_.gateway_, line_.line_).line;
  const Area& area = data.area(image::Direction::outputs);
  const auto found = area.entries.find(std::string(name));
  if (found == area.entries.end())
    return Error::no_name;
  number = found->second;
  entry = &area.layout->entries[number];
  layout_id = area.layout->id;
  return Error::none;
}

Answer<Delivery> Commands::write_output(std::string_view name, const Data& value, bool raw,
                                        const CallOptions& options) const {
  const image::Entry* entry = nullptr;
  line::SingleOutput output;
  std::uint64_t layout_id = 0;
  Error failed = find_output(name, entry, output.entry, layout_id);
  if (failed == Error::none)
    failed = raw ? encode(value, entry->type, entry->bit_length, output.data)
                 : encode_scaled(value, *entry, output.data);
  if (failed != Error::none)
    return Answer<Delivery>(line_.refused(std::string(describe(failed))));
  Request request = request_of(std::move(output));
  request.layout_id = layout_id;
  return Answer<Delivery>(line_.request(std::move(request), options));
}

Answer<Bytes> Commands::read_network(unsigned network, unsigned node, unsigned index, unsigned sub,
                                     const CallOptions& options) const {
  return Answer<Bytes>(start(
      out_of_range({network_of(network), one_node(node), index_of(index), sub_of(sub)}),
      request_of(line::NetworkRead{
          .network = word_of(network), .node = byte_of(node), .address = address_of(index, sub)}),
      options));
}

Call Commands::write_network(unsigned network, unsigned node, unsigned index, unsigned sub,
                             Bytes value, const CallOptions& options) const {
  return start(out_of_range({network_of(network), one_node(node), index_of(index), sub_of(sub)}),
               request_of(line::NetworkWrite{.network = word_of(network),
                                             .node = byte_of(node),
                                             .address = address_of(index, sub),
                                             .data = std::move(value)}),
               options);
}

Answer<Bytes> Commands::read_own(unsigned index, unsigned sub, unsigned node,
                                 const CallOptions& options) const {
  return Answer<Bytes>(start(
      out_of_range({index_of(index), sub_of(sub), node_or_0(node)}),
      request_of(line::LocalRead{.node = byte_of(node), .what = address_of(index, sub)}), options));
}

Call Commands::write_own(unsigned index, unsigned sub, Bytes value, unsigned node, bool as_owner,
                         const CallOptions& options) const {
  return start(out_of_range({index_of(index), sub_of(sub), node_or_0(node)}),
               request_of(line::LocalWrite{.node = byte_of(node),
                                           .address = address_of(index, sub),
                                           .as_owner = as_owner,
                                           .data = std::move(value)}),
               options);
}

Answer<std::vector<ListedObject>> Commands::list_objects(unsigned first, unsigned last,
                                                         unsigned node,
                                                         const CallOptions& options) const {
  return Answer<std::vector<ListedObject>>(
      start(out_of_range({word_number(first, "first"), word_number(last, "last"), node_or_0(node)}),
            request_of(line::LocalRead{.node = byte_of(node),
                                       .what = line::ObjectRange{word_of(first), word_of(last)}}),
            options));
}

Call Commands::create_object(const ListedObject& object, std::optional<std::uint64_t> image_byte,
                             const CallOptions& options) const {
  constexpr auto kAccesses = static_cast<std::uint8_t>(od::Access::constant);
  line::OwnObject made{.index = object.index,
                       .in_image = image_byte.has_value(),
                       .offset = static_cast<std::uint32_t>(image_byte.value_or(0))};
  made.variable.sub = object.sub;
  made.variable.name = object.name;
  made.variable.type = static_cast<od::DataType>(object.type);
  made.variable.access = static_cast<od::Access>(object.access);
  made.variable.mappable = object.mappable;
  made.variable.store = object.stored;
  made.variable.value = object.value;
  return start(out_of_range({own_index_of(object.index),
                             {"sub", object.sub < 0xFF, "0..254"},
                             {"access", object.access <= kAccesses, "0..5"},
                             text_of(object.name, "name"),
                             {"image_byte", image_byte.value_or(0) <= 0xFFFF'FFFF, "0..FFFFFFFFh"},
                             {"value", object.value.size() <= kMostSized, "0..255 bytes"}}),
               request_of(line::ObjectCreate{.what = std::move(made)}), options);
}

Call Commands::remove_object(unsigned index, const CallOptions& options) const {
  return start(out_of_range({own_index_of(index)}),
               request_of(line::ObjectCreate{.what = line::ObjectRemoval{word_of(index)}}),
               options);
}

// --- nodes ---------------------------------------------------------------------------------------

Answer<std::vector<ScannedNode>> Commands::scan(unsigned node, const CallOptions& options) const {
  return Answer<std::vector<ScannedNode>>(
      start(out_of_range({node_or_0(node)}), request_of(line::Scan{byte_of(node)}), options));
}

Answer<std::vector<ScannedNode>> Commands::apply_scan(unsigned node, bool set_up, bool restore,
                                                      const CallOptions& options) const {
  return Answer<std::vector<ScannedNode>>(start(
      out_of_range({node_or_0(node)}),
      request_of(line::ScanApply{.node = byte_of(node), .set_up = set_up, .restore = restore}),
      options));
}

Answer<std::vector<BootResult>> Commands::boot(unsigned node, const CallOptions& options) const {
  return Answer<std::vector<BootResult>>(
      start(out_of_range({node_or_0(node)}), request_of(line::Boot{byte_of(node)}), options));
}

Answer<std::vector<Configuration>> Commands::compare(unsigned node,
                                                     const CallOptions& options) const {
  return Answer<std::vector<Configuration>>(
      start(out_of_range({node_or_0(node)}), request_of(line::Configure{.node = byte_of(node)}),
            options));
}

Answer<std::vector<Configuration>> Commands::configure(unsigned node,
                                                       const CallOptions& options) const {
  return Answer<std::vector<Configuration>>(
      start(out_of_range({node_or_0(node)}),
            request_of(line::Configure{.node = byte_of(node), .apply = true}), options));
}

Answer<ProgramFault> Commands::program(unsigned node, unsigned number, Bytes program,
                                       const CallOptions& options) const {
  const bool has_size = !program.empty() && program.size() <= kLongestProgram;
  return Answer<ProgramFault>(
      start(out_of_range({one_node(node),
                          {"number", number >= 1 && number <= 0xFF, "1..255"},
                          {"program", has_size, "1 byte to 16 MiB"}}),
            request_of(line::ProgramDownload{
                .node = byte_of(node), .number = byte_of(number), .program = std::move(program)}),
            options));
}

// --- LSS -----------------------------------------------------------------------------------------

Answer<LssResult> Commands::lss_switch_global(bool configuration,
                                              const CallOptions& options) const {
  return Answer<LssResult>(line_.request(
      lss_request(lss::Procedure::switch_global, {configuration ? std::byte{1} : std::byte{0}}),
      options));
}

Answer<LssResult> Commands::lss_switch_selective(const LssAddress& address,
                                                 const CallOptions& options) const {
  return Answer<LssResult>(
      line_.request(lss_request(lss::Procedure::switch_selective, lss_bytes(address)), options));
}

Answer<LssResult> Commands::lss_set_node_id(unsigned node, bool unchecked,
                                            const CallOptions& options) const {
  std::vector<std::byte> arguments{std::byte{byte_of(node)}};
  if (unchecked)
    arguments.push_back(std::byte{1});
  const bool valid = one_node(node).valid || node == lss::kNoNodeId;
  return Answer<LssResult>(
      start(out_of_range({{"node", valid, "1..127 or 255"}}),
            lss_request(lss::Procedure::configure_node_id, std::move(arguments)), options));
}

Answer<LssResult> Commands::lss_set_bit_timing(unsigned table, unsigned index,
                                               const CallOptions& options) const {
  return Answer<LssResult>(
      start(out_of_range({byte_number(table, "table"), byte_number(index, "index")}),
            lss_request(lss::Procedure::configure_bit_timing,
                        {std::byte{byte_of(table)}, std::byte{byte_of(index)}}),
            options));
}

Answer<LssResult> Commands::lss_activate_bit_timing(std::chrono::milliseconds delay,
                                                    const CallOptions& options) const {
  const bool valid = delay.count() >= 0 && delay.count() <= 0xFFFF;
  std::vector<std::byte> arguments;
  append_number(valid ? static_cast<std::uint32_t>(delay.count()) : 0U, 2, arguments);
  return Answer<LssResult>(
      start(out_of_range({{"delay", valid, "0..65535 ms"}}),
            lss_request(lss::Procedure::activate_bit_timing, std::move(arguments)), options));
}

Answer<LssResult> Commands::lss_store(const CallOptions& options) const {
  return Answer<LssResult>(line_.request(lss_request(lss::Procedure::store), options));
}

Answer<LssResult> Commands::lss_inquire_address(const CallOptions& options) const {
  return Answer<LssResult>(line_.request(lss_request(lss::Procedure::inquire_address), options));
}

Answer<LssResult> Commands::lss_inquire_node_id(const CallOptions& options) const {
  return Answer<LssResult>(line_.request(lss_request(lss::Procedure::inquire_node_id), options));
}

Answer<LssResult> Commands::lss_identify(const LssAddress& lowest, std::uint32_t highest_revision,
                                         std::uint32_t highest_serial,
                                         const CallOptions& options) const {
  std::vector<std::byte> arguments;
  for (const std::uint32_t part : {lowest.vendor, lowest.product, lowest.revision, highest_revision,
                                   lowest.serial, highest_serial})
    append_number(part, 4, arguments);
  return Answer<LssResult>(
      line_.request(lss_request(lss::Procedure::identify, std::move(arguments)), options));
}

Answer<LssResult> Commands::lss_identify_unconfigured(const CallOptions& options) const {
  return Answer<LssResult>(
      line_.request(lss_request(lss::Procedure::identify_unconfigured), options));
}

Answer<LssResult> Commands::lss_fastscan(unsigned known, const LssAddress& address,
                                         const CallOptions& options) const {
  constexpr unsigned kAllParts = 15;
  std::vector<std::byte> arguments;
  if (known != 0) {
    arguments.push_back(std::byte{byte_of(known)});
    const std::vector<std::byte> bytes = lss_bytes(address);
    arguments.insert(arguments.end(), bytes.begin(), bytes.end());
  }
  return Answer<LssResult>(start(out_of_range({{"known", known <= kAllParts, "0..15"}}),
                                 lss_request(lss::Procedure::fastscan, std::move(arguments)),
                                 options));
}

Answer<LssResult> Commands::lss_assign_node_ids(const CallOptions& options) const {
  return Answer<LssResult>(line_.request(lss_request(lss::Procedure::assign), options));
}

// --- PDOs, EMCYs and frames ----------------------------------------------------------------------

Answer<std::vector<std::uint16_t>> Commands::trigger_pdo(unsigned number, unsigned node,
                                                         const CallOptions& options) const {
  return Answer<std::vector<std::uint16_t>>(start(
      out_of_range({node_or_0(node), node == 0 ? line_pdo(number) : device_pdo(number)}),
      request_of(line::PdoTrigger{.node = byte_of(node), .number = word_of(number)}), options));
}

Answer<std::vector<std::uint16_t>> Commands::trigger_pdos_of(std::string_view output,
                                                             const CallOptions& options) const {
  const image::Entry* entry = nullptr;
  std::uint32_t number = 0;
  std::uint64_t layout_id = 0;
  if (const Error why = find_output(output, entry, number, layout_id); why != Error::none)
    return Answer<std::vector<std::uint16_t>>(line_.refused(std::string(describe(why))));
  Request request = request_of(line::PdoTrigger{.output_byte = entry->bit_offset / 8});
  request.layout_id = layout_id;
  return Answer<std::vector<std::uint16_t>>(line_.request(std::move(request), options));
}

Call Commands::request_pdo(unsigned node, unsigned number, const CallOptions& options) const {
  return start(out_of_range({node_or_0(node), node == 0 ? line_pdo(number) : device_pdo(number)}),
               request_of(line::PdoRequest{.node = byte_of(node), .number = word_of(number)}),
               options);
}

Answer<std::uint16_t> Commands::write_mpdo(unsigned node, unsigned index, unsigned sub, Bytes value,
                                           unsigned tpdo, const CallOptions& options) const {
  const bool has_size = !value.empty() && value.size() <= kMostMpdo;
  return Answer<std::uint16_t>(start(out_of_range({node_or_0(node),
                                                   index_of(index),
                                                   sub_of(sub),
                                                   {"value", has_size, "1 to 4 bytes"},
                                                   {"tpdo", tpdo <= kMostPdos, "0..512"}}),
                                     request_of(line::MpdoWrite{.node = byte_of(node),
                                                                .address = address_of(index, sub),
                                                                .data = std::move(value),
                                                                .tpdo = word_of(tpdo)}),
                                     options));
}

Call Commands::send_emcy(unsigned code, unsigned error_register,
                         const std::array<std::byte, 5>& manufacturer, unsigned node,
                         const CallOptions& options) const {
  return start(out_of_range({word_number(code, "code"),
                             byte_number(error_register, "error_register"), node_or_0(node)}),
               request_of(line::EmcySend{.node = byte_of(node),
                                         .code = word_of(code),
                                         .error_register = byte_of(error_register),
                                         .manufacturer = manufacturer}),
               options);
}

Call Commands::send_frame(std::uint32_t identifier, const Bytes& data, bool extended, bool fd,
                          bool bit_rate_switch, const CallOptions& options) const {
  const bool has_size =
      data.size() <= can::kMaxClassicData ||
      (fd && data.size() <= can::kMaxFdData && can::fd_length(data.size()) == data.size());
  std::string why = out_of_range(
      {identifier_of(identifier, extended),
       {"data", has_size, fd ? "0..8, 12, 16, 20, 24, 32, 48 or 64 bytes" : "0..8 bytes"},
       {"bit_rate_switch", fd || !bit_rate_switch, "possible without fd"}});
  if (!why.empty())
    return line_.refused(std::move(why));
  const unsigned flags = (fd ? unsigned{can::Frame::kFd} : 0U) |
                         (bit_rate_switch ? unsigned{can::Frame::kBitRateSwitch} : 0U);
  can::Frame frame = frame_of(identifier, extended, static_cast<std::uint8_t>(flags));
  frame.length = static_cast<std::uint8_t>(data.size());
  std::ranges::copy(data, frame.data.begin());
  return line_.request(request_of(line::CanSend{frame}), options);
}

Call Commands::send_remote_frame(std::uint32_t identifier, unsigned length, bool extended,
                                 const CallOptions& options) const {
  std::string why = out_of_range(
      {identifier_of(identifier, extended), {"length", length <= can::kMaxClassicData, "0..8"}});
  if (!why.empty())
    return line_.refused(std::move(why));
  can::Frame frame = frame_of(identifier, extended, can::Frame::kRemote);
  frame.length = byte_of(length);
  return line_.request(request_of(line::CanSend{frame}), options);
}

Call Commands::listen(std::chrono::seconds seconds, std::uint32_t identifier, std::uint32_t mask,
                      std::optional<bool> extended, const CallOptions& options) const {
  const bool timely = seconds >= std::chrono::seconds(0) && seconds <= kLongestListening;
  return start(
      out_of_range({{"seconds", timely, "0..3600"},
                    identifier_of(identifier, true),
                    {"mask", mask <= line::CanListen::kAllBits, "0..1FFFFFFFh"}}),
      request_of(line::CanListen{
          .identifier = identifier, .mask = mask, .extended = extended, .duration = seconds}),
      options);
}

Call Commands::trace_routing(std::chrono::seconds seconds, const CallOptions& options) const {
  const bool timely = seconds >= std::chrono::seconds(1) && seconds <= std::chrono::hours(1);
  return start(out_of_range({{"seconds", timely, "1..3600"}}),
               request_of(line::RoutingTrace{seconds}), options);
}

// --- SDO connections, sleep ----------------------------------------------------------------------

Answer<std::vector<SdoConnection>> Commands::open_connection(unsigned client, unsigned server,
                                                             const CallOptions& options) const {
  return Answer<std::vector<SdoConnection>>(
      start(out_of_range({one_node(client, "client"), one_node(server, "server")}),
            request_of(line::ConnectionOpen{.node = byte_of(client), .server = byte_of(server)}),
            options));
}

Call Commands::close_connection(std::uint32_t number, const CallOptions& options) const {
  return line_.request(request_of(line::ConnectionClose{number}), options);
}

Answer<std::vector<SdoConnection>> Commands::connections(const CallOptions& options) const {
  return Answer<std::vector<SdoConnection>>(
      line_.request(request_of(line::ConnectionList{}), options));
}

Answer<std::vector<std::uint8_t>> Commands::check_sleep(const CallOptions& options) const {
  return Answer<std::vector<std::uint8_t>>(
      line_.request(request_of(line::SleepRequest{line::SleepAction::check}), options));
}

Answer<std::vector<std::uint8_t>> Commands::sleep(const CallOptions& options) const {
  return Answer<std::vector<std::uint8_t>>(
      line_.request(request_of(line::SleepRequest{line::SleepAction::sleep}), options));
}

Call Commands::sleep_unchecked(const CallOptions& options) const {
  return line_.request(request_of(line::SleepRequest{line::SleepAction::prepare}), options);
}

Call Commands::wake_up(const CallOptions& options) const {
  return line_.request(request_of(line::SleepRequest{line::SleepAction::wake}), options);
}

Call Commands::object_to_sleep(bool object, const CallOptions& options) const {
  const auto action = object ? line::SleepAction::object : line::SleepAction::consent;
  return line_.request(request_of(line::SleepRequest{action}), options);
}

// --- the gateway ---------------------------------------------------------------------------------

Answer<std::string> Commands::versions(const CallOptions& options) const {
  return Answer<std::string>(line_.request(gateway_request_of(request::Versions{}), options));
}

Call Commands::restart_bus(const CallOptions& options) const {
  return line_.request(gateway_request_of(request::BusRestart{}), options);
}

Answer<std::string> Commands::set_bus_faults(std::string_view faults,
                                             const CallOptions& options) const {
  return Answer<std::string>(
      start(out_of_range({{"faults", faults.size() <= kMostFaults, "0..256 bytes"}}),
            gateway_request_of(request::BusFault{std::string(faults)}), options));
}

Answer<JournalPage> Commands::read_journal(const JournalQuery& query,
                                           const CallOptions& options) const {
  constexpr auto kWorst = static_cast<std::uint8_t>(EventSeverity::error);
  return Answer<JournalPage>(start(out_of_range({text_of(query.line.value_or(""), "line"),
                                                 text_of(query.text, "text"),
                                                 node_or_0(query.node.value_or(0)),
                                                 {"severity", query.severity <= kWorst, "0..2"}}),
                                   gateway_request_of(journal_request(query)), options));
}

}  // namespace linegate::client
