// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/generic_can.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <ostream>
#include <span>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "bridges/console/answer.h"
#include "bridges/console/json_text.h"
#include "bridges/console/lookup.h"
#include "bridges/console/one_line.h"
#include "bridges/console/table.h"
#include "bridges/console/tables.h"
#include "bridges/console/value_text.h"

namespace linegate::console {
namespace {

constexpr std::size_t kDigits = 3;          // digits of an 11-bit identifier
constexpr std::size_t kExtendedDigits = 8;  // digits of a 29-bit identifier

// A line stops listening this long after the last request.
constexpr std::chrono::seconds kListenTime{15};
constexpr Duration kListenAgain = std::chrono::seconds(5);

std::optional<std::uint32_t> digits_value(std::string_view text) {
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  return whole ? std::optional(value) : std::nullopt;
}

struct Identifier {
  std::uint32_t id = 0;
  bool extended = false;
};
std::optional<Identifier> identifier_of(std::string_view text) {
  const auto value = digits_value(text);
  if (value && text.size() == kDigits && *value <= 0x7FF) {
    return Identifier{*value, false};
  }
  if (value && text.size() == kExtendedDigits && *value <= 0x1FFF'FFFF) {
    return Identifier{*value, true};
  }
  return std::nullopt;
}

bool remote_length(std::string_view text, can::Frame& out) {
  const auto length = text.empty() ? 0 : digits_value(text);
  if (!length || *length > can::kMaxClassicData) {
    return false;
  }
  out.flags |= can::Frame::kRemote;
  out.length = static_cast<std::uint8_t>(*length);
  return true;
}

// Two digits a byte, optionally separated by dots.
bool frame_data(std::string_view text, std::size_t most, can::Frame& out) {
  while (!text.empty()) {
    const auto byte = text.size() < 2 ? std::nullopt : digits_value(text.substr(0, 2));
    if (!byte || out.length == most) {
      return false;
    }
    out.data[out.length++] = static_cast<std::byte>(*byte);
    text.remove_prefix(2);
    text.remove_prefix(text.starts_with('.') ? 1 : 0);
  }
  return true;
}

// Reassembles a frame from the events that carry its pieces.
class Assembly {
 public:
  // Returns whether the frame is complete.
  bool add(const event::CanFrame& part) {
    if (part.piece == 0) {
      frame_ = {};
      frame_.id = part.identifier;
      frame_.length = static_cast<std::uint8_t>(std::min<std::size_t>(part.length, 64));
      frame_.flags = static_cast<std::uint8_t>((part.extended ? can::Frame::kExtended : 0) |
                                               (part.remote ? can::Frame::kRemote : 0) |
                                               (part.fd ? can::Frame::kFd : 0));
      held_back_ = part.suppressed;
      have_ = 0;
    }
    const std::size_t bytes = part.bytes();
    const bool next =
        part.piece == 0 || (part.identifier == frame_.id && part.extended == frame_.extended());
    if (!next || part.piece * part.data.size() != have_ || have_ + bytes > frame_.data.size()) {
      return false;
    }
    std::copy_n(part.data.begin(), bytes, frame_.data.begin() + static_cast<std::ptrdiff_t>(have_));
    have_ += bytes;
    return frame_.remote() || have_ >= frame_.length;
  }
  const can::Frame& frame() const { return frame_; }
  std::uint32_t held_back() const { return held_back_; }

