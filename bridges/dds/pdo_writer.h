// SPDX-License-Identifier: Apache-2.0
// Writes PDO updates: transient-local samples of many instances. Only the newest sample of each
// instance counts.
//
// They are transient-local although late joiners are promised nothing: Fast DDS 2.9 may deadlock
// when a reader of a reliable volatile writer leaves (issues 3468 and 5432 of Fast DDS). The writer
// keeps the newest sample of each PDO, so the sample of a PDO that has been silent for long is
// written again, like a state (state_writer.h), with 0 receptions.
//
// The writer keeps an instance for every PDO that it ever wrote. Fast DDS 2.9 releases one only if
// it is unregistered, and a reader of PDO updates, whose memory policy is dynamic, would receive
// nothing after that (idl/README.md). So a new writer replaces it before reloads that name lines or
// PDOs anew have used up the instances of the profile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <linegatePubSubTypes.h>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/held_samples.h"
#include "bridges/dds/renewed_writer.h"

namespace linegate::dds {

class PdoWriter {
 public:
  // endpoints must outlive it, and reports whether the writer could be created. renew_after:
  // samples, see RenewedWriter. partition: see Endpoints::writer_beside().
  PdoWriter(Endpoints& endpoints, std::uint64_t renew_after, const std::string& partition = {})
      : writer_(endpoints, renew_after, RenewedWriter::Keep::until_received,
                [&endpoints, partition] {
                  return endpoints.writer_beside<v1::PdoUpdatePubSubType>(partition,
                                                                          v1::TOPIC_PDO_UPDATE);
                }) {}

  // Returns false if DDS refused the sample.
  bool write(v1::PdoUpdate& sample) {
    Key key;
    if (writer_.writer() == nullptr || !type_.getKey(&sample, &key))
      return false;
    v1::PdoUpdate& held = held_.note(key, sample);
    const bool written = write(key, held);
    held.receptions(0);
    while (v1::PdoUpdate* stale = held_.pop_stale()) {
      if (type_.getKey(stale, &key))
        write(key, *stale);
    }
    return written;
  }

  // Call it when the PDOs of a line have a new layout, or the line is removed: their old values are
  // not written again. It clears the history of the writer, for all lines, until they are written
  // again.
  void forget(std::string_view line) {
    renew_before_full();
    bool any = false;
    held_.drop([&](const v1::PdoUpdate& sample) { return line == sample.line().c_str(); },
               [&](const Key&, v1::PdoUpdate&) { any = true; });
    if (!any)
      return;
    writer_.each([](auto* writer) {
      std::size_t dropped = 0;
      writer->clear_history(&dropped);
    });
  }

 private:
  using Key = eprosima::fastdds::dds::InstanceHandle_t;

  bool write(const Key& key, v1::PdoUpdate& sample) {
    auto* const writer = writer_.next([&](auto*) { instances_.clear(); });
    instances_.insert(key);
    return writer->write(&sample);
  }
  // A reload may name all present PDOs anew. The old writer is written until the new one has
  // readers, so it must have room for two reloads.
  void renew_before_full() {
    if (writer_.writer() == nullptr || instances_.size() <= held_.size())
      return;
    const int most = writer_.writer()->get_qos().resource_limits().max_instances;
    if (most > 0 && instances_.size() + 2 * held_.size() > static_cast<std::size_t>(most))
      writer_.renew();
  }

  RenewedWriter writer_;
  std::set<Key> instances_;  // of the writer in use
  KeyedType<v1::PdoUpdatePubSubType> type_;
  HeldSamples<Key, v1::PdoUpdate> held_;
};

}  // namespace linegate::dds
