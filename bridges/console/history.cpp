// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/history.h"

#include <algorithm>
#include <charconv>
#include <deque>
#include <optional>
#include <ostream>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "bridges/console/events.h"
#include "bridges/console/lookup.h"
#include "bridges/console/tables.h"

namespace linegate::console {
namespace {

using request::JournalPage;
using request::JournalRead;
using request::JournalRecord;

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

std::string_view clock_name(std::uint8_t quality) {
  return quality == 2 ? "synchronised" : quality == 1 ? "free-running" : "unknown";
}

// The journal of a gateway, page by page.
class GatewayJournal {
 public:
  GatewayJournal(std::string gateway, JournalRead read)
      : gateway_(std::move(gateway)), read_(std::move(read)), more_(true) {}

  const std::string& gateway() const { return gateway_; }
  bool failed() const { return failed_; }
  std::deque<JournalRecord>& waiting() { return waiting_; }
  // Lets fetch() ask again for events that are stored later.
  void resume() { more_ = true; }

  // Requests pages until events wait, or there are no more.
  void fetch(Context& context, Model& model) {
    while (waiting_.empty() && more_) {
      auto page = next_page(context, model);
      if (page) {
        waiting_ = {std::make_move_iterator(page->records.begin()),
                    std::make_move_iterator(page->records.end())};
      }
    }
  }

  // The newest events, of which later ones follow with fetch().
  void fetch_newest(Context& context, Model& model, std::uint64_t count) {
    const JournalRead forwards = read_;
    std::optional<request::JournalCursor> newest;
    read_.newest_first = true;
    while (more_ && waiting_.size() < count) {
      read_.most =
          static_cast<std::uint32_t>(std::min<std::uint64_t>(count - waiting_.size(), 1'000'000));
      auto page = next_page(context, model);
      if (!page) {
        break;
      }
      newest = newest ? newest : page->newest;
      for (JournalRecord& record : page->records) {
        waiting_.push_front(std::move(record));
      }
    }
    read_ = forwards;
    read_.cursor = newest.value_or(request::JournalCursor{});
    more_ = false;
  }

 private:
  // Nothing after a failure, which is reported once.
  std::optional<JournalPage> next_page(Context& context, Model& model) {
    Client::Answer answer = ask(context, model);
    const bool replaced = answer.reply.error == line::to_error(line::Refusal::wrong_incarnation) &&
                          read_.cursor != request::JournalCursor{};
    if (replaced) {
      read_.cursor = {};
      more_ = !read_.newest_first;
      return std::nullopt;
    }
    auto page = answer.reply.ok() ? request::decode_page(answer.reply.bytes()) : std::nullopt;
    more_ = page && page->more;
    if (!page) {
      report(context, answer);
      return std::nullopt;
    }
    failed_ = false;
    read_.cursor = page->cursor;
    return page;
  }

  Client::Answer ask(Context& context, Model& model) {
    const LineId id{gateway_, read_.line.value_or("")};
    for (int busy = 0;; ++busy) {
      Client::Answer answer = context.client.call_gateway(id, read_, context.timeout, model);
      if (busy == kMostBusy || answer.reply.error != line::to_error(line::Refusal::busy)) {
        return answer;
      }
      poll(context, model, kBusyPause);
    }
  }

  void report(Context& context, const Client::Answer& answer) {
    if (std::exchange(failed_, true)) {
      return;
    }
    const std::vector<std::byte>& bytes = answer.reply.bytes();
    const std::string sentence(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const bool is_sentence = !answer.reply.ok() && !sentence.empty();
    context.err << printable(gateway_) << ": "
                << (is_sentence         ? printable(sentence)
                    : answer.reply.ok() ? "the reply is not a page of a journal"
                                        : answer.text)
                << '\n';
  }

  std::string gateway_;
  JournalRead read_;
  std::deque<JournalRecord> waiting_;
  bool more_;
  bool failed_ = false;
};

class History {
 public:
  History(Context& context, Model& model, std::vector<GatewayJournal> journals)
      : context_(context), model_(model), journals_(std::move(journals)) {}

