// SPDX-License-Identifier: Apache-2.0
// Records which participants publish the states of each line, and of each gateway (line ""): a line
// is lost with its last publisher, and replies of other participants are not accepted.
//
// Two participants that publish the same line at the same time dispute it. A gateway that starts
// again after a kill does not: its earlier participant publishes nothing any more. So a line with a
// second publisher is contested until the earlier one is lost or silent, and it is disputed once
// the earlier one publishes again. A dispute ends when one publisher is left.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "stack/base/time.h"

namespace linegate::dds {

// The GUID of a writer (RTPS 2.3 9.3.1): prefix of its participant (12), entity (4).
using WriterGuid = std::array<std::uint8_t, 16>;
using ParticipantPrefix = std::array<std::uint8_t, 12>;

ParticipantPrefix participant_of(const WriterGuid& writer);
// As Fast DDS prints it: "01.0f.ab.cd|..."; the first 4 octets are the vendor and, usually, the
// host.
std::string to_string(const ParticipantPrefix& participant);

class LinePublishers {
 public:
  static constexpr std::size_t kMaxLines = 4'096;  // bounded: any host may publish any names
  // Of a line; the others are not recorded, and the line is disputed. Ended processes of a gateway
  // that ends again and again count until their writers are lost.
  static constexpr std::size_t kMaxPublishers = 16;
  // A gateway publishes its LineStates and its GatewayState once a second.
  static constexpr Duration kSilence = std::chrono::seconds(2);

  // A state of the line was received from that writer. Returns false if kMaxLines other lines are
  // recorded.
  bool note(const std::string& gateway, const std::string& line, const WriterGuid& writer,
            Instant now);

  // The writer disposed the line. Returns true if it was the last publisher.
  bool forget(const std::string& gateway, const std::string& line, const WriterGuid& writer);

  using Line = std::pair<std::string, std::string>;  // gateway, line
  // The writer has left, or is not alive. Returns the lines of which it was the last publisher,
  // sorted, without those with an empty name. Its participant may still answer: a writer that was
  // only late publishes again.
  std::vector<Line> lose(const WriterGuid& writer);

  enum class Right {
    unknown,    // no publisher is recorded
    publisher,  // the participant is the only publisher
    contested,  // it is one of several publishers, and which ones are present is not known yet
    disputed,   // several participants publish the line
    foreign     // another participant is the only publisher
  };
  // Whether the participant may answer for the line. For a line without a publisher, such as one
  // that the gateway does not have, the publisher of the gateway may answer. The same holds for
  // disputed() and publishers().
  Right right_of(const std::string& gateway, const std::string& line,
                 const ParticipantPrefix& participant, Instant now) const;
  bool disputed(const std::string& gateway, const std::string& line) const;
  // Whether the participant may publish other samples of the line: only while it publishes its
  // state. Right::unknown without a publisher, also if the gateway has one.
  Right right_to_publish(const std::string& gateway, const std::string& line,
                         const ParticipantPrefix& participant, Instant now) const;
  // The recorded publishers, oldest first.
  std::vector<ParticipantPrefix> publishers(const std::string& gateway,
                                            const std::string& line) const;

 private:
  struct Publisher {
    WriterGuid writer{};
    Instant heard{};
    ParticipantPrefix participant() const { return participant_of(writer); }
  };
  struct Publishers {
    std::vector<Publisher> present;  // one of each participant, oldest first
    ParticipantPrefix last{};        // the only publisher before it was lost
    bool disputed = false;
  };
  std::map<Line, Publishers>::const_iterator find(const std::string& gateway,
                                                  const std::string& line) const;
  bool make_room();
  static std::vector<Publisher>::iterator find(Publishers& publishers,
                                               const ParticipantPrefix& participant);
  static void remove(Publishers& publishers, std::vector<Publisher>::iterator publisher);

  std::map<Line, Publishers> lines_;
};

}  // namespace linegate::dds
