// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/history.h"

#include <algorithm>
#include <charconv>
#include <deque>
#include <functional>
#include <iterator>
#include <optional>
#include <ostream>
#include <set>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>

#include "bridges/console/events.h"
#include "bridges/console/history_values.h"
#include "bridges/console/lookup.h"
#include "bridges/console/tables.h"

namespace linegate::console {
namespace {

using request::JournalPage;
using request::JournalRead;
using request::JournalRecord;
using request::JournalValue;

constexpr Duration kFollowPeriod = std::chrono::milliseconds(250);
constexpr Duration kBusyPause = std::chrono::milliseconds(100);
constexpr int kMostBusy = 50;  // repetitions of a request

std::string hex(std::uint64_t value, int digits) {
  constexpr std::string_view kHexDigits = "0123456789abcdef";
  std::string out;
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4)
    out += kHexDigits[value >> static_cast<unsigned>(shift) & 0xFU];
  return out;
}

// Sets the line and the node. Returns false if the text is invalid.
bool read_node(const std::string& text, JournalRead& to) {
  const std::size_t colon = text.rfind(':');
  const std::size_t from = colon == std::string::npos ? 0 : colon + 1;
  unsigned node = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + from, end, node);
  if (error != std::errc{} || rest != end || node > 127 || colon == 0) {
    return false;
  }
  to.node = static_cast<std::uint8_t>(node);
  if (colon != std::string::npos) {
    to.line = text.substr(0, colon);
  }
  return true;
}

using HistoryItem = std::variant<JournalRecord, JournalValue>;

Instant time_of(const HistoryItem& item) {
  return std::visit([](const auto& one) { return one.time; }, item);
}

std::vector<HistoryItem> items_of(JournalPage&& page) {
  std::vector<HistoryItem> out{std::make_move_iterator(page.records.begin()),
                               std::make_move_iterator(page.records.end())};
  out.insert(out.end(), std::make_move_iterator(page.values.begin()),
             std::make_move_iterator(page.values.end()));
  return out;
}

std::string history_line(const HistoryItem& item, const std::string& gateway, bool several,
                         const HistoryOutput& output) {
  const std::string before = several ? gateway : std::string();
  if (const auto* const value = std::get_if<JournalValue>(&item)) {
    return output.csv    ? value_history_csv(*value, gateway)
           : output.json ? value_history_json(*value, gateway)
                         : value_history_text(*value, before, output.utc);
  }
  const auto& record = std::get<JournalRecord>(item);
  return output.json ? history_json(record, gateway) : history_text(record, before, output.utc);
}

// A query of a journal, page by page.
class JournalPart {
 public:
  // gateway: empty for a file.
  JournalPart(std::string gateway, std::string name, AskForPage ask, JournalRead read)
      : gateway_(std::move(gateway)),
        name_(std::move(name)),
        ask_(std::move(ask)),
        read_(std::move(read)),
        more_(true) {}

  const std::string& gateway() const { return gateway_; }
  const std::string& name() const { return name_; }
  const JournalRead& query() const { return read_; }
  bool failed() const { return failed_; }
  bool knows_entry() const { return knows_entry_; }
  std::deque<HistoryItem>& waiting() { return waiting_; }
  // Lets fetch() ask again for what is stored later.
  void resume() { more_ = true; }

  // Requests pages until events or values wait, or there are no more.
  void fetch(std::ostream& err) {
    if (more_ && newest_wanted_ != 0)
      fetch_newest(err, newest_wanted_);
    while (more_ && waiting_.size() < std::max<std::uint64_t>(look_ahead(), 1)) {
      if (auto page = next_page(err)) {
        std::ranges::move(items_of(std::move(*page)), std::back_inserter(waiting_));
        sort_values();
      }
    }
  }

  // The newest ones, of which later ones follow with fetch(). After a failure, the next fetch()
  // requests them again: without their cursor, it would begin with the oldest one.
  void fetch_newest(std::ostream& err, std::uint64_t count) {
    const JournalRead forwards = read_;
    const std::uint64_t wanted = count + std::min(look_ahead(), ~count);
    std::optional<request::JournalCursor> newest;
    read_.newest_first = true;
    while (more_ && waiting_.size() < wanted) {
      read_.most =
          static_cast<std::uint32_t>(std::min<std::uint64_t>(wanted - waiting_.size(), 1'000'000));
      auto page = next_page(err);
      if (!page) {
        break;
      }
      newest = newest ? newest : page->newest;
      std::ranges::move(items_of(std::move(*page)), std::front_inserter(waiting_));
    }
    sort_values();
    while (waiting_.size() > count) {
      waiting_.pop_front();
    }
    read_ = forwards;
    read_.cursor = newest.value_or(request::JournalCursor{});
    newest_wanted_ = newest ? 0 : count;
    more_ = false;
  }