 private:
  can::Frame frame_;
  std::uint32_t held_back_ = 0;
  std::size_t have_ = 0;
};

std::string packed_data(std::span<const std::byte> bytes) {
  std::string out = to_hex(bytes);
  std::erase(out, ' ');
  return out;
}

void print_frame(Context& context, const LineId& id, const Assembly& heard, Instant time) {
  const can::Frame& frame = heard.frame();
  if (context.json) {
    const nlohmann::ordered_json out{
        {"time", date_text(time)},
        {"gateway", id.gateway},
        {"line", id.line},
        {"id", frame.id},
        {"extended", frame.extended()},
        {"remote", frame.remote()},
        {"fd", frame.fd()},
        {"length", frame.length},
        {"data", frame.remote() ? std::string() : packed_data(frame.bytes())},
        {"held_back", heard.held_back()}};
    context.out << one_line(out) << std::endl;
    return;
  }
  context.out << clock_text(time) << ' ' << printable(id.line) << ' ' << frame_text(frame);
  if (heard.held_back() != 0) {
    context.out << "  (" << heard.held_back() << " more suppressed)";
  }
  context.out << std::endl;
}

int print_frames(Context& context, Model& model, const Line& line, const line::CanListen& request,
                 std::uint64_t count, const std::function<bool()>& stopped) {
  const std::uint64_t kept = line.view->state.counters.events;
  std::uint64_t seen = model.events_seen() - model.events().size();
  std::uint64_t printed = 0;
  Assembly heard;
  auto ask_at = std::chrono::steady_clock::now();
  while (!stopped() && (count == 0 || printed < count)) {
    if (std::chrono::steady_clock::now() >= ask_at) {
      ask_at = std::chrono::steady_clock::now() + kListenAgain;
      const Client::Answer answer = ask_line(context, model, line, {.request = request});
      if (!answer.reply.ok()) {
        return print_answer(context, answer);
      }
    }
    poll(context, model, std::chrono::milliseconds(100));
    const std::uint64_t fresh =
        std::min<std::uint64_t>(model.events_seen() - seen, model.events().size());
    seen = model.events_seen();
    for (auto it = model.events().end() - static_cast<std::ptrdiff_t>(fresh);
         it != model.events().end() && (count == 0 || printed < count); ++it) {
      const EventView& event = it->view;
      const auto* const part = event.get<event::CanFrame>();
      if (it->id == line.id && part != nullptr && event.number > kept && heard.add(*part)) {
        print_frame(context, line.id, heard, event.time);
        ++printed;
      }
    }
  }
  return kDone;
}

}  // namespace

std::optional<can::Frame> parse_frame(std::string_view text) {
  constexpr std::uint8_t kNoFlags = 0;
  const std::size_t sign = text.find('#');
  if (sign == std::string_view::npos) {
    return std::nullopt;
  }
  const auto identifier = identifier_of(text.substr(0, sign));
  can::Frame out;
  out.id = identifier ? identifier->id : 0;
  out.flags = identifier && identifier->extended ? std::uint8_t{can::Frame::kExtended} : kNoFlags;
  std::string_view rest = text.substr(sign + 1);
  bool good = identifier.has_value();
  if (rest.starts_with('#')) {
    const auto flags = rest.size() < 2 ? std::nullopt : digits_value(rest.substr(1, 1));
    out.flags |= can::Frame::kFd;
    out.flags |=
        (flags.value_or(0) & 1U) != 0 ? std::uint8_t{can::Frame::kBitRateSwitch} : kNoFlags;
    good = good && flags && frame_data(rest.substr(2), can::kMaxFdData, out) &&
           can::fd_length(out.length) == out.length;
  } else if (rest.starts_with('R')) {
    good = good && remote_length(rest.substr(1), out);
  } else {
    good = good && frame_data(rest, can::kMaxClassicData, out);
  }
  return good ? std::optional(out) : std::nullopt;
}

std::string frame_text(const can::Frame& frame) {
  std::string out =
      hex_digits(frame.id, static_cast<int>(frame.extended() ? kExtendedDigits : kDigits));
  if (frame.remote()) {
    return out + "#R" + (frame.length == 0 ? "" : std::to_string(frame.length));
  }
  out += frame.fd() ? "##4" : "#";
  return out + packed_data(frame.bytes());
}

// The identifier format is compared too, unless all frames are selected.
std::optional<line::CanListen> parse_identifiers(std::string_view text) {
  const std::size_t slash = text.find('/');
  const auto identifier = identifier_of(text.substr(0, slash));
  if (!text.empty() && !identifier) {
    return std::nullopt;
  }
  line::CanListen out;
  if (!identifier) {
    out.mask = 0;
    return out;
  }
  out.identifier = identifier->id;
  out.extended = identifier->extended;
  if (slash != std::string_view::npos) {
    const auto bits = identifier_of(text.substr(slash + 1));
    if (!bits) {
      return std::nullopt;
    }
    out.mask = bits->id;
  }
  return out;
}

int send(Context& context, const std::string& line, const std::string& text) {
  const auto frame = parse_frame(text);
  if (!frame) {
    context.err << "'" << text
                << "' is no frame such as 123#1122, 00000123#11, 123#R or 123##4112233\n";
    return kUsage;
  }
  return on_line(context, line, [&](Model& model, const Line& target) {
    const Client::Answer answer =
        ask_line(context, model, target, {.request = line::CanSend{*frame}});
    return print_answer(context, answer, answer.reply.ok() ? "sent" : "");
  });
}

int listen(Context& context, const std::string& line, const std::string& filter,
           std::uint64_t count, const std::function<bool()>& stopped) {
  auto request = parse_identifiers(filter);
  if (!request) {
    context.err << "'" << filter << "' is no identifier such as 123, 00000123 or 100/700\n";
    return kUsage;
  }
  request->duration = kListenTime;
  return on_line(context, line, [&](Model& model, const Line& target) {
    return print_frames(context, model, target, *request, count, stopped);
  });
}

}  // namespace linegate::console
