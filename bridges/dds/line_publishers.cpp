// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/line_publishers.h"

#include <algorithm>

namespace linegate::dds {

ParticipantPrefix participant_of(const WriterGuid& writer) {
  ParticipantPrefix prefix{};
  std::copy_n(writer.begin(), prefix.size(), prefix.begin());
  return prefix;
}

std::string to_string(const ParticipantPrefix& participant) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string out;
  for (std::size_t i = 0; i < participant.size(); ++i) {
    if (i != 0)
      out += i % 4 == 0 ? '|' : '.';
    out += kDigits[participant[i] >> 4U];
    out += kDigits[participant[i] & 0xFU];
  }
  return out;
}

bool LinePublishers::note(const std::string& gateway, const std::string& line,
                          const WriterGuid& writer, Instant now) {
  const Line key(gateway, line);
  if (!lines_.contains(key) && lines_.size() >= kMaxLines && !make_room())
    return false;
  Publishers& known = lines_[key];
  const auto own = find(known, participant_of(writer));
  if (own != known.present.end()) {
    *own = {writer, now};  // the writer may have been replaced (RenewedWriter)
    if (own + 1 != known.present.end())
      known.disputed = true;
  } else if (known.present.size() < kMaxPublishers) {
    known.present.push_back({writer, now});
  } else {
    known.disputed = true;
  }
  return true;
}

// Removes a line that has no publisher any more. Returns false if there is none.
bool LinePublishers::make_room() {
  const auto lost =
      std::ranges::find_if(lines_, [](const auto& entry) { return entry.second.present.empty(); });
  if (lost == lines_.end())
    return false;
  lines_.erase(lost);
  return true;
}

std::vector<LinePublishers::Publisher>::iterator LinePublishers::find(
    Publishers& publishers, const ParticipantPrefix& participant) {
  return std::ranges::find(publishers.present, participant, &Publisher::participant);
}

void LinePublishers::remove(Publishers& publishers, std::vector<Publisher>::iterator publisher) {
  publishers.last = publisher->participant();
  publishers.present.erase(publisher);
  if (publishers.present.size() <= 1)
    publishers.disputed = false;
}

bool LinePublishers::forget(const std::string& gateway, const std::string& line,
                            const WriterGuid& writer) {
  const auto found = lines_.find(Line(gateway, line));
  if (found == lines_.end())
    return false;
  Publishers& known = found->second;
  const auto own = find(known, participant_of(writer));
  if (own == known.present.end())
    return false;
  remove(known, own);
  if (!known.present.empty())
    return false;
  lines_.erase(found);
  return true;
}

std::vector<LinePublishers::Line> LinePublishers::lose(const WriterGuid& writer) {
  std::vector<Line> gone;
  for (auto& [line, known] : lines_) {
    const auto own = std::ranges::find(known.present, writer, &Publisher::writer);
    if (own == known.present.end())
      continue;
    remove(known, own);
    if (known.present.empty() && !line.second.empty())
      gone.push_back(line);
  }
  return gone;
}

std::map<LinePublishers::Line, LinePublishers::Publishers>::const_iterator LinePublishers::find(
    const std::string& gateway, const std::string& line) const {
  const auto found = lines_.find(Line(gateway, line));
  return found != lines_.end() ? found : lines_.find(Line(gateway, ""));
}

LinePublishers::Right LinePublishers::right_of(const std::string& gateway, const std::string& line,
                                               const ParticipantPrefix& participant,
                                               Instant now) const {
  const auto found = find(gateway, line);
  if (found == lines_.end())
    return Right::unknown;
  const Publishers& known = found->second;
  if (known.present.empty())
    return known.last == participant ? Right::publisher : Right::foreign;
  if (std::ranges::find(known.present, participant, &Publisher::participant) ==
      known.present.end()) {
    return Right::foreign;
  }
  if (known.disputed)
    return Right::disputed;
  const bool another_present =
      std::any_of(known.present.begin(), known.present.end() - 1,
                  [&](const Publisher& it) { return now < it.heard + kSilence; });
  if (another_present)
    return Right::contested;
  return known.present.back().participant() == participant ? Right::publisher : Right::foreign;
}

LinePublishers::Right LinePublishers::right_to_publish(const std::string& gateway,
                                                       const std::string& line,
                                                       const ParticipantPrefix& participant,
                                                       Instant now) const {
  const auto found = lines_.find(Line(gateway, line));
  if (found == lines_.end() || found->second.present.empty())
    return Right::unknown;
  return right_of(gateway, line, participant, now);
}

bool LinePublishers::disputed(const std::string& gateway, const std::string& line) const {
  const auto found = find(gateway, line);
  return found != lines_.end() && found->second.disputed;
}

std::vector<ParticipantPrefix> LinePublishers::publishers(const std::string& gateway,
                                                          const std::string& line) const {
  std::vector<ParticipantPrefix> out;
  const auto found = find(gateway, line);
  if (found == lines_.end())
    return out;
  for (const Publisher& publisher : found->second.present)
    out.push_back(publisher.participant());
  return out;
}

}  // namespace linegate::dds