 private:
  // The order of a journal is that of storage: a value that waited for the interval of its entry is
  // stored behind later ones of other entries. So many are compared by their times.
  std::uint64_t look_ahead() const { return read_.values ? 256 : 0; }
  void sort_values() {
    if (read_.values) {
      std::ranges::stable_sort(waiting_, std::less(), time_of);
    }
  }

  // Nothing after a failure, which is reported once.
  std::optional<JournalPage> next_page(std::ostream& err) {
    PageAnswer answer = ask_(read_);
    if (answer.is_foreign && read_.cursor != request::JournalCursor{}) {
      read_.cursor = {};
      more_ = !read_.newest_first;
      return std::nullopt;
    }
    more_ = answer.page && answer.page->more;
    if (!answer.page) {
      if (!std::exchange(failed_, true)) {
        err << printable(name_) << ": " << printable(answer.error) << '\n';
      }
      return std::nullopt;
    }
    failed_ = false;
    knows_entry_ = knows_entry_ || !answer.page->unknown_entry;
    read_.cursor = answer.page->cursor;
    return std::move(answer.page);
  }

  std::string gateway_;
  std::string name_;
  AskForPage ask_;
  JournalRead read_;
  std::deque<HistoryItem> waiting_;
  std::uint64_t newest_wanted_ = 0;  // of a fetch_newest() that failed
  bool more_;
  bool failed_ = false;
  bool knows_entry_ = false;
};

class History {
 public:
  History(const HistoryOutput& output, std::vector<JournalPart> parts)
      : output_(output), parts_(std::move(parts)) {
    several_ = std::ranges::any_of(
        parts_, [&](const auto& one) { return one.gateway() != parts_.front().gateway(); });
    if (output_.csv) {
      output_.out << kValueCsvHead << '\n';
    }
  }

  // All that are stored and were not printed.
  void print() {
    for (;;) {
      JournalPart* earliest = nullptr;
      for (JournalPart& part : parts_) {
        part.fetch(output_.err);
        if (!part.waiting().empty() &&
            (earliest == nullptr ||
             time_of(part.waiting().front()) < time_of(earliest->waiting().front()))) {
          earliest = &part;
        }
      }
      if (earliest == nullptr || !output_.out.good()) {
        break;
      }
      output_.out << history_line(earliest->waiting().front(), earliest->gateway(), several_,
                                  output_)
                  << '\n';
      earliest->waiting().pop_front();
      printed_ = true;
    }
    output_.out << std::flush;
  }

  void print_newest(std::uint64_t count) {
    std::size_t waiting = 0;
    for (JournalPart& part : parts_) {
      part.fetch_newest(output_.err, count);
      waiting += part.waiting().size();
    }
    for (; waiting > count; --waiting) {
      const auto is_later = [](JournalPart& a, JournalPart& b) {
        return !a.waiting().empty() &&
               (b.waiting().empty() || time_of(a.waiting().front()) < time_of(b.waiting().front()));
      };
      std::ranges::min_element(parts_, is_later)->waiting().pop_front();
    }
    print();
  }

  // Reports entries of which no journal has values. False if there are some.
  bool knows_all_entries() const {
    std::set<std::string> unknown;
    for (const JournalPart& part : parts_) {
      if (part.query().values && !part.failed() && !part.knows_entry()) {
        unknown.insert(part.query().text);
      }
    }
    for (const JournalPart& part : parts_) {
      if (part.knows_entry()) {
        unknown.erase(part.query().text);
      }
    }
    for (const std::string& entry : unknown) {
      output_.err << "no values " << (entry.empty() ? "" : "of \"" + printable(entry) + "\" ")
                  << "are stored: `history:` of a line names the entries\n";
    }
    return unknown.empty();
  }

  void resume() { std::ranges::for_each(parts_, &JournalPart::resume); }
  bool failed() const { return std::ranges::any_of(parts_, &JournalPart::failed); }
  bool has_printed() const { return printed_; }

 private:
  const HistoryOutput output_;
  std::vector<JournalPart> parts_;
  bool several_ = false;  // gateways
  bool printed_ = false;  // an event or a value
};

// A query for each entry.
void add_parts(const std::string& gateway, const std::string& name, const AskForPage& ask,
               const HistoryRequest& request, JournalRead read, std::vector<JournalPart>& to) {
  if (!request.values || request.entries.empty()) {
    to.emplace_back(gateway, name, ask, read);
    return;
  }
  for (const std::string& entry : request.entries) {
    read.text = entry;
    to.emplace_back(gateway, name, ask, read);
  }
}

