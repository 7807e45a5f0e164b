// SPDX-License-Identifier: Apache-2.0
// Writes states: transient-local samples of many instances, of which each one's newest counts. An
// instance that has long been silent is written again, unchanged.
//
// Fast DDS 2.9 names in every heartbeat each sequence number that is missing between the oldest and
// the newest sample a writer keeps, and a reader goes through them one by one
// (StatefulWriter::add_gaps_for_holes_in_history_, StatefulReader::processGapMsg). With one node
// that never changes beside one that often does, every sample would cost more than the one before,
// until readers fall behind.
#pragma once

#include <cstdint>
#include <string>

#include <fastdds/dds/publisher/DataWriter.hpp>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/held_samples.h"
#include "bridges/dds/renewed_writer.h"

namespace linegate::dds {

template <class PubSubType>
class StateWriter {
 public:
  using Sample = typename PubSubType::type;

  // endpoints must outlive it, and reports whether the writer could be created. renew_after:
  // samples, see RenewedWriter.
  StateWriter(Endpoints& endpoints, const std::string& topic, std::uint64_t renew_after)
      : writer_(endpoints, renew_after, RenewedWriter::Keep::until_received,
                [&endpoints, topic] { return endpoints.writer<PubSubType>(topic); }) {}

  // False: DDS did not take it.
  bool write(Sample& sample) {
    Key key;
    if (writer_.writer() == nullptr || !type_.getKey(&sample, &key))
      return false;
    const bool written = next()->write(&held_.note(key, sample));
    while (Sample* stale = held_.take_stale())
      next()->write(stale);
    return written;
  }

  // Instances of which wanted(sample) is true end: readers are told, and nothing of them is kept.
  template <class Wanted>
  void end(Wanted wanted) {
    held_.drop(wanted, [&](const Key& key, Sample& sample) {
      writer_.each([&](auto* writer) { writer->unregister_instance(&sample, key); });
    });
  }

  eprosima::fastdds::dds::DataWriter* writer() const { return writer_.writer(); }

 private:
  using Key = eprosima::fastdds::dds::InstanceHandle_t;

  eprosima::fastdds::dds::DataWriter* next() {
    return writer_.next(
        [&](auto* writer) { held_.each([&](Sample& sample) { writer->write(&sample); }); });
  }

  RenewedWriter writer_;
  PubSubType type_;
  HeldSamples<Key, Sample> held_;
};

}  // namespace linegate::dds
