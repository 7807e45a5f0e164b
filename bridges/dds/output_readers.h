// SPDX-License-Identifier: Apache-2.0
// The readers of OutputWrite of a gateway.
//
// Ownership is arbitrated by the reader, before the gateway sees a sample: the strongest writer of
// a group suppresses all others, whether the gateway accepts its samples or not. With DDS-Security
// each line therefore has a reader in its own partitions, so that an identity without a right to
// the line does not match it. Without, one reader receives the samples of all lines.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include <linegate.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/inbound_reader.h"

namespace linegate::dds {

// Any thread may add and remove lines while another one takes samples.
class OutputReaders {
 public:
  // endpoints and waiting must outlive it. gateway: its name, for one reader a line; empty: one
  // reader for all lines.
  OutputReaders(Endpoints& endpoints, Waiting& waiting, std::string gateway);

  // No effect if the line is there, or there is one reader for all. Returns false if the reader
  // could not be created.
  bool add(const std::string& line);
  void remove(const std::string& line);

  // The next sample, of each reader in turn. Returns false if there is none. Callers ignore samples
  // without valid data.
  bool take(v1::OutputWrite& sample, eprosima::fastdds::dds::SampleInfo& info);
  // As InboundReader::misfit(): of the first reader that has one.
  std::uint32_t misfit();
  // As InboundReader::renew_if_full().
  void renew_if_full();

 private:
  using Reader = InboundReader<v1::OutputWritePubSubType>;

  Endpoints& endpoints_;
  Waiting& waiting_;
  const std::string gateway_;
  std::mutex mutex_;
  std::map<std::string, std::unique_ptr<Reader>> readers_;  // by line; of all lines: by ""
  std::string last_;                                        // line of the last sample
};

}  // namespace linegate::dds