PageAnswer page_of(const Client::Answer& answer) {
  const std::vector<std::byte>& bytes = answer.reply.bytes();
  PageAnswer out;
  if (answer.reply.ok()) {
    out.page = request::decode_page(bytes);
    out.error = "the reply is not a page of a journal";
  } else {
    out.is_foreign = answer.reply.error == line::to_error(line::Refusal::wrong_incarnation);
    out.error = bytes.empty()
                    ? answer.text
                    : std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  return out;
}

AskForPage ask_gateway(Context& context, Model& model, const std::string& gateway) {
  return [&context, &model, gateway](const JournalRead& read) {
    const LineId id{gateway, read.line.value_or("")};
    for (int busy = 0;; ++busy) {
      const Client::Answer answer = context.client.call_gateway(id, read, context.timeout, model);
      if (busy == kMostBusy || answer.reply.error != line::to_error(line::Refusal::busy)) {
        return page_of(answer);
      }
      poll(context, model, kBusyPause);
    }
  };
}

// The journals that may have such events or values. "GATEWAY/LINE" selects one.
std::vector<JournalPart> journals_of(Context& context, Model& model, const HistoryRequest& request,
                                     JournalRead read) {
  std::string only;
  if (const std::size_t slash = read.line.value_or("").find('/');
      read.line && slash != std::string::npos) {
    only = read.line->substr(0, slash);
    read.line = read.line->substr(slash + 1);
  }
  std::vector<JournalPart> out;
  for (const auto& [gateway, view] : model.gateways()) {
    if (only.empty() || gateway == only) {
      JournalRead there = read;
      // A journal has the names of lines, not their network-IDs. It may have lines that the gateway
      // does not have any more.
      if (read.line && !read.line->empty()) {
        const std::vector<const Line*> lines = model.find(gateway + '/' + *read.line);
        there.line = lines.size() == 1 ? lines.front()->id.line : *read.line;
      }
      add_parts(gateway, gateway, ask_gateway(context, model, gateway), request, there, out);
    }
  }
  return out;
}

std::string no_journal_text(const Context& context, const Model& model, const std::string& line) {
  std::string found;
  for (const auto& [name, view] : model.gateways()) {
    found += (found.empty() ? "" : ", ") + printable(name);
  }
  return found.empty() ? no_gateway_text(context)
                       : "no gateway of line '" + printable(line) + "'; gateways found: " + found;
}

// "LINE:NAME" selects the node of the only line with that name. False after an error message.
bool resolve_history_node(Context& context, Model& model, const std::string& node,
                          JournalRead& read) {
  if (history_node_name(node).empty()) {
    return true;
  }
  NodeRef ref = *parse_node(node);
  const Line* const line = find_line(context, model, ref.line);
  if (line == nullptr || !resolve_node(context, model, *line, ref)) {
    return false;
  }
  read.line = line->id.gateway + '/' + line->id.line;
  read.node = ref.node;
  return true;
}

int print_history(History& history, std::uint64_t count) {
  if (count != 0) {
    history.print_newest(count);
  } else {
    history.print();
  }
  return history.failed() || !history.knows_all_entries() ? kFailed : kDone;
}

// Why the options of values are wrong; empty if they are not.
std::string parse_values(const HistoryRequest& request, JournalRead& to) {
  constexpr std::size_t kMostEntries = 100;
  if (!request.values) {
    return request.csv ? "--csv prints values: --values" : "";
  }
  if (!request.kind.empty() || !request.severity.empty() || !request.text.empty()) {
    return "values have no kind, severity and text";
  }
  if (request.entries.size() > kMostEntries) {
    return "more than 100 entries";
  }
  const auto is_long = [](const auto& name) { return name.size() > JournalRead::kLongestText; };
  if (std::ranges::any_of(request.entries, is_long)) {
    return "the name of an entry has more than 255 bytes";
  }
  to.values = true;
  return "";
}

}  // namespace

std::string history_node_name(const std::string& node) {
  const auto ref = parse_node(node);
  return ref && !ref->line.empty() ? ref->name : "";
}

