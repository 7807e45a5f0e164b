// SPDX-License-Identifier: Apache-2.0
// Writes states: transient-local samples of many instances. Only the newest sample of each instance
// counts. An instance that has been silent for long is written again, unchanged.
//
// In every heartbeat, Fast DDS 2.9 lists each sequence number that is missing between the oldest
// and the newest sample of a writer's history, and a reader processes them one by one
// (StatefulWriter::add_gaps_for_holes_in_history_, StatefulReader::processGapMsg). With one node
// that never changes and another that often does, every sample would cost more than the one before,
// until readers fall behind.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>

#include <fastdds/dds/publisher/DataWriter.hpp>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/held_samples.h"
#include "bridges/dds/keyed_type.h"
#include "bridges/dds/renewed_writer.h"

namespace linegate::dds {

template <class PubSubType>
class StateWriter {
 public:
  using Sample = typename PubSubType::type;

  // endpoints must outlive it, and reports whether the writer could be created. renew_after:
  // samples, see RenewedWriter. partition: see Endpoints::writer_beside().
  StateWriter(Endpoints& endpoints, const std::string& topic, std::uint64_t renew_after,
              const std::string& partition = {})
      : writer_(endpoints, renew_after, RenewedWriter::Keep::until_received,
                [&endpoints, topic, partition] {
                  return endpoints.writer_beside<PubSubType>(partition, topic);
                }) {}

  // Returns false if DDS refused the sample.
  bool write(Sample& sample) {
    const std::lock_guard lock(mutex_);
    Key key;
    if (writer_.writer() == nullptr || !type_.getKey(&sample, &key))
      return false;
    const bool written = next()->write(&held_.note(key, sample));
    while (Sample* stale = held_.pop_stale())
      next()->write(stale);
    return written;
  }

  // Ends the instances for which wanted(sample) is true, which readers receive, and removes their
  // samples.
  template <class Wanted>
  void end(Wanted wanted) {
    const std::lock_guard lock(mutex_);
    held_.drop(wanted, [&](const Key& key, Sample& sample) {
      writer_.each([&](auto* writer) { writer->unregister_instance(&sample, key); });
    });
  }

  // Asserts the liveliness of its writers (DDS 1.4 2.2.3.11, manual by topic), from any thread. Has
  // no effect while a sample is written, which asserts it.
  void assert_liveliness() {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (lock)
      writer_.each([](auto* writer) { writer->assert_liveliness(); });
  }

  eprosima::fastdds::dds::DataWriter* writer() const { return writer_.writer(); }

 private:
  using Key = eprosima::fastdds::dds::InstanceHandle_t;

  eprosima::fastdds::dds::DataWriter* next() {
    return writer_.next(
        [&](auto* writer) { held_.each([&](Sample& sample) { writer->write(&sample); }); });
  }

  std::mutex mutex_;
  RenewedWriter writer_;
  KeyedType<PubSubType> type_;
  HeldSamples<Key, Sample> held_;
};

}  // namespace linegate::dds
