// SPDX-License-Identifier: Apache-2.0
// Inputs of lines of other gateways as values for outputs of this one (`forward:`).
//
// Invariants:
// 1. A value is written only if the newest known image of the source has it, as valid, in an entry
//    with the wanted name, data type and length, and no other scaling, of the layout that the image
//    names, of the same incarnation. After a layout that reads its ID otherwise than before, or
//    a restart of the line with the same ID, the image must certainly belong to the layout
//    (stack/image/layout_match.h), because names may change places without another ID.
// 2. A write confirms that the line of the source was heard just now: by an image, or by its state
//    if the line was not silent for longer than the time-out before, and DDS had a second since the
//    end of the last silence to repeat an image. So the value that a line had before a silence does
//    not come back after it, and the watchdog of the group limits the age of a value. DDS gives a
//    new reader the last samples of a line that stands still, too: after a silence, and after a
//    change of the rules, a line counts as heard from its second state or second image on.
// 3. The values of an output come from one publisher. Two that publish the line at the same time
//    dispute it: then nothing is written. A new one counts when the one before it was silent for
//    kHandOver.
//
// All samples are foreign. No DDS, thread or clock here.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gateway/config/plant.h"
#include "stack/base/time.h"
#include "stack/image/layout.h"
#include "stack/image/layout_match.h"
#include "stack/image/snapshot.h"
#include "stack/line/output_write.h"

namespace linegate::gateway {

// The line that a sample is of.
struct RemoteSource {
  config::RemoteLine line;
  std::uint64_t incarnation = 0;
};

class RemoteInputs {
 public:
  // An output of a line of this gateway.
  struct Rule {
    std::string line;
    std::uint64_t layout_id = 0;  // of the outputs of the line
    config::RemoteInput input;
  };

  class Sink {
   public:
    virtual ~Sink() = default;
    // A value for an output of the line. Returns false if there is no room: advance() retries.
    virtual bool write(const std::string& line, const line::OutputWrite& write) = 0;
    // No value is written, for that reason. Called once for each reason and publisher;
    // source_silent and source_invalid: once if the rule has had no value for the time-out and
    // kSilence.
    virtual void refuse(const Rule& rule, line::OutputRefusal why) = 0;
  };

  // A gateway publishes the state of each line once a second.
  static constexpr Duration kSilence = std::chrono::seconds(3);
  static constexpr Duration kHandOver = std::chrono::seconds(2);
  // Of one line: former incarnations, and foreign ones. Further ones are ignored until one of them
  // was silent for kSilence.
  static constexpr std::size_t kMostPublishers = 4;

  // sink must outlive it.
  explicit RemoteInputs(Sink& sink) : sink_(sink) {}

  // What is known of lines and rules that remain is kept.
  void set_rules(std::vector<Rule> rules);
  // The lines that the rules name.
  std::vector<config::RemoteLine> lines() const;

  // time: of the sample, by the clock of its gateway. Lines that no rule names are ignored.
  void take_state(const RemoteSource& source, std::int64_t time, Instant now);
  void take_layout(const RemoteSource& source, const image::Layout& layout, Instant now);
  void take_image(const RemoteSource& source, const image::Snapshot& image, Instant now);
  // Retries writes that found no room, and reports outputs without a value. Call it periodically.
  void advance(Instant now);

 private:
  struct Publisher {
    std::uint64_t incarnation = 0;
    Instant began{};
    Instant heard{};  // its state or an image
    // Whether a state, or an image, came since it may have stood still; or a second one
    bool had_state = false;
    bool had_image = false;
    bool is_live = false;
    Instant resumed{};  // end of its last silence
    Instant image_heard{};
    std::optional<std::int64_t> state_time{};  // of its last state
    std::optional<image::Layout> layout{};
    std::optional<image::Snapshot> image{};
    image::LayoutMatch match{};
    std::vector<line::OutputRefusal> verdicts{};  // by rule of the source, as far as reported
    bool dispute_reported = false;
  };
  struct Target {
    Rule rule;
    Instant written{};
    Instant confirmed{};
    std::uint64_t arming = 0;   // 0: nothing was written
    line::OutputValue value{};  // as it was written last
    bool waits_for_room = false;
    bool had_value = false;
    std::optional<Instant> awaited{};                          // since when the first value is
    line::OutputRefusal reported = line::OutputRefusal::none;  // why there was none
  };
  struct Source {
    std::vector<Publisher> publishers;
    std::vector<Target> targets;
  };

  Source* find(const config::RemoteLine& line);
  static bool is_same(const Rule& a, const Rule& b);
  static std::optional<line::OutputValue> value_in(const Publisher& publisher,
                                                   const config::RemoteInput& input, Instant now);
  static Duration hear(Publisher& publisher, bool Publisher::*had, Instant now);
  static void doubt(Publisher& publisher);
  static Publisher* publisher(Source& source, std::uint64_t incarnation, Instant now);
  bool speaks(Source& source, Publisher& publisher, Instant now);
  void retry(Source& source, Target& target, Instant now);
  void report_absent(const Source& source, Target& target, Instant now);
  static line::OutputRefusal why_absent(const Source& source, const Target& target, Instant now);
  void judge(Source& source, Publisher& publisher);
  void write(Target& target, const line::OutputValue& value, Instant now);
  void confirm(Target& target, const Publisher& publisher, Instant now);

  Sink& sink_;
  std::map<config::RemoteLine, Source> sources_;
};

}  // namespace linegate::gateway
