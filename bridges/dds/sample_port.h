// SPDX-License-Identifier: Apache-2.0
// The writers and readers of a gateway, without the meaning of their samples.
//
// GatewayBridge makes and interprets samples. The port writes and receives them: with the endpoints
// of this process (make_local_port), or by messages to a process that has them (remote_port.h).
//
// write() and the functions before it from one thread at a time, except CommandReply: from any.
// wait(), take() and the counters below them from one thread at a time, which may be another one.
// wake() and the last group from any thread.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <linegate.h>

#include "bridges/dds/guard/counters.h"
#include "bridges/dds/guard/stall.h"
#include "bridges/dds/message_link.h"
#include "bridges/dds/named_topic.h"
#include "bridges/dds/publisher.h"
#include "bridges/dds/values.h"
#include "stack/base/diagnostic.h"
#include "stack/image/layout.h"

namespace linegate::dds {

struct NamedReceived;

class SamplePort {
 public:
  virtual ~SamplePort() = default;

  // As in GatewayBridge; but another thread may call wait() and take() meanwhile.
  virtual bool add_line(const std::string& line) = 0;
  virtual void remove_line(const std::string& line) = 0;
  // The PDOs of the line have a new layout: their old values are not written again.
  virtual void forget_pdos(std::string_view line) = 0;

  // --- out ---------------------------------------------------------------------------------

  // Each write() returns false if the sample was not written. The gateway, the line and other keys
  // are in the samples.
  virtual bool write(v1::GatewayState& sample) = 0;
  virtual bool write(v1::LineState& sample) = 0;
  virtual bool write(v1::NodeState& sample) = 0;
  virtual bool write(v1::OutputState& sample) = 0;
  virtual bool write(v1::ImageLayout& sample) = 0;
  virtual bool write(v1::ProcessImage& sample) = 0;
  // The process of the endpoints takes the images of the line from that memory, once it has carried
  // out what was written before. Returns false if the endpoints are in this process.
  virtual bool share_images(const std::string& /*line*/, std::shared_ptr<SharedFiles> /*files*/) {
    return false;
  }
  virtual bool write(v1::PdoUpdate& sample) = 0;
  virtual bool write(v1::PdoReception& sample) = 0;
  virtual bool write(v1::Event& sample) = 0;
  // partition: of the client (reply_partition()); empty without DDS-Security.
  virtual bool write(v1::CommandReply& sample, const std::string& partition) = 0;
  // Named topics. add_named() returns false if the topic could not be created. The instances of
  // removed topics end. sample: CDR with its encapsulation.
  virtual bool add_named(const NamedTopic& topic) = 0;
  virtual void remove_named(std::span<const std::string> topics) = 0;
  virtual bool write_named(std::string_view topic, std::span<const std::byte> sample) = 0;
  // False while a sample of the topic would wait: it is better made later, with newer values.
  virtual bool accepts_named(std::string_view /*topic*/) const { return true; }
  // As in GatewayBridge.
  virtual bool has_named_readers(std::string_view /*topic*/) { return true; }
  virtual void watch_named_readers(std::function<void()> /*changed*/) {}
  // Named topics that applications write, while no thread waits or takes samples.
  // add_named_reader() returns false if the topic could not be created.
  virtual bool add_named_reader(const NamedTopic& /*topic*/) { return false; }
  virtual void remove_named_readers(std::span<const std::string> /*topics*/) {}
  // From now on LineState, ImageLayout and ProcessImage of these lines of other gateways are
  // received, those present included. Call it while no thread waits or takes samples. Returns false
  // if they cannot be received.
  virtual bool follow(const std::vector<RemoteLine>& lines) = 0;
  // False while a ProcessImage of the line would wait: it is better made later, with newer values.
  virtual bool accepts_image(std::string_view line, image::Direction direction) const = 0;
  // Number of samples that were accepted and could not be written later. From any thread.
  virtual std::uint64_t failed_later() const { return 0; }
  // Number of processes that were started for the endpoints; 0: they are in this process. From any
  // thread.
  virtual std::uint64_t process_starts() const { return 0; }
  // As in GatewayBridge.
  virtual std::int64_t next_expiry() const = 0;
  virtual bool replace_process(std::string_view /*reason*/) { return false; }

  // --- in ----------------------------------------------------------------------------------

  // Waits until samples may have arrived, wake() was called, or the timeout passed. Returns false
  // if nothing happened.
  virtual bool wait(Duration timeout) = 0;
  virtual void wake() = 0;

  enum class Taken : std::uint8_t { none, invalid, sample };  // invalid: without data
  // from: the participant that sent the sample; valid if the result is `sample`.
  virtual Taken take(v1::OutputWrite& sample, Participant& from) = 0;
  virtual Taken take(v1::CommandRequest& sample, Participant& from) = 0;
  // Of any named topic.
  virtual Taken take_named(NamedReceived& /*sample*/, Participant& /*from*/) { return Taken::none; }
  // After follow(). invalid: also a sample of another line.
  virtual Taken take_other(v1::LineState& sample) = 0;
  virtual Taken take_other(v1::ImageLayout& sample) = 0;
  virtual Taken take_other(v1::ProcessImage& sample) = 0;
  virtual void all_lines_taken() {}
  // Call it after all samples of that topic were taken.
  virtual void all_outputs_taken() = 0;
  virtual void all_commands_taken() = 0;
  virtual void all_named_taken() {}

  // Number of samples since the last call that could not be deserialized, or are of a line that
  // is followed and whose writer has not the certificate of the gateway that they name.
  virtual std::uint64_t pop_unreadable() = 0;
  // The name of the QoS policy in which a writer discovered since the last call is incompatible;
  // empty: none.
  virtual std::string_view output_misfit() = 0;
  virtual std::string_view command_misfit() = 0;
  // The same of a named topic, with its name.
  struct Misfit {
    std::string_view topic;
    std::string_view policy;
  };
  virtual Misfit named_misfit() { return {}; }

  // --- status ------------------------------------------------------------------------------

  virtual std::size_t namesakes() const = 0;
  virtual std::vector<std::string> other_gateways() const = 0;
  virtual DiscoveryCounters discovery() const = 0;
  virtual guard::Counters guard_counters() const = 0;
  // The thread of the library that has made no progress for longest: with a datagram that it
  // processes now, or, after watch_timers(), with its timers. From any thread.
  virtual guard::Stall longest_stall() const { return {}; }
  // Call it at most once, before longest_stall().
  virtual void watch_timers() {}
};

// Whether output_misfit() and command_misfit() may return that text.
bool is_policy_name(std::string_view text);

// Creates the participant with its writers and readers. Without a value, a diagnostic states the
// reason. Its destructor waits for readers as that of GatewayBridge.
Loaded<std::unique_ptr<SamplePort>> make_local_port(const GatewayOptions& options);

}  // namespace linegate::dds