std::string parse_history(const HistoryRequest& request, Instant now, JournalRead& to) {
  const auto time = [&](const std::string& text, std::optional<Instant>& into) {
    into = text.empty() ? std::nullopt : parse_since(text, now);
    return text.empty() || into ? std::string() : "'" + printable(text) + "' is no time: " + kTimes;
  };
  if (!request.line.empty()) {
    to.line = request.line;
  }
  if (!request.node.empty() && history_node_name(request.node).empty() &&
      !read_node(request.node, to)) {
    return "'" + printable(request.node) + "' is no node: LINE:5, LINE:NAME, or 5 of each line";
  }
  for (std::size_t i = 0; i < kEventKinds && !request.kind.empty() && !to.kind; ++i) {
    const auto kind = static_cast<EventKind>(i);
    to.kind = request.kind == name(kind) ? std::optional(kind) : std::nullopt;
  }
  if (!request.kind.empty() && !to.kind) {
    return "'" + printable(request.kind) + "' is no kind of event, such as heartbeat-lost";
  }
  const auto severity = severity_named(request.severity);
  if (!severity) {
    return "severities are info, warning and error";
  }
  if (request.text.size() > JournalRead::kLongestText) {
    return "the text has more than 255 bytes";
  }
  if (const std::string wrong = parse_values(request, to); !wrong.empty()) {
    return wrong;
  }
  to.least = *severity;
  to.text = request.text;
  if (const std::string wrong = time(request.since, to.since); !wrong.empty()) {
    return wrong;
  }
  if (const std::string wrong = time(request.until, to.until); !wrong.empty()) {
    return wrong;
  }
  return to.since && to.until && *to.until <= *to.since
             ? "no time is between --since " + printable(request.since) + " and --until " +
                   printable(request.until)
             : "";
}

std::string history_text(const JournalRecord& record, const std::string& gateway, bool utc) {
  return (utc ? date_text(record.time) : local_text(record.time)) + ' ' +
         (gateway.empty() ? "" : printable(gateway) + '/') +
         (record.line.empty() ? "gateway" : printable(record.line)) + " #" +
         std::to_string(record.number) + ' ' + std::string(name(record.kind)) + ": " +
         printable(record.text);
}

std::string history_json(const JournalRecord& record, const std::string& gateway) {
  std::string data;
  for (const std::byte byte : record.data) {
    data += hex(std::to_integer<std::uint64_t>(byte), 2);
  }
  std::ranges::transform(data, data.begin(),
                         [](char c) { return c >= 'a' ? static_cast<char>(c - 'a' + 'A') : c; });
  nlohmann::ordered_json out{{"time", date_text(record.time)}};
  if (!gateway.empty()) {
    out["gateway"] = gateway;
  }
  out["clock"] = clock_name(record.clock);
  out["stream"] = hex(record.stream, 16);
  out["incarnation"] = hex(record.incarnation, 16);
  out["line"] = record.line;
  out["number"] = record.number;
  out["kind"] = name(record.kind);
  out["severity"] = name(record.severity);
  out["node"] = record.node;
  out["code"] = record.code;
  out["value"] = record.value;
  out["data"] = data;
  out["text"] = record.text;
  return out.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

int values_of(const std::string& name, const AskForPage& ask, const HistoryRequest& request,
              Instant now, const HistoryOutput& output) {
  JournalRead read;
  if (const std::string wrong = parse_history(request, now, read); !wrong.empty()) {
    output.err << wrong << '\n';
    return kUsage;
  }
  if (!history_node_name(request.node).empty()) {
    output.err << kNoNodeNames << '\n';
    return kUsage;
  }
  std::vector<JournalPart> parts;
  add_parts("", name, ask, request, read, parts);
  History history(output, std::move(parts));
  return print_history(history, request.count);
}

int history(Context& context, const HistoryRequest& request, bool follow,
            const std::function<bool()>& stopped) {
  JournalRead read;
  if (const std::string wrong = parse_history(request, utc_now(), read); !wrong.empty()) {
    context.err << wrong << '\n';
    return kUsage;
  }
  Model model;
  (void)wait_until_settled(context, model, [&] { return stopped() || !model.gateways().empty(); });
  if (!resolve_history_node(context, model, request.node, read)) {
    return kFailed;
  }
  auto journals = journals_of(context, model, request, read);
  if (journals.empty()) {
    context.err << no_journal_text(context, model, read.line.value_or("")) << '\n';
    return kFailed;
  }
  History history({.out = context.out,
                   .err = context.err,
                   .json = context.json,
                   .csv = request.csv,
                   .utc = context.utc},
                  std::move(journals));
  const int printed = print_history(history, request.count);
  if (printed == kDone && !history.has_printed() && read.line && model.find(*read.line).empty()) {
    context.err << no_line_text(context, model, *read.line) << "; nothing stored matches\n";
    return kFailed;
  }
  const int code = printed == kDone ? completeness(context, model) : printed;
  while (follow && !stopped() && context.out.good()) {
    poll(context, model, kFollowPeriod);
    history.resume();
    history.print();
  }
  return code;
}

}  // namespace linegate::console