  // All that are stored and were not printed.
  void print() {
    for (;;) {
      GatewayJournal* earliest = nullptr;
      for (GatewayJournal& journal : journals_) {
        journal.fetch(context_, model_);
        if (!journal.waiting().empty() &&
            (earliest == nullptr ||
             journal.waiting().front().time < earliest->waiting().front().time)) {
          earliest = &journal;
        }
      }
      if (earliest == nullptr) {
        break;
      }
      print(*earliest);
    }
    context_.out << std::flush;
  }

  void print_newest(std::uint64_t count) {
    std::size_t waiting = 0;
    for (GatewayJournal& journal : journals_) {
      journal.fetch_newest(context_, model_, count);
      waiting += journal.waiting().size();
    }
    for (; waiting > count; --waiting) {
      const auto is_later = [](GatewayJournal& a, GatewayJournal& b) {
        return !a.waiting().empty() &&
               (b.waiting().empty() || a.waiting().front().time < b.waiting().front().time);
      };
      std::ranges::min_element(journals_, is_later)->waiting().pop_front();
    }
    print();
  }

  void resume() { std::ranges::for_each(journals_, &GatewayJournal::resume); }
  bool failed() const { return std::ranges::any_of(journals_, &GatewayJournal::failed); }

 private:
  void print(GatewayJournal& journal) {
    const JournalRecord& record = journal.waiting().front();
    const std::string& gateway = journal.gateway();
    context_.out << (context_.json
                         ? history_json(record, gateway)
                         : history_text(record, journals_.size() > 1 ? gateway : "", context_.utc))
                 << '\n';
    journal.waiting().pop_front();
  }

  Context& context_;
  Model& model_;
  std::vector<GatewayJournal> journals_;
};

// The journals that may have such events. "GATEWAY/LINE" selects one.
std::vector<GatewayJournal> journals_of(const Model& model, JournalRead read) {
  std::string only;
  if (const std::size_t slash = read.line.value_or("").find('/');
      read.line && slash != std::string::npos) {
    only = read.line->substr(0, slash);
    read.line = read.line->substr(slash + 1);
  }
  std::vector<GatewayJournal> out;
  for (const auto& [gateway, view] : model.gateways()) {
    if (only.empty() || gateway == only) {
      out.emplace_back(gateway, read);
    }
  }
  return out;
}

}  // namespace

std::string parse_history(const HistoryRequest& request, Instant now, JournalRead& to) {
  const auto time = [&](const std::string& text, std::optional<Instant>& into) {
    into = text.empty() ? std::nullopt : parse_since(text, now);
    return text.empty() || into ? std::string() : "'" + printable(text) + "' is no time: " + kTimes;
  };
  if (!request.line.empty()) {
    to.line = request.line;
  }
  if (!request.node.empty() && !read_node(request.node, to)) {
    return "'" + printable(request.node) + "' is no node: LINE:5, or 5 of each line";
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
  to.least = *severity;
  to.text = request.text;
  const std::string since = time(request.since, to.since);
  return since.empty() ? time(request.until, to.until) : since;
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

int history(Context& context, const HistoryRequest& request, bool follow,
            const std::function<bool()>& stopped) {
  JournalRead read;
  if (const std::string wrong = parse_history(request, utc_now(), read); !wrong.empty()) {
    context.err << wrong << '\n';
    return kUsage;
  }
  Model model;
  (void)wait_until_settled(context, model, [&] { return stopped() || !model.gateways().empty(); });
  auto journals = journals_of(model, read);
  if (journals.empty()) {
    context.err << (model.gateways().empty() ? "no gateway was found"
                                             : "no gateway of line '" + printable(*read.line) + "'")
                << '\n';
    return kFailed;
  }
  History history(context, model, std::move(journals));
  if (request.count != 0) {
    history.print_newest(request.count);
  } else {
    history.print();
  }
  const int code = history.failed() ? kFailed : completeness(context, model);
  while (follow && !stopped() && context.out.good()) {
    poll(context, model, kFollowPeriod);
    history.resume();
    history.print();
  }
  return code;
}

}  // namespace linegate::console
